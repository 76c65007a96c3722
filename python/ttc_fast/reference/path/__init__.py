"""``SweptPath``: when static points first enter the moving vehicle."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ttc_fast._core import NoDataError
from ttc_fast.reference.arguments import checked_no_data, duration, output
from ttc_fast.reference.hit import Batch, Counts
from ttc_fast.reference.path.planned import PlannedPath
from ttc_fast.reference.path.sweep import Sweep
from ttc_fast.reference.points import frames
from ttc_fast.reference.vehicle import checked_outline, motions
from ttc_fast.status import Status

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from ttc_fast.reference.vehicle import Motion, Outline

    Floats = NDArray[np.floating[Any]]

LONGEST = 1e6
"""The longest horizon, s."""


@dataclass(frozen=True)
class NearestPoint:
    """The point that is hit first, and everything that says why."""

    ttc: float
    """The least time until a point enters the outline, s."""
    status: Status
    """What that time means."""
    index: int
    """The point that decided: the one of ``ttc``, else the first in contact, else -1."""
    x: float
    """Its x, m. Without a point it is NaN, as are ``y``, ``clearance`` and ``closing_speed``."""
    y: float
    """Its y, m."""
    clearance: float
    """The distance from the outline to the point, m; negative inside."""
    closing_speed: float
    """How fast the clearance shrinks now, m/s."""
    counts: Counts
    """How many points are ``valid``, ``invalid`` and in ``contact``; the rest is 0."""


class NearestPointBatch(Batch[NearestPoint]):
    """The ``NearestPoint`` of each frame of a batch."""

    def __init__(self, frames: Sequence[NearestPoint]) -> None:
        super().__init__(NearestPoint, frames)


class SweptPath:
    """Time until points enter the vehicle's outline, if it goes on moving as it does.

    Parameters, results and errors are those of ``ttc_fast.SweptPath``.

    Examples
    --------
    A corridor does not matter to a car that fits in it, and a post in front of it does:

    >>> import numpy as np
    >>> from ttc_fast import reference
    >>> path = reference.SweptPath((-0.1, 0.4, -0.15, 0.15))
    >>> walls = np.array([[x, y] for x in np.arange(0.0, 9.0, 0.1) for y in (-1.0, 1.0)])
    >>> path.min(walls, 5.0)
    inf
    >>> path.min(np.vstack([walls, [5.4, 0.1]]), 5.0)
    1.0
    """

    def __init__(
        self, outline: tuple[float, float, float, float], *, horizon: float = 5.0, no_data: float | None = None
    ) -> None:
        self._outline = checked_outline(outline)
        self._horizon = duration("horizon", horizon, LONGEST)
        self._no_data = checked_no_data(no_data)

    @property
    def outline(self) -> tuple[float, float, float, float]:
        """The outline it was made with, m."""
        return self._outline.x_rear, self._outline.x_front, self._outline.y_right, self._outline.y_left

    @property
    def horizon(self) -> float:
        """How far ahead it looks, s."""
        return self._horizon

    @property
    def no_data(self) -> float | None:
        """What ``min`` gives for a cloud without a valid point."""
        return self._no_data

    def min(
        self, points: Any, speed: Any, yaw_rate: Any = 0.0, lateral_speed: Any = 0.0, *, path: Any = None
    ) -> float | NDArray[np.float64]:
        """Return the least time until a point enters the outline, s; for a batch one each, float64 of shape (B,)."""
        clouds, is_batch = frames("points", points)
        results = [self._nearest(*each) for each in self._each(clouds, is_batch, speed, yaw_rate, lateral_speed, path)]
        ttc = [self._one_number(nearest, index) for index, nearest in enumerate(results)]
        return np.array(ttc, np.float64) if is_batch else ttc[0]

    def nearest(
        self, points: Any, speed: Any, yaw_rate: Any = 0.0, lateral_speed: Any = 0.0, *, path: Any = None
    ) -> NearestPoint | NearestPointBatch:
        """Return the point that is hit first, and everything that says why, for a cloud or each cloud of a batch."""
        clouds, is_batch = frames("points", points)
        results = [self._nearest(*each) for each in self._each(clouds, is_batch, speed, yaw_rate, lateral_speed, path)]
        return NearestPointBatch(results) if is_batch else results[0]

    def per_point(
        self,
        points: Any,
        speed: Any,
        yaw_rate: Any = 0.0,
        lateral_speed: Any = 0.0,
        *,
        path: Any = None,
        out: Floats | None = None,
        status_out: NDArray[np.uint8] | None = None,
    ) -> Floats:
        """Return the time until each point enters the outline, s, in the dtype of the points; else infinite."""
        clouds, is_batch = frames("points", points)
        each = list(self._each(clouds, is_batch, speed, yaw_rate, lateral_speed, path))
        like = clouds[:, 0] if is_batch else clouds[0, 0]
        if status_out is not None:
            output("status_out", status_out, like, np.uint8)
        out = np.empty_like(like) if out is None else output("out", out, like, like.dtype)
        for index, (cloud, way) in enumerate(each):
            ttc, status, _ = self._every(cloud, way)
            np.atleast_2d(out)[index] = ttc
            if status_out is not None:
                np.atleast_2d(status_out)[index] = status
        return out

    def _every(self, cloud: Floats, way: Way) -> tuple[NDArray[np.float64], NDArray[np.uint8], Sweep]:
        """Return the time and the status of each point of a cloud, shape (3, N)."""
        sweep = Sweep(self._outline, self._horizon, way.motion)
        valid = np.isfinite(cloud).all(axis=0) & (cloud != 0).any(axis=0)
        x, y = np.where(valid, cloud[:2], np.nan).astype(np.float64)
        inside = sweep.is_inside(x, y)
        ttc = sweep.ttc(x, y, inside) if way.path is None else way.path.ttc(x, y, inside, way.speed, self._horizon)
        # The first that holds.
        cases = {
            Status.INVALID: ~valid,
            Status.CONTACT: inside,
            Status.CLOSING: ttc < np.inf,
        }
        status = np.select(list(cases.values()), list(cases), Status.NOT_CLOSING)
        return ttc, status.astype(np.uint8), sweep

    def _nearest(self, cloud: Floats, way: Way) -> NearestPoint:
        ttc, status, sweep = self._every(cloud, way)
        valid, contacts = status != Status.INVALID, np.flatnonzero(status == Status.CONTACT)
        counts = Counts(
            valid=int(np.count_nonzero(valid)),
            invalid=int(np.count_nonzero(~valid)),
            too_close=0,
            no_return=0,
            out_of_range=0,
            beyond_limits=0,
            masked=0,
            contact=contacts.size,
        )
        # "When several hold the largest wins", among points that count.
        overall = Status(int(status[valid].max())) if valid.any() else Status.NO_DATA
        if (ttc < np.inf).any():
            index = int(ttc.argmin())
        elif contacts.size > 0:
            index = int(contacts[0])
        else:
            return NearestPoint(math.inf, overall, -1, math.nan, math.nan, math.nan, math.nan, counts)
        x, y = cloud[:2, index].astype(np.float64)
        clearance, closing_speed = sweep.approach(np.array([x]), np.array([y]))
        return NearestPoint(
            ttc=float(ttc[index]),
            status=overall,
            index=index,
            x=float(x),
            y=float(y),
            clearance=float(clearance[0]),
            closing_speed=float(closing_speed[0]),
            counts=counts,
        )

    def _one_number(self, nearest: NearestPoint, index: int) -> float:
        if nearest.status is not Status.NO_DATA:
            return nearest.ttc
        if self._no_data is None:
            raise NoDataError(f"no valid point in cloud {index}: a blind sensor is not free space")
        return self._no_data

    def _each(
        self, clouds: Floats, is_batch: bool, speed: Any, yaw_rate: Any, lateral_speed: Any, path: Any
    ) -> Iterator[tuple[Floats, Way]]:
        """Return each cloud with the way of the vehicle; all are checked first."""
        like = clouds[:, 0] if is_batch else clouds[0, 0]
        return zip(clouds, ways(self._outline, self._horizon, like, speed, yaw_rate, lateral_speed, path), strict=True)


class Way(NamedTuple):
    """How the vehicle goes on: by its motion, or along a path at a speed."""

    motion: Motion
    speed: float
    path: PlannedPath | None


def ways(
    outline: Outline, horizon: float, like: Floats, speed: Any, yaw_rate: Any, lateral_speed: Any, path: Any
) -> list[Way]:
    """Return how the vehicle goes on in each frame, if all make sense."""
    if path is None:
        found = [Way(motion, motion.speed, None) for motion in motions(like, speed, yaw_rate, lateral_speed)]
    else:
        if not all(np.ndim(each) == 0 and each == 0.0 for each in (yaw_rate, lateral_speed)):
            raise ValueError("path says where the vehicle goes: leave yaw_rate and lateral_speed out with it")
        planned = PlannedPath(outline, path)
        each = [motion.speed for motion in motions(like, speed, 0.0, 0.0)]
        found = [Way(planned.motion(speed), speed, planned) for speed in each]
    for way in found:
        Sweep(outline, horizon, way.motion)
    return found
