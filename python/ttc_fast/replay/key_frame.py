"""What the bird's eye view of a frame of a replay shows: the outline, the swept path and the threats."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from ttc_fast.brake import Command
from ttc_fast.plotting.birds_eye import View, collision, view_of_body, view_of_scan
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
    if not isinstance(replay.pipeline, Scans):
        return _cloud(replay, row, frame)
    motion = (0.0 if frame.speed is None else frame.speed, frame.yaw_rate)
    nearest = row.beam, row.angle, row.range, row.ttc
    scan = replay.pipeline.scan_of(frame)
    return view_of_scan(_title(replay, row), scan, frame.ranges, motion, replay.threshold, nearest)


def _title(replay: Replay, row: Row) -> str:
    what = f"{row.command.name} ({row.reason.name})"
    if not replay.braked and row.command is not Command.BRAKE:
        what = "least TTC" if math.isfinite(row.ttc) else "the TTC is infinite in all frames"
    if not math.isfinite(row.ttc):
        return f"frame {row.frame}, t = {row.stamp:.2f} s\n{what}"
    hit = collision(row.ttc, row.distance, row.closing_speed)
    return f"frame {row.frame}, t = {row.stamp:.2f} s: {what}\n{hit}"


def _cloud(replay: Replay, row: Row, frame: Any) -> View:
    """Return the points at the heights of the gate, which of them are threatening, and where the distance ends."""
    pipeline, outline = replay.pipeline, replay.pipeline.outline
    points = pipeline.obstacles(frame.points)
    (near, far), (right, left), (x, y, _) = pipeline.gate.x, pipeline.gate.y, pipeline.mount
    lane, offset = (near + x, far + x, right + y, left + y), pipeline.lidar.front_offset
    at = (float(points[row.beam, 0]), float(points[row.beam, 1])) if row.beam >= 0 else None
    ahead = x + row.distance + offset if at is None else at[0]
    view = view_of_body(_title(replay, row), points, lane, ahead)._replace(sensor=(x, y), vehicle=outline)
    if outline is not None:
        view = view._replace(path=(row.speed, frame.yaw_rate, replay.threshold))
    elif offset > 0.0:  # as far as the bumper tells where the vehicle is
        front = x + offset
        view = view._replace(vehicle=(front - CAR_LENGTH, front, y - CAR_WIDTH / 2, y + CAR_WIDTH / 2))
    if at is None:
        return view._replace(threats="what the tracker follows")
    threatening = pipeline.path.per_point(points, frame.speed, frame.yaw_rate) < replay.threshold
    within = f"contact within {replay.threshold:g} s"
    return view._replace(threatening=threatening, at=at, threats=within, decides="nearest in time")
