"""From matched positions to one scale, by the estimator's idea of which of them to trust."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast._core import Consensus, LeastSquares, MedianRatio, TrimmedMeanRatio
from ttc_fast.reference.consensus import agreed
from ttc_fast.reference.similarity import SAME_SPOT, centred, fitted, squared_residuals

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Doubles = NDArray[np.float64]
    ScaleEstimator = Consensus | LeastSquares | MedianRatio | TrimmedMeanRatio


@dataclass(frozen=True)
class Estimate:
    """A scale, and what it rests on."""

    scale: float
    spread: float
    """Standard error of it."""
    pairs: int
    """Ratios that it rests on."""
    support: int
    """Matches that stand behind it."""


def checked_scale_estimator(estimator: Any) -> ScaleEstimator:
    """Say how mismatches and background are survived."""
    if estimator is None:
        return Consensus()
    if isinstance(estimator, Consensus | LeastSquares | MedianRatio | TrimmedMeanRatio):
        return estimator
    raise TypeError(f"estimator must be an estimator object such as Consensus() or MedianRatio(), got {estimator!r}")


def estimate(estimator: ScaleEstimator, before: Doubles, now: Doubles, min_distance: float) -> Estimate | None:
    """Ask the estimator; None if too few matches or pairs count."""
    match estimator:
        case MedianRatio():
            every = ratios(before, now, min_distance)
            return _resting_on(before, now, every, float(np.median(every)) if len(every) else math.nan)
        case TrimmedMeanRatio():
            every = np.sort(ratios(before, now, min_distance))
            cut = int(estimator.share * len(every))
            left = every[cut : len(every) - cut]
            return _resting_on(before, now, left, float(left.mean()) if len(left) else math.nan)
        case LeastSquares():
            similarity = fitted(before, now)
            none = np.empty(0)
            return None if similarity is None else _resting_on(before, now, none, abs(similarity.turn))
        case Consensus():
            those = agreed(estimator, before, now)
            if those is None:
                return None
            every = ratios(before[those], now[those], min_distance)
            return _resting_on(before[those], now[those], every, float(every.mean()) if len(every) else math.nan)


def ratios(before: Doubles, now: Doubles, min_distance: float) -> Doubles:
    """How many times as far apart each pair ``i < j`` is now, of the pairs that count.

    A pair counts if it was apart, and is at least ``min_distance`` apart now.
    """
    i, j = np.triu_indices(len(before), k=1)
    squared_before, squared_now = _squared_distances(before, i, j), _squared_distances(now, i, j)
    count = (squared_before > SAME_SPOT) & (squared_now >= min_distance * min_distance)
    quotients: Doubles = np.sqrt(squared_now[count] / squared_before[count])
    return quotients


def _squared_distances(points: Doubles, i: Any, j: Any) -> Doubles:
    x, y = (points[j] - points[i]).T
    squared: Doubles = x * x + y * y
    return squared


def _resting_on(before: Doubles, now: Doubles, every: Doubles, scale: float) -> Estimate | None:
    if math.isnan(scale):
        return None
    return Estimate(scale, _spread(before, now, scale), len(every), len(before))


def _spread(before: Doubles, now: Doubles, scale: float) -> float:
    """Find how far the matches are from the scale, by the best turn and shift, over how far apart they are."""
    matches, freedom = centred(before, now), 2 * len(before) - 4
    if matches is None or freedom <= 0:
        return math.nan
    length = abs(matches.product)
    turn = matches.product / length * scale if length > 0 else complex(scale)
    squared = squared_residuals(matches.about(turn), before, now)
    return math.sqrt(float(squared.sum()) / freedom / matches.size)
