"""From the frames of a log to rows. Each kind of log has a pipeline: kernel or tracker, then the brake, then the row.

``Scans``: the brake assesses each scan, by what its beams or the path of the vehicle run into.
``Clouds``: a tracker follows what is ahead, and the brake evaluates its estimates. With an outline and odometry, or a
speed, the brake assesses the points on the path of the vehicle instead, as a node does, and the row is about these.
``Distances``: a tracker follows the distances, and the brake evaluates its estimates.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ttc_fast._core import CloudTracker, DistanceTracker, Gate, Minimum, SweptPath, robust_min_x
from ttc_fast._settings import option
from ttc_fast.brake import Estimate, EstimateThreshold, Motion, RssDistance
from ttc_fast.brake.types import Needs
from ttc_fast.configuration import ConfigurationError
from ttc_fast.logs.log import REP_103, forward_left_up
from ttc_fast.replay.controller import ReplayController, motion_of
from ttc_fast.replay.own_points import FRAMES, OwnPoints
from ttc_fast.replay.road import find_road
from ttc_fast.replay.row import Row
from ttc_fast.replay.settings import GATE_OPTIONS, SCANNER
from ttc_fast.replay.summary import frames_of
from ttc_fast.sensors.clouds import FAR_AWAY, Placement, only_heights
from ttc_fast.sensors.oddities import Tally
from ttc_fast.sensors.scans import Geometry, Repeats, Scan, ScanKernels
from ttc_fast.status import Status

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ttc_fast._core import ScanTTC, TrackedTTC
    from ttc_fast.brake import Decision
    from ttc_fast.logs import CloudFrame, CloudLog, DistanceFrame, DistanceLog, Lidar, ScanFrame, ScanLog
    from ttc_fast.logs.log import Axes
    from ttc_fast.replay.settings import Settings

NO_INTERVAL = (math.nan, math.nan)
OF_ESTIMATES = (EstimateThreshold, RssDistance)
"""The criteria that are about estimates: for them the tracker is asked beside the path as well."""
TOLERANCE = 0.01
"""Where the vehicle ends may be said twice with this difference, m."""
LEAST_CLOSING = 0.1
"""A body that certainly closes at more than this is not the vehicle itself, m/s."""


class Scans:
    """The pipeline of a log of scans.

    Parameters
    ----------
    log : ScanLog
        The log.
    settings : Settings
        The settings of scanner and brake.

    Raises
    ------
    ConfigurationError
        If a setting makes no sense.
    """

    name: ClassVar[str] = "a log of scans"
    uses: ClassVar[tuple[str, ...]] = SCANNER
    assumed: ClassVar[str] = ""

    def __init__(self, log: ScanLog, settings: Settings) -> None:
        self._configuration = settings.configured()
        recorded = {name: value for name, value in vars(log.scanner).items() if value is not None}
        self._geometry = Geometry(**{name: recorded.pop(name) for name in Geometry._fields})
        scanner = {**recorded, **self._configuration.scan}
        self._configuration = replace(self._configuration, scan=scanner)
        self._kernels = ScanKernels(self._configuration)
        scan = self._kernels.of(self._geometry)
        self.outline, self.mount = scanner.get("outline"), tuple(scanner.get("mount", (0.0, 0.0, 0.0)))
        self.about = about_scans(log, self.outline, self.mount)
        self.rated = False
        """Whether the range rate gave closing speeds."""
        if self._configuration.range_rate is None and not log.always_has_speed:
            self._configuration = replace(self._configuration, range_rate={})  # as in a node
        self.controller = ReplayController(self._configuration, scan=scan)
        self._tally = Tally()
        self._repeats = Repeats("scans", self._tally, settings.sensor_timeout)
        self._row: Row | None = None

    @property
    def odd(self) -> list[str]:
        """What was odd about the scans, a sentence for each kind."""
        return self._tally.sentences()

    def scan_of(self, frame: ScanFrame) -> ScanTTC:
        """Return the scanner of a frame."""
        return self._kernels.of(frame.geometry or self._geometry)

    def _scan(self, frame: ScanFrame) -> Scan:
        return Scan(frame.geometry or self._geometry, frame.time_increment, frame.ranges)

    def row(self, number: int, frame: ScanFrame) -> Row:
        """Return the row of a frame."""
        stamp, speed = frame.stamp, math.nan if frame.speed is None else frame.speed
        self.controller.reset_if_set_back(stamp)
        self.rated = self.rated or frame.speed is None
        if self._repeats.found(frame.ranges, stamp) and self._row is not None:
            decision = self.controller.decide(stamp, motion_of(frame))
            return repeated_row(self._row, number, stamp, speed, decision)
        data = self._kernels.frame(self.controller.brake, self._scan(frame))
        decision = self.controller.decide(stamp, motion_of(frame), stamp=stamp, **data)
        self._row = assessed_row(number, stamp, speed, decision)
        return self._row


class Clouds:
    """The pipeline of a log of clouds.

    Parameters
    ----------
    log : CloudLog
        The log.
    settings : Settings
        The settings of gate and brake.

    Raises
    ------
    ConfigurationError
        If a setting makes no sense.
    """

    name: ClassVar[str] = "a log of clouds"
    uses: ClassVar[tuple[str, ...]] = ("mount", "outline", *GATE_OPTIONS)
    rated: ClassVar[bool] = False

    def __init__(self, log: CloudLog, settings: Settings) -> None:
        scanner = settings.of_scanner
        recorded = getattr(log, "mount", None) or (0.0, 0.0, 0.0)
        self.outline, self.mount = scanner.get("outline"), tuple(scanner.get("mount", recorded))
        lidar, road = log.lidar, ""
        if lidar.sensor_height is None and not settings.says_heights:
            lidar, road = find_road(log, settings)
        self.lidar = with_bumper(lidar, self.outline, self.mount, settings.log_options.get("front_offset"))
        self.gate = settings.gate_of(self.lidar)
        self._about = [("gate", bounds_of(self.gate))]
        sensor_height = self.lidar.sensor_height
        self._own_points = None if sensor_height is None else OwnPoints(sensor_height)
        if road:
            self._about.insert(0, ("road", road))
        mounted = getattr(log, "mounted", "")
        if mounted and "mount" not in scanner:
            x, y, yaw = self.mount
            self._about.insert(0, ("lidar", f"at x {x:g} m, y {y:g} m, yaw {yaw:g} rad, {mounted}"))
        assumes = self.lidar.vehicle_reach is None and not settings.says_where_gate_begins
        reach = assumed_reach(self.lidar) if assumes else ""
        height = "" if settings.says_heights else assumed_height(log)
        self._within: Gate | None = None
        if assumes and self.lidar.own_reach > 0.0:
            self._within = settings.gate_within(self.lidar)
        self._own_frames, self._own_distance = 0, math.nan
        said = None if settings.says_axes else getattr(log, "placement", None)
        self.placement = placement_of(said, scanner.get("mount", recorded), self.gate.axes, "mount" in scanner)
        """Where stored points are in the frame of the vehicle; None where they are stored so."""
        self._turns = self.placement is not None and not is_axes(self.placement.turn, self.gate.axes)
        if self._turns:
            self.gate = with_axes(self.gate, REP_103)
            self._within = self._within and with_axes(self._within, REP_103)
        known_reach = settings.says_where_gate_begins or log.lidar.vehicle_reach is not None
        self._own_reach = self.gate.x[0] if known_reach else 0.0
        """How far ahead of the lidar the points of the vehicle itself reach, where that is said, m."""
        self._begin_tracking()
        self.path = self._path_of(log)
        self._tally = Tally()
        self._repeats = Repeats("clouds", self._tally, settings.sensor_timeout)
        configuration, instead = settings.for_estimates(path=self.path is not None)
        if self.path is None and self.outline is not None:
            for each in configuration.criteria or ():
                if each.needs is Needs.PATH:
                    raise ConfigurationError(f"{each.name} needs the speed: {option('speed')} says it")
        self.assumed = "; ".join(filter(None, (height, reach, instead)))
        self.controller = ReplayController(configuration, path=self.path)
        criteria = self.controller.criteria
        self._estimates = self.path is None or any(isinstance(each, OF_ESTIMATES) for each in criteria)
        start = self.lidar.front_offset
        on_path = None if self.path is None else self._estimates
        self._about.append(("distance", about_distances(start, self.outline, on_path)))
        self._row: Row | None = None

    def _path_of(self, log: CloudLog) -> SweptPath | None:
        """Return the path by which clouds are assessed where there are an outline and odometry or a speed."""
        try:
            path = None if self.outline is None else SweptPath(self.outline)
        except (ValueError, TypeError) as error:
            raise ConfigurationError(f"outline: {error}") from None
        return path if log.has_speed else None

    def _begin_tracking(self) -> None:
        self._tracker = CloudTracker(self.gate, front_offset=self.lidar.front_offset)
        self._near = None if self._within is None else CloudTracker(self._within)

    def row(self, number: int, frame: CloudFrame) -> Row:
        """Return the row of a frame."""
        stamp, points = frame.stamp, self._turned(frame.points)
        if self.controller.reset_if_set_back(stamp):
            self._begin_tracking()
        if self._own_points is not None and self._own_points.frames < FRAMES:
            self._own_points.add(forward_left_up(points, self.gate.axes))
        tracked, gate, repeated = None, self.gate, False
        data: dict[str, Any] = {}
        if self._estimates:
            tracked, gate = self._track(points, stamp)
            data["estimate"] = Estimate.of(tracked, stamp)
        if self.path is not None:
            cloud = self.obstacles(frame.points)
            repeated = self._repeats.found(cloud, stamp)
            if not repeated:
                data |= {"points": cloud, "stamp": stamp}
        decision = self.controller.decide(stamp, motion_of(frame), **data)
        plain = robust_min_x(points, gate=gate, estimator=Minimum())
        nearest = max(plain.nearest_x - self.lidar.front_offset, 0.0)
        speed = math.nan if frame.speed is None else frame.speed
        if tracked is not None:
            row = tracked_row(number, stamp, tracked, frame.speed, decision)
        elif repeated and self._row is not None:
            row = repeated_row(self._row, number, stamp, speed, decision)
        else:
            row = assessed_row(number, stamp, speed, decision)
        self._row = row._replace(valid=plain.candidates, nearest=nearest)
        return self._row

    def _track(self, points: NDArray[Any], stamp: float) -> tuple[TrackedTTC, Gate]:
        """Return what a tracker says of a cloud, and in which gate."""
        tracked, gate = self._tracker.update(points, stamp), self.gate
        if self._near is not None and self._within is not None:
            near = self._near.update(points, stamp)
            if tracked.status is Status.CLEAR or comes_closer(near, tracked):
                tracked, gate = near, self._within
        own = self._tracker.own_vehicle
        if own is not None:
            self._own_frames, self._own_distance = self._own_frames + 1, own
        return tracked, gate

    @property
    def about(self) -> list[tuple[str, str]]:
        """What the numbers rest on, a line each."""
        own = "" if self._own_points is None else self._own_points.text(self.gate)
        return [*self._about, *([("own points", own)] if own else [])]

    @property
    def odd(self) -> list[str]:
        """What was odd about the clouds, a sentence for each kind."""
        odd = self._tally.sentences()
        if not self._own_frames:
            return odd
        seen = f"the gate holds the vehicle itself, {self._own_distance:.2f} m ahead of the lidar"
        how = f"{option('front_offset')} says where the vehicle ends, or {option('gate_x')}"
        return [f"{seen}: it was passed over in {frames_of(self._own_frames)}; {how}", *odd]

    def _turned(self, points: NDArray[Any]) -> NDArray[Any]:
        """Return the points of the lidar as the gate looks at them: forward is where the vehicle drives."""
        if not self._turns or self.placement is None:
            return points
        turned = self.placement.turned(points)
        if self.gate.intensity is None:
            return turned
        intensity = points["intensity"] if points.dtype.names else points[..., 3]
        return np.column_stack([turned, intensity.ravel()])

    def obstacles(self, points: NDArray[Any]) -> NDArray[Any]:
        """Return the points in the vehicle frame, as a node has them, of which those at the heights of the gate count.

        The others, and those of the vehicle itself where it is said how far it reaches, are moved far away.
        """
        placed = self.placement
        x, y, z = (0.0, 0.0, 0.0) if placed is None else placed.shift
        low, high = self.gate.z or (-math.inf, math.inf)
        cloud = only_heights(points if placed is None else placed.placed(points), low + z, high + z)
        if self._own_reach > 0.0:
            ahead, (right, left) = cloud[:, 0] - x, self.gate.y
            own = (ahead >= 0.0) & (ahead < self._own_reach) & (cloud[:, 1] >= right + y) & (cloud[:, 1] <= left + y)
            cloud[own & cloud.any(axis=1), :2] = FAR_AWAY
        return cloud


class Distances:
    """The pipeline of a table of distances.

    Parameters
    ----------
    log : DistanceLog
        The table.
    settings : Settings
        The settings of the brake.
    """

    name: ClassVar[str] = "a table of distances"
    uses: ClassVar[tuple[str, ...]] = ()
    odd: ClassVar[tuple[str, ...]] = ()
    outline: ClassVar[None] = None
    rated: ClassVar[bool] = False

    def __init__(self, log: DistanceLog, settings: Settings) -> None:
        self.about = [("distance", f"column {log.column}, in {log.unit}")]
        self._tracker = DistanceTracker()
        configuration, self.assumed = settings.for_estimates(path=False)
        self.controller = ReplayController(configuration)

    def row(self, number: int, frame: DistanceFrame) -> Row:
        """Return the row of a frame."""
        stamp = frame.stamp
        if self.controller.reset_if_set_back(stamp):
            self._tracker = DistanceTracker()
        tracked = self._tracker.update(frame.distance, stamp)
        motion = None if frame.speed is None else Motion(frame.speed)
        decision = self.controller.decide(stamp, motion, estimate=Estimate.of(tracked, stamp))
        return tracked_row(number, stamp, tracked, frame.speed, decision)


def assessed_row(number: int, stamp: float, speed: float, decision: Decision) -> Row:
    """Return the row of a decision on a new scan, or on a new cloud by the path."""
    command, reason, criterion, threats = decision.command, decision.reason, decision.criterion, decision.threats
    nearest = None if threats is None else threats.path or threats.beams
    if threats is None or nearest is None or criterion is None:
        status = decision.status
        assert status is not None
        return Row(number, stamp, math.nan, math.nan, math.inf, status, command, reason, speed=speed)
    return Row(
        number,
        stamp,
        distance=math.inf if nearest.status is Status.CLEAR else nearest.clearance,
        closing_speed=nearest.closing_speed,
        ttc=nearest.ttc,
        status=nearest.status,
        command=command,
        reason=reason,
        speed=speed,
        valid=threats.returns,
        criterion=criterion.name,
        value=decision.value,
        threshold=decision.threshold,
        beam=nearest.index,
        range=nearest.range,
        angle=nearest.angle,
    )


def repeated_row(before: Row, number: int, stamp: float, speed: float, decision: Decision) -> Row:
    """Return the row of a frame whose readings are those of the row before, to the bit."""
    command, reason = decision.command, decision.reason
    return before._replace(frame=number, stamp=stamp, command=command, reason=reason, speed=speed)


def tracked_row(number: int, stamp: float, tracked: TrackedTTC, speed: float | None, decision: Decision) -> Row:
    """Return the row of a tracker's result, or of what is on the path where that comes first."""
    path, criterion = None if decision.threats is None else decision.threats.path, decision.criterion
    decided: dict[str, Any] = {"command": decision.command, "reason": decision.reason}
    decided["speed"] = math.nan if speed is None else speed
    if criterion is not None:
        decided |= {"criterion": criterion.name, "value": decision.value, "threshold": decision.threshold}
    if path is not None:
        decided |= {"beam": path.index, "range": path.range, "angle": path.angle}
        if path.ttc < tracked.ttc:
            return Row(number, stamp, path.clearance, path.closing_speed, path.ttc, path.status, **decided)
    decided["closing_low"], decided["closing_high"] = tracked.closing_speed_interval or NO_INTERVAL
    decided["ttc_low"], decided["ttc_high"] = tracked.ttc_interval or NO_INTERVAL
    return Row(number, stamp, tracked.distance, tracked.closing_speed, tracked.ttc, tracked.status, **decided)


