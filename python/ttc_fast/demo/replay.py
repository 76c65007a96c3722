"""What the replays of all kinds of logs have in common."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

from ttc_fast.logs import LogError

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path


class Row(Protocol):
    """What one frame gave."""

    @property
    def frame(self) -> int:
        """Its place in the log, from 0."""

    @property
    def stamp(self) -> float:
        """When, s."""

    @property
    def ttc(self) -> float:
        """Time to collision, s; inf where nothing closes."""


RowT = TypeVar("RowT", bound=Row)
FrameT = TypeVar("FrameT")


@dataclass(frozen=True)
class Replay(Generic[RowT, FrameT]):
    """A log replayed.

    Attributes
    ----------
    rows : list of Row
        One a frame, at least one.
    least : Row
        The frame of least TTC, the first of them; the first of all when nothing ever closes.
    least_frame : frame of the log
        What was recorded there.
    threshold : float
        TTC below which a frame is marked, s.
    """

    rows: list[RowT]
    least: RowT
    least_frame: FrameT
    threshold: float

    @cached_property
    def under(self) -> list[RowT]:
        """Frames whose TTC is under the threshold."""
        return [row for row in self.rows if row.ttc < self.threshold]

    @property
    def duration(self) -> float:
        """From the first frame to the last, s."""
        return self.rows[-1].stamp - self.rows[0].stamp

    @property
    def pace(self) -> str:
        """How many frames a second there are, for people."""
        return f"{(len(self.rows) - 1) / self.duration:.3g} Hz" if self.duration else "1 frame"

    @property
    def alarming(self) -> bool:
        """Whether the least TTC is under the threshold."""
        return self.least.ttc < self.threshold


def collect(path: Path, played: Iterable[tuple[RowT, FrameT]]) -> tuple[list[RowT], RowT, FrameT]:
    """Gather the rows of a log, and of its frames that of the least TTC.

    Parameters
    ----------
    path : Path
        Of the log, for messages.
    played : iterable of (Row, frame)
        In order.

    Returns
    -------
    rows, least, least_frame
        As ``Replay`` has them.

    Raises
    ------
    LogError
        If there are none.
    """
    rows: list[RowT] = []
    least = None
    for row, frame in played:
        rows.append(row)
        if least is None or row.ttc < least[0].ttc:
            least = row, frame
    if least is None:
        raise LogError(path, "has no frames")
    return rows, *least
