"""Every method of `DistanceTracker`, and histories of distances for it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import ttc_fast

METHODS = [
    ttc_fast.MotionMixture(),
    ttc_fast.MotionMixture(memory=0.3, scale=4.0),
    ttc_fast.KalmanCA(),
    ttc_fast.KalmanCA(jerk=10.0, acceleration=0.5),
    ttc_fast.KalmanCV(),
    ttc_fast.SlidingLine(),
    ttc_fast.SlidingLine(window=2.0, acceleration=0.0),
    ttc_fast.SlidingParabola(),
    ttc_fast.SlidingParabola(window=0.2, jerk=5.0),
    ttc_fast.TheilSen(),
    ttc_fast.AlphaBeta(),
    ttc_fast.AlphaBeta(memory=1.0, acceleration=0.0),
]


def history(seed: int, frames: int) -> list[tuple[Any, float, float | None]]:
    """Make an approach with everything that a tracker may meet: gaps, repeats, jumps, flickers, nonsense."""
    rng = np.random.default_rng(seed)
    stamp, distance, speed = float(rng.choice([0.0, 1.7e9, -50.0])), rng.uniform(2, 60), rng.uniform(-5, 15)
    out: list[tuple[Any, float, float | None]] = []
    for _ in range(frames):
        step = float(rng.choice([0.1, 0.05, 0.11, 0.0, -0.2, 1.5, 0.6], p=[0.6, 0.12, 0.2, 0.04, 0.01, 0.01, 0.02]))
        # Rounded, so that a stamp that comes again is the same, and not later by the last bit.
        stamp, distance, speed = round(stamp + step, 3), distance - speed * step, speed + rng.normal(0, 0.2)
        if rng.random() < 0.03:
            distance = rng.uniform(-6, 60)
        measured: Any = distance + rng.normal(0, 0.03)
        if rng.random() < 0.04:
            measured += rng.uniform(-8, 8) * rng.choice([0.05, 1.0])
        if rng.random() < 0.04:
            measured = rng.choice([math.nan, math.inf, -math.inf])
        out.append((measured, stamp, float(rng.uniform(0.01, 0.2)) if rng.random() < 0.1 else None))
    return out
