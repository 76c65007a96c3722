"""PointCloud2 messages with something odd: read in the one way that is left, or refused with the field and the fix."""

from __future__ import annotations

import array
import struct
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tests.support.pointcloud2 import VELODYNE, XYZ, changed, filled, message, rows
from ttc_fast import Detection, Gate, Minimum, NoDataError, from_pointcloud2, robust_min_x
from ttc_fast.pointcloud2 import read_pointcloud2
from ttc_fast.ros.core import BrakeNode
from ttc_fast.ros.settings import NodeSettings

if TYPE_CHECKING:
    import types

    from numpy.typing import NDArray


def refused(kind: type[Exception], said: str, msg: Any, **settings: Any) -> str:
    with pytest.raises(kind) as caught:
        from_pointcloud2(msg, **settings)
    assert caught.type is kind
    assert said in str(caught.value)
    return str(caught.value)


def odd(msg: Any, **settings: Any) -> tuple[NDArray[np.void], dict[str, str]]:
    """The points of a message that is read all the same, and what is odd about it."""
    points, oddities = read_pointcloud2(msg, **settings)
    assert from_pointcloud2(msg, **settings).tobytes() == points.tobytes()
    return points, oddities


def in_order(count: int, step: int = 22) -> bytes:
    """Points whose x counts up from 1, and whose other bytes are zero."""
    return b"".join(struct.pack("<f", i + 1.0).ljust(step, b"\0") for i in range(count))


# --- rows ----------------------------------------------------------------------------------------------------------


def test_a_sound_message_has_nothing_odd() -> None:
    for msg in (message(2), message(4, height=3, row_step=100), message(4, row_step=100)):
        assert odd(msg)[1] == {}


@pytest.mark.parametrize("row_step", [0, 1, 65, 67, 5 * 22, 2**32 - 1])
@pytest.mark.parametrize("height", [2, 4])
def test_a_row_step_that_the_length_of_the_data_contradicts(height: int, row_step: int) -> None:
    """Never set, or left from before the cloud was cropped; the data are as long as they are without padding."""
    points, oddities = odd(message(3, height=height, row_step=row_step, data=in_order(3 * height)))
    assert points["x"].tolist() == np.arange(1.0, 3 * height + 1).reshape(height, 3).tolist()
    assert oddities == {"row_step": f"msg.row_step is {row_step}; rows are read as width x point_step, 66 bytes"}


@pytest.mark.parametrize("row_step", [0, 1, 43])
def test_a_single_row_needs_no_row_step(row_step: int) -> None:
    for extra in (0, 1, 21):
        points, oddities = odd(message(2, row_step=row_step, data=in_order(2) + b"\xff" * extra))
        assert points["x"].tolist() == [1.0, 2.0]
        assert list(oddities) == ["row_step"]


def test_a_single_row_that_was_cropped() -> None:
    """Its row_step is that of the longer row: padding, as far as anybody can tell, and the last row may lack it."""
    points, oddities = odd(message(2, row_step=2200, data=in_order(2)))
    assert points["x"].tolist() == [1.0, 2.0]
    assert oddities == {}


def test_a_column_of_points_whose_row_step_is_of_a_row() -> None:
    points, oddities = odd(message(1, height=5, row_step=5 * 22, data=in_order(5)))
    assert points["x"].ravel().tolist() == [1.0, 2.0, 3.0, 4.0, 5.0]
    assert list(oddities) == ["row_step"]


@pytest.mark.parametrize("length", [3 * 66 + 1, 3 * 66 + 3, 3 * 80, 1000])
def test_rows_that_may_lie_in_several_ways(length: int) -> None:
    """With padding of unknown length nobody knows where the second row begins."""
    said = refused(ValueError, "msg.row_step", message(3, height=3, row_step=65, data=bytes(length)))
    assert "3 x 22 = 66 bytes, got 65" in said
    assert f"rows without padding need 198 bytes of data, and there are {length}" in said


def test_room_for_more_points_than_are_read_is_said() -> None:
    """A width that was left from before the cloud grew would hide whatever the other points show."""
    for msg, room in (
        (message(2, data=in_order(9)), 9),
        (message(2, row_step=9 * 22, data=in_order(9)), 9),
        (message(2, height=2, row_step=3 * 22, data=in_order(6)), 6),
    ):
        points, oddities = odd(msg)
        assert points.size == 2 * msg.height
        said = f"msg.data have room for {room} points; the {msg.height} x 2 of height x width are read"
        assert oddities == {"data": said}
    assert odd(message(2, data=in_order(2) + bytes(21)))[1] == {}


