"""What goes into a brake controller, and what its criteria see. These classes hold data only.

``Motion`` and ``Estimate`` go in. ``Threats`` are what a frame shows, and a ``Criterion`` turns them into an
``Evaluation``.
"""

from __future__ import annotations

import math
from enum import Enum
from typing import TYPE_CHECKING, ClassVar, NamedTuple, Protocol

from ttc_fast.status import NamedInt, Status

if TYPE_CHECKING:
    from ttc_fast._core import TrackedTTC


class Motion(NamedTuple):
    """The motion of the vehicle.

    Parameters
    ----------
    speed : float
        Forward speed of the vehicle's origin, m/s; negative when reversing. Odometry without a sign would take
        reversing for driving forward.
    yaw_rate : float
        Yaw rate, counter-clockwise, rad/s.
    lateral_speed : float
        Speed to the left, m/s.
    stamp : float or None
        Time of the measurement, s; None stands for the time of the decision.

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
        """Speed in any direction, m/s."""
        return math.hypot(self.speed, self.lateral_speed)


STANDING = Motion(0.0)
UNSURE = frozenset({Status.TOO_FEW, Status.WARMING_UP, Status.LOST, Status.STALE})
"""The statuses of an estimate that says nothing of what is ahead now."""
MEASURED = UNSURE | {Status.NOT_CLOSING, Status.CLOSING, Status.CONTACT}
"""The statuses of an estimate that rests on a measurement of something."""


class Estimate(NamedTuple):
    """What a tracker or a camera estimates. ``Estimate.of`` makes one from a tracker's result.

    An estimate is in contact when its status is CONTACT, or its distance is 0 or below. NO_DATA and INVALID mean that
    nothing was seen; the TTC is not used then.

    Parameters
    ----------
    stamp : float
        Time of the frame that it is made of, s.
    ttc : float
        Time-to-collision, s, in [0, inf].
    ttc_interval : (float, float) or None
        The 90 % interval of the TTC, s; None when not known.
    distance : float
        Distance, m; NaN when not known, as for a camera.
    closing_speed : float
        Closing speed, m/s; NaN when not known.
    closing_speed_interval : (float, float) or None
        The 90 % interval of the closing speed, m/s; None when not known.
    status : Status or None
        What the TTC means; None when not known.
    age : float
        Time from the measurement that it rests on to its stamp, s. A tracker predicts through what a sensor repeats.

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
    age: float = 0.0

    @property
    def saw_nothing(self) -> bool:
        """Whether the status is NO_DATA or INVALID: there is nothing to evaluate."""
        return self.status is Status.NO_DATA or self.status is Status.INVALID

    def is_current(self, now: float, timeout: float) -> bool:
        """Return whether it may say that nothing is in the way.

        It may not while its tracker warms up, has lost its target, is stale or had too few points, nor when the
        measurement that it rests on is too old. It may trigger all the same.

        Parameters
        ----------
        now : float
            The time, s.
        timeout : float
            The measurement may be this old, s.

        Returns
        -------
        bool

        Examples
        --------
        >>> from ttc_fast import Estimate, Status
        >>> Estimate(12.0, ttc=9.0).is_current(12.1, 0.3)
        True
        >>> Estimate(12.0, ttc=9.0, status=Status.LOST).is_current(12.1, 0.3)
        False
        """
        return self.status not in UNSURE and now - self.stamp + self.age <= timeout

    def repeats(self, before: Estimate | None) -> bool:
        """Return whether it is the one before to the bit, but for its stamp, with a TTC that should have run down.

        Parameters
        ----------
        before : Estimate or None
            The estimate before this one.

        Returns
        -------
        bool

        Examples
        --------
        >>> from ttc_fast import Estimate
        >>> Estimate(12.1, ttc=9.0).repeats(Estimate(12.0, ttc=9.0))
        True
        """
        return before is not None and 0.0 < self.ttc < math.inf and repr(self[1:]) == repr(before[1:])

    @classmethod
    def of(cls, tracked: TrackedTTC, stamp: float) -> Estimate:
        """Return a tracker's result for the frame of ``stamp`` as an estimate, with its status.

        Parameters
        ----------
        tracked : TrackedTTC
            The result of ``DistanceTracker.update`` or ``CloudTracker.update``.
        stamp : float
            Stamp of that frame, s.

        Returns
        -------
        Estimate

        Raises
        ------
        TypeError
            If ``tracked`` is not the result of a tracker.

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
                tracked.age if tracked.status in MEASURED and tracked.age < math.inf else 0.0,
            )
        except AttributeError:
            raise TypeError(f"tracked must be what a tracker's update() returned, got {tracked!r}") from None


class Source(NamedInt):
    """How a threat was found.

    Attributes
    ----------
    BEAMS
        By iTTC, each beam of a scan for itself, from the vehicle's motion.
    PATH
        By the swept path: what the outline will touch, from the vehicle's motion.
    RANGE_RATE
        By iTTC from how the ranges change, without odometry.
    ESTIMATE
        By a tracker or a camera.

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
    """What is nearest in time, at the time of the decision.

    Attributes
    ----------
    source : Source
        How it was found.
    ttc : float
        Time-to-collision, s, in [0, inf], less the age of the data.
    status : Status
        What the TTC means. An estimate in contact has the status CONTACT and keeps the TTC that it came with.
    index : int
        Number of the beam or point; -1 when there is none.
    angle : float
        Direction, rad; NaN when not known.
    range : float
        Distance from the sensor or the vehicle's origin, m; NaN when not known.
    clearance : float
        Length of the way that is left to it, m, less what was driven since the data were measured.
    closing_speed : float
        Closing speed, m/s.
    age : float
        Age of the data, s.
    """

    source: Source
    ttc: float
    status: Status
    index: int  # type: ignore[assignment]  # it hides tuple.index()
    angle: float
    range: float
    clearance: float
    closing_speed: float
    age: float

    def __str__(self) -> str:
        """Describe the threat in one line."""
        what = "target" if self.source is Source.ESTIMATE else "return"
        where = f"{what} {self.index}" if self.index >= 0 else what
        at = f" at {self.range:.2f} m," if math.isfinite(self.range) else ""
        if self.source is Source.ESTIMATE and self.status is Status.CONTACT:
            return f"{where}{at} in contact"
        if self.index < 0 and self.source is not Source.ESTIMATE:
            return "nothing is touched within the horizon" if self.source is Source.PATH else "nothing comes closer"
        return (
            f"{where}{at} {self.clearance:.2f} m clear, closing at {self.closing_speed:.2f} m/s, TTC {self.ttc:.2f} s"
        )


