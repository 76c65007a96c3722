"""Views over serialised messages, against rosbags, which deserialises all of a message."""

import struct

import numpy as np
import pytest

from tests.support.bags import BEGIN, POINTS, Cloud, Odom, Recorded, Scan, serialised
from ttc_fast import ScanTTC, from_pointcloud2
from ttc_fast.ros_messages import CDR, ROS1, Encoding, MessageError, laser_scan, odometry, point_cloud

WIRES: dict[str, Encoding] = {"ros1": ROS1, "little": CDR, "big": CDR}
VIEWS = {"Scan": laser_scan, "Odom": odometry, "Cloud": point_cloud}


def samples() -> list[Recorded]:
    return [Scan(1.5, 2.0), Odom(1.5, 2.0, speed=2.0, yaw_rate=-0.5, x=3.0, y=4.0, yaw=-2.0), Cloud(1.5, 2.0, POINTS)]


@pytest.mark.parametrize("wire", WIRES)
@pytest.mark.parametrize("letters", range(9))
def test_a_scan_is_what_was_sent(wire: str, letters: int) -> None:
    message = serialised(Scan(1.5, 2.0, frame="l" * letters), wire)
    scan = laser_scan(message, encoding=WIRES[wire])
    assert scan.stamp == BEGIN + 1_500_000_000
    assert scan.angle_min == -1.5
    assert scan.angle_increment == np.float32(3.0 / 18)
    assert (scan.range_min, scan.range_max) == (0.0625, 30.0)
    assert scan.ranges.dtype == np.float32
    np.testing.assert_array_equal(scan.ranges, np.arange(1.0, 20.0))


@pytest.mark.parametrize("wire", WIRES)
@pytest.mark.parametrize("letters", range(9))
def test_odometry_is_what_was_sent(wire: str, letters: int) -> None:
    sent = Odom(1.5, 2.0, speed=-2.0, yaw_rate=0.5, x=3.0, y=4.0, yaw=-2.0, frame="o" * letters)
    read = odometry(serialised(sent, wire), encoding=WIRES[wire])
    assert read.stamp == BEGIN + 1_500_000_000
    assert (read.x, read.y, read.speed, read.lateral_speed, read.yaw_rate) == (3.0, 4.0, -2.0, 0.0, 0.5)
    assert read.yaw == pytest.approx(-2.0)


@pytest.mark.parametrize("wire", WIRES)
@pytest.mark.parametrize("letters", range(5))
def test_a_cloud_is_what_was_sent(wire: str, letters: int) -> None:
    message = point_cloud(serialised(Cloud(1.5, 2.0, POINTS, frame="l" * letters), wire), encoding=WIRES[wire])
    assert message.stamp == BEGIN + 1_500_000_000
    points = from_pointcloud2(message)
    for name in POINTS.dtype.names or ():
        np.testing.assert_array_equal(points[name], POINTS[name])


@pytest.mark.parametrize("wire", ["ros1", "little"])
@pytest.mark.parametrize("before", range(4))
def test_ranges_lie_in_the_buffer_of_the_message_wherever_it_is(wire: str, before: int) -> None:
    message = serialised(Scan(1.5, 2.0), wire)
    buffer = bytes(before) + message + bytes(9)
    scan = laser_scan(buffer, before, before + len(message), encoding=WIRES[wire])
    assert np.shares_memory(scan.ranges, np.frombuffer(buffer, np.uint8))
    np.testing.assert_array_equal(scan.ranges, np.arange(1.0, 20.0))
    kernel = ScanTTC.from_message(scan)
    assert kernel.min(scan.ranges, 2.0) == kernel.min(scan.ranges.copy(), 2.0)


def test_some_ranges_of_ros_1_are_unaligned() -> None:
    assert not laser_scan(serialised(Scan(1.5, 2.0), "ros1"), encoding=ROS1).ranges.flags.aligned


@pytest.mark.parametrize("wire", WIRES)
@pytest.mark.parametrize("item", samples(), ids=lambda item: type(item).__name__)
def test_a_message_cut_anywhere_is_an_error(item: Recorded, wire: str) -> None:
    message = serialised(item, wire)
    view = VIEWS[type(item).__name__]
    # What is not read is behind: the count of intensities, is_dense, the covariance of the twist.
    unread = {"Scan": 4, "Odom": 36 * 8, "Cloud": 1}[type(item).__name__]
    for size in range(len(message) - unread):
        with pytest.raises(MessageError, match="cut short"):
            view(message[:size], encoding=WIRES[wire])
        with pytest.raises(MessageError, match="cut short"):  # the next message, right behind, must not be read
            view(message + message, 0, size, encoding=WIRES[wire])
    view(message[: len(message) - unread], encoding=WIRES[wire])


@pytest.mark.parametrize("wire", WIRES)
@pytest.mark.parametrize("item", samples(), ids=lambda item: type(item).__name__)
def test_damaged_bytes_are_read_or_refused(item: Recorded, wire: str) -> None:
    rng = np.random.default_rng(7)
    message = np.frombuffer(serialised(item, wire), np.uint8)
    refused = 0
    for _ in range(400):
        damaged = message.copy()
        damaged[rng.integers(0, 80, 2)] = rng.integers(0, 256, 2)  # lengths are in front
        try:
            VIEWS[type(item).__name__](damaged.tobytes(), encoding=WIRES[wire])
        except MessageError:
            refused += 1
    assert refused > 5


def test_plain_xcdr2_aligns_doubles_to_four_bytes() -> None:
    header = struct.pack("<4BiI", 0, 7, 0, 0, 12, 5) + struct.pack("<I4sI6s2x", 4, b"map", 6, b"robot")
    pose = (1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    body = struct.pack("<7d288x6d288x", *pose, 3.0, 0.0, 0.0, 0.0, 0.0, 0.25)
    assert (len(header) - 4) % 8 == 4  # under XCDR1 there would be padding
    read = odometry(header + body)
    assert (read.x, read.y, read.speed, read.yaw_rate) == (1.0, 2.0, 3.0, 0.25)


@pytest.mark.parametrize("kind", [2, 3, 8, 0xFFFF])
def test_another_encoding_is_refused(kind: int) -> None:
    message = struct.pack(">H", kind) + serialised(Scan(1.5, 2.0), "little")[2:]
    with pytest.raises(MessageError, match="which is no plain CDR"):
        laser_scan(message)