# --- fields --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("counted", ["x", "intensity", "ring"])
def test_a_count_of_zero_is_one(counted: str) -> None:
    """The Point Cloud Library once wrote it so."""
    fields = [(*each, 0) if each[0] == counted else each for each in VELODYNE]
    sound, msg = filled(message(9)), message(9, fields)
    msg.data = sound.data
    points, oddities = odd(msg)
    assert points.dtype == from_pointcloud2(sound).dtype
    assert oddities == {"count": f"msg.fields {counted!r} has count 0; it is read as 1"}


def test_a_count_of_zero_where_one_number_does_not_fit() -> None:
    points, oddities = odd(message(2, (*XYZ, ("end", 12, 7, 0)), 12))
    assert points.dtype.names == ("x", "y", "z")
    assert list(oddities) == ["count", "fields"]


@pytest.mark.parametrize(
    ("padding", "said"),
    [
        ([("", 12, 2, 4)], "'' has no name"),
        ([("", 12, 2, 4), ("", 18, 2, 4)], "'' has no name"),
        ([("_", 12, 2, 4), ("_", 18, 2, 4)], "'_' is declared twice, in two places"),
        ([("_", 12, 2, 2), ("_", 14, 2, 2), ("_", 12, 2, 2)], "'_' is declared twice, in two places"),
        ([("ring", 12, 0)], "'ring' has the unknown datatype 0; known are INT8 (1), "),
        ([("ring", 12, 9)], "'ring' has the unknown datatype 9"),
        ([("time", 19, 7)], "'time' ends at byte 23, beyond point_step 22"),
        ([("time", 22, 2)], "'time' ends at byte 23, beyond point_step 22"),
        ([("time", 12, 4, 6)], "'time' ends at byte 24, beyond point_step 22"),
        ([("time", 2**32 - 1, 8, 2**32 - 1)], "beyond point_step 22"),
    ],
)
def test_fields_that_nobody_needs_are_ignored(padding: Any, said: str) -> None:
    for fields in ((*XYZ, *padding), (*padding, *XYZ)):
        msg = filled(message(50, fields))
        points, oddities = odd(msg)
        assert points.dtype.names == ("x", "y", "z")
        assert list(oddities) == ["fields"]
        assert said in oddities["fields"]
        assert oddities["fields"].endswith("; it is ignored")
        found = robust_min_x(points, estimator=Minimum())
        assert repr(found) == repr(robust_min_x(rows(points), estimator=Minimum()))


def test_a_field_that_just_fits() -> None:
    points, oddities = odd(message(2, (*XYZ, ("time", 18, 7))))
    assert (points.dtype.names, oddities) == ((*"xyz", "time"), {})


def test_a_field_declared_twice_in_one_place() -> None:
    points, oddities = odd(message(2, (*XYZ, *XYZ, ("ring", 12, 4), ("ring", 12, 4))))
    assert (points.dtype.names, oddities) == ((*"xyz", "ring"), {})


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ([("intensity", 12, 7, 2)], "has 2 numbers a point"),
        ([("intensity", 19, 7)], "ends at byte 23, beyond point_step 22"),
        ([("intensity", 12, 77)], "has the unknown datatype 77"),
        ([("intensity", 12, 7), ("intensity", 16, 7)], "is declared twice, in two places"),
        ([("intensity", 0, 7)], "shares bytes with x, y or z"),
        ([("intensity", 11, 2)], "shares bytes with x, y or z"),
        ([("intensity", 4, 8)], "shares bytes with x, y or z"),
    ],
)
def test_an_intensity_that_cannot_be_used_is_ignored_and_a_gate_on_it_refuses(fields: Any, said: str) -> None:
    msg = message(2, (*XYZ, *fields), data=in_order(2))
    points, oddities = odd(msg)
    assert points.dtype.names == ("x", "y", "z")
    assert list(oddities) == ["intensity"]
    assert said in oddities["intensity"]
    assert robust_min_x(points, estimator=Minimum()).x == 1.0
    with pytest.raises(ValueError, match="gate has bounds on intensity, but the points have no intensity"):
        robust_min_x(points, gate=Gate(intensity=(0.0, 1.0)))
    points, oddities = odd(msg, intensity=None)
    assert points.dtype.names == ("x", "y", "z")


