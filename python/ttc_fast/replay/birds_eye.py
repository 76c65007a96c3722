"""A bird's eye view of the key frame: ahead is up, and left is left."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import Polygon, Rectangle

from ttc_fast._core import ScanSweptPath
from ttc_fast.replay.pipelines import Scans
from ttc_fast.replay.style import ALARM, CAUTION, INK, LINE, PALE, QUIET, legend_below, quieten, title_of
from ttc_fast.status import Status

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from ttc_fast.replay.row import Row
    from ttc_fast.replay.run import Replay

CLOSEST_VIEW, FARTHEST_VIEW = 2.5, 60.0
"""The view reaches at least and at most this far, m."""
BODY_DEPTH = 0.5
"""Points within this of the distance that a tracker gives belong to the body that it follows, m."""
STRAY = 0.1
"""Points of the gate that are nearer than the body by more than this are drawn as strays, m."""
CAR_WIDTH, CAR_LENGTH = 1.8, 4.2
"""The size of the vehicle where only its bumper is known, m."""
STEPS = 120

Seen = tuple["NDArray[Any]", "NDArray[np.bool_]", "tuple[float, float] | None"]


def draw_birds_eye(axes: Axes, replay: Replay) -> None:
    """Draw the key frame with the outline, the swept path and the threatening points."""
    assert replay.key_frame is not None
    row, frame = replay.key_frame
    scans = isinstance(replay.pipeline, Scans)
    points, threatening, at = (_scan if scans else _cloud)(replay, row, frame)
    _frame(axes, replay, at)
    outline = replay.pipeline.outline
    if outline is not None:
        _draw_path(axes, outline, row, getattr(frame, "yaw_rate", 0.0), replay.threshold)
    elif not scans:
        _draw_gate(axes, replay.pipeline.gate, replay.pipeline.mount)
    axes.plot(points[~threatening, 1], points[~threatening, 0], ".", color=QUIET, ms=3, mew=0)
    if threatening.any():
        path = scans or row.beam >= 0
        label = f"contact within {replay.threshold:g} s" if path else "what the tracker follows"
        axes.plot(points[threatening, 1], points[threatening, 0], ".", color=ALARM, ms=6, mew=0, label=label, zorder=3)
    if not scans and at is not None:
        _draw_strays(axes, replay, points, at[0])
    if at is not None:
        label = "nearest in time" if row.beam >= 0 else "distance"
        axes.plot(at[1], at[0], "o", mfc="none", mec=INK, mew=1.8, ms=12, zorder=4, ls="none", label=label)
    _draw_vehicle(axes, replay)
    legend_below(axes)
    quieten(axes)
    title_of(axes, _title(replay, row))


def _title(replay: Replay, row: Row) -> str:
    what = f"{row.command.name} ({row.reason.name})"
    if not replay.braked:
        what = "least TTC" if math.isfinite(row.ttc) else "nothing closes in any frame"
    if not math.isfinite(row.ttc):
        return f"frame {row.frame}, t = {row.stamp:.2f} s\n{what}"
    collision = f"{row.ttc:.2f} s to collision, {row.distance:.2f} m, closing at {row.closing_speed:.2f} m/s"
    return f"frame {row.frame}, t = {row.stamp:.2f} s: {what}\n{collision}"


def _frame(axes: Axes, replay: Replay, at: tuple[float, float] | None) -> None:
    """Set the limits of the view: the vehicle, what is nearest in time, and a little around both."""
    x, y = (FARTHEST_VIEW / 6, 0.0) if at is None else at
    low = min(replay.pipeline.outline[0] if replay.pipeline.outline else -1.0, x, 0.0)
    high = max(x, 0.0)
    size = min(max(1.35 * max(high - low, 2.0 * abs(y)), CLOSEST_VIEW), 2.0 * FARTHEST_VIEW)
    middle = (low + high) / 2.0
    axes.set(xlim=(size / 2, -size / 2), ylim=(middle - size / 2, middle + size / 2), xlabel="y, m", ylabel="x, m")
    axes.set_aspect("equal")


def _draw_vehicle(axes: Axes, replay: Replay) -> None:
    """Draw the sensor, and the vehicle as far as it is known."""
    x, y, _ = replay.pipeline.mount
    outline = replay.pipeline.outline
    offset = 0.0 if isinstance(replay.pipeline, Scans) else replay.pipeline.lidar.front_offset
    if outline is None and offset > 0.0:
        outline = (x + offset - CAR_LENGTH, x + offset, y - CAR_WIDTH / 2, y + CAR_WIDTH / 2)
    if outline is not None:
        rear, front, right, left = outline
        size = (left - right, front - rear)
        axes.add_patch(Rectangle((right, rear), *size, facecolor=LINE, edgecolor=INK, alpha=0.85, lw=1, zorder=2))
    axes.plot(y, x, "o", color="white", mec=INK, ms=4, ls="none", zorder=5, label="sensor")


def _scan(replay: Replay, row: Row, frame: Any) -> Seen:
    """Return the readings as points, which of them have a TTC below the threshold, and the nearest in time."""
    scan = replay.pipeline.scan_of(frame)
    speed = 0.0 if frame.speed is None else frame.speed
    kernel = scan if replay.pipeline.outline is None else ScanSweptPath(scan)
    ttc = kernel.per_beam(frame.ranges, speed, frame.yaw_rate)
    status = np.empty(scan.beams, np.uint8)
    scan.per_beam(frame.ranges, speed, frame.yaw_rate, status_out=status)
    ranges = np.asarray(frame.ranges, float)
    seen = np.isfinite(ranges) & np.isin(status, (Status.NOT_CLOSING, Status.CLOSING, Status.CONTACT))
    threatening = ttc < replay.threshold
    at = None
    if row.beam >= 0:
        threatening[row.beam] |= row.ttc < replay.threshold  # the range rate tells it where there is no speed
        (x,), (y,) = _placed(replay.pipeline.mount, np.array([row.angle]), np.array([row.range]))
        at = float(x), float(y)
    return np.column_stack(_placed(replay.pipeline.mount, scan.angles[seen], ranges[seen])), threatening[seen], at


def _placed(mount: Any, angles: NDArray[Any], ranges: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    x, y, yaw = mount
    return x + ranges * np.cos(angles + yaw), y + ranges * np.sin(angles + yaw)


def _cloud(replay: Replay, row: Row, frame: Any) -> Seen:
    """Return the points at the heights of the gate, which of them are threatening, and where the distance ends."""
    pipeline = replay.pipeline
    points = pipeline.obstacles(frame.points)
    if row.beam >= 0:
        threatening = pipeline.path.per_point(points, frame.speed, frame.yaw_rate) < replay.threshold
        return points, threatening, (float(points[row.beam, 0]), float(points[row.beam, 1]))
    threatening = np.zeros(len(points), bool)
    if not math.isfinite(row.distance):
        return points, threatening, None
    x = pipeline.mount[0] + row.distance + pipeline.lidar.front_offset
    lane = _in_lane(pipeline, points)
    threatening = (np.abs(points[:, 0] - x) < BODY_DEPTH) & lane
    return (
        points,
        threatening,
        (x, float(points[threatening, 1].mean()) if threatening.any() else sum(pipeline.gate.y) / 2),
    )


def _in_lane(pipeline: Any, points: NDArray[Any]) -> NDArray[np.bool_]:
    right, left = pipeline.gate.y
    lane: NDArray[np.bool_] = (points[:, 1] >= right + pipeline.mount[1]) & (points[:, 1] <= left + pipeline.mount[1])
    return lane


def _draw_strays(axes: Axes, replay: Replay, points: NDArray[Any], x: float) -> None:
    """Mark the points in the lane that are nearer than ``x``: a plain minimum would have taken them."""
    pipeline = replay.pipeline
    near = (points[:, 0] < x - STRAY - BODY_DEPTH) & (points[:, 0] >= pipeline.mount[0] + pipeline.gate.x[0])
    stray = points[near & _in_lane(pipeline, points)]
    if len(stray):
        axes.plot(stray[:, 1], stray[:, 0], "x", color=CAUTION, ms=6, mew=1.6, ls="none", zorder=3, label="stray point")


def _draw_gate(axes: Axes, gate: Any, mount: Any) -> None:
    """Tint the lane in which points count."""
    near, far = gate.x
    length = min(far, 10.0 * FARTHEST_VIEW) - near
    corner, width = (gate.y[0] + mount[1], near + mount[0]), gate.y[1] - gate.y[0]
    axes.add_patch(Rectangle(corner, width, length, color=PALE, alpha=0.6, lw=0, zorder=0, label="gate"))


def _draw_path(axes: Axes, outline: Any, row: Row, yaw_rate: float, ahead: float) -> None:
    """Draw where the outline will be within the threshold if the vehicle goes on as it does."""
    if not math.isfinite(row.speed) or row.speed == 0.0:
        return
    rear, front, right, left = outline
    corners = np.array([(rear, right), (front, right), (front, left), (rear, left)])
    for t in np.linspace(ahead, 0.0, STEPS):
        turn = yaw_rate * t
        along = row.speed * t
        half = turn / 2.0
        way = along * (math.sin(half) / half if half else 1.0)
        middle = (way * math.cos(half), way * math.sin(half))
        x = middle[0] + corners[:, 0] * math.cos(turn) - corners[:, 1] * math.sin(turn)
        y = middle[1] + corners[:, 0] * math.sin(turn) + corners[:, 1] * math.cos(turn)
        axes.add_patch(Polygon(np.column_stack([y, x]), closed=True, color=PALE, lw=0, zorder=1))
    path = Rectangle((0.0, 0.0), 0.0, 0.0, color=PALE, lw=0, label=f"its path in {ahead:g} s")
    axes.add_patch(path)
