"""The camera kernels against the NumPy reference, on all that `camera_strategies` can think of: medians bit for bit."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ttc_fast
from tests.support import camera_strategies
from tests.support.camera_strategies import WORLDS, MatchCase, matches
from tests.support.common import examples
from ttc_fast import MedianRatio, reference

NAMES = [field.name for field in fields(reference.KeypointTTC)]
SUMMED = ("ttc", "scale", "spread", "ttc_interval")
DT = 0.1

few_examples = examples(100)
many_examples = examples(500)


def same(one: float, other: float, rel_tol: float, abs_tol: float = 0.0) -> bool:
    return math.isclose(one, other, rel_tol=rel_tol, abs_tol=abs_tol) or (math.isnan(one) and math.isnan(other))


def assert_same(kernel: Any, specified: Any, estimator: Any) -> None:
    """Every count equal, and a median and its time; sums depend on the order of their terms."""
    for name in set(NAMES) - set(SUMMED):
        assert getattr(kernel, name) == getattr(specified, name) or near_one(kernel, specified, name), name
    exact = isinstance(estimator, MedianRatio)
    assert same(kernel.scale, specified.scale, 0.0 if exact else 1e-12)
    if exact:
        assert kernel.ttc == specified.ttc
    elif not math.isinf(specified.ttc) and specified.ttc < 1e6:
        assert same(kernel.ttc, specified.ttc, 1e-6)
    # Of matches that agree to the last bit, what is left of their disagreement is rounding.
    assert same(kernel.spread, specified.spread, 1e-6, 1e-10 * abs(specified.scale))
    assert (kernel.ttc_interval is None) == (specified.ttc_interval is None) == math.isnan(kernel.spread)
    for end, expected in zip(kernel.ttc_interval or (), specified.ttc_interval or (), strict=True):
        assert same(DT / end, DT / expected, 1e-6, 1e-9 * abs(specified.scale)) if end and expected else end == expected


def near_one(kernel: Any, specified: Any, name: str) -> bool:
    """Of a sum that is about 1, rounding decides whether the thing closes."""
    return name == "status" and abs(specified.scale - 1.0) < 1e-12 and abs(kernel.scale - 1.0) < 1e-12


def assert_parity(previous: Any, current: Any, **settings: Any) -> None:
    kernel = ttc_fast.ttc_from_keypoints(previous, current, DT, **settings)
    specified = reference.ttc_from_keypoints(previous, current, DT, **settings)
    assert_same(kernel, specified, settings["estimator"])


@many_examples
@given(camera_strategies.cases())
def test_matches(case: MatchCase) -> None:
    before = case.previous.copy(), case.current.copy()
    assert_parity(case.previous, case.current, **case.settings)
    for array, unchanged in zip((case.previous, case.current), before, strict=True):
        np.testing.assert_array_equal(array, unchanged, err_msg="the input was written to")


@many_examples
@given(*[st.floats(1e-300, 1e300) | st.floats(0.5, 2.0) | st.sampled_from([1.0, 5e-324])] * 2, st.floats(1e-9, 1e9))
def test_scales_and_heights(previous: float, current: float, dt: float) -> None:
    assert ttc_fast.ttc_from_scale(previous, dt) == reference.ttc_from_scale(previous, dt)
    found = ttc_fast.ttc_from_heights(previous, current, dt)
    assert found == reference.ttc_from_heights(previous, current, dt)
    assert found >= 0.0


@pytest.mark.slow
@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("count", [700, 1501])
@pytest.mark.parametrize("world", sorted(WORLDS))
def test_a_median_that_samples_come_first_for(world: str, count: int, dtype: str) -> None:
    """So many that a bracket is narrowed in steps, and fails where ratios tie."""
    for seed in range(3):
        assert_parity(*matches(world, count, seed, dtype), min_distance=40.0, estimator=MedianRatio())


@pytest.mark.parametrize("world", sorted(WORLDS))
def test_threads_do_not_change_the_answer(world: str) -> None:
    previous, current = matches(world, 1500, 5, "float32")
    alone, together = (
        repr(ttc_fast.ttc_from_keypoints(previous, current, DT, estimator=MedianRatio(), threads=threads))
        for threads in (1, 3)
    )
    assert alone == together


@few_examples
@given(camera_strategies.cases(), st.integers(0, 2**32 - 1))
def test_the_order_of_matches_does_not_matter_to_a_median(case: MatchCase, seed: int) -> None:
    order = np.random.default_rng(seed).permutation(len(case.previous))
    settings = case.settings | {"estimator": MedianRatio()}
    one = ttc_fast.ttc_from_keypoints(case.previous, case.current, DT, **settings)
    other = ttc_fast.ttc_from_keypoints(case.previous[order], case.current[order], DT, **settings)
    assert same(one.scale, other.scale, 0.0)
    assert (one.ttc, one.pairs, one.matches) == (other.ttc, other.pairs, other.matches)


@few_examples
@given(camera_strategies.cases(), st.sampled_from([0.25, 2.0, 1024.0]))
def test_the_unit_of_distance_does_not_matter(case: MatchCase, unit: float) -> None:
    """A power of 2, so that nothing is rounded; within what is a position, and can be squared."""
    sizes = np.abs(np.hstack([case.previous, case.current]))
    near = sizes.max(initial=0.0) < 1e5 and sizes[sizes > 0.0].min(initial=1.0) > 1e-9
    settings = case.settings | {"estimator": MedianRatio()}
    settings["min_distance"] = min(settings["min_distance"], 500.0)
    one = ttc_fast.ttc_from_keypoints(case.previous, case.current, DT, **settings)
    settings["min_distance"] *= unit
    other = ttc_fast.ttc_from_keypoints(case.previous * unit, case.current * unit, DT, **settings)
    assert not near or same(one.scale, other.scale, 0.0)