def placement_of(said: Placement | None, mount: Any, axes: Axes, by_user: bool) -> Placement | None:
    """Return where stored points are in the vehicle frame: by the transforms of the log, or by axes and mount.

    ``said`` is what the transforms say, which a mount of the user replaces. It is None where points are stored so.
    """
    if said is not None and not by_user:
        return said
    x, y, yaw = mount
    stored, cos, sin = stored_axes(axes), math.cos(yaw), math.sin(yaw)
    if (x, y, yaw) == (0.0, 0.0, 0.0) and axes == REP_103:
        return None
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return Placement(turn @ stored, np.array([x, y, 0.0]))


def stored_axes(axes: Axes) -> NDArray[np.float64]:
    """Return the rotation that turns stored points into forward, left and up."""
    return np.array([[(-1.0 if axis[0] == "-" else 1.0) * (axis[-1] == name) for name in "xyz"] for axis in axes])


def is_axes(turn: NDArray[np.float64], axes: Axes) -> bool:
    """Return whether a rotation only says which stored coordinates are forward, left and up."""
    return bool(np.allclose(turn, stored_axes(axes), rtol=0.0, atol=1e-9))


def with_axes(gate: Gate, axes: Axes) -> Gate:
    """Return a gate with the same bounds on points of other axes."""
    return Gate(**(gate.__getnewargs_ex__()[1] | {"axes": axes}))


