"""A PointCloud2 message becomes a view of its own bytes, or is refused with the field and the fix."""

from __future__ import annotations

import array
import types
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ttc_fast
from ttc_fast import Detection, Gate, KthSmallest, Minimum, NoDataError, from_pointcloud2, robust_min_x

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

DATATYPES = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "f4": 7, "f8": 8}
XYZ = (("x", 0, 7), ("y", 4, 7), ("z", 8, 7))
VELODYNE = (*XYZ, ("intensity", 12, 7), ("ring", 16, 4), ("time", 18, 7))  # steps of 22 bytes


def field(name: str, offset: int, datatype: int, count: int = 1) -> types.SimpleNamespace:
    return types.SimpleNamespace(name=name, offset=offset, datatype=datatype, count=count)


def message(width: int, fields: Any = VELODYNE, point_step: int = 22, **changes: Any) -> types.SimpleNamespace:
    """A message of ``width`` points in each row, whose bytes are zero unless given."""
    height, row_step = changes.get("height", 1), changes.get("row_step", width * point_step)
    whole: dict[str, Any] = {
        "height": height,
        "width": width,
        "fields": [field(*each) for each in fields],
        "is_bigendian": False,
        "point_step": point_step,
        "row_step": row_step,
        "data": bytes(height * row_step),
        "is_dense": True,
    }
    return types.SimpleNamespace(**{**whole, **changes})


def filled(msg: types.SimpleNamespace, seed: int = 1) -> types.SimpleNamespace:
    """The message with points ahead, and noise wherever else there are bytes."""
    rng = np.random.default_rng(seed)
    msg.data = bytearray(rng.bytes(msg.height * msg.row_step))
    points = from_pointcloud2(msg)
    for name, (low, high) in {"x": (1, 40), "y": (-3, 3), "z": (-2, 2), "intensity": (0, 100)}.items():
        if name in (points.dtype.names or ()):
            points[name] = rng.uniform(low, high, points.shape)
    return msg


def rows(points: NDArray[np.void]) -> NDArray[Any]:
    """The same points as plain rows, by NumPy."""
    return np.stack([points[name] for name in ("x", "y", "z", "intensity") if name in (points.dtype.names or ())], -1)


def changed(msg: types.SimpleNamespace, **changes: Any) -> types.SimpleNamespace:
    return types.SimpleNamespace(**{**vars(msg), **changes})


def refused(kind: type[Exception], said: str, msg: Any, **settings: Any) -> str:
    with pytest.raises(kind) as caught:
        from_pointcloud2(msg, **settings)
    assert caught.type is kind
    assert said in str(caught.value)
    return str(caught.value)


# --- what comes out ------------------------------------------------------------------------------------------------


def test_numbers_written_by_hand() -> None:
    data = b"".join(
        np.array([x], "<f4").tobytes() + np.array([y, z], "<f4").tobytes() + bytes([intensity, 0xFF])
        for x, y, z, intensity in [(4.0, 1.0, -1.0, 200), (3.0, 0.5, 0.25, 7)]
    )
    points = from_pointcloud2(message(2, (*XYZ, ("intensity", 12, 2)), 14, data=data))
    assert points.shape == (2,)
    assert points.tolist() == [(4.0, 1.0, -1.0, 200), (3.0, 0.5, 0.25, 7)]
    assert robust_min_x(points, gate=Gate(intensity=(100, 255)), estimator=Minimum()).x == 4.0


@pytest.mark.parametrize("datatype", DATATYPES)
@pytest.mark.parametrize("count", [1, 3])
def test_every_datatype_at_an_odd_offset(datatype: str, count: int) -> None:
    dtype = np.dtype(datatype)
    step = 13 + count * dtype.itemsize
    points = from_pointcloud2(message(3, (*XYZ, ("other", 13, DATATYPES[datatype], count)), step))
    shape = (3,) if count == 1 else (3, count)
    assert (points["other"].dtype, points["other"].shape) == (dtype, shape)
    assert points.dtype.fields is not None
    assert points.dtype.fields["other"][1] == 13


