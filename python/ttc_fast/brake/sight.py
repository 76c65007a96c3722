"""What a criterion judges: the nearest thing in time, as one way of looking sees it."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import TYPE_CHECKING, NamedTuple

from ttc_fast.status import Status

if TYPE_CHECKING:
    from ttc_fast._core import TrackedTTC


class Source(IntEnum):
    """Which way of looking saw something.

    Attributes
    ----------
    BEAMS
        iTTC: each beam of a scan by itself, by the vehicle's motion.
    PATH
        What the outline will touch on its way, by the vehicle's motion.
    RANGE_RATE
        iTTC by how the ranges change, without odometry.
    ESTIMATE
        A tracker or a camera.

    Examples
    --------
    >>> from ttc_fast.brake import Source
    >>> Source.PATH.name
    'PATH'
    """

    BEAMS = 0
    PATH = 1
    RANGE_RATE = 2
    ESTIMATE = 3


class Threat(NamedTuple):
    """The nearest thing in time, at the time of the decision.

    Attributes
    ----------
    source : Source
        Who saw it.
    ttc : float
        s, in [0, inf]; the age of the data has been taken off.
    status : Status
        What the TTC means. CONTACT of an estimate stands beside the TTC as it was told.
    index : int
        The beam or point; -1 when there is none.
    angle : float
        Its direction, rad; NaN when not known.
    range : float
        Its distance from the sensor or the vehicle's origin, m; NaN when not known.
    clearance : float
        What is left of the way to it, m, likewise less the age of the data.
    closing_speed : float
        m/s.
    age : float
        Of the data it was seen in, s.
    """

    source: Source
    ttc: float
    status: Status
    index: int  # type: ignore[assignment]  # a tuple's own index() is not missed
    angle: float
    range: float
    clearance: float
    closing_speed: float
    age: float

    def __str__(self) -> str:
        """Say what is there, in one line."""
        what = "target" if self.source is Source.ESTIMATE else "return"
        where = f"{what} {self.index}" if self.index >= 0 else what
        at = f" at {self.range:.2f} m," if math.isfinite(self.range) else ""
        if self.source is Source.ESTIMATE and self.status is Status.CONTACT:
            return f"{where}{at} in contact"
        return (
            f"{where}{at} {self.clearance:.2f} m clear, closing at {self.closing_speed:.2f} m/s, TTC {self.ttc:.2f} s"
        )


class Motion(NamedTuple):
    """How the vehicle moves.

    Parameters
    ----------
    speed : float
        Of the vehicle's origin, forward, m/s; negative when reversing. Odometry without a sign would take reversing
        for driving forward.
    yaw_rate : float
        Counter-clockwise, rad/s.
    lateral_speed : float
        To the left, m/s.
    stamp : float or None
        When it was measured, s; None means at the time of the decision.

    Examples
    --------
    >>> from ttc_fast import Motion
    >>> Motion(3.0, yaw_rate=0.2).lateral_speed
    0.0
    """

    speed: float
    yaw_rate: float = 0.0
    lateral_speed: float = 0.0
    stamp: float | None = None

    @property
    def over_ground(self) -> float:
        """Speed whatever the direction, m/s."""
        return math.hypot(self.speed, self.lateral_speed)


STANDING = Motion(0.0)


class Estimate(NamedTuple):
    """An estimate, from a tracker or a camera. ``Estimate.of`` makes it of what a tracker says.

    It is in contact when its status is CONTACT, or its distance is 0 or below. NO_DATA and INVALID say that nothing was
    seen: the TTC beside them is not used.

    Parameters
    ----------
    stamp : float
        When it was made, s.
    ttc : float
        s, in [0, inf].
    ttc_interval : (float, float) or None
        Its 90 % interval, if known.
    distance : float
        m; NaN when not known, as for a camera.
    closing_speed : float
        m/s; NaN when not known.
    closing_speed_interval : (float, float) or None
        Its 90 % interval, if known.
    status : Status or None
        What the TTC means; None when nobody says.

    Examples
    --------
    >>> from ttc_fast import Estimate
    >>> Estimate(12.0, ttc=1.4, distance=4.2).status is None
    True
    """

    stamp: float
    ttc: float
    ttc_interval: tuple[float, float] | None = None
    distance: float = math.nan
    closing_speed: float = math.nan
    closing_speed_interval: tuple[float, float] | None = None
    status: Status | None = None

    @property
    def saw_nothing(self) -> bool:
        """Whether there is nothing to judge: the status is NO_DATA or INVALID."""
        return self.status is Status.NO_DATA or self.status is Status.INVALID

    @classmethod
    def of(cls, tracked: TrackedTTC, stamp: float) -> Estimate:
        """Return what a tracker said of the frame of ``stamp``, its status included.

        Parameters
        ----------
        tracked : TrackedTTC
            From ``DistanceTracker.update`` or ``CloudTracker.update``.
        stamp : float
            The stamp of that frame, s.

        Returns
        -------
        Estimate

        Raises
        ------
        TypeError
            If it is nothing that a tracker said.

        Examples
        --------
        >>> from ttc_fast import DistanceTracker, Estimate
        >>> Estimate.of(DistanceTracker().update(8.0, stamp=0.0), 0.0).distance
        8.0
        """
        try:
            return cls(
                stamp,
                tracked.ttc,
                tracked.ttc_interval,
                tracked.distance,
                tracked.closing_speed,
                tracked.closing_speed_interval,
                tracked.status,
            )
        except AttributeError:
            raise TypeError(f"tracked must be what a tracker's update() returned, got {tracked!r}") from None
