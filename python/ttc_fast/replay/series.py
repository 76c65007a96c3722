"""Rows of a long log, a few thousand at most, to draw and to print."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ttc_fast.replay.row import Row

MOST = 4096


class Series:
    """Of so many rows in a row, that with the strongest command, and of those the least TTC.

    Examples
    --------
    >>> from ttc_fast.replay import Replay, sample
    >>> log = Replay(sample("scans"))
    >>> all_rows = list(log)
    >>> log.series.rows == all_rows, log.series.step
    (True, 1)
    """

    def __init__(self) -> None:
        self.rows: list[Row] = []
        """In order."""
        self.step = 1
        """How many rows each of them stands for."""
        self._pending: Row | None = None
        self._count = 0

    def add(self, row: Row) -> None:
        """Take in a row."""
        if self.step == 1:
            self.rows.append(row)
        else:
            pending = self._pending
            self._pending = row if pending is None else worse(pending, row)
            self._count += 1
            if self._count < self.step:
                return
            self.end()
        if len(self.rows) >= MOST:
            rows = self.rows
            self.rows = [worse(rows[i], rows[i + 1]) for i in range(0, MOST, 2)]
            self.step *= 2

    def end(self) -> None:
        """Keep what is pending."""
        if self._pending is not None:
            self.rows.append(self._pending)
        self._pending, self._count = None, 0


def worse(one: Row, other: Row) -> Row:
    """Return the row that matters more; the first where both do."""
    if one.command is not other.command:
        return one if one.command > other.command else other
    return one if one.ttc <= other.ttc else other
