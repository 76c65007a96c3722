"""A PointCloud2 message becomes a view of its own bytes, whatever layout its driver chose."""

from __future__ import annotations

import array
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.support.pointcloud2 import DATATYPES, VELODYNE, XYZ, changed, filled, message, rows
from ttc_fast import Gate, KthSmallest, Minimum, from_pointcloud2, robust_min_x

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

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
    with pytest.raises(ValueError, match=r"^msg\.data .* 1 are missing"):
        from_pointcloud2(changed(cut, data=cut.data[:-1]))


# --- the other order of bytes --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("height", "padding"), [(1, 0), (3, 0), (3, 7)])
def test_big_endian_numbers_are_a_copy_of_the_same_points(height: int, padding: int) -> None:
    fields = (*VELODYNE, ("normal", 22, 3, 3), ("flags", 28, 2))
    little = filled(message(5, fields, 30, height=height, row_step=5 * 30 + padding))
    expected = from_pointcloud2(little)
    swapped = changed(little, data=bytearray(little.data), is_bigendian=True)
    for row in range(height):
        for point in range(5):
            at = row * little.row_step + point * 30
            for _, offset, datatype, *count in fields:
                size = np.dtype(list(DATATYPES)[datatype - 1]).itemsize
                for begin in range(at + offset, at + offset + size * (count or [1])[0], size):
                    swapped.data[begin : begin + size] = swapped.data[begin : begin + size][::-1]
    points = from_pointcloud2(swapped)
    assert points.dtype.names == expected.dtype.names
    assert points.shape == expected.shape
    for name in points.dtype.names or ():
        assert points[name].dtype == expected[name].dtype
        assert points[name].tobytes() == expected[name].tobytes()
    assert repr(robust_min_x(points, estimator=Minimum())) == repr(robust_min_x(expected, estimator=Minimum()))


def test_big_endian_fields_that_share_bytes_do_not_multiply_the_memory() -> None:
    fields = (*XYZ, ("intensity", 12, 4), *((f"all {i}", 0, 2, 14) for i in range(1000)))
    values = np.array([(5.0, 0.5, 0.25, 300)], ">f4, >f4, >f4, >u2")
    points = from_pointcloud2(message(1, fields, 14, data=values.tobytes(), is_bigendian=True))
    assert points.tolist() == [(5.0, 0.5, 0.25, 300)]


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


@pytest.mark.parametrize("datatype", DATATYPES)
def test_an_intensity_of_any_type_is_read_in_the_units_stored(datatype: str) -> None:
    msg = filled(message(40, (*XYZ, ("intensity", 13, DATATYPES[datatype])), 26))
    points = from_pointcloud2(msg)
    assert points["intensity"].dtype == np.dtype(datatype)
    bright = rows(points)[points["intensity"] >= 50]
    found = robust_min_x(points, gate=Gate(intensity=(50, 1e9)), estimator=Minimum())
    assert found.x == robust_min_x(bright, estimator=Minimum()).x
    assert 0 < found.candidates < 40
