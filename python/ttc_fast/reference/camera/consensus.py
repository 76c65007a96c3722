"""The matches that move as one body: random sample consensus (RANSAC) over similarities."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast.reference.camera.similarity import (
    Similarity,
    fitted,
    lanes_of,
    squared_residuals,
    through,
    total,
)
from ttc_fast.reference.camera.spread import strained

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from ttc_fast._core import Consensus

    Doubles = NDArray[np.float64]
    Bools = NDArray[np.bool_]

WIDTH_SQUARED = -2.0 * math.log(0.05)
"""All but a twentieth of positions with a normal error are within this many standard deviations, squared."""
LEAST_TOLERANCE = 0.1
"""No match is left out for less than this, px."""
UNCHANGED = 0.1
"""With more than this share of coordinates unchanged, positions are rounded."""
MOST_ROUNDS = 20
"""The most rounds of the refinement, which settles long before."""


def inliers(search: Consensus, before: Doubles, now: Doubles) -> Bools | None:
    """Say which matches agree with one similarity; None if there are fewer than two, or if no two agree."""
    squared = search.tolerance * search.tolerance
    best = _best_of_pairs(search, before, now, squared)
    if best is None:
        return None
    first = squared_residuals(best, before, now) <= squared
    unstrained = _refined(fitted, before, now, first, squared)
    # Strain may take background for a part of the body, and then fewer matches agree in the end.
    return max((_refined(strained, before, now, those, squared) for those in (first, unstrained)), key=np.sum)


def _refined(fit: Any, before: Doubles, now: Doubles, those: Bools, squared: float) -> Bools:
    """Find the matches that agree with a map that is fitted to them, from those of a first guess."""
    rounded, lanes = (before == now).sum() > UNCHANGED * before.size, lanes_of(before)
    for _ in range(MOST_ROUNDS):
        found = fit(before[those], now[those], lanes[those])
        if found is None:
            break
        is_similarity = isinstance(found, Similarity)
        residuals = squared_residuals(found, before, now) if is_similarity else found.squared_residuals(before, now)
        variance = total(residuals[those], lanes[those]) / (2 * those.sum())
        limit = squared if rounded else min(squared, variance * WIDTH_SQUARED)
        following = residuals <= max(limit, min(squared, LEAST_TOLERANCE * LEAST_TOLERANCE))
        if following.sum() < 3 or np.array_equal(following, those):
            break
        those = following
    return those


def _best_of_pairs(search: Consensus, before: Doubles, now: Doubles, squared: float) -> Similarity | None:
    """Find the similarity through two matches that most matches agree with; of several the first."""
    best, most, count = None, 1, len(before)
    if count < 2:
        return None
    for bits in _split_mix(search.seed, search.trials):
        first, second = ((bits >> 32) * count) >> 32, ((bits & 0xFFFFFFFF) * (count - 1)) >> 32
        similarity = through(before, now, first, second + (second >= first))
        if similarity is not None:
            votes = int((squared_residuals(similarity, before, now) <= squared).sum())
            if votes > most:
                best, most = similarity, votes
    return best


def _split_mix(seed: int, count: int) -> Iterator[int]:
    """Give numbers of 64 bits by the generator SplitMix64 [Steele, Lea and Flood 2014]."""
    mask = (1 << 64) - 1
    for _ in range(count):
        seed = (seed + 0x9E3779B97F4A7C15) & mask
        mixed = ((seed ^ (seed >> 30)) * 0xBF58476D1CE4E5B9) & mask
        mixed = ((mixed ^ (mixed >> 27)) * 0x94D049BB133111EB) & mask
        yield mixed ^ (mixed >> 31)
