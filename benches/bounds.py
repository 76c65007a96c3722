"""What no kernel can beat here: the price of a call, and of reading the bytes."""

from __future__ import annotations

import timeit
from typing import Any

import numpy as np

import ttc_fast
from benches import native
from evaluation.report import Report, time_of

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
LEGEND = (
    "Best of 15. Reading and copying: loops of 64-byte loads (and stores) over as many bytes again and again. GB/s: of "
    "bytes read, and of bytes read and written, without what the call of nothing takes."
)


def report() -> Report:
    """Measure them."""
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
    return Report("What bounds them", LEGEND, ["", "time", "GB/s"], rows)


def _best(expression: str, names: dict[str, Any]) -> float:
    """Return the least time of a call of all repeats, ns."""
    timer = timeit.Timer(expression, globals=names)
    calls = max(1, int(5e-3 / (timer.timeit(10) / 10 + 1e-9)))
    return min(timer.repeat(REPEATS, calls)) / calls * 1e9
