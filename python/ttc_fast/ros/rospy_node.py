"""The brake as a node of ROS 1: convert, call, publish. Needs rospy, which comes with ROS or from Debian."""

from __future__ import annotations

import sys
import threading
import time
from functools import partial
from typing import TYPE_CHECKING, Any

import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from genpy.dynamic import generate_dynamic
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rospy.impl.registration import Registration, get_registration_listeners, get_topic_manager
from rospy.numpy_msg import numpy_msg
from sensor_msgs.msg import Joy, LaserScan, PointCloud2
from std_msgs.msg import Bool, Float32, Float64
from visualization_msgs.msg import Marker

from ttc_fast.ros.core import BrakeNode, freeze_heap, of_ackermann, of_twist, on_transforms
from ttc_fast.ros.messages import fill_diagnostics, fill_drive, fill_marker, odometry_of
from ttc_fast.ros.settings import NodeSettings, SettingError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from ttc_fast.ros.messages import Outputs
    from ttc_fast.ros_messages import Commanded

ACKERMANN = """\
Header header
AckermannDrive drive
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
================================================================================
MSG: ackermann_msgs/AckermannDrive
float32 steering_angle
float32 steering_angle_velocity
float32 speed
float32 acceleration
float32 jerk
"""
AckermannDriveStamped = generate_dynamic("ackermann_msgs/AckermannDriveStamped", ACKERMANN)[
    "ackermann_msgs/AckermannDriveStamped"
]
"""The type of ackermann_msgs, with the same MD5 sum; Debian does not package it."""
TRANSFORMS = """\
geometry_msgs/TransformStamped[] transforms
================================================================================
MSG: geometry_msgs/TransformStamped
Header header
string child_frame_id
geometry_msgs/Transform transform
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
================================================================================
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
"""
TFMessage = generate_dynamic("tf2_msgs/TFMessage", TRANSFORMS)["tf2_msgs/TFMessage"]
"""The type of tf2_msgs, with the same MD5 sum."""
BYTES_AT_ONCE = {LaserScan: 2**18, PointCloud2: 2**24}
"""The bytes that are read from a connection at once. With less than a message, old messages would queue up there."""
LOOK_AT_MASTER = 1.0
"""s between two looks at the master."""