def test_fields_in_any_order_overlapping_or_apart() -> None:
    fields = (("rgba", 20, 6), ("z", 8, 7), ("rgb", 20, 7), ("x", 4, 7), ("y", 0, 7))
    points = from_pointcloud2(message(2, fields, 32, data=np.arange(16, dtype="<f4").tobytes()))
    assert [points[name].tolist() for name in ("x", "y", "z", "rgb")] == [[1, 9], [0, 8], [2, 10], [5, 13]]
    assert points.dtype.itemsize == 32


@pytest.mark.parametrize("width", [1, 16, 17, 500])
@pytest.mark.parametrize(
    ("fields", "step"),
    [
        (XYZ, 12),
        ((*XYZ, ("intensity", 12, 7)), 16),
        (VELODYNE, 22),
        ((*XYZ, ("intensity", 16, 7), ("ring", 20, 4)), 32),
        ((("x", 0, 8), ("y", 8, 8), ("z", 16, 8), ("intensity", 24, 4)), 26),
        ((*XYZ, ("intensity", 16, 2)), 48),
        ((("x", 1, 7), ("y", 5, 7), ("z", 9, 7), ("intensity", 0, 2)), 13),
    ],
    ids=lambda value: str(value) if isinstance(value, int) else "",
)
@pytest.mark.parametrize(("height", "padding"), [(1, 0), (1, 5), (4, 0), (4, 7)])
def test_the_kernel_reads_it_as_plain_rows(fields: Any, step: int, width: int, height: int, padding: int) -> None:
    msg = filled(message(width, fields, step, height=height, row_step=width * step + padding))
    points = from_pointcloud2(msg)
    assert points.shape == ((width,) if height == 1 else (height, width))
    gates = [Gate(), *([Gate(intensity=(20.0, 80.0))] if "intensity" in (points.dtype.names or ()) else [])]
    for gate in gates:
        for estimator in (Minimum(), KthSmallest(3)):
            assert repr(robust_min_x(points, gate=gate, estimator=estimator)) == repr(
                robust_min_x(rows(points), gate=gate, estimator=estimator)
            )


def test_an_index_counts_the_rows_in_order() -> None:
    msg = filled(message(5, height=3, row_step=5 * 22 + 9))
    points = from_pointcloud2(msg)
    points["x"] = 9.0
    points["y"] = 0.0
    points["x"][2, 1] = 3.0
    assert robust_min_x(points, estimator=Minimum()).index == 2 * 5 + 1


def test_is_dense_is_not_believed() -> None:
    """A driver that says so may send NaN or (0, 0, 0) all the same; neither counts."""
    for is_dense in (True, False, None):
        msg = message(3, XYZ, 12, data=np.array([[np.nan, 0, 0], [0, 0, 0], [5, 0, 0]], "<f4").tobytes())
        msg.is_dense = is_dense
        found = robust_min_x(from_pointcloud2(msg), estimator=Minimum())
        assert (found.x, found.candidates) == (5.0, 1)
    del msg.is_dense
    assert from_pointcloud2(msg).shape == (3,)


# --- no copy -------------------------------------------------------------------------------------------------------

BUFFERS: dict[str, Callable[[bytes], Any]] = {
    "bytes, ROS 1": bytes,
    "array.array, ROS 2": lambda data: array.array("B", data),
    "ndarray": lambda data: np.frombuffer(data, np.uint8).copy(),
    "ndarray of int8": lambda data: np.frombuffer(data, np.int8).copy(),
    "ndarray (height, row_step)": lambda data: np.frombuffer(data, np.uint8).copy().reshape(2, -1),
    "bytearray": bytearray,
    "memoryview": lambda data: memoryview(bytearray(data))[:],
    "unaligned": lambda data: memoryview(bytearray(b"\0\0\0" + data))[3:],
}


