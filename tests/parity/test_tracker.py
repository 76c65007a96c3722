"""The tracker against the NumPy reference, frame by frame: the same statuses, and numbers equal but for rounding."""

from __future__ import annotations

import math
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

import ttc_fast
from tests.support.common import examples
from tests.support.distance_histories import METHODS, history
from ttc_fast import reference

NUMBERS = ["ttc", "ttc_interval", "distance", "closing_speed", "closing_speed_interval"]


def alike(kernel: Any, specified: Any) -> bool:
    if kernel is None or specified is None:
        return kernel is specified
    if isinstance(kernel, tuple):
        return all(map(alike, kernel, specified))
    if math.isnan(kernel) or math.isinf(kernel):
        return kernel == specified or (math.isnan(kernel) and math.isnan(specified))
    return math.isclose(kernel, specified, rel_tol=1e-7, abs_tol=1e-7)


@examples(150)
@given(
    seed=st.integers(0, 2**31),
    method=st.sampled_from(METHODS),
    noise=st.sampled_from([None, 0.03, 0.3, ttc_fast.EstimatedNoise(0.1, 15)]),
    confirm=st.sampled_from([2, 3, 5]),
)
def test_histories(seed: int, method: Any, noise: Any, confirm: int) -> None:
    settings: dict[str, Any] = {"noise": noise, "confirm": confirm, "max_gap": 0.8, "jump": 0.8}
    kernel, specified = ttc_fast.DistanceTracker(method, **settings), reference.DistanceTracker(method, **settings)
    for distance, stamp, own in history(seed, 60):
        one, other = kernel.update(distance, stamp, own), specified.update(distance, stamp, own)
        assert one.status is other.status
        for name in NUMBERS:
            assert alike(getattr(one, name), getattr(other, name)), (name, one, other)
