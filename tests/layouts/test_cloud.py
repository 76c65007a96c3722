"""Whatever a cloud looks like in memory, the answer is that of plain rows; nothing is copied, nothing else is read."""

from __future__ import annotations

import ctypes
import mmap
import sys
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import ttc_fast
from tests.support.cloud_layouts import IN_COLUMNS, IN_ROWS, unaligned
from tests.support.clouds import BRIGHT, ESTIMATORS, GATES, answer, answers, make_points
from tests.support.common import LOWER, peak_of, reports
from tests.support.little_memory import call_each
from ttc_fast import Cluster, Detection, Gate, Minimum, Quantile, robust_min_x

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from multiprocessing.connection import Connection
    from pathlib import Path

    from numpy.typing import NDArray

    Array = NDArray[Any]
    Columns = tuple[Array, ...]
    Layout = Callable[[Columns], Any]

DTYPES = ["float32", "float64"]
POINTS = 2500  # beyond the 2048 from which a sample is looked at first, and divisible by the height of a grid
LARGE = 1 << 18
FEW = (1, 2, 3, 4, 5, 8, 15, 16, 17, 18, 31, 32, 33, 34, 48, 49, 50)
STEPS = (12, 16, 22, 26, 32, 48)  # of PointCloud2 messages


def step_of(step: int, lead: int, apart: int = 0) -> Layout:
    """Records of ``step`` bytes: ``lead`` bytes, x, y, z, ``apart`` bytes, the intensity, and whatever is left."""

    def lay(columns: Columns) -> Array:
        size = columns[0].itemsize
        names = ["x", "y", "z", "intensity"][: len(columns)]
        layout: Any = {
            "names": names,
            "formats": [column.dtype for column in columns],
            "offsets": [lead, lead + size, lead + 2 * size, lead + 3 * size + apart][: len(columns)],
            "itemsize": step,
        }
        points: Array = np.full(len(columns[0]) * step, 0x41, np.uint8).view(np.dtype(layout))
        for name, column in zip(names, columns, strict=True):
            points[name] = column
        return points

    return lay


def wide(width: int) -> Layout:
    """Rows of ``width`` numbers, the first three or four of which are a point."""

    def lay(columns: Columns) -> Array:
        rows = np.full((len(columns[0]), width), 3.0, columns[0].dtype)
        rows[:, : len(columns)] = np.column_stack(columns)
        return rows

    return lay


def strided(points: int, numbers: int) -> Layout:
    """Rows any distance apart in memory, and their numbers too; backwards if negative."""

    def lay(columns: Columns) -> Array:
        memory = np.zeros((len(columns[0]) * abs(points), len(columns) * abs(numbers)), columns[0].dtype)
        rows: Array = memory[::points, ::numbers]
        rows[...] = np.column_stack(columns)
        return rows

    return lay


def shifted(offset: int) -> Layout:
    """Contiguous rows, ``offset`` bytes off the alignment."""

    def lay(columns: Columns) -> Array:
        plain = np.column_stack(columns)
        rows: Array = np.ndarray(plain.shape, plain.dtype, bytearray(plain.nbytes + offset), offset)
        rows[...] = plain
        return rows

    return lay


def message_bytes(columns: Columns) -> Array:
    """Read-only and unaligned, over the bytes of a message."""
    plain = np.column_stack(columns)
    rows: Array = np.frombuffer(b"\x2a" * 3 + plain.tobytes(), plain.dtype, offset=3).reshape(plain.shape)
    return rows


def organised_steps(step: int, padding: int) -> Layout:
    """Records in rows that end with ``padding`` bytes, as ``row_step`` allows."""

    def lay(columns: Columns) -> Array:
        records = step_of(step, 0)(columns)
        height, width = 4, len(records) // 4
        row_step = width * step + padding
        memory = np.full(height * row_step, 0x41, np.uint8)
        points: Array = np.ndarray((height, width), records.dtype, memory.data, 0, (row_step, step))
        points[...] = records.reshape(height, width)
        return points

    return lay


