"""From a frame to threats: the kernels find what is nearest in time, and the age of the data is taken off.

A frame is a scan, a cloud, or, where a controller has neither scanner nor path, an estimate. It is assessed by the
vehicle's motion; where that is not known, a scan is assessed by the range rate. Only what the criteria need is
computed.
"""

from __future__ import annotations

import math
import operator
from math import hypot
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from ttc_fast._core import NearestBatch, NearestPointBatch, RangeRate, ScanSweptPath, ScanTTC, SweptPath
from ttc_fast.brake.criteria import PresentArc, StoppingDistance
from ttc_fast.brake.types import STANDING, Needs, Source, Threat, Threats, new
from ttc_fast.status import Status

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from ttc_fast.brake.frame import Frame
    from ttc_fast.brake.types import Criterion, Motion


BEAMS, PATH = Source.BEAMS, Source.PATH  # a name is looked up faster than the member of an enumeration
UNKNOWN = frozenset({Status.WARMING_UP, Status.STALE, Status.INVALID})
"""The statuses of a range rate, and of an estimate without a TTC, that know no closing speed."""


SHORTEST = 1e-3
"""Points of a path that are nearer to the one before than this, in lengths of the vehicle, are in one place."""

GRIP = 10.0
"""The greatest lateral acceleration of a vehicle that turns, m/s^2: tires hold about their own weight."""

POINTS = 50
"""The number of points that a path which is a function is asked for."""

SOON = 0.3
"""In this time a vehicle that follows a path has turned to where the path leads, s."""

FEW = 20
"""A scan that has one beam in this many more or less, or is as much wider, is read by the beams of the range rate."""
COVERED = 16
"""So many readings do not all lie inside the outline of a vehicle that is only touched."""
BATCHES = frozenset({NearestBatch, NearestPointBatch})
"""The answers of kernels to several scans or clouds."""
GEOMETRY = ("angle_min", "angle_increment", "beams")


