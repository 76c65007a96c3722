"""Euclidean clustering, as far as the nearest cluster that is large enough."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Doubles = NDArray[np.float64]


def nearest_cluster(position: Doubles, tolerance: float, min_points: int) -> tuple[int, int] | None:
    """Find the nearest cluster of at least ``min_points``: its nearest point, and its number of points.

    ``position`` has shape (N, 3), nearest first. Points are linked by steps of at most ``tolerance``.
    """
    free = np.ones(len(position), np.bool_)
    for seed in range(len(free)):
        support = _grow(position, seed, tolerance, free) if free[seed] else 0
        if support >= min_points:
            return seed, support
    return None


def _grow(position: Doubles, seed: int, tolerance: float, free: NDArray[np.bool_]) -> int:
    """Take from ``free`` all points that a chain of links joins to the seed, and return their number."""
    free[seed] = False
    found = [seed]
    for point in found:
        linked = free & (_squared_distances(position, position[point]) <= tolerance * tolerance)
        free[linked] = False
        found.extend(np.flatnonzero(linked).tolist())
    return len(found)


def _squared_distances(position: Doubles, point: Doubles) -> Doubles:
    with np.errstate(over="ignore", under="ignore"):
        x, y, z = (position - point).T
        squared: Doubles = x * x + y * y + z * z
    return squared
