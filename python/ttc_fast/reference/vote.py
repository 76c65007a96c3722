"""Which beam decides: the nearest in time, or the nearest that is not a speckle."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ttc_fast._core import KthSmallest, NeighbourSupport

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Minimum = KthSmallest | NeighbourSupport


class Decision(NamedTuple):
    """The outcome of a vote."""

    beam: int | None
    """The beam that decides; None when none closes."""
    too_few: bool
    """Whether beams close, but too few for a vote, so that the plain nearest decides."""


def decide(ttc: NDArray[np.float64], ranges: NDArray[np.float64], minimum: Minimum | None) -> Decision:
    """Choose the beam that decides.

    Parameters
    ----------
    ttc : ndarray, shape (N,)
        Time-to-collision of each beam, s; infinite where it does not close.
    ranges : ndarray, shape (N,)
        Usable range of each beam, m; NaN where there is none.
    minimum : KthSmallest or NeighbourSupport or None
        How to vote; None takes the nearest.
    """
    order = np.argsort(ttc, kind="stable")  # stable: ties go to the lowest index
    closing = order[ttc[order] < np.inf]
    elected = _elected(closing, ranges, minimum)
    if elected.size > 0:
        return Decision(int(elected[0]), too_few=False)
    if closing.size > 0:
        return Decision(int(closing[0]), too_few=True)
    return Decision(None, too_few=False)


def _elected(closing: NDArray[np.intp], ranges: NDArray[np.float64], minimum: Minimum | None) -> NDArray[np.intp]:
    """Pick the beams among ``closing`` that the vote lets decide, nearest first."""
    if isinstance(minimum, KthSmallest):
        return closing[minimum.k - 1 :]
    if isinstance(minimum, NeighbourSupport):
        return closing[_agreeing_neighbours(ranges, minimum)[closing] >= minimum.count]
    return closing


def _agreeing_neighbours(ranges: NDArray[np.float64], support: NeighbourSupport) -> NDArray[np.intp]:
    """For each beam, how many of the ``window`` beams on each side have a range within ``gap`` of its own."""
    agreeing = np.zeros(ranges.size, np.intp)
    for distance in range(1, min(support.window, ranges.size - 1) + 1):
        agree = np.abs(ranges[distance:] - ranges[:-distance]) <= support.gap
        agreeing[distance:] += agree
        agreeing[:-distance] += agree
    return agreeing
