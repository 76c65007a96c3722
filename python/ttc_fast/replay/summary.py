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
    least_ttc : float
        Of them, s.
    """

    begin: Row
    end: float
    frames: int
    least_ttc: float


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
    frames, brakes, warnings, invalid, unknown : int
        Rows; events of braking; rows that warn; rows of data that nothing could be told from; rows where nothing told
        a closing speed.
    stale, resets : int
        Gaps between frames that are longer than the brake waits; how often the clock of the log was set back.
    exposed : float
        Time exposed TTC: for how long the TTC was below the threshold, s.
    integrated : float
        Time integrated TTC: the same, times how far it was below, s^2.
    least : Row or None
        Of least TTC, the first of them.
    events : list of Event
        Of braking, the first thousand.
    lost : str
        What could not be read; empty if all could.

    Notes
    -----
    [Minderhoud, Bovy: Extended time-to-collision measures for road traffic safety assessment, 2001]

    Examples
    --------
    >>> from ttc_fast.replay import Replay, sample
    >>> log = Replay(sample("scans"))
    >>> for row in log:
    ...     pass
    >>> round(log.summary.exposed, 2), round(log.summary.integrated, 2)
    (1.87, 1.44)
    """

    def __init__(self, path: str, threshold: float, longest: float) -> None:
        self.path, self.threshold = path, threshold
        self.frames = self.brakes = self.warnings = self.invalid = self.unknown = self.stale = self.resets = 0
        self.begin = self.end = math.nan
        self.duration = self.exposed = self.integrated = 0.0
        self.least: Row | None = None
        self.events: list[Event] = []
        self.lost = ""
        self._longest = longest
        self._before: Row | None = None
        self._event: Row | None = None
        self._event_frames, self._event_least = 0, math.inf
        self._has_moment = False

    def add(self, row: Row) -> bool:
        """Take in a row; tell whether its frame is the one to look at, of those so far."""
        self.frames += 1
        before, stamp, ttc = self._before, row.stamp, row.ttc
        if before is None:
            self.begin = stamp
        else:
            passed = stamp - before.stamp
            if passed > 0.0:
                self.duration += passed
                if before.ttc < self.threshold:
                    passed = min(passed, self._longest)
                    self.exposed += passed
                    self.integrated += passed * (self.threshold - before.ttc)
        self._before, self.end = row, stamp
        if row.status in UNSEEN:
            self.invalid += 1
        elif row.reason is Reason.NO_MOTION or not row.criterion:
            self.unknown += 1
        least = self.least is None or ttc < self.least.ttc
        if least:
            self.least = row
        self._follow(row)
        if row.reason is Reason.CRITERION and not self._has_moment:
            self._has_moment = True
            return True
        return least and not self._has_moment

    def _follow(self, row: Row) -> None:
        """Follow the commands."""
        if row.command is Command.BRAKE:
            if self._event is None:
                self.brakes += 1
                self._event, self._event_frames, self._event_least = row, 0, math.inf
                if len(self.events) < MOST_EVENTS:
                    self.events.append(Event(row, row.stamp, 1, row.ttc))
            self._event_frames += 1
            self._event_least = min(self._event_least, row.ttc)
            if self.brakes <= MOST_EVENTS and self._event is not None:
                self.events[-1] = Event(self._event, row.stamp, self._event_frames, self._event_least)
        else:
            self._event = None
            self.warnings += row.command is Command.WARN

    @property
    def pace(self) -> str:
        """How many frames a second there are, for people."""
        return f"{(self.frames - 1) / self.duration:.3g} Hz" if self.duration > 0.0 else "1 frame"
