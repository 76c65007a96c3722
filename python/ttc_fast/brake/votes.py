"""N of the last M frames."""

from __future__ import annotations

import operator
from typing import Any


class VoteRule:
    """At least ``needed`` of the last ``frames`` frames, where frames that never were have voted no.

    The votes themselves are an int that the caller keeps, the newest in the lowest bit.

    Parameters
    ----------
    argument : str
        What the setting is called, for messages.
    rule : (int, int)
        needed, frames.
    """

    __slots__ = ("_mask", "_needed")

    def __init__(self, argument: str, rule: Any) -> None:
        wrong = f"{argument} must be two integers (N, M), N of the last M frames, with 1 <= N <= M <= 64; got {rule!r}"
        try:
            needed, frames = map(operator.index, rule)
        except (TypeError, ValueError):
            raise TypeError(wrong) from None
        if not 1 <= needed <= frames <= 64:
            raise ValueError(wrong)
        self._needed = needed
        self._mask = (1 << frames) - 1

    def cast(self, votes: int, vote: bool) -> int:
        """Return the votes with one more."""
        return (votes << 1 | vote) & self._mask

    def carried(self, votes: int) -> bool:
        """Whether enough of them are yes."""
        return votes.bit_count() >= self._needed
