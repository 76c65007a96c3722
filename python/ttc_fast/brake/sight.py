"""What a criterion judges: the nearest thing in time, as one way of looking sees it."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from ttc_fast.status import Status


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


class Sight(NamedTuple):
    """The nearest thing in time, at the time of the decision.

    Attributes
    ----------
    source : Source
        Who saw it.
    ttc : float
        s, in [0, inf]; the age of the data has been taken off.
    status : Status
        What the TTC means.
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
    """A second opinion, from a tracker or a camera.

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

    Examples
    --------
    >>> from ttc_fast import DistanceTracker, Estimate
    >>> seen = DistanceTracker(noise=0.02).update(8.0, 0.0)
    >>> Estimate(0.0, seen.ttc, seen.ttc_interval, seen.distance, seen.closing_speed).distance
    8.0
    """

    stamp: float
    ttc: float
    ttc_interval: tuple[float, float] | None = None
    distance: float = math.nan
    closing_speed: float = math.nan
