"""``ttc_from_scale``, ``ttc_from_heights`` and ``ttc_from_keypoints``: time-to-collision with no distance at all."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast.reference.arguments import checked_dt, checked_threads, non_negative, positive
from ttc_fast.reference.scales import checked_scale_estimator, estimate
from ttc_fast.status import Status

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ttc_fast.reference.scales import ScaleEstimator

FARTHEST = 1e9
"""No picture is this wide, px: what lies farther out is not a position."""


@dataclass(frozen=True)
class KeypointTTC:
    """Time-to-collision from matched keypoints, and what it rests on."""

    ttc: float
    """s, in [0, inf]; inf where nothing closes or too little is known."""
    status: Status
    """What it means."""
    scale: float
    """How many times as large the thing looks now. NaN without one."""
    spread: float
    """Standard error of the scale. NaN with fewer than three matches."""
    pairs: int
    """Ratios of distances that the scale rests on; 0 for an estimator that needs none."""
    matches: int
    """Matches that count: those whose four numbers are positions."""
    support: int
    """How many of them stand behind the scale."""


def ttc_from_scale(scale: float, dt: float) -> float:
    """Time-to-collision by how many times as large a thing looks as ``dt`` seconds before.

    Arguments, result and errors are those of ``ttc_fast.ttc_from_scale``.

    Examples
    --------
    >>> from ttc_fast import reference
    >>> round(reference.ttc_from_scale(1.05, 0.1), 6)
    2.0
    """
    scale, dt = positive("scale", scale), checked_dt(dt)
    return _time(scale, dt)


def ttc_from_heights(previous: float, current: float, dt: float) -> float:
    """Time-to-collision by two heights of the same thing in the picture, ``dt`` seconds apart.

    Arguments, result and errors are those of ``ttc_fast.ttc_from_heights``.

    Examples
    --------
    >>> from ttc_fast import reference
    >>> round(reference.ttc_from_heights(100.0, 105.0, 0.1), 6)
    2.0
    """
    previous, current, dt = positive("previous", previous), positive("current", current), checked_dt(dt)
    grown = current - previous
    return previous * (dt / grown) if grown > 0 else math.inf


def ttc_from_keypoints(
    previous: Any,
    current: Any,
    dt: float,
    *,
    min_distance: float = 100.0,
    estimator: ScaleEstimator | None = None,
    threads: int = 1,
) -> KeypointTTC:
    """Time-to-collision by keypoints matched between two pictures taken ``dt`` seconds apart.

    Arguments, result and errors are those of ``ttc_fast.ttc_from_keypoints``.

    Examples
    --------
    >>> import numpy as np
    >>> from ttc_fast import reference
    >>> corners = np.array([[500.0, 150.0], [700.0, 150.0], [700.0, 300.0], [500.0, 300.0]])
    >>> seen = reference.ttc_from_keypoints(corners, 1.05 * corners, 0.1)
    >>> round(seen.ttc, 6), seen.status.name, seen.pairs
    (2.0, 'CLOSING', 6)
    """
    checked_threads(threads)  # the answer does not depend on them
    dt, min_distance = checked_dt(dt), non_negative("min_distance", min_distance)
    estimator = checked_scale_estimator(estimator)
    before, now = _matches(previous, current)
    if len(before) == 0:
        return KeypointTTC(math.inf, Status.NO_DATA, math.nan, math.nan, 0, 0, 0)
    found = estimate(estimator, before, now, min_distance)
    if found is None:
        return KeypointTTC(math.inf, Status.TOO_FEW, math.nan, math.nan, 0, len(before), 0)
    ttc = _time(found.scale, dt)
    status = Status.CLOSING if ttc < math.inf else Status.NOT_CLOSING
    return KeypointTTC(ttc, status, found.scale, found.spread, found.pairs, len(before), found.support)


def _time(scale: float, dt: float) -> float:
    return dt / (scale - 1.0) if scale > 1.0 else math.inf


def _matches(previous: Any, current: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions before and now of the matches that count, in float64."""
    before, now = _positions("previous", previous), _positions("current", current)
    if before.dtype != now.dtype:
        raise TypeError(f"previous and current must have the same dtype, got {before.dtype} and {now.dtype}")
    if len(before) != len(now):
        raise ValueError(f"current must have one row for each of previous, which has {len(before)}, got {len(now)}")
    numbers = np.hstack([before, now]).astype(np.float64)
    # Neither NaN nor inf is that near.
    count = (np.abs(numbers) <= FARTHEST).all(axis=1)
    return numbers[count, :2], numbers[count, 2:]


def _positions(argument: str, points: Any) -> NDArray[Any]:
    if not isinstance(points, np.ndarray):
        try:
            points = memoryview(points)
        except TypeError:
            raise TypeError(f"{argument} must be a numpy array or a buffer, got {type(points).__name__}") from None
    array: NDArray[Any] = np.asarray(points)
    if array.ndim == 3 and array.shape[1] == 1:
        array = array[:, 0]
    if array.ndim != 2 or array.shape[1] != 2:
        raise ValueError(f"{argument} must have shape (N, 2), one x and y in pixels for each match, got {array.shape}")
    if array.dtype not in (np.float32, np.float64):
        raise TypeError(f"{argument} must have dtype float32 or float64, got {array.dtype}")
    return array
