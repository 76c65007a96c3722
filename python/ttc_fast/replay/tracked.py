"""Clouds and distances: a tracker follows what is ahead, and the brake judges what it estimates."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ttc_fast._core import CloudTracker, DistanceTracker, Minimum, SweptPath, robust_min_x
from ttc_fast.brake import Estimate, Motion
from ttc_fast.configuration import ConfigurationError
from ttc_fast.logs import forward_left_up
from ttc_fast.replay.controller import ReplayController, motion_of
from ttc_fast.replay.row import Row
from ttc_fast.replay.settings import GATE_OPTIONS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ttc_fast._core import Gate, TrackedTTC
    from ttc_fast.brake import Decision
    from ttc_fast.brake.scene import Threats
    from ttc_fast.logs import CloudFrame, CloudLog, DistanceFrame, DistanceLog, Lidar
    from ttc_fast.replay.settings import Settings

UNSEEN = (math.nan, math.nan)


class Clouds:
    """Frames of a log of clouds to rows.

    Parameters
    ----------
    log : CloudLog
        Of the frames.
    settings : Settings
        Of gate and brake.

    Raises
    ------
    ConfigurationError
        If a setting makes no sense.
    """

    name: ClassVar[str] = "a log of clouds"
    uses: ClassVar[tuple[str, ...]] = ("mount", "outline", *GATE_OPTIONS)
    rated = False

    def __init__(self, log: CloudLog, settings: Settings) -> None:
        self._settings, self._configuration = settings, settings.configured()
        scanner = settings.of_scanner
        self.outline, self.mount = scanner.get("outline"), tuple(scanner.get("mount", (0.0, 0.0, 0.0)))
        self.lidar = _with_bumper(log.lidar, self.outline, self.mount)
        self.gate = settings.gate_of(self.lidar)
        self.about = [("gate", _bounds(self.gate)), ("distance", _start(self.lidar.front_offset))]
        self.path: SweptPath | None = None
        self._restart()

    def _restart(self) -> None:
        self._tracker = CloudTracker(self.gate, front_offset=self.lidar.front_offset)
        self.controller = ReplayController(
            self._configuration,
            self._settings.sensor_timeout,
            path=self.path,
            sees_path=self.path is not None,
        )

    def begin(self, frame: CloudFrame) -> None:
        """Look at the first frame: with an outline and a speed, the points on the path are judged as well."""
        if self.outline is None or frame.speed is None:
            return
        try:
            self.path = SweptPath(self.outline)
        except (ValueError, TypeError) as error:
            raise ConfigurationError(f"outline: {error}") from None
        self._restart()

    def row(self, number: int, frame: CloudFrame) -> Row:
        """Put a frame through the brake."""
        stamp = frame.stamp
        if self.controller.is_reset(stamp):
            self._tracker = CloudTracker(self.gate, front_offset=self.lidar.front_offset)
        tracked = self._tracker.update(frame.points, stamp)
        data: dict[str, Any] = {"estimate": Estimate.of(tracked, stamp)}
        if self.path is not None:
            data |= {"points": self.obstacles(frame.points), "stamp": stamp}
        decision, threats, _ = self.controller.decide(stamp, motion_of(frame), **data)
        plain = robust_min_x(frame.points, gate=self.gate, estimator=Minimum())
        nearest = max(plain.nearest_x - self.lidar.front_offset, 0.0)
        row = row_of(number, stamp, tracked, frame.speed, decision, threats)
        return row._replace(valid=plain.candidates, nearest=nearest)

    def obstacles(self, points: NDArray[Any]) -> NDArray[Any]:
        """Return the points at the heights of the gate, in the vehicle frame, without the vehicle's own before it."""
        points = forward_left_up(points, self.gate.axes)[:, :3]
        (near, _), (right, left), heights = self.gate.x, self.gate.y, self.gate.z
        counts = ~((points[:, 0] >= 0.0) & (points[:, 0] < near) & (points[:, 1] >= right) & (points[:, 1] <= left))
        if heights is not None:
            counts &= (points[:, 2] >= heights[0]) & (points[:, 2] <= heights[1])
        counts &= points.any(axis=1)  # moved, what is stored where nothing came back would be a return
        points = points[counts]
        x, y, yaw = self.mount
        if (x, y, yaw) == (0.0, 0.0, 0.0):
            return np.ascontiguousarray(points)
        cos, sin = math.cos(yaw), math.sin(yaw)
        turned = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]], points.dtype)
        moved: NDArray[Any] = points @ turned + np.array([x, y, 0.0], points.dtype)
        return moved


