"""One interface to the node, with nothing around its core, or rospy, or rclpy."""

from __future__ import annotations

import io
import math
import warnings
from functools import partial
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pytest

from ttc_fast.ros.core import BrakeNode
from ttc_fast.ros.settings import NodeSettings
from ttc_fast.ros_messages import Commanded, Transform

if TYPE_CHECKING:
    from collections.abc import Callable

    from ttc_fast.sensors.odometry import Pose

LEFTMOST = np.pi / 2
BEAMS = 181
GEOMETRY = {
    "angle_min": -LEFTMOST,
    "angle_increment": 2 * LEFTMOST / (BEAMS - 1),
    "time_increment": 0.0,
    "range_min": 0.05,
    "range_max": 30.0,
}


AT_ONCE = {"trigger": [1, 1], "release": [1, 1], "hold": 0.0, "stopping_distance": False, "use_range_rate": False}
"""A frame decides by itself."""


class Seen(NamedTuple):
    """The last messages that the node published."""

    brake: bool | None
    speed: float | None
    acceleration: float | None


class Status(NamedTuple):
    """The last diagnostics."""

    level: int
    message: str
    values: dict[str, str]


DATATYPES = {"u2": 4, "f4": 7, "f8": 8}


def records_of(points: Any) -> Any:
    """Return rows x, y, z as records of float32; records stay as they are."""
    points = np.asarray(points)
    if points.dtype.names:
        return points
    rows = np.ascontiguousarray(points, np.float32)
    return rows.view([(name, "<f4") for name in "xyz"])[..., 0]


def fields_of(records: Any) -> list[dict[str, Any]]:
    """Return the fields of the records, as PointField has them."""
    described = records.dtype.fields.items()
    return [
        {"name": name, "offset": offset, "datatype": DATATYPES[kind.str[1:]], "count": 1}
        for name, (kind, offset) in described
    ]


def shape_of(records: Any) -> dict[str, int]:
    """Return the shape of the cloud, as PointCloud2 has it."""
    height, width = records.shape if records.ndim == 2 else (1, len(records))
    step = records.dtype.itemsize
    return {"height": height, "width": width, "point_step": step, "row_step": step * width}


class Drive(NamedTuple):
    """The numbers of an AckermannDrive."""

    speed: float
    steering_angle: float = 0.0
    acceleration: float = 0.0
    jerk: float = 0.0
    steering_angle_velocity: float = 0.0


class Harness:
    """A node under test."""

    def close(self) -> None:
        """Leave the graph, where there is one."""


