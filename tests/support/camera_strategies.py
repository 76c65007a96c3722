"""Matched keypoints of every kind that makes a difference, for hypothesis and by name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from hypothesis import strategies as st

import ttc_fast

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Array = NDArray[Any]

ESTIMATORS = [
    ttc_fast.MedianRatio(),
    ttc_fast.TrimmedMeanRatio(0.2),
    ttc_fast.LeastSquares(),
    ttc_fast.Consensus(trials=20),
    ttc_fast.Consensus(tolerance=0.5, trials=20, seed=3),
]


def spread_out(random: np.random.Generator, count: int) -> Array:
    return random.uniform((550.0, 180.0), (700.0, 330.0), (count, 2))


def grown(before: Array, scale: float) -> Array:
    return (before - 600.0) * scale + 601.0


def noisy(random: np.random.Generator, count: int) -> tuple[Array, Array]:
    before = spread_out(random, count)
    return before, grown(before, 1.01) + random.normal(0.0, 0.4, (count, 2))


def on_pixels(random: np.random.Generator, count: int) -> tuple[Array, Array]:
    """Make matches of which most do not move: thousands of ratios are exactly 1."""
    before, now = noisy(random, count)
    return np.round(before), np.round(now)


def on_a_coarse_grid(random: np.random.Generator, count: int) -> tuple[Array, Array]:
    """Make matches of which many are on one spot, so that few distances are possible."""
    before, now = noisy(random, count)
    return np.round(before / 25) * 25, np.round(now / 25) * 25


def exactly_twice(random: np.random.Generator, count: int) -> tuple[Array, Array]:
    """Make matches whose every ratio is 2."""
    before = spread_out(random, count)
    return before, before * 2.0


def almost_one_scale(random: np.random.Generator, count: int) -> tuple[Array, Array]:
    """Make matches whose ratios differ by rounding alone."""
    before = spread_out(random, count)
    return before, grown(before, 1.01)


def on_one_spot(random: np.random.Generator, count: int) -> tuple[Array, Array]:
    return np.full((count, 2), 600.0), spread_out(random, count)


def in_two_bodies(random: np.random.Generator, count: int) -> tuple[Array, Array]:
    before, now = noisy(random, count)
    now[: count // 3] = before[: count // 3] + np.array([7.0, -2.0])
    return before, now


def with_gaps(random: np.random.Generator, count: int) -> tuple[Array, Array]:
    before, now = noisy(random, count)
    for array, odd in ((before, np.nan), (now, np.nan), (before, np.inf), (now, -2e9)):
        array[random.random((count, 2)) < 0.05] = odd
    return before, now


def sorted_across(random: np.random.Generator, count: int) -> tuple[Array, Array]:
    """Make matches in which a sample by place in the array is not one by place in the picture."""
    before, now = noisy(random, count)
    now[:, 0] += 0.001 * (before[:, 0] - 600.0) ** 2
    order = np.argsort(before[:, 0])
    return before[order], now[order]


def far_and_near(random: np.random.Generator, count: int) -> tuple[Array, Array]:
    """Make matches with distances of every size, down to those that float32 cannot square."""
    before = random.normal(0.0, 1.0, (count, 2)) * 10.0 ** random.uniform(-25.0, 8.0, (count, 1))
    return before, before * random.uniform(0.5, 2.0, (count, 1))


WORLDS: dict[str, Callable[[np.random.Generator, int], tuple[Array, Array]]] = {
    world.__name__: world
    for world in (
        noisy,
        on_pixels,
        on_a_coarse_grid,
        exactly_twice,
        almost_one_scale,
        on_one_spot,
        in_two_bodies,
        with_gaps,
        sorted_across,
        far_and_near,
    )
}


@dataclass(frozen=True)
class MatchCase:
    """The arguments of one call."""

    previous: Array
    current: Array
    settings: dict[str, Any]


def matches(world: str, count: int, seed: int, dtype: str) -> tuple[Array, Array]:
    before, now = WORLDS[world](np.random.default_rng(seed), count)
    return before.astype(dtype), now.astype(dtype)


@st.composite
def cases(draw: st.DrawFn) -> MatchCase:
    counts = st.integers(0, 40) | st.sampled_from([48, 64, 65, 130, 257, 400])
    previous, current = matches(
        draw(st.sampled_from(sorted(WORLDS))),
        draw(counts),
        draw(st.integers(0, 2**32 - 1)),
        draw(st.sampled_from(["float32", "float64"])),
    )
    settings = {
        "min_distance": draw(st.sampled_from([0.0, 1e-20, 1.0, 50.0, 100.0, 100.0, 500.0, 1e300])),
        "estimator": draw(st.sampled_from(ESTIMATORS)),
    }
    return MatchCase(previous, current, settings)
