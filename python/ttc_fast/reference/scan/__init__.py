"""``ScanTTC``: instantaneous time-to-collision (iTTC) over the beams of a laser scanner."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast._core import NoDataError
from ttc_fast.reference.arguments import (
    checked_no_data,
    checked_threads,
    floats,
    non_negative,
    number,
    output,
    shows_settings,
)
from ttc_fast.reference.formula import rounded, time_to_collision
from ttc_fast.reference.hit import Batch, Counts
from ttc_fast.reference.scan.settings import (
    checked_angles,
    checked_beam_vote,
    checked_mask,
    checked_rules,
)
from ttc_fast.reference.scan.vote import elect, goes_around
from ttc_fast.reference.vehicle import (
    Motion,
    checked_mount,
    checked_outline,
    motions,
    outline_offsets,
    sensor_velocity,
)
from ttc_fast.status import Status

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from ttc_fast._core import KthSmallest, NeighbourSupport

    Floats = NDArray[np.floating[Any]]


@dataclass(frozen=True)
class Nearest:
    """The nearest beam in time of one scan, and everything that says why."""

    ttc: float
    """The least time-to-collision, s, in [0, inf]."""
    status: Status
    """What that time means."""
    beam: int
    """The beam that decided: the one of ``ttc``, else the first in contact, else -1."""
    angle: float
    """The direction of that beam in the sensor frame, rad. Without a beam it is NaN, as are ``range``,
    ``clearance`` and ``closing_speed``."""
    range: float
    """The reading of that beam, m."""
    clearance: float
    """What is left of the reading outside the outline, m."""
    closing_speed: float
    """The speed of the sensor along the beam, m/s."""
    counts: Counts
    """How often each case of a reading occurred."""


class NearestBatch(Batch[Nearest]):
    """The ``Nearest`` of each frame of a batch."""

    def __init__(self, frames: Sequence[Nearest]) -> None:
        super().__init__(Nearest, frames)


@shows_settings(
    "angle_min",
    "angle_increment",
    "range_min",
    "range_max",
    "limits",
    "limits_policy",
    "mount",
    "outline",
    "mask",
    "min_closing_speed",
    "too_close",
    "no_data",
    "minimum",
    "threads",
)
class ScanTTC:
    """Instantaneous time-to-collision (iTTC) of the beams of one laser scanner.

    Parameters, results and errors are those of ``ttc_fast.ScanTTC``.

    Examples
    --------
    A wall 10 m ahead, and the car reversing from it:

    >>> import numpy as np
    >>> from ttc_fast import reference
    >>> scan = reference.ScanTTC(-0.5, 0.5, 3)
    >>> scan.min(10.0 / np.cos(scan.angles), 5.0)
    2.0
    >>> scan.min(10.0 / np.cos(scan.angles), -5.0)
    inf
    """

    def __init__(
        self,
        angle_min: float,
        angle_increment: float,
        beams: int,
        *,
        range_min: float = 0.0,
        range_max: float = math.inf,
        limits: tuple[float, float] | None = None,
        limits_policy: str = "horizon",
        mount: tuple[float, float, float] = (0.0, 0.0, 0.0),
        outline: tuple[float, float, float, float] | None = None,
        mask: Sequence[bool] | NDArray[np.bool_] | None = None,
        min_closing_speed: float = 0.01,
        too_close: str = "hit",
        no_data: float | None = None,
        minimum: KthSmallest | NeighbourSupport | None = None,
        threads: int = 1,
    ) -> None:
        self._angles = checked_angles(angle_min, angle_increment, beams)
        self._angle_increment = float(angle_increment)
        self._goes_around = goes_around(self._angle_increment, beams)
        self._rules = checked_rules(range_min, range_max, limits, limits_policy, too_close)
        self._mount = checked_mount(mount)
        self._cos, self._sin = _directions(self._angles + self._mount.yaw)
        # How much of each beam's range lies inside the vehicle, m. NaN: the beam is ignored.
        self._offset = np.zeros(self.beams)
        self._outline = None if outline is None else checked_outline(outline)
        if self._outline is not None:
            self._offset = outline_offsets(self._outline, self._mount, self._cos, self._sin)
        if mask is not None:
            self._offset[checked_mask(mask, self.beams)] = np.nan
        self._min_closing_speed = non_negative("min_closing_speed", min_closing_speed)
        self._no_data = checked_no_data(no_data)
        self._beam_vote = checked_beam_vote(minimum)
        checked_threads(threads)  # the answer does not depend on them
        self._settings = {
            "angle_min": float(angle_min),
            "angle_increment": self._angle_increment,
            "range_min": float(range_min),
            "range_max": float(range_max),
            "limits": None if limits is None else (float(limits[0]), float(limits[1])),
            "limits_policy": limits_policy,
            "mount": tuple(float(value) for value in mount),
            "outline": None if outline is None else tuple(float(edge) for edge in outline),
            "mask": None if mask is None else tuple(bool(masked) for masked in mask),
            "min_closing_speed": self._min_closing_speed,
            "too_close": too_close,
            "no_data": self._no_data,
            "minimum": minimum,
            "threads": int(threads),
        }

    @classmethod
    def from_message(cls, msg: Any, **settings: Any) -> ScanTTC:
        """Make a scanner from a sensor_msgs/LaserScan; ``settings`` override what the message says."""
        names = ("angle_min", "angle_increment", "range_min", "range_max")
        for name in (*names, "ranges"):
            if not hasattr(msg, name):
                raise TypeError(f"msg must be a sensor_msgs/LaserScan; it has no field {name}")
        message = {name: getattr(msg, name) for name in names} | {"beams": len(msg.ranges)}
        angle_max = number("angle_max", getattr(msg, "angle_max", 0.0))
        if angle_max != 0.0 and not settings.keys() & {"angle_min", "angle_increment", "beams"}:
            last = msg.angle_min + msg.angle_increment * (max(len(msg.ranges), 1) - 1)
            apart, tolerated = abs(last - angle_max), 2.0 * abs(msg.angle_increment)
            if abs(last - msg.angle_min) < math.tau + tolerated and math.isfinite(apart):
                apart = abs(math.remainder(apart, math.tau))  # it may be counted the other way round
            if tolerated <= apart < math.inf:
                readings = f"its {len(msg.ranges)} readings end at {last} rad, and angle_max is {angle_max} rad"
                raise ValueError(f"msg contradicts itself: {readings}")
        return cls(**(message | settings))

    @property
    def beams(self) -> int:
        """The number of beams."""
        return len(self._angles)

    @property
    def angles(self) -> NDArray[np.float64]:
        """The direction of each beam in the sensor frame, rad, float64 of shape (beams,)."""
        return self._angles.copy()

    def min(
        self, ranges: Any, speed: Any, yaw_rate: Any = 0.0, lateral_speed: Any = 0.0
    ) -> float | NDArray[np.float64]:
        """Return the least time-to-collision of a scan, s; for a batch one each, float64 of shape (B,).

        It is that of the beam in ``nearest``, computed in float64. Raises ``NoDataError`` when nothing valid was
        observed, unless ``no_data`` says what that means.
        """
        ranges = self._checked(ranges)
        scans = self._scans(ranges, speed, yaw_rate, lateral_speed)
        each = [self._one_number(self._nearest(*scan), index) for index, scan in enumerate(scans)]
        return each[0] if ranges.ndim == 1 else np.array(each, np.float64)

    def nearest(self, ranges: Any, speed: Any, yaw_rate: Any = 0.0, lateral_speed: Any = 0.0) -> Nearest | NearestBatch:
        """Return the nearest beam in time, and everything that says why, for a scan or for each scan of a batch."""
        ranges = self._checked(ranges)
        each = [self._nearest(*scan) for scan in self._scans(ranges, speed, yaw_rate, lateral_speed)]
        return each[0] if ranges.ndim == 1 else NearestBatch(each)

    def per_beam(
        self,
        ranges: Any,
        speed: Any,
        yaw_rate: Any = 0.0,
        lateral_speed: Any = 0.0,
        *,
        out: Floats | None = None,
        status_out: NDArray[np.uint8] | None = None,
    ) -> Floats:
        """Return the time-to-collision of each beam, s, in the dtype of ``ranges``; infinite if it is invalid."""
        ranges = self._checked(ranges)
        scans = self._scans(ranges, speed, yaw_rate, lateral_speed)
        if status_out is not None:
            output("status_out", status_out, ranges, np.uint8)
        out = np.empty_like(ranges, subok=False) if out is None else output("out", out, ranges, ranges.dtype)
        for index, (scan, motion) in enumerate(scans):
            ttc, status = self._each_beam(scan, motion)
            np.atleast_2d(out)[index] = ttc
            if status_out is not None:
                np.atleast_2d(status_out)[index] = status
        return out

    def _nearest(self, ranges: Floats, motion: Motion) -> Nearest:
        """Return the nearest beam of one scan, computed in float64."""
        usable = self._rules.usable(ranges).astype(np.float64)
        closing = self._closing(motion)
        ttc = time_to_collision(usable - self._offset, closing, np.float64(self._min_closing_speed))
        return self._nearest_by(ttc, ranges, motion)

    def _closing(self, motion: Motion) -> NDArray[np.float64]:
        """Return the speed of the sensor along each beam, m/s."""
        vx, vy = sensor_velocity(motion, self._mount)
        return vx * self._cos + vy * self._sin

    def _nearest_by(self, ttc: NDArray[np.float64], ranges: Floats, motion: Motion) -> Nearest:
        """Return the nearest beam of one scan whose beams have these times."""
        usable = self._rules.usable(ranges).astype(np.float64)
        clearance = usable - self._offset
        closing = self._closing(motion)

        looking = np.where(np.isnan(self._offset), np.nan, usable)
        beam, confirmed = elect(ttc, looking, self._beam_vote, around=self._goes_around)
        contacts = np.flatnonzero(clearance <= 0)
        if contacts.size > 0:
            status = Status.CONTACT
        elif not confirmed:
            status = Status.TOO_FEW
        elif beam is not None:
            status = Status.CLOSING
        elif not np.isnan(clearance).all():
            status = Status.NOT_CLOSING
        elif (self._rules.observed(ranges) & ~np.isnan(self._offset)).any():
            status = Status.CLEAR
        else:
            status = Status.NO_DATA

        counts = self._rules.count(ranges, self._offset)
        if beam is None and contacts.size > 0:
            beam = int(contacts[0])
        if beam is None:
            return Nearest(math.inf, status, -1, math.nan, math.nan, math.nan, math.nan, counts)
        return Nearest(
            ttc=float(ttc[beam]),
            status=status,
            beam=beam,
            angle=float(self._angles[beam]),
            range=float(usable[beam]),
            clearance=float(clearance[beam]),
            closing_speed=float(closing[beam]),
            counts=counts,
        )

    def _each_beam(self, ranges: Floats, motion: Motion) -> tuple[Floats, NDArray[np.uint8]]:
        """Return the time-to-collision and the status of each beam of one scan, computed in the dtype of its ranges."""
        dtype = ranges.dtype
        cos, sin, offset = self._cos.astype(dtype), self._sin.astype(dtype), self._offset.astype(dtype)
        vx, vy = (rounded(component, dtype) for component in sensor_velocity(motion, self._mount))
        least = rounded(self._min_closing_speed, dtype)
        clearance = self._rules.usable(ranges) - offset
        closing = vx * cos + vy * sin
        return time_to_collision(clearance, closing, least), self._statuses(ranges, clearance, closing > least)

    def _statuses(self, ranges: Floats, clearance: Floats, closes: NDArray[np.bool_]) -> NDArray[np.uint8]:
        """Return the status of each beam."""
        # The first that holds.
        cases = {
            Status.NO_DATA: np.isnan(self._offset),
            Status.CONTACT: clearance <= 0,
            Status.CLOSING: (clearance > 0) & closes,
            Status.NOT_CLOSING: clearance > 0,
            Status.CLEAR: self._rules.observed(ranges),
        }
        return np.select(list(cases.values()), list(cases), Status.INVALID).astype(np.uint8)

    def _one_number(self, nearest: Nearest, index: int) -> float:
        if nearest.status is not Status.NO_DATA:
            return nearest.ttc
        if self._no_data is None:
            raise NoDataError(f"nothing valid was observed in scan {index}: a blind sensor is not free space")
        return self._no_data

    def _scans(self, ranges: Floats, speed: Any, yaw_rate: Any, lateral_speed: Any) -> Iterator[tuple[Floats, Motion]]:
        """Return each scan with its motion."""
        return zip(np.atleast_2d(ranges), motions(ranges, speed, yaw_rate, lateral_speed), strict=True)

    def _checked(self, ranges: Any) -> Floats:
        scans = floats("ranges", ranges)
        if scans.shape[-1] != self.beams:
            raise ValueError(f"ranges must have one entry for each of the {self.beams} beams, got {scans.shape}")
        return scans


def _directions(angles: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the cosine and the sine of each angle.

    They are computed by ``math``, whose functions are the C library's as in the kernels. NumPy's own may differ from
    them in the last bit, depending on version and processor.
    """
    each = angles.tolist()
    return np.array([math.cos(angle) for angle in each]), np.array([math.sin(angle) for angle in each])
