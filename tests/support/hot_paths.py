"""Every kernel that ``ScanTTC.min`` has for one scan."""

from typing import Any

import numpy as np

import ttc_fast
from tests.support.common import CAR

BEAMS = 1080


def hot_paths() -> dict[str, tuple[ttc_fast.ScanTTC, Any, tuple[float, ...]]]:
    """Return scanner, ranges and motion by the name of the kernel."""
    plain = ttc_fast.ScanTTC(-2.35, 4.7 / BEAMS, BEAMS, range_min=0.06, range_max=30.0)
    car = ttc_fast.ScanTTC(-2.35, 4.7 / BEAMS, BEAMS, outline=CAR, mount=(0.2, 0.0, 0.0))
    ranges = np.random.default_rng(6).uniform(1.0, 25.0, BEAMS)
    single, wide = ranges.astype(np.float32), np.repeat(ranges, 3)
    unaligned = np.frombuffer(b"\0" + single.tobytes(), np.float32, offset=1)
    free = np.full(BEAMS, np.inf, np.float32)
    return {
        "float32": (plain, single, (5.0, 0.0, 0.0)),
        "float64": (plain, ranges, (5.0, 0.0, 0.0)),
        "turning": (car, single, (5.0, 0.3, 0.1)),
        "strided": (car, wide[::3], (5.0, 0.0, 0.0)),
        "unaligned": (plain, unaligned, (-5.0, 0.0, 0.0)),
        "free space": (plain, free, (5.0, 0.0, 0.0)),
        "standing": (plain, single, (0.0, 0.0, 0.0)),
    }