class ThreatAssessment:
    """The kernels of a controller, and which of them its criteria need.

    Parameters
    ----------
    scan, path, range_rate, horizon
        The arguments of ``BrakeController``.
    """

    def __init__(
        self,
        scan: ScanTTC | None,
        path: SweptPath | None,
        range_rate: RangeRate | None,
        horizon: float,
    ) -> None:
        needed = {"scan": (scan, ScanTTC), "path": (path, SweptPath), "range_rate": (range_rate, RangeRate)}
        for name, (value, kind) in needed.items():
            if value is not None and not isinstance(value, kind):
                raise TypeError(f"{name} must be a {kind.__name__}, got {type(value).__name__}")
        if range_rate is not None and scan is None:
            raise ValueError("range_rate needs a scan: it gives the closing speeds of beams")
        self.scan = scan
        self.path = path
        self.range_rate = range_rate
        self._rate_beams: NDArray[np.intp] | None = None
        """The beam of a scan for each beam of the range rate, and -1 where there is none; None where they are one."""
        if range_rate is not None and scan is not None and not is_same(scan, range_rate.scan):
            self._rate_beams = nearest_beams(scan, range_rate.scan)
        self._horizon = horizon
        self.scan_path = None if scan is None else path_of(scan, horizon)
        self._needs_beams = self._needs_path = self._needs_arc = True
        self._sharpest = 0.0
        self.stopping = StoppingDistance()
        """How the vehicle stops."""
        self.only_estimates = scan is None and path is None
        """Whether estimates are the only frames."""

    @property
    def outline(self) -> Any:
        """The outline of the vehicle, or None."""
        if self.scan_path is not None:
            return self.scan_path.scan.outline
        return None if self.path is None else self.path.outline

    @property
    def has_path(self) -> bool:
        """Whether threats on the path can be found: there is an outline."""
        return self.path is not None or self.scan_path is not None

    def check(self, criteria: Iterable[Criterion], deceleration: float) -> tuple[Criterion, ...]:
        """Return the criteria if they can be evaluated. From now on only what they need is computed.

        A ``StoppingDistance`` among them says how the vehicle stops; without one it is its default with this
        deceleration.
        """
        if isinstance(criteria, np.ndarray):
            raise TypeError(f"criteria must be a sequence of criteria, {_instead_of(criteria)}")
        try:
            criteria = tuple(criteria)
        except TypeError:
            raise TypeError(f"criteria must be a sequence of criteria, {_instead_of(criteria)}") from None
        if not criteria:
            raise ValueError("criteria must not be empty: nothing would ever brake")
        for criterion in criteria:
            if isinstance(criterion, type):
                raise TypeError(f"criteria must be objects, such as {criterion.__name__}(), got the class itself")
            if not (hasattr(criterion, "evaluate") and hasattr(criterion, "needs")):
                raise TypeError(f"criteria must have evaluate() and needs, as IttcThreshold has; got {criterion!r}")
            if criterion.needs in (Needs.PATH, Needs.ARC) and not self.has_path:
                raise ValueError(f"{criterion.name} needs an outline: give one to the scan, or give a path")
            if criterion.needs is Needs.BEAMS and self.scan is None:
                instead = "use EstimateThreshold for what a tracker follows"
                raise ValueError(f"{criterion.name} needs a scan: it evaluates beams; {instead}")
        stopping = [each for each in criteria if isinstance(each, StoppingDistance)]
        self.stopping = stopping[0] if stopping else StoppingDistance(deceleration)
        needs = {criterion.needs for criterion in criteria}
        self._needs_path = self.has_path and not needs.isdisjoint({Needs.PATH, Needs.NEAREST, Needs.ARC})
        self._needs_arc = Needs.ARC in needs
        self._sharpest = max((each.sharpest for each in criteria if isinstance(each, PresentArc)), default=0.0)
        # Every scan is assessed in one way at least, so that a blind scanner is noticed by a controller of estimates.
        self._needs_beams = Needs.BEAMS in needs or not (self._needs_path and self.scan_path is not None)
        return criteria

    def use_scan(self, scan: ScanTTC) -> None:
        """Read scans by another scanner from now on; the range rate goes on by angle."""
        scan_path = path_of(scan, self._horizon)
        if (scan_path is None) is not (self.scan_path is None):
            raise ValueError("scan must have an outline where the one before it has one, or none")
        if self.range_rate is not None:
            if not is_like(scan, self.range_rate.scan):
                self.range_rate = range_rate_by_angle(self.range_rate, scan)
            same = is_same(scan, self.range_rate.scan)
            self._rate_beams = None if same else nearest_beams(scan, self.range_rate.scan)
        self.scan, self.scan_path = scan, scan_path

    def _by_beams_of_rates(self, ranges: Any) -> Any:
        """Return a scan as the beams of the range rate would have measured it."""
        beams = self._rate_beams
        if beams is None:
            return ranges
        ranges = np.asarray(ranges)
        if self.scan is not None and len(ranges) != self.scan.beams:
            raise ValueError(f"ranges must have {self.scan.beams} beams, got {len(ranges)}")
        seen = ranges[beams]
        seen[beams < 0] = np.nan
        return seen

    def checked_path(self, path: Any, motion: Motion | None) -> NDArray[np.float64]:
        """Return the points of a planned path; a function of the way is asked for as far as the horizon."""
        if not self.has_path:
            raise ValueError("path needs an outline: give one to the scan, or give a path that reads points")
        if callable(path):
            horizon = self._horizon if self.path is None else self.path.horizon
            path = path(np.linspace(0.0, max(1.0, horizon * abs(motion.speed if motion else 0.0)), POINTS))
        try:
            points = np.ascontiguousarray(path, np.float64)
        except (TypeError, ValueError):
            raise TypeError(f"path must be points, of shape (N, 2), or a function of the way, got {path!r}") from None
        if points.ndim != 2 or points.shape[1] != 2 or len(points) < 2:
            raise ValueError(f"path must have shape (N, 2), N at least 2, got {points.shape}")
        if not np.isfinite(points).all():
            raise ValueError("path must be finite: some of its points are not")
        return points

    def assess_without_odometry(self, frame: Frame) -> Threats:
        """Return the threats of a frame by the range rate, which takes it up, or only whether anything is seen."""
        if self.range_rate is None or frame.is_cloud:
            # Nothing gives closing speeds. Whether anything is seen is found as for a vehicle that stands.
            seen = self.assess_along(frame, STANDING)
            return seen._replace(speed=None, beams=None, path=None, closing_speed_known=False)
        rates = self.range_rate.update(self._by_beams_of_rates(frame.readings), frame.stamp)
        known = rates.status not in UNKNOWN and rates.rated >= rates.unrated
        beams = self._threat(Source.RANGE_RATE, frame, rates) if known else None
        return Threats(None, beams, None, *estimated_threat(frame), rates.counts.valid, rates.status, known)

    def take_up(self, frame: Frame) -> None:
        """Let the range rate take up a frame that was assessed by motion, so that it is warm when odometry fails."""
        if self.range_rate is not None and frame.motion is not None and not frame.is_cloud:
            self.range_rate.update(self._by_beams_of_rates(frame.readings), frame.stamp, frame.motion.yaw_rate)

    def assess_along(
        self, frame: Frame, motion: Motion, along: NDArray[np.float64] | None = None, turns: bool = True
    ) -> Threats:
        """Return the threats of a frame to a vehicle of this motion, which may turn where it follows no path."""
        speed, yaw_rate, lateral_speed, _ = motion
        over_ground = hypot(speed, lateral_speed)
        readings = frame.readings
        kernel: Any = self.scan_path if self._needs_path else None
        seen: Any = None
        beams = path = arc = turn = estimate = None
        is_sure = False
        if frame.is_cloud:
            kernel = self.path
        elif self._needs_beams and self.scan is not None:
            seen = self.scan.nearest(readings, speed, yaw_rate, lateral_speed)
            beams = self._threat(BEAMS, frame, seen)
        if kernel is not None:
            if along is None or not leads(along, speed, self.outline):
                seen = kernel.nearest(readings, speed, yaw_rate, lateral_speed)
                if self._sharpest > 0.0 and turns and speed != 0.0:
                    turn = self._turn(frame, kernel, motion)
            else:
                if self._needs_arc:
                    arc = self.assess_along(frame, motion, turns=False).path
                over_ground = abs(speed)
                seen = kernel.nearest(readings, speed, 0.0, 0.0, path=along)
            path = self._threat(PATH, frame, seen, over_ground)
        elif seen is None:
            self._refuse(frame)
        if frame.estimate is not None:
            estimate, is_sure = estimated_threat(frame)
        counts, status = seen.counts, seen.status
        if status is Status.CONTACT and not frame.is_cloud and self._is_covered(counts):
            status = Status.NO_DATA
        return new(Threats, (over_ground, beams, path, estimate, is_sure, counts.valid, status, True, arc, turn))

    def _is_covered(self, counts: Any) -> bool:
        """Return whether all that a scan shows lies inside the outline: a hand, dirt, or an outline in centimetres."""
        hits = counts.valid
        if self.scan is not None and self.scan.too_close == "hit":
            hits += counts.too_close
        beyond = hits - counts.contact + counts.no_return + counts.beyond_limits
        return bool(beyond == 0 and hits >= COVERED)

    def assess_straying(self, frame: Frame, motion: Motion, threats: Threats) -> Threats:
        """Return the threats along a planned path, or what is too near on the present arc if the vehicle strays."""
        if frame.path is not None and strays(frame.path, motion, self.outline):
            arc = threats.arc or self.assess_along(frame, motion, turns=False).path
            if arc is not None and threats.path is not None and arc.ttc < threats.path.ttc:
                rule, speed = self.stopping, arc.closing_speed
                stops_in = rule.reaction_time + speed / (2.0 * rule.deceleration) + rule.margin / speed
                return threats._replace(path=arc) if arc.ttc < stops_in else threats
        return threats

    def _turn(self, frame: Frame, kernel: Any, motion: Motion) -> Threat:
        """Return the nearest threat on arcs that a vehicle may turn to: half and all of what wheels and tires allow."""
        speed, lateral_speed = motion.speed, motion.lateral_speed
        yaw_rate = min(self._sharpest * abs(speed), GRIP / abs(speed))
        yaw_rates = (share * yaw_rate for share in (-1.0, -0.5, 0.5, 1.0))
        arcs = (kernel.nearest(frame.readings, speed, each, lateral_speed) for each in yaw_rates)
        return self._threat(PATH, frame, min(arcs, key=operator.attrgetter("ttc")), motion.over_ground)

    def _threat(self, source: Source, frame: Frame, seen: Any, over_ground: float = 0.0) -> Threat:
        """Return what a kernel found nearest, at the time of the decision.

        The clearance of what the outline touches, whose source is PATH, is the way that is left. It closes at the
        vehicle's speed over ground.
        """
        age = frame.now - frame.stamp
        if type(seen) in BATCHES:
            self._refuse(frame)
        if frame.is_cloud:
            index, x, y = seen.index, seen.x, seen.y
            angle, distance = math.atan2(y, x), hypot(x, y)
        else:
            index, angle, distance = seen.beam, seen.angle, seen.range
            if index > 0:
                age -= index * frame.time_increment
        if age < 0.0:
            age = 0.0  # what has come was measured before
        ttc = seen.ttc - age
        if ttc < 0.0:
            ttc = 0.0
        if source is PATH:
            closing, clearance = over_ground, over_ground * ttc if over_ground > 0.0 else math.inf
        else:
            closing = seen.closing_speed
            clearance = max(seen.clearance - max(closing, 0.0) * age, 0.0)
        return new(Threat, (source, ttc, seen.status, index, angle, distance, clearance, closing, age))

    def _refuse(self, frame: Frame) -> NoReturn:
        """Raise because nothing reads a frame, or because it is several."""
        if frame.is_cloud:
            if self.path is None:
                raise ValueError("points need a path that reads them: BrakeController(path=SweptPath(outline))")
            raise ValueError("points must be one cloud, of shape (N, 2) or wider, got a batch of several")
        if self.scan is None:
            raise ValueError("ranges need a scan that reads them: BrakeController(scan=ScanTTC(...))")
        raise ValueError(f"ranges must be one scan, of shape (beams,), got shape {np.shape(frame.readings)}")

    def assess_estimate(self, frame: Frame) -> Threats:
        """Return the threats of a frame that is an estimate."""
        if frame.readings is not None:
            raise ValueError("ranges need a scan that reads them, and points need a path: give the controller one")
        threat, is_sure = estimated_threat(frame)
        status = Status.NO_DATA if threat is None else threat.status
        speed = None if frame.motion is None else frame.motion.over_ground
        # A tracker that warms up, or gets nothing new, knows no closing speed unless it predicts one.
        known = threat is None or threat.ttc < math.inf or status not in UNKNOWN
        return Threats(speed, None, None, threat, is_sure, 1, status, known)

    def reset(self) -> None:
        """Let the range rate forget what it has taken up."""
        if self.range_rate is not None:
            self.range_rate.reset()

    def state(self) -> Any:
        """Return the state of the range rate, or None without one."""
        return None if self.range_rate is None else self.range_rate.state()

    def restore(self, state: Any) -> None:
        """Let the range rate go on from a state."""
        if (state is None) is not (self.range_rate is None):
            raise ValueError("state must be that of a controller with a range_rate where this one has it, or without")
        if self.range_rate is not None:
            self.range_rate.restore(state)


