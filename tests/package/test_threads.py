"""One object in many threads, the GIL released for long work, interrupts, and memory that changes under a call."""

from __future__ import annotations

import math
import signal
import sys
import sysconfig
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import ttc_fast
from tests.support.common import CAR, can_interrupt, interrupted_after
from ttc_fast import KthSmallest, NeighbourSupport, NoDataError, ScanTTC

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

THREADS = 8
LARGE = 1 << 17  # beams: enough for the GIL to be released


def answers(scan: ScanTTC, ranges: Any, speed: float) -> tuple[Any, ...]:
    """All that a thread may ask, in a form that compares exactly."""
    status = np.empty(ranges.shape, np.uint8)
    return (
        scan.min(ranges, speed),
        repr(scan.nearest(ranges, speed, 0.2)),
        scan.per_beam(ranges, speed, 0.2, status_out=status).tobytes(),
        status.tobytes(),
        ttc_fast.ittc(ranges, closing_speed=speed).tobytes(),
    )


@pytest.mark.skipif(not sysconfig.get_config_var("Py_GIL_DISABLED"), reason="this Python always has the GIL")
def test_a_python_without_the_gil_stays_without() -> None:
    assert not getattr(sys, "_is_gil_enabled")()  # noqa: B009 (mypy knows no such name before 3.13)


