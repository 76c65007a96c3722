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

    from benches.case import Case, Entrant
    from benches.contestant import Contestant

SLICE_NS = 500_000
"""About how long each contestant works before the next one's turn. Well below what schedulers give at once, so that on
a busy machine the median turn is one without an interruption, for slow contestants too."""
BUDGET_NS = 2_000_000_000
FEWEST_ROUNDS = 7

_THROUGHPUT = """
def timed(turns):
    for ARGUMENT in turns:
        EXPRESSION
"""
_ONE_CALL = """
def timed():
    ARGUMENT = turn()
    EXPRESSION
"""


def interleaved(entrants: Sequence[Entrant], rounds: int) -> dict[Entrant, float]:
    """Median time of a call of each, ns, over rounds in which each has its turn, after its answers were checked.

    ``rounds`` of them, or as many as ``BUDGET_NS`` allows, but at least ``FEWEST_ROUNDS``.
    """
    times: list[list[float]] = []
    contestants = [entrant.checked() for entrant in entrants]
    with no_collection():
        stints = [_Stint(entrant.case, who) for entrant, who in zip(entrants, contestants, strict=True)]
        start = perf_counter_ns()
        while len(times) < rounds and (len(times) < FEWEST_ROUNDS or perf_counter_ns() - start < BUDGET_NS):
            times.append([stint.work() for stint in stints])
    medians = np.median(times, axis=0)
    return {entrant: float(median) for entrant, median in zip(entrants, medians, strict=True)}


def one_call(case: Case, contestant: Contestant) -> Callable[[], None]:
    """A function that asks about the next input; for clocks that are not ours."""
    inputs = [contestant.prepare(data) for data in case.pool()]
    return contestant.compiled(_ONE_CALL, turn=cycle(inputs).__next__)


class _Stint:
    """What one contestant does in a turn: as many calls as fill the slice, on inputs that come round again."""

    def __init__(self, case: Case, contestant: Contestant) -> None:
        self._timed = contestant.compiled(_THROUGHPUT)
        self._pool = case.pool()  # kept: what is prepared may be no more than a pointer
        self._inputs = [contestant.prepare(data) for data in self._pool]
        self._turns = cycle(self._inputs)
        self._calls = 1
        while (elapsed := self.work() * self._calls) < SLICE_NS / 2:
            self._calls = max(2 * self._calls, int(self._calls * SLICE_NS / (elapsed + 1)))

    def work(self) -> float:
        """Time of a call, ns, after the inputs were brought back into the caches that others have used meanwhile."""
        self._timed(self._inputs)
        turns = list(islice(self._turns, self._calls))
        start = perf_counter_ns()
        self._timed(turns)
        return (perf_counter_ns() - start) / self._calls


@contextmanager
def no_collection() -> Iterator[None]:
    """No garbage collection meanwhile: it would count as somebody's time, by chance."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()
