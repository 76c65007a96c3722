"""The formulae of motion against the NumPy reference, bit for bit: both compute in float64 and round once."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import ttc_fast
from tests.support.common import examples
from ttc_fast import reference

SIGNED = [0.0, -0.0, 1e-300, -1e-300, 1e-30, 0.1, -0.1, 1.0, -1.0, 10.0, -7.5, 1e30, np.inf, -np.inf, np.nan]
NAMES = {
    "ttc_constant_velocity": ["closing_speed"],
    "ttc_constant_acceleration": ["closing_speed", "closing_acceleration"],
    "time_headway": ["speed"],
    "deceleration_to_avoid_crash": ["closing_speed"],
    "stopping_distance": ["deceleration", "reaction_time"],
}
RSS = ["response_time", "acceleration_max", "braking_min", "braking_max"]


def values(seed: int, count: int, dtype: type) -> np.ndarray:
    """Ordinary numbers, with special ones among them."""
    rng = np.random.default_rng(seed)
    out = rng.normal(0.0, 20.0, count)
    special = rng.random(count) < 0.2
    out[special] = rng.choice(SIGNED, int(special.sum()))
    return out.astype(dtype)


@examples(200)
@given(
    name=st.sampled_from(list(NAMES)),
    seed=st.integers(0, 2**31),
    count=st.sampled_from([1, 3, 15, 16, 17, 33, 100]),
    dtype=st.sampled_from([np.float32, np.float64]),
)
@example(name="ttc_constant_acceleration", seed=49051, count=17, dtype=np.float64)  # the discriminant underflows
def test_arrays(name: str, seed: int, count: int, dtype: type) -> None:
    first = values(seed, count, dtype)
    others = {argument: values(seed + 1 + i, count, dtype) for i, argument in enumerate(NAMES[name])}
    with_status = {}
    if name.startswith("ttc"):
        with_status = {"status_out": np.full(count, 77, np.uint8)}
        expected_status = {"status_out": np.full(count, 78, np.uint8)}
    kernel = getattr(ttc_fast, name)(first, **others, **with_status)
    expected = getattr(reference, name)(first, **others, **(expected_status if with_status else {}))
    np.testing.assert_array_equal(kernel, expected)
    if with_status:
        np.testing.assert_array_equal(with_status["status_out"], expected_status["status_out"])
        assert (kernel >= 0).all()


@examples(100)
@given(seed=st.integers(0, 2**31), dtype=st.sampled_from([np.float32, np.float64]))
def test_rss(seed: int, dtype: type) -> None:
    speeds = [values(seed + i, 40, dtype) for i in range(2)]
    behaviour = {name: values(seed + 2 + i, 40, dtype) for i, name in enumerate(RSS)}
    kernel = ttc_fast.rss_longitudinal_distance(*speeds, **behaviour)
    np.testing.assert_array_equal(kernel, reference.rss_longitudinal_distance(*speeds, **behaviour))


@pytest.mark.parametrize("name", NAMES)
@given(numbers=st.lists(st.floats(1e-3, 1e3), min_size=3, max_size=3))
def test_numbers(name: str, numbers: list[float]) -> None:
    first, *rest = numbers
    others = dict(zip(NAMES[name], rest, strict=False))
    assert getattr(ttc_fast, name)(first, **others) == getattr(reference, name)(first, **others)
