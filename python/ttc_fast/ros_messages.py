"""LaserScan, Odometry and PointCloud2 as views over serialised messages of ROS 1, and of ROS 2 and DDS (CDR).

Only a few numbers are copied: ``ranges`` and ``data`` stay in the buffer of the message, at any alignment. Every length
is checked against the end of the message before it is used.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

LASER_SCAN = "sensor_msgs/LaserScan"
ODOMETRY = "nav_msgs/Odometry"
POINT_CLOUD = "sensor_msgs/PointCloud2"
TRANSFORMS = ("tf2_msgs/TFMessage", "tf/tfMessage")


class MessageError(ValueError):
    """A message that does not fit its type: it is cut short, or has another layout."""


class LaserScan(NamedTuple):
    """The fields of a sensor_msgs/LaserScan that ``ScanTTC`` needs; ``ScanTTC.from_message`` takes it.

    Attributes
    ----------
    stamp : int
        The stamp of the header, ns; 0 where the sender set none.
    ranges : ndarray, float32, shape (beams,)
        m; a view, of any alignment. A copy if the message is big-endian.
    frame_id : str
        The frame of the header: which sensor it is, and where it sits.
    """

    stamp: int
    angle_min: float
    angle_increment: float
    time_increment: float
    range_min: float
    range_max: float
    ranges: NDArray[np.float32]
    angle_max: float = 0.0
    frame_id: str = ""


class Odometry(NamedTuple):
    """The fields of a nav_msgs/Odometry that a vehicle on the ground needs.

    Attributes
    ----------
    stamp : int
        The stamp of the header, ns; 0 where the sender set none.
    x, y, yaw : float
        The pose, m and rad.
    speed, lateral_speed, yaw_rate : float
        The twist in the frame of the vehicle: forward and to the left (m/s), counter-clockwise (rad/s).
    """

    stamp: int
    x: float
    y: float
    yaw: float
    speed: float
    lateral_speed: float
    yaw_rate: float


@dataclass(frozen=True)
class PointField:
    """A field of a point, with the names of sensor_msgs/PointField."""

    name: str
    offset: int
    datatype: int
    count: int


class PointCloud2(NamedTuple):
    """A sensor_msgs/PointCloud2 that ``from_pointcloud2`` takes; ``stamp`` (ns) and ``frame_id`` are its header's."""

    stamp: int
    height: int
    width: int
    fields: tuple[PointField, ...]
    is_bigendian: bool
    point_step: int
    row_step: int
    data: memoryview
    frame_id: str = ""


class Transform(NamedTuple):
    """A geometry_msgs/TransformStamped: where a frame is in its parent, m, and as a quaternion x, y, z, w."""

    parent: str
    child: str
    translation: tuple[float, float, float]
    rotation: tuple[float, float, float, float]


class Commanded(NamedTuple):
    """What a driver or planner asks for.

    Attributes
    ----------
    speed, lateral_speed : float
        Forward and to the left, m/s.
    yaw_rate : float
        Counter-clockwise, rad/s.
    steering_angle : float
        The angle of the front wheels, to the left, rad.
    """

    speed: float
    lateral_speed: float = 0.0
    yaw_rate: float = 0.0
    steering_angle: float = 0.0


class Encoding:
    """The encoding of a message: the order of its bytes, and the alignment of its numbers.

    ``ROS1`` and ``CDR`` are the two to choose from. The first bytes of a CDR message name its order.
    """

    def __init__(self, order: str, stamp: str, *, widest: int) -> None:
        self.native = order == "<"
        self.widest = widest  # what a float64 is aligned to, bytes; 1 aligns nothing
        self.align = widest > 1
        # The first four bytes are the sequence number in ROS 1, and the kind of encoding in CDR.
        self.header = struct.Struct(f"{order}4x{stamp}")
        self.count = struct.Struct(f"{order}I")
        self.scan = struct.Struct(f"{order}7fI")
        self.odometry = struct.Struct(f"{order}7d288x6d")  # the covariance of the pose lies between
        self.transform = struct.Struct(f"{order}7d")
        self.size = struct.Struct(f"{order}3I")
        self.field = struct.Struct(f"{order}IB")
        self.steps = struct.Struct(f"{order}3I")
        self.ranges = np.dtype(f"{order}f4")

    def of(self, buffer: Any, start: int, end: int) -> Encoding:
        """Return the encoding of one message."""
        return self


