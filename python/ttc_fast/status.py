"""The enums that say what a time-to-collision, a cloud or a road fit means."""

from enum import IntEnum


class NamedInt(IntEnum):
    """An integer that prints as its name: ``print(status)`` and ``f"{status}"`` give CLOSING, ``f"{status:d}"`` 2.

    Examples
    --------
    >>> from ttc_fast import Status
    >>> print(Status.CLOSING, f"{Status.CLOSING:>8}", f"{Status.CLOSING:d}", Status.CLOSING == 2)
    CLOSING  CLOSING 2 True
    """

    def __str__(self) -> str:
        return self.name

    def __format__(self, spec: str) -> str:
        return int.__format__(self, spec) if spec[-1:] in "bcdeEfFgGnoxX%" and spec else format(self.name, spec)


class Status(NamedInt):
    """What a time-to-collision means.

    A float cannot say whether nothing is there or nothing was seen, so a status stands beside it. The values are fixed;
    in arrays they are uint8. When several hold, the largest wins, except that CONTACT outranks TOO_FEW, and in trackers
    and ``ttc_from_clouds`` also WARMING_UP: contact is the more urgent news.

    Attributes
    ----------
    CLEAR
        The sensor looked, and there is nothing to hit.
    NOT_CLOSING
        Something is there and does not come closer, or a swept path does not touch it within its horizon. The TTC is
        infinite.
    CLOSING
        Something comes closer.
    CONTACT
        Something touches the outline or is inside it. Its own TTC is 0 while closing and infinite while opening.
        Something else may come closer at the same time and decide the TTC of the frame.
    TOO_FEW
        There are fewer points than the estimator needs.
    WARMING_UP
        There were too few frames so far, or the first ones contradict each other.
    LOST
        The target was there and is not there any more. Only trackers give it.
    STALE
        The newest data are too old. Only trackers and range rates give it.
    NO_DATA
        Nothing valid was seen.
    INVALID
        The input makes no sense.

    Examples
    --------
    >>> from ttc_fast import Status
    >>> Status(2)
    <Status.CLOSING: 2>
    """

    CLEAR = 0
    NOT_CLOSING = 1
    CLOSING = 2
    CONTACT = 3
    TOO_FEW = 4
    WARMING_UP = 5
    LOST = 6
    STALE = 7
    NO_DATA = 8
    INVALID = 9


class Detection(NamedInt):
    """What ``robust_min_x`` found in a cloud.

    Attributes
    ----------
    FOUND
        Something is ahead, with enough candidates for the estimator.
    CLEAR
        There are valid points, and none inside the gate.
    TOO_FEW
        There are candidates, but too few for the estimator.
    NO_DATA
        There is no valid point at all.

    Examples
    --------
    >>> from ttc_fast import Detection
    >>> Detection(0)
    <Detection.FOUND: 0>
    """

    FOUND = 0
    CLEAR = 1
    TOO_FEW = 2
    NO_DATA = 3


class RoadStatus(NamedInt):
    """Whether ``fit_road`` found a road in a cloud.

    Attributes
    ----------
    FOUND
        There is a road.
    NOT_FOUND
        There are valid points, and no plane through them can be a road.
    NO_DATA
        There is no valid point at all.

    Examples
    --------
    >>> from ttc_fast import RoadStatus
    >>> RoadStatus(0)
    <RoadStatus.FOUND: 0>
    """

    FOUND = 0
    NOT_FOUND = 1
    NO_DATA = 2
