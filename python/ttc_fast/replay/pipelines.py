"""From the frames of a log to rows. Each kind of log has a pipeline: kernel or tracker, then the brake, then the row.

``Scans``: the brake assesses each scan, by what its beams or the path of the vehicle run into.
``Clouds``: a tracker follows what is ahead, and the brake evaluates its estimates. With an outline and a speed, the
brake assesses the points on the path of the vehicle as well.
``Distances``: a tracker follows the distances, and the brake evaluates its estimates.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ttc_fast._core import CloudTracker, DistanceTracker, Minimum, SweptPath, robust_min_x
from ttc_fast._settings import option
from ttc_fast.brake import Estimate, Motion
from ttc_fast.brake.types import Needs
from ttc_fast.configuration import ConfigurationError
from ttc_fast.logs import forward_left_up
from ttc_fast.replay.controller import ReplayController, motion_of
from ttc_fast.replay.row import Row
from ttc_fast.replay.settings import GATE_OPTIONS, SCANNER
from ttc_fast.sensors.scans import Geometry, Scan, ScanKernels
from ttc_fast.status import Status

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ttc_fast._core import Gate, ScanTTC, TrackedTTC
    from ttc_fast.brake import Decision
    from ttc_fast.logs import CloudFrame, CloudLog, DistanceFrame, DistanceLog, Lidar, ScanFrame, ScanLog
    from ttc_fast.replay.settings import Settings

MOST_SCANS = 64
"""A range rate remembers at most this many scans."""
NO_INTERVAL = (math.nan, math.nan)
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
    odd: ClassVar[tuple[str, ...]] = ()

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
        """Whether the range rate gives the closing speeds."""
        self._recent: deque[tuple[ScanFrame, float]] = deque(maxlen=MOST_SCANS)
        """The last frames, for a range rate that is not needed before, and how far the vehicle had turned, rad."""
        self._heading = 0.0
        self.controller = ReplayController(self._configuration, scan=scan)

    def scan_of(self, frame: ScanFrame) -> ScanTTC:
        """Return the scanner of a frame."""
        return self._kernels.of(frame.geometry or self._geometry)

    def begin(self, frame: ScanFrame) -> None:
        """Take the first frame into account: where it has no speed, the range rate gives the closing speeds."""
        if frame.speed is None:
            self._rate()

    def _rate(self) -> None:
        """From now on let the range rate give closing speeds where there is no speed, as it does in a node."""
        self.rated = True
        configuration = self._configuration
        if configuration.range_rate is not None:
            return  # it has seen every frame
        before = self.controller.brake
        self._configuration = replace(configuration, range_rate={})
        self.controller.brake = after = self._configuration.controller(self._kernels.of(self._geometry))
        for frame, _ in self._recent:  # it has to have seen the frames before, by the motion that they had
            data = self._kernels.frame(after, self._scan(frame))
            after.update(frame.stamp, motion=motion_of(frame), stamp=frame.stamp, **data)
        rates = after.state()["range_rate"]
        headings = [heading for _, heading in self._recent]
        rates = {**rates, "headings": headings[len(headings) - len(rates["headings"]) :]}
        after.restore({**before.state(), "range_rate": rates})

    def _scan(self, frame: ScanFrame) -> Scan:
        return Scan(frame.geometry or self._geometry, frame.time_increment, frame.ranges)

    def row(self, number: int, frame: ScanFrame) -> Row:
        """Return the row of a frame."""
        stamp, speed = frame.stamp, math.nan if frame.speed is None else frame.speed
        if self.controller.reset_if_set_back(stamp):
            self._recent.clear()
        if not self.rated:
            if frame.speed is None:
                self._rate()
            elif not self._recent or stamp > self._recent[-1][0].stamp:
                self._heading += frame.yaw_rate * (stamp - self._recent[-1][0].stamp) if self._recent else 0.0
                self._recent.append((frame, self._heading))
        data = self._kernels.frame(self.controller.brake, self._scan(frame))
        decision = self.controller.decide(stamp, motion_of(frame), stamp=stamp, **data)
        command, reason, criterion, threats = decision.command, decision.reason, decision.criterion, decision.threats
        nearest = None if threats is None else threats.path or threats.beams
        if threats is None or nearest is None or criterion is None:
            status = decision.status
            assert status is not None
            return Row(number, stamp, math.nan, math.nan, math.inf, status, command, reason, speed=speed)
        return Row(
            number,
            stamp,
            nearest.clearance,
            nearest.closing_speed,
            nearest.ttc,
            nearest.status,
            command,
            reason,
            math.nan,
            math.nan,
            math.nan,
            math.nan,
            speed,
            threats.returns,
            criterion.name,
            decision.value,
            decision.threshold,
            nearest.index,
            nearest.range,
            nearest.angle,
        )


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
        self._settings = settings
        scanner = settings.of_scanner
        recorded = getattr(log, "mount", None) or (0.0, 0.0, 0.0)
        self.outline, self.mount = scanner.get("outline"), tuple(scanner.get("mount", recorded))
        self.lidar = with_bumper(log.lidar, self.outline, self.mount)
        self.gate = settings.gate_of(self.lidar)
        self.about = about_clouds(self.gate, self.lidar.front_offset)
        mounted = getattr(log, "mounted", "")
        if mounted and "mount" not in scanner:
            x, y, yaw = self.mount
            self.about.insert(0, ("lidar", f"at x {x:g} m, y {y:g} m, yaw {yaw:g} rad, {mounted}"))
        assumes = self.lidar.vehicle_reach is None and not settings.says_where_gate_begins
        self._reach = assumed_reach(self.lidar) if assumes else ""
        self._within: Gate | None = None
        if assumes and self.lidar.own_reach > 0.0:
            self._within = settings.gate_within(self.lidar)
        self._own_frames, self._own_distance = 0, math.nan
        self.path: SweptPath | None = None
        if self.outline is not None:
            try:
                self.path = SweptPath(self.outline)
            except (ValueError, TypeError) as error:
                raise ConfigurationError(f"outline: {error}") from None
        self._begin_tracking()
        self._begin_to_brake()

    def _begin_tracking(self) -> None:
        self._tracker = CloudTracker(self.gate, front_offset=self.lidar.front_offset)
        self._near = None if self._within is None else CloudTracker(self._within)

    def _begin_to_brake(self) -> None:
        configuration, instead = self._settings.for_estimates(path=self.path is not None)
        if self.path is None and self.outline is not None:
            for each in configuration.criteria or ():
                if each.needs is Needs.PATH:
                    raise ConfigurationError(f"{each.name} needs the speed: {option('speed')} says it")
        self.assumed = "; ".join(filter(None, (self._reach, instead)))
        self.controller = ReplayController(configuration, path=self.path)

    def begin(self, frame: CloudFrame) -> None:
        """Take the first frame into account: with an outline and a speed, points on the path are assessed as well."""
        if self.path is not None and frame.speed is None:
            self.path = None
            self._begin_to_brake()

    def row(self, number: int, frame: CloudFrame) -> Row:
        """Return the row of a frame."""
        stamp = frame.stamp
        if self.controller.reset_if_set_back(stamp):
            self._begin_tracking()
        tracked, gate = self._tracker.update(frame.points, stamp), self.gate
        if self._near is not None and self._within is not None:
            near = self._near.update(frame.points, stamp)
            if tracked.status is Status.CLEAR or comes_closer(near, tracked):
                tracked, gate = near, self._within
        own = self._tracker.own_vehicle
        if own is not None:
            self._own_frames, self._own_distance = self._own_frames + 1, own
        data: dict[str, Any] = {"estimate": Estimate.of(tracked, stamp)}
        if self.path is not None:
            data |= {"points": self.obstacles(frame.points), "stamp": stamp}
        decision = self.controller.decide(stamp, motion_of(frame), **data)
        plain = robust_min_x(frame.points, gate=gate, estimator=Minimum())
        nearest = max(plain.nearest_x - self.lidar.front_offset, 0.0)
        row = tracked_row(number, stamp, tracked, frame.speed, decision)
        return row._replace(valid=plain.candidates, nearest=nearest)

    @property
    def odd(self) -> list[str]:
        """What was odd about the clouds, a sentence for each kind."""
        if not self._own_frames:
            return []
        seen = f"the gate holds the vehicle itself, {self._own_distance:.2f} m ahead of the lidar"
        count = "1 frame" if self._own_frames == 1 else f"{self._own_frames} frames"
        how = f"{option('front_offset')} says where the vehicle ends, or {option('gate_x')}"
        return [f"{seen}: it was passed over in {count}; {how}"]

    def obstacles(self, points: NDArray[Any]) -> NDArray[Any]:
        """Return the points at the heights of the gate in the vehicle frame, without those of the vehicle itself."""
        points = forward_left_up(points, self.gate.axes)[:, :3]
        (near, _), (right, left), heights = self.gate.x, self.gate.y, self.gate.z
        counts = ~((points[:, 0] >= 0.0) & (points[:, 0] < near) & (points[:, 1] >= right) & (points[:, 1] <= left))
        if heights is not None:
            counts &= (points[:, 2] >= heights[0]) & (points[:, 2] <= heights[1])
        counts &= points.any(axis=1)  # where nothing came back (0, 0, 0) is stored, which the mount would move
        points = points[counts]
        x, y, yaw = self.mount
        if (x, y, yaw) == (0.0, 0.0, 0.0):
            return np.ascontiguousarray(points)
        cos, sin = math.cos(yaw), math.sin(yaw)
        turned = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]], points.dtype)
        moved: NDArray[Any] = points @ turned + np.array([x, y, 0.0], points.dtype)
        return moved


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

    def begin(self, frame: DistanceFrame) -> None:
        """Do nothing: the first frame of a table decides nothing."""

    def row(self, number: int, frame: DistanceFrame) -> Row:
        """Return the row of a frame."""
        stamp = frame.stamp
        if self.controller.reset_if_set_back(stamp):
            self._tracker = DistanceTracker()
        tracked = self._tracker.update(frame.distance, stamp)
        motion = None if frame.speed is None else Motion(frame.speed)
        decision = self.controller.decide(stamp, motion, estimate=Estimate.of(tracked, stamp))
        return tracked_row(number, stamp, tracked, frame.speed, decision)


def tracked_row(number: int, stamp: float, tracked: TrackedTTC, speed: float | None, decision: Decision) -> Row:
    """Return the row of a tracker's result, or of what is on the path where that comes first."""
    path = None if decision.threats is None else decision.threats.path
    first = path if path is not None and path.ttc < tracked.ttc else None
    closing_low, closing_high = tracked.closing_speed_interval or NO_INTERVAL
    ttc_low, ttc_high = tracked.ttc_interval or NO_INTERVAL
    if first is not None:
        closing_low, closing_high, ttc_low, ttc_high = *NO_INTERVAL, *NO_INTERVAL
    return Row(
        number,
        stamp,
        tracked.distance if first is None else first.clearance,
        tracked.closing_speed if first is None else first.closing_speed,
        tracked.ttc if first is None else first.ttc,
        tracked.status if first is None else first.status,
        decision.command,
        decision.reason,
        closing_low,
        closing_high,
        ttc_low,
        ttc_high,
        math.nan if speed is None else speed,
        None,
        "" if decision.criterion is None else decision.criterion.name,
        decision.value,
        decision.threshold,
        -1 if path is None else path.index,
        math.nan if path is None else path.range,
        math.nan if path is None else path.angle,
    )


