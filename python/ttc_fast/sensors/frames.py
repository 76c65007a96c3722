"""Which sensor a message is of, by the ``frame_id`` of its header.

Two sensors may publish on one topic, told apart by ``frame_id`` alone, as the layers of some scanners do. What one of
them sees would outvote what the other one sees, and the rates of its beams would be rates between two sensors. So a
topic is of one sensor, and of a second one it is refused until the user has chosen.

Scans that name no frame are told apart by what they show: where each scan is like the one before the last, and unlike
the last, two sensors take turns.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast.sensors.oddities import RefusedError

if TYPE_CHECKING:
    from ttc_fast.sensors.oddities import Tally


COMPARED = 16
"""The number of beams of two scans that are compared."""
ALIKE = (0.3, 0.1)
"""m, and a part of the range: two readings that differ by less show the same."""
IN_TURNS = 6
"""The number of scans in a row that are unlike the last, and like the one before it, of sensors that take turns."""


class MixedError(RefusedError):
    """Messages of two sensors come on one topic, and the user has chosen none."""


class SensorChoice:
    """Lets the messages of one sensor through.

    Parameters
    ----------
    name : str
        The topic.
    odd : Tally
        Counts the messages of other sensors, where one is chosen.
    chosen : str
        The ``frame_id`` of the chosen sensor; empty where none is.
    how : str
        How the user chooses, for the message.

    Attributes
    ----------
    name : str
        The topic.
    mixed : str
        A sentence that says which sensors share the topic, as soon as they do and none is chosen; empty before.

    Examples
    --------
    >>> from ttc_fast.sensors.frames import SensorChoice
    >>> from ttc_fast.sensors.oddities import Tally
    >>> sensors = SensorChoice("/scan", Tally())
    >>> sensors.accepts("front")
    True
    >>> sensors.accepts("rear")
    Traceback (most recent call last):
        ...
    ttc_fast.sensors.frames.MixedError: has messages of two sensors, with the frame_id 'front' and 'rear', which must \
not be mixed: choose one with frame_id
    """

    def __init__(self, name: str, odd: Tally, chosen: str = "", how: str = "frame_id") -> None:
        self.name = name
        self._odd = odd
        self._chosen = chosen.lstrip("/")
        self._how = how
        self._known: str | None = chosen or None
        self._turns = Turns()
        self.mixed = ""

    def accepts(self, frame_id: str | None, ranges: Any = None) -> bool:
        """Return whether a message of this frame is to be used; raise MixedError where that is not known.

        The frame is None of objects that are no messages and say none. ``ranges`` are those of a scan.
        """
        if not frame_id and not self.mixed and ranges is not None and len(ranges) and self._turns.found(ranges):
            self.mixed = "has scans that name no frame_id and show two scenes in turns, as of two sensors on one topic"
        if not self.mixed:
            if frame_id is None or frame_id == self._known:
                return True
            known = self._known
            if known is None or frame_id.lstrip("/") == known.lstrip("/"):  # the names of ROS 1 may begin with one
                self._known = frame_id
                return True
            if self._chosen:
                self._odd.count(f"{self.name}, frame_id", f"{frame_id!r} is ignored, as {self._chosen!r} is chosen")
                return False
            self.mixed = mixed_sensors((known, frame_id), self._how)
        raise MixedError(self.mixed)


class Turns:
    """Finds that two sensors take turns on one topic, by the ranges of scans that name no frame.

    Examples
    --------
    >>> import numpy as np
    >>> from ttc_fast.sensors.frames import Turns
    >>> turns = Turns()
    >>> [turns.found(np.full(90, 6.0 if i % 2 else 9.0 - 0.05 * i)) for i in range(10)].index(True)
    7
    """

    def __init__(self) -> None:
        self._last: list[float] = []
        self._before_last: list[float] = []
        self._count = 0
        self._beams, self._chosen = 0, np.arange(0)
        """The beams that are compared, spread over however many there are."""

    def found(self, ranges: Any) -> bool:
        """Take up the next scan, and return whether it is clear that two sensors take turns."""
        beams = len(ranges)
        if beams != self._beams:
            self._beams, self._chosen = beams, np.arange(COMPARED) * beams // COMPARED
        now = ranges[self._chosen].tolist()
        last, before_last = self._last, self._before_last
        self._before_last, self._last = last, now
        turn = show_the_same(now, last, 0.25) is False and show_the_same(now, before_last, 0.75) is True
        self._count = self._count + 1 if turn else 0
        return self._count >= IN_TURNS


def show_the_same(one: list[float], other: list[float], share: float) -> bool | None:
    """Return whether more than a share of the readings that both scans have are the same; None if they have none.

    Examples
    --------
    >>> import math
    >>> from ttc_fast.sensors.frames import show_the_same
    >>> show_the_same([1.0, 5.0, math.inf], [1.1, 9.0, 2.0], 0.4), show_the_same([1.0, 5.0], [1.1, 9.0], 0.5)
    (True, False)
    """
    least, part = ALIKE
    both = alike = 0
    enough = share * len(one)
    for a, b in zip(one, other, strict=False):
        apart = abs(a - b)
        if apart < math.inf:  # neither is NaN or infinite
            both += 1
            if apart <= least + part * b:
                alike += 1
                if alike > enough:
                    return True
    return alike > share * both if both else None


def mixed_sensors(frames: Any, how: str) -> str:
    """Return the sentence that refuses several sensors on one topic."""
    count = {2: "two"}.get(len(frames), str(len(frames)))
    names = " and ".join(map(repr, frames))
    return f"has messages of {count} sensors, with the frame_id {names}, which must not be mixed: choose one with {how}"


def frame_of(message: Any) -> str | None:
    """Return the ``frame_id`` of a message of any transport; None of an object that has none."""
    frame_id = getattr(message, "frame_id", None)
    if frame_id is None:
        frame_id = getattr(getattr(message, "header", None), "frame_id", None)
    return frame_id
