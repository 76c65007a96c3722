"""What the camera functions promise, with numbers worked out by hand; the kernels and the reference alike."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from tests.support.common import both_dtypes
from ttc_fast import Consensus, LeastSquares, MedianRatio, Status, TrimmedMeanRatio

INF, NAN = math.inf, math.nan
DT = 0.1
SQUARE = np.array([[0.0, 0.0], [200.0, 0.0], [200.0, 200.0], [0.0, 200.0]])

every_estimator = pytest.mark.parametrize(
    "estimator", [MedianRatio(), TrimmedMeanRatio(0.25), LeastSquares(), Consensus()], ids=repr
)
of_pairs = pytest.mark.parametrize("estimator", [MedianRatio(), TrimmedMeanRatio(0.25), Consensus()], ids=repr)


# --- scale and heights ---------------------------------------------------------------------------------------------


def test_growing_by_a_twentieth_in_a_tenth_of_a_second_is_two_seconds(ttc: Any) -> None:
    assert ttc.ttc_from_scale(1.05, DT) == pytest.approx(2.0, rel=1e-12)
    assert ttc.ttc_from_heights(100.0, 105.0, DT) == pytest.approx(2.0, rel=1e-12)


def test_the_time_counts_from_the_later_picture(ttc: Any) -> None:
    """From 10 m to 9 m in 1 s leaves 9 s."""
    assert ttc.ttc_from_heights(1 / 10.0, 1 / 9.0, 1.0) == pytest.approx(9.0, rel=1e-12)


@pytest.mark.parametrize("scale", [1.0, 0.999, 1e-300])
def test_what_does_not_grow_never_comes(ttc: Any, scale: float) -> None:
    assert ttc.ttc_from_scale(scale, DT) == INF
    assert ttc.ttc_from_heights(100.0, 100.0 * scale, DT) == INF


def test_the_ends_of_the_numbers(ttc: Any) -> None:
    assert ttc.ttc_from_scale(math.nextafter(1.0, 2.0), 1e300) == INF
    assert ttc.ttc_from_scale(1e308, 1e-9) == pytest.approx(0.0, abs=1e-300)
    assert ttc.ttc_from_heights(5e-324, 1e308, 1e-9) == 0.0


# --- keypoints -----------------------------------------------------------------------------------------------------


@every_estimator
@both_dtypes
def test_a_square_that_grows(ttc: Any, estimator: Any, dtype: Any) -> None:
    seen = ttc.ttc_from_keypoints(SQUARE.astype(dtype), (1.25 * SQUARE + 7.0).astype(dtype), DT, estimator=estimator)
    assert seen.scale == pytest.approx(1.25, rel=1e-7)
    assert seen.ttc == pytest.approx(0.4, rel=1e-6)
    assert seen.status is Status.CLOSING
    assert (seen.matches, seen.support) == (4, 4)
    trimmed = isinstance(estimator, TrimmedMeanRatio)
    assert seen.pairs == (0 if isinstance(estimator, LeastSquares) else 4 if trimmed else 6)
    assert seen.spread == pytest.approx(0.0, abs=1e-7)


@every_estimator
@pytest.mark.parametrize(("scale", "scale_seen"), [(1.0, 1.0), (0.75, 0.75)])
def test_what_stays_or_shrinks_does_not_close(ttc: Any, estimator: Any, scale: float, scale_seen: float) -> None:
    seen = ttc.ttc_from_keypoints(SQUARE, scale * SQUARE, DT, estimator=estimator)
    assert (seen.scale, seen.ttc, seen.status) == (scale_seen, INF, Status.NOT_CLOSING)


@every_estimator
def test_a_turn_of_the_camera_does_not_matter(ttc: Any, estimator: Any) -> None:
    turned = SQUARE @ np.array([[0.0, 1.0], [-1.0, 0.0]])
    seen = ttc.ttc_from_keypoints(SQUARE, 1.5 * turned, DT, estimator=estimator)
    assert seen.scale == pytest.approx(1.5, rel=1e-12)
    assert seen.spread == pytest.approx(0.0, abs=1e-12)


def test_an_even_number_of_ratios_has_the_mean_of_the_middle_two(ttc: Any) -> None:
    """On a line, distances 100, 200 and 300 become 110, 240 and 350; then a fourth match."""
    before = np.array([[0.0, 0.0], [100.0, 0.0], [300.0, 0.0]])
    now = np.array([[0.0, 0.0], [110.0, 0.0], [350.0, 0.0]])
    odd = ttc.ttc_from_keypoints(before, now, DT, estimator=MedianRatio())
    assert (odd.scale, odd.pairs) == (pytest.approx(350 / 300, rel=1e-15), 3)
    before, now = np.vstack([before, [700.0, 0.0]]), np.vstack([now, [750.0, 0.0]])
    ratios = sorted([110 / 100, 240 / 200, 350 / 300, 750 / 700, 640 / 600, 400 / 400])
    even = ttc.ttc_from_keypoints(before, now, DT, estimator=MedianRatio())
    assert (even.scale, even.pairs) == (pytest.approx((ratios[2] + ratios[3]) / 2, rel=1e-15), 6)


@of_pairs
@both_dtypes
def test_the_least_distance_is_one_now_and_included(ttc: Any, estimator: Any, dtype: Any) -> None:
    before, now = np.array([[0, 0], [30, 40]], dtype), np.array([[0, 0], [60, 80]], dtype)
    at = ttc.ttc_from_keypoints(before, now, DT, min_distance=100.0, estimator=estimator)
    assert (at.scale, at.status) == (2.0, Status.CLOSING)
    beyond = math.nextafter(100.0, 101.0)
    above = ttc.ttc_from_keypoints(before, now, DT, min_distance=beyond, estimator=estimator)
    assert above.status is Status.TOO_FEW
    assert (above.ttc, above.pairs, above.matches, above.support) == (INF, 0, 2, 0)
    assert math.isnan(above.scale)
    assert math.isnan(above.spread)
    assert above.ttc_interval is None


@every_estimator
def test_matches_that_were_on_one_spot_have_no_ratio(ttc: Any, estimator: Any) -> None:
    seen = ttc.ttc_from_keypoints(np.full((4, 2), 600.0), SQUARE, DT, min_distance=0.0, estimator=estimator)
    assert (seen.status, seen.ttc, seen.pairs, seen.matches) == (Status.TOO_FEW, INF, 0, 4)


@of_pairs
def test_matches_that_fall_together_have_the_ratio_0(ttc: Any, estimator: Any) -> None:
    seen = ttc.ttc_from_keypoints(SQUARE, np.full((4, 2), 600.0), DT, min_distance=0.0, estimator=estimator)
    assert (seen.scale, seen.ttc, seen.status) == (0.0, INF, Status.NOT_CLOSING)


@every_estimator
@pytest.mark.parametrize("count", [0, 1])
def test_no_match_is_no_data_and_one_is_too_few(ttc: Any, estimator: Any, count: int) -> None:
    seen = ttc.ttc_from_keypoints(SQUARE[:count], SQUARE[:count], DT, estimator=estimator)
    assert seen.status is (Status.TOO_FEW if count else Status.NO_DATA)
    assert (seen.ttc, seen.matches) == (INF, count)


@every_estimator
def test_two_matches_have_a_scale_and_no_spread(ttc: Any, estimator: Any) -> None:
    seen = ttc.ttc_from_keypoints(SQUARE[:2], 2.0 * SQUARE[:2], DT, estimator=estimator)
    assert seen.scale == 2.0
    assert math.isnan(seen.spread)
    assert seen.ttc_interval is None


@every_estimator
@pytest.mark.parametrize("odd", [NAN, INF, -INF, 1.1e9])
@pytest.mark.parametrize("place", range(4))
def test_a_match_that_is_no_position_does_not_count(ttc: Any, estimator: Any, odd: float, place: int) -> None:
    before, now = np.vstack([SQUARE, [50.0, 50.0]]), np.vstack([1.5 * SQUARE, [0.0, 0.0]])
    (before, now)[place // 2][4, place % 2] = odd
    seen = ttc.ttc_from_keypoints(before, now, DT, estimator=estimator)
    without = ttc.ttc_from_keypoints(before[:4], now[:4], DT, estimator=estimator)
    assert repr(seen) == repr(without)
    assert seen.matches == 4


def test_only_nan_is_no_data(ttc: Any) -> None:
    assert ttc.ttc_from_keypoints(np.full((9, 2), NAN), np.ones((9, 2)), DT).status is Status.NO_DATA


# --- estimators ----------------------------------------------------------------------------------------------------


def body_and_background(share: float, *, noise: float = 0.2, grid: float = 0.0, seed: int = 1) -> tuple[Any, Any]:
    """A car of 160 px that grows by a hundredth, and other things that move as the picture does."""
    random = np.random.default_rng(seed)
    before = random.uniform(-80.0, 80.0, (120, 2)) + 600.0
    now = (before - 600.0) * 1.01 + 600.0
    others = random.random(120) < share
    now[others] = before[others] + (6.0, -4.0)
    now += random.normal(0.0, noise, now.shape)
    return (before, now) if not grid else (np.round(before / grid) * grid, np.round(now / grid) * grid)


def mean_error(ttc: Any, estimator: Any, *, share: float = 0.0, grid: float = 0.0) -> Any:
    """By how much a scale of 1.01 is missed, over many draws: on average, and typically."""
    every = [body_and_background(share, grid=grid, seed=seed) for seed in range(20)]
    errors = [ttc.ttc_from_keypoints(*each, DT, estimator=estimator).scale - 1.01 for each in every]
    return np.mean(errors), np.mean(np.abs(errors))


def test_what_moves_otherwise_is_left_out_by_the_consensus(ttc: Any) -> None:
    assert mean_error(ttc, Consensus(), share=0.35)[1] < 1e-3
    assert mean_error(ttc, LeastSquares(), share=0.35)[1] > 3e-3
    seen = ttc.ttc_from_keypoints(*body_and_background(0.35), DT)
    assert 60 < seen.support < 90 < seen.matches


def test_positions_on_pixels_blind_the_median_and_not_the_consensus(ttc: Any) -> None:
    """A body grows by less than a pixel of ORB's coarsest level: most points stay, and their ratios are exactly 1."""
    assert abs(mean_error(ttc, Consensus(), grid=3.6)[0]) < 1.5e-3
    assert mean_error(ttc, MedianRatio(), grid=3.6)[0] < -8e-3


