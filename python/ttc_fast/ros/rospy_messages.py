"""Message types of ROS 1 that the distribution lacks, or whose reading is made safe."""

from __future__ import annotations

from typing import Any

from genpy.dynamic import generate_dynamic

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
"""The same type as ackermann_msgs has, by its MD5 sum; Debian does not package that."""


def forgiving(kind: Any) -> Any:
    """Return a message type that says by ``unreadable`` why it cannot be read, where ``kind`` ends the connection."""

    class Forgiving(kind):  # type: ignore[misc] # made by genpy, which has no types
        unreadable: Exception | None = None

        def deserialize(self, buffer: Any) -> Any:
            try:
                return super().deserialize(buffer)
            except Exception as error:  # whatever generated code may raise over damaged bytes
                self.unreadable = error
                return self

    return Forgiving
