"""The brake as a node in a ROS 2 graph over DDS, without a ROS installation: convert, call, publish.

What comes is viewed in the bytes of its message. Only one thread does all of it, the one that calls ``run``.
"""

from __future__ import annotations

import signal
import time
from typing import TYPE_CHECKING, Any

from ttc_fast.ros import pauses
from ttc_fast.ros.core import BrakeNode
from ttc_fast.ros.dds.decode import float32, float64
from ttc_fast.ros.dds.encode import encoded_bool, encoded_diagnostics, encoded_drive, encoded_marker
from ttc_fast.ros.dds.participant import Participant
from ttc_fast.ros.fill import COLOURS
from ttc_fast.ros_messages import laser_scan, odometry, point_cloud

if TYPE_CHECKING:
    from collections.abc import Callable

    from ttc_fast.ros.core import Outputs
    from ttc_fast.ros.dds.participant import Publisher, Subscription
    from ttc_fast.ros.dds.settings import DdsSettings
    from ttc_fast.ros.settings import NodeSettings
    from ttc_fast.ros_messages import LaserScan, Odometry, PointCloud2


class DdsNode:
    """The node, from joining the graph until ``close``.

    Parameters
    ----------
    settings : NodeSettings
        What every node has.
    dds : DdsSettings, optional
        What only this one has.
    clock : callable, optional
        The time of stamps, ns since 1970.
    """

    def __init__(
        self, settings: NodeSettings, dds: DdsSettings | None = None, *, clock: Callable[[], int] = time.time_ns
    ) -> None:
        self.settings = settings
        self.core = BrakeNode(settings)
        self.participant = Participant(dds)
        self._clock = clock
        self._brake = self._publisher(settings.brake_topic, "std_msgs/Bool")
        self._drive = self._publisher(settings.drive_topic, "ackermann_msgs/AckermannDriveStamped")
        self._diagnostics = self._publisher(settings.diagnostics_topic, "diagnostic_msgs/DiagnosticArray")
        self._marker = self._publisher(settings.marker_topic, "visualization_msgs/Marker")
        self._dropped: dict[Subscription, int] = {}
        self._subscribe()
        self.participant.announce()
        # Periods are of a clock that nobody sets.
        self._next_diagnostics = time.monotonic()
        self._next_tick = self._next_diagnostics + settings.watchdog_period

    def spin(self) -> None:
        """Wait until something has come, or is due, and do that."""
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
        """Let the watchdog look."""
        now = self._clock()
        self._publish(now, self.core.tick(now * 1e-9))

    def diagnose(self) -> None:
        """Publish the diagnostics."""
        self._count_dropped()
        if self._diagnostics is None:
            return
        now = self._clock()
        said = self.core.diagnostics(now * 1e-9)
        values = [*said.values, *self._of_the_transport()]
        self._diagnostics.publish(
            encoded_diagnostics(
                now, level=said.level, name=said.name, message=said.message, hardware_id="ttc_fast", values=values
            )
        )

    def close(self) -> None:
        """Leave the graph."""
        self.participant.close()

    def _subscribe(self) -> None:
        settings, node = self.settings, self.participant
        if settings.scan_topic:
            node.subscribe(settings.scan_topic, "sensor_msgs/LaserScan", laser_scan, self._on_scan, sensor_data=True)
        if settings.points_topic:
            node.subscribe(
                settings.points_topic, "sensor_msgs/PointCloud2", point_cloud, self._on_points, sensor_data=True
            )
        if settings.speed_topic:
            kinds: dict[str, tuple[Callable[[bytes], Any], Callable[[Any], None]]] = {
                "nav_msgs/Odometry": (odometry, self._on_odometry),
                "std_msgs/Float32": (float32, self._on_speed),
                "std_msgs/Float64": (float64, self._on_speed),
            }
            node.subscribe_by_type(settings.speed_topic, kinds)
            return
        for topic in settings.odom_topics:
            node.subscribe(topic, "nav_msgs/Odometry", odometry, self._on_odometry)

    def _publisher(self, topic: str, name: str) -> Publisher | None:
        return self.participant.publisher(topic, name) if topic else None

    def _on_scan(self, scan: LaserScan) -> None:
        now = self._clock()
        self._publish(now, self.core.on_scan(now * 1e-9, scan.stamp * 1e-9, scan))

    def _on_points(self, cloud: PointCloud2) -> None:
        now = self._clock()
        points = self.core.points_of(cloud)
        if points is not None:
            self._publish(now, self.core.on_points(now * 1e-9, cloud.stamp * 1e-9, points))

    def _on_odometry(self, read: Odometry) -> None:
        now = self._clock() * 1e-9
        self.core.on_odometry(now, read.stamp * 1e-9, read.speed, read.yaw_rate, read.lateral_speed)

    def _on_speed(self, speed: float) -> None:
        self.core.on_speed(self._clock() * 1e-9, speed)

    def _publish(self, now: int, outputs: Outputs) -> None:
        if self._brake is not None:
            self._brake.publish(encoded_bool(outputs.brake))
        frame = self.settings.base_frame
        if self._drive is not None and outputs.drive is not None:
            speed, acceleration = outputs.drive
            self._drive.publish(encoded_drive(now, frame, speed=speed, acceleration=acceleration))
        if self._marker is not None and self._marker.has_listeners and (cause := self.core.cause()):
            position, color = (cause.x, cause.y, 0.0), COLOURS[cause.command]
            self._marker.publish(encoded_marker(now, cause.frame, position, color=color, text=cause.text))

    def _count_dropped(self) -> None:
        for each in self.participant.subscriptions:
            dropped = self.participant.dropped(each)
            for _ in range(dropped - self._dropped.get(each, 0)):
                self.core.dropped(each.topic, "cut short or damaged")
            self._dropped[each] = dropped

    def _of_the_transport(self) -> list[tuple[str, str]]:
        losses = [(f"lost: {each.topic}", each.lost) for each in self.participant.subscriptions]
        losses += [(f"could not be sent: {each.topic}", each.unsent) for each in self.participant.publishers]
        losses += [("malformed packets", self.participant.malformed)]
        return [(name, str(count)) for name, count in losses if count]


def run(settings: NodeSettings, dds: DdsSettings | None = None) -> None:
    """Be the node until somebody interrupts or ends the process (SIGINT, SIGTERM)."""
    ended = False

    def end(*_: Any) -> None:
        nonlocal ended
        ended = True

    before = [(each, signal.signal(each, end)) for each in (signal.SIGINT, signal.SIGTERM)]
    try:
        node = DdsNode(settings, dds)
        pauses.freeze()
        while not ended:
            node.spin()
        node.close()
    finally:
        for each, handler in before:
            signal.signal(each, handler)
