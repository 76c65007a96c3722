"""The brake as a node in a ROS 2 graph over DDS, without a ROS installation: convert, call, publish.

A received message is viewed in its bytes. One thread does everything: the one that calls ``run``.
"""

from __future__ import annotations

import signal
import sys
import time
from functools import partial
from typing import TYPE_CHECKING, Any

from cyclonedds.core import DDSException

from ttc_fast.ros.core import BrakeNode, freeze_heap
from ttc_fast.ros.dds.participant import Participant
from ttc_fast.ros.dds.types import message, serialized, time_of
from ttc_fast.ros.messages import fill_diagnostics, fill_drive, fill_marker
from ttc_fast.ros.settings import SettingError
from ttc_fast.ros_messages import (
    MessageError,
    ackermann,
    boolean,
    buttons,
    float32,
    float64,
    laser_scan,
    odometry,
    point_cloud,
    transforms,
    twist,
)
from ttc_fast.sensors.odometry import Pose

if TYPE_CHECKING:
    from collections.abc import Callable

    from ttc_fast.ros.dds.participant import Publisher, Subscription
    from ttc_fast.ros.dds.settings import DdsSettings
    from ttc_fast.ros.messages import Outputs
    from ttc_fast.ros.settings import NodeSettings
    from ttc_fast.ros_messages import Commanded, LaserScan, Odometry, PointCloud2

TRUE_FALSE = {flag: serialized(message("std_msgs/Bool", data=flag)) for flag in (True, False)}
ACKERMANN = "ackermann_msgs/AckermannDriveStamped"
MARKER_LIFETIME = 500_000_000
"""ns: a marker fades this long after it was published."""