@pytest.mark.parametrize("intensity", [3, b"intensity", ["intensity"], "x", "z", Minimum()], ids=repr)
def test_intensities_that_are_no_field(intensity: Any) -> None:
    refused(TypeError, "intensity", message(2), intensity=intensity)


# --- refused -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("length", [0, 1, 22, 43])
def test_data_that_are_cut_off_are_told_how_much(length: int) -> None:
    assert f"{44 - length} are missing" in refused(ValueError, "msg.data", message(2, data=bytes(length)))


def test_more_points_than_bytes() -> None:
    for height, width in ((1, 2**31), (2**31, 2), (2**40, 2**40)):
        refused(ValueError, "missing", changed(message(2), height=height, width=width, row_step=22 * width))
    refused(ValueError, "missing", changed(message(1), point_step=2**33, row_step=2**33))


@pytest.mark.parametrize("missing", ["x", "y", "z"])
def test_missing_coordinates(missing: str) -> None:
    said = refused(ValueError, "msg.fields", message(2, [each for each in VELODYNE if each[0] != missing]))
    assert "x, y and z" in said
    refused(ValueError, "msg.fields", message(2, ()))


@pytest.mark.parametrize("name", ["x", "y", "z"])
@pytest.mark.parametrize(("datatype", "count"), [(1, 1), (3, 1), (4, 1), (5, 1), (6, 1), (7, 2), (7, 3)])
def test_coordinates_of_another_type(name: str, datatype: int, count: int) -> None:
    fields = [each if each[0] != name else (name, each[1], datatype, count) for each in XYZ]
    said = refused(ValueError, f"msg.fields '{name}'", message(2, fields))
    assert "FLOAT32 (7), FLOAT64 (8)" in said


def test_coordinates_of_two_types() -> None:
    refused(ValueError, "one datatype", message(2, (("x", 0, 7), ("y", 4, 7), ("z", 8, 8))))


@pytest.mark.parametrize("name", ["x", "y", "z"])
@pytest.mark.parametrize(
    ("place", "said"),
    [
        ((19, 7), "ends at byte 23, beyond point_step 22"),
        ((2**32 - 1, 7), "beyond point_step 22"),
        ((12, 0), "has the unknown datatype 0"),
        ((12, 7, 2**32 - 1), "beyond point_step 22"),
    ],
)
def test_coordinates_that_cannot_be_used(name: str, place: tuple[int, ...], said: str) -> None:
    for fields in ([(name, *place) if each[0] == name else each for each in XYZ], [*XYZ, (name, *place)]):
        assert said in refused(ValueError, f"msg.fields {name!r}", message(2, fields))


def test_a_coordinate_in_two_places() -> None:
    for name in "xyz":
        assert "twice" in refused(ValueError, f"msg.fields {name!r}", message(2, (*XYZ, (name, 12, 7))))


@pytest.mark.parametrize("offsets", [(0, 0, 0), (0, 4, 4), (0, 3, 8), (8, 4, 7), (0, 8, 1)])
def test_coordinates_that_share_bytes(offsets: tuple[int, int, int]) -> None:
    fields = [(name, offset, 7) for name, offset in zip("xyz", offsets, strict=True)]
    refused(ValueError, "share bytes", message(2, fields))


def test_names_that_are_no_text() -> None:
    for name in (None, b"x", 3):
        refused(TypeError, "names", message(2, (*XYZ, (name, 12, 7))))


def test_points_wider_than_records_can_be() -> None:
    nothing = np.broadcast_to(np.uint8(0), 2**31)
    refused(ValueError, "contiguous", message(1, point_step=2**31, row_step=0, data=nothing))
    refused(ValueError, "msg.point_step", message(1, point_step=2**31, row_step=0, data=np.zeros(2**31, np.uint8)))


@pytest.mark.parametrize(("height", "width"), [(0, 0), (0, 5), (5, 0), (1, 0)])
def test_no_points_is_no_data(height: int, width: int) -> None:
    """A message without points, or never filled in, is a blind sensor."""
    said = refused(NoDataError, "msg.width", message(width, height=height))
    assert f"{height} x {width}" in said
    refused(NoDataError, "msg.width", message(0, (), 0, height=height))


def test_points_of_no_bytes() -> None:
    refused(ValueError, "msg.point_step", message(2, point_step=0))