def strained(strain: float, seed: int) -> tuple[Any, Any, float]:
    """A car that grows by a hundredth while its picture is strained: in scale, stretch and shear alike."""
    random = np.random.default_rng(seed)
    before, now = body_and_background(0.0, seed=seed)
    x, y = (before - 600.0).T
    scale, stretch, shear = random.normal(0.0, strain, 3)
    return before, now + np.column_stack([(scale + stretch) * x + shear * y, (scale - stretch) * y + shear * x]), 1.01


def holds(seen: Any, scale: float) -> bool:
    low, high = seen.ttc_interval
    assert 0.0 <= low <= seen.ttc <= high
    return bool(low <= DT / (scale - 1.0) <= high)


@pytest.mark.parametrize("strain", [0.0, 0.5e-3, 1e-3])
@pytest.mark.parametrize("estimator", [LeastSquares(), Consensus()], ids=repr)
def test_the_truth_is_in_the_interval_even_where_neighbours_err_alike(ttc: Any, estimator: Any, strain: float) -> None:
    inside, halves = [], []
    for seed in range(100):
        *positions, scale = strained(strain, seed)
        seen = ttc.ttc_from_keypoints(*positions, DT, estimator=estimator)
        inside.append(holds(seen, scale))
        halves.append(1.645 * seen.spread)
    assert 0.80 <= np.mean(inside) <= 0.99
    assert np.median(halves) < 1.5e-3 + 4.0 * strain


