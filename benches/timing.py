"""Clocks."""

from __future__ import annotations

import gc
from contextlib import contextmanager
from itertools import cycle, islice
from time import perf_counter_ns
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

    from benches.cases import Case
    from benches.contestant import Contestant

SLICE_NS = 500_000
"""About how long each contestant works before the next one's turn. Well below what schedulers give at once, so that on
a busy machine the median turn is one without an interruption, for slow contestants too."""
BUDGET_NS = 2_000_000_000
FEWEST_ROUNDS = 7

_THROUGHPUT = """
def timed(scans):
    for ranges in scans:
        EXPRESSION
"""
_LATENCY = """
def timed(samples, turns):
    for call, ranges in enumerate(turns):
        start = clock()
        EXPRESSION
        samples[call] = clock() - start
"""
_ONE_CALL = """
def timed():
    ranges = turn()
    EXPRESSION
"""


def interleaved(case: Case, contestants: Sequence[Contestant], rounds: int) -> list[float]:
    """Median time of a call of each contestant, ns, over rounds in which each has its turn.

    ``rounds`` of them, or as many as ``BUDGET_NS`` allows, but at least ``FEWEST_ROUNDS``.
    """
    times: list[list[float]] = []
    with _no_collection():
        stints = [_Stint(case, contestant) for contestant in contestants]
        start = perf_counter_ns()
        while len(times) < rounds and (len(times) < FEWEST_ROUNDS or perf_counter_ns() - start < BUDGET_NS):
            times.append([stint.work() for stint in stints])
    return [float(median) for median in np.median(times, axis=0)]


def latencies(case: Case, contestant: Contestant, calls: int) -> NDArray[np.int64]:
    """Time of each of ``calls`` calls back to back, ns, with what the clock itself takes."""
    samples = np.empty(calls, np.int64)
    timed = contestant.compiled(_LATENCY, clock=perf_counter_ns)
    with _no_collection():
        timed(samples, islice(cycle(case.pool()), calls))
    return samples


def one_call(case: Case, contestant: Contestant) -> Callable[[], None]:
    """A function that asks about the next scan; for clocks that are not ours."""
    return contestant.compiled(_ONE_CALL, turn=cycle(case.pool()).__next__)


class _Stint:
    """What one contestant does in a turn: as many calls as fill the slice, on scans that come round again and again."""

    def __init__(self, case: Case, contestant: Contestant) -> None:
        self._timed = contestant.compiled(_THROUGHPUT)
        self._scans = cycle(case.pool())
        self._calls = 1
        while (elapsed := self.work() * self._calls) < SLICE_NS / 2:
            self._calls = max(2 * self._calls, int(self._calls * SLICE_NS / (elapsed + 1)))

    def work(self) -> float:
        """Time of a call, ns."""
        scans = list(islice(self._scans, self._calls))
        start = perf_counter_ns()
        self._timed(scans)
        return (perf_counter_ns() - start) / self._calls


@contextmanager
def _no_collection() -> Iterator[None]:
    """No garbage collection meanwhile: it would count as somebody's time, by chance."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()
