"""``ScanSweptPath``: which beam's point is hit first, by the swept path over the beams of a scanner."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast.reference.arguments import duration, finite, non_negative, output
from ttc_fast.reference.path import LONGEST, Way, ways
from ttc_fast.reference.path.sweep import Sweep
from ttc_fast.reference.scan import Nearest, NearestBatch, ScanTTC
from ttc_fast.reference.scan.field_of_view import STRIPS, FieldOfView, leading_edge, longest_run
from ttc_fast.reference.vehicle import Motion

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Floats = NDArray[np.floating[Any]]


class ScanSweptPath:
    """Time until what a laser scanner sees enters the vehicle's outline, if it goes on moving as it does.

    Parameters, results and errors are those of ``ttc_fast.ScanSweptPath``.

    Examples
    --------
    >>> import numpy as np
    >>> from ttc_fast import reference
    >>> scan = reference.ScanTTC(-1.5, 0.5, 7, outline=(-0.1, 0.4, -0.15, 0.15))
    >>> path = reference.ScanSweptPath(scan)
    >>> ranges = np.array([1.0, 1.0, 1.0, 5.4, 1.0, 1.0, 1.0])    # something ahead, things at the sides
    >>> path.min(ranges, 5.0)
    1.0
    >>> round(scan.min(ranges, 5.0), 2)
    0.16
    """

    def __init__(self, scan: ScanTTC, *, horizon: float = 5.0) -> None:
        self._scan, self._horizon = scan, duration("horizon", horizon, LONGEST)
        if scan._outline is None:
            raise ValueError("scan must have an outline: ScanTTC(..., outline=(x_rear, x_front, y_right, y_left))")
        self._outline = scan._outline
        self._view = FieldOfView(scan)

    @property
    def scan(self) -> ScanTTC:
        """The scanner it was made of."""
        return self._scan

    @property
    def horizon(self) -> float:
        """How far ahead it looks, s."""
        return self._horizon

    def min(
        self, ranges: Any, speed: Any, yaw_rate: Any = 0.0, lateral_speed: Any = 0.0, *, path: Any = None
    ) -> float | NDArray[np.float64]:
        """Return the least time until a beam's point enters the outline, s; for a batch one each, of shape (B,)."""
        ranges = self._scan._checked(ranges)
        scans = self._scans(ranges, speed, yaw_rate, lateral_speed, path)
        each = [self._scan._one_number(self._nearest(*scan), index) for index, scan in enumerate(scans)]
        return each[0] if ranges.ndim == 1 else np.array(each, np.float64)

    def nearest(
        self, ranges: Any, speed: Any, yaw_rate: Any = 0.0, lateral_speed: Any = 0.0, *, path: Any = None
    ) -> Nearest | NearestBatch:
        """Return the beam whose point is hit first, and everything that says why, for each scan."""
        ranges = self._scan._checked(ranges)
        each = [self._nearest(*scan) for scan in self._scans(ranges, speed, yaw_rate, lateral_speed, path)]
        return each[0] if ranges.ndim == 1 else NearestBatch(each)

    def per_beam(
        self,
        ranges: Any,
        speed: Any,
        yaw_rate: Any = 0.0,
        lateral_speed: Any = 0.0,
        *,
        path: Any = None,
        out: Floats | None = None,
        status_out: NDArray[np.uint8] | None = None,
    ) -> Floats:
        """Return the time until each beam's point enters the outline, s, in the dtype of ``ranges``; else infinite."""
        ranges = self._scan._checked(ranges)
        scans = list(self._scans(ranges, speed, yaw_rate, lateral_speed, path))
        if status_out is not None:
            output("status_out", status_out, ranges, np.uint8)
        out = np.empty_like(ranges, subok=False) if out is None else output("out", out, ranges, ranges.dtype)
        for index, (scan, way) in enumerate(scans):
            ttc = self._every(scan, way)
            status = self._scan._statuses(scan, self._usable(scan) - self._scan._offset, ttc < np.inf)
            np.atleast_2d(out)[index] = ttc
            if status_out is not None:
                np.atleast_2d(status_out)[index] = status
        return out

    def unseen(
        self,
        speed: Any,
        yaw_rate: Any = 0.0,
        lateral_speed: Any = 0.0,
        *,
        ahead: Any,
        others: Sequence[ScanSweptPath] = (),
    ) -> float:
        """Return how wide the widest part of the path is at which no beam looks, m."""
        motion = Motion(finite("speed", speed), finite("yaw_rate", yaw_rate), finite("lateral_speed", lateral_speed))
        self._scan._closing(motion)
        Sweep(self._outline, self._horizon, motion)
        ahead = non_negative("ahead", ahead)
        by_each = [path._view.unseen(self._outline, motion, ahead) for path in (self, *others)]
        _, length, _ = leading_edge(self._outline, motion)
        return length * longest_run(np.all(by_each, axis=0)) / STRIPS

    def _usable(self, ranges: Floats) -> NDArray[np.float64]:
        """Return the range of each beam to compute with, m; NaN where there is none."""
        usable = self._scan._rules.usable(ranges).astype(np.float64)
        return np.where(np.isnan(self._scan._offset), np.nan, usable)

    def _scans(
        self, ranges: Floats, speed: Any, yaw_rate: Any, lateral_speed: Any, path: Any
    ) -> list[tuple[Floats, Way]]:
        """Return each scan with the way of the vehicle; all are checked first."""
        each = ways(self._outline, self._horizon, ranges, speed, yaw_rate, lateral_speed, path)
        for way in each:
            self._scan._closing(way.motion)
        return list(zip(np.atleast_2d(ranges), each, strict=True))

    def _every(self, ranges: Floats, way: Way) -> NDArray[np.float64]:
        """Return the time of each beam of a scan."""
        scan, usable = self._scan, self._usable(ranges)
        x, y = scan._mount.x + usable * scan._cos, scan._mount.y + usable * scan._sin
        sweep = Sweep(self._outline, self._horizon, way.motion)
        # Where the sensor is outside the outline, a reading of 0 touches the sensor, which may be anywhere.
        contact = (scan._offset > 0) & (usable - scan._offset <= 0) | sweep.is_inside(x, y)
        if way.path is None:
            return sweep.ttc(x, y, contact)
        return way.path.ttc(x, y, contact, way.speed, self._horizon)

    def _nearest(self, ranges: Floats, way: Way) -> Nearest:
        return self._scan._nearest_by(self._every(ranges, way), ranges, way.motion)
