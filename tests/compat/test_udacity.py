"""The course's camera time-to-collision: its loop, its quirks, and beside each what is right."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.support.camera_strategies import WORLDS, matches
from ttc_fast import MedianRatio, Status, ttc_from_keypoints
from ttc_fast.compat.udacity_camera import compute_ttc_camera, ordered_ratios

if TYPE_CHECKING:
    from numpy.typing import NDArray


def naive(previous: NDArray[Any], current: NDArray[Any], frame_rate: float, least: float = 100.0) -> float:
    """The rule, one pair at a time."""
    ratios = []
    for outer in range(len(previous) - 1):
        for inner in range(1, len(previous)):
            x, y = (float(value) for value in previous[outer] - previous[inner])
            before = math.sqrt(x * x + y * y)
            x, y = (float(value) for value in current[outer] - current[inner])
            now = math.sqrt(x * x + y * y)
            if before > np.finfo(np.float64).eps and now >= least:
                ratios.append(now / before)
    if not ratios:
        return math.nan
    ratios.sort()
    middle = len(ratios) // 2
    median = ratios[middle] if len(ratios) % 2 else (ratios[middle - 1] + ratios[middle]) / 2.0
    return -math.inf if median == 1.0 else -(1 / frame_rate) / (1 - median)


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("count", [0, 1, 2, 3, 4, 17, 60])
@pytest.mark.parametrize("world", sorted(set(WORLDS) - {"with_gaps", "far_and_near"}))
def test_the_rule_one_pair_at_a_time(world: str, count: int, dtype: str) -> None:
    previous, current = matches(world, count, 3, dtype)
    for least in (0.0, 100.0):
        found = compute_ttc_camera(previous, current, 10.0, min_distance=least)
        expected = naive(previous, current, 10.0, least)
        assert found == expected or (math.isnan(found) and math.isnan(expected))


def test_quirk_pairs_of_interior_matches_count_twice() -> None:
    previous, current = matches("noisy", 30, 1, "float64")
    inner = ordered_ratios(previous[1:-1], current[1:-1], 0.0)
    assert len(ordered_ratios(previous, current, 0.0)) == 2 * 28 * 27 // 2 + 2 * 28 + 1
    assert len(inner) == 2 * 26 * 25 // 2 + 2 * 26 + 1
    assert ttc_from_keypoints(previous, current, 0.1, min_distance=0.0, estimator=MedianRatio()).pairs == 30 * 29 // 2


@pytest.mark.parametrize(
    ("scale", "time", "right"),
    [(1.25, 0.4, (0.4, Status.CLOSING)), (1.0, -math.inf, (math.inf, Status.NOT_CLOSING)),
     (0.75, -0.4, (math.inf, Status.NOT_CLOSING))],
)  # fmt: skip
def test_quirk_a_time_may_be_negative(scale: float, time: float, right: tuple[float, Status]) -> None:
    square = np.array([[0.0, 0.0], [200.0, 0.0], [200.0, 200.0], [0.0, 200.0]])
    assert compute_ttc_camera(square, scale * square, 10.0) == pytest.approx(time)
    seen = ttc_from_keypoints(square, scale * square, 0.1, estimator=MedianRatio())
    assert seen.ttc == pytest.approx(right[0])
    assert seen.status is right[1]


def test_quirk_nothing_kept_is_nan() -> None:
    near = np.array([[0.0, 0.0], [9.0, 0.0]])
    assert math.isnan(compute_ttc_camera(near, near, 10.0))
    seen = ttc_from_keypoints(near, near, 0.1, estimator=MedianRatio())
    assert (seen.ttc, seen.status) == (math.inf, Status.TOO_FEW)


def test_shapes_are_checked() -> None:
    with pytest.raises(ValueError, match=r"\(N, 2\)"):
        compute_ttc_camera(np.ones((4, 3)), np.ones((4, 3)), 10.0)
    with pytest.raises(ValueError, match=r"\(N, 2\)"):
        compute_ttc_camera(np.ones((4, 2)), np.ones((3, 2)), 10.0)
