"""Whatever the memory looks like, the answer is that of a contiguous copy, and no copy is made."""

from __future__ import annotations

import array
import ctypes
import math
import sys
import warnings
from functools import cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ttc_fast
from tests.support.common import CAR, peak_of, reports
from tests.support.little_memory import call_each

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from multiprocessing.connection import Connection
    from pathlib import Path

    from numpy.typing import NDArray

    Floats = NDArray[Any]
    Layout = Callable[[Floats], Any]

DTYPES = ["float32", "float64"]
BEAMS = 1081  # not a multiple of any lane count, so the tail is used as well
ROWS = 5
LARGE = 1 << 20


@cache
def make_scan(beams: int) -> ttc_fast.ScanTTC:
    return ttc_fast.ScanTTC(-2.0, 4.0 / beams, beams, range_min=0.06, range_max=30.0, limits=(0.0, 25.0), outline=CAR)


def make_ranges(shape: int | tuple[int, ...], dtype: str) -> Floats:
    """Readings with every kind of special value, and ties."""
    random = np.random.default_rng(7)
    ranges = random.uniform(0.5, 35.0, shape).astype(dtype)
    for special in (np.nan, np.inf, -np.inf, 0.0, -1.0, 0.01, 0.2, 3.0):
        ranges[random.random(shape) < 0.02] = special
    return ranges


def records(itemsize: int, offset: int) -> Layout:
    """One field of packed records: neither aligned nor a whole number of elements apart."""

    def lay(values: Floats) -> Floats:
        dtype = np.dtype({"names": ["r"], "formats": [values.dtype], "offsets": [offset], "itemsize": itemsize})
        field: Floats = np.zeros(values.shape, dtype)["r"]
        field[...] = values
        return field

    return lay


def shifted(offset: int) -> Layout:
    """Contiguous, ``offset`` bytes off the alignment."""

    def lay(values: Floats) -> Floats:
        out: Floats = np.ndarray(values.shape, values.dtype, bytearray(values.nbytes + offset), offset)
        out[...] = values
        return out

    return lay


def strided(step: int) -> Layout:
    """Every ``step``-th element along the last axis; backwards if negative."""

    def lay(values: Floats) -> Floats:
        wide = np.zeros((*values.shape[:-1], values.shape[-1] * abs(step)), values.dtype)
        view: Floats = wide[..., ::step]
        view[...] = values
        return view

    return lay


def read_only(values: Floats) -> Floats:
    out = values.copy()
    out.flags.writeable = False
    return out


def message_bytes(values: Floats) -> Floats:
    """As readers of ROS bags hand ranges out: read-only and unaligned, over the bytes of the message."""
    out: Floats = np.frombuffer(b"\x2a" * 3 + values.tobytes(), values.dtype, offset=3)
    return out


def column_of_image(values: Floats) -> Floats:
    image = np.zeros((len(values), 3), values.dtype)
    image[:, 1] = values
    return image[:, 1]


def row_of_fortran(values: Floats) -> Floats:
    image: Floats = np.zeros((3, len(values)), values.dtype, order="F")
    image[1] = values
    row: Floats = image[1]
    return row


def row_of_larger(values: Floats) -> Floats:
    image: Floats = np.zeros((3, len(values) + 7), values.dtype)
    image[1, 5:-2] = values
    row: Floats = image[1, 5:-2]
    return row


def python_array(values: Floats) -> array.array[float]:
    return array.array(values.dtype.char, values.tobytes())


def memory(values: Floats) -> memoryview:
    return values.copy().data


def c_array(values: Floats) -> Any:
    kind = ctypes.c_float if values.dtype == np.float32 else ctypes.c_double
    return (kind * len(values)).from_buffer_copy(values.tobytes())


def from_dlpack(values: Floats) -> Floats:
    out: Floats = np.from_dlpack(Tensor(values))
    return out


class Tensor:
    """A tensor of another library: it offers DLPack and nothing else."""

    def __init__(self, values: Floats) -> None:
        self.values = values.copy()

    def __dlpack__(self, **options: Any) -> Any:
        return self.values.__dlpack__(**options)

    def __dlpack_device__(self) -> Any:
        return self.values.__dlpack_device__()


