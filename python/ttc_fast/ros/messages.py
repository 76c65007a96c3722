"""What a node publishes: plain values, and the messages of ROS filled from them; and the odometry that it takes.

The fields are the same in rospy, in rclpy and over DDS; an adapter hands over a message, and its own time stamp.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from ttc_fast.brake import Command
from ttc_fast.ros_messages import yaw_of
from ttc_fast.sensors.odometry import Pose

if TYPE_CHECKING:
    from ttc_fast.brake import Decision

OK, WARN, ERROR, STALE = range(4)
"""Levels of diagnostic_msgs/DiagnosticStatus."""
SPHERE = 2
"""visualization_msgs/Marker.SPHERE."""
COLOURS = {Command.NONE: (0.0, 0.8, 0.0), Command.WARN: (1.0, 0.7, 0.0), Command.BRAKE: (1.0, 0.0, 0.0)}


def odometry_of(msg: Any) -> tuple[float, float, float, Pose]:
    """Return speed, yaw rate, lateral speed and pose of a nav_msgs/Odometry, m/s, rad/s and m."""
    twist, at, turned = msg.twist.twist, msg.pose.pose.position, msg.pose.pose.orientation
    yaw = yaw_of(turned.x, turned.y, turned.z, turned.w)
    return twist.linear.x, twist.angular.z, twist.linear.y, Pose(at.x, at.y, yaw)


class Drive(NamedTuple):
    """A request to the vehicle, as in ackermann_msgs/AckermannDrive.

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
    """The answer to a scan, a cloud or a tick.

    Attributes
    ----------
    brake : bool
        For ``brake_topic``.
    drive : Drive or None
        For ``drive_topic``; None is silence.
    decision : Decision
        The decision from which both come.
    steering_angle : float
        The steering angle of ``drive``, rad: what the driver asks for.
    forward : object or None
        The driver's message, which goes out on ``drive_topic`` as it came.
    """

    brake: bool
    drive: Drive | None
    decision: Decision
    steering_angle: float = 0.0
    forward: Any = None


class Diagnostics(NamedTuple):
    """For ``diagnostics_topic``, as in diagnostic_msgs/DiagnosticStatus."""

    level: int
    name: str
    message: str
    values: list[tuple[str, str]]


class Cause(NamedTuple):
    """For ``marker_topic``: the position of the beam or point that decided, in a frame, m."""

    frame: str
    x: float
    y: float
    command: Command
    text: str


def fill_drive(message: Any, drive: Drive, stamp: Any, frame: str, steering_angle: float = 0.0) -> Any:
    """Fill an ackermann_msgs/AckermannDriveStamped."""
    message.header.stamp, message.header.frame_id = stamp, frame
    message.drive.speed, message.drive.acceleration = float(drive.speed), float(drive.acceleration)
    message.drive.steering_angle = float(steering_angle)
    return message


def fill_diagnostics(message: Any, status: Any, pair: Any, diagnostics: Diagnostics, stamp: Any) -> Any:
    """Fill a diagnostic_msgs/DiagnosticArray; ``status`` and ``pair`` make a DiagnosticStatus and a KeyValue."""
    message.header.stamp = stamp
    name, text = sendable(diagnostics.name), sendable(diagnostics.message)
    one = status(name=name, message=text, hardware_id="ttc_fast")
    one.level = type(one.level)([diagnostics.level]) if isinstance(one.level, bytes) else diagnostics.level
    one.values = [pair(key=sendable(key), value=sendable(value)) for key, value in diagnostics.values]
    message.status = [one]
    return message


def fill_marker(message: Any, cause: Cause, stamp: Any) -> Any:
    """Fill a visualization_msgs/Marker; the caller sets how long it lives."""
    message.header.stamp, message.header.frame_id = stamp, cause.frame
    message.ns, message.text, message.type = "ttc_fast", sendable(cause.text), SPHERE
    message.pose.position.x, message.pose.position.y = float(cause.x), float(cause.y)
    message.pose.orientation.w = 1.0
    message.scale.x = message.scale.y = message.scale.z = 0.2
    message.color.r, message.color.g, message.color.b = COLOURS[cause.command]
    message.color.a = 1.0
    return message


def sendable(text: str) -> str:
    r"""Return a text as a message can carry it: without what UTF-8 cannot encode, and up to its first zero.

    Examples
    --------
    >>> from ttc_fast.ros.messages import sendable
    >>> sendable("a\0b"), sendable("\ud800")
    ('a', '?')
    """
    return text.encode("utf-8", "replace").partition(b"\0")[0].decode()
