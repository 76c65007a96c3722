"""Messages that go over DDS: the bytes are those of rosbags, and what is damaged is an error."""

from __future__ import annotations

import struct
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from tests.support import bags
from tests.support.dds_wire import STORE, UPSTREAM, deserialised, header, make, ros2_name, serialised, store_of
from ttc_fast.brake import Command
from ttc_fast.ros.dds.types import (
    DEFINITIONS,
    GID_OF_HUMBLE,
    HASHES,
    dds_name,
    message,
    message_type,
    serialized,
    time_of,
    topic_type,
    type_hash,
)
from ttc_fast.ros.messages import Cause, Diagnostics, Drive, fill_diagnostics, fill_drive, fill_marker
from ttc_fast.ros_messages import (
    Commanded,
    MessageError,
    ackermann,
    boolean,
    buttons,
    float32,
    float64,
    laser_scan,
    odometry,
    point_cloud,
    twist,
)

if TYPE_CHECKING:
    from collections.abc import Callable

STAMP = 1_700_000_000_123_456_789
NAMES = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=9)
HUMBLE = store_of({**DEFINITIONS, **GID_OF_HUMBLE})
FLOATS = st.floats(width=32, allow_nan=False)


@pytest.mark.parametrize("name", [name for name in DEFINITIONS if not name.startswith("ackermann_msgs")])
@pytest.mark.parametrize("release", UPSTREAM)
def test_definitions_are_those_of_ros(name: str, release: str) -> None:
    definitions = HUMBLE if release == "humble" and name.startswith("rmw_dds_common") else STORE
    theirs = UPSTREAM[release]
    assert definitions.fielddefs[ros2_name(name)][1] == theirs.fielddefs[ros2_name(name)][1]
    assert definitions.hash_rihs01(ros2_name(name)) == theirs.hash_rihs01(ros2_name(name))


def test_definition_of_ackermann_is_the_one_with_the_known_checksum() -> None:
    store = get_typestore(Stores.ROS1_NOETIC)
    for name in ("ackermann_msgs/AckermannDrive", "ackermann_msgs/AckermannDriveStamped"):
        store.register(get_types_from_msg(DEFINITIONS[name].replace("; ", "\n"), ros2_name(name)))
    _, checksum = store.generate_msgdef(ros2_name("ackermann_msgs/AckermannDriveStamped"))
    assert checksum == "1fd5d7f58889cefd44d29f6653240d0c"


@pytest.mark.parametrize("name", HASHES)
def test_hashes_are_those_of_the_definitions(name: str) -> None:
    assert type_hash(name) == f"typehash={STORE.hash_rihs01(ros2_name(name))};".encode()


def test_a_release_without_hashes_is_told_none() -> None:
    assert type_hash("rmw_dds_common/ParticipantEntitiesInfo", gid_size=24) == b""


@pytest.mark.parametrize("name", HASHES)
def test_types_are_named_as_on_the_wire(name: str) -> None:
    package, own = name.split("/")
    assert topic_type(name).__idl__.idl_transformed_typename == f"{package}::msg::dds_::{own}_" == dds_name(name)
    assert message_type(name)[0].__idl__.idl_transformed_typename == dds_name(name)


@pytest.mark.parametrize("name", HASHES)
def test_an_empty_message_is_that_of_rosbags(name: str) -> None:
    """A message of nothing but zeros reads as such, and is packed again to the same bytes."""
    empty = serialized(message(name))
    assert serialised(name, deserialised(name, empty)) == empty


@pytest.mark.parametrize("value", [True, False])
def test_bool_is_that_of_rosbags(value: bool) -> None:
    assert serialized(message("std_msgs/Bool", data=value)) == serialised(
        "std_msgs/Bool", make("std_msgs/Bool", data=value)
    )


@given(frame=NAMES, speed=FLOATS, acceleration=FLOATS)
def test_drive_is_that_of_rosbags(frame: str, speed: float, acceleration: float) -> None:
    drive = make(
        "ackermann_msgs/AckermannDrive",
        steering_angle=0.0,
        steering_angle_velocity=0.0,
        speed=speed,
        acceleration=acceleration,
        jerk=0.0,
    )
    theirs = make("ackermann_msgs/AckermannDriveStamped", header=header(STAMP, frame), drive=drive)
    ours = message("ackermann_msgs/AckermannDriveStamped")
    fill_drive(ours, Drive(speed, acceleration), time_of(STAMP), frame)
    assert serialized(ours) == serialised("ackermann_msgs/AckermannDriveStamped", theirs)


def diagnosed(level: int, name: str, text: str, values: list[tuple[str, str]]) -> bytes:
    status, pair = (partial(message, f"diagnostic_msgs/{kind}") for kind in ("DiagnosticStatus", "KeyValue"))
    array = message("diagnostic_msgs/DiagnosticArray")
    return serialized(fill_diagnostics(array, status, pair, Diagnostics(level, name, text, values), time_of(STAMP)))


