"""The side of a body that faces the sensor, summed up cell by cell in each frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ttc_fast._core import Alignment

    Doubles = NDArray[np.float64]

FARTHEST = 32_000
"""Columns and levels are numbered up to here, to either side."""
FARTHEST_FROM_MEDIAN = 3.0
"""Points farther from the median of their cell than this times the range noise do not count."""


@dataclass(frozen=True)
class Profile:
    """A body in one frame: its cells with points in them, in the order of their columns, upwards in each."""

    column: NDArray[np.int64]
    """Number of each cell to the left, in widths of a cell."""
    level: NDArray[np.int64]
    """Number of each cell upwards, in heights of a cell."""
    count: Doubles
    """The number of points that count in each cell."""
    x: Doubles
    """The mean distance ahead of these points, m."""
    z: Doubles
    """The mean height of these points, m."""


@dataclass(frozen=True)
class Sighting:
    """A body in one frame: its stamp, its edge and its profile."""

    stamp: float
    """Stamp of the frame, s."""
    edge: float
    """The robust nearest distance, m."""
    profile: Profile
    """The side that faces the sensor."""


def profile(x: Doubles, y: Doubles, z: Doubles, settings: Alignment) -> Profile:
    """Sum up the points of a body; ``x`` is ahead, ``y`` to the left and ``z`` upwards, m."""
    column, level = _numbered(y, settings.cell[0]), _numbered(z, settings.cell[1])
    order = np.lexsort((x, level, column))
    x, z, column, level = x[order], z[order], column[order], level[order]

    new = np.diff(column, prepend=-FARTHEST - 1) != 0
    new |= np.diff(level, prepend=-FARTHEST - 1) != 0
    first, cell = np.flatnonzero(new), np.cumsum(new) - 1
    size = np.bincount(cell, minlength=len(first))
    median = (x[first + (size - 1) // 2] + x[first + size // 2]) / 2
    near = np.abs(x - median[cell]) <= FARTHEST_FROM_MEDIAN * settings.range_noise
    # Of two points far apart neither is the majority, so both count.
    near |= np.bincount(cell, near)[cell] == 0
    count = np.bincount(cell, near).astype(np.float64)
    return Profile(
        column[first], level[first], count, np.bincount(cell, near * x) / count, np.bincount(cell, near * z) / count
    )


def _numbered(place: Doubles, width: float) -> NDArray[np.int64]:
    numbered: NDArray[Any] = np.clip(np.floor(place / width), -FARTHEST, FARTHEST)
    return numbered.astype(np.int64)