class DdsNode:
    """The node, from joining the graph until ``close``.

    Parameters
    ----------
    settings : NodeSettings
        The parameters that every node has.
    dds : DdsSettings, optional
        The settings that only this one has.
    clock : callable, optional
        Returns the time of stamps, ns since 1970.
    """

    def __init__(
        self, settings: NodeSettings, dds: DdsSettings | None = None, *, clock: Callable[[], int] = time.time_ns
    ) -> None:
        self.participant = Participant(dds)
        self.settings = settings = settings.resolved(self.participant.resolved)
        self.core = BrakeNode(settings)
        self._clock = clock
        self._brake = self._publisher(settings.brake_topic, "std_msgs/Bool")
        self._drive = self._publisher(settings.drive_topic, ACKERMANN)
        self._diagnostics = self._publisher(settings.diagnostics_topic, "diagnostic_msgs/DiagnosticArray")
        self._marker = self._publisher(settings.marker_topic, "visualization_msgs/Marker")
        # Each is made once, and filled again for each answer.
        self._drive_message = message(ACKERMANN)
        lifetime = message("builtin_interfaces/Duration", nanosec=MARKER_LIFETIME)
        self._marker_message = message("visualization_msgs/Marker", lifetime=lifetime)
        self._dropped: dict[Subscription, int] = {}
        self._subscribe()
        self.participant.announce()
        # The periods run in monotonic time, which no one sets back.
        self._next_diagnostics = time.monotonic()
        self._next_tick = self._next_diagnostics + settings.watchdog_period

    def spin(self) -> None:
        """Wait until a message has come or something is due, and do it."""
        due = min(self._next_tick, self._next_diagnostics) - time.monotonic()
        if self.participant.wait(due):
            self.participant.take()
        monotonic = time.monotonic()
        if monotonic >= self._next_tick:
            self._next_tick = monotonic + self.settings.watchdog_period
            self.tick()
        if monotonic >= self._next_diagnostics:
            self._next_diagnostics = monotonic + self.settings.diagnostics_period
            self.diagnose()

    def tick(self) -> None:
        """Publish what the core decides without new data."""
        now = self._clock()
        self._publish(now, self.core.tick(now * 1e-9))

    def diagnose(self) -> None:
        """Publish the diagnostics."""
        self._count_dropped()
        if self._diagnostics is None:
            return
        now = self._clock()
        diagnostics = self.core.diagnostics(now * 1e-9)
        diagnostics.values.extend(self._transport_losses())
        array, status = message("diagnostic_msgs/DiagnosticArray"), partial(message, "diagnostic_msgs/DiagnosticStatus")
        pair = partial(message, "diagnostic_msgs/KeyValue")
        self._diagnostics.publish(serialized(fill_diagnostics(array, status, pair, diagnostics, time_of(now))))

    def said(self) -> str:
        """Return where the node is, and what it reads and publishes."""
        node = self.participant
        reads, publishes = (
            ", ".join(sorted({each.topic for each in all_of})) for all_of in (node.subscriptions, node.publishers)
        )
        return f"DDS domain {node.settings.domain}, reads {reads}, publishes {publishes}"

    def close(self) -> None:
        """Leave the graph."""
        self._brake = self._drive = self._diagnostics = self._marker = None
        self._dropped.clear()
        self.participant.close()

    def _subscribe(self) -> None:
        settings, node = self.settings, self.participant
        node.subscribe("/tf_static", "tf2_msgs/TFMessage", transforms, self.core.on_transforms, latched=True)
        if settings.scan_topic:
            node.subscribe(settings.scan_topic, "sensor_msgs/LaserScan", laser_scan, self._on_scan, sensor_data=True)
        if settings.points_topic:
            node.subscribe(
                settings.points_topic, "sensor_msgs/PointCloud2", point_cloud, self._on_points, sensor_data=True
            )
        if settings.speed_topic:
            kinds: dict[str, Any] = {
                "nav_msgs/Odometry": (odometry, partial(self._on_odometry, settings.speed_topic)),
                "std_msgs/Float32": (float32, self._on_speed),
                "std_msgs/Float64": (float64, self._on_speed),
            }
            node.subscribe_by_type(settings.speed_topic, kinds)
        for topic in () if settings.speed_topic else settings.odom_topics:
            take = partial(self._on_odometry, topic)
            node.subscribe(topic, "nav_msgs/Odometry", odometry, take, sensor_data=True)
        if settings.mux:
            driver = settings.commanded_topic, ACKERMANN, forwarded, self._on_forwarded
            node.subscribe(*driver, sensor_data=True)
        elif settings.commanded_topic:
            kinds = {ACKERMANN: (ackermann, self._on_commanded), "geometry_msgs/Twist": (twist, self._on_commanded)}
            node.subscribe_by_type(settings.commanded_topic, kinds)
        if settings.override_topic:
            kinds = {"std_msgs/Bool": (boolean, self._on_override), "sensor_msgs/Joy": (buttons, self._on_buttons)}
            node.subscribe_by_type(settings.override_topic, kinds)

    def _publisher(self, topic: str, name: str) -> Publisher | None:
        return self.participant.publisher(topic, name) if topic else None

    def _on_scan(self, scan: LaserScan) -> None:
        now = self._clock()
        self._publish(now, self.core.on_scan(now * 1e-9, scan.stamp * 1e-9, scan))

    def _on_points(self, cloud: PointCloud2) -> None:
        now = self._clock()
        self._publish(now, self.core.on_cloud(now * 1e-9, cloud.stamp * 1e-9, cloud))

    def _on_odometry(self, topic: str, read: Odometry) -> None:
        now, pose = self._clock() * 1e-9, Pose(read.x, read.y, read.yaw)
        twist = read.speed, read.yaw_rate, read.lateral_speed
        self.core.on_odometry(now, read.stamp * 1e-9, *twist, pose, topic)

    def _on_speed(self, speed: float) -> None:
        self.core.on_speed(self._clock() * 1e-9, speed)

    def _on_commanded(self, commanded: Commanded, message: bytes | None = None) -> None:
        now = self._clock()
        if (outputs := self.core.on_commanded(now * 1e-9, commanded, message)) is not None:
            self._publish(now, outputs)

    def _on_forwarded(self, received: tuple[Commanded, bytes]) -> None:
        self._on_commanded(*received)

    def _on_override(self, override: bool) -> None:
        self.core.on_override(self._clock() * 1e-9, override)

    def _on_buttons(self, pressed: Any) -> None:
        self.core.on_buttons(self._clock() * 1e-9, pressed)

    def _publish(self, now: int, outputs: Outputs) -> None:
        if self._brake is not None:
            self._brake.publish(TRUE_FALSE[outputs.brake])
        if self._drive is not None and outputs.forward is not None:
            self._drive.publish(outputs.forward)
        elif self._drive is not None and outputs.drive is not None:
            said = time_of(now), self.settings.base_frame, outputs.steering_angle
            self._drive.publish(serialized(fill_drive(self._drive_message, outputs.drive, *said)))
        if self._marker is not None and self._marker.has_listeners and (cause := self.core.cause()):
            self._marker.publish(serialized(fill_marker(self._marker_message, cause, time_of(now))))

    def _count_dropped(self) -> None:
        for each in self.participant.subscriptions:
            dropped = self.participant.dropped(each)
            for _ in range(dropped - self._dropped.get(each, 0)):
                self.core.dropped(each.topic, "cut short or damaged")
            self._dropped[each] = dropped

    def _transport_losses(self) -> list[tuple[str, str]]:
        losses = [(f"lost: {each.topic}", each.lost) for each in self.participant.subscriptions]
        losses += [(f"could not be sent: {each.topic}", each.unsent) for each in self.participant.publishers]
        losses += [("malformed packets", self.participant.malformed)]
        return [(name, str(count)) for name, count in losses if count]


def forwarded(cdr: bytes) -> tuple[Commanded, bytes]:
    """Read an AckermannDriveStamped that goes out as it came, in the encoding that ROS 2 has."""
    if cdr[:2] != b"\0\1":
        raise MessageError(f"starts with {cdr[:2].hex()}, and mux forwards XCDR1 of little-endian senders (0001) alone")
    return ackermann(cdr), cdr


def run(settings: NodeSettings, dds: DdsSettings | None = None) -> None:
    """Run the node until the process is interrupted or ended (SIGINT, SIGTERM).

    Raises
    ------
    SettingError
        If Cyclone DDS cannot join the domain, as with a variable CYCLONEDDS_URI that makes no sense.
    """
    ended = False

    def end(*_: Any) -> None:
        nonlocal ended
        ended = True

    before = [(each, signal.signal(each, end)) for each in (signal.SIGINT, signal.SIGTERM)]
    try:
        try:
            node = DdsNode(settings, dds)
        except DDSException as error:
            raise SettingError(f"Cyclone DDS cannot join the domain, and its log says why: {error}") from None
        print(f"ttc-fast node: {node.said()}; Ctrl-C ends it", file=sys.stderr, flush=True)
        freeze_heap()
        while not ended:
            node.spin()
        node.close()
    finally:
        for each, handler in before:
            signal.signal(each, handler)
