"""Time-to-collision from how a thing grows in the picture, with no distance at all.

- ``matches``: which matched keypoints count
- ``pairs``: how many times as far apart each pair of them is now
- ``similarity`` and ``consensus``: which matches move as one body
- ``estimator``: from matches to one scale
- ``spread``: the standard error of the scale, and a fit that allows for strain
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ttc_fast.reference.arguments import checked_dt, checked_threads, non_negative, positive
from ttc_fast.reference.camera.estimator import checked_scale_estimator, estimate
from ttc_fast.reference.camera.matches import matches
from ttc_fast.status import Status

if TYPE_CHECKING:
    from ttc_fast.reference.camera.estimator import ScaleEstimator


QUANTILE = 1.6448536269514722
"""Half a 90 % interval in standard deviations of a normal number."""


@dataclass(frozen=True)
class KeypointTTC:
    """Time-to-collision from matched keypoints, and the scale that it rests on."""

    ttc: float
    """Time-to-collision, s, in [0, inf]; inf where nothing closes or too little is known."""
    status: Status
    """What the numbers mean."""
    scale: float
    """The size in the picture now over the size before. NaN without a scale."""
    spread: float
    """The standard error of the scale. NaN with fewer than three matches."""
    ttc_interval: tuple[float, float] | None
    """Lower and upper end of the 90 % interval, s, in [0, inf]. None without a spread."""
    pairs: int
    """The number of pairs in support that count; 0 for an estimator that asks for none."""
    matches: int
    """The number of matches that count: those whose four numbers are positions."""
    support: int
    """The number of matches that stand behind the scale."""


def ttc_from_scale(scale: float, dt: float) -> float:
    """Time-to-collision from the size of a thing in the picture over its size ``dt`` seconds before, s.

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
    """Time-to-collision from two heights of one thing in the picture, ``dt`` seconds apart, s.

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
    """Time-to-collision from keypoints matched between two pictures taken ``dt`` seconds apart.

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
    before, now = matches(previous, current)
    if len(before) == 0:
        return KeypointTTC(math.inf, Status.NO_DATA, math.nan, math.nan, None, 0, 0, 0)
    found = estimate(estimator, before, now, min_distance)
    if found is None:
        return KeypointTTC(math.inf, Status.TOO_FEW, math.nan, math.nan, None, 0, len(before), 0)
    ttc = _time(found.scale, dt)
    status = Status.CLOSING if ttc < math.inf else Status.NOT_CLOSING
    half = QUANTILE * found.spread
    interval = None if math.isnan(half) else (_time(found.scale + half, dt), _time(found.scale - half, dt))
    return KeypointTTC(ttc, status, found.scale, found.spread, interval, found.pairs, len(before), found.support)


def _time(scale: float, dt: float) -> float:
    return dt / (scale - 1.0) if scale > 1.0 else math.inf
