"""Where the beams of a scan point, and the kernels that read it.

A driver may measure the time of each turn, and with it the ``time_increment``; it may send a few readings more or less
in each scan; and while the scanner starts it may send an empty scan, or one of a single reading. So each scan says
where its own beams are, and a ``ScanReader`` checks what it says [sensor_msgs/LaserScan, REP 117]:

- ``time_increment`` only corrects the age of a beam by milliseconds. A senseless one is taken for 0.
- ``angle_max`` is the angle of the last beam. If it is not where ``angle_min``, ``angle_increment`` and the number of
  readings put that beam, nobody knows where the beams point, and the scan is refused. Drivers that count the readings
  as if they were the steps between them are off by one beam, and where they round the count down by less than two,
  which is tolerated.

``ScanKernels`` keeps a ``ScanTTC`` for each geometry. Two geometries that differ by less than a sixteenth of a beam are
taken for one: the increments that drivers compute anew in each scan differ in their last digits.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ttc_fast._core import ScanTTC
from ttc_fast.configuration import ConfigurationError
from ttc_fast.sensors.oddities import RefusedError

if TYPE_CHECKING:
    from ttc_fast.brake import BrakeController
    from ttc_fast.configuration import Configuration
    from ttc_fast.sensors.oddities import Tally

LONGEST_SCAN = 1.5
"""s; no scanner takes longer for one scan, so a ``time_increment`` that says so is senseless."""
OFF_BY_ONE = 1.99
"""The number of readings may differ by up to this from what ``angle_max`` says: one, and what was rounded down."""
SAME = 1.0 / 16.0
"""Of a beam: two geometries whose first and last beams are this near are one."""
KEPT = 64
"""The number of geometries whose kernels are kept."""
FAR = 500.0
"""m; no sensor sees so far: readings beyond are perhaps in millimetres."""
TURN = 2.0 * math.pi
ROUNDING = 1e-3
"""s; stamps that are rounded in another way must not decide otherwise."""


class Geometry(NamedTuple):
    """Where the beams of a scan point, and what its readings can be: arguments of ``ScanTTC``, rad and m."""

    angle_min: float
    angle_increment: float
    beams: int
    range_min: float
    range_max: float

    @property
    def angle_last(self) -> float:
        """The angle of the last beam, rad."""
        return self.angle_min + (self.beams - 1) * self.angle_increment

    def is_nearly(self, other: Geometry) -> bool:
        """Return whether every beam points where the other's does, but for a small part of a beam."""
        return self.range_min == other.range_min and self.range_max == other.range_max and self.points_like(other)

    def points_like(self, other: Geometry) -> bool:
        """Return whether every beam points where the other's does, whatever its readings can be."""
        tolerance = SAME * abs(self.angle_increment)
        return (
            self.beams == other.beams
            and abs(self.angle_min - other.angle_min) <= tolerance
            and abs(self.angle_last - other.angle_last) <= tolerance
        )


class Scan(NamedTuple):
    """A scan that makes sense.

    Attributes
    ----------
    geometry : Geometry
        Where its beams point.
    time_increment : float
        The time between two beams, s.
    ranges : ndarray
        The readings, m, where they lay in the message.
    """

    geometry: Geometry
    time_increment: float
    ranges: Any


