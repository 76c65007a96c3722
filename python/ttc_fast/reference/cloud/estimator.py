"""``robust_min_x``: from the points inside a gate to one distance, by the estimator's idea of which are not real."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast._core import Cluster, InterquartileFence, KthSmallest, MeanOfLowest, Minimum, Quantile, Supported
from ttc_fast.reference.arguments import checked_threads
from ttc_fast.reference.cloud.cluster import nearest_cluster
from ttc_fast.reference.cloud.gate import candidates, checked_gate
from ttc_fast.reference.points import cloud
from ttc_fast.status import Detection

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ttc_fast._core import Gate
    from ttc_fast.reference.cloud.gate import Candidates
    from ttc_fast.reference.points import Cloud

    Doubles = NDArray[np.float64]
    Estimator = Minimum | KthSmallest | Quantile | MeanOfLowest | InterquartileFence | Supported | Cluster


@dataclass(frozen=True)
class MinX:
    """The robust nearest distance ahead, and the candidates that it rests on."""

    x: float
    """The estimate, m. NaN when there are too few candidates or no data, inf when clear."""
    nearest_x: float
    """The plain nearest candidate, m. inf when clear, NaN without data."""
    candidates: int
    """The number of points inside the gate."""
    support: int
    """The number of candidates that stand behind the estimate."""
    index: int
    """The index of the point that the estimate is; -1 where it is no single point."""
    detection: Detection
    """What was found."""


def robust_min_x(
    points: Any, *, gate: Gate | None = None, estimator: Estimator | None = None, threads: int = 1
) -> MinX:
    """Find the robust nearest distance ahead of the points inside a gate.

    Arguments, result and errors are those of ``ttc_fast.robust_min_x``.

    Examples
    --------
    >>> import numpy as np
    >>> from ttc_fast import reference
    >>> points = np.array([[3.0, 0.0, 0.5], [8.0, 0.1, 0.5], [8.1, 0.2, 0.5], [9.0, 5.0, 0.5]])
    >>> found = reference.robust_min_x(points, estimator=reference.KthSmallest(2))
    >>> found.x, found.nearest_x, found.candidates
    (8.0, 3.0, 3)
    """
    checked_threads(threads)  # the answer does not depend on them
    return nearest(cloud("points", points), checked_gate(gate), checked_estimator(estimator))


def nearest(cloud: Cloud, gate: Gate, estimator: Estimator) -> MinX:
    """Find the robust nearest distance ahead in a cloud of columns."""
    inside = candidates(cloud, gate)
    if not cloud.valid().any():
        return MinX(math.nan, math.nan, 0, 0, -1, Detection.NO_DATA)
    if len(inside.x) == 0:
        return MinX(math.inf, math.inf, 0, 0, -1, Detection.CLEAR)
    found = estimate(estimator, inside)
    nearest_x, count = float(inside.x[0]), len(inside.x)
    if found is None:
        return MinX(math.nan, nearest_x, count, 0, -1, Detection.TOO_FEW)
    return MinX(found.x, nearest_x, count, found.support, found.index, Detection.FOUND)


@dataclass(frozen=True)
class Estimate:
    """A distance, and the candidates that it rests on."""

    x: float
    """The distance, m."""
    index: int
    """The index of the point that the distance is; -1 where it is no single point."""
    support: int
    """The number of candidates that stand behind it."""


def checked_estimator(estimator: Any) -> Estimator:
    """Return the estimator; None stands for ``KthSmallest(10)``."""
    if estimator is None:
        return KthSmallest(10)
    if isinstance(
        estimator, Minimum | KthSmallest | Quantile | MeanOfLowest | InterquartileFence | Supported | Cluster
    ):
        return estimator
    raise TypeError(f"estimator must be an estimator object such as KthSmallest(10), got {estimator!r}")


def estimate(estimator: Estimator, candidates: Candidates) -> Estimate | None:
    """Estimate a distance; None if there are too few candidates for the estimator."""
    match estimator:
        case Minimum():
            return _kth_smallest(candidates, 1)
        case KthSmallest():
            return _kth_smallest(candidates, estimator.k)
        case Quantile():
            return _quantile(candidates, estimator.q)
        case MeanOfLowest():
            return _mean_of_lowest(candidates, estimator.k)
        case InterquartileFence():
            return _fenced(candidates, estimator.factor)
        case Supported():
            return _supported(candidates, estimator.points, estimator.gap)
        case Cluster():
            found = nearest_cluster(candidates.position, estimator.tolerance, estimator.min_points)
            return None if found is None else _single(candidates, *found)


def _kth_smallest(candidates: Candidates, k: int) -> Estimate | None:
    if len(candidates.x) < k:
        return None
    return Estimate(float(candidates.x[k - 1]), int(candidates.index[k - 1]), support=k)


def _quantile(candidates: Candidates, q: float) -> Estimate | None:
    if len(candidates.x) == 0:
        return None
    x = _order_statistic(candidates.x, q)
    return Estimate(x, index=-1, support=int(np.count_nonzero(candidates.x <= x)))


def _mean_of_lowest(candidates: Candidates, k: int) -> Estimate | None:
    if len(candidates.x) < k:
        return None
    with np.errstate(over="ignore"):
        mean = float(np.mean(candidates.x[:k]))
    # A sum beyond the largest number has a mean all the same.
    return Estimate(mean if math.isfinite(mean) else float(np.sum(candidates.x[:k] / k)), index=-1, support=k)


def _fenced(candidates: Candidates, factor: float) -> Estimate | None:
    """Find the nearest candidate not below Tukey's fence, ``factor`` interquartile ranges below the lower quartile."""
    if len(candidates.x) == 0:
        return None
    lower, upper = (_order_statistic(candidates.x, q) for q in (0.25, 0.75))
    spread = factor * (upper - lower)
    if not math.isfinite(upper - lower):  # the difference may be beyond the largest number, and 0 times that is none
        spread = factor * upper - factor * lower
    inside = np.flatnonzero(candidates.x >= lower - spread)
    return _single(candidates, inside[0], support=len(inside))


def _order_statistic(x: Doubles, q: float) -> float:
    """Give NumPy's quantile of sorted numbers, even if their difference is beyond the largest number."""
    with np.errstate(over="ignore", invalid="ignore"):
        quantile = float(np.quantile(x, q))
    if math.isfinite(quantile):
        return quantile
    place = q * (len(x) - 1)
    below = int(place)
    weight = place - below
    return float(x[below] * (1 - weight) + x[min(below + 1, len(x) - 1)] * weight)


def _supported(candidates: Candidates, points: int, gap: float) -> Estimate | None:
    """Find the nearest candidate with at least ``points`` candidates, itself included, in ``[x, x + gap]``."""
    x = candidates.x
    support = np.searchsorted(x, x + gap, side="right") - np.searchsorted(x, x, side="left")
    enough = np.flatnonzero(support >= points)
    return _single(candidates, enough[0], support[enough[0]]) if len(enough) > 0 else None


def _single(candidates: Candidates, nearest: np.intp | int, support: np.intp | int) -> Estimate:
    return Estimate(float(candidates.x[nearest]), int(candidates.index[nearest]), int(support))