def with_bumper(lidar: Lidar, outline: Any, mount: Any) -> Lidar:
    """Return the lidar with the distance to the bumper by the outline, unless the log says it."""
    if lidar.front_offset or outline is None:
        return lidar
    offset = max(outline[1] - mount[0], 0.0)
    return replace(lidar, front_offset=offset, vehicle_reach=max(lidar.vehicle_reach or 0.0, offset))


def comes_closer(near: TrackedTTC, ahead: TrackedTTC) -> bool:
    """Whether a body that was taken for the vehicle itself comes closer for certain, and before what is ahead."""
    interval = near.closing_speed_interval
    return interval is not None and interval[0] > LEAST_CLOSING and near.ttc < ahead.ttc


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
    rear, front, right, left = outline
    return [
        ("scanner", scanner),
        ("distance", f"from the outline, x {rear:g} to {front:g} m, y {right:g} to {left:g} m"),
    ]


def about_clouds(gate: Gate, front_offset: float) -> list[tuple[str, str]]:
    """Return the lines of a summary that say what the numbers of clouds rest on."""
    bounds = {"x": gate.x, "y": gate.y, "z": gate.z, "intensity": gate.intensity}
    limits = [f"{name} {low:g} to {high:g}" for name, bound in bounds.items() if bound for low, high in [bound]]
    too_long = "from the lidar, so TTC is too long by (lidar to bumper) / closing speed"
    start = f"{too_long}; {option('front_offset')} says how far that is"
    if front_offset:
        start = f"from the bumper, {front_offset:g} m ahead of the lidar"
    return [("gate", ", ".join(limits)), ("distance", start)]