class ScanReader:
    """Checks the scans of one topic.

    Parameters
    ----------
    name : str
        The topic, which oddities are counted by.
    odd : Tally
        Counts what is odd but usable.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> import numpy as np
    >>> from ttc_fast.sensors.oddities import Tally
    >>> from ttc_fast.sensors.scans import ScanReader
    >>> reader = ScanReader("/scan", Tally(print))
    >>> scan = SimpleNamespace(
    ...     angle_min=-1.0, angle_max=1.0, angle_increment=0.5, range_min=0.1, range_max=30.0, time_increment=-1.0,
    ...     ranges=np.ones(5, np.float32),
    ... )
    >>> reader.read(scan).time_increment
    /scan, time_increment: is -1 s from one beam to the next of 5, which makes no sense; it is taken for 0
    0.0
    >>> scan.ranges = np.ones(9, np.float32)
    >>> reader.read(scan)  # doctest: +NORMALIZE_WHITESPACE
    Traceback (most recent call last):
        ...
    ttc_fast.sensors.oddities.RefusedError: has 9 readings that end at 3 rad, and angle_max 1 rad: nobody \
knows where its beams point
    """

    def __init__(self, name: str, odd: Tally) -> None:
        self._name = name
        self._odd = odd
        self._said: tuple[Any, ...] | None = None
        self._geometry: Geometry | None = None
        self._off_by_one = ""
        self._sound: set[tuple[float, float, int]] = set()

    def read(self, scan: Any) -> Scan:
        """Return what any object with the fields of sensor_msgs/LaserScan says; RefusedError where it is nonsense."""
        ranges = scan.ranges
        beams = len(ranges)
        said = (
            scan.angle_min,
            scan.angle_increment,
            beams,
            scan.range_min,
            scan.range_max,
            getattr(scan, "angle_max", None),
        )
        if said != self._said or self._geometry is None:
            self._geometry = self._checked(*said)
            self._said = said
        if self._off_by_one:
            self._odd.count(f"{self._name}, angle_max", self._off_by_one)
        if self._geometry.range_max > FAR and (middle := middle_of(ranges)) > FAR:
            why = f"half of them are {middle:g} m or more, read as they are; if they are in millimetres"
            self._odd.count(f"{self._name}, ranges", f"{why}, divide ranges, range_min and range_max by 1000")
        return Scan(self._geometry, self._between(scan.time_increment, beams), ranges)

    def _between(self, time_increment: Any, beams: int) -> float:
        """Return the time between two beams, s, which is 0 where what is said makes no sense."""
        if 0.0 <= time_increment * (beams - 1) <= LONGEST_SCAN:
            return float(time_increment)
        if time_increment != time_increment:
            raise RefusedError("has a time_increment that is not a number")
        if beams > 1:
            why = f"is {time_increment:g} s from one beam to the next of {beams}, which makes no sense; "
            self._odd.count(f"{self._name}, time_increment", f"{why}it is taken for 0")
        return 0.0

    def _checked(
        self, angle_min: Any, angle_increment: Any, beams: int, range_min: Any, range_max: Any, angle_max: Any
    ) -> Geometry:
        """Return the geometry that a scan says, if it makes sense."""
        self._geometry, self._off_by_one = None, ""
        if beams == 0:
            raise RefusedError("has no readings")
        if not math.isfinite(angle_min + angle_increment):
            raise RefusedError(
                f"has angle_min {angle_min:g} and angle_increment {angle_increment:g}, which must be finite"
            )
        geometry = Geometry(float(angle_min), float(angle_increment), beams, float(range_min), float(range_max))
        directions = geometry[:3]
        is_known = directions in self._sound
        try:  # the limits of a reading are checked by one beam, where they alone are new
            ScanTTC(**(geometry._replace(beams=1) if is_known else geometry)._asdict())
        except ValueError as error:
            raise RefusedError(f"cannot be read: {error}") from None
        if not is_known:
            if len(self._sound) >= KEPT:
                self._sound.clear()
            self._sound.add(directions)
        # An angle_max of 0 is one that nobody filled in.
        if angle_max and math.isfinite(angle_max) and angle_increment:
            self._check_last(geometry, angle_max)
        return geometry

    def _check_last(self, geometry: Geometry, angle_max: float) -> None:
        """Check that the last beam points to ``angle_max``, whichever way round that was counted.

        Readings that go round more than once do not get there by another way round.
        """
        last, step = geometry.angle_last, abs(geometry.angle_increment)
        apart = abs(last - angle_max) / step
        if step * (geometry.beams - 1) < TURN + 2.0 * step:
            apart = abs(math.remainder(last - angle_max, TURN)) / step
        if apart <= 0.5:
            return
        text = f"has {geometry.beams} readings that end at {last:g} rad, and angle_max {angle_max:g} rad"
        if apart > OFF_BY_ONE:
            raise RefusedError(f"{text}: nobody knows where its beams point")
        self._off_by_one = f"{text}, a beam off; the readings are taken as counted from angle_min"


def middle_of(readings: Any) -> float:
    """Return the median of the size of readings that are finite, 0 where none is.

    Examples
    --------
    >>> import math
    >>> from ttc_fast.sensors.scans import middle_of
    >>> middle_of([math.inf, 900.0, 1200.0, 1500.0]), middle_of([math.nan])
    (1200.0, 0.0)
    """
    sizes = np.abs(np.asarray(readings))
    sizes = sizes[np.isfinite(sizes)]
    return float(np.median(sizes)) if sizes.size else 0.0