WRITABLE: dict[str, Layout] = {
    "contiguous": np.copy,
    "every second": strided(2),
    "every seventh": strided(7),
    "reversed": strided(-1),
    "every third, reversed": strided(-3),
    **{f"{offset} bytes off": shifted(offset) for offset in range(1, 8)},
    "unaligned and reversed": lambda values: shifted(1)(values[::-1])[::-1],
    "records of 13 bytes": records(13, 1),
    "records of 22 bytes": records(22, 12),
    "records of 22 bytes, reversed": lambda values: records(22, 5)(values[::-1])[::-1],
    "column of an image": column_of_image,
    "row of a Fortran image": row_of_fortran,
    "row of a larger image": row_of_larger,
}
BUFFERS: dict[str, Layout] = {
    "array.array": python_array,
    "memoryview": memory,
    "ctypes array": c_array,
}
LAYOUTS: dict[str, Layout] = {
    **WRITABLE,
    **BUFFERS,
    "smallest records": lambda values: records(values.itemsize + 1, 1)(values),
    "read-only": read_only,
    "bytes of a message": message_bytes,
    "numpy.from_dlpack": from_dlpack,
}


def fortran(values: Floats) -> Floats:
    return values.copy(order="F")


def beams_first(values: Floats) -> Floats:
    return values.T.copy().T


def rows_backwards(values: Floats) -> Floats:
    return values[::-1].copy()[::-1]


def both_backwards(values: Floats) -> Floats:
    return values[::-1, ::-1].copy()[::-1, ::-1]


def every_second_row(values: Floats) -> Floats:
    wide = np.zeros((2 * len(values), values.shape[1]), values.dtype)
    wide[1::2] = values
    return wide[1::2]


def inside_larger(values: Floats) -> Floats:
    wide = np.zeros((values.shape[0] + 2, values.shape[1] + 3), values.dtype)
    wide[1:-1, 2:-1] = values
    return wide[1:-1, 2:-1]


BATCH_LAYOUTS: dict[str, Layout] = {
    "contiguous": np.copy,
    "Fortran": fortran,
    "beams first": beams_first,
    "rows backwards": rows_backwards,
    "both backwards": both_backwards,
    "every second row": every_second_row,
    "inside a larger one": inside_larger,
    "every second beam": strided(2),
    "unaligned": shifted(3),
    "records of 13 bytes": records(13, 1),
    "read-only": read_only,
    "memoryview": memory,
}

one_scan = pytest.mark.parametrize("lay", LAYOUTS.values(), ids=LAYOUTS)
one_writable_scan = pytest.mark.parametrize("lay", WRITABLE.values(), ids=WRITABLE)
one_batch = pytest.mark.parametrize("lay", BATCH_LAYOUTS.values(), ids=BATCH_LAYOUTS)
both_dtypes = pytest.mark.parametrize("dtype", DTYPES)

NEAREST = ("ttc", "status", "beam", "angle", "range", "clearance", "closing_speed")
COUNTS = ("valid", "invalid", "too_close", "no_return", "out_of_range", "beyond_limits", "masked", "contact")


def everything(scan: ttc_fast.ScanTTC, ranges: Any, speed: Any) -> list[Any]:
    """All answers for these ranges, in a form where equal means bit for bit."""
    shape, dtype = np.asarray(ranges).shape, np.asarray(ranges).dtype
    status, bare_status = np.empty(shape, np.uint8), np.empty(shape, np.uint8)
    nearest = scan.nearest(ranges, speed, 0.3, 0.1)
    answers = [
        scan.min(ranges, speed),
        scan.min(ranges, speed, 0.3, 0.1),
        *(getattr(nearest, name) for name in NEAREST),
        *(getattr(nearest.counts, name) for name in COUNTS),
        scan.per_beam(ranges, speed, status_out=status),
        scan.per_beam(ranges, speed, 0.3, 0.1),
        status,
        ttc_fast.ittc(ranges, closing_speed=np.full(shape, 1.5, dtype), status_out=bare_status),
        ttc_fast.ittc(ranges, range_rate=-2.5),
        bare_status,
    ]
    return [np.asarray(answer).tobytes() for answer in answers]


