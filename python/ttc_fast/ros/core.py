"""The node without a transport: messages in, decisions out."""

from __future__ import annotations

import gc
import math
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ttc_fast._core import SweptPath
from ttc_fast.brake import Command, Motion, Reason
from ttc_fast.brake.controller import cover_for_one_another
from ttc_fast.brake.frame import CLOCK_TOLERANCE
from ttc_fast.brake.settings import BrakeSettings
from ttc_fast.ros.messages import ERROR, OK, STALE, WARN, Cause, Diagnostics, Drive, Outputs
from ttc_fast.ros_messages import Commanded, Transform
from ttc_fast.sensors.clock import ANOTHER_CLOCK, SET_BACK, Stamps, apart
from ttc_fast.sensors.clouds import CloudReader, Placement, only_heights
from ttc_fast.sensors.frames import MixedError, SensorChoice, frame_of
from ttc_fast.sensors.oddities import RefusedError, Tally, say_on_console
from ttc_fast.sensors.odometry import OdometryReader, no_motion
from ttc_fast.sensors.scans import Geometry, Repeats, ScanKernels, ScanReader
from ttc_fast.sensors.transforms import Transforms, is_level, tilted

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from ttc_fast.brake import BrakeController, Decision
    from ttc_fast.ros.settings import NodeSettings
    from ttc_fast.sensors.odometry import Pose
    from ttc_fast.sensors.transforms import Mount

__all__ = ["ERROR", "OK", "STALE", "WARN", "BrakeNode", "Cause", "Diagnostics", "Drive", "Outputs"]

NAME = "ttc_fast: brake"
UNSEEING = frozenset({Reason.WAITING, Reason.STALE, Reason.BLIND, Reason.NO_MOTION, Reason.UNSEEN})
UNREADABLE = (ArithmeticError, AttributeError, LookupError, MemoryError, TypeError, ValueError)
"""The errors that a message without sense may raise."""
SCAN, CLOUD = "scan", "cloud"
"""The sources of frames. Each has its own controller, votes and watchdog: they come at different times and rates. What
one of them looks at, the other need not."""
NO_SCAN = Geometry(0.0, 0.1, 2, 0.0, math.inf)
"""The geometry of a scanner until the first scan comes."""