class RospyNode:
    """Subscriptions and publications around a core. rospy calls back from many threads; a lock orders the calls."""

    def __init__(self, settings: NodeSettings) -> None:
        self.core = BrakeNode(settings.resolved(full_name))
        self._lock = threading.Lock()
        self._frame = settings.base_frame
        self._subscriptions: list[Any] = []
        self._brake = _publisher(settings.brake_topic, Bool)
        self._drive = _publisher(settings.drive_topic, AckermannDriveStamped)
        self._diagnostics = _publisher(settings.diagnostics_topic, DiagnosticArray)
        self._marker = _publisher(settings.marker_topic, Marker)
        self._subscribe(settings.scan_topic, LaserScan, self._on_scan, numpy_msg)
        self._subscribe(settings.points_topic, PointCloud2, self._on_points)
        call = partial(self._safely, "/tf_static", partial(on_transforms, self.core))
        self._subscriptions.append(rospy.Subscriber("/tf_static", forgiving(TFMessage), call, queue_size=100))
        for topic in () if settings.speed_topic else settings.odom_topics:
            self._subscribe(topic, Odometry, partial(self._on_odometry, full_name(topic)))
        of_speed = partial(self._on_odometry, full_name(settings.speed_topic))
        speeds: dict[Any, Any] = {Odometry: of_speed, Float32: self._on_speed, Float64: self._on_speed}
        commands: dict[Any, Any] = {AckermannDriveStamped: partial(self._on_commanded, of_ackermann)}
        if not settings.mux:
            commands[Twist] = partial(self._on_commanded, of_twist)
        self._subscribe_by_type(settings.speed_topic, speeds)
        self._subscribe_by_type(settings.driver_topic, commands)
        self._subscribe_by_type(settings.override_topic, {Bool: self._on_override, Joy: self._on_buttons})

    def _subscribe(self, topic: str, kind: Any, take: Callable[[Any], None], variant: Any = lambda kind: kind) -> None:
        if topic:
            call = partial(self._safely, topic, take)
            size = BYTES_AT_ONCE.get(kind, 2**16)
            own, how = forgiving(variant(kind)), {"queue_size": 1, "buff_size": size, "tcp_nodelay": True}
            self._subscriptions.append(rospy.Subscriber(_name(topic), own, call, **how))

    def _subscribe_by_type(self, topic: str, kinds: Mapping[Any, Callable[[Any], None]]) -> None:
        """Subscribe to a topic that may have one of several types; the connection names it."""
        takes = {kind._type: (forgiving(kind), take) for kind, take in kinds.items()}
        self._subscribe(topic, rospy.AnyMsg, partial(self._on_any, full_name(topic), takes))

    def _on_any(self, topic: str, takes: Mapping[str, tuple[Any, Callable[[Any], None]]], msg: Any) -> None:
        name = msg._connection_header["type"]
        if name not in takes:
            self.core.dropped(topic, f"is {name}, and not one of {', '.join(takes)}")
            return
        kind, take = takes[name]
        read = kind().deserialize(msg._buff)
        if read.unreadable is None:
            take(read)
        else:
            self.core.dropped(topic, read.unreadable)

    def _safely(self, topic: str, take: Callable[[Any], None], msg: Any) -> None:
        with self._lock:
            if msg.unreadable is not None:
                self.core.dropped(full_name(topic), msg.unreadable)
            else:
                take(msg)

    def _on_scan(self, msg: Any) -> None:
        self._publish(self.core.on_scan(rospy.get_time(), msg.header.stamp.to_sec(), msg))

    def _on_points(self, msg: Any) -> None:
        self._publish(self.core.on_cloud(rospy.get_time(), msg.header.stamp.to_sec(), msg))

    def _on_odometry(self, topic: str, msg: Any) -> None:
        self.core.on_odometry(rospy.get_time(), msg.header.stamp.to_sec(), *odometry_of(msg), topic)

    def _on_speed(self, msg: Any) -> None:
        self.core.on_speed(rospy.get_time(), msg.data)

    def _on_commanded(self, read: Callable[[Any], Commanded], msg: Any) -> None:
        if (outputs := self.core.on_commanded(rospy.get_time(), read(msg), msg)) is not None:
            self._publish(outputs)

    def _on_override(self, msg: Any) -> None:
        self.core.on_override(rospy.get_time(), msg.data)

    def _on_buttons(self, msg: Any) -> None:
        self.core.on_buttons(rospy.get_time(), msg.buttons)

    def _publish(self, outputs: Outputs) -> None:
        if self._brake:
            self._brake.publish(outputs.brake)
        if self._drive and outputs.forward is not None:
            self._drive.publish(outputs.forward)
        elif self._drive and outputs.drive:
            said = rospy.get_rostime(), self._frame, outputs.steering_angle
            self._drive.publish(fill_drive(AckermannDriveStamped(), outputs.drive, *said))
        if self._marker and self._marker.get_num_connections() and (cause := self.core.cause()):
            self._marker.publish(fill_marker(Marker(lifetime=rospy.Duration(0.5)), cause, rospy.get_rostime()))

    def tick(self) -> None:
        """Publish what the core decides without new data."""
        with self._lock:
            self._publish(self.core.tick(rospy.get_time()))

    def diagnose(self) -> None:
        """Publish the diagnostics."""
        with self._lock:
            status = self.core.diagnostics(rospy.get_time())
        if self._diagnostics:
            array = fill_diagnostics(DiagnosticArray(), DiagnosticStatus, KeyValue, status, rospy.get_rostime())
            self._diagnostics.publish(array)

    def close(self) -> None:
        """Leave the graph."""
        for each in (*self._subscriptions, self._brake, self._drive, self._diagnostics, self._marker):
            if each:
                each.unregister()

    def spin(self) -> None:
        """Run the watchdog until the node is shut down: in wall time, since a simulated clock may stand."""
        diagnose_at = time.monotonic()
        while not rospy.is_shutdown():
            try:
                self.tick()
                if time.monotonic() >= diagnose_at:
                    diagnose_at = time.monotonic() + self.core.settings.diagnostics_period
                    self.diagnose()
            except rospy.ROSException:  # what publish raises once the node is being shut down
                if not rospy.is_shutdown():
                    raise
            time.sleep(self.core.settings.watchdog_period)


