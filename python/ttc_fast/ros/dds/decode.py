"""Single numbers as messages; scans, odometry and clouds are in ``ttc_fast.ros_messages``."""

from __future__ import annotations

import struct

from ttc_fast.ros_messages import CDR, MessageError


def float32(cdr: bytes) -> float:
    """Read a std_msgs/Float32.

    Examples
    --------
    >>> from ttc_fast.ros.dds.decode import float32
    >>> float32(bytes([0, 1, 0, 0]) + bytes([0, 0, 0xC0, 0x3F]))
    1.5
    """
    return _number(cdr, "f")


def float64(cdr: bytes) -> float:
    """Read a std_msgs/Float64."""
    return _number(cdr, "d")


def _number(cdr: bytes, kind: str) -> float:
    order = "<" if CDR.of(cdr, 0, len(cdr)).native else ">"
    number = struct.Struct(order + kind)
    if len(cdr) < 4 + number.size:
        raise MessageError(f"is cut short: it needs {4 + number.size} bytes, and has {len(cdr)}")
    value: float
    (value,) = number.unpack_from(cdr, 4)
    return value