class BrakeNode:
    """Takes messages and the time, and returns what to publish. One thread at a time may call it.

    Times are seconds of the clock of the stamps. No content of a message makes it raise: a message that cannot be read
    is counted, and ``diagnostics`` shows the count.

    Parameters
    ----------
    settings : NodeSettings
        The parameters of the node.

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
        settings = settings.resolved()
        self._dropped, self._odd = Tally(say_on_console), Tally(say_on_console)
        self._scans = ScanReader(settings.scan_topic, self._odd)
        self._clouds = CloudReader(settings.points_topic, self._odd)
        self._controllers: dict[str, BrakeController] = {}
        self._transforms = Transforms()
        self._kernels: ScanKernels
        self._mount: tuple[float, float, float] = settings.mount
        self._upside_down = False
        self._tilted = ""
        self.settings = settings
        self._forget()
        self.change(settings)

    def change(self, settings: NodeSettings) -> None:
        """Go on with other settings; votes and held brakes stay."""
        settings = settings.resolved()
        if settings.frame_id != self.settings.frame_id:
            self._sensors = self._choices(settings)
        self.settings = settings
        self._configuration = settings.configuration()
        self._placed.clear()
        self._place(None)
        brake = self._configuration.brake
        self._motion_timeout = brake.get("motion_timeout", BrakeSettings.motion_timeout)
        timeout = brake.get("sensor_timeout", BrakeSettings.sensor_timeout)
        topics = {SCAN: settings.scan_topic, CLOUD: settings.points_topic}
        self._repeats = {source: Repeats(topic, self._odd, timeout) for source, topic in topics.items()}
        controllers, self._controllers = self._controllers, {}
        if settings.scan_topic:
            scan = self._kernels.of(NO_SCAN)
            self._controllers[SCAN] = _after(controllers.get(SCAN), self._configuration.controller(scan))
        if settings.points_topic and settings.outline:
            cloud = self._configuration.controller(path=SweptPath(settings.outline), views=settings.views())
            self._controllers[CLOUD] = _after(controllers.get(CLOUD), cloud)
        cover_for_one_another(self._controllers.values())

    def _forget(self) -> None:
        """Forget everything that was seen."""
        self._controllers = {}
        self._now = -math.inf
        self._motion: Motion | None = None
        self._unjudged: Motion | None = None
        self._commanded: Commanded | None = None
        self._motion_asked_for: Motion | None = None
        self._commanded_at = self._override_at = -math.inf
        self._latest: Decision | None = None
        self._source = SCAN
        self._took = self._took_at_most = 0.0
        self._answers: list[tuple[Decision, str]] = []
        self._odometry: dict[str, OdometryReader] = {}
        self._moved_by, self._moved_at = "", -math.inf
        topics = {SCAN: self.settings.scan_topic, CLOUD: self.settings.points_topic}
        self._stamps = {source: Stamps(topic, self._odd) for source, topic in topics.items()}
        self._placed: dict[str, tuple[str, Mount | None]] = {}
        self._sensors = self._choices(self.settings)

    def _choices(self, settings: NodeSettings) -> dict[str, SensorChoice]:
        """Return the choice of a sensor on each topic, before any message."""
        topics = {SCAN: settings.scan_topic, CLOUD: settings.points_topic}
        return {source: SensorChoice(topic, self._odd, settings.frame_id) for source, topic in topics.items()}

    def on_odometry(
        self,
        now: float,
        stamp: float,
        speed: float,
        yaw_rate: float = 0.0,
        lateral_speed: float = 0.0,
        pose: Pose | None = None,
        topic: str = "odometry",
    ) -> None:
        """Take the odometry of the vehicle's origin, m/s and rad/s, and its pose where that is known."""
        self._look_at_clock(now)
        reader = self._odometry.get(topic)
        if reader is None:
            reader = self._odometry[topic] = OdometryReader(topic, self._odd)
        measured = stamp if stamp and self.settings.use_stamps else now
        early, late = measured - now - CLOCK_TOLERANCE, now - measured - self._motion_timeout
        if math.isfinite(measured) and (early > 0.0 or late > 0.0):
            self._other_clock(topic, measured - now, "it is not used")
            return
        try:
            twist = reader.read(measured, pose, speed, yaw_rate, lateral_speed)
        except UNREADABLE as error:
            self.dropped("odometry", error)
            return
        if twist is not None and (topic == self._moved_by or self._is_chosen(topic, now)):
            self._moved_at = now
            self._motion = self._unjudged = Motion(twist.speed, twist.yaw_rate, twist.lateral_speed, measured)

    def _is_chosen(self, topic: str, now: float) -> bool:
        """Return whether odometry of this topic holds: of several, that of the first in ``odom_topics`` that comes."""
        names, before = self.settings.odom_topics, self._moved_by
        rank, rank_before = (names.index(each) if each in names else 0 for each in (topic, before))
        if rank_before <= rank and now - self._moved_at <= self._motion_timeout:
            self._odd.count(f"{topic}, odometry", f"is ignored while that of {before} comes")
            return False
        self._moved_by = topic
        return True

    def on_speed(self, now: float, speed: float) -> None:
        """Take a bare speed, m/s; it counts as measured when it came."""
        self.on_odometry(now, now, speed)

    def on_commanded(self, now: float, commanded: Commanded, message: Any = None) -> Outputs | None:
        """Take what the driver or planner asks for, which counts for ``commanded_timeout`` from now.

        With ``mux`` it returns what goes out at once: the driver's message as ``forward``, or a brake.
        """
        self._look_at_clock(now)
        why_not, motion = no_motion(*commanded), None
        if not why_not:
            motion = motion_asked_for(commanded, self.settings.wheelbase)
            why_not = "" if motion is None else no_motion(*motion[:3])
        if why_not:
            self.dropped(self.settings.commanded_topic, f"{why_not}: {commanded}")
            return None
        if motion is None:
            why = f"is {commanded.steering_angle:g}, which is no steering angle in rad, and is perhaps in degrees"
            self._odd.count(f"{self.settings.commanded_topic}, steering_angle", f"{why}: what is asked for is unknown")
        if commanded.steering_angle and not self.settings.wheelbase:
            why = "it steers, and no wheelbase is set, so the path of what is asked for is taken for straight"
            self._odd.count(f"{self.settings.commanded_topic}, wheelbase", why)
        self._commanded, self._motion_asked_for, self._commanded_at = commanded, motion, now
        if not self.settings.mux:
            return None
        outputs = self._decide(now)
        return outputs if outputs.brake else outputs._replace(forward=message)

    def on_override(self, now: float, override: bool) -> None:
        """Take whether the driver takes over; an override counts for ``override_timeout`` from now."""
        self._look_at_clock(now)
        self._override_at = now if override else -math.inf

    def on_buttons(self, now: float, buttons: Sequence[int]) -> None:
        """Take the buttons of a sensor_msgs/Joy, one of which is that of the override."""
        button = self.settings.override_button
        if button < len(buttons):
            self.on_override(now, bool(buttons[button]))
        else:
            why = f"has {len(buttons)} buttons, counted from 0, and override_button is {button}"
            self.dropped(self.settings.override_topic, why)

    def _asked_for(self, now: float) -> Commanded | None:
        """Return what the driver asks for, unless it is too old."""
        return self._commanded if 0.0 <= now - self._commanded_at <= self.settings.commanded_timeout else None

    def on_scan(self, now: float, stamp: float, scan: Any) -> Outputs:
        """Take a scan: any object with the fields of sensor_msgs/LaserScan, its ``ranges`` read where they lie."""
        began = time.perf_counter()
        self._look_at_clock(now)
        try:
            frame_id = frame_of(scan)
            if not self._sensors[SCAN].accepts(frame_id, scan.ranges):
                return self.tick(now)
            if frame_id and SCAN not in self._placed:
                self._place(frame_id)
            if self._tilted:
                raise RefusedError(self._tilted)
            read, measured = self._scans.read(scan), self._measured(SCAN, now, stamp)
            if self._repeats[SCAN].found(read.ranges, measured):
                return self.tick(now)
            frame = self._kernels.frame(self._controllers[SCAN], read)
            outputs = self._decide(now, SCAN, stamp=measured, **frame)
        except UNREADABLE as error:
            return self._refused(SCAN, error, now)
        self._count_time(began)
        return outputs

    def on_cloud(self, now: float, stamp: float, message: Any) -> Outputs:
        """Take a sensor_msgs/PointCloud2 of any transport."""
        points = self.points_of(message)
        return self.tick(now) if points is None else self.on_points(now, stamp, points)

    def on_transforms(self, transforms: Iterable[Transform]) -> None:
        """Take the static transforms of a tf2_msgs/TFMessage, which place the sensors on the vehicle."""
        try:
            if self._transforms.add(transforms):
                self._placed.clear()
        except UNREADABLE as error:
            self.dropped("/tf_static", error)

    def _place(self, frame_id: str | None) -> None:
        """Place the scanner: as the user says, or by the static transforms, or at the vehicle's origin."""
        configuration, mount = self._configuration, None
        self._tilted = ""
        if frame_id is not None:
            mount = self._mount_of(SCAN, frame_id)
            if "mount" in configuration.scan:
                return
            if mount is None:
                self._count_unplaced(SCAN, frame_id)
                return
            if not is_level(mount):
                self._tilted = tilted(mount, "mount")
                return
            configuration = replace(configuration, scan={**configuration.scan, "mount": mount.place})
            if mount.place == self._mount and mount.upside_down is self._upside_down:
                return
            say_on_console(f"{self.settings.scan_topic}: the scanner is mounted {mount.text}")
        self._mount = self.settings.mount if mount is None else mount.place
        self._upside_down = mount is not None and mount.upside_down
        self._kernels = ScanKernels(configuration, upside_down=self._upside_down)

    def _mount_of(self, source: str, frame_id: str) -> Mount | None:
        """Return where the sensor of a frame sits by the static transforms, as far as they have come."""
        frame, mount = self._placed.get(source, ("", None))
        if frame != frame_id:
            mount = self._transforms.mount(self.settings.base_frame, frame_id)
            self._placed[source] = frame_id, mount
        return mount

    def on_points(self, now: float, stamp: float, points: Any) -> Outputs:
        """Take a cloud in the vehicle's frame: rows x, y, z, or records as ``points_of`` gives them."""
        began = time.perf_counter()
        self._look_at_clock(now)
        try:
            cloud, measured = only_heights(points, *self.settings.height), self._measured(CLOUD, now, stamp)
            if self._repeats[CLOUD].found(cloud, measured):
                return self.tick(now)
            outputs = self._decide(now, CLOUD, points=cloud, stamp=measured)
        except UNREADABLE as error:
            return self._refused(CLOUD, error, now)
        self._count_time(began)
        return outputs

    def points_of(self, message: Any) -> Any:
        """Return the points of a sensor_msgs/PointCloud2 in the vehicle's frame, or None where it cannot be used.

        They are a view of the message, or a copy where the static transforms or an optical frame say another frame. A
        message without points gives an empty cloud, which is no free space. A message that cannot be used is counted,
        and so is what is odd about one that can.
        """
        try:
            frame_id = frame_of(message)
            if not self._sensors[CLOUD].accepts(frame_id):
                return None
            return self._in_vehicle_frame(self._clouds.read(message, intensity=None), frame_id or "")
        except UNREADABLE as error:
            self._drop(CLOUD, error)
            return None

    def _in_vehicle_frame(self, points: Any, frame_id: str) -> Any:
        """Return points of a frame in that of the vehicle, if it is known where that frame is."""
        mount = self._mount_of(CLOUD, frame_id)
        placement = Placement.of(mount, frame_id)
        if placement is None:
            self._count_unplaced(CLOUD, frame_id)
            return points
        how = "has z forward, x right, y down" if mount is None else f"is {mount.text}"
        self._odd.count(f"{self.settings.points_topic}, frame", f"{frame_id} {how}")
        return placement.placed(points)

    def _count_unplaced(self, source: str, frame_id: str) -> None:
        """Count a message of a frame that is not known to be that of the vehicle, and is taken for it."""
        base = self.settings.base_frame
        if frame_id.lstrip("/") not in ("", base.lstrip("/")):
            why = f"{frame_id} is placed by no static transform, and taken for {base}"
            self._odd.count(f"{self._sensors[source].name}, frame", why)

    def tick(self, now: float) -> Outputs:
        """Decide without new data, which notices data that stopped. An adapter calls it every ``watchdog_period``."""
        self._look_at_clock(now)
        return self._decide(now)

    def dropped(self, topic: str, why: object = "") -> None:
        """Count a message that could not be read."""
        self._dropped.count(topic, str(why))

    def _refused(self, source: str, error: Exception, now: float) -> Outputs:
        """Count a frame that cannot be used, and decide without it."""
        self._drop(source, error)
        return self.tick(now)

    def _drop(self, source: str, error: Exception) -> None:
        self.dropped(self._sensors[source].name, error)
        if isinstance(error, MixedError) and source in self._controllers:  # what was seen may be of either sensor
            self._controllers[source].reset()

    def _measured(self, source: str, now: float, stamp: float) -> float:
        """Return when a frame was measured: by its stamp, or now if it has none or ``use_stamps`` is false."""
        if not self.settings.use_stamps:
            return now
        measured = self._stamps[source].measured(stamp, now)
        if abs(measured - now) > ANOTHER_CLOCK:
            self._other_clock(self._sensors[source].name, measured - now, "it is not safe")
        return measured

    def _other_clock(self, topic: str, ahead: float, so: str) -> None:
        """Count a message whose stamp cannot be used."""
        how = apart(round(ahead, 3), "the clock of this node")
        why = f"its stamp is {how}, so {so}: set the clocks, or set use_stamps to false"
        self._odd.count(f"{topic}, clock", why)

    def _look_at_clock(self, now: float) -> None:
        if now < self._now - SET_BACK:
            self._forget()
            self.change(self.settings)
        self._now = now

    def _count_time(self, began: float) -> None:
        self._took = time.perf_counter() - began
        self._took_at_most = max(self._took_at_most, self._took)

    def _decide(self, now: float, source: str = "", **data: Any) -> Outputs:
        """Update every controller with the time and the motion, one of them with the data; the worst answer counts."""
        motion, self._unjudged = self._unjudged, None
        asked, steering_angle = self._asked_for(now), 0.0
        driver: dict[str, Any] = {"override": 0.0 <= now - self._override_at <= self.settings.override_timeout}
        if asked is not None:
            steering_angle = asked.steering_angle
            driver["commanded"] = self._motion_asked_for
        self._answers = answers = [
            (controller.update(now, motion=motion, **driver, **(data if name == source else {})), name)
            for name, controller in self._controllers.items()
        ]
        decision, self._source = answers[0] if len(answers) == 1 else max(answers, key=_severity)
        self._latest = decision
        return Outputs(decision.command is Command.BRAKE, self._drive(decision, now), decision, steering_angle)

    def _drive(self, decision: Decision, now: float) -> Drive | None:
        motion = self._motion
        is_known = motion is not None and motion.stamp is not None and now - motion.stamp <= self._motion_timeout
        speed = motion.speed if motion is not None and is_known else 0.0
        if decision.command is Command.BRAKE:
            slow = 0.0 if decision.reason in UNSEEING else min(abs(speed), self.settings.brake_speed)
            return Drive(math.copysign(slow, speed) if slow else 0.0, decision.deceleration)
        if not self.settings.drive_always:
            return None
        return Drive(math.copysign(min(abs(speed), decision.speed_limit), speed), 0.0)

    def diagnostics(self, now: float) -> Diagnostics:
        """Return the state of the node and the reason for it."""
        decision = self._latest
        if decision is None:
            return Diagnostics(STALE, NAME, "nothing has come yet", self._counted())
        values = [("command", decision.command.name), ("reason", decision.reason.name)]
        values += [(name, str(value)) for name, value in decision.counters._asdict().items()]
        if decision.threat is not None:
            threat = decision.threat
            values += [("source", threat.source.name), ("status", threat.status.name), ("ttc", f"{threat.ttc:.3f} s")]
            values += [("age of the data", f"{threat.age:.4f} s")]
        if self._motion is not None and self._motion.stamp is not None:
            values += [("speed", f"{self._motion.speed:.3f} m/s")]
            values += [("age of the speed", f"{now - self._motion.stamp:.4f} s")]
        if (asked := self._asked_for(now)) is not None:
            values += [("commanded speed", f"{asked.speed:.3f} m/s")]
        values += [("latency", f"{self._took * 1e6:.0f} us"), ("worst latency", f"{self._took_at_most * 1e6:.0f} us")]
        self._took_at_most = 0.0
        mixed = [f"{sensor.name} {sensor.mixed}" for sensor in self._sensors.values() if sensor.mixed]
        level = ERROR if mixed else _level(decision)
        others = [f"{source}: {each}" for each, source in self._answers if each is not decision and each.command]
        return Diagnostics(level, NAME, "; ".join([str(decision), *others, *mixed]), values + self._counted())

    def _counted(self) -> list[tuple[str, str]]:
        return self._dropped.values("dropped") + self._odd.values("odd")

    def cause(self) -> Cause | None:
        """Return the position of the beam or point that decided, in the vehicle's frame."""
        decision = self._latest
        if (
            decision is None
            or decision.threat is None
            or not math.isfinite(decision.threat.range + decision.threat.angle)
        ):
            return None
        threat = decision.threat
        x, y, yaw = (0.0, 0.0, 0.0) if self._source == CLOUD else self._mount
        direction = yaw + threat.angle
        x, y = x + threat.range * math.cos(direction), y + threat.range * math.sin(direction)
        return Cause(self.settings.base_frame, x, y, decision.command, str(decision))


