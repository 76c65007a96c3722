"""The brake as a node of ROS 2: convert, call, publish. Needs rclpy and ackermann_msgs, which come with ROS 2."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import rclpy
from ackermann_msgs.msg import AckermannDriveStamped
from builtin_interfaces.msg import Duration
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import LaserScan, PointCloud2
from std_msgs.msg import Bool, Float32, Float64
from visualization_msgs.msg import Marker

from ttc_fast import ros_messages
from ttc_fast.ros.core import BrakeNode, freeze_heap, on_transforms
from ttc_fast.ros.messages import fill_diagnostics, fill_drive, fill_marker
from ttc_fast.ros.settings import AT_START, NodeSettings, SettingError, parameters_of_node
from ttc_fast.ros_messages import yaw_of
from ttc_fast.sensors.odometry import Pose

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from ttc_fast._settings import Setting
    from ttc_fast.ros.messages import Outputs

SPEEDS = {"nav_msgs/msg/Odometry": Odometry, "std_msgs/msg/Float32": Float32, "std_msgs/msg/Float64": Float64}


class RclpyNode(Node):  # type: ignore[misc] # rclpy has no types here
    """Subscriptions, publications and parameters around a core."""

    def __init__(self, given: Mapping[str, Any] | None = None, name: str = "ttc_fast") -> None:
        super().__init__(name)
        for each in parameters_of_node():
            self.declare_parameter(each.name, (given or {}).get(each.name, each.plain_default), _descriptor(each))
        settings = NodeSettings.of(self._parameters_now())
        self.core = BrakeNode(settings)
        self.add_on_set_parameters_callback(self._on_parameters)
        self._brake = self._publisher(Bool, settings.brake_topic)
        self._drive = self._publisher(AckermannDriveStamped, settings.drive_topic)
        self._diagnostics = self._publisher(DiagnosticArray, settings.diagnostics_topic)
        self._marker = self._publisher(Marker, settings.marker_topic)
        self._subscribe(LaserScan, settings.scan_topic, self._on_scan)
        self._subscribe(PointCloud2, settings.points_topic, self._on_points)
        self._subscribe_to_transforms()
        for topic in () if settings.speed_topic else settings.odom_topics:
            self._subscribe(Odometry, topic, partial(self._on_odometry, topic))
        self._speed_is_known = not settings.speed_topic
        # The timers run in steady time, so that they also act while a simulated clock stands.
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(settings.watchdog_period, self.tick, clock=self._steady)
        self.create_timer(settings.diagnostics_period, self.diagnose, clock=self._steady)

    def _publisher(self, kind: Any, topic: str) -> Any:
        return self.create_publisher(kind, topic, 1) if topic else None

    def _subscribe(self, kind: Any, topic: str, take: Any) -> None:
        """Subscribe as sensors publish: best effort, which receives from reliable publishers as well."""
        if topic:
            self.create_subscription(kind, topic, take, qos_profile_sensor_data)

    def _subscribe_to_transforms(self) -> None:
        """Subscribe to the static transforms, those that were published before included."""
        try:
            from rclpy.qos import DurabilityPolicy, QoSProfile
            from tf2_msgs.msg import TFMessage
        except ImportError:
            return  # a ROS without them has none
        latched = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        take = partial(on_transforms, self.core)
        self.create_subscription(TFMessage, "/tf_static", take, latched)

    def _parameters_now(self) -> dict[str, Any]:
        return {each.name: _plain(self.get_parameter(each.name).value) for each in parameters_of_node()}

    def _on_parameters(self, changed: Iterable[Any]) -> Any:
        """Go on with changed parameters, or refuse them with the reason."""
        new = {each.name: _plain(each.value) for each in changed}
        now = self._parameters_now()
        fixed = sorted(name for name, value in new.items() if name in AT_START and value != now[name])
        if fixed:
            return SetParametersResult(successful=False, reason=f"{fixed[0]} is read when the node starts: restart it")
        try:
            own = {name: value for name, value in new.items() if name in now}
            self.core.change(NodeSettings.of({**now, **own}))
        except SettingError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _now(self) -> float:
        seconds, nanoseconds = divmod(self.get_clock().now().nanoseconds, 10**9)
        return float(seconds + nanoseconds * 1e-9)  # rounded as stamps are

    def _on_scan(self, msg: Any) -> None:
        try:
            ranges = np.frombuffer(msg.ranges, np.float32)
        except (ValueError, TypeError) as error:
            self.core.dropped(self.core.settings.scan_topic, error)
            return
        angles = msg.angle_min, msg.angle_increment
        limits = msg.time_increment, msg.range_min, msg.range_max
        scan = ros_messages.LaserScan(0, *angles, *limits, ranges, msg.angle_max, msg.header.frame_id)
        self._publish(self.core.on_scan(self._now(), _seconds(msg.header.stamp), scan))

    def _on_points(self, msg: Any) -> None:
        self._publish(self.core.on_cloud(self._now(), _seconds(msg.header.stamp), msg))

    def _on_odometry(self, topic: str, msg: Any) -> None:
        twist, pose = msg.twist.twist, msg.pose.pose
        speeds = twist.linear.x, twist.angular.z, twist.linear.y
        turned = pose.orientation
        at = Pose(pose.position.x, pose.position.y, yaw_of(turned.x, turned.y, turned.z, turned.w))
        self.core.on_odometry(self._now(), _seconds(msg.header.stamp), *speeds, at, topic)

    def _on_speed(self, msg: Any) -> None:
        self.core.on_speed(self._now(), msg.data)

    def _look_for_speed(self) -> None:
        """Subscribe to the speed as soon as it is published: before, its type is not known."""
        topic = self.core.settings.speed_topic
        known = dict(self.get_topic_names_and_types()).get(self.resolve_topic_name(topic), [])
        for name in known:
            if name in SPEEDS:
                of_odometry = partial(self._on_odometry, topic)
                self._subscribe(SPEEDS[name], topic, of_odometry if SPEEDS[name] is Odometry else self._on_speed)
                self._speed_is_known = True
                return
        if known:
            self.core.dropped(topic, f"is {known[0]}, and not one of {', '.join(SPEEDS)}")

    def _publish(self, outputs: Outputs) -> None:
        stamp = self.get_clock().now().to_msg()
        if self._brake:
            self._brake.publish(Bool(data=outputs.brake))
        if self._drive and outputs.drive:
            frame = self.core.settings.base_frame
            self._drive.publish(fill_drive(AckermannDriveStamped(), outputs.drive, stamp, frame))
        if self._marker and self._marker.get_subscription_count() and (cause := self.core.cause()):
            self._marker.publish(fill_marker(Marker(lifetime=Duration(nanosec=500_000_000)), cause, stamp))

    def tick(self) -> None:
        """Publish what the core decides without new data."""
        self._publish(self.core.tick(self._now()))

    def diagnose(self) -> None:
        """Publish the diagnostics."""
        if not self._speed_is_known:
            self._look_for_speed()
        status = self.core.diagnostics(self._now())
        if self._diagnostics:
            stamp = self.get_clock().now().to_msg()
            self._diagnostics.publish(fill_diagnostics(DiagnosticArray(), DiagnosticStatus, KeyValue, status, stamp))


def run(parameters: Mapping[str, Any] | None = None, args: Sequence[str] | None = None) -> None:
    """Run the node until it is shut down.

    Parameters
    ----------
    parameters : mapping, optional
        Settings as ``NodeSettings.of`` takes them; a parameter that ROS gives the node wins.
    args : sequence of str, optional
        ``--ros-args`` and the arguments after it; by default those of the process.

    Raises
    ------
    SettingError
        If a parameter cannot be used.
    """
    rclpy.init(args=args)
    try:
        node = RclpyNode(parameters)
        freeze_heap()
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        rclpy.try_shutdown()


def main() -> None:
    """Run the node, for ``ros2 run ttc_fast_ros brake_node``."""
    run()


def _descriptor(parameter: Setting) -> Any:
    """Describe a parameter to ROS. Its type may change there, because the node takes 1 for 1.0."""
    low_high = parameter.usual
    ranges = [] if low_high is None else [FloatingPointRange(from_value=low_high[0], to_value=low_high[1])]
    return ParameterDescriptor(description=parameter.description, dynamic_typing=True, floating_point_range=ranges)


def _plain(value: Any) -> Any:
    """Return a parameter as a plain value: rclpy hands lists over as arrays."""
    return value if isinstance(value, str) or not hasattr(value, "__iter__") else list(value)


def _seconds(stamp: Any) -> float:
    return float(stamp.sec + stamp.nanosec * 1e-9)