def leads(path: NDArray[np.float64], speed: float, outline: Any) -> bool:
    """Return whether a path leads the way that the vehicle drives, as the kernel sees it.

    What it begins off the origin fades over two lengths of the vehicle, and points in one place are one.
    """
    if speed == 0.0:
        return False
    x_rear, x_front, y_right, y_left = outline
    size = max(x_front - x_rear, y_left - y_right)
    (x_off, y_off), way = path[0].tolist(), 0.0
    x_before, y_before = x_off, y_off
    for x, y in path[1:].tolist():
        way += hypot(x - x_before, y - y_before)
        x_before, y_before = x, y
        share = max(1.0 - way / (2.0 * size), 0.0)
        x_led = x - x_off * share
        if hypot(x_led, y - y_off * share) >= SHORTEST * size:
            return bool((x_led < 0.0) == (speed < 0.0))  # a speed may be a scalar of NumPy
    return False  # it leads nowhere, as that of a vehicle which has arrived


def strays(path: NDArray[np.float64], motion: Motion, outline: Any) -> bool:
    """Return whether the motion does not follow a path: soon it would be off it by more than the vehicle's width.

    Soon is ``SOON``, or two lengths of the vehicle where it is slow. A vehicle that drives along its path and steers a
    little late, or is a little off it, is not off by so much.
    """
    speed, yaw_rate, lateral_speed, _ = motion
    x_rear, x_front, y_right, y_left = outline
    over_ground = hypot(speed, lateral_speed)
    if over_ground == 0.0:
        return False
    way = max(SOON * over_ground, 2.0 * (x_front - x_rear))
    points = np.concatenate([np.zeros((1, 2)), path])
    ways = np.concatenate([np.zeros(1), np.hypot(*np.diff(points, axis=0).T).cumsum()])
    way = min(way, float(ways[-1]))
    turn = yaw_rate * way / over_ground
    ahead, aside = (math.sin(turn) / turn, (1.0 - math.cos(turn)) / turn) if abs(turn) > 1e-6 else (1.0, turn / 2.0)
    along, across = speed / over_ground * way, lateral_speed / over_ground * way
    x, y = along * ahead - across * aside, along * aside + across * ahead
    x_path, y_path = (float(np.interp(way, ways, points[:, axis])) for axis in (0, 1))
    return bool(hypot(x - x_path, y - y_path) > y_left - y_right)