class _AnyCdr(Encoding):
    """CDR, whose messages name their order of bytes at the start."""

    def of(self, buffer: Any, start: int, end: int) -> Encoding:
        if end - start < 4:
            raise MessageError(f"has {end - start} bytes, and CDR starts with 4 that say its kind: cut short")
        kind = (buffer[start] << 8) | buffer[start + 1]
        found = _CDR_KINDS.get(kind)
        if found is None:
            raise MessageError(f"starts with {bytes(buffer[start : start + 4]).hex()}, which is no plain CDR")
        return found


_CDR_KINDS = {
    0x0000: Encoding(">", "iII", widest=8),
    0x0001: Encoding("<", "iII", widest=8),
    0x0006: Encoding(">", "iII", widest=4),  # XCDR2, which aligns nothing to more than 4 bytes
    0x0007: Encoding("<", "iII", widest=4),
}
ROS1 = Encoding("<", "III", widest=1)
"""The encoding of ROS 1, in bags and on the wire: little-endian, without alignment."""
CDR = _AnyCdr("<", "iII", widest=8)
"""The encoding of ROS 2 bags and of DDS: either order of bytes, XCDR1 or plain XCDR2."""


def laser_scan(buffer: Any, start: int = 0, end: int | None = None, *, encoding: Encoding = CDR) -> LaserScan:
    """View a serialised sensor_msgs/LaserScan.

    Parameters
    ----------
    buffer : bytes or any contiguous buffer of bytes
        The buffer that has the message in it.
    start, end : int
        The message is ``buffer[start:end]``; by default all of the buffer.
    encoding : Encoding
        ``ROS1`` or ``CDR``.

    Returns
    -------
    LaserScan

    Raises
    ------
    MessageError
        If the message is cut short or has another layout.

    Examples
    --------
    >>> import struct
    >>> from ttc_fast.ros_messages import laser_scan
    >>> stamp, frame = struct.pack("<4BiI", 0, 1, 0, 0, 12, 500_000_000), struct.pack("<I6s2x", 6, b"laser")
    >>> message = stamp + frame + struct.pack("<7fI2f", -1.5, 1.5, 3.0, 0, 0, 0.5, 30, 2, 7.0, 8.0)
    >>> scan = laser_scan(message)
    >>> scan.stamp, scan.angle_min, scan.ranges
    (12500000000, -1.5, array([7., 8.], dtype=float32))
    """
    if end is None:
        end = len(buffer)
    encoding = encoding.of(buffer, start, end)
    stamp, frame_id, at = _header(buffer, start, end, encoding)
    if at + 32 > end:
        raise _short("LaserScan", at + 32 - start, end - start)
    angle_min, angle_max, increment, between, _, range_min, range_max, beams = encoding.scan.unpack_from(buffer, at)
    at += 32
    if beams * 4 > end - at:
        raise MessageError(f"is cut short: {beams} ranges need {beams * 4} bytes, {end - at} are left")
    ranges = np.frombuffer(buffer, encoding.ranges, beams, at)
    if not encoding.native:
        ranges = ranges.astype(np.float32)
    return LaserScan(stamp, angle_min, increment, between, range_min, range_max, ranges, angle_max, frame_id)


def odometry(buffer: Any, start: int = 0, end: int | None = None, *, encoding: Encoding = CDR) -> Odometry:
    """Read a serialised nav_msgs/Odometry; it takes and raises what ``laser_scan`` does."""
    if end is None:
        end = len(buffer)
    encoding = encoding.of(buffer, start, end)
    stamp, _, at = _header(buffer, start, end, encoding)
    _, at = _string(buffer, at, start, end, encoding)
    if encoding.align:
        at += (start + 4 - at) % encoding.widest
    if at + encoding.odometry.size > end:
        raise _short("Odometry", at + encoding.odometry.size - start, end - start)
    x, y, _, qx, qy, qz, qw, speed, lateral, _, _, _, yaw_rate = encoding.odometry.unpack_from(buffer, at)
    return Odometry(stamp, x, y, yaw_of(qx, qy, qz, qw), speed, lateral, yaw_rate)