def test_stretch_and_shear_widen_the_spread_and_a_turn_does_not(ttc: Any) -> None:
    before, now = body_and_background(0.0, noise=0.1)
    x, y = (before - 600.0).T

    def spread(dx: Any, dy: Any) -> float:
        shifted = now + 2e-3 * np.column_stack([dx, dy])
        return float(ttc.ttc_from_keypoints(before, shifted, DT, estimator=LeastSquares()).spread)

    plain = spread(0 * x, 0 * y)
    assert spread(-y, x) == pytest.approx(plain, rel=1e-2)
    assert spread(x, -y) > 4.0 * plain
    assert spread(y, x) > 4.0 * plain


def test_the_interval_ends_where_the_scale_is_off_by_its_error(ttc: Any) -> None:
    seen = ttc.ttc_from_keypoints(*body_and_background(0.0), DT)
    half = 1.6448536269514722 * seen.spread
    ends = (DT / (seen.scale + half - 1.0), DT / (seen.scale - half - 1.0))
    assert seen.ttc_interval == pytest.approx(ends, rel=1e-9)
    still = ttc.ttc_from_keypoints(*body_and_background(0.0, noise=20.0, seed=4), DT, estimator=LeastSquares())
    assert still.ttc_interval[1] == INF
    shrinking = ttc.ttc_from_keypoints(2.0 * SQUARE, SQUARE, DT)
    assert shrinking.ttc_interval == (INF, INF)


def test_matches_on_one_line_show_no_stretch_and_have_a_wide_interval(ttc: Any) -> None:
    random = np.random.default_rng(2)
    before = np.column_stack([random.uniform(500.0, 700.0, 60), np.full(60, 200.0)])
    now = (before - 600.0) * 1.01 + 600.0 + random.normal(0.0, 0.2, before.shape)
    seen = ttc.ttc_from_keypoints(before, now, DT, estimator=LeastSquares())
    independent = 0.2 / np.sqrt(np.square(before - before.mean(axis=0)).sum())
    assert 1.8 < seen.spread / independent < 2.6


def test_a_seed_decides_and_nothing_else(ttc: Any) -> None:
    before, now = body_and_background(0.6, noise=1.5)

    def scale(seed: int) -> str:
        once = Consensus(tolerance=1.0, trials=1, seed=seed)
        return repr(ttc.ttc_from_keypoints(before, now, DT, estimator=once).scale)

    assert len({scale(3) for _ in range(5)}) == 1
    assert len({scale(seed) for seed in range(9)}) > 5


def test_trimming_nothing_is_the_mean(ttc: Any) -> None:
    before, now = SQUARE, np.vstack([1.2 * SQUARE[:3], [0.0, 300.0]])
    scale = ttc.ttc_from_keypoints(before, now, DT, estimator=TrimmedMeanRatio(0.0)).scale
    i, j = np.triu_indices(4, 1)
    ratios = np.hypot(*(now[i] - now[j]).T) / np.hypot(*(before[i] - before[j]).T)
    assert scale == pytest.approx(ratios.mean(), rel=1e-14)
    inner = ttc.ttc_from_keypoints(before, now, DT, estimator=TrimmedMeanRatio(0.34))
    assert (inner.scale, inner.pairs) == (pytest.approx(np.sort(ratios)[2:4].mean(), rel=1e-14), 2)
