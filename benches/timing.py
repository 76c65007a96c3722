"""How times are taken: in turns, so that other work of the machine hits all implementations alike."""

from __future__ import annotations

import gc
from contextlib import contextmanager
from itertools import cycle, islice
from time import perf_counter_ns
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from benches.case import Case, Implementation

SLICE_NS = 500_000
"""How long an implementation works, about, before the turn of the next. It is well below what schedulers give at once,
so that on a busy machine the median turn is one without an interruption, for slow implementations too."""
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


def interleaved(timed: Sequence[tuple[Case, str]], rounds: int) -> dict[tuple[Case, str], float]:
    """Return the median time of a call, ns, of each implementation of a case, after its answers were checked.

    All of them take turns in ``rounds`` rounds, or as many as ``BUDGET_NS`` allows, but at least ``FEWEST_ROUNDS``.
    """
    times: list[list[float]] = []
    checked = [case.checked(name) for case, name in timed]
    with no_collection():
        stints = [_Stint(case, implementation) for (case, _), implementation in zip(timed, checked, strict=True)]
        start = perf_counter_ns()
        while len(times) < rounds and (len(times) < FEWEST_ROUNDS or perf_counter_ns() - start < BUDGET_NS):
            times.append([stint.work() for stint in stints])
    return {key: float(median) for key, median in zip(timed, np.median(times, axis=0), strict=True)}


def one_call(case: Case, implementation: Implementation) -> Callable[[], None]:
    """Return a function that asks about the next input, for the clock of pytest-benchmark."""
    inputs = [implementation.prepare(data) for data in case.inputs()]
    return implementation.compiled(_ONE_CALL, turn=cycle(inputs).__next__)


class _Stint:
    """The turn of one implementation: as many calls as fill the slice, on inputs that come round again."""

    def __init__(self, case: Case, implementation: Implementation) -> None:
        self._timed = implementation.compiled(_THROUGHPUT)
        self._pool = case.inputs()  # kept: what is prepared may be no more than a pointer
        self._inputs = [implementation.prepare(data) for data in self._pool]
        self._turns = cycle(self._inputs)
        self._calls = 1
        while (elapsed := self.work() * self._calls) < SLICE_NS / 2:
            self._calls = max(2 * self._calls, int(self._calls * SLICE_NS / (elapsed + 1)))

    def work(self) -> float:
        """Return the time of a call, ns, after the inputs were brought back into the caches."""
        self._timed(self._inputs)
        turns = list(islice(self._turns, self._calls))
        start = perf_counter_ns()
        self._timed(turns)
        return (perf_counter_ns() - start) / self._calls


@contextmanager
def no_collection() -> Iterator[None]:
    """Keep garbage from being collected meanwhile: it would count as the time of one implementation, by chance."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()