@given(level=st.integers(0, 3), texts=st.tuples(NAMES, NAMES), values=st.lists(st.tuples(NAMES, NAMES), max_size=4))
def test_diagnostics_are_those_of_rosbags(level: int, texts: tuple[str, str], values: list[tuple[str, str]]) -> None:
    name, text = texts
    pairs = [make("diagnostic_msgs/KeyValue", key=key, value=value) for key, value in values]
    status = make(
        "diagnostic_msgs/DiagnosticStatus", level=level, name=name, message=text, hardware_id="ttc_fast", values=pairs
    )
    theirs = make("diagnostic_msgs/DiagnosticArray", header=header(STAMP, ""), status=[status])
    assert diagnosed(level, name, text, values) == serialised("diagnostic_msgs/DiagnosticArray", theirs)


@given(frame=NAMES, text=NAMES, x=FLOATS, y=FLOATS)
def test_marker_is_that_of_rosbags(frame: str, text: str, x: float, y: float) -> None:
    def vector(kind: str, x: float, y: float, z: float) -> Any:
        return make(f"geometry_msgs/{kind}", x=x, y=y, z=z)

    pose = make(
        "geometry_msgs/Pose",
        position=vector("Point", x, y, 0.0),
        orientation=make("geometry_msgs/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0),
    )
    nothing = np.zeros(0, np.uint8)
    theirs = make(
        "visualization_msgs/Marker",
        header=header(STAMP, frame),
        ns="ttc_fast",
        id=0,
        type=2,
        action=0,
        pose=pose,
        scale=vector("Vector3", 0.2, 0.2, 0.2),
        color=make("std_msgs/ColorRGBA", r=1.0, g=0.0, b=0.0, a=1.0),
        lifetime=make("builtin_interfaces/Duration", sec=1, nanosec=250_000_000),
        frame_locked=False,
        points=[],
        colors=[],
        texture_resource="",
        texture=make("sensor_msgs/CompressedImage", header=header(0, ""), format="", data=nothing),
        uv_coordinates=[],
        text=text,
        mesh_resource="",
        mesh_file=make("visualization_msgs/MeshFile", filename="", data=nothing),
        mesh_use_embedded_materials=False,
    )
    lifetime = message("builtin_interfaces/Duration", sec=1, nanosec=250_000_000)
    ours = message("visualization_msgs/Marker", lifetime=lifetime)
    fill_marker(ours, Cause(frame, x, y, Command.BRAKE, text), time_of(STAMP))
    assert serialized(ours) == serialised("visualization_msgs/Marker", theirs)


@pytest.mark.parametrize("size", [16, 24])
@given(counts=st.tuples(st.integers(0, 3), st.integers(0, 3)), name=NAMES)
def test_discovery_is_that_of_rosbags(size: int, counts: tuple[int, int], name: str) -> None:
    gids = [bytes(range(n, n + 16)).ljust(size, b"\0") for n in range(7)]
    readers, writers = gids[1 : 1 + counts[0]], gids[4 : 4 + counts[1]]
    store = STORE if size == 16 else HUMBLE
    info, node, gid = (
        store.types[f"rmw_dds_common/msg/{kind}"] for kind in ("ParticipantEntitiesInfo", "NodeEntitiesInfo", "Gid")
    )

    def theirs(raw: bytes) -> Any:
        return gid(data=np.frombuffer(raw, np.uint8))

    entities = node("/car", name, [theirs(each) for each in readers], [theirs(each) for each in writers])
    expected = store.serialize_cdr(info(theirs(gids[0]), [entities]), "rmw_dds_common/msg/ParticipantEntitiesInfo")

    def ours(kind: str, **values: Any) -> Any:
        return message(f"rmw_dds_common/{kind}", gid_size=size, **values)

    reader_gids, writer_gids = ([ours("Gid", data=each) for each in gids] for gids in (readers, writers))
    own = ours(
        "NodeEntitiesInfo",
        node_namespace="/car",
        node_name=name,
        reader_gid_seq=reader_gids,
        writer_gid_seq=writer_gids,
    )
    info_sent = ours("ParticipantEntitiesInfo", gid=ours("Gid", data=gids[0]), node_entities_info_seq=[own])
    assert serialized(info_sent) == bytes(expected)


@pytest.mark.parametrize("text", ["a\0b", "\ud800"])
def test_text_that_cdr_cannot_carry_is_cut_or_replaced(text: str) -> None:
    (status,) = deserialised("diagnostic_msgs/DiagnosticArray", diagnosed(0, text, "", [])).status
    assert status.name in ("a", "?")


@pytest.mark.parametrize("little", [True, False])
def test_numbers_are_read(little: bool) -> None:
    assert float32(serialised("std_msgs/Float32", make("std_msgs/Float32", data=-2.5), little=little)) == -2.5
    assert float64(serialised("std_msgs/Float64", make("std_msgs/Float64", data=-2.1), little=little)) == -2.1


JOY = make(
    "sensor_msgs/Joy",
    header=header(5, "joy"),
    axes=np.array([0.5, -1.0, 0.0], np.float32),
    buttons=np.array([0, 1, 0, 1, 1], np.int32),
)
ACKERMANN_DRIVE = make(
    "ackermann_msgs/AckermannDriveStamped",
    header=header(5, "driver"),
    drive=make(
        "ackermann_msgs/AckermannDrive",
        steering_angle=0.25,
        steering_angle_velocity=1.0,
        speed=-1.5,
        acceleration=2.0,
        jerk=3.0,
    ),
)
TWIST = make(
    "geometry_msgs/Twist",
    linear=make("geometry_msgs/Vector3", x=1.5, y=-0.5, z=9.0),
    angular=make("geometry_msgs/Vector3", x=9.0, y=9.0, z=0.75),
)


@pytest.mark.parametrize("little", [True, False])
def test_what_a_driver_asks_for_is_read(little: bool) -> None:
    drive = serialised("ackermann_msgs/AckermannDriveStamped", ACKERMANN_DRIVE, little=little)
    assert ackermann(drive) == Commanded(-1.5, steering_angle=0.25)
    assert twist(serialised("geometry_msgs/Twist", TWIST, little=little)) == Commanded(1.5, -0.5, 0.75)
    assert list(buttons(serialised("sensor_msgs/Joy", JOY, little=little))) == [0, 1, 0, 1, 1]
    for value in (True, False):
        assert boolean(serialised("std_msgs/Bool", make("std_msgs/Bool", data=value), little=little)) is value


def in_order(item: bags.Recorded) -> bytes:
    return bags.serialised(item, "little")


RECEIVED: dict[str, tuple[Callable[[bytes], Any], bytes, int]] = {
    # What is not looked at is behind: the count of intensities, is_dense, the covariance of the twist.
    "sensor_msgs/LaserScan": (laser_scan, in_order(bags.Scan(1.5, 2.0)), 4),
    "nav_msgs/Odometry": (odometry, in_order(bags.Odom(1.5, 2.0, speed=2.0)), 36 * 8),
    "sensor_msgs/PointCloud2": (point_cloud, in_order(bags.Cloud(1.5, 2.0, bags.POINTS)), 1),
    # The buttons of a Joy are its end; the acceleration and jerk of a drive are read with it.
    "sensor_msgs/Joy": (buttons, serialised("sensor_msgs/Joy", JOY), 0),
    "ackermann_msgs/AckermannDriveStamped": (
        ackermann,
        serialised("ackermann_msgs/AckermannDriveStamped", ACKERMANN_DRIVE),
        0,
    ),
    "geometry_msgs/Twist": (twist, serialised("geometry_msgs/Twist", TWIST), 0),
    "std_msgs/Bool": (boolean, serialised("std_msgs/Bool", make("std_msgs/Bool", data=True)), 0),
    "std_msgs/Float32": (float32, serialised("std_msgs/Float32", make("std_msgs/Float32", data=1.5)), 0),
    "std_msgs/Float64": (float64, serialised("std_msgs/Float64", make("std_msgs/Float64", data=1.5)), 0),
}


@pytest.mark.parametrize("name", RECEIVED)
def test_messages_cut_anywhere_are_refused(name: str) -> None:
    decode, cdr, unread = RECEIVED[name]
    for size in range(len(cdr) - unread):
        with pytest.raises(MessageError):
            decode(cdr[:size])
    decode(cdr[: len(cdr) - unread])


@pytest.mark.parametrize("name", RECEIVED)
def test_damaged_bytes_are_read_or_refused(name: str) -> None:
    decode, cdr, _ = RECEIVED[name]
    rng = np.random.default_rng(20)
    refused = 0
    for _ in range(2000):
        damaged = bytearray(cdr)
        for at in rng.integers(0, min(len(cdr), 96), rng.integers(1, 4)):
            damaged[at] ^= 1 << rng.integers(0, 8)
        try:
            decode(bytes(damaged))
        except MessageError:
            refused += 1
    assert 0 < refused < 2000


def test_every_length_that_a_count_can_have_is_checked() -> None:
    cdr = bytearray(in_order(bags.Scan(1.5, 2.0)))
    at = len(cdr) - 4 - 19 * 4 - 4  # of the count of ranges
    assert struct.unpack_from("<I", cdr, at) == (19,)
    for count in (21, 2**16, 2**30, 2**31, 2**32 - 1):
        cdr[at : at + 4] = struct.pack("<I", count)
        with pytest.raises(MessageError, match="cut short"):
            laser_scan(bytes(cdr))