@pytest.mark.parametrize("lay", BUFFERS.values(), ids=BUFFERS)
@pytest.mark.parametrize("height", [1, 2])
def test_it_is_a_view_of_the_message(lay: Callable[[bytes], Any], height: int) -> None:
    """Both ends of every field lie where the message has them: nothing was copied on the way."""
    msg = filled(message(10, height=height, row_step=230))
    expected = from_pointcloud2(msg)
    msg.data = lay(bytes(msg.data) if height == 2 else bytes(msg.data) + b"\0" * 230)
    points = from_pointcloud2(msg)
    memory: NDArray[np.uint8] = np.frombuffer(msg.data, np.uint8)
    start = memory.__array_interface__["data"][0]
    assert points.__array_interface__["data"][0] == start
    assert points.strides == ((22,) if height == 1 else (230, 22))
    assert np.shares_memory(points["x"], memory)
    assert points.flags.writeable == memory.flags.writeable
    assert points["x"].tobytes() == expected["x"].tobytes()
    if memory.flags.writeable:
        points["x"] = 30.0
        points["y"] = 0.0
        memory[22 * 9 : 22 * 9 + 4] = np.frombuffer(np.float32(2.0).tobytes(), np.uint8)
        assert robust_min_x(points, estimator=Minimum()).index == 9


def test_the_view_keeps_the_message_bytes_alive() -> None:
    msg = filled(message(100))
    points = from_pointcloud2(msg)
    before = points["x"].tobytes()
    del msg
    assert points["x"].tobytes() == before


def test_data_beyond_the_last_row_are_not_points() -> None:
    msg = filled(message(4))
    msg.data += b"\xff" * 100
    assert from_pointcloud2(msg).shape == (4,)


def test_the_last_row_may_lack_its_padding() -> None:
    msg = filled(message(4, height=3, row_step=4 * 22 + 10))
    expected = from_pointcloud2(msg).tolist()
    for missing in range(11):
        cut = changed(msg, data=bytes(msg.data)[: 3 * 98 - missing])
        assert from_pointcloud2(cut).tolist() == expected
    cut.data = cut.data[:-1]
    assert "1 are missing" in refused(ValueError, "msg.data", cut)


# --- the intensity -------------------------------------------------------------------------------------------------

OUSTER = (*XYZ, ("intensity", 16, 7), ("reflectivity", 20, 4))


def test_another_field_may_be_the_intensity() -> None:
    points = from_pointcloud2(message(2, OUSTER, 24), intensity="reflectivity")
    assert sorted(points.dtype.names or ()) == ["intensity", "x", "y", "z"]
    assert points["intensity"].dtype == np.uint16


def test_what_was_not_asked_for_is_never_taken_for_the_intensity() -> None:
    """A gate in the wrong units would be worse than none."""
    for asked in ("signal", None):
        points = from_pointcloud2(message(2, OUSTER, 24), intensity=asked)
        assert points.dtype.names == ("x", "y", "z", "reflectivity")
        with pytest.raises(ValueError, match="intensity"):
            robust_min_x(points, gate=Gate(intensity=(0, 1)))
    assert from_pointcloud2(message(2, XYZ, 12)).dtype.names == ("x", "y", "z")


@pytest.mark.parametrize("datatype", ["u1", "u2", "f4", "f8"])
def test_intensities_that_the_kernel_reads(datatype: str) -> None:
    msg = filled(message(40, (*XYZ, ("intensity", 13, DATATYPES[datatype])), 26))
    points = from_pointcloud2(msg)
    assert points["intensity"].dtype == np.dtype(datatype)
    bright = rows(points)[points["intensity"] >= 50]
    found = robust_min_x(points, gate=Gate(intensity=(50, 1e9)), estimator=Minimum())
    assert found.x == robust_min_x(bright, estimator=Minimum()).x
    assert 0 < found.candidates < 40


@pytest.mark.parametrize(("datatype", "count"), [(1, 1), (3, 1), (5, 1), (6, 1), (7, 2)])
def test_intensities_that_it_does_not_read_can_be_left_out(datatype: int, count: int) -> None:
    msg = message(2, (*XYZ, ("intensity", 12, datatype, count)), 32)
    assert "intensity=None" in refused(ValueError, "'intensity'", msg)
    points = from_pointcloud2(msg, intensity=None)
    assert robust_min_x(points).detection is Detection.NO_DATA


@pytest.mark.parametrize("intensity", [3, b"intensity", ["intensity"], "x", "z", Minimum()], ids=repr)
def test_intensities_that_are_no_field(intensity: Any) -> None:
    refused(TypeError, "intensity", message(2), intensity=intensity)


# --- refused -------------------------------------------------------------------------------------------------------


