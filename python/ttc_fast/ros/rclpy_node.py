"""The brake as a node of ROS 2: convert, call, publish. Needs rclpy and ackermann_msgs, which come with ROS 2."""

from __future__ import annotations

import sys
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import rclpy
from ackermann_msgs.msg import AckermannDriveStamped
from builtin_interfaces.msg import Duration
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import NameValidationException, NotInitializedException, ParameterException
from rclpy.executors import ExternalShutdownException
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Joy, LaserScan, PointCloud2
from std_msgs.msg import Bool, Float32, Float64
from visualization_msgs.msg import Marker

from ttc_fast import ros_messages
from ttc_fast.configuration import PARTS
from ttc_fast.ros.core import BrakeNode, freeze_heap, of_ackermann, of_twist, on_transforms
from ttc_fast.ros.files import OF_EVERY_NODE
from ttc_fast.ros.messages import fill_diagnostics, fill_drive, fill_marker, odometry_of
from ttc_fast.ros.settings import AT_START, NodeSettings, SettingError, parameters_of_node

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from ttc_fast._settings import Setting
    from ttc_fast.ros.messages import Outputs
    from ttc_fast.ros_messages import Commanded

REFUSED = (
    ParameterException,
    NameValidationException,
    rclpy_implementation.RCLError,
    rclpy_implementation.RCLInvalidROSArgsError,
    rclpy_implementation.UnknownROSArgsError,
)
"""What rclpy raises over arguments, names and values that it refuses."""