ROWS: dict[str, Layout] = {
    **{f"(N, {width})": wide(width) for width in (5, 6, 9)},
    **{f"{offset} bytes off": shifted(offset) for offset in range(1, 8)},
    **{f"every {step} points": strided(step, 1) for step in (2, 5, -1, -2)},
    "every second number": strided(1, 2),
    "everything backwards": strided(-1, -1),
    "numbers backwards, apart": strided(3, -3),
    "bytes of a message": message_bytes,
    "recarray": lambda columns: step_of(40, 4)(columns).view(np.recarray),
    **IN_ROWS,
}
RECORDS: dict[str, Layout] = {
    "odd offsets": step_of(39, 3, 1),
    "packed, 1 byte ahead": step_of(33, 1),
    "steps of 48, apart": step_of(48, 0, 4),
    "steps of 48, at their end": step_of(48, 15),
    "organised": organised_steps(32, 0),
    "organised, rows padded": organised_steps(32, 16),
    "organised, rows padded by odd bytes": organised_steps(33, 5),
    "columns of one type each": lambda columns: tuple(unaligned(column)[::-1].copy()[::-1] for column in columns),
    **IN_COLUMNS,
}
LAYOUTS = ROWS | RECORDS
"""What layouts do with coordinates, and an intensity of the same type."""
INTENSITIES = ["int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64"]

both_dtypes = pytest.mark.parametrize("dtype", DTYPES)
each_layout = pytest.mark.parametrize("lay", LAYOUTS.values(), ids=LAYOUTS)


def columns_of(count: int, dtype: str, intensity: str | None = None) -> Columns:
    x, y, z, bright = make_points(count, dtype).T.copy()
    return (x, y, z) if intensity is None else (x, y, z, bright.astype(intensity))


def everything(points: Any, bright: bool) -> list[Any]:
    return answers(points, [*GATES.values(), *(BRIGHT.values() if bright else ())])


@pytest.fixture(scope="module")
def expected() -> dict[tuple[str, bool], list[Any]]:
    """The answers for plain, contiguous rows."""
    plain = {dtype: make_points(POINTS, dtype) for dtype in DTYPES}
    return {
        (dtype, bright): everything(plain[dtype][:, : 3 + bright].copy(), bright)
        for dtype in DTYPES
        for bright in (False, True)
    }


# --- the same answer -----------------------------------------------------------------------------------------------


def test_the_answers_vary(expected: dict[tuple[str, bool], list[Any]]) -> None:
    """The comparisons below mean something only if gates and estimators have something to decide."""
    for found in expected.values():
        assert len(set(found)) > 0.9 * len(found)
        assert all(detection in (Detection.FOUND, Detection.TOO_FEW) for *_, detection in found)
        assert sum(detection is Detection.FOUND for *_, detection in found) > 0.9 * len(found)
    assert expected["float32", True] != expected["float64", True]


@both_dtypes
@each_layout
@pytest.mark.parametrize("bright", [False, True], ids=["x, y, z", "x, y, z, intensity"])
def test_it_is_read_as_plain_rows(lay: Layout, dtype: str, bright: bool, expected: Any) -> None:
    points = lay(columns_of(POINTS, dtype, dtype if bright else None))
    assert everything(points, bright) == expected[dtype, bright]


@both_dtypes
@pytest.mark.parametrize("intensity", INTENSITIES)
@pytest.mark.parametrize("lay", RECORDS.values(), ids=RECORDS)
def test_an_intensity_of_another_type(lay: Layout, dtype: str, intensity: str, expected: Any) -> None:
    assert everything(lay(columns_of(POINTS, dtype, intensity)), True) == expected[dtype, True]


def left_over(step: int, dtype: str, intensity: str | None) -> int:
    return step - 3 * np.dtype(dtype).itemsize - (0 if intensity is None else np.dtype(intensity).itemsize)


FITTING = [
    (step, dtype, intensity)
    for step in STEPS
    for dtype in DTYPES
    for intensity in (None, *INTENSITIES)
    if left_over(step, dtype, intensity) >= 0
]