def with_bumper(lidar: Lidar, outline: Any, mount: Any, said: float | None) -> Lidar:
    """Return the lidar with the distance to the front of the outline, if there is one, whatever the log says.

    ``said`` is the ``front_offset`` of the user, which must not contradict the outline.
    """
    if outline is None:
        return lidar
    offset = max(outline[1] - mount[0], 0.0)
    if said is not None and abs(said - offset) > TOLERANCE:
        where = f"its front is {offset:g} m ahead of the lidar, which is at x {mount[0]:g} m"
        raise ConfigurationError(
            f"outline: {where}, and {option('front_offset')} says {said:g} m; leave one of them out, or say where the "
            f"lidar is with {option('mount')}"
        )
    return replace(lidar, front_offset=offset, vehicle_reach=max(lidar.vehicle_reach or 0.0, offset))


def comes_closer(near: TrackedTTC, ahead: TrackedTTC) -> bool:
    """Whether a body that was taken for the vehicle itself comes closer for certain, and before what is ahead."""
    interval = near.closing_speed_interval
    return interval is not None and interval[0] > LEAST_CLOSING and near.ttc < ahead.ttc


def assumed_height(log: CloudLog) -> str:
    """Say that the height of the lidar is that of the format's usual car, where neither log nor user says it."""
    usual = getattr(log, "height_of", "")
    how = f"say it with {option('sensor_height')}"
    return usual and f"the lidar is {log.lidar.sensor_height:g} m above the road, as in {usual}: {how}"


