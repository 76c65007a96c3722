"""What stands beside every time-to-collision."""

from enum import IntEnum


class Status(IntEnum):
    """What a time-to-collision means.

    A float cannot say whether nothing is there or nothing was seen, so a status stands beside it. The values are fixed;
    in arrays they are uint8. When several hold, the largest wins, except that CONTACT outranks TOO_FEW.

    Examples
    --------
    >>> from ttc_fast import Status
    >>> Status(2)
    <Status.CLOSING: 2>
    """

    CLEAR = 0
    """Looked, and there is nothing to hit."""
    NOT_CLOSING = 1
    """Something is there and does not come closer; the TTC is infinite."""
    CLOSING = 2
    """Something comes closer."""
    CONTACT = 3
    """Touching or inside the outline: 0 while closing, infinite while opening."""
    TOO_FEW = 4
    """Fewer points than the estimator needs."""
    WARMING_UP = 5
    """Too few frames so far."""
    LOST = 6
    """The target was there and is not any more."""
    STALE = 7
    """The newest data are too old."""
    NO_DATA = 8
    """Nothing valid was seen."""
    INVALID = 9
    """The input makes no sense."""


class Detection(IntEnum):
    """What ``robust_min_x`` found in a cloud.

    Examples
    --------
    >>> from ttc_fast import Detection
    >>> Detection(0)
    <Detection.FOUND: 0>
    """

    FOUND = 0
    """Something is ahead, and the estimator vouches for it."""
    CLEAR = 1
    """There are valid points, and none inside the gate."""
    TOO_FEW = 2
    """There are candidates, but too few for the estimator."""
    NO_DATA = 3
    """There is no valid point at all."""


class RoadStatus(IntEnum):
    """Whether ``fit_road`` found a road in a cloud.

    Examples
    --------
    >>> from ttc_fast import RoadStatus
    >>> RoadStatus(0)
    <RoadStatus.FOUND: 0>
    """

    FOUND = 0
    """There is one."""
    NOT_FOUND = 1
    """There are valid points, and no plane among them passes for a road."""
    NO_DATA = 2
    """There is no valid point at all."""
