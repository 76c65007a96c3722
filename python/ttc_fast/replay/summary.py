"""The summary of a log: least TTC, exposure, brakes, and the frames that tell nothing.

It is made row by row, so that a log of any length takes the same memory.
"""

from __future__ import annotations

import json
import math
from typing import NamedTuple

from ttc_fast.brake import Command, Reason
from ttc_fast.replay.controller import STILL_BRAKING
from ttc_fast.replay.row import Row, of_plain, plain
from ttc_fast.status import Status

MOST_EVENTS = 1000
UNSEEN = (Status.NO_DATA, Status.INVALID)
UNKNOWN = (Status.WARMING_UP, Status.LOST, Status.STALE, *UNSEEN)
CONTRADICTION = 2.0
AT_START = (Reason.NO_MOTION, Reason.WAITING)
"""The reasons for which it brakes until something can be evaluated."""


def frames_of(count: int) -> str:
    """Return a number of frames as a text."""
    return "1 frame" if count == 1 else f"{count} frames"


class Event(NamedTuple):
    """An event of braking. Another one begins where a criterion triggers while the car brakes for another reason.

    Attributes
    ----------
    begin : Row
        The first row that brakes.
    end : float
        Stamp of the last row that brakes, s.
    frames : int
        Number of rows from the first to the last.
    """

    begin: Row
    end: float
    frames: int

    def __str__(self) -> str:
        begin = self.begin
        by = f" by {begin.criterion}: {begin.value:.2f} < {begin.threshold:.3g}"
        why = by if begin.reason is Reason.CRITERION and math.isfinite(begin.value) else ""
        until = f"{begin.stamp:.3f} to {self.end:.3f} s, {frames_of(self.frames)}"
        return f"frame {begin.frame}, {until}: {begin.reason.name}{why}"