def assumed_reach(lidar: Lidar) -> str:
    """Say which points count where it is not known where the vehicle ends."""
    counts = "points count from the lidar on"
    if lidar.sensor_height is not None:
        within = f"what is nearer than {lidar.own_reach:.3g} m, 1.5 times the height of the lidar, is taken for the"
        counts = f"{within} vehicle itself unless it comes closer or nothing else is ahead"
    how = f"{option('front_offset')}, {option('outline')} or {option('gate_x')}"
    return f"{counts}, as it is not known where the vehicle ends: say it with {how}"


def about_scans(log: ScanLog, outline: Any, mount: tuple[float, ...]) -> list[tuple[str, str]]:
    """Return the lines of a summary that say what the numbers of scans rest on."""
    x, y, yaw = mount
    scanner = f"{log.scanner.beams} beams, at x {x:g} m, y {y:g} m, yaw {yaw:g} rad"
    mounted = getattr(log, "mounted", "")
    scanner += f", {mounted}" if mounted else ""
    if outline is None:
        problem = "from the scanner, so TTC is too long by (scanner to edge of the vehicle) / closing speed"
        return [("scanner", scanner), ("distance", f"{problem}; {option('outline')} says where the vehicle ends")]
    return [("scanner", scanner), ("distance", from_outline(outline))]


def bounds_of(gate: Gate) -> str:
    """Return the bounds of a gate, for people."""
    bounds = {"x": gate.x, "y": gate.y, "z": gate.z, "intensity": gate.intensity}
    return ", ".join(f"{name} {low:g} to {high:g}" for name, bound in bounds.items() if bound for low, high in [bound])


def about_distances(front_offset: float, outline: Any, on_path: bool | None) -> str:
    """Say where the distances of clouds begin. ``on_path`` is None without a path, True if a tracker decides too."""
    if outline is None:
        if front_offset:
            return f"from the bumper, {front_offset:g} m ahead of the lidar"
        too_long = "from the lidar, so TTC is too long by (lidar to bumper) / closing speed"
        return f"{too_long}; {option('front_offset')} says how far that is"
    if on_path is None:
        return f"from the front of the outline, {front_offset:g} m ahead of the lidar"
    along = f"along the path, {from_outline(outline)}"
    return f"{along}; from its front to what the tracker follows, where that comes first" if on_path else along


def from_outline(outline: Any) -> str:
    """Say where the outline is."""
    rear, front, right, left = outline
    return f"from the outline, x {rear:g} to {front:g} m, y {right:g} to {left:g} m"