def test_big_endian_and_that_its_fix_works() -> None:
    values = np.array([[5.0, 0.5, 0.25], [4.0, 0.5, 0.25]])
    msg = message(2, XYZ, 12, data=values.astype(">f4").tobytes(), is_bigendian=True)
    said = refused(ValueError, "msg.is_bigendian", msg)
    fix = "numpy.frombuffer(msg.data, numpy.uint32).byteswap().tobytes()"
    assert fix in said
    msg.data, msg.is_bigendian = eval(fix, {"numpy": np, "msg": msg}), False
    np.testing.assert_array_equal(rows(from_pointcloud2(msg)), values.astype(np.float32))


@pytest.mark.parametrize("datatype", [0, 9, 255])
def test_unknown_datatypes(datatype: int) -> None:
    said = refused(ValueError, "'ring'", message(2, (*XYZ, ("ring", 12, datatype))))
    assert f"datatype {datatype}" in said
    assert "FLOAT32 (7)" in said


@pytest.mark.parametrize(
    ("offset", "datatype", "count"), [(19, 7, 1), (22, 2, 1), (15, 8, 1), (12, 4, 6), (2**40, 2, 1), (0, 8, 2**62)]
)
def test_fields_beyond_the_point(offset: int, datatype: int, count: int) -> None:
    said = refused(ValueError, "'time'", message(2, (*XYZ, ("time", offset, datatype, count))))
    assert "point_step 22" in said


def test_a_field_that_just_fits() -> None:
    assert from_pointcloud2(message(2, (*XYZ, ("time", 18, 7)))).shape == (2,)


@pytest.mark.parametrize("row_step", [0, 1, 43])
def test_rows_shorter_than_their_points(row_step: int) -> None:
    said = refused(ValueError, "msg.row_step", message(2, row_step=row_step, data=bytes(44)))
    assert "44" in said


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


def test_fields_that_make_no_sense() -> None:
    refused(ValueError, "'x' twice", message(2, (*XYZ, ("x", 12, 7))))
    refused(ValueError, "count 0", message(2, (*XYZ, ("ring", 12, 7, 0))))
    for name in ("", None, b"x"):
        refused(TypeError, "names", message(2, (*XYZ, (name, 12, 7))))


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
    "data", [[0] * 44, (0,) * 44, None, "0" * 44, 44, np.zeros(44), np.zeros(11, "f4"), array.array("f", [0.0] * 11)]
)
def test_data_that_are_no_bytes(data: Any) -> None:
    refused(TypeError, "msg.data", message(2, data=data))


def test_data_with_gaps() -> None:
    refused(ValueError, "contiguous", message(2, data=np.zeros(88, np.uint8)[::2]))


@pytest.mark.parametrize("msg", [None, b"", 3, {}, np.ones((3, 3)), "PointCloud2"], ids=repr)
def test_what_is_no_message(msg: Any) -> None:
    assert "PointCloud2" in refused(TypeError, "msg", msg)


near = st.integers(-3, 20)


@given(
    height=st.integers(0, 4),
    width=st.integers(0, 9),
    offset=st.integers(0, 5),
    beyond=st.tuples(near, near, near),
    extra=st.tuples(st.integers(0, 30), st.integers(0, 12), st.integers(0, 3)),
)
def test_any_message_is_refused_or_read_inside_its_bytes(
    height: int, width: int, offset: int, beyond: tuple[int, int, int], extra: tuple[int, int, int]
) -> None:
    """Steps and lengths around what just fits."""
    point_step = offset + 12 + beyond[0]
    row_step = max(width * point_step + beyond[1], 0)
    length = max((height - 1) * row_step + width * point_step + beyond[2], 0)
    fields = [("x", offset, 7), ("y", offset + 4, 7), ("z", offset + 8, 7), ("intensity", *extra)]
    msg = message(width, fields, point_step, height=height, row_step=row_step, data=bytes(length))
    try:
        points = from_pointcloud2(msg)
    except ValueError as error:
        assert "msg." in str(error)  # noqa: PT017 - either is right
        return
    last = sum((n - 1) * stride for n, stride in zip(points.shape, points.strides, strict=True))
    assert points.__array_interface__["data"][0] == np.frombuffer(msg.data, np.uint8).__array_interface__["data"][0]
    assert last + point_step <= length
    assert points.size == height * width
    assert ttc_fast.robust_min_x(points).detection is Detection.NO_DATA
