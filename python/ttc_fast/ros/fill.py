"""Messages that rospy and rclpy publish, filled from what the core says; the fields are the same in both."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ttc_fast.brake import Command

if TYPE_CHECKING:
    from ttc_fast.ros.outputs import Cause, Diagnostics, Drive

SPHERE = 2
"""visualization_msgs/Marker.SPHERE."""
COLOURS = {Command.NONE: (0.0, 0.8, 0.0), Command.WARN: (1.0, 0.7, 0.0), Command.BRAKE: (1.0, 0.0, 0.0)}


def fill_drive(message: Any, drive: Drive, stamp: Any, frame: str) -> Any:
    """Fill an ackermann_msgs/AckermannDriveStamped."""
    message.header.stamp, message.header.frame_id = stamp, frame
    message.drive.speed, message.drive.acceleration = float(drive.speed), float(drive.acceleration)
    return message


def fill_diagnostics(message: Any, status: Any, pair: Any, diagnostics: Diagnostics, stamp: Any) -> Any:
    """Fill a diagnostic_msgs/DiagnosticArray; ``status`` and ``pair`` make a DiagnosticStatus and a KeyValue."""
    message.header.stamp = stamp
    one = status(name=diagnostics.name, message=diagnostics.message, hardware_id="ttc_fast")
    one.level = type(one.level)([diagnostics.level]) if isinstance(one.level, bytes) else diagnostics.level
    one.values = [pair(key=key, value=value) for key, value in diagnostics.values]
    message.status = [one]
    return message


def fill_marker(message: Any, cause: Cause, stamp: Any) -> Any:
    """Fill a visualization_msgs/Marker; the caller sets how long it lives."""
    message.header.stamp, message.header.frame_id = stamp, cause.frame
    message.ns, message.text, message.type = "ttc_fast", cause.text, SPHERE
    message.pose.position.x, message.pose.position.y = float(cause.x), float(cause.y)
    message.pose.orientation.w = 1.0
    message.scale.x = message.scale.y = message.scale.z = 0.2
    message.color.r, message.color.g, message.color.b = COLOURS[cause.command]
    message.color.a = 1.0
    return message
