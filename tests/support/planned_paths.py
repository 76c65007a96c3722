"""Planned paths at random, and a vehicle that is driven along one in fine steps."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Doubles = NDArray[np.float64]


def random_path(rng: np.random.Generator) -> tuple[Doubles, float]:
    """Return a path that winds, forward or back, from near the vehicle, and a speed that agrees with it."""
    count, side = int(rng.integers(2, 60)), float(rng.choice([1.0, 1.0, -1.0]))
    spacing = rng.choice([0.02, 0.1, 0.2, 0.5, 3.0]) * rng.uniform(0.5, 1.5, count)
    curvature = np.cumsum(rng.normal(0.0, 0.3, count)) * rng.choice([0.0, 1.0, 1.0])
    heading = np.cumsum(curvature * np.minimum(spacing, 0.3))
    steps = np.column_stack([np.cos(heading), np.sin(heading)]) * spacing[:, np.newaxis]
    points = side * np.cumsum(np.vstack([[0.0, 0.0], steps]), axis=0) + rng.normal(0.0, 0.1, 2)
    return points, side * float(rng.choice([0.0, 0.5, 3.0, 8.0]))


def driven_until_touched(point: Any, places: Doubles, outline: Any, step: float = 1e-3) -> float:
    """Return the way after which the outline holds a point, m, on a path of dense points; infinite if it never does."""
    x_rear, x_front, y_right, y_left = outline
    ways = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(places, axis=0).T))])
    headings = np.unwrap(np.arctan2(np.gradient(places[:, 1]), np.gradient(places[:, 0])))
    way = np.arange(0.0, ways[-1], step)
    x, y, heading = (np.interp(way, ways, each) for each in (places[:, 0], places[:, 1], headings))
    dx, dy = point[0] - x, point[1] - y
    u, v = dx * np.cos(heading) + dy * np.sin(heading), dy * np.cos(heading) - dx * np.sin(heading)
    inside = (x_rear <= u) & (u <= x_front) & (y_right <= v) & (v <= y_left)
    return float(way[np.argmax(inside)]) if inside.any() else math.inf
