"""From matches to one scale, by the estimator's idea of which of them to trust."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast._core import Consensus, LeastSquares, MedianRatio, TrimmedMeanRatio
from ttc_fast.reference.camera.consensus import inliers
from ttc_fast.reference.camera.pairs import ratios, sampled_ratios
from ttc_fast.reference.camera.similarity import fitted, lanes_of
from ttc_fast.reference.camera.spread import spread, strained

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Doubles = NDArray[np.float64]
    ScaleEstimator = Consensus | LeastSquares | MedianRatio | TrimmedMeanRatio


@dataclass(frozen=True)
class Estimate:
    """A scale, and the matches that it rests on."""

    scale: float
    """The size now over the size before."""
    spread: float
    """The standard error of the scale."""
    pairs: int
    """The number of pairs in support that count."""
    support: int
    """The number of matches that stand behind it."""


def checked_scale_estimator(estimator: Any) -> ScaleEstimator:
    """Return the estimator; None stands for ``Consensus()``."""
    if estimator is None:
        return Consensus()
    if isinstance(estimator, Consensus | LeastSquares | MedianRatio | TrimmedMeanRatio):
        return estimator
    raise TypeError(f"estimator must be an estimator object such as Consensus() or MedianRatio(), got {estimator!r}")


def estimate(estimator: ScaleEstimator, before: Doubles, now: Doubles, min_distance: float) -> Estimate | None:
    """Estimate a scale; None if too few matches or pairs count."""
    match estimator:
        case MedianRatio():
            every = ratios(before, now, min_distance)
            return _estimate_by(before, now, every, float(np.median(every)) if len(every) else math.nan)
        case TrimmedMeanRatio():
            every = np.sort(sampled_ratios(before, now, min_distance))
            cut = int(estimator.share * len(every))
            left = every[cut : len(every) - cut]
            return _estimate_by(before, now, left, float(left.mean()) if len(left) else math.nan)
        case LeastSquares():
            similarity = fitted(before, now, lanes_of(before))
            none = np.empty(0)
            return None if similarity is None else _estimate_by(before, now, none, abs(similarity.turn))
        case Consensus():
            those = inliers(estimator, before, now)
            if those is None:
                return None
            every = ratios(before[those], now[those], min_distance)
            refined = strained(before[those], now[those], lanes_of(before)[those])
            if refined is None or len(every) == 0:
                return None
            return Estimate(refined.scale, refined.spread, len(every), int(those.sum()))


def _estimate_by(before: Doubles, now: Doubles, every: Doubles, scale: float) -> Estimate | None:
    if math.isnan(scale):
        return None
    return Estimate(scale, spread(before, now, scale), len(every), len(before))