class Repeats:
    """Finds that a message repeats the readings of the one before, under a new stamp.

    Simulators publish faster than they measure, and some drivers hand a measurement over again. That is no new
    measurement, so it casts no vote: the decision stays as it was, and grows older. A scene may stand, though, and an
    open field shows nothing in every scan. So a quarter of ``sensor_timeout`` after they first came, which is before
    they are too old, the readings count as measured anew.

    Parameters
    ----------
    name : str
        The topic, which repeats are counted by.
    odd : Tally
        Counts the repeats.
    sensor_timeout : float
        The age from which sensor data are too old, s.

    Examples
    --------
    >>> import numpy as np
    >>> from ttc_fast.sensors.oddities import Tally
    >>> from ttc_fast.sensors.scans import Repeats
    >>> repeats = Repeats("/scan", Tally(), 0.3)
    >>> [repeats.found(np.ones(3), 0.05 * i) for i in range(4)]
    [False, True, False, True]
    """

    def __init__(self, name: str, odd: Tally, sensor_timeout: float) -> None:
        self._name = name
        self._odd = odd
        self._counts_from = sensor_timeout / 4.0 - ROUNDING
        self._bytes = b""
        self._at = -math.inf

    def found(self, readings: Any, stamp: float) -> bool:
        """Return whether readings are those of the message before; otherwise take them up."""
        now: bytes = readings.tobytes()
        if now == self._bytes and 0.0 < stamp - self._at < self._counts_from:
            self._odd.count(f"{self._name}, readings", "are those of the message before, to the bit: they cast no vote")
            return True
        self._bytes, self._at = now, stamp
        return False


class ScanKernels:
    """The scanners of a configuration, one for each geometry, made once.

    Parameters
    ----------
    configuration : Configuration
        The settings of the scanner; what it says of the geometry wins.
    upside_down : bool
        Whether the scanner hangs upside down, so that its beams run the other way round.
    """

    def __init__(self, configuration: Configuration, *, upside_down: bool = False) -> None:
        self._configuration = configuration
        self._upside_down = upside_down
        self._made: dict[Geometry, ScanTTC] = {}
        self._fitted: tuple[Geometry, BrakeController] | None = None
        self._limits: tuple[float, float] | None = None
        """The limits of the scan where those of its kernel are wider."""
        self._has_time_increment = "time_increment" in configuration.brake

    def of(self, geometry: Geometry) -> ScanTTC:
        """Return the scanner of a geometry."""
        made = self._made
        known = geometry
        if known not in made:
            known = next((each for each in reversed(made) if each.is_nearly(geometry)), geometry)
        scan = made.pop(known, None)
        if scan is None:
            turned = geometry
            if self._upside_down:
                turned = geometry._replace(angle_min=-geometry.angle_min, angle_increment=-geometry.angle_increment)
            scan = self._configuration.scanner(**turned._asdict())
            if len(made) >= KEPT:
                del made[next(iter(made))]
        made[known] = scan  # the newest is last
        return scan

    def frame(self, controller: BrakeController, scan: Scan) -> dict[str, Any]:
        """Let a controller read scans of this geometry, and return what its ``update`` is given of this one."""
        geometry = scan.geometry
        fitted = self._fitted
        if fitted is None or fitted[0] != geometry or fitted[1] is not controller:
            try:
                kernel = self._fitting(geometry)
            except ConfigurationError as error:  # such as a mask that has a value for each of other beams
                raise RefusedError(f"cannot be read with these settings: {error}") from None
            if controller.scan is not kernel:
                controller.use_scan(kernel)
            self._fitted = geometry, controller
        between = None if self._has_time_increment else scan.time_increment
        ranges = scan.ranges if self._limits is None else within(scan.ranges, *self._limits)
        return {"ranges": ranges, "time_increment": between}

    def _fitting(self, geometry: Geometry) -> ScanTTC:
        """Return the scanner of a geometry, or one of the same beams that takes readings in wider limits.

        A driver may say the least and the greatest reading of each scan as its limits. One kernel serves them all.
        """
        self._limits = None
        alike = [each for each in self._made if each.points_like(geometry)]
        if not alike or any(each.is_nearly(geometry) for each in alike):
            return self.of(geometry)
        of_user = self._configuration.scan
        low = -math.inf if "range_min" in of_user else geometry.range_min
        high = math.inf if "range_max" in of_user else geometry.range_max
        self._limits = low, high
        return self.of(alike[0]._replace(range_min=0.0, range_max=math.inf))


def within(ranges: Any, low: float, high: float) -> Any:
    """Return readings of which those outside of limits are NaN, but for infinite ones, which are no readings.

    Examples
    --------
    >>> import math, numpy as np
    >>> from ttc_fast.sensors.scans import within
    >>> within(np.array([-math.inf, 0.1, 3.0, 40.0, math.inf]), 0.2, 30.0)
    array([-inf,  nan,   3.,  nan,  inf])
    """
    ranges = np.asarray(ranges)
    outside = ((ranges < low) & (ranges > -math.inf)) | ((ranges > high) & (ranges < math.inf))
    return np.where(outside, ranges.dtype.type(math.nan), ranges) if outside.any() else ranges
