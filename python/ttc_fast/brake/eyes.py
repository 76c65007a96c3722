"""How a controller looks: frames to sights, by the kernels that the criteria need and no others."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ttc_fast._core import NearestPointBatch, RangeRate, ScanSweptPath, ScanTTC, SweptPath
from ttc_fast.brake.scene import Needs, Threats
from ttc_fast.brake.sight import STANDING, Source, Threat
from ttc_fast.status import Status

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ttc_fast.brake.scene import Criterion
    from ttc_fast.brake.sight import Estimate, Motion


@dataclass(slots=True)
class Frame:
    """What is to be looked at."""

    now: float
    stamp: float
    ranges: Any
    points: Any
    estimate: Estimate | None


PATH = Source.PATH  # the look-up of an enum's member takes longer than that of a name
CANNOT_TELL = frozenset({Status.WARMING_UP, Status.STALE, Status.INVALID})
"""What a range rate says while it knows none."""


class ThreatAssessment:
    """The kernels of a controller.

    Parameters
    ----------
    scan, path, range_rate, time_increment, horizon
        As ``BrakeController`` takes them.
    """

    def __init__(
        self,
        scan: ScanTTC | None,
        path: SweptPath | None,
        range_rate: RangeRate | None,
        time_increment: float,
        horizon: float,
    ) -> None:
        needed = {"scan": (scan, ScanTTC), "path": (path, SweptPath), "range_rate": (range_rate, RangeRate)}
        for name, (value, kind) in needed.items():
            if value is not None and not isinstance(value, kind):
                raise TypeError(f"{name} must be a {kind.__name__}, got {type(value).__name__}")
        if range_rate is not None and scan is None:
            raise ValueError("range_rate needs a scan: it tells the closing speeds of beams")
        self._scan = scan
        self._scan_path = None if scan is None else path_of(scan, horizon)
        self._path = path
        self._range_rate = range_rate
        self._time_increment = float(time_increment)
        self._wants_beams = self._wants_path = True
        self.only_estimates = scan is None and path is None
        """Whether there is nothing to look with but what others estimate."""

    @property
    def sees_path(self) -> bool:
        """Whether anything can be judged along the path."""
        return self._path is not None or self._scan_path is not None

    def check(self, criteria: Iterable[Criterion]) -> tuple[Criterion, ...]:
        """Return the criteria, if they can be judged; from now on only what they need is computed."""
        try:
            criteria = tuple(criteria)
        except TypeError:
            raise TypeError(f"criteria must be a sequence of criteria, got {criteria!r}") from None
        if not criteria:
            raise ValueError("criteria must not be empty: nothing would ever brake")
        for criterion in criteria:
            if isinstance(criterion, type):
                raise TypeError(f"criteria must be objects, such as {criterion.__name__}(), got the class itself")
            if not (hasattr(criterion, "evaluate") and hasattr(criterion, "needs")):
                raise TypeError(f"criteria must have evaluate() and needs, as IttcThreshold has; got {criterion!r}")
            if criterion.needs is Needs.PATH and not self.sees_path:
                raise ValueError(f"{criterion.name} needs an outline: give one to the scan, or give a path")
            if criterion.needs is Needs.BEAMS and self._scan is None:
                raise ValueError(f"{criterion.name} needs a scan: it judges beams")
        wanted = {criterion.needs for criterion in criteria}
        self._wants_path = self.sees_path and not wanted.isdisjoint({Needs.PATH, Needs.NEAREST})
        # A scan is looked at in one way at least, whoever asks: a blind scanner is to be noticed.
        assesses_path = self._wants_path and self._scan_path is not None
        self._wants_beams = Needs.BEAMS in wanted or not assesses_path
        return criteria

    def assess(self, frame: Frame, motion: Motion | None) -> Threats:
        """Look at a new frame: by the vehicle's motion, or by range rate where that is not known."""
        if self.only_estimates:
            return self._estimate_alone(frame, motion)
        rated = None
        if self._range_rate is not None and frame.ranges is not None:
            rated = self._range_rate.update(frame.ranges, frame.stamp, 0.0 if motion is None else motion.yaw_rate)
        if motion is not None:
            return self.assess_along(frame, motion)
        if rated is None:
            return self._without_motion(frame)
        known = rated.status not in CANNOT_TELL and rated.rated >= rated.unrated
        threat = self._beam_threat(Source.RANGE_RATE, frame, rated) if known else None
        return Threats(None, threat, None, *estimated_threat(frame), rated.counts.valid, rated.status, known)

    def assess_along(self, frame: Frame, motion: Motion) -> Threats:
        """Look at a frame as a vehicle that moves so."""
        beams = path = None
        seen: Any = None
        speed, yaw_rate, lateral_speed, _ = motion
        over_ground = math.hypot(speed, lateral_speed)
        if frame.points is not None:
            if self._path is None:
                raise ValueError("points need a path that reads them: BrakeController(path=SweptPath(outline))")
            seen = self._path.nearest(frame.points, speed, yaw_rate, lateral_speed)
            if type(seen) is NearestPointBatch:
                raise ValueError("points must be one cloud, of shape (N, 2) or wider, got a batch of several")
            angle, distance = math.atan2(seen.y, seen.x), math.hypot(seen.x, seen.y)
            path = on_the_way(seen, seen.index, angle, distance, over_ground, self._age(frame))
        else:
            if self._scan is None:
                raise ValueError("ranges need a scan that reads them: BrakeController(scan=ScanTTC(...))")
            if self._wants_beams:
                seen = self._scan.nearest(frame.ranges, speed, yaw_rate, lateral_speed)
                beams = self._beam_threat(Source.BEAMS, frame, seen)
            if self._wants_path and self._scan_path is not None:
                seen = self._scan_path.nearest(frame.ranges, speed, yaw_rate, lateral_speed)
                beam = seen.beam
                path = on_the_way(seen, beam, seen.angle, seen.range, over_ground, self._age(frame, beam))
        estimate, sure = (None, False) if frame.estimate is None else estimated_threat(frame)
        return Threats(over_ground, beams, path, estimate, sure, seen.counts.valid, seen.status, True)

    def _estimate_alone(self, frame: Frame, motion: Motion | None) -> Threats:
        """Take the estimate for all there is to see."""
        if frame.ranges is not None or frame.points is not None:
            raise ValueError("ranges need a scan that reads them, and points need a path: give the controller one")
        threat, sure = estimated_threat(frame)
        status = Status.NO_DATA if threat is None else Status.CLEAR
        speed = None if motion is None else motion.over_ground
        return Threats(speed, None, None, threat, sure, 1, status, True)

    def _without_motion(self, frame: Frame) -> Threats:
        """Look whether there is anything to see at all, as a vehicle that stands."""
        return self.assess_along(frame, STANDING)._replace(speed=None, beams=None, path=None, judged=False)

    def _beam_threat(self, source: Source, frame: Frame, seen: Any) -> Threat:
        """Return the nearest beam at the time of the decision."""
        closing, age = seen.closing_speed, self._age(frame, seen.beam)
        ttc, clearance = max(seen.ttc - age, 0.0), max(seen.clearance - max(closing, 0.0) * age, 0.0)
        return Threat(source, ttc, seen.status, seen.beam, seen.angle, seen.range, clearance, closing, age)

    def _age(self, frame: Frame, beam: int = -1) -> float:
        """Return how old a frame, or a beam of it, is at the time of the decision, s."""
        age = frame.now - frame.stamp - (beam * self._time_increment if beam > 0 else 0.0)
        return age if age > 0.0 else 0.0  # what has come was measured before

    def state(self) -> Any:
        """Return what the range rate remembers."""
        return copy.deepcopy(self._range_rate)

    def restore(self, state: Any) -> None:
        """Let the range rate go on from there."""
        if type(state) is not type(self._range_rate):
            raise TypeError("state is of a controller with another range_rate")
        self._range_rate = copy.deepcopy(state)