def _after(before: BrakeController | None, controller: BrakeController) -> BrakeController:
    """Return the controller with the memory of the one before it, which may be braking."""
    if before is not None:
        controller.restore({**before.state(), "range_rate": controller.state()["range_rate"]})
    return controller


def _severity(answer: tuple[Decision, str]) -> tuple[float, ...]:
    """Return what makes one decision more severe than another: the command, then what it asks of the vehicle."""
    decision = answer[0]
    share = decision.value / decision.threshold if decision.threshold > 0.0 else math.inf
    return decision.command, decision.reason in UNSEEING, -decision.speed_limit, decision.deceleration, -share


def _level(decision: Decision) -> int:
    if decision.reason in UNSEEING:
        return ERROR
    if decision.reason is Reason.OVERRIDE:
        return WARN
    return OK if decision.command is Command.NONE else WARN


def motion_asked_for(commanded: Commanded, wheelbase: float) -> Motion | None:
    """Return the motion that a command asks for: a steering angle bends the path as that of a bicycle.

    It is None for a steering angle beyond a quarter turn, which cannot be in rad.

    Examples
    --------
    >>> from ttc_fast.ros.core import motion_asked_for
    >>> from ttc_fast.ros_messages import Commanded
    >>> round(motion_asked_for(Commanded(2.0, steering_angle=0.4), 0.33).yaw_rate, 3)
    2.562
    """
    if wheelbase and abs(commanded.steering_angle) >= math.pi / 2.0:
        return None
    bend = math.tan(commanded.steering_angle) / wheelbase if wheelbase else 0.0
    return Motion(commanded.speed, commanded.yaw_rate + commanded.speed * bend, commanded.lateral_speed)


def on_transforms(node: BrakeNode, message: Any) -> None:
    """Hand a tf2_msgs/TFMessage of rospy or rclpy to a node."""
    found = []
    for each in message.transforms:
        at, turned = each.transform.translation, each.transform.rotation
        rotation = turned.x, turned.y, turned.z, turned.w
        found.append(Transform(each.header.frame_id, each.child_frame_id, (at.x, at.y, at.z), rotation))
    node.on_transforms(found)


def of_ackermann(message: Any) -> Commanded:
    """Return what an ackermann_msgs/AckermannDriveStamped of rospy or rclpy asks for."""
    return Commanded(message.drive.speed, steering_angle=message.drive.steering_angle)


def of_twist(message: Any) -> Commanded:
    """Return what a geometry_msgs/Twist of rospy or rclpy asks for."""
    return Commanded(message.linear.x, message.linear.y, message.angular.z)


def freeze_heap() -> None:
    """Have Python's garbage collector never again walk what exists now, which would hold a brake up for milliseconds.

    Modules and types make up most of it. What is made later is collected as before. An adapter calls this once, when
    the node is set up and owns its process.
    """
    gc.collect()
    gc.freeze()
