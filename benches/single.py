"""Single calls: what no kernel can beat, and how they spread back to back, paced like a sensor, and cold."""

from __future__ import annotations

import time
import timeit
from itertools import cycle, islice
from time import perf_counter_ns
from typing import TYPE_CHECKING, Any

import numpy as np

import ttc_fast
from benches import machine, native
from benches.case import OURS, Case, Implementation
from benches.cases import BY_NAME
from benches.timing import no_collection
from evaluation.report import Report, time_of

if TYPE_CHECKING:
    from collections.abc import Callable

_SCAN, _CLOUD = np.array([2.0], np.float32), np.array([[8.0, 0.0, 0.0, 0.5]], np.float32)
_NAMES: dict[str, Any] = {
    "scan": ttc_fast.ScanTTC(0.0, 0.1, 1),
    "ranges": _SCAN,
    "out": np.empty_like(_SCAN),
    "points": _CLOUD,
    "robust_min_x": ttc_fast.robust_min_x,
    "gate": ttc_fast.Gate(),
    "estimator": ttc_fast.Minimum(),
    "nothing": native.library().bare_read if native.AVAILABLE else None,
}
NOTHING = "bare read of nothing, through ctypes"
CALLS = {
    "scan.min of 1 beam": "scan.min(ranges, 5.0)",
    "scan.nearest of 1 beam": "scan.nearest(ranges, 5.0)",
    "scan.per_beam(out=) of 1 beam": "scan.per_beam(ranges, 5.0, out=out)",
    "robust_min_x of 1 point": "robust_min_x(points, gate=gate, estimator=estimator)",
    **({NOTHING: "nothing(None, 0)"} if native.AVAILABLE else {}),
}
READS = {"32 KiB": 1 << 15, "256 KiB": 1 << 18, "1.8 MB, a frame": 1_824_000, "16 MB, 1M points": 16_000_000}
REPEATS = 15
BOUNDS_LEGEND = (
    "Best of 15. Reading and copying: loops of 64-byte loads (and stores) over as many bytes again and again. GB/s: of "
    "bytes read, and of bytes read and written, without what the call of nothing takes."
)


def bounds() -> Report:
    """Return what no kernel can beat: the price of a call, and of reading the bytes."""
    calls = {name: _best(expression, _NAMES) for name, expression in CALLS.items()}
    rows = [[name, time_of(ns), ""] for name, ns in calls.items()]
    for name, nbytes in READS.items() if native.AVAILABLE else ():
        for what, bare, moved in (
            ("read", native.bare_read(nbytes), nbytes),
            ("copy", native.bare_copy(nbytes), 2 * nbytes),
        ):
            data = np.ones(nbytes, np.uint8)
            names = {**bare.names, bare.argument: native.address(data)}
            ns = _best(bare.expression, names)
            rows.append([f"bare {what} of {name}", time_of(ns), f"{moved / (ns - calls[NOTHING]):.3g}"])
    return Report("What bounds them", BOUNDS_LEGEND, ["", "time", "GB/s"], rows)


def _best(expression: str, names: dict[str, Any]) -> float:
    """Return the least time of a call of all repeats, ns."""
    timer = timeit.Timer(expression, globals=names)
    calls = max(1, int(5e-3 / (timer.timeit(10) / 10 + 1e-9)))
    return min(timer.repeat(REPEATS, calls)) / calls * 1e9


PERIOD_NS = 1_000_000
PACED_CALLS, COLD_CALLS = 10_000, 500
CASES = ("min 1080 float32", "nearest 1080 float32", "KthSmallest(k=20) 114k float32")
LATENCY_LEGEND = (
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


def latency(calls: int) -> Report:
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
    return Report("Latency", LATENCY_LEGEND, ["call", "", "", "calls", "p50", "p99", "p99.9", "max"], rows)


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
        time.sleep(max(due - perf_counter_ns(), 0) / 1e9)

    return wait


def _evict() -> Callable[[], Any]:
    """Return a function that reads twice as much as the largest cache holds."""
    memory = np.ones(2 * max(machine.caches().values(), default=1 << 25) // 8, np.uint64)
    return lambda: np.bitwise_or.reduce(memory)


def _row(case: Case, name: str, how: str, samples: Any) -> list[str]:
    quantiles = np.quantile(samples, (0.5, 0.99, 0.999, 1.0))
    return [str(case), name, how, str(len(samples)), *(time_of(quantile) for quantile in quantiles)]