def _instead_of(criteria: Any) -> str:
    """Return what was given instead of criteria, and where it goes."""
    named = {ScanTTC: "scan", SweptPath: "path", RangeRate: "range_rate"}.get(type(criteria))
    if named is not None:
        return f"got a {type(criteria).__name__}, which goes by its name: BrakeController({named}=...)"
    if isinstance(criteria, np.ndarray):
        scan = "and their scanner to the controller: BrakeController(scan=ScanTTC(...))"
        return f"got an array; ranges go to update(now, ranges=...), {scan}"
    listed = f"[{criteria}]" if hasattr(criteria, "evaluate") else "[IttcThreshold(1.5)]"
    return f"such as {listed}, got {criteria!r}"


def estimated_threat(frame: Frame) -> tuple[Threat | None, bool]:
    """Return the estimate at the time of the decision, and whether it is sure, as ``Threats`` has both."""
    estimate = frame.estimate
    if estimate is None or estimate.saw_nothing:
        return None, False
    _, ttc, ttc_interval, distance, closing, closing_interval, status, _ = estimate
    age = max(frame.now - estimate.stamp, 0.0)
    clearance = max(distance - max(closing, 0.0) * age, 0.0)
    if status is Status.CONTACT or distance <= 0.0:
        status, clearance = Status.CONTACT, 0.0
        is_sure = not (closing if closing_interval is None else closing_interval[1]) < 0.0
    else:
        is_sure = ttc < math.inf and (ttc_interval is None or ttc_interval[1] < math.inf)
    if status is None:
        status = Status.CLOSING if ttc < math.inf else Status.NOT_CLOSING
    threat = Threat(Source.ESTIMATE, max(ttc - age, 0.0), status, -1, math.nan, distance, clearance, closing, age)
    return threat, is_sure


