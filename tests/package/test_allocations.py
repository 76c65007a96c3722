"""The hot path, ``ScanTTC.min`` of one scan: one C call that allocates nothing but the float it returns.

Three instruments, because each sees only a part:

- ``sys.setprofile`` sees every Python frame and every call of a C function that the interpreter makes.
- ``tracemalloc`` sees what goes through Python's allocators (objects, and NumPy's buffers), with its highest point.
  It does not see the ``malloc`` of the kernels.
- A process in which every ``malloc`` fails sees that: an allocation of any size by the kernels ends it.
"""

from __future__ import annotations

import signal
import subprocess
import sys
import tracemalloc
import types
from pathlib import Path
from typing import Any

import pytest

import ttc_fast
from tests.support.hot_paths import hot_paths

FLOAT = sys.getsizeof(1.0)


every_hot_path = pytest.mark.parametrize(("scan", "ranges", "motion"), hot_paths().values(), ids=hot_paths())


@pytest.mark.parametrize("name", ["min", "nearest", "per_beam"])
def test_methods_are_built_in(name: str) -> None:
    scan, _, _ = hot_paths()["float32"]
    assert type(getattr(scan, name)) is types.BuiltinMethodType
    assert type(vars(ttc_fast.ScanTTC)[name]) is types.MethodDescriptorType
    assert type(ttc_fast.ittc) is types.BuiltinFunctionType


@every_hot_path
def test_no_python_runs_in_a_call(scan: ttc_fast.ScanTTC, ranges: Any, motion: tuple[float, ...]) -> None:
    scan.min(ranges, *motion)  # the first call of a process looks NumPy's C interface up
    events: list[str] = []

    def record(frame: types.FrameType, event: str, argument: Any) -> None:
        events.append(f"{event} {getattr(argument, '__name__', frame.f_code.co_name)}")

    sys.setprofile(record)
    try:
        scan.min(ranges, *motion)
    finally:
        sys.setprofile(None)
    assert events == ["c_call min", "c_return min", "c_call setprofile"]


@every_hot_path
def test_python_allocates_nothing_but_the_float(scan: ttc_fast.ScanTTC, ranges: Any, motion: tuple[float, ...]) -> None:
    kept, (speed, yaw_rate, lateral_speed) = [0.0] * 100, motion
    expected = scan.min(ranges, *motion)
    tracemalloc.start()
    try:
        before, _ = tracemalloc.get_traced_memory()
        tracemalloc.reset_peak()
        for index in range(100):
            kept[index] = scan.min(ranges, speed, yaw_rate, lateral_speed)
        after, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    slack = 3 * FLOAT  # of this function itself: the loop's counter, the tuples that tracemalloc gives
    assert after - before <= 100 * FLOAT + slack
    assert peak - after <= slack, "something was allocated and freed again"
    assert kept == [expected] * 100


def test_results_are_not_kept() -> None:
    """No blocks stay behind: a process that runs for weeks does not grow."""
    for scan, ranges, motion in hot_paths().values():
        scan.min(ranges, *motion)
        before = sys.getallocatedblocks()
        for _ in range(10_000):
            scan.min(ranges, *motion)
        assert sys.getallocatedblocks() - before < 100


WITHOUT_MALLOC = """
import ctypes, os, resource, sys, ttc_fast
sys.path.insert(0, {root!r})
from tests.support.hot_paths import hot_paths

scan, ranges, (speed, yaw_rate, lateral_speed) = hot_paths()[{name!r}]
{change}
expected = scan.min(ranges, speed, yaw_rate, lateral_speed)
spare = [bytes(size) for size in range(512) for _ in range(8)]
del spare  # Python's own small objects, the returned float among them, do not ask malloc
libc = ctypes.CDLL(None)
libc.malloc.restype, libc.malloc.argtypes = ctypes.c_void_p, [ctypes.c_size_t]
sizes = [*(1 << bits for bits in range(26, 11, -1)), *range(4096, 0, -16)]
with open("/proc/self/statm") as statm:
    used = int(statm.read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used, used))
for size in sizes:
    while libc.malloc(size):
        pass
if libc.malloc(1):
    os._exit(3)
found = scan.min(ranges, speed, yaw_rate, lateral_speed)
os._exit(0 if found == expected and not libc.malloc(1) else 4)
"""


def without_malloc(name: str, change: str = "") -> int:
    """The exit code of a process that calls ``min`` while every ``malloc`` fails."""
    program = WITHOUT_MALLOC.format(root=str(Path(__file__).parents[2]), name=name, change=change)
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, timeout=60, check=False)
    return done.returncode


needs_linux = pytest.mark.skipif(sys.platform != "linux", reason="needs /proc and RLIMIT_AS, as Linux has them")


@needs_linux
@pytest.mark.parametrize("name", hot_paths())
def test_the_kernels_allocate_nothing(name: str) -> None:
    assert without_malloc(name) == 0


@needs_linux
def test_the_test_above_can_fail() -> None:
    """A vote keeps its candidates on the heap: the process is aborted."""
    vote = "scan = ttc_fast.ScanTTC(-2.35, 4.7 / 1080, 1080, minimum=ttc_fast.KthSmallest(2))"
    assert without_malloc("float32", vote) == -signal.SIGABRT
