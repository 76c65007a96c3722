"""When to brake: criteria, each with its own settings. Any of them may trigger.

A criterion compares a value with a threshold and triggers when the value is less. The controller warns at a multiple
of the threshold and releases at another.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from ttc_fast._core import rss_longitudinal_distance
from ttc_fast._settings import Number, check_fields, setting
from ttc_fast.brake.types import NOTHING, Criterion, Evaluation, Needs, new

if TYPE_CHECKING:
    from ttc_fast.brake.types import Threat, Threats


TIME = Number(unit="s", positive=True)
BRAKING = Number(unit="m/s^2", positive=True)


@dataclass(frozen=True)
class TtcThreshold(Criterion):
    """A criterion that compares a time-to-collision with a threshold."""

    threshold: float = setting(1.5, TIME, "It brakes when the TTC is below this.")

    unit: ClassVar[str] = "s"

    def __post_init__(self) -> None:
        check_fields(self)


@dataclass(frozen=True)
class IttcThreshold(TtcThreshold):
    """Brake when the least iTTC of any beam is below a threshold: the classic rule of F1TENTH.

    It cannot see where the vehicle goes: it brakes for walls that are only passed (0.36 s beside walls 1 m away at
    5 m/s) and late for what lies off its axis. Without odometry it compares the TTC by range rate.

    Parameters
    ----------
    threshold : float, default 1.5
        The threshold, s, above 0.

    Raises
    ------
    ValueError
        If the threshold is not finite and above 0.

    Examples
    --------
    >>> from ttc_fast import IttcThreshold
    >>> IttcThreshold(0.5)
    IttcThreshold(threshold=0.5)
    """

    name: ClassVar[str] = "IttcThreshold"
    needs: ClassVar[Needs] = Needs.BEAMS

    def evaluate(self, threats: Threats) -> Evaluation:
        return NOTHING if threats.beams is None else Evaluation(threats.beams.ttc, self.threshold, threats.beams)


@dataclass(frozen=True)
class SweptPathThreshold(TtcThreshold):
    """Brake when the outline, moving on as now, touches something within a threshold.

    It cannot see that a thing moves by itself and closes faster, nor that the driver is about to steer. Without
    odometry there is no path, and it compares the TTC by range rate.

    Parameters
    ----------
    threshold : float, default 1.5
        The threshold, s, above 0.

    Raises
    ------
    ValueError
        If the threshold is not finite and above 0.

    Examples
    --------
    >>> from ttc_fast import SweptPathThreshold
    >>> SweptPathThreshold(1.0)
    SweptPathThreshold(threshold=1.0)
    """

    name: ClassVar[str] = "SweptPathThreshold"
    needs: ClassVar[Needs] = Needs.PATH

    def evaluate(self, threats: Threats) -> Evaluation:
        threat = threats.path or threats.beams
        return NOTHING if threat is None else new(Evaluation, (threat.ttc, self.threshold, threat))


@dataclass(frozen=True)
class EstimateThreshold(TtcThreshold):
    """Brake when the TTC of an estimate is below a threshold.

    An estimate whose interval reaches infinity is not sure that anything comes closer: it may warn and never brakes.
    One in contact is 0 s away, whatever its TTC, unless it surely moves away: the interval of its closing speed, or
    without one the closing speed, is below 0. It cannot see what its tracker or camera does not follow.

    Parameters
    ----------
    threshold : float, default 1.5
        The threshold, s, above 0.

    Raises
    ------
    ValueError
        If the threshold is not finite and above 0.

    Examples
    --------
    >>> from ttc_fast import EstimateThreshold
    >>> EstimateThreshold(2.0)
    EstimateThreshold(threshold=2.0)
    """

    name: ClassVar[str] = "EstimateThreshold"
    needs: ClassVar[Needs] = Needs.ESTIMATE

    def evaluate(self, threats: Threats) -> Evaluation:
        if threats.estimate is None:
            return NOTHING
        if threats.estimate_in_contact:
            return Evaluation(0.0, self.threshold, threats.estimate)
        ttc = threats.estimate.ttc if threats.estimate_is_sure else max(threats.estimate.ttc, self.threshold)
        return Evaluation(ttc, self.threshold, threats.estimate)


@dataclass(frozen=True)
class StoppingDistance(Criterion):
    """Brake when the vehicle could only just stop short of something.

    It compares the clearance with ``v reaction_time + v^2 / (2 deceleration) + margin``, v the closing speed. A TTC
    threshold alone cannot stop a car that is faster than about ``2 deceleration (threshold - reaction_time)``. It
    evaluates the nearest return on the path where there is an outline, else the nearest beam in time, and the estimate
    as well. It takes everything to go on as it does, and cannot see that a car ahead may brake: for that there is
    ``RssDistance``.

    Parameters
    ----------
    deceleration : float, default 6.0
        The deceleration of the vehicle when it brakes, m/s^2, above 0.
    reaction_time : float, default 0.1
        The time from the decision until the brake acts, s, at least 0.
    margin : float, default 0.2
        The distance that is left when the vehicle stands, m, at least 0.

    Raises
    ------
    ValueError
        If a setting is out of its range.

    Examples
    --------
    >>> from ttc_fast import StoppingDistance
    >>> StoppingDistance(deceleration=8.0).margin
    0.2
    """

    deceleration: float = setting(6.0, BRAKING, "The deceleration of the vehicle when it brakes.")
    reaction_time: float = setting(0.1, Number(unit="s", least=0.0), "The time from the decision until the brake acts.")
    margin: float = setting(0.2, Number(unit="m", least=0.0), "The distance that is left when the vehicle stands.")

    name: ClassVar[str] = "StoppingDistance"
    unit: ClassVar[str] = "m"
    needs: ClassVar[Needs] = Needs.NEAREST

    def __post_init__(self) -> None:
        check_fields(self)

    def evaluate(self, threats: Threats) -> Evaluation:
        threat = threats.path or threats.beams
        nearest = NOTHING if threat is None or threat.ttc == math.inf else self._needed(threat)
        if threats.estimate is None or not threats.estimate_is_sure:
            return nearest
        estimated = self._needed(threats.estimate, threats.estimate_in_contact)
        return estimated if estimated.more_urgent_than(nearest) else nearest

    def _needed(self, threat: Threat, touches: bool = False) -> Evaluation:
        speed = threat.closing_speed
        if not speed > 0.0:
            if not touches:
                return NOTHING
            speed = 0.0
        elif not (touches or threat.ttc < math.inf):
            return NOTHING
        # As ``stopping_distance``, to the bit, without the call.
        needed = speed * self.reaction_time + speed * (speed / (2.0 * self.deceleration)) + self.margin
        return new(Evaluation, (threat.clearance, needed, threat))


@dataclass(frozen=True)
class PresentArc(Criterion):
    """Brake when the way that the vehicle is on now, without a plan, ends too soon.

    Where no path is planned, the present arc is a guess: the vehicle may steer. It compares the TTC on it with the
    time in which the vehicle needs the way ``v reaction_time + v^2 / (2 deceleration) + margin``, with more to spare
    than ``StoppingDistance``. With ``sharpest`` it compares the TTC on four arcs that the vehicle may turn to as well:
    half and all of that curvature to both sides, as far as tires hold it (10 m/s^2 of lateral acceleration). Along a
    planned path it compares the TTC on the present arc with ``threshold``: the vehicle may not be where it planned to
    be, and cannot leave its arc at once. It cannot see what moves by itself.

    Parameters
    ----------
    deceleration : float, default 4.0
        The deceleration to be content with, m/s^2, above 0.
    reaction_time : float, default 0.2
        The time from the decision until the brake acts, s, at least 0.
    margin : float, default 0.3
        The distance that is left when the vehicle stands, m, at least 0.
    threshold : float, default 0.2
        The threshold on the present arc where a path is planned, s, above 0.
    sharpest : float, default 0.0
        The curvature of the sharpest bend that the vehicle may turn into, 1/m, at least 0.

    Raises
    ------
    ValueError
        If a setting is out of its range.

    Examples
    --------
    >>> from ttc_fast import PresentArc
    >>> PresentArc().threshold
    0.2
    """

    deceleration: float = setting(4.0, BRAKING, "The deceleration to be content with where no path is planned.")
    reaction_time: float = setting(0.2, Number(unit="s", least=0.0), "The time from the decision until the brake acts.")
    margin: float = setting(0.3, Number(unit="m", least=0.0), "The distance that is left when the vehicle stands.")
    threshold: float = setting(
        0.2, TIME, "Along a planned path it brakes when the TTC on the present arc is below this."
    )
    sharpest: float = setting(
        0.0, Number(unit="1/m", least=0.0), "The curvature of the sharpest bend that the vehicle may turn into."
    )

    name: ClassVar[str] = "PresentArc"
    unit: ClassVar[str] = "s"
    needs: ClassVar[Needs] = Needs.ARC

    def __post_init__(self) -> None:
        check_fields(self)

    def evaluate(self, threats: Threats) -> Evaluation:
        if threats.arc is not None:
            return Evaluation(threats.arc.ttc, self.threshold, threats.arc)
        threat = threats.path or threats.beams
        if self.sharpest > 0.0 and threats.turn is not None and not (threat and threat.ttc <= threats.turn.ttc):
            threat = threats.turn
        if threat is None or not (threat.closing_speed > 0.0 and threat.ttc < math.inf):
            return NOTHING
        speed = threat.closing_speed
        needed = self.reaction_time + speed / (2.0 * self.deceleration) + self.margin / speed
        return Evaluation(threat.ttc, needed, threat)


@dataclass(frozen=True)
class RssDistance(Criterion):
    """Brake when the gap is less than RSS's safe longitudinal distance.

    The safe distance lets the vehicle accelerate during the response time and brake gently after it, while what is
    ahead brakes as hard as it can. What the path or the beams show is taken to stand; the speed of a car ahead comes
    from the estimate, which is evaluated even while the gap does not shrink. It cannot see anything lateral.

    Parameters
    ----------
    response_time : float, default 0.1
        The vehicle may accelerate for this long, s, at least 0.
    acceleration_max : float, default 2.0
        The greatest acceleration of the vehicle during the response time, m/s^2, at least 0.
    braking_min : float, default 6.0
        The deceleration with which the vehicle brakes at least, m/s^2, above 0.
    braking_max : float, default 8.0
        The deceleration with which the vehicle ahead brakes at most, m/s^2, above 0.

    Raises
    ------
    ValueError
        If a setting is out of its range.

    Notes
    -----
    [Shalev-Shwartz, Shammah, Shashua: On a Formal Model of Safe and Scalable Self-driving Cars, 2017, definition 1]

    Examples
    --------
    >>> from ttc_fast import RssDistance
    >>> RssDistance(response_time=0.2).braking_min
    6.0
    """

    response_time: float = setting(0.1, Number(unit="s", least=0.0), "The vehicle may accelerate for this long.")
    acceleration_max: float = setting(
        2.0, Number(unit="m/s^2", least=0.0), "The vehicle's greatest acceleration during the response time."
    )
    braking_min: float = setting(6.0, BRAKING, "The deceleration with which the vehicle brakes at least.")
    braking_max: float = setting(8.0, BRAKING, "The deceleration with which the one ahead brakes at most.")

    name: ClassVar[str] = "RssDistance"
    unit: ClassVar[str] = "m"
    needs: ClassVar[Needs] = Needs.NEAREST

    def __post_init__(self) -> None:
        check_fields(self)

    def evaluate(self, threats: Threats) -> Evaluation:
        threat, target = threats.path or threats.beams, threats.estimate
        nearest = NOTHING
        if threat is not None and threat.closing_speed > 0.0 and threat.ttc < math.inf:
            nearest = self._needed(threat, threat.closing_speed, 0.0)
        if target is None or threats.speed is None:
            return nearest
        closing = target.closing_speed
        if threats.estimate_in_contact and math.isnan(closing):
            closing = threats.speed  # what is in contact at an unknown speed is taken to stand
        if not math.isfinite(target.clearance + closing):
            return nearest
        estimated = self._needed(target, threats.speed, max(threats.speed - closing, 0.0))
        return estimated if estimated.more_urgent_than(nearest) else nearest

    def _needed(self, threat: Threat, rear: float, front: float) -> Evaluation:
        needed = rss_longitudinal_distance(
            rear,
            front,
            response_time=self.response_time,
            acceleration_max=self.acceleration_max,
            braking_min=self.braking_min,
            braking_max=self.braking_max,
        )
        return Evaluation(threat.clearance, needed, threat)