@pytest.mark.parametrize("name", ["height", "width", "fields", "is_bigendian", "point_step", "row_step", "data"])
def test_messages_without_a_field(name: str) -> None:
    msg = message(2)
    delattr(msg, name)
    assert "PointCloud2" in refused(TypeError, name, msg)


@pytest.mark.parametrize("name", ["height", "width", "point_step", "row_step"])
def test_sizes_that_are_no_sizes(name: str) -> None:
    for value in (1.0, "1", None, b"1", [1]):
        refused(TypeError, f"msg.{name}", changed(message(2), **{name: value}))
    refused(ValueError, f"msg.{name}", changed(message(2), **{name: -1}))


@pytest.mark.parametrize("name", ["name", "offset", "datatype", "count"])
def test_fields_without_a_field(name: str) -> None:
    msg = message(2)
    delattr(msg.fields[1], name)
    assert "PointField" in refused(TypeError, name, msg)
    setattr(msg.fields[1], name, 1.5)
    refused(TypeError, "msg.fields", msg)
    refused(TypeError, "msg.fields", changed(message(2), fields=3))


@pytest.mark.parametrize(
    "data",
    [
        [0] * 44,
        (0,) * 44,
        None,
        "0" * 44,
        44,
        np.zeros(44),
        np.zeros(44, "M8[s]"),
        np.zeros(11, "f4"),
        array.array("f", [0.0] * 11),
    ],
)
def test_data_that_are_no_bytes(data: Any) -> None:
    refused(TypeError, "msg.data", message(2, data=data))


def test_data_with_gaps() -> None:
    refused(ValueError, "contiguous", message(2, data=np.zeros(88, np.uint8)[::2]))


@pytest.mark.parametrize("msg", [None, b"", 3, {}, np.ones((3, 3)), "PointCloud2"], ids=repr)
def test_what_is_no_message(msg: Any) -> None:
    assert "PointCloud2" in refused(TypeError, "msg", msg)


# --- any message ---------------------------------------------------------------------------------------------------

UINT32 = st.integers(0, 30) | st.sampled_from([2**16, 2**31 - 1, 2**31, 2**32 - 1])
NAMES = st.sampled_from(["x", "y", "z", "intensity", "ring", "_", "", "X", "x ", "\0", "\ud800"]) | st.text(max_size=2)
PARTS = {"row_step", "data", "count", "fields", "intensity"}
SEEN = np.array([0.0, 0.3, 3.0, 20.0, -1.0, np.nan, np.inf])
"""What is stored in points: some are none, and some are in the way of the vehicle."""
FIELDS = st.tuples(NAMES, UINT32, st.integers(0, 9) | st.just(255), st.integers(0, 3) | UINT32)


def sometimes(usual: st.SearchStrategy[int]) -> st.SearchStrategy[int]:
    """The usual numbers, and once in a while any other."""
    return st.integers(0, 15).flatmap(lambda chance: usual if chance else UINT32)