def yaw_of(x: float, y: float, z: float, w: float) -> float:
    """Return the yaw of a quaternion, rad.

    Examples
    --------
    >>> from ttc_fast.ros_messages import yaw_of
    >>> yaw_of(0.0, 0.0, 1.0, 0.0)
    3.141592653589793
    """
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def point_cloud(buffer: Any, start: int = 0, end: int | None = None, *, encoding: Encoding = CDR) -> PointCloud2:
    """View a serialised sensor_msgs/PointCloud2; it takes and raises what ``laser_scan`` does."""
    if end is None:
        end = len(buffer)
    encoding = encoding.of(buffer, start, end)
    stamp, frame_id, at = _header(buffer, start, end, encoding)
    if at + 12 > end:
        raise _short("PointCloud2", at + 12 - start, end - start)
    height, width, count = encoding.size.unpack_from(buffer, at)
    at += 12
    fields = []
    for _ in range(count):
        field, at = _field(buffer, at, start, end, encoding)
        fields.append(field)
    if at + 1 > end:
        raise _short("PointCloud2", at + 1 - start, end - start)
    is_bigendian = bool(buffer[at])
    at = _aligned(at + 1, start, encoding)
    if at + 12 > end:
        raise _short("PointCloud2", at + 12 - start, end - start)
    point_step, row_step, size = encoding.steps.unpack_from(buffer, at)
    at += 12
    if size > end - at:
        raise MessageError(f"is cut short: data of {size} bytes, {end - at} are left")
    data = memoryview(buffer)[at : at + size]
    return PointCloud2(stamp, height, width, tuple(fields), is_bigendian, point_step, row_step, data, frame_id)


def transforms(
    buffer: Any, start: int = 0, end: int | None = None, *, encoding: Encoding = CDR
) -> tuple[Transform, ...]:
    """Read a serialised tf2_msgs/TFMessage; it takes and raises what ``laser_scan`` does."""
    if end is None:
        end = len(buffer)
    encoding = encoding.of(buffer, start, end)
    count, at = _count(buffer, start + 4 if encoding.align else start, start, end, encoding)
    found = []
    for _ in range(count):
        at = _aligned(at, start, encoding) + (8 if encoding.align else 12)  # the stamp, and in ROS 1 a number
        parent, at = _string(buffer, at, start, end, encoding)
        child, at = _string(buffer, at, start, end, encoding)
        if encoding.align:
            at += (start + 4 - at) % encoding.widest
        if at + encoding.transform.size > end:
            raise _short("TransformStamped", at + encoding.transform.size - start, end - start)
        x, y, z, *rotation = encoding.transform.unpack_from(buffer, at)
        qx, qy, qz, qw = rotation
        found.append(Transform(parent, child, (x, y, z), (qx, qy, qz, qw)))
        at += encoding.transform.size
    return tuple(found)


def float32(buffer: Any, start: int = 0, end: int | None = None, *, encoding: Encoding = CDR) -> float:
    """Read a serialised std_msgs/Float32; it takes and raises what ``laser_scan`` does.

    Examples
    --------
    >>> from ttc_fast.ros_messages import float32
    >>> float32(bytes([0, 1, 0, 0]) + bytes([0, 0, 0xC0, 0x3F]))
    1.5
    """
    return _number("f", buffer, start, end, encoding)


def float64(buffer: Any, start: int = 0, end: int | None = None, *, encoding: Encoding = CDR) -> float:
    """Read a serialised std_msgs/Float64; it takes and raises what ``laser_scan`` does."""
    return _number("d", buffer, start, end, encoding)


def boolean(buffer: Any, start: int = 0, end: int | None = None, *, encoding: Encoding = CDR) -> bool:
    """Read a serialised std_msgs/Bool; it takes and raises what ``laser_scan`` does."""
    return bool(_number("B", buffer, start, end, encoding))


def buttons(
    buffer: Any, start: int = 0, end: int | None = None, *, encoding: Encoding = CDR
) -> NDArray[np.signedinteger[Any]]:
    """Read the buttons of a serialised sensor_msgs/Joy; it takes and raises what ``laser_scan`` does."""
    if end is None:
        end = len(buffer)
    encoding = encoding.of(buffer, start, end)
    _, _, at = _header(buffer, start, end, encoding)
    axes, at = _count(buffer, at, start, end, encoding)
    if axes * 4 > end - at:
        raise MessageError(f"is cut short: {axes} axes need {axes * 4} bytes, {end - at} are left")
    count, at = _count(buffer, at + axes * 4, start, end, encoding)
    if count * 4 > end - at:
        raise MessageError(f"is cut short: {count} buttons need {count * 4} bytes, {end - at} are left")
    return np.frombuffer(buffer, "<i4" if encoding.native else ">i4", count, at)


