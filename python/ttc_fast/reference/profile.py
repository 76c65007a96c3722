"""The side of a body that faces the sensor, cell by cell."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ttc_fast._core import Alignment
    from ttc_fast.reference.gate import Candidates

    Doubles = NDArray[np.float64]

FARTHEST = 32_000
"""Columns and levels are numbered up to here, to either side."""
WIDE = 3.0
"""Points further from the median of their cell than this times the range noise don't count."""


@dataclass(frozen=True)
class Profile:
    """What is known of each cell with points in it; cells in the order of their columns, upwards in each."""

    column: NDArray[np.int64]
    """To the left, in widths of a cell."""
    level: NDArray[np.int64]
    """Upwards, in heights of a cell."""
    count: Doubles
    """Points that count."""
    x: Doubles
    """Their mean distance ahead, m."""
    z: Doubles
    """Their mean height, m."""


def profile(inside: Candidates, edge: float, settings: Alignment) -> Profile:
    """Sum up a body whose nearest point is at ``edge``, and which counts up to ``depth`` behind that."""
    body = inside.x <= edge + settings.depth
    x, (_, y, z) = inside.x[body], inside.position[body].T
    column, level = _numbered(y, settings.cell[0]), _numbered(z, settings.cell[1])
    order = np.lexsort((x, level, column))
    x, z, column, level = x[order], z[order], column[order], level[order]

    new = np.diff(column, prepend=-FARTHEST - 1) != 0
    new |= np.diff(level, prepend=-FARTHEST - 1) != 0
    first, cell = np.flatnonzero(new), np.cumsum(new) - 1
    size = np.bincount(cell, minlength=len(first))
    median = (x[first + (size - 1) // 2] + x[first + size // 2]) / 2
    near = np.abs(x - median[cell]) <= WIDE * settings.range_noise
    # Two points that far apart have no majority: both count.
    near |= np.bincount(cell, near)[cell] == 0
    count = np.bincount(cell, near).astype(np.float64)
    return Profile(
        column[first], level[first], count, np.bincount(cell, near * x) / count, np.bincount(cell, near * z) / count
    )


def _numbered(place: Doubles, width: float) -> NDArray[np.int64]:
    numbered: NDArray[Any] = np.clip(np.floor(place / width), -FARTHEST, FARTHEST)
    return numbered.astype(np.int64)
