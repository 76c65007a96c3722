"""``RangeRate``: how fast each beam's range changes from scan to scan, and the time-to-collision that follows."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast._core import NeighbourSupport
from ttc_fast.reference.arguments import count_in, finite, floats, output, positive, shows_settings
from ttc_fast.reference.formula import time_to_collision
from ttc_fast.reference.hit import Counts
from ttc_fast.reference.scan import ScanTTC
from ttc_fast.reference.scan.settings import checked_beam_vote
from ttc_fast.reference.scan.vote import elect
from ttc_fast.status import Status

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ttc_fast._core import KthSmallest

    Floats = NDArray[np.float64]

MOST_SCANS = 64
"""The largest number of scans that are remembered, however long the window."""

LONGEST_WINDOW = 60.0
"""The longest window, s; what lies farther back has nothing to do with a collision."""

FASTEST_TURN = 1e4
"""No vehicle turns faster, rad/s."""
PATIENCE = 0.6
"""A scan that is repeated for longer than this part of the window shows a scene that stands."""
ACCELERATION = 1.6
"""Standard deviation of the acceleration of what is predicted, m/s^2."""


@dataclass(frozen=True)
class RangeRateNearest:
    """The beam that comes nearest in time by its own range rate, and everything that says why."""

    ttc: float
    """The least time-to-collision, s, in [0, inf]."""
    status: Status
    """What that time means."""
    beam: int
    """The beam that decided: the one of ``ttc``, else the first in contact, else -1."""
    angle: float
    """The direction of that beam in the sensor frame, rad. Without a beam it is NaN, as are ``range``,
    ``clearance``, ``closing_speed`` and ``standard_error``."""
    range: float
    """The reading of that beam, m."""
    clearance: float
    """What is left of the reading outside the outline, m."""
    closing_speed: float
    """How fast its range shrinks, m/s: the negative of its range rate. NaN where that is unknown."""
    standard_error: float
    """The standard error of that speed, m/s."""
    counts: Counts
    """How often each case of a reading occurred."""
    rated: int
    """The number of beams whose range rate is known."""
    unrated: int
    """The number of beams that see something whose range rate is unknown."""
    nearest_unrated: float
    """The least clearance of the latter, m; infinite without one."""
    age: float = math.inf
    """The time since the newest scan that was not the one before again, s; infinite before the first."""


@dataclass(frozen=True)
class _Scan:
    """A scan that is remembered."""

    stamp: float
    """When it was taken, s."""
    heading: float
    """How far the vehicle had turned since the first of all scans, rad."""
    readings: Floats
    """What was measured, m; NaN where nothing was."""


@dataclass(frozen=True)
class _Rates:
    """What is known of each beam."""

    range_rate: Floats
    """The range rates, m/s; NaN where unknown."""
    standard_error: Floats
    """The standard errors of the range rates, m/s; NaN where unknown."""


@shows_settings(
    "window", "min_scans", "noise", "max_speed", "max_acceleration", "gate", "significance", "edge", "minimum"
)
class RangeRate:
    """Range rate of each beam of a laser scanner from its last scans, and the time-to-collision that follows.

    Parameters, results and errors are those of ``ttc_fast.RangeRate``.

    Examples
    --------
    >>> import numpy as np
    >>> from ttc_fast import reference
    >>> rates = reference.RangeRate(reference.ScanTTC(-0.15, 0.02, 16))
    >>> for frame in range(5):
    ...     nearest = rates.update(np.full(16, 8.0 - 0.2 * frame), 0.1 * frame)
    >>> nearest.status.name, round(nearest.closing_speed, 6), round(nearest.ttc, 6)
    ('CLOSING', 2.0, 3.6)
    """

    def __init__(
        self,
        scan: ScanTTC,
        *,
        window: float = 0.5,
        min_scans: int = 4,
        noise: float = 0.01,
        max_speed: float = 20.0,
        max_acceleration: float = 5.0,
        gate: float = 3.0,
        significance: float = 3.0,
        edge: float = 0.2,
        minimum: KthSmallest | NeighbourSupport | None = None,
    ) -> None:
        if not isinstance(scan, ScanTTC):
            raise TypeError(f"scan must be a ScanTTC, got {type(scan).__name__}")
        self._scan = scan
        self._window = positive("window", window)
        if self._window > LONGEST_WINDOW:
            raise ValueError(f"window must be at most {LONGEST_WINDOW} s, got {window}")
        self._min_scans = count_in("min_scans", min_scans, 3, MOST_SCANS)
        self._noise = positive("noise", noise)
        self._max_speed = positive("max_speed", max_speed)
        self._max_acceleration = positive("max_acceleration", max_acceleration)
        self._gate = positive("gate", gate)
        self._significance = positive("significance", significance)
        self._edge = positive("edge", edge)
        self._beam_vote = checked_beam_vote(minimum) or NeighbourSupport(count=6, window=4)
        self._settings = {
            "window": self._window,
            "min_scans": self._min_scans,
            "noise": self._noise,
            "max_speed": self._max_speed,
            "max_acceleration": self._max_acceleration,
            "gate": self._gate,
            "significance": self._significance,
            "edge": self._edge,
            "minimum": self._beam_vote,
        }
        self._scans: list[_Scan] = []

    @property
    def scan(self) -> ScanTTC:
        """The scanner."""
        return self._scan

    def reset(self) -> None:
        """Forget every scan."""
        self._scans = []

    def state(self) -> dict[str, Any]:
        """Return what is remembered, as the kernel's does: either takes up the other's state."""
        remembered = {
            "stamps": [scan.stamp for scan in self._scans],
            "headings": [scan.heading for scan in self._scans],
            "readings": [scan.readings.tolist() for scan in self._scans],
        }
        return {"class": "RangeRate", "version": 1, "beams": self._scan.beams, **remembered}

    def restore(self, state: dict[str, Any]) -> None:
        """Remember what another object with the same scanner and settings remembered."""
        scans = zip(state["stamps"], state["headings"], state["readings"], strict=True)
        self._scans = [_Scan(stamp, heading, np.array(readings)) for stamp, heading, readings in scans]

    def update(
        self,
        ranges: Any,
        stamp: float,
        yaw_rate: float = 0.0,
        *,
        range_rate_out: NDArray[Any] | None = None,
        standard_error_out: NDArray[Any] | None = None,
        status_out: NDArray[np.uint8] | None = None,
    ) -> RangeRateNearest:
        """Take the next scan, and return the nearest beam in time."""
        ranges = floats("ranges", ranges)
        if ranges.shape != (self._scan.beams,):
            raise ValueError(f"ranges must be one scan of {self._scan.beams} beams, got shape {ranges.shape}")
        stamp, yaw_rate = finite("stamp", stamp), finite("yaw_rate", yaw_rate)
        if abs(yaw_rate) > FASTEST_TURN:
            raise ValueError(f"yaw_rate must be at most {FASTEST_TURN} rad/s in size, got {yaw_rate}")
        _separate_outputs(ranges, range_rate_out, standard_error_out, status_out)

        elapsed = stamp - self._scans[-1].stamp if self._scans else 0.0
        if self._scans and elapsed <= 0:
            unknown = np.full(ranges.shape, np.nan)
            rates, status = _Rates(unknown, unknown), np.full(ranges.shape, Status.INVALID, np.uint8)
            nearest = _OUT_OF_ORDER
        else:
            stale = elapsed > self._window
            self._remember(ranges, stamp, yaw_rate * elapsed)
            rates = self._rates()
            status, nearest = self._classified(ranges, rates, stale)
            ahead, age = stamp - self._scans[-1].stamp, stamp - self._unchanged_since()
            error = math.hypot(nearest.standard_error, ACCELERATION * ahead)
            nearest = replace(nearest, ttc=max(nearest.ttc - ahead, 0.0), standard_error=error, age=age)
        with np.errstate(over="ignore", under="ignore"):
            if range_rate_out is not None:
                range_rate_out[...] = rates.range_rate
            if standard_error_out is not None:
                standard_error_out[...] = rates.standard_error
        if status_out is not None:
            status_out[...] = status
        return nearest

    def _remember(self, ranges: NDArray[Any], stamp: float, turned: float) -> None:
        """Remember what was measured, and forget what is older than the window."""
        readings = self._scan._rules.usable(ranges).astype(np.float64)
        readings[(ranges == -np.inf) | np.isnan(self._scan._offset)] = np.nan
        repeated = bool(self._scans) and _looks_like(readings, self._scans[-1])
        if repeated and stamp - self._unchanged_since() < PATIENCE * self._window:
            return
        recent = [scan for scan in self._scans if stamp - scan.stamp <= self._window]
        heading = recent[-1].heading + turned if recent else 0.0
        self._scans = [*recent, _Scan(stamp, heading, readings)][-MOST_SCANS:]

    def _unchanged_since(self) -> float:
        """Return the stamp of the oldest scan since which nothing has changed, s."""
        since = newest = self._scans[-1]
        for scan in reversed(self._scans):
            if not _looks_like(scan.readings, newest):
                break
            since = scan
        return since.stamp

    def _rates(self) -> _Rates:
        """Fit a line to the readings of each beam, from the newest back to the first that belongs to something else.

        Ages and changes are relative to the newest scan, so that a large stamp loses no digits.
        """
        newest = self._scans[-1]
        jump = self._gate * math.sqrt(2.0) * self._noise
        half_acceleration = 0.5 * self._max_acceleration
        zero = np.zeros(self._scan.beams)
        same = np.full(self._scan.beams, True)  # whether all up to here belongs to one surface
        count, ages, age_squares = zero + 1.0, zero, zero
        changes, change_squares, products = zero, zero, zero
        last_age, last_change = zero, zero
        last_step, last_gap = zero, zero  # the step before, and the time that it took; 0 when there is none
        with np.errstate(all="ignore"):
            for scan in reversed(self._scans[:-1]):
                age = newest.stamp - scan.stamp
                change = self._turned(scan, newest.heading) - newest.readings
                seen = ~np.isnan(change)
                step, gap = change - last_change, age - last_age
                steady = np.abs(step) <= jump + self._max_speed * gap
                bend = np.abs(step * last_gap - last_step * gap)
                straight = bend <= (last_gap + gap) * (jump + half_acceleration * (gap * last_gap))
                same = same & (~seen | (steady & straight))
                kept = seen & same
                kept_age, kept_change = np.where(kept, age, 0.0), np.where(kept, change, 0.0)
                count = count + kept
                ages, age_squares = ages + kept_age, age_squares + kept_age * kept_age
                changes, change_squares = changes + kept_change, change_squares + kept_change * kept_change
                products = products + kept_age * kept_change
                last_age, last_change = np.where(seen, age, last_age), np.where(seen, change, last_change)
                last_step, last_gap = np.where(seen, step, last_step), np.where(seen, gap, last_gap)

            # Least squares; the scatter about the line counts where it exceeds the noise.
            each, spare = 1.0 / count, count - 2.0
            spread = age_squares - ages * ages * each
            slope = (products - ages * changes * each) / spread
            unexplained = change_squares - changes * changes * each - slope * slope * spread
            scatter = np.maximum(unexplained, self._noise * self._noise * spare)
            error = np.sqrt(scatter / (spare * spread))
            on_a_line = unexplained <= (self._gate * self._noise) * (self._gate * self._noise) * spare
        known = ~np.isnan(newest.readings) & (count >= self._min_scans) & on_a_line
        return _Rates(np.where(known, -slope, np.nan), np.where(known, error, np.nan))

    def _turned(self, scan: _Scan, heading: float) -> Floats:
        """Return what a scan measured in the directions in which the beams point now."""
        turned = heading - scan.heading
        if turned == 0:
            return scan.readings
        beams, increment = self._scan.beams, self._scan._angle_increment
        shift = turned / increment if increment != 0 else math.inf
        if not abs(shift) <= beams:
            return np.full(beams, np.nan)
        whole = math.floor(shift)
        part = shift - whole
        outside = np.full(beams + 1, np.nan)
        around = np.concatenate([outside, scan.readings, outside])
        first, second = (around[beams + 1 + whole + side :][:beams] for side in (0, 1))
        between: Floats = first + part * (second - first)
        return np.where(np.abs(second - first) <= self._edge, between, first if part < 0.5 else second)

    def _classified(
        self, ranges: NDArray[Any], rates: _Rates, stale: bool
    ) -> tuple[NDArray[np.uint8], RangeRateNearest]:
        """Return the status of each beam, and the nearest."""
        scan = self._scan
        usable = scan._rules.usable(ranges).astype(np.float64)
        clearance = usable - scan._offset
        closing, error = -rates.range_rate, rates.standard_error
        known, there = ~np.isnan(closing), ~np.isnan(clearance)
        contact = clearance <= 0
        closes = (closing > scan._min_closing_speed) & (closing > self._significance * error)
        observed = scan._rules.observed(ranges) & ~np.isnan(scan._offset)

        # The first that holds.
        cases = {
            Status.NO_DATA: np.isnan(scan._offset),
            Status.CONTACT: contact,
            Status.CLOSING: closes,
            Status.NOT_CLOSING: known,
            Status.WARMING_UP: there,
            Status.CLEAR: observed,
        }
        each = np.select(list(cases.values()), list(cases), Status.INVALID).astype(np.uint8)

        ttc = time_to_collision(clearance, np.where(closes, closing, np.nan), np.float64(0))
        closing_in = np.where(ttc < np.inf, usable, np.nan)
        beam, confirmed = elect(ttc, closing_in, self._beam_vote, around=scan._goes_around)
        unrated = there & ~known
        if not observed.any():
            status = Status.NO_DATA
        elif stale:
            status = Status.STALE
        elif unrated.any() and not known.any():
            status = Status.WARMING_UP
        elif contact.any():
            status = Status.CONTACT
        elif not confirmed:
            status = Status.TOO_FEW
        elif beam is not None:
            status = Status.CLOSING
        elif known.any():
            status = Status.NOT_CLOSING
        else:
            status = Status.CLEAR

        shown = beam if beam is not None else int(np.argmax(contact)) if contact.any() else None
        nothing = shown is None
        at = 0 if shown is None else shown
        nearest = RangeRateNearest(
            ttc=math.inf if beam is None else float(ttc[beam]),
            status=status,
            beam=-1 if nothing else at,
            angle=math.nan if nothing else float(scan._angles[at]),
            range=math.nan if nothing else float(usable[at]),
            clearance=math.nan if nothing else float(clearance[at]),
            closing_speed=math.nan if nothing else float(closing[at]),
            standard_error=math.nan if nothing else float(error[at]),
            counts=scan._rules.count(ranges, scan._offset),
            rated=int(np.count_nonzero(known)),
            unrated=int(np.count_nonzero(unrated)),
            nearest_unrated=float(np.min(clearance[unrated], initial=np.inf)),
        )
        return each, nearest


def _looks_like(readings: Floats, scan: _Scan) -> bool:
    """Whether two scans measured the same numbers; NaN is the same as NaN, and -0 the same as 0."""
    return np.array_equal(readings, scan.readings, equal_nan=True)


_OUT_OF_ORDER = RangeRateNearest(
    ttc=math.inf,
    status=Status.INVALID,
    beam=-1,
    angle=math.nan,
    range=math.nan,
    clearance=math.nan,
    closing_speed=math.nan,
    standard_error=math.nan,
    counts=Counts(0, 0, 0, 0, 0, 0, 0, 0),
    rated=0,
    unrated=0,
    nearest_unrated=math.inf,
)


def _separate_outputs(ranges: NDArray[Any], range_rate_out: Any, standard_error_out: Any, status_out: Any) -> None:
    """Refuse an array that the results cannot be written to, or that shares memory with another or with the ranges."""
    wanted = [
        ("range_rate_out", range_rate_out, ranges.dtype),
        ("standard_error_out", standard_error_out, ranges.dtype),
        ("status_out", status_out, np.dtype(np.uint8)),
    ]
    others = [ranges]
    for argument, out, dtype in wanted:
        if out is not None:
            output(argument, out, ranges, dtype)
            if any(np.shares_memory(out, other) for other in others):
                raise ValueError(f"{argument} overlaps the input or another output in memory")
            others.append(out)
