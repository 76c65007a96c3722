"""``ScaleTracker`` against the NumPy reference, picture by picture: equal but for rounding."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import ttc_fast
from tests.support.common import examples
from ttc_fast import reference

NUMBERS = ["ttc", "ttc_interval", "distance", "closing_speed", "closing_speed_interval", "age"]


def alike(kernel: Any, specified: Any) -> bool:
    if kernel is None or specified is None:
        return kernel is specified
    if isinstance(kernel, tuple):
        return all(map(alike, kernel, specified))
    return math.isclose(kernel, specified, rel_tol=1e-6, abs_tol=1e-6) or (math.isnan(kernel) and math.isnan(specified))


@examples(100)
@given(seed=st.integers(0, 2**31), lidar=st.sampled_from(["none", "late", "always", "jumps"]), moves=st.booleans())
def test_histories(seed: int, lidar: str, moves: bool) -> None:
    random = np.random.default_rng(seed)
    settings = {"distance": float(random.uniform(2.0, 30.0)), "max_gap": 0.5}
    kernel, specified = ttc_fast.ScaleTracker(**settings), reference.ScaleTracker(**settings)
    stamp, distance, speed, spread = 1.7e9, 20.0, float(random.normal(0.0, 5.0)), float(10.0 ** random.uniform(-5, -2))
    for picture in range(40):
        dt = float(random.choice([0.05, 0.1, 0.1, 0.1, 0.7]))
        before, stamp = distance, stamp + dt
        speed += float(random.normal(0.0, 0.1))
        distance = before - speed * dt
        if distance < 0.5:  # a target that stops dead amplifies every rounding
            break
        scale = before / distance * float(random.normal(1.0, spread)) if random.random() < 0.8 else None
        extra: dict[str, float] = {}
        if lidar == "always" or (lidar == "late" and picture > 20) or (lidar == "jumps" and picture % 5):
            seen = distance + (9.0 if lidar == "jumps" and random.random() < 0.3 else 0.0)
            extra |= {"distance": seen + float(random.normal(0.0, 0.02)), "distance_noise": 0.02}
        if moves:
            extra |= {"displacement": before - distance + float(random.normal(0.0, 0.01)), "displacement_noise": 0.01}
        own = spread if scale is not None or random.random() < 0.5 else None
        one, other = (tracker.update(scale, stamp, own, **extra) for tracker in (kernel, specified))
        assert one.status is other.status, (picture, one, other)
        for name in NUMBERS:
            assert alike(getattr(one, name), getattr(other, name)), (picture, name, one, other)