@both_dtypes
@one_scan
def test_one_scan_is_read_as_its_contiguous_copy(lay: Layout, dtype: str) -> None:
    values = make_ranges(BEAMS, dtype)
    ranges, scan = lay(values), make_scan(BEAMS)
    assert np.asarray(ranges).tobytes() == values.tobytes()
    assert everything(scan, ranges, 5.0) == everything(scan, values, 5.0)
    assert everything(scan, ranges, -5.0) == everything(scan, values, -5.0)


def test_floats_in_records_of_five_bytes() -> None:
    values = make_ranges(BEAMS, "float32")
    ranges = records(5, 1)(values)
    assert (ranges.strides, ranges.flags.aligned) == ((5,), False)
    assert everything(make_scan(BEAMS), ranges, 5.0) == everything(make_scan(BEAMS), values, 5.0)


@both_dtypes
@one_batch
def test_a_batch_is_read_as_its_contiguous_copy(lay: Layout, dtype: str) -> None:
    values = make_ranges((ROWS, BEAMS), dtype)
    speeds = np.array([5.0, -5.0, 0.0, 0.5, 20.0])
    ranges, scan = lay(values), make_scan(BEAMS)
    assert np.asarray(ranges).tobytes() == values.tobytes()
    assert everything(scan, ranges, speeds) == everything(scan, values, speeds)


@both_dtypes
@pytest.mark.parametrize("beams", [1, 2, 15, 16, 17, 33])
def test_few_beams_far_apart(beams: int, dtype: str) -> None:
    values = np.linspace(3.0, 9.0, beams).astype(dtype)
    scan = make_scan(beams)
    for lay in (strided(5), strided(-5), records(13, 1), shifted(1)):
        assert everything(scan, lay(values), 5.0) == everything(scan, values, 5.0)


@both_dtypes
def test_one_scan_shared_by_many_rows(dtype: str) -> None:
    """Row stride 0: what one scan means at several speeds."""
    values, speeds = make_ranges(BEAMS, dtype), np.linspace(-8.0, 8.0, ROWS)
    scan, ranges = make_scan(BEAMS), np.broadcast_to(values, (ROWS, BEAMS))
    assert ranges.strides[0] == 0
    assert everything(scan, ranges, speeds) == everything(scan, ranges.copy(), speeds)


@both_dtypes
def test_one_reading_shared_by_all_beams(dtype: str) -> None:
    scan, ranges = make_scan(BEAMS), np.broadcast_to(np.array(4.0, dtype), BEAMS)
    assert ranges.strides == (0,)
    assert everything(scan, ranges, 5.0) == everything(scan, ranges.copy(), 5.0)
    both = np.broadcast_to(np.array(4.0, dtype), (ROWS, BEAMS))
    assert everything(scan, both, 5.0) == everything(scan, both.copy(), 5.0)


@both_dtypes
def test_overlapping_windows_are_a_batch(dtype: str) -> None:
    stream = make_ranges(BEAMS + ROWS - 1, dtype)
    windows = np.lib.stride_tricks.sliding_window_view(stream, BEAMS)
    assert everything(make_scan(BEAMS), windows, 5.0) == everything(make_scan(BEAMS), windows.copy(), 5.0)


@given(
    data=st.binary(min_size=400, max_size=400),
    dtype=st.sampled_from(DTYPES),
    beams=st.integers(1, 40),
    stride=st.integers(-9, 9),
)
def test_any_bytes_any_distance_apart(data: bytes, dtype: str, beams: int, stride: int) -> None:
    """Elements that overlap or touch, anywhere in memory, holding any bit pattern."""
    offset = -stride * (beams - 1) if stride < 0 else 0
    ranges: Floats = np.ndarray(beams, dtype, data, offset, (stride,))
    scan = ttc_fast.ScanTTC(-0.5, 1.0 / beams, beams, no_data=99.0)
    answers = everything(scan, ranges, 5.0)
    assert answers == everything(scan, ranges.copy(), 5.0)