class CoreHarness(Harness):
    """The core by itself."""

    def __init__(self, **parameters: Any) -> None:
        self.now = 100.0
        self.node = BrakeNode(NodeSettings.of(parameters))

    def scan(self, ranges: Any, *, stamp: float | None = None, frame: str = "", **geometry: Any) -> Seen:
        scan = SimpleNamespace(**{**GEOMETRY, **geometry}, frame_id=frame, ranges=np.asarray(ranges, np.float32))
        return self._seen(self.node.on_scan(self.now, self.now if stamp is None else stamp, scan))

    def points(self, points: Any, *, frame: str = "", stamp: float | None = None) -> Seen:
        if not frame:
            return self._seen(self.node.on_points(self.now, self.now, np.asarray(points, np.float32)))
        records = records_of(points)
        fields = [SimpleNamespace(**each) for each in fields_of(records)]
        cloud = SimpleNamespace(
            **shape_of(records), fields=fields, data=records.tobytes(), is_bigendian=False, frame_id=frame
        )
        return self._seen(self.node.on_cloud(self.now, self.now if stamp is None else stamp, cloud))

    def odometry(
        self,
        speed: float,
        yaw_rate: float = 0.0,
        *,
        stamp: float | None = None,
        topic: str = "/odom",
        lateral_speed: float = 0.0,
        pose: Pose | None = None,
    ) -> None:
        stamp = self.now if stamp is None else stamp
        self.node.on_odometry(self.now, stamp, speed, yaw_rate, lateral_speed, pose, topic)

    def transform(self, parent: str, child: str, at: Any, rotation: Any) -> None:
        self.node.on_transforms([Transform(parent, child, at, rotation)])

    def speed(self, speed: float, kind: str, topic: str) -> None:
        if kind == "Odometry":
            self.odometry(speed)
        else:
            self.node.on_speed(self.now, speed)

    def ask(self, speed: float, steering_angle: float = 0.0, topic: str = "/drive_in", **more: float) -> list[Drive]:
        message = Drive(speed, steering_angle, **more)
        outputs = self.node.on_commanded(self.now, Commanded(speed, steering_angle=steering_angle), message)
        if outputs is None:
            return []
        if outputs.forward is not None:
            return [outputs.forward]
        assert outputs.drive is not None
        return [Drive(outputs.drive.speed, outputs.steering_angle, outputs.drive.acceleration)]

    def twist(self, speed: float, yaw_rate: float, topic: str = "/cmd_vel") -> None:
        self.node.on_commanded(self.now, Commanded(speed, yaw_rate=yaw_rate))

    def override(self, taken_over: bool, topic: str = "/override") -> None:
        self.node.on_override(self.now, taken_over)

    def press(self, buttons: list[int], topic: str = "/joy") -> None:
        self.node.on_buttons(self.now, buttons)

    def steering_angle(self) -> float:
        return self.node.tick(self.now).steering_angle

    def wait(self, seconds: float) -> Seen:
        self.now += seconds
        return self._seen(self.node.tick(self.now))

    def diagnostics(self) -> Status:
        said = self.node.diagnostics(self.now)
        return Status(said.level, said.message, dict(said.values))

    def cause(self) -> tuple[float, float] | None:
        cause = self.node.cause()
        return None if cause is None else (cause.x, cause.y)

    @staticmethod
    def _seen(outputs: Any) -> Seen:
        return Seen(outputs.brake, *(outputs.drive or (None, None)))


