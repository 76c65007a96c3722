"""When a message was measured: by the stamp of its header, or by when it came.

Whether the stamps of a topic can be used is seen by all of them, not by the first one: a simulation sends a few
messages without a stamp until its clock has come. A message without a stamp among others that have one is lost, since
nobody knows when it was measured. Odometry is an exception: where it has no stamp, it counts as measured when it came,
as it is only used for what comes next.

Two topics may be stamped by two clocks, such as the time since a sensor was switched on and the time of day. Such
stamps cannot be compared, and nobody knows how old the odometry is at the time of a scan.
"""

from __future__ import annotations

from statistics import median
from typing import TYPE_CHECKING, TypeVar

from ttc_fast.sensors.oddities import RefusedError

if TYPE_CHECKING:
    from ttc_fast.sensors.oddities import Tally

TimeT = TypeVar("TimeT", int, float)
ANOTHER_CLOCK = 10.0
"""s; stamps that are further than this from others of the same time are of another clock."""
SET_BACK = 1.0
"""s; a clock that goes back by more than this was set anew, as where a bag is played again; less is jitter."""
REAL_TIME = 0.05
"""A clock that runs this little faster or slower than another, as a part, runs alike."""


class Stamps:
    """The stamps of one topic, as its messages come.

    Parameters
    ----------
    name : str
        The topic.
    odd : Tally
        Counts stamps that stand still.
    has_stamps : bool
        Whether it is known before that its messages have stamps.

    Examples
    --------
    >>> from ttc_fast.sensors.clock import Stamps
    >>> from ttc_fast.sensors.oddities import Tally
    >>> stamps = Stamps("/scan", Tally(print))
    >>> stamps.measured(12.0, came=12.5), stamps.measured(12.0, came=12.6)
    /scan, stamp: stands still: it is that of the message before
    (12.0, 12.0)
    """

    def __init__(self, name: str, odd: Tally, *, has_stamps: bool = False) -> None:
        self._name = name
        self._odd = odd
        self._has_stamps = has_stamps
        self._last: float = 0.0

    def measured(self, stamp: TimeT, came: TimeT) -> TimeT:
        """Return when a message was measured; ``came`` is when it came, in the same unit."""
        if not stamp:
            if self._has_stamps:
                raise RefusedError("has no stamp, and others of its topic have one")
            return came
        self._has_stamps = True
        if stamp == self._last:
            self._odd.count(f"{self._name}, stamp", "stands still: it is that of the message before")
        self._last = stamp
        return stamp


class StampSurvey:
    """What the first messages of a recorded topic say about its clock. Times are in ns."""

    def __init__(self) -> None:
        self._seen: list[tuple[int, int]] = []

    def add(self, stamp: int, recorded: int) -> None:
        """Take up the stamp of a message, and when it was recorded."""
        self._seen.append((stamp, recorded))

    @property
    def stamped(self) -> int:
        """The number of messages that have a stamp."""
        return sum(stamp != 0 for stamp, _ in self._seen)

    @property
    def has_stamps(self) -> bool:
        """Whether at least half of the messages have a stamp."""
        return self.stamped > 0 and 2 * self.stamped >= len(self._seen)

    @property
    def first(self) -> tuple[int, int]:
        """The stamp of the first message that has one, and when that was recorded."""
        return next(each for each in self._seen if each[0])

    @property
    def ahead(self) -> float:
        """How far the stamps are ahead of the times of recording, s; negative where they are behind."""
        return median(stamp - recorded for stamp, recorded in self._seen if stamp) * 1e-9

    @property
    def rate(self) -> float:
        """How fast the clock of the stamps runs by that of recording: below 1 for a slow simulation."""
        stamped = [each for each in self._seen if each[0]]
        (stamp, recorded), (last, last_recorded) = stamped[0], stamped[-1]
        if last_recorded <= recorded or last <= stamp:
            return 1.0
        rate = (last - stamp) / (last_recorded - recorded)
        return 1.0 if abs(rate - 1.0) <= REAL_TIME else rate


def apart(ahead: float, of: str) -> str:
    """Return how far stamps are from others, or from a clock.

    Examples
    --------
    >>> from ttc_fast.sensors.clock import apart
    >>> apart(-5.0, "the clock of this node")
    '5 s before the clock of this node'
    """
    return f"{abs(ahead):.10g} s {'after' if ahead > 0.0 else 'before'} {of}"


def other_clock(name: str, ahead: float, of: str, remedy: str) -> str:
    """Return a sentence that names two clocks which cannot be compared; empty where they can be.

    Examples
    --------
    >>> from ttc_fast.sensors.clock import other_clock
    >>> other_clock("/odom", 3600.0, "/scan", "set the clocks")
    'the stamps of /odom are 3600 s after those of /scan: two clocks that cannot be compared; set the clocks'
    >>> other_clock("/odom", 0.5, "/scan", "set the clocks")
    ''
    """
    if abs(ahead) <= ANOTHER_CLOCK:
        return ""
    how = apart(round(ahead), f"those of {of}")
    return f"the stamps of {name} are {how}: two clocks that cannot be compared; {remedy}"
