"""Pairs of matches, and the ratios of their distances."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast.reference.camera.similarity import SAME_SPOT

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Doubles = NDArray[np.float64]


def ratios(before: Doubles, now: Doubles, min_distance: float) -> Doubles:
    """Return the distance now over the distance before, of each pair ``i < j`` that counts.

    A pair counts if it was apart, and is at least ``min_distance`` apart now.
    """
    i, j = np.triu_indices(len(before), k=1)
    squared_before, squared_now = _squared_distances(before, i, j), _squared_distances(now, i, j)
    count = (squared_before > SAME_SPOT) & (squared_now >= min_distance * min_distance)
    quotients: Doubles = np.sqrt(squared_now[count] / squared_before[count])
    return quotients


def _squared_distances(points: Doubles, i: Any, j: Any) -> Doubles:
    x, y = (points[j] - points[i]).T
    squared: Doubles = x * x + y * y
    return squared