class MessageHarness(Harness):
    """The part that rospy and rclpy share: messages in, messages out."""

    node: Any

    def __init__(self) -> None:
        self.now = 100.0
        self.published: dict[str, list[Any]] = {}

    def message(self, package: str, name: str) -> Any:
        """Return a new message."""
        return getattr(__import__(f"{package}.msg", fromlist=[name]), name)()

    def deliver(self, topic: str, message: Any) -> None:
        raise NotImplementedError

    def stamp(self, seconds: float) -> Any:
        raise NotImplementedError

    def scan(self, ranges: Any, *, stamp: float | None = None, frame: str = "", **geometry: Any) -> Seen:
        message = self.message("sensor_msgs", "LaserScan")
        message.header.frame_id = frame
        for name, value in {**GEOMETRY, **geometry}.items():
            setattr(message, name, float(value))
        message.ranges = [float(each) for each in np.asarray(ranges, np.float32)]
        return self.sent("/scan", message, stamp)

    def points(self, points: Any, *, frame: str = "", stamp: float | None = None, **header: Any) -> Seen:
        message = self.message("sensor_msgs", "PointCloud2")
        message.header.frame_id = frame
        records = records_of(points)
        for each in fields_of(records):
            field = self.message("sensor_msgs", "PointField")
            for name, value in each.items():
                setattr(field, name, value)
            message.fields.append(field)
        message.data = records.tobytes()
        for name, value in {**shape_of(records), **header}.items():
            setattr(message, name, value)
        return self.sent("/points", message, stamp)

    def odometry(
        self,
        speed: float,
        yaw_rate: float = 0.0,
        *,
        stamp: float | None = None,
        topic: str = "/odom",
        lateral_speed: float = 0.0,
        pose: Pose | None = None,
    ) -> None:
        message = self.message("nav_msgs", "Odometry")
        message.twist.twist.linear.x, message.twist.twist.angular.z = float(speed), float(yaw_rate)
        message.twist.twist.linear.y = float(lateral_speed)
        if pose is not None:
            position, turned = message.pose.pose.position, message.pose.pose.orientation
            position.x, position.y = float(pose.x), float(pose.y)
            turned.z, turned.w = math.sin(pose.yaw / 2), math.cos(pose.yaw / 2)
        self.sent(topic, message, stamp)

    def speed(self, speed: float, kind: str, topic: str) -> None:
        if kind == "Odometry":
            self.odometry(speed, topic=topic)
        else:
            message = self.message("std_msgs", kind)
            message.data = float(speed)
            self.deliver(topic, message)

    def announce(self, topic: str, package: str, kind: str) -> None:
        """Publish a topic, where the node has to find its type in the graph."""

    def ask(self, speed: float, steering_angle: float = 0.0, topic: str = "/drive_in", **more: float) -> list[Drive]:
        message = self.message("ackermann_msgs", "AckermannDriveStamped")
        for name, value in Drive(speed, steering_angle, **more)._asdict().items():
            setattr(message.drive, name, float(value))
        message.header.frame_id = "driver"
        self.announce(topic, "ackermann_msgs", "AckermannDriveStamped")
        self.sent(topic, message)
        published = [each.drive for each in self.published.get("/drive", [])]
        return [Drive(*(getattr(each, name) for name in Drive._fields)) for each in published]

    def twist(self, speed: float, yaw_rate: float, topic: str = "/cmd_vel") -> None:
        message = self.message("geometry_msgs", "Twist")
        message.linear.x, message.angular.z = float(speed), float(yaw_rate)
        self.announce(topic, "geometry_msgs", "Twist")
        self.deliver(topic, message)

    def override(self, taken_over: bool, topic: str = "/override") -> None:
        message = self.message("std_msgs", "Bool")
        message.data = taken_over
        self.announce(topic, "std_msgs", "Bool")
        self.deliver(topic, message)

    def press(self, buttons: list[int], topic: str = "/joy") -> None:
        message = self.message("sensor_msgs", "Joy")
        message.axes, message.buttons = [0.5, -0.5, 1.0], buttons
        self.announce(topic, "sensor_msgs", "Joy")
        self.sent(topic, message)

    def steering_angle(self) -> float:
        self.published.clear()
        self.node.tick()
        angle: float = self.published["/drive"][-1].drive.steering_angle
        return angle

    def transform(self, parent: str, child: str, at: Any, rotation: Any) -> None:
        message, placed = self.message("tf2_msgs", "TFMessage"), self.message("geometry_msgs", "TransformStamped")
        placed.header.frame_id, placed.child_frame_id = parent, child
        translation, turned = placed.transform.translation, placed.transform.rotation
        translation.x, translation.y, translation.z = map(float, at)
        turned.x, turned.y, turned.z, turned.w = map(float, rotation)
        message.transforms = [placed]
        self.deliver("/tf_static", message)

    def sent(self, topic: str, message: Any, stamp: float | None = None) -> Seen:
        message.header.stamp = self.stamp(self.now if stamp is None else stamp)
        return self.seen(lambda: self.deliver(topic, message))

    def wait(self, seconds: float) -> Seen:
        self.now += seconds
        return self.seen(self.node.tick)

    def seen(self, act: Callable[[], object]) -> Seen:
        self.published.clear()
        act()
        brakes, drives = self.published.get("/brake_bool", []), self.published.get("/drive", [])
        brake = brakes[-1].data if brakes else None
        return Seen(brake, *((drives[-1].drive.speed, drives[-1].drive.acceleration) if drives else (None, None)))

    def diagnostics(self) -> Status:
        self.node.diagnose()
        status = self.published["/diagnostics"][-1].status[0]
        level = status.level[0] if isinstance(status.level, bytes) else status.level
        return Status(level, status.message, {each.key: each.value for each in status.values})

    def cause(self) -> tuple[float, float] | None:
        markers = self.published.get("/ttc_fast/cause")
        return (markers[-1].pose.position.x, markers[-1].pose.position.y) if markers else None


