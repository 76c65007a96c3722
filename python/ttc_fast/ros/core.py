"""The node without a transport: messages in, decisions out."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ttc_fast._core import SweptPath
from ttc_fast.brake import Command, Motion, Reason

if TYPE_CHECKING:
    from ttc_fast._core import ScanTTC
    from ttc_fast.brake import BrakeController, Decision
    from ttc_fast.ros.settings import NodeSettings

OK, WARN, ERROR, STALE = range(4)
"""Levels of diagnostic_msgs/DiagnosticStatus."""
UNSEEING = frozenset({Reason.WAITING, Reason.STALE, Reason.BLIND, Reason.NO_MOTION})


class Drive(NamedTuple):
    """What to ask of the vehicle: of ackermann_msgs/AckermannDrive.

    Attributes
    ----------
    speed : float
        m/s, negative backwards.
    acceleration : float
        m/s^2, without sign.
    """

    speed: float
    acceleration: float


class Outputs(NamedTuple):
    """What to publish.

    Attributes
    ----------
    brake : bool
        For ``brake_topic``.
    drive : Drive or None
        For ``drive_topic``; None is silence.
    decision : Decision
        Where both come from.
    """

    brake: bool
    drive: Drive | None
    decision: Decision


class Diagnostics(NamedTuple):
    """For ``diagnostics_topic``, as of diagnostic_msgs/DiagnosticStatus."""

    level: int
    name: str
    message: str
    values: list[tuple[str, str]]


class Cause(NamedTuple):
    """For ``marker_topic``: where the beam or point is that decided, in a frame, m."""

    frame: str
    x: float
    y: float
    command: Command
    text: str


class BrakeNode:
    """Takes messages and the time, and says what to publish.

    Parameters
    ----------
    settings : NodeSettings
        Its parameters.

    Examples
    --------
    >>> import numpy as np
    >>> from types import SimpleNamespace
    >>> from ttc_fast.ros.core import BrakeNode
    >>> from ttc_fast.ros.settings import NodeSettings
    >>> node = BrakeNode(NodeSettings.of({"trigger": [1, 1]}))
    >>> node.on_odometry(0.0, 0.0, speed=4.0)
    >>> scan = SimpleNamespace(
    ...     angle_min=0.0, angle_increment=0.1, range_min=0.1, range_max=30.0, time_increment=0.0,
    ...     ranges=np.array([2.0, 9.0], np.float32),
    ... )
    >>> outputs = node.on_scan(0.0, 0.0, scan)
    >>> outputs.brake, outputs.drive
    (True, Drive(speed=0.0, acceleration=6.0))
    """

    def __init__(self, settings: NodeSettings) -> None:
        self.settings = settings
        self._configuration = settings.configuration()
        self._geometry: tuple[Any, ...] | None = None
        self._scan: ScanTTC | None = None
        self._scan_frame = settings.base_frame
        self._controller: BrakeController | None = None
        outline: Any = settings.outline
        self._path = SweptPath(outline) if outline else None
        self._speed = 0.0
        self._motion: Motion | None = None
        self._latest: Decision | None = None
        self._dropped: dict[str, int] = {}

    def on_odometry(
        self, now: float, stamp: float, speed: float, yaw_rate: float = 0.0, lateral_speed: float = 0.0
    ) -> None:
        """Take odometry; a stamp of 0 is a clock that nobody set, and counts as now."""
        if not all(map(math.isfinite, (stamp, speed, yaw_rate, lateral_speed))):
            self.dropped("odometry")
            return
        self._speed = speed
        self._motion = Motion(speed, yaw_rate, lateral_speed, stamp or now)

    def on_speed(self, now: float, speed: float) -> None:
        """Take a bare speed, as measured when it came."""
        self.on_odometry(now, now, speed)

    def on_scan(self, now: float, stamp: float, scan: Any) -> Outputs:
        """Take a scan: any object with the fields of sensor_msgs/LaserScan."""
        try:
            self._read_by(scan)
            return self._decide(now, ranges=scan.ranges, stamp=stamp or now)
        except (ValueError, TypeError) as error:
            return self._unread(now, self.settings.scan_topic, error)

    def on_points(self, now: float, stamp: float, points: Any) -> Outputs:
        """Take a cloud of rows x, y, z in the vehicle's frame."""
        low, high = self.settings.height
        try:
            points = np.asarray(points)
            return self._decide(now, points=points[(points[:, 2] >= low) & (points[:, 2] <= high)], stamp=stamp or now)
        except (ValueError, TypeError, IndexError) as error:
            return self._unread(now, self.settings.points_topic, error)

    def tick(self, now: float) -> Outputs:
        """Look whether data still come."""
        return self._decide(now)

    def dropped(self, topic: str) -> None:
        """Count a message that could not be read."""
        self._dropped[topic] = self._dropped.get(topic, 0) + 1

    def _unread(self, now: float, topic: str, error: Exception) -> Outputs:
        self.dropped(f"{topic}: {error}")
        return self.tick(now)

    def _read_by(self, scan: Any) -> None:
        """Make the scanner, from the first scan and again whenever its geometry changes."""
        geometry = (
            scan.angle_min,
            scan.angle_increment,
            len(scan.ranges),
            scan.range_min,
            scan.range_max,
            scan.time_increment,
        )
        if geometry == self._geometry:
            return
        angle_min, angle_increment, beams, range_min, range_max, time_increment = geometry
        told = {"angle_min": angle_min, "angle_increment": angle_increment, "beams": beams}
        self._scan = self._configuration.scanner(**told, range_min=range_min, range_max=range_max)
        self._controller = self._configuration.controller(self._scan, self._path, time_increment=time_increment)
        self._geometry = geometry

    def _decide(self, now: float, **data: Any) -> Outputs:
        if self._controller is None:
            # Before the first scan only the watchdog speaks; with an outline clouds can be judged already.
            geometry = {"angle_min": 0.0, "angle_increment": 0.1, "beams": 2}
            self._controller = self._configuration.controller(self._configuration.scanner(**geometry), self._path)
        motion, self._motion = self._motion, None
        decision = self._controller.update(now, motion=motion, **data)
        self._latest = decision
        return Outputs(decision.command is Command.BRAKE, self._drive(decision), decision)

    def _drive(self, decision: Decision) -> Drive | None:
        if decision.command is Command.BRAKE:
            slow = min(abs(self._speed), self.settings.brake_speed)
            return Drive(math.copysign(slow, self._speed) if slow else 0.0, decision.deceleration)
        if not self.settings.drive_always:
            return None
        limited = min(abs(self._speed), decision.speed_limit)
        return Drive(math.copysign(limited, self._speed), 0.0)

    def diagnostics(self, now: float) -> Diagnostics:
        """Say how it is, and why."""
        decision = self._latest
        if decision is None:
            return Diagnostics(STALE, "ttc_fast: brake", "nothing has come yet", self._losses())
        level = ERROR if decision.reason in UNSEEING else WARN if decision.command is not Command.NONE else OK
        values = [("command", decision.command.name), ("reason", decision.reason.name)]
        values += [(name, str(value)) for name, value in decision.counters._asdict().items()]
        if decision.sight is not None:
            sight = decision.sight
            values += [("age", f"{sight.age:.4f} s"), ("ttc", f"{sight.ttc:.3f} s"), ("status", sight.status.name)]
        values.append(("decided", f"{now - decision.stamp:.4f} s ago"))
        return Diagnostics(level, "ttc_fast: brake", str(decision), values + self._losses())

    def _losses(self) -> list[tuple[str, str]]:
        return [(f"dropped: {topic}", str(count)) for topic, count in self._dropped.items()]

    def cause(self) -> Cause | None:
        """Where the beam or point is that decided, in the vehicle's frame."""
        decision = self._latest
        if decision is None or decision.sight is None or not math.isfinite(decision.sight.range + decision.sight.angle):
            return None
        sight = decision.sight
        x, y, yaw = self.settings.mount if sight.index >= 0 and self._geometry is not None else (0.0, 0.0, 0.0)
        direction = yaw + sight.angle
        return Cause(
            self.settings.base_frame,
            x + sight.range * math.cos(direction),
            y + sight.range * math.sin(direction),
            decision.command,
            str(decision),
        )