def on_the_way(seen: Any, index: int, angle: float, distance: float, speed: float, age: float) -> Threat:
    """Return what will be touched first, at the time of the decision; its clearance is what is left of the way."""
    ttc = seen.ttc - age
    ttc = ttc if ttc > 0.0 else 0.0
    return Threat(PATH, ttc, seen.status, index, angle, distance, speed * ttc if speed > 0.0 else math.inf, speed, age)


def estimated_threat(frame: Frame) -> tuple[Threat | None, bool]:
    """Return the estimate at the time of the decision, and whether it is sure; see ``Threats``."""
    estimate = frame.estimate
    if estimate is None or estimate.saw_nothing:
        return None, False
    _, ttc, ttc_interval, distance, closing, closing_interval, status = estimate
    age = max(frame.now - estimate.stamp, 0.0)
    clearance = max(distance - max(closing, 0.0) * age, 0.0)
    if status is Status.CONTACT or distance <= 0.0:
        status, clearance = Status.CONTACT, 0.0
        sure = not (closing if closing_interval is None else closing_interval[1]) < 0.0
    else:
        sure = ttc < math.inf and (ttc_interval is None or ttc_interval[1] < math.inf)
    if status is None:
        status = Status.CLOSING if ttc < math.inf else Status.NOT_CLOSING
    threat = Threat(Source.ESTIMATE, max(ttc - age, 0.0), status, -1, math.nan, distance, clearance, closing, age)
    return threat, sure


def path_of(scan: ScanTTC, horizon: float) -> ScanSweptPath | None:
    """Return the swept path of a scanner's vehicle; None when it has no outline."""
    try:
        ScanSweptPath(scan)
    except ValueError:
        return None
    return ScanSweptPath(scan, horizon=horizon)  # a horizon that is none is an error of its own