@pytest.mark.parametrize("minimum", [None, KthSmallest(3), NeighbourSupport()], ids=repr)
@pytest.mark.parametrize("beams", [1080, LARGE])
def test_eight_threads_share_one_object(beams: int, minimum: Any) -> None:
    scan = ScanTTC(-2.0, 4.0 / beams, beams, outline=CAR, minimum=minimum)
    random = np.random.default_rng(2)
    scans = [random.uniform(0.2, 30.0, beams).astype(np.float32) for _ in range(THREADS)]
    speeds = np.linspace(-5.0, 5.0, THREADS)
    alone = [answers(scan, *arguments) for arguments in zip(scans, speeds, strict=True)]
    start = threading.Barrier(THREADS)

    def repeatedly(index: int) -> list[tuple[Any, ...]]:
        start.wait()
        return [answers(scan, scans[index], speeds[index]) for _ in range(200_000 // beams + 2)]

    with ThreadPoolExecutor(THREADS) as pool:
        for expected, found in zip(alone, pool.map(repeatedly, range(THREADS)), strict=True):
            assert set(found) == {expected}


@pytest.fixture
def voluntary_switches_only() -> Iterator[None]:
    """No thread loses the GIL unless it gives it up by itself."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1000.0)
    yield
    sys.setswitchinterval(before)


def lets_others_run(call: Callable[[], object]) -> bool:
    """Whether a Python thread that is ready to run does so before ``call`` ends."""
    go = threading.Lock()
    go.acquire()
    ran: list[float] = []

    def other() -> None:
        with go:
            ran.append(time.perf_counter())

    thread = threading.Thread(target=other)
    thread.start()
    go.release()  # does not give up the GIL: the other thread is ready now, and cannot go on
    call()
    ended = time.perf_counter()
    thread.join()
    return ran[0] < ended


LONG_SCAN = ScanTTC(-2.0, 4.0 / LARGE, LARGE)
LONG_RANGES = np.broadcast_to(np.full(LARGE, 10.0, np.float32), (32, LARGE))
LONG_OUT = np.empty(LONG_RANGES.shape, np.float32)
LONG_CALLS = {
    "min": lambda: LONG_SCAN.min(LONG_RANGES, 5.0, 0.0, 1.0),
    "nearest": lambda: LONG_SCAN.nearest(LONG_RANGES, 5.0, 0.0, 1.0),
    "per_beam": lambda: LONG_SCAN.per_beam(LONG_RANGES, 5.0, out=LONG_OUT),
    "ittc": lambda: ttc_fast.ittc(LONG_RANGES, closing_speed=5.0, out=LONG_OUT),
}


@pytest.mark.usefixtures("voluntary_switches_only")
@pytest.mark.parametrize("call", LONG_CALLS.values(), ids=LONG_CALLS)
def test_long_work_releases_the_gil(call: Callable[[], object]) -> None:
    """The other thread needs a processor within the call, which a busy machine may deny: one success proves it."""
    assert any(lets_others_run(call) for _ in range(50))


@pytest.mark.usefixtures("voluntary_switches_only")
@pytest.mark.skipif(not getattr(sys, "_is_gil_enabled", lambda: True)(), reason="there is no GIL to hold")
def test_the_test_above_can_fail() -> None:
    """A call that keeps the GIL is seen to keep it."""
    assert not any(lets_others_run(lambda: sum(range(300_000))) for _ in range(5))


def endless_rows(rows: int, *row: int) -> Any:
    """Rows of one row's memory, more than any processor gets through in several seconds."""
    return np.broadcast_to(np.full(row, 10.0, np.float32), (rows, *row))


def keypoints(estimator: Any, threads: int) -> Any:
    before = np.random.default_rng(3).uniform(0.0, 2000.0, ((1 << 20) - 1, 2)).astype(np.float32)
    return ttc_fast.ttc_from_keypoints(before, before * 1.02, 0.1, estimator=estimator, threads=threads)


ENDLESS_SCAN = partial(ScanTTC, -2.0, 4.0 / 65_536, 65_536)
ENDLESS_CALLS = {
    "min": lambda threads: ENDLESS_SCAN(threads=threads).min(endless_rows(2_000_000, 65_536), 5.0, 0.1),
    "nearest": lambda threads: ENDLESS_SCAN(threads=threads).nearest(endless_rows(2_000_000, 65_536), 5.0, 0.1),
    "swept path": lambda _: ttc_fast.SweptPath(CAR).min(endless_rows(4_000_000, 1000, 3), 5.0, 0.1),
    "no columns": lambda _: ttc_fast.ittc(np.empty((1 << 40, 0)), closing_speed=5.0),
    "median": lambda threads: keypoints(ttc_fast.MedianRatio(), threads),
    "consensus": lambda threads: keypoints(ttc_fast.Consensus(trials=1_000_000), threads),
    "pairs of the consensus": lambda threads: keypoints(ttc_fast.Consensus(trials=1), threads),
}


@can_interrupt
@pytest.mark.slow
@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("call", ENDLESS_CALLS.values(), ids=ENDLESS_CALLS)
def test_an_interrupt_ends_a_long_call(call: Callable[[int], object], threads: int) -> None:
    begun = time.process_time()
    with interrupted_after(1.0), pytest.raises(KeyboardInterrupt):
        call(threads)
    assert time.process_time() - begun < 25.0


def cluster() -> Any:
    points = np.random.default_rng(4).uniform(3.0, 60.0, (1 << 19, 3))
    return ttc_fast.robust_min_x(points, gate=EVERYWHERE, estimator=ttc_fast.Cluster(tolerance=1e-9, min_points=2))


EVERYWHERE = ttc_fast.Gate(x=(0.0, 99.0), y=(-99.0, 99.0), z=(-99.0, 99.0))
CALLS_OF_A_SECOND = {
    "batch": lambda: LONG_SCAN.min(np.broadcast_to(LONG_RANGES[0], (20_000, LARGE)), 5.0, 0.1).tobytes(),
    "cluster": cluster,
}


@can_interrupt
@pytest.mark.slow
@pytest.mark.parametrize("call", CALLS_OF_A_SECOND.values(), ids=CALLS_OF_A_SECOND)
def test_a_handler_that_does_not_raise_runs_meanwhile_and_changes_nothing(call: Callable[[], object]) -> None:
    expected, meanwhile = call(), []
    before = signal.signal(signal.SIGALRM, lambda *_: meanwhile.append(LONG_SCAN.min(LONG_RANGES[0], 5.0)))
    signal.setitimer(signal.ITIMER_REAL, 0.05, 0.05)
    try:
        assert repr(call()) == repr(expected)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    assert len(meanwhile) >= 2  # once is after the call


@pytest.mark.parametrize("minimum", [None, KthSmallest(3), NeighbourSupport()], ids=repr)
def test_ranges_may_change_during_a_call(minimum: Any) -> None:
    """A call may then see a mix of frames. It sees nothing else, and never fails otherwise than for want of data."""
    scan = ScanTTC(-1e-9, 2e-9 / LARGE, LARGE, outline=(-1.0, 0.5, -1.0, 1.0), minimum=minimum)
    ranges, out = np.full(LARGE, 10.5), np.empty(LARGE)
    status = np.empty(LARGE, np.uint8)
    stop = threading.Event()

    def write() -> None:
        random = np.random.default_rng(4)
        while not stop.is_set():
            at = int(random.integers(LARGE))
            ranges[at : at + LARGE // 4] = random.choice([10.5, 5.5, math.nan, math.inf, -math.inf])

    writer = threading.Thread(target=write)
    writer.start()
    possible = {0.0, 1.0, 2.0, math.inf}
    try:
        for _ in range(60):
            try:
                least = scan.min(ranges, 5.0)
            except NoDataError:
                least = math.inf
            assert least in possible
            nearest = scan.nearest(ranges, 5.0)
            assert nearest.ttc in possible
            assert -1 <= nearest.beam < LARGE
            scan.per_beam(ranges, 5.0, out=out, status_out=status)
            assert set(np.unique(out)) <= possible
            assert set(np.unique(status)) <= set(ttc_fast.Status)
            ttc_fast.ittc(ranges, closing_speed=5.0, out=out)
            assert set(np.unique(out)) <= {0.0, 1.1, 2.1, math.inf}
    finally:
        stop.set()
        writer.join()
    ranges[:] = 5.5
    assert scan.min(ranges, 5.0) == 1.0


@pytest.mark.parametrize("threads", [1, 2, 3, 8])
def test_threads_share_a_batch_and_change_no_answer(threads: int) -> None:
    rng = np.random.default_rng(threads)
    ranges = rng.uniform(0.1, 9.0, (700, 1080)).astype(np.float32)
    speeds = rng.uniform(-3.0, 9.0, 700)
    alone, shared = (ttc_fast.ScanTTC(-2.0, 0.004, 1080, threads=n) for n in (1, threads))
    assert shared.min(ranges, speeds).tobytes() == alone.min(ranges, speeds).tobytes()
    assert shared.nearest(ranges, speeds).beam.tobytes() == alone.nearest(ranges, speeds).beam.tobytes()
    ranges[650] = np.nan
    with pytest.raises(ttc_fast.NoDataError, match="scan 650"):
        shared.min(ranges, speeds)


@pytest.mark.parametrize("threads", [2, 3, 8])
@pytest.mark.parametrize("rows", [1, 3], ids=["one row", "three rows"])
def test_threads_share_a_cloud_and_change_no_answer(threads: int, rows: int) -> None:
    rng = np.random.default_rng(threads)
    points = np.round(rng.normal(0.0, 9.0, (rows, 400_001, 4)), 2).astype(np.float32)  # rounded: many ties
    points[:, ::7] = 0.0
    for estimator in (
        ttc_fast.Minimum(),
        ttc_fast.KthSmallest(5000),
        ttc_fast.Quantile(0.01),
        ttc_fast.Supported(9, 0.1),
    ):
        found = [ttc_fast.robust_min_x(points, estimator=estimator, threads=n) for n in (1, threads)]
        assert repr(found[0]) == repr(found[1])
        assert (found[0].x, found[0].index, found[0].candidates) == (found[1].x, found[1].index, found[1].candidates)


@pytest.mark.parametrize("threads", [0, -1, 1025, 2**40])
def test_a_number_of_threads_that_makes_no_sense(threads: int) -> None:
    with pytest.raises(ValueError, match="threads"):
        ttc_fast.ScanTTC(0.0, 0.1, 3, threads=threads)
    with pytest.raises(ValueError, match="threads"):
        ttc_fast.robust_min_x(np.zeros((3, 3)), threads=threads)