class Threats(NamedTuple):
    """All that a frame shows at the time of a decision. What no criterion needs, or no sensor can see, is None.

    Attributes
    ----------
    speed : float or None
        Speed of the vehicle over ground, m/s, without sign; None without odometry.
    beams : Threat or None
        The nearest beam by iTTC.
    path : Threat or None
        The nearest return on the path of the outline.
    estimate : Threat or None
        What a tracker or a camera estimates.
    estimate_is_sure : bool
        Whether the estimate surely comes closer: its TTC and the interval of it are finite. For an estimate in contact,
        whether it may stay so: the interval of its closing speed does not lie below 0.
    returns : int
        Number of valid readings or points; 1 where an estimate is all there is.
    status : Status
        Status of the frame: NO_DATA without a valid reading, else what the nearest TTC means.
    closing_speed_known : bool
        Whether the vehicle's motion, the range rate or the estimate gives the closing speeds.
    arc : Threat or None
        Where a planned path was given, the nearest return on the present arc, which ``path`` is otherwise.
    turn : Threat or None
        Where none was given, the nearest return on the arcs that the vehicle may turn to, up to
        ``PresentArc.sharpest``.
    """

    speed: float | None
    beams: Threat | None
    path: Threat | None
    estimate: Threat | None
    estimate_is_sure: bool
    returns: int
    status: Status
    closing_speed_known: bool
    arc: Threat | None = None
    turn: Threat | None = None

    @property
    def estimate_in_contact(self) -> bool:
        """Whether the estimate is in contact and does not surely move away."""
        return self.estimate_is_sure and self.estimate is not None and self.estimate.status is Status.CONTACT


class Evaluation(NamedTuple):
    """What a criterion compares: it triggers when ``value < threshold``.

    Attributes
    ----------
    value, threshold : float
        The two sides of the comparison, in the criterion's unit.
    threat : Threat or None
        The threat that the value belongs to.
    """

    value: float
    threshold: float
    threat: Threat | None

    @property
    def triggers(self) -> bool:
        """Whether it is time to brake."""
        return self.value < self.threshold

    def more_urgent_than(self, other: Evaluation) -> bool:
        """Return whether the value is a smaller part of its threshold than the other's is of its own."""
        return self.value * other.threshold < other.value * self.threshold


new = tuple.__new__
"""``new(Evaluation, (value, threshold, threat))`` takes half as long as ``Evaluation(value, threshold, threat)``."""

NOTHING = Evaluation(math.inf, 0.0, None)
"""The evaluation where there is no threat to evaluate. It never triggers."""


class Needs(Enum):
    """Which threats a criterion evaluates.

    Attributes
    ----------
    BEAMS
        The nearest beam by iTTC.
    PATH
        The nearest return on the path of the outline.
    NEAREST
        The nearest return on the path where there is an outline, else the nearest beam by iTTC.
    ESTIMATE
        The estimate alone.
    ARC
        The nearest return on the path, and with a planned path that on the present arc as well.
    """

    BEAMS = "beams"
    PATH = "path"
    NEAREST = "nearest"
    ESTIMATE = "estimate"
    ARC = "arc"


class Criterion(Protocol):
    """What a controller asks of a criterion. Any object with these attributes can be one.

    Attributes
    ----------
    name, unit : str
        Name, and unit of what it compares, for people.
    needs : Needs
        Which threats have to be computed for it.
    """

    name: ClassVar[str]
    unit: ClassVar[str]
    needs: ClassVar[Needs]

    def evaluate(self, threats: Threats) -> Evaluation:
        """Compare what a frame shows with the threshold.

        Parameters
        ----------
        threats : Threats
            What the frame shows.

        Returns
        -------
        Evaluation

        Examples
        --------
        >>> from ttc_fast import IttcThreshold, Status
        >>> from ttc_fast.brake import Source, Threat, Threats
        >>> threat = Threat(Source.BEAMS, 1.2, Status.CLOSING, 7, 0.0, 6.0, 6.0, 5.0, 0.0)
        >>> threats = Threats(5.0, threat, None, None, False, 100, Status.CLOSING, True)
        >>> IttcThreshold(1.5).evaluate(threats).triggers
        True
        """
        ...