def run(parameters: Mapping[str, Any] | None = None, name: str = "ttc_fast") -> None:
    """Run the node until it is shut down. rospy finds remappings (``scan:=/front``, ``_hold:=1.0``) in ``sys.argv``.

    Parameters
    ----------
    parameters : mapping, optional
        Settings as ``NodeSettings.of`` takes them; the node's own parameters on the server win.
    name : str
        The name of the node.

    Raises
    ------
    SettingError
        If a parameter cannot be used.
    """
    rospy.init_node(name)
    settings = NodeSettings.of({**(parameters or {}), **_on_server()})
    node = RospyNode(settings)
    stay_registered()
    freeze_heap()
    node.spin()


def main() -> int:
    """Run the node, for ``rosrun ttc_fast_ros brake_node``."""
    try:
        run()
    except SettingError as error:
        print(f"ttc_fast: {error}", file=sys.stderr)
        return 2
    return 0


def _on_server() -> dict[str, Any]:
    """Wait for a master, and return the node's own parameters."""
    while not rospy.is_shutdown():
        try:
            found = rospy.get_param("~", {})
        except OSError as error:
            rospy.logwarn_throttle(10.0, f"waiting for the master at {rospy.get_master().target.uri}: {error}")
            time.sleep(0.2)
            continue
        if not isinstance(found, dict):
            raise SettingError(f"the parameter {rospy.get_name()} must be a table of settings, got {found!r}")
        return found
    return {}


def _publisher(topic: str, kind: Any) -> Any:
    return rospy.Publisher(_name(topic), kind, queue_size=1, tcp_nodelay=True) if topic else None


def _name(topic: str) -> str:
    """Return the name of a topic as ROS 1 has it, where ~ alone stands for the node."""
    return topic.replace("~/", "~", 1)


def full_name(topic: str) -> str:
    """Return the full name of a topic."""
    resolved: str = rospy.resolve_name(_name(topic))
    return resolved


def forgiving(kind: Any) -> Any:
    """Return a message type that keeps the error of an unreadable message, where ``kind`` would end the connection."""

    class Forgiving(kind):  # type: ignore[misc] # made by genpy, which has no types
        unreadable: Exception | None = None

        def deserialize(self, buffer: Any) -> Any:
            try:
                return super().deserialize(buffer)
            except Exception as error:  # whatever generated code may raise over damaged bytes
                self.unreadable = error
                return self

    return Forgiving


def stay_registered() -> threading.Thread:
    """Register the node again whenever the master has forgotten it: rospy itself registers only once.

    The thread that does it ends with the process.
    """
    thread = threading.Thread(target=_watch_master, name="registration", daemon=True)
    thread.start()
    return thread


def _watch_master() -> None:
    master = rosgraph.Master(rospy.get_name())
    while not rospy.is_shutdown():
        time.sleep(LOOK_AT_MASTER)
        try:
            master.lookupNode(rospy.get_name())
        except rosgraph.MasterError:
            rospy.logwarn("the master does not know this node any more: registering again")
            _register_all()
        except (OSError, rosgraph.MasterException) as error:
            rospy.logwarn_throttle(10.0, f"the master does not answer: {error}")


def _register_all() -> None:
    topics, listeners = get_topic_manager(), get_registration_listeners()
    for name, kind in topics.get_publications():
        listeners.notify_added(name, kind, Registration.PUB)
    for name, kind in topics.get_subscriptions():
        listeners.notify_added(name, kind, Registration.SUB)
