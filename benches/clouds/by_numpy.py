"""What a user would write in NumPy: a mask, the x inside of it, then a line for each estimator."""

from __future__ import annotations

from typing import Any

import numpy as np

from benches.clouds.street import INTENSITY, X, Y, Z


def columns(points: Any) -> Any:
    """x, y, z and intensity of rows or records."""
    return points.T if points.dtype.names is None else [points[name] for name in ("x", "y", "z", "intensity")]


def as_rows(points: Any) -> Any:
    """Records copied to plain rows."""
    return np.column_stack(columns(points))


def mask(points: Any) -> Any:
    x, y, z, intensity = columns(points)
    inside = (x >= X[0]) & (x <= X[1]) & (y >= Y[0]) & (y <= Y[1])
    return inside & (z >= Z[0]) & (z <= Z[1]) & (intensity >= INTENSITY[0]) & (intensity <= INTENSITY[1])


def gated(points: Any) -> Any:
    return columns(points)[0][mask(points)]


def minimum(points: Any) -> Any:
    return gated(points).min()


def kth_smallest(points: Any, k: int) -> Any:
    return np.partition(gated(points), k - 1)[k - 1]


def quantile(points: Any, q: float) -> Any:
    return np.quantile(gated(points), q)


def mean_of_lowest(points: Any, k: int) -> Any:
    return np.partition(gated(points), k - 1)[:k].mean()


def interquartile_fence(points: Any, factor: float) -> Any:
    x = gated(points)
    low, high = np.quantile(x, (0.25, 0.75))
    return x[x >= low - factor * (high - low)].min()


def supported(points: Any, count: int, gap: float) -> Any:
    x = np.sort(gated(points))
    return x[: len(x) - count + 1][x[count - 1 :] <= x[: len(x) - count + 1] + gap][0]