class RospyHarness(MessageHarness):
    """The adapter of rospy with its real messages, written and read again; only the connections are not there."""

    def __init__(self, patch: pytest.MonkeyPatch, **parameters: Any) -> None:
        rospy = pytest.importorskip("rospy", reason="needs rospy: make ros1 installs it on Debian and Ubuntu")
        from ttc_fast.ros.rospy_node import RospyNode

        super().__init__()
        harness = self
        self.subscriptions: dict[str, tuple[Any, Any]] = {}

        class Publisher:
            def __init__(self, topic: str, kind: Any, **_: Any) -> None:
                self.topic, self.kind = rospy.resolve_name(topic), kind

            def publish(self, value: Any) -> None:
                message = value if isinstance(value, self.kind) else self.kind(value)
                harness.published.setdefault(self.topic, []).append(self.kind().deserialize(written(message)))

            def get_num_connections(self) -> int:
                return 1

        def subscriber(topic: str, kind: Any, call: Any, **_: Any) -> None:
            harness.subscriptions[rospy.resolve_name(topic)] = kind, call

        patch.setattr(rospy, "Publisher", Publisher)
        patch.setattr(rospy, "Subscriber", subscriber)
        patch.setattr(rospy, "get_time", lambda: harness.now)
        patch.setattr(rospy, "get_rostime", lambda: rospy.Time.from_sec(harness.now))
        self.rospy = rospy
        self.node = RospyNode(NodeSettings.of(parameters))

    def message(self, package: str, name: str) -> Any:
        from ttc_fast.ros import rospy_node  # Debian does not install every package with rospy

        own = {"tf2_msgs": "TFMessage", "ackermann_msgs": "AckermannDriveStamped"}
        return getattr(rospy_node, own[package])() if package in own else super().message(package, name)

    def stamp(self, seconds: float) -> Any:
        return self.rospy.Time.from_sec(seconds)

    def deliver(self, topic: str, message: Any) -> None:
        self.deliver_bytes(topic, written(message), message._type)

    def deliver_bytes(self, topic: str, data: bytes, kind: str) -> None:
        expected, call = self.subscriptions[topic]
        message = expected()
        message._connection_header = {"type": kind}
        call(message.deserialize(data))


def written(message: Any) -> bytes:
    """Return a message of ROS 1 as it is on the wire."""
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


class RclpyHarness(MessageHarness):
    """The adapter of rclpy with its real messages, serialised and read again; no other node hears it."""

    def __init__(self, patch: pytest.MonkeyPatch, **parameters: Any) -> None:
        self.rclpy = pytest.importorskip("rclpy", reason="needs rclpy: make ros2 installs it, and its tests run there")
        from rclpy.serialization import deserialize_message, serialize_message

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # its generators of messages use modules that are deprecated
            from ttc_fast.ros.rclpy_node import RclpyNode

        def again(message: Any) -> Any:
            return deserialize_message(serialize_message(message), type(message))

        self.again = again
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF")
        if not self.rclpy.ok():
            self.rclpy.init(args=[])
        self.node = RclpyNode(parameters)
        self.clock = self.node.get_clock()
        self.clock._set_ros_time_is_active(True)
        super().__init__()
        for each in self.node.publishers:
            patch.setattr(each, "publish", partial(self._hear, each.topic_name))
            patch.setattr(each, "get_subscription_count", lambda: 1)

    def _hear(self, topic: str, message: Any) -> None:
        self.published.setdefault(topic, []).append(self.again(message))

    def close(self) -> None:
        self.node.destroy_node()
        self.rclpy.try_shutdown()

    @property
    def now(self) -> float:
        return self._now

    @now.setter
    def now(self, seconds: float) -> None:
        self._now = seconds
        self.clock.set_ros_time_override(self.rclpy.time.Time(nanoseconds=round(seconds * 1e9)))

    def stamp(self, seconds: float) -> Any:
        return self.rclpy.time.Time(nanoseconds=round(seconds * 1e9)).to_msg()

    def deliver(self, topic: str, message: Any) -> None:
        (subscription,) = [each for each in self.node.subscriptions if each.topic_name == topic]
        assert isinstance(message, subscription.msg_type)
        subscription.callback(self.again(message))

    def speed(self, speed: float, kind: str, topic: str) -> None:
        self.announce(topic, "nav_msgs" if kind == "Odometry" else "std_msgs", kind)
        super().speed(speed, kind, topic)

    def announce(self, topic: str, package: str, kind: str) -> None:
        """Publish a topic, so that the node finds its type."""
        if self.node.count_publishers(topic) == 0:
            self.node.create_publisher(type(self.message(package, kind)), topic, 1)
        self.node.diagnose()