def range_rate_by_angle(range_rate: RangeRate, scan: ScanTTC) -> RangeRate:
    """Return the range rate of another scanner with the same settings, which remembers the same readings by angle.

    Each beam takes over what the beam nearest in direction measured, if that is less than half an increment away.
    """
    before, state = range_rate.scan, range_rate.state()
    other = RangeRate(**(range_rate.__getnewargs_ex__()[1] | {"scan": scan}))
    if state["stamps"]:
        beams = nearest_beams(before, scan)
        carried = np.array(state["readings"])[:, beams]
        carried[:, beams < 0] = np.nan
        other.restore(state | {"beams": scan.beams, "readings": carried.tolist()})
    return other


def nearest_beams(scan: ScanTTC, other: ScanTTC) -> NDArray[np.intp]:
    """Return for each beam of another scanner the beam of this one that is nearest in direction.

    It is -1 where the nearest one is more than half an increment away. A scanner of one beam has no increment, and that
    beam is nearest to its own direction alone.
    """
    angles = scan.angles
    if len(angles) == 1:
        return np.where(other.angles == angles[0], 0, -1)
    increment = (angles[-1] - angles[0]) / (len(angles) - 1)
    step, along = abs(increment), (other.angles - angles[0]) * math.copysign(1.0, increment)
    beams = (np.mod(along + step / 2.0, 2.0 * math.pi) / step).astype(np.intp)
    return np.where(beams < len(angles), beams, -1)


def is_same(scan: ScanTTC, other: ScanTTC) -> bool:
    """Return whether the beams of two scanners are the same."""
    return scan is other or (scan.beams == other.beams and np.array_equal(scan.angles, other.angles))


def is_like(scan: ScanTTC, other: ScanTTC) -> bool:
    """Return whether two scanners differ by their beams alone, and have nearly as many over nearly as wide a view."""
    width, other_width = (abs(each.angles[-1] - each.angles[0]) for each in (scan, other))
    if max(abs(scan.beams - other.beams) / other.beams, abs(width / (other_width or 1.0) - 1.0)) > 1.0 / FEW:
        return False
    one, two = (dict(each.__getnewargs_ex__()[1]) for each in (scan, other))
    return all(repr(one[name]) == repr(two[name]) for name in one if name not in GEOMETRY)


def path_of(scan: ScanTTC, horizon: float) -> ScanSweptPath | None:
    """Return the swept path of a scanner's vehicle, or None when the scanner has no outline."""
    try:
        ScanSweptPath(scan)
    except ValueError:
        return None
    return ScanSweptPath(scan, horizon=horizon)  # a wrong horizon is an error, and not taken for a missing outline