@st.composite
def messages(draw: st.DrawFn) -> types.SimpleNamespace:
    """A message like those of drivers, any parts of which may be anything."""
    coordinate = draw(st.sampled_from([7, 7, 8]))
    size, start = (4 if coordinate == 7 else 8), draw(st.sampled_from([0, 0, 4, 1]))
    fields = [(name, start + size * i, coordinate, draw(st.sampled_from([1, 1, 1, 0]))) for i, name in enumerate("xyz")]
    end = start + 3 * size
    fields += draw(st.lists(st.sampled_from([("intensity", end, 3, 1), ("ring", end, 4, 1)]) | FIELDS, max_size=4))
    for i in draw(st.sampled_from([(), (), (), (), (), (0,), (2,), (0, 1)])):
        fields[i] = draw(FIELDS)
    height, width = draw(sometimes(st.sampled_from([1, 1, 2, 3]))), draw(sometimes(st.integers(1, 6)))
    point_step = draw(sometimes(st.sampled_from([end, end + 2, end + 10])))
    row = width * point_step
    row_steps = st.sampled_from([row, row, 0, row + 5, 3 * row]) | st.integers(max(row - 2, 0), row + 2)
    row_step = draw(sometimes(row_steps)) % 2**32
    needed = draw(st.sampled_from([height * row, height * row, height * row_step, (height - 1) * row_step + row]))
    length = min(max(needed + draw(st.sampled_from([0, 0, 0, -1, 1, -point_step, point_step, 500])), 0), 3000)
    is_bigendian = draw(st.sampled_from([False, False, True]))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    kind = (">f" if is_bigendian else "<f") + str(size)
    values = rng.choice(SEEN[: draw(st.integers(1, len(SEEN)))], length // size + 1).astype(kind)
    data = (bytes(start) + values.tobytes())[:length]
    msg = message(width, draw(st.permutations(fields)), point_step, height=height, row_step=row_step, data=data)
    msg.is_bigendian = is_bigendian
    return msg


def by_hand(msg: types.SimpleNamespace) -> list[list[float]]:
    """The points of a message that can be read: x, y and z, number by number."""
    row = msg.width * msg.point_step
    fits = msg.row_step >= row and (msg.height - 1) * msg.row_step + row <= len(msg.data)
    step = msg.row_step if fits else row
    places = {each.name: (each.offset, each.datatype) for each in msg.fields}
    kinds = {7: "f", 8: "d"}

    def number(at: int, name: str) -> float:
        offset, datatype = places[name]
        kind = (">" if msg.is_bigendian else "<") + kinds[datatype]
        value: float = struct.unpack_from(kind, msg.data, at + offset)[0]
        return value

    starts = [i * step + j * msg.point_step for i in range(msg.height) for j in range(msg.width)]
    return [[number(at, name) for name in "xyz"] for at in starts]


@given(msg=messages(), intensity=st.sampled_from(["intensity", "ring", None]))
@example(msg=message(2, (*XYZ, ("\ud800", 12, 7))), intensity=None)
def test_any_message_is_refused_or_read_inside_its_bytes(msg: types.SimpleNamespace, intensity: str | None) -> None:
    try:
        points, oddities = read_pointcloud2(msg, intensity=intensity)
    except ValueError as error:
        assert type(error) is ValueError  # noqa: PT017 - either is right
        assert "msg." in str(error)  # noqa: PT017
        refused(ValueError, str(error), msg, intensity=intensity)
        return
    assert oddities.keys() <= PARTS
    if msg.height * msg.width == 0:
        assert points.shape == (0,)
        refused(NoDataError, "msg.height x msg.width", msg)
        return
    assert points.shape == ((msg.width,) if msg.height == 1 else (msg.height, msg.width))
    assert np.array_equal(rows(points)[..., :3].reshape(-1, 3), by_hand(msg), equal_nan=True)
    if not msg.is_bigendian:
        last = sum((n - 1) * stride for n, stride in zip(points.shape, points.strides, strict=True))
        start = np.frombuffer(msg.data, np.uint8).__array_interface__["data"][0]
        assert points.__array_interface__["data"][0] == start
        assert last + msg.point_step <= len(msg.data)
    valid = [point for point in by_hand(msg) if np.isfinite(point).all() and np.any(point)]
    assert (robust_min_x(points).detection is Detection.NO_DATA) == (not valid)


AT_ONCE = {"trigger": [1, 1], "release": [1, 1], "hold": 0.0, "stopping_distance": False, "use_range_rate": False}
NODE = NodeSettings.of({"points_topic": "/points", "scan_topic": "", "outline": [-0.1, 0.4, -0.3, 0.3], **AT_ONCE})


def decided(points: Any) -> tuple[Any, ...]:
    """What a node at 4 m/s does about its first cloud: a message, or plain rows."""
    node = BrakeNode(NODE)
    node.on_odometry(100.0, 100.0, speed=4.0)
    seen = points if isinstance(points, np.ndarray) else node.points_of(points)
    outputs = node.tick(100.0) if seen is None else node.on_points(100.0, 100.0, seen)
    dropped = [value for name, value in node.diagnostics(100.0).values if name == "dropped: /points"]
    return outputs.brake, outputs.decision.reason, repr(outputs.decision.value), len(dropped)


@given(msg=messages())
def test_the_node_never_raises_and_never_takes_for_clear_what_it_did_not_judge(msg: types.SimpleNamespace) -> None:
    answer = decided(msg)
    try:
        from_pointcloud2(msg, intensity=None)
    except NoDataError:
        assert answer == decided(np.empty((0, 3), np.float32))
        assert answer[0]
        return
    except ValueError:
        assert (answer[0], answer[-1]) == (True, 1)
        return
    plain = np.array(by_hand(msg))
    assert answer == decided(plain)
    if not (np.isfinite(plain).all(axis=1) & plain.any(axis=1)).any():
        assert answer[0]
