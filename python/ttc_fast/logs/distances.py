"""What a log of distances gives."""

from __future__ import annotations

from typing import NamedTuple, Protocol, runtime_checkable

from ttc_fast.logs.log import Log


class DistanceFrame(NamedTuple):
    """One distance to what is ahead.

    Attributes
    ----------
    stamp : float
        s, since whatever the log counts from.
    distance : float
        m; NaN where the table has none.
    speed : float or None
        Of the vehicle, if the user says it, m/s.
    """

    stamp: float
    distance: float
    speed: float | None = None


@runtime_checkable
class DistanceLog(Log[DistanceFrame], Protocol):
    """A log of distances."""

    @property
    def column(self) -> str:
        """Of the table, that the distances are from."""

    @property
    def clock(self) -> str:
        """Where the stamps come from, for people."""
