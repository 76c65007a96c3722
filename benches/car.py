"""The car of all benchmarks, and scans of the rooms it drives through."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import DTypeLike, NDArray

    Floats = NDArray[np.floating[Any]]

RANGE_MIN, RANGE_MAX = 0.06, 30.0
MIN_CLOSING_SPEED = 0.01
SPEED, YAW_RATE = 5.0, 0.8
MOUNT = (0.27, 0.0, 0.0)
OUTLINE = (-0.1, 0.45, -0.15, 0.15)
SETTINGS: dict[str, Any] = {
    "range_min": RANGE_MIN,
    "range_max": RANGE_MAX,
    "mount": MOUNT,
    "outline": OUTLINE,
    "min_closing_speed": MIN_CLOSING_SPEED,
}
"""Keyword arguments of ``ScanTTC``."""


def place(beams: int) -> tuple[float, float, int]:
    """Return the positional arguments of ``ScanTTC``: 270 degrees, the middle beam ahead."""
    view = 1.5 * math.pi
    return -view / 2, view / (beams - 1), beams


def directions(beams: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return cosine and sine of each beam."""
    angle_min, increment, _ = place(beams)
    angles = angle_min + increment * np.arange(beams)
    return np.cos(angles), np.sin(angles)


def offsets(beams: int) -> NDArray[np.float64]:
    """Return the distance from the sensor to the outline along each beam, m."""
    cos, sin = directions(beams)
    x, y, _ = MOUNT
    x_rear, x_front, y_right, y_left = OUTLINE
    return _to_rectangle((x_rear - x, x_front - x, y_right - y, y_left - y), cos, sin)


def rooms(scans: int, beams: int, dtype: DTypeLike) -> Floats:
    """Make scans of rooms with things in them, shape (scans, beams), with noise, NaN, +inf and error codes.

    The same in every run, and no two alike.
    """
    rng = np.random.default_rng(beams + scans)
    cos, sin = directions(beams)
    wall = np.empty((scans, beams))
    for scan in range(scans):
        front, rear, right, left = rng.uniform((4.0, 2.0, 1.0, 1.0), (12.0, 6.0, 4.0, 4.0))
        wall[scan] = _to_rectangle((-rear, front, -right, left), cos, sin)
        for _ in range(8):
            first, width = rng.integers(beams), rng.integers(1, beams // 20)
            wall[scan, first : first + width] *= rng.uniform(0.5, 0.9)
    ranges = wall + rng.normal(0.0, 0.01, wall.shape)
    chance = rng.random(wall.shape)
    ranges[chance < 0.05] = 0.005
    ranges[chance < 0.04] = np.inf
    ranges[chance < 0.02] = np.nan
    return ranges.astype(dtype)


def flat_walls(scans: int, beams: int, dtype: DTypeLike) -> Floats:
    """Make scans of a wall across the way ahead, each at another distance, and of nothing else."""
    cos, _ = directions(beams)
    distances = np.linspace(4.0, 12.0, scans)[:, np.newaxis]
    with np.errstate(divide="ignore"):
        return np.where(cos > 0.0, distances / cos, np.inf).astype(dtype)


def ties(scans: int, beams: int, dtype: DTypeLike) -> Floats:
    """Make scans in which all closing beams of the turning car take the same time but for rounding: the worst case."""
    cos, sin = directions(beams)
    closing = SPEED * cos + YAW_RATE * MOUNT[0] * sin
    times = np.linspace(1.0, 3.0, scans)[:, np.newaxis]
    return np.where(closing > MIN_CLOSING_SPEED, offsets(beams) + times * closing, 10.0).astype(dtype)


SCENES: dict[str, Callable[[int, int, DTypeLike], Floats]] = {"rooms": rooms, "wall": flat_walls, "ties": ties}


def _to_rectangle(edges: tuple[float, float, float, float], cos: Floats, sin: Floats) -> NDArray[np.float64]:
    """Return the distance from the origin to a rectangle around it, along each direction."""
    x_rear, x_front, y_right, y_left = edges
    with np.errstate(divide="ignore"):
        to_end = np.maximum(x_rear / cos, x_front / cos)
        to_side = np.maximum(y_right / sin, y_left / sin)
    nearer: NDArray[np.float64] = np.minimum(to_end, to_side)
    return nearer
