"""What a log comes to: least TTC, exposure, brakes, and what could not be judged."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from ttc_fast.brake import Command, Reason
from ttc_fast.status import Status

if TYPE_CHECKING:
    from ttc_fast.replay.row import Row

MOST_EVENTS = 1000
UNSEEN = (Status.NO_DATA, Status.INVALID)
GOING = (Status.CLEAR, Status.NOT_CLOSING)
UNKNOWN = (Status.WARMING_UP, Status.LOST, Status.STALE, *UNSEEN)
CONTRADICTION = 2.0


class Event(NamedTuple):
    """From the first row that braked to the last.

    Attributes
    ----------
    begin : Row
        The first.
    end : float
        Stamp of the last, s.
    frames : int
        How many.
    """

    begin: Row
    end: float
    frames: int


class Summary:
    """Of rows, as they come.

    Parameters
    ----------
    path : str
        Of the log.
    threshold : float
        s; what exposure is counted below.
    longest : float
        A row counts until the next one, but not for longer than this, s.

    Attributes
    ----------
    frames, with_known_ttc, brakes, warnings, invalid, unknown, isolated : int
        Rows; rows that tell a TTC, or that nothing comes closer; events of braking; rows that warn; rows of data that
        nothing could be told from; rows where nothing told a closing speed; isolated rows.
    stale, resets : int
        Gaps between frames that are longer than the brake waits; how often the clock of the log was set back.
    longest_gap : float
        Of those, s.
    judged : float
        For how long there was a TTC, or nothing came closer, s.
    exposed : float
        Time exposed TTC: for how long the TTC was at most the threshold, s.
    integrated : float
        Time integrated TTC: the same, times how far it was below, s^2.
    least : Row or None
        Of least TTC, the first of them; None if nothing ever closes.
    least_isolated : Row or None
        The isolated row of least TTC.
    events : list of Event
        Of braking, the first thousand.
    lost : str
        What could not be read; empty if all could.
    assumed : str
        What the reader of the log assumed because the log does not say it; empty if nothing.

    odd : list of str
        What was odd about messages that were used all the same, a sentence for each kind.

    Notes
    -----
    The measures are TET and TIT of [Minderhoud, Bovy: Extended time-to-collision measures for road traffic safety
    assessment, Accident Analysis and Prevention 33, 2001, pages 89 to 97]: the sum over all rows
    whose TTC is at most the threshold, of the time until the next row, and of that time by (threshold - TTC). Rows that
    tell no TTC do not count (WARMING_UP, LOST, STALE, NO_DATA, INVALID), nor does the part of a gap that is longer than
    ``longest``.

    An isolated row is a stray reading, as ``is_isolated`` tells it: it is never the least, and counts with the lesser
    TTC of its two neighbours.

    Examples
    --------
    >>> from ttc_fast.replay import Replay, sample
    >>> log = Replay(sample("scans"))
    >>> for row in log:
    ...     pass
    >>> round(log.summary.exposed, 2), round(log.summary.integrated, 2), log.summary.isolated
    (1.8, 1.34, 4)
    """

    def __init__(self, path: str, threshold: float, longest: float) -> None:
        self.path, self.threshold, self.longest = path, threshold, longest
        self.frames = self.brakes = self.warnings = self.invalid = self.unknown = 0
        self.with_known_ttc = self.isolated = self.stale = self.resets = 0
        self.longest_gap = self.duration = self.judged = self.exposed = self.integrated = 0.0
        self.least: Row | None = None
        self.least_isolated: Row | None = None
        self.events: list[Event] = []
        self.lost = self.assumed = ""
        self.odd: list[str] = []
        self._before: Row | None = None
        self._last: Row | None = None
        self._brakes = self._has_key_frame = False

    def add(self, row: Row) -> Row | None:
        """Take in a row; return this one or the one before it if its frame is now the one to look at."""
        self.frames += 1
        before, last = self._before, self._last
        self._before, self._last = last, row
        key_frame = None if last is None else self._measure(before, last, row)
        if row.status in UNSEEN:
            self.invalid += 1
        elif row.reason is Reason.NO_MOTION or not row.criterion:
            self.unknown += 1
        self._follow(row)
        if row.reason is Reason.CRITERION and not self._has_key_frame:
            self._has_key_frame = True
            return row
        return key_frame

    def end(self) -> Row | None:
        """Take in that there are no more; return what ``add`` does."""
        before, last = self._before, self._last
        self._before = self._last = None
        return None if last is None else self._measure(before, last, None)

    def _measure(self, before: Row | None, row: Row, after: Row | None) -> Row | None:
        """Measure a row by its neighbours; return it if it is the first, or the least so far, and none has braked."""
        passed = 0.0 if after is None else max(after.stamp - row.stamp, 0.0)
        self.duration += passed
        passed = min(passed, self.longest)
        ttc = known_ttc(row)
        if before is not None and after is not None and is_isolated(before, row, after, longest=self.longest):
            self.isolated += 1
            if self.least_isolated is None or ttc < self.least_isolated.ttc:
                self.least_isolated = row
            ttc, least = min(before.ttc, after.ttc), False
        else:
            least = ttc < (math.inf if self.least is None else self.least.ttc)
        if ttc == ttc:  # not NaN
            self.with_known_ttc += 1
            self.judged += passed
        if ttc <= self.threshold:
            self.exposed += passed
            self.integrated += passed * (self.threshold - ttc)
        if least:
            self.least = row
        return row if (least or before is None) and not self._has_key_frame else None

    def _follow(self, row: Row) -> None:
        """Follow the commands."""
        brakes = row.command is Command.BRAKE
        self.warnings += row.command is Command.WARN
        if brakes and not self._brakes:
            self.brakes += 1
            if self.brakes <= MOST_EVENTS:
                self.events.append(Event(row, row.stamp, 1))
        elif brakes and self.brakes <= MOST_EVENTS:
            begin, _, frames = self.events[-1]
            self.events[-1] = Event(begin, row.stamp, frames + 1)
        self._brakes = brakes

    @property
    def pace(self) -> str:
        """How many frames there are, and how many a second, for people."""
        if not self.duration > 0.0:
            return "1 frame" if self.frames == 1 else f"{self.frames} frames"
        return f"{self.frames} frames in {self.duration:.1f} s, {(self.frames - 1) / self.duration:.3g} Hz"


def known_ttc(row: Row) -> float:
    """Return the TTC that a row tells, inf where nothing comes closer, and NaN where it tells nothing."""
    if row.status in UNKNOWN or (row.status is Status.TOO_FEW and row.ttc == math.inf):
        return math.nan
    return row.ttc


def is_isolated(before: Row, row: Row, after: Row, *, longest: float) -> bool:
    """Tell whether a row is contradicted by both its neighbours: a stray reading.

    What really comes within the TTC of a row was as near, but for the time that passed, in the row before, and is so
    in the row after. Where both tell more than twice that, the row stands alone. Neighbours that tell nothing, or are
    further away than ``longest``, contradict nobody.

    Parameters
    ----------
    before, row, after : Row
        In the order of the log.
    longest : float
        s.

    Returns
    -------
    bool

    Examples
    --------
    >>> from ttc_fast.replay import Replay, sample
    >>> from ttc_fast.replay.summary import is_isolated
    >>> rows = list(Replay(sample("scans")))
    >>> [row.frame for a, row, b in zip(rows, rows[1:], rows[2:]) if is_isolated(a, row, b, longest=0.3)]
    [8, 14, 42, 71]
    """
    ttc, early, late = row.ttc, row.stamp - before.stamp, after.stamp - row.stamp
    if row.status in UNKNOWN or not (0.0 <= early <= longest and 0.0 <= late <= longest):
        return False
    return known_ttc(before) > CONTRADICTION * (ttc + early) and known_ttc(after) > CONTRADICTION * (ttc + late)