def ackermann(buffer: Any, start: int = 0, end: int | None = None, *, encoding: Encoding = CDR) -> Commanded:
    """Read a serialised ackermann_msgs/AckermannDriveStamped; it takes and raises what ``laser_scan`` does."""
    if end is None:
        end = len(buffer)
    encoding = encoding.of(buffer, start, end)
    _, _, at = _header(buffer, start, end, encoding)
    if at + 20 > end:
        raise _short("AckermannDriveStamped", at + 20 - start, end - start)
    steering_angle, _, speed, _, _ = struct.unpack_from("<5f" if encoding.native else ">5f", buffer, at)
    return Commanded(speed, steering_angle=steering_angle)


def twist(buffer: Any, start: int = 0, end: int | None = None, *, encoding: Encoding = CDR) -> Commanded:
    """Read a serialised geometry_msgs/Twist; it takes and raises what ``laser_scan`` does."""
    if end is None:
        end = len(buffer)
    encoding = encoding.of(buffer, start, end)
    at = start + (4 if encoding.align else 0)
    if at + 48 > end:
        raise _short("Twist", at + 48 - start, end - start)
    forward, left, _, _, _, yaw_rate = struct.unpack_from("<6d" if encoding.native else ">6d", buffer, at)
    return Commanded(forward, left, yaw_rate)


def _number(form: str, buffer: Any, start: int, end: int | None, encoding: Encoding) -> float:
    if end is None:
        end = len(buffer)
    encoding = encoding.of(buffer, start, end)
    number = struct.Struct(("<" if encoding.native else ">") + form)
    at = start + (4 if encoding.align else 0)
    if at + number.size > end:
        raise _short("a number", at + number.size - start, end - start)
    value: float
    (value,) = number.unpack_from(buffer, at)
    return value


def _field(buffer: Any, at: int, start: int, end: int, encoding: Encoding) -> tuple[PointField, int]:
    name, at = _string(buffer, at, start, end, encoding)
    at = _aligned(at, start, encoding)
    if at + 5 > end:
        raise _short(f"a PointField {name!r}", at + 5 - start, end - start)
    offset, datatype = encoding.field.unpack_from(buffer, at)
    count, at = _count(buffer, at + 5, start, end, encoding)
    return PointField(name, offset, datatype, count), at


def _header(buffer: Any, start: int, end: int, encoding: Encoding) -> tuple[int, str, int]:
    """Read a std_msgs/Header, and return its stamp (ns), its frame and the position of the next field."""
    at = start + 16
    if at > end:
        raise _short("a header", 16, end - start)
    seconds, nanoseconds, length = encoding.header.unpack_from(buffer, start)
    at += length
    if at > end:
        raise MessageError(f"is cut short: the name of its frame has {length} bytes, {end - start - 16} are left")
    frame_id = str(buffer[start + 16 : at], "utf-8", "replace").removesuffix("\0")
    if encoding.align:
        at += (start - at) % 4
    return seconds * 1_000_000_000 + nanoseconds, frame_id, at


def _string(buffer: Any, at: int, start: int, end: int, encoding: Encoding) -> tuple[str, int]:
    length, at = _count(buffer, at, start, end, encoding)
    if length > end - at:
        raise MessageError(f"is cut short: a name has {length} bytes, {end - at} are left")
    text = bytes(buffer[at : at + length]).removesuffix(b"\0")  # CDR counts the zero at its end
    return text.decode("utf-8", "replace"), at + length


def _count(buffer: Any, at: int, start: int, end: int, encoding: Encoding) -> tuple[int, int]:
    at = _aligned(at, start, encoding)
    if at + 4 > end:
        raise _short("a length", at + 4 - start, end - start)
    (count,) = encoding.count.unpack_from(buffer, at)
    return count, at + 4


def _short(what: str, needed: int, size: int) -> MessageError:
    return MessageError(f"is cut short: {what} needs {needed} bytes from the start of the message, which has {size}")


def _aligned(at: int, start: int, encoding: Encoding) -> int:
    """Return where a number of 4 bytes begins. CDR counts from behind its first 4 bytes, with the same result."""
    return at + (start - at) % 4 if encoding.align else at