class Summary:
    """The summary of rows, which takes them as they come.

    Parameters
    ----------
    path : str
        The log.
    threshold : float
        Exposure is the time with a TTC of at most this, s.
    longest : float
        A row counts until the next one, but for at most this time, s.

    Attributes
    ----------
    frames : int
        Number of rows.
    with_known_ttc : int
        Number of rows with a TTC, or with nothing that comes closer.
    brakes : int
        Number of events of braking.
    warnings : int
        Number of rows that warn.
    invalid : int
        Number of rows of blind and ignored frames.
    unknown : int
        Number of other rows in which it is not known what comes closer.
    isolated : int
        Number of isolated rows.
    begin : float
        Stamp of the first row, s; NaN without rows.
    stale : int
        Number of gaps between frames that are longer than the brake waits.
    resets : int
        Number of times that the clock of the log was set back.
    longest_gap : float
        The longest of those gaps, s.
    judged : float
        The time with a TTC, or with nothing that comes closer, s.
    exposed : float
        Time exposed TTC: the time with a TTC of at most the threshold, s.
    integrated : float
        Time integrated TTC: the integral over that time of how far the TTC is below the threshold, s^2.
    least : Row or None
        The first row of least TTC; None if nothing ever closes.
    least_isolated : Row or None
        The isolated row of least TTC.
    events : list of Event
        The first thousand events of braking.
    start : Event or None
        The braking from the start of the log until something could be evaluated, as while a tracker warms up or before
        the first odometry comes (NO_MOTION, WAITING). It is none of ``brakes`` and ``events``, unless nothing is ever
        evaluated.
    lost : str
        What could not be read; empty if all could.
    assumed : str
        What was assumed because neither the log nor the user says it; empty if nothing.
    odd : list of str
        What was odd about messages that were used all the same, a sentence for each kind.

    Notes
    -----
    The measures are TET and TIT of [Minderhoud, Bovy: Extended time-to-collision measures for road traffic safety
    assessment, Accident Analysis and Prevention 33, 2001, pages 89 to 97]: the sum over all rows
    whose TTC is at most the threshold, of the time until the next row, and of that time by (threshold - TTC). Rows
    without a TTC do not count (WARMING_UP, LOST, STALE, NO_DATA, INVALID), nor does the part of a gap that is longer
    than ``longest``.

    An isolated row, as ``is_isolated`` finds it, is a stray reading: it is never the least, and counts with the lesser
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
        self.begin = math.nan
        self.longest_gap = self.duration = self.judged = self.exposed = self.integrated = 0.0
        self.least: Row | None = None
        self.least_isolated: Row | None = None
        self.events: list[Event] = []
        self.start: Event | None = None
        self.lost = self.assumed = ""
        self.odd: list[str] = []
        self._before: Row | None = None
        self._last: Row | None = None
        self._brakes = self._saw_cause = self._has_key_frame = self._evaluated = self._starts = False

    def __repr__(self) -> str:
        """Return the numbers: frames, least TTC, exposure, brakes, and what was lost."""
        least = "none" if self.least is None else f"{self.least.ttc:.3f} s in frame {self.least.frame}"
        exposure = f"exposed={self.exposed:.2f} s, integrated={self.integrated:.2f} s^2"
        lost = f", lost={self.lost!r}" if self.lost else ""
        return f"Summary({self.path!r}, frames={self.frames}, least={least}, {exposure}, brakes={self.brakes}{lost})"

    def add(self, row: Row) -> Row | None:
        """Take a row; return this one or the one before it if its frame is now the key frame, else None."""
        self.frames += 1
        before, last = self._before, self._last
        self._before, self._last = last, row
        if self.frames == 1:
            self.begin = row.stamp
        key_frame = None if last is None else self._measure(before, last, row)
        if row.status in UNSEEN:
            self.invalid += 1
        elif math.isnan(known_ttc(row)) or row.reason is Reason.NO_MOTION or not row.criterion:
            self.unknown += 1
        self._follow(row)
        if row.reason is Reason.CRITERION and not self._has_key_frame:
            self._has_key_frame = True
            return row
        return key_frame

    def end(self) -> Row | None:
        """Measure the last row: there are no more; return what ``add`` does."""
        if self.start is not None and not self._evaluated:
            self.events.append(self.start)
            self.events.sort(key=lambda event: event.begin.frame)
            self.brakes, self.start = self.brakes + 1, None
        before, last = self._before, self._last
        self._before = self._last = None
        return None if last is None else self._measure(before, last, None)

    def to_json(self) -> str:
        """Return all of a summary that has ended as a text, from which ``of_json`` makes one that is equal."""
        state = {name: value for name, value in vars(self).items() if not name.startswith("_")}
        for name in ("least", "least_isolated"):
            state[name] = state[name] and plain(state[name])
        state["events"] = [(plain(begin), end, frames) for begin, end, frames in self.events]
        state["start"] = self.start and (plain(self.start.begin), *self.start[1:])
        return json.dumps(state)

    @classmethod
    def of_json(cls, text: str) -> Summary:
        """Return the summary that ``to_json`` gave as a text."""
        summary, state = cls("", 0.0, 0.0), json.loads(text)
        for name in ("least", "least_isolated"):
            state[name] = state[name] and of_plain(state[name])
        state["events"] = [Event(of_plain(begin), end, frames) for begin, end, frames in state["events"]]
        state["start"] = state["start"] and Event(of_plain(state["start"][0]), *state["start"][1:])
        vars(summary).update(state)
        return summary

    def _measure(self, before: Row | None, row: Row, after: Row | None) -> Row | None:
        """Measure a row by its neighbours; return it if none has braked and it is the first, or the least so far."""
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
        """Count commands and events."""
        brakes = row.command is Command.BRAKE
        sees_cause = brakes and row.reason is Reason.CRITERION
        self.warnings += row.command is Command.WARN
        self._evaluated = self._evaluated or bool(row.criterion)
        waits = row.reason in AT_START and not self._evaluated
        self._starts = brakes and not self._brakes and (waits or (self._starts and row.reason in STILL_BRAKING))
        if self._starts:
            begin, _, frames = self.start or Event(row, row.stamp, 0)
            self.start = Event(begin, row.stamp, frames + 1)
            brakes = False
        if brakes and (not self._brakes or (sees_cause and not self._saw_cause)):
            self.brakes += 1
            self._saw_cause = False
            if self.brakes <= MOST_EVENTS:
                self.events.append(Event(row, row.stamp, 1))
        elif brakes and self.brakes <= MOST_EVENTS:
            begin, _, frames = self.events[-1]
            self.events[-1] = Event(begin, row.stamp, frames + 1)
        self._brakes, self._saw_cause = brakes, self._saw_cause or sees_cause

    @property
    def pace(self) -> str:
        """The number of frames, in all and a second, as a text."""
        if not self.duration > 0.0:
            return frames_of(self.frames)
        return f"{frames_of(self.frames)} in {self.duration:.1f} s, {(self.frames - 1) / self.duration:.3g} Hz"


def known_ttc(row: Row) -> float:
    """Return the TTC of a row: inf where nothing comes closer, NaN where it is not known."""
    if row.status in UNKNOWN or (row.status is Status.TOO_FEW and row.ttc == math.inf):
        return math.nan
    return row.ttc


def is_isolated(before: Row, row: Row, after: Row, *, longest: float) -> bool:
    """Return whether both neighbours of a row contradict it: it is a stray reading.

    What really comes within the TTC of a row was about as near in the row before, and is so in the row after, but for
    the time between them. A row is isolated where both have more than twice that TTC. Neighbours without a TTC, or
    more than ``longest`` away, do not contradict it.

    Parameters
    ----------
    before, row, after : Row
        Three successive rows.
    longest : float
        The greatest time between neighbours, s.

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
