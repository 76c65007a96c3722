"""Which beam decides, where a speckle must not: the nearest in time that a vote confirms."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ttc_fast._core import KthSmallest, NeighbourSupport

if TYPE_CHECKING:
    from numpy.typing import NDArray

    BeamVote = KthSmallest | NeighbourSupport


class Elected(NamedTuple):
    """The outcome of a vote."""

    beam: int | None
    """The beam that decides; None when none closes."""
    confirmed: bool
    """False where beams close, but too few for a vote, so that the plain nearest decides."""


def elect(
    ttc: NDArray[np.float64], ranges: NDArray[np.float64], beam_vote: BeamVote | None, *, around: bool
) -> Elected:
    """Return the beam that decides.

    Parameters
    ----------
    ttc : ndarray, shape (N,)
        Time-to-collision of each beam, s; infinite where it does not close.
    ranges : ndarray, shape (N,)
        Usable range of each beam, m; NaN where there is none.
    beam_vote : KthSmallest or NeighbourSupport or None
        The vote; without one the nearest decides.
    around : bool
        Whether the beams go all around, so that the first is a neighbour of the last.
    """
    order = np.argsort(ttc, kind="stable")  # stable: ties go to the lowest index
    closing = order[ttc[order] < np.inf]
    winners = _winners(closing, ranges, beam_vote, around)
    if winners.size > 0:
        return Elected(int(winners[0]), confirmed=True)
    if closing.size > 0:
        return Elected(int(closing[0]), confirmed=False)
    return Elected(None, confirmed=True)


def _winners(
    closing: NDArray[np.intp], ranges: NDArray[np.float64], beam_vote: BeamVote | None, around: bool
) -> NDArray[np.intp]:
    """Return the beams among ``closing`` that the vote lets decide, nearest first."""
    if isinstance(beam_vote, KthSmallest):
        return closing[beam_vote.k - 1 :]
    if isinstance(beam_vote, NeighbourSupport):
        return closing[_agreeing_neighbours(ranges, beam_vote, around)[closing] >= beam_vote.count]
    return closing


def goes_around(angle_increment: float, beams: int) -> bool:
    """Return whether beams go all around, so that the first is a neighbour of the last."""
    increment = abs(angle_increment)
    seam = 2.0 * math.pi - increment * (beams - 1)
    return -0.5 * increment <= seam <= 1.5 * increment


def _agreeing_neighbours(ranges: NDArray[np.float64], support: NeighbourSupport, around: bool) -> NDArray[np.intp]:
    """Count for each beam how many of the ``window`` beams on each side have a range within ``gap`` of its own."""
    agreeing = np.zeros(ranges.size, np.intp)
    if around:
        for distance in range(1, min(support.window, (ranges.size - 1) // 2) + 1):
            for other in (np.roll(ranges, distance), np.roll(ranges, -distance)):
                agreeing += np.abs(other - ranges) <= support.gap
        return agreeing
    for distance in range(1, min(support.window, ranges.size - 1) + 1):
        agree = np.abs(ranges[distance:] - ranges[:-distance]) <= support.gap
        agreeing[distance:] += agree
        agreeing[:-distance] += agree
    return agreeing
