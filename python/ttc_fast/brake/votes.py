"""N of the last M frames."""

from __future__ import annotations


class NOfM:
    """At least ``needed`` of the last ``frames`` frames, where frames that never were have voted no.

    The votes themselves are an int that the caller keeps, the newest in the lowest bit.

    Parameters
    ----------
    rule : (int, int)
        needed, frames, as ``BrakeSettings`` checks them.
    """

    __slots__ = ("_mask", "_needed")

    def __init__(self, rule: tuple[int, int]) -> None:
        self._needed, frames = rule
        self._mask = (1 << frames) - 1

    def push(self, votes: int, vote: bool) -> int:
        """Return the votes with one more."""
        return (votes << 1 | vote) & self._mask

    def reached(self, votes: int) -> bool:
        """Whether enough of them are yes."""
        return votes.bit_count() >= self._needed
