"""What stands beside every time-to-collision."""

from enum import IntEnum


class Status(IntEnum):
    """What a time-to-collision means.

    A float cannot say whether nothing is there or nothing was seen, so a status stands beside it. The values are fixed;
    in arrays they are uint8. When several hold, the largest wins, except that CONTACT outranks TOO_FEW, and in trackers
    and ``ttc_from_clouds`` WARMING_UP as well: where something touches, that is the more urgent news.

    Attributes
    ----------
    CLEAR
        Looked, and there is nothing to hit.
    NOT_CLOSING
        Something is there and does not come closer; the TTC is infinite.
    CLOSING
        Something comes closer.
    CONTACT
        Something touches or is inside the outline. Its own TTC is 0 while closing and infinite while opening; something
        else may come closer all the same and decide the TTC of the whole.
    TOO_FEW
        Fewer points than the estimator needs.
    WARMING_UP
        Too few frames so far.
    LOST
        The target was there and is not any more. Trackers give it.
    STALE
        The newest data are too old. Trackers give it.
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


class Detection(IntEnum):
    """What ``robust_min_x`` found in a cloud.

    Attributes
    ----------
    FOUND
        Something is ahead, and the estimator vouches for it.
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


class RoadStatus(IntEnum):
    """Whether ``fit_road`` found a road in a cloud.

    Attributes
    ----------
    FOUND
        There is one.
    NOT_FOUND
        There are valid points, and no plane among them passes for a road.
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
