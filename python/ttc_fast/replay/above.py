"""The frame that decided, from above: ahead is up, left is left."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import Polygon, Rectangle

from ttc_fast._core import ScanSweptPath
from ttc_fast.demo.picture import ALARM, INK, LINE, QUIET, quieten, title_of
from ttc_fast.replay.scans import Scans
from ttc_fast.status import Status

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from ttc_fast.replay.row import Row
    from ttc_fast.replay.run import Replay

CLOSEST_VIEW, FARTHEST_VIEW = 2.5, 30.0
"""m to each side that are shown at least and at most."""
GUILTY = 0.5
"""m around the distance that a tracker gives: those points are of the body that it follows."""
STEPS = 40


def draw_above(axes: Axes, replay: Replay) -> None:
    """Draw the frame with outline, swept path, and the points that are to blame."""
    assert replay.moment is not None
    row, frame = replay.moment
    scans = isinstance(replay.eyes, Scans)
    points, guilty, at = (_scan if scans else _cloud)(replay, row, frame)
    reach = max(0.0 if at is None else 1.25 * math.hypot(*at) + 0.5, CLOSEST_VIEW)
    reach = min(reach, FARTHEST_VIEW) if at is not None else FARTHEST_VIEW / 3
    middle = 0.3 * reach
    axes.set(xlim=(reach, -reach), ylim=(middle - reach, middle + reach), xlabel="y, m", ylabel="x, m")
    axes.set_aspect("equal")
    outline = replay.eyes.outline
    if outline is not None:
        _draw_path(axes, outline, row, getattr(frame, "yaw_rate", 0.0), replay.threshold)
    axes.plot(points[~guilty, 1], points[~guilty, 0], ".", color=QUIET, ms=3, mew=0)
    if guilty.any():
        label = f"contact within {replay.threshold:g} s" if scans else "decides"
        axes.plot(points[guilty, 1], points[guilty, 0], ".", color=ALARM, ms=6, mew=0, label=label, zorder=3)
    if at is not None:
        axes.plot(at[1], at[0], "o", mfc="none", mec=INK, mew=1.8, ms=12, zorder=4, label="nearest in time")
    if outline is not None:
        rear, front, right, left = outline
        size = (left - right, front - rear)
        axes.add_patch(Rectangle((right, rear), *size, facecolor=LINE, edgecolor=INK, alpha=0.85, lw=1, zorder=2))
    mount = getattr(replay.eyes, "mount", (0.0, 0.0, 0.0))
    axes.plot(mount[1], mount[0], "o", color="white", mec=INK, ms=4, ls="none", zorder=5, label="sensor")
    axes.legend(loc="lower right", frameon=False, fontsize=8.5, labelcolor=INK)
    quieten(axes)
    what = f"{row.command.name} ({row.reason.name})" if replay.braked else "least TTC"
    told = f"{row.ttc:.2f} s to collision, {row.distance:.2f} m, closing at {row.closing_speed:.2f} m/s"
    title_of(axes, f"frame {row.frame}, t = {row.stamp:.2f} s: {what}\n{told}")


Seen = tuple["NDArray[Any]", "NDArray[np.bool_]", "tuple[float, float] | None"]


def _scan(replay: Replay, row: Row, frame: Any) -> Seen:
    """Return the readings as points, those with a TTC below the threshold, and the one that decided."""
    scan = replay.eyes.scan
    speed = 0.0 if frame.speed is None else frame.speed
    judged = scan if replay.eyes.outline is None else ScanSweptPath(scan)
    ttc = judged.per_beam(frame.ranges, speed, frame.yaw_rate)
    status = np.empty(scan.beams, np.uint8)
    scan.per_beam(frame.ranges, speed, frame.yaw_rate, status_out=status)
    ranges = np.asarray(frame.ranges, float)
    seen = np.isfinite(ranges) & np.isin(status, (Status.NOT_CLOSING, Status.CLOSING, Status.CONTACT))
    guilty = ttc < replay.threshold
    at = None
    if row.beam >= 0:
        guilty[row.beam] |= row.ttc < replay.threshold  # the range rate tells it where there is no speed
        (x,), (y,) = _placed(replay.eyes.mount, np.array([row.angle]), np.array([row.range]))
        at = float(x), float(y)
    return np.column_stack(_placed(replay.eyes.mount, scan.angles[seen], ranges[seen])), guilty[seen], at


def _placed(mount: Any, angles: NDArray[Any], ranges: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    x, y, yaw = mount
    return x + ranges * np.cos(angles + yaw), y + ranges * np.sin(angles + yaw)


def _cloud(replay: Replay, row: Row, frame: Any) -> Seen:
    """Return the points at the heights that count, and those of the gate at the distance that decided."""
    eyes = replay.eyes
    points = eyes.obstacles(frame.points)
    if row.beam >= 0:
        guilty = eyes.path.per_point(points, frame.speed, frame.yaw_rate) < replay.threshold
        return points, guilty, (float(points[row.beam, 0]), float(points[row.beam, 1]))
    guilty = np.zeros(len(points), bool)
    if not math.isfinite(row.distance):
        return points, guilty, None
    x, (right, left) = eyes.mount[0] + row.distance + eyes.lidar.front_offset, eyes.gate.y
    guilty = (abs(points[:, 0] - x) < GUILTY) & (points[:, 1] >= right) & (points[:, 1] <= left)
    return points, guilty, (x, float(points[guilty, 1].mean()) if guilty.any() else (right + left) / 2)


def _draw_path(axes: Axes, outline: Any, row: Row, yaw_rate: float, ahead: float) -> None:
    """Draw where the outline will be within the threshold, if it goes on as it does."""
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
        axes.add_patch(Polygon(np.column_stack([y, x]), closed=True, color=LINE, alpha=0.05, lw=0, zorder=1))
