"""Pairs of matches, and the ratios of their distances."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast.reference.camera.similarity import SAME_SPOT

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Doubles = NDArray[np.float64]


SHIFTS = 64
"""A sample has this many pairs for each match, each of which is in twice as many."""
STEP = 7
"""The step between the places of shifts within their parts."""


def ratios(before: Doubles, now: Doubles, min_distance: float) -> Doubles:
    """Return the distance now over the distance before, of each pair ``i < j`` that counts.

    A pair counts if it was apart, and is at least ``min_distance`` apart now.
    """
    return _ratios(before, now, *np.triu_indices(len(before), k=1), min_distance)


def sampled_ratios(before: Doubles, now: Doubles, min_distance: float) -> Doubles:
    """Return the ratios of all pairs, or of an even sample of them where there are many more pairs than matches.

    The pairs of matches ``i`` and ``i + shift``, around the end to the beginning, hold each match twice, and the shifts
    from 1 to half the number of matches make all pairs. A sample takes one shift from each of as many equal parts of
    that range, each at another place within its part.
    """
    count, every = len(before), len(before) // 2
    if every == 0:
        return np.empty(0)
    shifts = min(every, SHIFTS)
    first, second = [], []
    for part in range(shifts):
        low, high = part * every // shifts, (part + 1) * every // shifts
        shift = 1 + low + part * STEP % (high - low)
        # Half of an even number of matches leads from one half to the other, and back.
        i = np.arange(shift if 2 * shift == count else count)
        first.append(i)
        second.append((i + shift) % count)
    return _ratios(before, now, np.concatenate(first), np.concatenate(second), min_distance)


def _ratios(before: Doubles, now: Doubles, i: Any, j: Any, min_distance: float) -> Doubles:
    squared_before, squared_now = _squared_distances(before, i, j), _squared_distances(now, i, j)
    count = (squared_before > SAME_SPOT) & (squared_now >= min_distance * min_distance)
    quotients: Doubles = np.sqrt(squared_now[count] / squared_before[count])
    return quotients


def _squared_distances(points: Doubles, i: Any, j: Any) -> Doubles:
    x, y = (points[j] - points[i]).T
    squared: Doubles = x * x + y * y
    return squared
