"""From the candidates to one distance, by the estimator's idea of which of them are not real."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast._core import Cluster, InterquartileFence, KthSmallest, MeanOfLowest, Minimum, Quantile, Supported

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ttc_fast.reference.gate import Candidates

    Doubles = NDArray[np.float64]
    Estimator = Minimum | KthSmallest | Quantile | MeanOfLowest | InterquartileFence | Supported | Cluster


@dataclass(frozen=True)
class Estimate:
    """A distance, and what it rests on."""

    x: float
    """m."""
    index: int
    """The point that it is; -1 where it is no single one."""
    support: int
    """How many candidates stand behind it."""


def estimate(estimator: Estimator, candidates: Candidates) -> Estimate | None:
    """Ask the estimator; None if there are too few candidates for it."""
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
            return _clustered(candidates, estimator.tolerance, estimator.min_points)


def checked_estimator(estimator: Any) -> Estimator:
    """Say how outliers are survived."""
    if estimator is None:
        return KthSmallest(10)
    if isinstance(
        estimator, Minimum | KthSmallest | Quantile | MeanOfLowest | InterquartileFence | Supported | Cluster
    ):
        return estimator
    raise TypeError(f"estimator must be an estimator object such as KthSmallest(10), got {estimator!r}")


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
    """Tukey's fence: what lies further below the lower quartile than ``factor`` interquartile ranges is an outlier."""
    if len(candidates.x) == 0:
        return None
    lower, upper = (_order_statistic(candidates.x, q) for q in (0.25, 0.75))
    spread = factor * (upper - lower)
    if not math.isfinite(upper - lower):  # the difference may be beyond the largest number, and 0 times that is none
        spread = factor * upper - factor * lower
    inside = np.flatnonzero(candidates.x >= lower - spread)
    return _single(candidates, inside[0], support=len(inside))


def _order_statistic(x: Doubles, q: float) -> float:
    """Give NumPy's quantile of sorted numbers, also of some whose difference is beyond the largest number."""
    with np.errstate(over="ignore", invalid="ignore"):
        quantile = float(np.quantile(x, q))
    if math.isfinite(quantile):
        return quantile
    place = q * (len(x) - 1)
    below = int(place)
    weight = place - below
    return float(x[below] * (1 - weight) + x[min(below + 1, len(x) - 1)] * weight)


def _supported(candidates: Candidates, points: int, gap: float) -> Estimate | None:
    """Find the nearest with at least ``points`` candidates, itself included, in ``[x, x + gap]``."""
    x = candidates.x
    support = np.searchsorted(x, x + gap, side="right") - np.searchsorted(x, x, side="left")
    enough = np.flatnonzero(support >= points)
    return _single(candidates, enough[0], support[enough[0]]) if len(enough) > 0 else None


def _clustered(candidates: Candidates, tolerance: float, min_points: int) -> Estimate | None:
    """Find the nearest point of the nearest cluster that is large enough."""
    free = np.ones(len(candidates.x), np.bool_)
    for seed in range(len(free)):
        support = _cluster(candidates.position, seed, tolerance, free) if free[seed] else 0
        if support >= min_points:
            return _single(candidates, seed, support)
    return None


def _cluster(position: Doubles, seed: int, tolerance: float, free: NDArray[np.bool_]) -> int:
    """Take from ``free`` all points that a chain of steps of at most ``tolerance`` links to one; how many they are."""
    free[seed] = False
    found = [seed]
    for point in found:
        linked = free & (_squared_distances(position, position[point]) <= tolerance * tolerance)
        free[linked] = False
        found.extend(np.flatnonzero(linked).tolist())
    return len(found)


def _squared_distances(position: Doubles, point: Doubles) -> Doubles:
    with np.errstate(over="ignore", under="ignore"):
        x, y, z = (position - point).T
        squared: Doubles = x * x + y * y + z * z
    return squared


def _single(candidates: Candidates, nearest: np.intp | int, support: np.intp | int) -> Estimate:
    return Estimate(float(candidates.x[nearest]), int(candidates.index[nearest]), int(support))