class Distances:
    """Frames of a log of distances to rows.

    Parameters
    ----------
    log : DistanceLog
        Of the frames.
    settings : Settings
        Of the brake.
    """

    name: ClassVar[str] = "a table of distances"
    uses: ClassVar[tuple[str, ...]] = ()
    outline = None
    rated = False

    def __init__(self, log: DistanceLog, settings: Settings) -> None:
        self.about = [("distance", f"column {log.column}")]
        self._tracker = DistanceTracker()
        self.controller = ReplayController(settings.configured(), settings.sensor_timeout)

    def begin(self, frame: DistanceFrame) -> None:
        """Nothing is to be decided by the first frame."""

    def row(self, number: int, frame: DistanceFrame) -> Row:
        """Put a frame through the brake."""
        if self.controller.is_reset(frame.stamp):
            self._tracker = DistanceTracker()
        tracked = self._tracker.update(frame.distance, frame.stamp)
        motion = None if frame.speed is None else Motion(frame.speed)
        decision, threats, _ = self.controller.decide(frame.stamp, motion, estimate=Estimate.of(tracked, frame.stamp))
        return row_of(number, frame.stamp, tracked, frame.speed, decision, threats)


def _with_bumper(lidar: Lidar, outline: Any, mount: Any) -> Lidar:
    """Say how far the bumper is from the lidar, where only the outline tells."""
    if lidar.front_offset or outline is None:
        return lidar
    offset = max(outline[1] - mount[0], 0.0)
    return replace(lidar, front_offset=offset, own_reach=max(lidar.own_reach, offset))


def _bounds(gate: Gate) -> str:
    """Say which points count, for people."""
    bounds = {"x": gate.x, "y": gate.y, "z": gate.z, "intensity": gate.intensity}
    return ", ".join(f"{name} {low:g} to {high:g}" for name, bound in bounds.items() if bound for low, high in [bound])


def _start(front_offset: float) -> str:
    """Say where distances start, for people."""
    if front_offset:
        return f"from the bumper, {front_offset:g} m ahead of the lidar"
    return (
        "from the lidar, so TTC is too long by (lidar to bumper) / closing speed; --front-offset says how far that is"
    )


def row_of(
    number: int, stamp: float, tracked: TrackedTTC, speed: float | None, decision: Decision, threats: Threats | None
) -> Row:
    """Put together what the tracker says, or the path where that comes first, and what is done."""
    path = None if threats is None else threats.path
    first = path if path is not None and path.ttc < tracked.ttc else None
    closing_low, closing_high = tracked.closing_speed_interval or UNSEEN
    ttc_low, ttc_high = tracked.ttc_interval or UNSEEN
    if first is not None:
        closing_low, closing_high, ttc_low, ttc_high = *UNSEEN, *UNSEEN
    return Row(
        number,
        stamp,
        tracked.distance if first is None else first.clearance,
        tracked.closing_speed if first is None else first.closing_speed,
        tracked.ttc if first is None else first.ttc,
        tracked.status if first is None else first.status,
        decision.command,
        decision.reason,
        closing_low,
        closing_high,
        ttc_low,
        ttc_high,
        math.nan if speed is None else speed,
        None,
        "" if decision.criterion is None else decision.criterion.name,
        decision.value,
        decision.threshold,
        -1 if path is None else path.index,
        math.nan if path is None else path.range,
        math.nan if path is None else path.angle,
    )