class RclpyNode(Node):  # type: ignore[misc] # rclpy has no types here
    """Subscriptions, publications and parameters around a core."""

    def __init__(self, given: Mapping[str, Any] | None = None, name: str = "ttc_fast") -> None:
        super().__init__(name, automatically_declare_parameters_from_overrides=True)
        by_ros = {each: _plain(parameter.value) for each, parameter in self.get_parameters_by_prefix("").items()}
        known = {each.name for each in parameters_of_node()}
        given = {**(given or {}), **{each: value for each, value in by_ros.items() if each in known}}
        for each in parameters_of_node():
            if each.name in by_ros:  # rclpy declared it, without a description
                self.undeclare_parameter(each.name)
            value = given.get(each.name, each.plain_default)
            self.declare_parameter(each.name, value, _descriptor(each, value), True)
        self._parts = {name: given[name] for name in PARTS if name in given}
        self._parts |= {each: by_ros[each] for each in by_ros if each not in known and not _of_every_node(each)}
        settings = self._settings(self._parameters_now())
        self.core = BrakeNode(settings.resolved(self.resolve_topic_name))
        self.add_on_set_parameters_callback(self._on_parameters)
        self._brake = self._publisher(Bool, settings.brake_topic)
        self._drive = self._publisher(AckermannDriveStamped, settings.drive_topic)
        self._diagnostics = self._publisher(DiagnosticArray, settings.diagnostics_topic)
        self._marker = self._publisher(Marker, settings.marker_topic)
        self._subscribe(LaserScan, settings.scan_topic, self._on_scan)
        self._subscribe(PointCloud2, settings.points_topic, self._on_points)
        self._subscribe_to_transforms()
        for topic in () if settings.speed_topic else settings.odom_topics:
            self._subscribe(Odometry, topic, self._odometry_of(topic))
        of_ackermann_drive = partial(self._on_commanded, of_ackermann)
        speeds = {Odometry: self._odometry_of(settings.speed_topic), Float32: self._on_speed, Float64: self._on_speed}
        commands = {AckermannDriveStamped: of_ackermann_drive, Twist: partial(self._on_commanded, of_twist)}
        if settings.mux:
            self._subscribe(AckermannDriveStamped, settings.driver_topic, of_ackermann_drive)
            commands = {}
        overrides = {Bool: self._on_override, Joy: self._on_buttons}
        by_type: dict[str, dict[Any, Any]] = {
            settings.speed_topic: speeds,
            settings.driver_topic: commands,
            settings.override_topic: overrides,
        }
        self._unknown = {topic: kinds for topic, kinds in by_type.items() if topic and kinds}
        # The timers run in steady time, so that they also act while a simulated clock stands.
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(settings.watchdog_period, self.tick, clock=self._steady)
        self.create_timer(settings.diagnostics_period, self.diagnose, clock=self._steady)

    def _settings(self, parameters: Mapping[str, Any]) -> NodeSettings:
        return NodeSettings.of({**parameters, **self._parts})

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
            self.core.change(self._settings({**now, **own}).resolved(self.resolve_topic_name))
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

    def _odometry_of(self, topic: str) -> Callable[[Any], None]:
        """Return what takes the odometry of a topic."""
        return partial(self._on_odometry, self.resolve_topic_name(topic) if topic else "")

    def _on_odometry(self, topic: str, msg: Any) -> None:
        self.core.on_odometry(self._now(), _seconds(msg.header.stamp), *odometry_of(msg), topic)

    def _on_speed(self, msg: Any) -> None:
        self.core.on_speed(self._now(), msg.data)

    def _on_commanded(self, read: Callable[[Any], Commanded], msg: Any) -> None:
        if (outputs := self.core.on_commanded(self._now(), read(msg), msg)) is not None:
            self._publish(outputs)

    def _on_override(self, msg: Any) -> None:
        self.core.on_override(self._now(), msg.data)

    def _on_buttons(self, msg: Any) -> None:
        self.core.on_buttons(self._now(), msg.buttons)

    def _look_for_types(self) -> Iterable[tuple[str, str]]:
        """Subscribe to topics that are published by now, and return the others with a type that none of theirs is."""
        wrong = []
        for topic, kinds in list(self._unknown.items()):
            found = {each.topic_type for each in self.get_publishers_info_by_topic(topic)}
            by_name = {_type_name(kind): kind for kind in kinds}
            if chosen := found & set(by_name):
                kind = by_name[min(chosen)]
                self._subscribe(kind, topic, self._unknown.pop(topic)[kind])
            elif found:
                wrong.append((topic, f"is {min(found)}, and not one of {', '.join(by_name)}"))
        return wrong

    def _publish(self, outputs: Outputs) -> None:
        stamp = self.get_clock().now().to_msg()
        if self._brake:
            self._brake.publish(Bool(data=outputs.brake))
        if self._drive and outputs.forward is not None:
            self._drive.publish(outputs.forward)
        elif self._drive and outputs.drive:
            said = stamp, self.core.settings.base_frame, outputs.steering_angle
            self._drive.publish(fill_drive(AckermannDriveStamped(), outputs.drive, *said))
        if self._marker and self._marker.get_subscription_count() and (cause := self.core.cause()):
            self._marker.publish(fill_marker(Marker(lifetime=Duration(nanosec=500_000_000)), cause, stamp))

    def tick(self) -> None:
        """Publish what the core decides without new data."""
        self._look_for_types()
        self._publish(self.core.tick(self._now()))

    def close(self) -> None:
        """Leave the graph."""
        self.destroy_node()

    def diagnose(self) -> None:
        """Publish the diagnostics."""
        for topic, why in self._look_for_types():
            self.core.dropped(self.resolve_topic_name(topic), why)
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
    is_up = False
    try:
        rclpy.init(args=args)
        is_up = True
        node = RclpyNode(parameters)
    except (*REFUSED, NotInitializedException) as error:
        if is_up and not rclpy.ok():  # a signal has shut everything down before the node was made
            return
        rclpy.try_shutdown()
        raise SettingError(f"rclpy refuses this: {' '.join(str(error).split())}") from None
    try:
        freeze_heap()
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except rclpy_implementation.RCLError:  # what a call raises once a signal has shut everything down
        if rclpy.ok():
            raise
    finally:
        node.close()
        rclpy.try_shutdown()


def main() -> int:
    """Run the node, for ``ros2 run ttc_fast_ros brake_node``."""
    try:
        run()
    except SettingError as error:
        print(f"ttc_fast: {error}", file=sys.stderr)
        return 2
    return 0


def _type_name(kind: Any) -> str:
    """Return the name of the type of a message, as the graph has it."""
    return f"{kind.__module__.partition('.')[0]}/msg/{kind.__name__}"


def _of_every_node(parameter: str) -> bool:
    return parameter.partition(".")[0] in OF_EVERY_NODE


def _descriptor(parameter: Setting, value: Any) -> Any:
    """Describe a parameter to ROS. Its type may change there, because the node takes 1 for 1.0.

    ROS would refuse a value beyond the range of the slider, which may be right: then there is no slider.
    """
    low, high = parameter.usual or (1.0, 0.0)
    inside = isinstance(value, (int, float)) and low <= value <= high
    ranges = [FloatingPointRange(from_value=low, to_value=high)] if inside else []
    return ParameterDescriptor(description=parameter.description, dynamic_typing=True, floating_point_range=ranges)


def _plain(value: Any) -> Any:
    """Return a parameter as a plain value: rclpy hands lists over as arrays."""
    return value if isinstance(value, str) or not hasattr(value, "__iter__") else list(value)


def _seconds(stamp: Any) -> float:
    return float(stamp.sec + stamp.nanosec * 1e-9)