def test_a_memory_map_is_an_array(tmp_path: Path) -> None:
    values = make_ranges(BEAMS, "float32")
    values.tofile(tmp_path / "scan.f32")
    mapped = np.memmap(tmp_path / "scan.f32", np.float32, mode="r")
    scan = make_scan(BEAMS)
    assert everything(scan, mapped, 5.0) == everything(scan, values, 5.0)
    assert type(scan.per_beam(mapped, 5.0)) is np.ndarray


def test_a_matrix_is_a_batch_of_one() -> None:
    """A matrix has two dimensions, always: what comes back is an array, not a float."""
    values = make_ranges(BEAMS, "float64")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PendingDeprecationWarning)
        matrix = np.matrix(values)
    scan = make_scan(BEAMS)
    assert scan.min(matrix, 5.0).tolist() == [scan.min(values, 5.0)]
    assert type(scan.per_beam(matrix, 5.0)) is np.ndarray


def test_a_torch_tensor_through_numpy() -> None:
    torch = pytest.importorskip("torch", reason="torch is not installed")
    tensor = torch.full((BEAMS,), 10.0)
    scan = make_scan(BEAMS)
    view: Floats = tensor.numpy()
    before = scan.min(view, 5.0)
    tensor[BEAMS // 2] = 5.0
    assert scan.min(view, 5.0) < before
    shared: Any = np.from_dlpack(tensor)
    assert scan.min(shared, 5.0) == scan.min(view, 5.0)


def test_what_offers_only_dlpack_is_read_in_place() -> None:
    ranges = make_ranges(BEAMS, "float32")
    tensor: Any = Tensor(ranges)
    scan = make_scan(BEAMS)
    assert scan.min(tensor, 5.0) == scan.min(ranges, 5.0)
    tensor.values[:] = 3.0
    assert scan.min(tensor, 5.0) == scan.min(np.full_like(ranges, 3.0), 5.0)


# --- no copy -----------------------------------------------------------------------------------------------------


@both_dtypes
@pytest.mark.parametrize("lay", [*WRITABLE.values(), *BUFFERS.values()], ids=[*WRITABLE, *BUFFERS])
def test_what_the_caller_writes_is_what_the_next_call_reads(lay: Layout, dtype: str) -> None:
    scan = ttc_fast.ScanTTC(0.0, 1e-9, BEAMS)
    ranges = lay(np.full(BEAMS, 10.0, dtype))
    out = np.empty(BEAMS, dtype)
    for beam, distance in ((0, 8.0), (BEAMS // 2, 6.0), (BEAMS - 1, 4.0)):
        ranges[beam] = distance
        assert scan.min(ranges, 2.0) == pytest.approx(distance / 2.0)
        assert scan.nearest(ranges, 2.0).beam == beam
        assert scan.per_beam(ranges, 2.0, out=out)[beam] == pytest.approx(distance / 2.0)
        assert ttc_fast.ittc(ranges, closing_speed=2.0, out=out)[beam] == distance / 2.0


def all_calls(scan: ttc_fast.ScanTTC, ranges: Any, speeds: Any, out: Floats, status: NDArray[np.uint8]) -> None:
    """Every function, on memory that is there already."""
    scan.min(ranges, 5.0)
    scan.min(ranges, 5.0, 0.3, 0.1)
    scan.nearest(ranges, 5.0)
    scan.per_beam(ranges, 5.0, out=out, status_out=status)
    ttc_fast.ittc(ranges, closing_speed=speeds, out=out, status_out=status)
    ttc_fast.ittc(ranges, range_rate=-2.5, out=out)


@both_dtypes
@one_scan
def test_numpy_allocates_nothing_of_the_size_of_the_input(lay: Layout, dtype: str) -> None:
    """NumPy reports its buffers to tracemalloc. What the kernels allocate is the next test's."""
    scan, ranges, speeds = (
        make_scan(LARGE),
        lay(np.resize(make_ranges(BEAMS, dtype), LARGE)),
        lay(np.full(LARGE, 1.5, dtype)),
    )
    out, status = np.empty(LARGE, dtype), np.empty(LARGE, np.uint8)
    assert peak_of(lambda: all_calls(scan, ranges, speeds, out, status)) < LARGE // 16


def without_memory(progress: Connection) -> None:
    """Call everything in every layout, in a process that cannot have another megabyte of input at once."""
    scan = make_scan(LARGE)

    def calls() -> Iterator[tuple[Any, int, Callable[[], None]]]:
        for dtype in DTYPES:
            out, status = np.empty(LARGE, dtype), np.empty(LARGE, np.uint8)
            for name, lay in LAYOUTS.items():
                ranges, speeds = lay(np.resize(make_ranges(BEAMS, dtype), LARGE)), lay(np.full(LARGE, 1.5, dtype))
                yield (dtype, name), out.nbytes, partial(all_calls, scan, ranges, speeds, out, status)

    call_each(progress, calls())


@pytest.mark.skipif(sys.platform != "linux", reason="needs /proc and RLIMIT_AS, as Linux has them")
def test_the_kernels_work_where_a_copy_would_not_fit() -> None:
    """Address space is limited so that a copy, by NumPy or by the kernels, fails (the control: malloc does)."""
    seen, ended = reports(without_memory)
    assert ended == 0, f"a copy was made for {seen[-1:]}"
    assert [(dtype, name, True) for dtype in DTYPES for name in LAYOUTS] == seen


# --- out and status_out --------------------------------------------------------------------------------------------


@both_dtypes
@one_writable_scan
def test_results_go_where_they_are_asked_to(lay: Layout, dtype: str) -> None:
    ranges, scan = make_ranges(BEAMS, dtype), make_scan(BEAMS)
    out, status = lay(np.zeros(BEAMS, dtype)), lay(np.zeros(BEAMS, np.uint8))
    expected_status = np.empty(BEAMS, np.uint8)
    expected = scan.per_beam(ranges, 5.0, status_out=expected_status)
    assert scan.per_beam(ranges, 5.0, out=out, status_out=status) is out
    assert (out.tobytes(), status.tobytes()) == (expected.tobytes(), expected_status.tobytes())

    expected = ttc_fast.ittc(ranges, closing_speed=1.5, status_out=expected_status)
    assert ttc_fast.ittc(ranges, closing_speed=1.5, out=out, status_out=status) is out
    assert (out.tobytes(), status.tobytes()) == (expected.tobytes(), expected_status.tobytes())


@both_dtypes
@pytest.mark.parametrize(
    "lay", [BATCH_LAYOUTS[name] for name in BATCH_LAYOUTS if name not in ("read-only", "memoryview")]
)
def test_results_of_a_batch_go_where_they_are_asked_to(lay: Layout, dtype: str) -> None:
    ranges, scan = make_ranges((ROWS, BEAMS), dtype), make_scan(BEAMS)
    out, status = lay(np.zeros(ranges.shape, dtype)), lay(np.zeros(ranges.shape, np.uint8))
    expected_status = np.empty(ranges.shape, np.uint8)
    expected = scan.per_beam(ranges, 5.0, status_out=expected_status)
    assert scan.per_beam(ranges, 5.0, out=out, status_out=status) is out
    assert (out.tobytes(), status.tobytes()) == (expected.tobytes(), expected_status.tobytes())


@pytest.mark.parametrize("step", [1, 2, 3, -2])
def test_nothing_is_written_beside_the_results(step: int) -> None:
    scan, ranges = make_scan(BEAMS), make_ranges(BEAMS, "float32")
    memory = np.full(3 * BEAMS + 8, 77.0, np.float32)
    out = memory[4 : 4 + BEAMS * abs(step)][::step]
    scan.per_beam(ranges, 5.0, out=out)
    out[...] = 77.0
    assert (memory == 77.0).all()


@both_dtypes
@one_writable_scan
def test_in_place(lay: Layout, dtype: str) -> None:
    values, scan = make_ranges(BEAMS, dtype), make_scan(BEAMS)
    ranges = lay(values)
    assert scan.per_beam(ranges, 5.0, out=ranges) is ranges
    assert ranges.tobytes() == scan.per_beam(values, 5.0).tobytes()
    ranges[...] = values
    ttc_fast.ittc(ranges, range_rate=-1.5, out=ranges)
    assert ranges.tobytes() == ttc_fast.ittc(values, range_rate=-1.5).tobytes()


def test_speeds_may_be_overwritten_in_place() -> None:
    ranges, speeds = np.full(BEAMS, 10.0), np.linspace(1.0, 9.0, BEAMS)
    expected = ttc_fast.ittc(ranges, closing_speed=speeds)
    assert ttc_fast.ittc(ranges, closing_speed=speeds, out=speeds).tobytes() == expected.tobytes()


@pytest.mark.parametrize("shift", [1, 16, BEAMS - 1])
def test_an_output_over_a_shifted_part_of_the_ranges_is_refused(shift: int) -> None:
    memory = np.full(BEAMS + shift, 10.0)
    for ranges, out in ((memory[:-shift], memory[shift:]), (memory[shift:], memory[:-shift])):
        with pytest.raises(ValueError, match=r"^out overlaps"):
            make_scan(BEAMS).per_beam(ranges, 5.0, out=out)
        with pytest.raises(ValueError, match=r"^out overlaps"):
            ttc_fast.ittc(ranges, closing_speed=1.0, out=out)


def test_an_output_over_the_reversed_ranges_is_refused() -> None:
    ranges = np.full(BEAMS, 10.0)
    with pytest.raises(ValueError, match=r"^out overlaps"):
        make_scan(BEAMS).per_beam(ranges, 5.0, out=ranges[::-1])


def test_a_status_over_the_ranges_is_refused() -> None:
    ranges = np.full(BEAMS, 10.0)
    with pytest.raises(ValueError, match=r"^status_out overlaps"):
        make_scan(BEAMS).per_beam(ranges, 5.0, status_out=ranges.view(np.uint8)[:BEAMS])


def test_an_output_over_a_shifted_part_of_the_speeds_is_refused() -> None:
    memory = np.full(BEAMS + 1, 2.0)
    ranges = np.full(BEAMS, 10.0)
    with pytest.raises(ValueError, match=r"^out overlaps"):
        ttc_fast.ittc(ranges, closing_speed=memory[:-1], out=memory[1:])
    with pytest.raises(ValueError, match=r"^out overlaps"):
        ttc_fast.ittc(ranges, range_rate=memory[:-1], out=memory[1:])


def test_a_status_over_the_output_is_refused() -> None:
    ranges, out = np.full(BEAMS, 10.0), np.empty(BEAMS)
    status = out.view(np.uint8)[:BEAMS]
    with pytest.raises(ValueError, match=r"^(status_)?out overlaps"):
        make_scan(BEAMS).per_beam(ranges, 5.0, out=out, status_out=status)
    with pytest.raises(ValueError, match=r"^(status_)?out overlaps"):
        ttc_fast.ittc(ranges, closing_speed=1.0, out=out, status_out=status)


def test_windows_that_share_memory_are_not_overwritten_in_place() -> None:
    """A row's result would be the next row's input."""
    windows = np.lib.stride_tricks.sliding_window_view(np.full(BEAMS + 1, 10.0), BEAMS, writeable=True)
    with pytest.raises(ValueError, match=r"^out overlaps"):
        make_scan(BEAMS).per_beam(windows, 5.0, out=windows)


@both_dtypes
def test_results_beside_the_ranges_in_the_same_records(dtype: str) -> None:
    """Interleaved is not overlapping."""
    points = np.zeros(BEAMS, [("range", dtype), ("ttc", dtype), ("status", np.uint8)])
    points["range"] = make_ranges(BEAMS, dtype)
    before, scan = points["range"].tobytes(), make_scan(BEAMS)
    status = np.empty(BEAMS, np.uint8)
    expected = scan.per_beam(points["range"].copy(), 5.0, status_out=status)
    scan.per_beam(points["range"], 5.0, out=points["ttc"], status_out=points["status"])
    assert points["range"].tobytes() == before
    assert points["ttc"].tobytes() == expected.tobytes()
    assert points["status"].tobytes() == status.tobytes()


def test_infinite_and_finite_answers_are_both_in_the_test_data() -> None:
    """The comparisons above mean something only if the answers vary."""
    ttc = make_scan(BEAMS).per_beam(make_ranges(BEAMS, "float64"), 5.0)
    assert 100 < np.isfinite(ttc).sum() < BEAMS - 100
    assert 0.0 < make_scan(BEAMS).min(np.full(BEAMS, 20.0), 5.0) < math.inf
