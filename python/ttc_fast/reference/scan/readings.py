"""What a number in ``ranges`` means (REP 117, sensor_msgs/LaserScan), and how often each case occurs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast.reference.formula import rounded
from ttc_fast.reference.hit import Counts

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.floating[Any]]
    Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Rules:
    """The sensor's range, the user's limits, and what is done with readings outside them.

    All bounds are inclusive, and rounded to the dtype of the ranges that they are compared with.
    """

    range_min: float
    """Finite readings below this are discarded, m."""
    range_max: float
    """Finite readings above this are discarded, m."""
    near: float
    """The user's near limit, m; 0 without limits."""
    far: float
    """The user's far limit, m; infinite without limits."""
    clamps: bool
    """Whether readings are moved into the limits, instead of being out of the horizon beyond ``far``."""
    too_close_is_hit: bool
    """Whether -inf is a hit at ``range_min``, instead of nothing."""

    def usable(self, ranges: Floats) -> Floats:
        """Return the range to compute with, m; NaN where there is none."""
        near, far = rounded(self.near, ranges.dtype), rounded(self.far, ranges.dtype)
        usable = ranges.copy()
        usable[self._hit_too_close(ranges)] = rounded(self.range_min, ranges.dtype)
        usable[~self._in_range(usable)] = np.nan
        if self.clamps:
            return np.clip(usable, near, far)
        usable[usable > far] = np.nan
        return usable

    def observed(self, ranges: Floats) -> Bools:
        """Whether the sensor saw anything at all: a reading within its range, or free space."""
        free_space: Bools = ranges == np.inf
        return self._in_range(ranges) | self._hit_too_close(ranges) | free_space

    def count(self, ranges: Floats, offset: NDArray[np.float64]) -> Counts:
        """Count how often each case occurs in a scan; ``offset`` is NaN where a beam is ignored."""
        looked = ~np.isnan(offset)
        in_range = self._in_range(ranges)
        beyond = ranges > rounded(self.far, ranges.dtype)
        contact = self.usable(ranges).astype(np.float64) - offset <= 0

        def number(case: Bools) -> int:
            return int(np.count_nonzero(case & looked))

        return Counts(
            valid=number(in_range & ~beyond),
            invalid=number(np.isnan(ranges)),
            too_close=number(ranges == -np.inf),
            no_return=number(ranges == np.inf),
            out_of_range=number(np.isfinite(ranges) & ~in_range),
            beyond_limits=number(in_range & beyond),
            masked=int(np.count_nonzero(~looked)),
            contact=number(contact),
        )

    def _in_range(self, ranges: Floats) -> Bools:
        """Whether each reading is finite and within the sensor's range."""
        range_min, range_max = rounded(self.range_min, ranges.dtype), rounded(self.range_max, ranges.dtype)
        return np.isfinite(ranges) & (range_min <= ranges) & (ranges <= range_max)

    def _hit_too_close(self, ranges: Floats) -> Bools:
        too_close: Bools = ranges == -np.inf
        return too_close & self.too_close_is_hit