@pytest.mark.parametrize(("step", "dtype", "intensity"), FITTING)
def test_steps_of_messages(step: int, dtype: str, intensity: str | None, expected: Any) -> None:
    """With x, y, z in front, in the middle and at the very end of each record, at even and odd offsets."""
    columns, spare = columns_of(POINTS, dtype, intensity), left_over(step, dtype, intensity)
    for lead, apart in {(0, 0), (0, spare), (spare, 0), (spare // 2, 0), (min(spare, 1), max(spare - 1, 0))}:
        points = step_of(step, lead, apart)(columns)
        assert points.strides == (step,)
        assert everything(points, intensity is not None) == expected[dtype, intensity is not None]


@both_dtypes
@pytest.mark.parametrize("count", FEW)
def test_few_points(count: int, dtype: str) -> None:
    for name, lay in RECORDS.items():
        if count % 4 and name.startswith("organised"):
            continue
        columns = columns_of(count, dtype, dtype)
        assert everything(lay(columns), True) == everything(np.column_stack(columns), True), name


def test_bounds_are_rounded_to_the_type_of_the_intensity() -> None:
    """0.7 is on the bound as float32 and as float64; the byte 1 is not beyond 0.9999."""
    for dtype in ("float32", "float64"):
        x = np.array([5.0, 6.0, 7.0], dtype)
        for intensity in ("float32", "float64"):
            points = (x, x * 0, x * 0, np.array([0.6, 0.7, 0.8], intensity))
            assert robust_min_x(points, gate=Gate(intensity=(0.7, 9.0)), estimator=Minimum()).x == 6.0
        points = (x, x * 0, x * 0, np.array([0, 1, 2], np.uint8))
        assert robust_min_x(points, gate=Gate(intensity=(0.9999, 9.0)), estimator=Minimum()).x == 6.0


@both_dtypes
def test_one_point_shared_by_all(dtype: str) -> None:
    """Stride 0."""
    points = np.broadcast_to(np.array([5.0, 1.0, 0.5, 30.0], dtype), (POINTS, 4))
    assert points.strides[0] == 0
    assert everything(points, True) == everything(points.copy(), True)
    x, y, z, intensity = points.T
    assert everything((x, y.copy(), z, intensity.astype(np.uint8)), True) == everything(points.copy(), True)


def test_points_that_share_bytes() -> None:
    """Windows of a stream: x of each point is y of the one before."""
    stream = make_points(POINTS, "float32")[:, 0]
    windows = np.lib.stride_tricks.sliding_window_view(stream, 4)
    assert everything(windows, True) == everything(windows.copy(), True)


@pytest.mark.parametrize("shape", [(0, 3), (0, 4), (0, 5, 3), (5, 0, 4)])
def test_no_points_at_all(shape: tuple[int, ...]) -> None:
    for dtype in DTYPES:
        for gate in GATES.values():
            for found in (
                robust_min_x(np.empty(shape, dtype), gate=gate, estimator=each) for each in ESTIMATORS.values()
            ):
                assert (found.detection, found.candidates, found.index) == (Detection.NO_DATA, 0, -1)
    empty = np.empty(0, [("x", "f4"), ("y", "f4"), ("z", "f4")])
    assert robust_min_x(empty).detection is Detection.NO_DATA
    assert robust_min_x((np.empty(0),) * 3).detection is Detection.NO_DATA


def test_a_memory_map(tmp_path: Path) -> None:
    """A KITTI file as it lies on the disk."""
    plain = make_points(POINTS, "float32")
    plain.tofile(tmp_path / "frame.bin")
    mapped = np.memmap(tmp_path / "frame.bin", np.float32, mode="r").reshape(-1, 4)
    assert everything(mapped, True) == everything(plain, True)


def test_two_clouds_in_two_layouts() -> None:
    before, now = make_points(POINTS, "float32"), make_points(POINTS, "float32")
    now[:, 0] -= 0.5
    plain = ttc_fast.ttc_from_clouds(before, now, 0.1)
    mixed = ttc_fast.ttc_from_clouds(step_of(22, 1)(tuple(before.T)), np.asfortranarray(now), 0.1)
    assert (plain.ttc, plain.status, plain.closing_speed) == (mixed.ttc, mixed.status, mixed.closing_speed)
    assert answer(plain.previous) == answer(mixed.previous)
    assert answer(plain.current) == answer(mixed.current)


# --- no copy -------------------------------------------------------------------------------------------------------


def xyz_of(points: Any) -> list[Array]:
    """The columns of a cloud, as views of its own memory."""
    if isinstance(points, tuple):
        return list(points)
    if points.dtype.names:
        return [points[name] for name in ("x", "y", "z", "intensity") if name in points.dtype.names]
    return [points[..., column] for column in range(min(points.shape[-1], 4))]


READ_ONLY = ("read-only", "bytes of a message")


@both_dtypes
@pytest.mark.parametrize("lay", [LAYOUTS[name] for name in LAYOUTS if name not in READ_ONLY])
def test_what_the_caller_writes_is_what_the_next_call_reads(lay: Layout, dtype: str) -> None:
    x, y, z, intensity = (np.full(1000, value, dtype) for value in (9.0, 0.5, 0.25, 50.0))
    points = lay((x.copy(), y, z, intensity))
    written, *_ = xyz_of(points)
    for place, distance in ((0, 8.0), (500, 7.0), (999, 6.0)):
        written[np.unravel_index(place, written.shape)] = distance
        found = robust_min_x(points, gate=Gate(intensity=(50, 50)), estimator=Minimum())
        assert (found.x, found.index, found.candidates) == (distance, place, 1000)


def ask(points: Any) -> None:
    """Questions that few points answer, so that nothing of the size of the cloud has to be remembered."""
    for gate in (Gate(x=(0.0, 0.6)), Gate(x=(0.0, 0.6), intensity=(20.0, 70.0)), Gate(x=(0.0, 0.6), curvature=0.04)):
        for estimator in (Minimum(), Quantile(0.5), Cluster(0.4, 4)):
            robust_min_x(points, gate=gate, estimator=estimator)


def large(dtype: str) -> Columns:
    x, y, z, intensity = (np.resize(column, LARGE) for column in columns_of(POINTS, dtype, dtype))
    return x, y, z, intensity


@both_dtypes
@each_layout
def test_numpy_allocates_nothing_of_the_size_of_the_cloud(lay: Layout, dtype: str) -> None:
    """NumPy reports its buffers to tracemalloc. What the kernels allocate is the next test's."""
    points = lay(tuple(column[: LARGE // 4] for column in large(dtype)))
    assert peak_of(lambda: ask(points)) < LARGE // 8


def without_memory(progress: Connection) -> None:
    """Ask about every layout, in a process that cannot have another column at once."""
    import numpy.ma  # noqa: F401 - the first call with a subclass of ndarray imports it

    def calls() -> Iterator[tuple[Any, int, Callable[[], None]]]:
        for dtype in DTYPES:
            columns = large(dtype)
            for name, lay in LAYOUTS.items():
                yield (dtype, name), columns[0].nbytes, partial(ask, lay(columns))

    call_each(progress, calls())


@pytest.mark.skipif(sys.platform != "linux", reason="needs /proc and RLIMIT_AS, as Linux has them")
def test_the_kernels_work_where_a_copy_would_not_fit() -> None:
    """Address space is limited so that a copy of one column fails, whoever makes it (the control: malloc)."""
    seen, ended = reports(without_memory)
    assert ended == 0, f"a copy was made for {seen[-1:]}"
    assert seen == [(dtype, name, True) for dtype in DTYPES for name in LAYOUTS]


# --- nothing beside the points is read -----------------------------------------------------------------------------


class Guarded:
    """Memory between two pages that may not be touched."""

    def __init__(self, size: int) -> None:
        self.size = -(-size // mmap.PAGESIZE) * mmap.PAGESIZE
        self.memory = mmap.mmap(-1, self.size + 2 * mmap.PAGESIZE)
        self.start: int = np.frombuffer(self.memory, np.uint8).ctypes.data
        protect = ctypes.CDLL(None, use_errno=True).mprotect
        protect.argtypes = (ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int)
        for guard in (self.start, self.start + mmap.PAGESIZE + self.size):
            assert protect(guard, mmap.PAGESIZE, 0) == 0

    def move(self, columns: list[Array], *, to_the_end: bool) -> Columns:
        """The columns as they lie relative to each other, with their first byte, or their last, next to a guard."""
        extents = [extent(column) for column in columns]
        low, high = min(begin for begin, _ in extents), max(end for _, end in extents)
        offset = mmap.PAGESIZE + (self.size - (high - low) if to_the_end else 0)
        ctypes.memmove(self.start + offset, low, high - low)
        return tuple(
            np.ndarray(column.shape, column.dtype, self.memory, offset + column.ctypes.data - low, column.strides)
            for column in columns
        )


def extent(array: Array) -> tuple[int, int]:
    """First and last byte (exclusive) of an array, wherever its strides lead."""
    reach = [(n - 1) * stride for n, stride in zip(array.shape, array.strides, strict=True)]
    first: int = array.ctypes.data + sum(min(each, 0) for each in reach)
    return first, array.ctypes.data + sum(max(each, 0) for each in reach) + array.itemsize


def between_guards(progress: Connection) -> None:
    """Ask about few points in every layout, right behind one guard and right before the other."""
    guarded = Guarded(1 << 16)
    progress.send(ttc_fast.SIMD_LEVEL)
    for dtype in DTYPES:
        for name, lay in LAYOUTS.items():
            progress.send((dtype, name))
            for count in FEW:
                if count % 4 and "organised" in name:
                    continue
                for intensity in (None, dtype, *(INTENSITIES if name in RECORDS else ())):
                    read_at_the_edges(guarded, lay(columns_of(count, dtype, intensity)))


def read_at_the_edges(guarded: Guarded, points: Any) -> None:
    columns = xyz_of(points)
    gates = [Gate(), *([Gate(intensity=(20.0, 70.0))] if len(columns) == 4 else [])]
    expected = answers(points, gates, [Minimum()])
    # Columns of their own are moved one at a time.
    parts = [slice(i, i + 1) for i in range(len(columns))] if isinstance(points, tuple) else [slice(None)]
    for part in parts:
        for to_the_end in (False, True):
            moved = list(columns)
            moved[part] = guarded.move(columns[part], to_the_end=to_the_end)
            assert answers(tuple(moved), gates, [Minimum()]) == expected


def beyond_the_guard(progress: Connection) -> None:
    guarded = Guarded(1 << 12)
    at_the_edge = guarded.start + mmap.PAGESIZE + guarded.size
    progress.send(ctypes.string_at(at_the_edge - 1, 1))
    progress.send(ctypes.string_at(at_the_edge, 1))


linux_only = pytest.mark.skipif(sys.platform != "linux", reason="needs mprotect")


@linux_only
@pytest.mark.parametrize(
    "level", [*(pytest.param(each, marks=pytest.mark.slow) for each in LOWER), ttc_fast.SIMD_LEVEL]
)
def test_nothing_before_the_first_or_after_the_last_byte_is_read(level: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The packed kernel loads four numbers of a point that has three: not of the last one."""
    monkeypatch.setenv("TTC_FAST_SIMD", level)
    seen, ended = reports(between_guards)
    assert ended == 0, f"read beside the points of {seen[-1:]}"
    assert seen == [level, *((dtype, name) for dtype in DTYPES for name in LAYOUTS)]


@linux_only
def test_the_guards_guard() -> None:
    """The control: the last byte before the guard can be read, and the process dies of reading the next."""
    seen, ended = reports(beyond_the_guard)
    assert seen == [b"\0"]
    assert ended is not None
    assert ended < 0
