"""What the bird's eye view of a frame of a replay shows: the outline, the swept path and the threats."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast.brake import Command
from ttc_fast.plotting.birds_eye import View, placed, seen_by, view_of_body
from ttc_fast.replay.pipelines import Distances, Scans

if TYPE_CHECKING:
    from ttc_fast.replay.row import Row
    from ttc_fast.replay.run import Replay

CAR_WIDTH, CAR_LENGTH = 1.8, 4.2
"""The size of the vehicle where only its bumper is known, m."""


def has_view(replay: Replay) -> bool:
    """Return whether the frames of a replay can be seen from above; those of a table of distances cannot."""
    return not isinstance(replay.pipeline, Distances)


def view_of(replay: Replay, row: Row, frame: Any) -> View:
    """Return the view of a frame of scans or clouds with its row."""
    scans, outline = isinstance(replay.pipeline, Scans), replay.pipeline.outline
    on_path = scans or row.beam >= 0
    view = (_scan if scans else _cloud)(replay, row, frame)
    return view._replace(
        title=_title(replay, row),
        threats=f"contact within {replay.threshold:g} s" if on_path else "what the tracker follows",
        decides="nearest in time" if row.beam >= 0 else "distance",
        sensor=replay.pipeline.mount[:2],
        vehicle=_vehicle(replay) if outline is None else outline,
        path=None if outline is None else (row.speed, getattr(frame, "yaw_rate", 0.0), replay.threshold),
    )


def _title(replay: Replay, row: Row) -> str:
    what = f"{row.command.name} ({row.reason.name})"
    if not replay.braked and row.command is not Command.BRAKE:
        what = "least TTC" if math.isfinite(row.ttc) else "the TTC is infinite in all frames"
    if not math.isfinite(row.ttc):
        return f"frame {row.frame}, t = {row.stamp:.2f} s\n{what}"
    collision = f"{row.ttc:.2f} s to collision, {row.distance:.2f} m, closing at {row.closing_speed:.2f} m/s"
    return f"frame {row.frame}, t = {row.stamp:.2f} s: {what}\n{collision}"


def _vehicle(replay: Replay) -> tuple[float, float, float, float] | None:
    """Return the vehicle as far as its bumper tells where it is, if that is known."""
    x, y, _ = replay.pipeline.mount
    offset = 0.0 if isinstance(replay.pipeline, Scans) else replay.pipeline.lidar.front_offset
    if offset <= 0.0:
        return None
    return (x + offset - CAR_LENGTH, x + offset, y - CAR_WIDTH / 2, y + CAR_WIDTH / 2)


def _scan(replay: Replay, row: Row, frame: Any) -> View:
    """Return the readings as points, which of them have a TTC below the threshold, and the nearest in time."""
    scan = replay.pipeline.scan_of(frame)
    speed = 0.0 if frame.speed is None else frame.speed
    points, seen, threatening = seen_by(scan, frame.ranges, speed, frame.yaw_rate, replay.threshold)
    at = None
    if row.beam >= 0:
        threatening[row.beam] |= row.ttc < replay.threshold  # the range rate tells it where there is no speed
        x, y = placed(replay.pipeline.mount, np.array([row.angle]), np.array([row.range]))[0]
        at = float(x), float(y)
    return View("", points, threatening[seen], "", at, "")


def _cloud(replay: Replay, row: Row, frame: Any) -> View:
    """Return the points at the heights of the gate, which of them are threatening, and where the distance ends."""
    pipeline = replay.pipeline
    points = pipeline.obstacles(frame.points)
    (near, far), (right, left), (x, y, _) = pipeline.gate.x, pipeline.gate.y, pipeline.mount
    lane = (near + x, far + x, right + y, left + y)
    if row.beam < 0:
        return view_of_body("", points, lane, x + row.distance + pipeline.lidar.front_offset)
    threatening = pipeline.path.per_point(points, frame.speed, frame.yaw_rate) < replay.threshold
    at = float(points[row.beam, 0]), float(points[row.beam, 1])
    return view_of_body("", points, lane, at[0])._replace(threatening=threatening, at=at)
