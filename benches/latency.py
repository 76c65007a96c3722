"""How single calls spread: back to back, paced like a sensor, and with nothing in the caches."""

from __future__ import annotations

import time
from itertools import cycle, islice
from time import perf_counter_ns
from typing import TYPE_CHECKING, Any

import numpy as np

from benches import machine
from benches.case import OURS, Case, Implementation
from benches.cases import BY_NAME
from benches.timing import no_collection
from evaluation.report import Report, time_of

if TYPE_CHECKING:
    from collections.abc import Callable

PERIOD_NS = 1_000_000
PACED_CALLS, COLD_CALLS = 10_000, 500
CASES = ("min 1080 float32", "nearest 1080 float32", "KthSmallest(k=20) 114k float32")
LEGEND = (
    "Single calls. Paced: at 1 kHz, asleep in between. Cold: after reading more memory than the caches hold. Each with "
    "what reading the clock takes (the row of the clock), and with whatever else the machine does."
)

_TEMPLATE = """
def timed(samples, turns):
    for call, ARGUMENT in enumerate(turns):
        before()
        start = clock()
        EXPRESSION
        samples[call] = clock() - start
"""
_BACK_TO_BACK = _TEMPLATE.replace("        before()\n", "")


def report(calls: int) -> Report:
    """Return quantiles of ``calls`` calls back to back, and of fewer that are paced or cold."""
    rows = []
    for case in map(BY_NAME.__getitem__, CASES):
        ours = case.checked(OURS)
        many = calls if case.nbytes < 1 << 20 else calls // 100
        rows += [
            _row(case, OURS, "back to back", _samples(case, ours, many)),
            _row(case, "the clock", "back to back", _samples(case, Implementation("None", {}), many)),
            _row(case, OURS, "1 kHz", _samples(case, ours, PACED_CALLS, _paced())),
            _row(case, OURS, "cold", _samples(case, ours, COLD_CALLS, _evict())),
        ]
    return Report("Latency", LEGEND, ["call", "", "", "calls", "p50", "p99", "p99.9", "max"], rows)


def _samples(case: Case, who: Implementation, calls: int, before: Callable[[], Any] | None = None) -> Any:
    """Return the time of each call, ns."""
    samples = np.empty(calls, np.int64)
    template = _BACK_TO_BACK if before is None else _TEMPLATE
    timed = who.compiled(template, clock=perf_counter_ns, before=before)
    with no_collection():
        timed(samples, islice(cycle(case.inputs()), calls))
    return samples


def _paced() -> Callable[[], None]:
    """Return a function that sleeps until the next period begins."""
    due = perf_counter_ns()

    def wait() -> None:
        nonlocal due
        due = max(due + PERIOD_NS, perf_counter_ns())
        time.sleep((due - perf_counter_ns()) / 1e9 if due > perf_counter_ns() else 0.0)

    return wait


def _evict() -> Callable[[], Any]:
    """Return a function that reads twice as much as the largest cache holds."""
    memory = np.ones(2 * max(machine.caches().values(), default=1 << 25) // 8, np.uint64)
    return lambda: np.bitwise_or.reduce(memory)


def _row(case: Case, name: str, how: str, samples: Any) -> list[str]:
    quantiles = np.quantile(samples, (0.5, 0.99, 0.999, 1.0))
    return [str(case), name, how, str(len(samples)), *(time_of(quantile) for quantile in quantiles)]
