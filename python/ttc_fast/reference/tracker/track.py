"""One target: its filter, the noise of its distances, whether the model follows them, whether the gap is stationary."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from ttc_fast._core import (
    AlphaBeta,
    EstimatedNoise,
    KalmanCA,
    KalmanCV,
    MotionMixture,
    SlidingLine,
    SlidingParabola,
    TheilSen,
)
from ttc_fast.reference.arguments import positive
from ttc_fast.reference.tracker.bank import FilterBank
from ttc_fast.reference.tracker.filter import KalmanFilter
from ttc_fast.reference.tracker.window import Window

if TYPE_CHECKING:
    from collections.abc import Callable

    from ttc_fast.reference.tracker.filter import Measurement, Posterior

NORMAL = 1.6448536269514722
"""The 95 % quantile of a normal distribution."""
MEMORY = 0.4
"""Memory of the line of the stationary test, s."""
SIGNIFICANT = 6.0
"""The slope of the line is significant from this many standard deviations on."""
PROOF = 10
"""From this number of frames on a level line proves that the gap is stationary, against any filter."""
TOGETHER = 0.1
"""Distances within this time count as one, s: the noise of a front edge that drifts does not average out in less."""
FRAMES = 30
"""The frames that the mean square of innovations remembers."""
MOST_SPREAD = 4.0
"""The largest factor on the variance of the slope: the line is no model of a car that brakes."""
PULL = 3.0
"""An outlier pulls at the line as if it were at most this many standard deviations away."""


@dataclass(frozen=True)
class Innovation:
    """How a distance compares with what a track predicts."""

    value: float
    """The measured less the predicted distance, m."""
    normalized: float | None
    """The innovation in standard deviations of the noise alone, so that a bias of the model shows in it.

    None after a single frame.
    """
    in_gate: bool
    """Whether the distance is near enough to belong to the track."""


class Track:
    """A target that is followed."""

    def __init__(self, method: Any, first: Measurement) -> None:
        self.filter, self.stationary = filter_of(method), StationaryTest()
        self.correlation = InnovationCorrelation()
        self.consecutive_hits = 0
        self._push(first)

    @property
    def is_warming_up(self) -> bool:
        """Whether the track has seen too few frames to say anything."""
        return self.filter.frames < self.filter.needed

    def innovation(self, new: Measurement, noise: NoiseLevel, gate: float, max_speed: float) -> Innovation:
        """Compare a distance with the prediction; ``gate`` is in standard deviations."""
        predicted = self.filter.posterior(new.stamp, noise.variance)
        if predicted is None:
            value = new.distance - self.last.distance
            return Innovation(value, None, abs(value) <= max_speed * (new.stamp - self.last.stamp))
        value, variance = float(new.distance - predicted.mean[0]), float(predicted.covariance[0, 0])
        normalized = value / math.sqrt(variance - predicted.model_bias + new.variance)
        deviation = math.sqrt(variance * self.correlation.variance_factor + new.variance)
        return Innovation(value, normalized, abs(value) <= gate * deviation)

    def update(self, new: Measurement, innovation: Innovation) -> None:
        """Take a distance that belongs to the track."""
        if innovation.normalized is not None:
            self.correlation.learn(innovation.normalized)
        self._push(new)

    def _push(self, new: Measurement) -> None:
        self.filter.update(new)
        self.stationary.update(new)
        self.last = new
        self.consecutive_hits += 1

    def posterior(self, stamp: float, noise: NoiseLevel) -> Posterior | None:
        """Give distance and closing speed at ``stamp``, once the track has warmed up."""
        posterior = None if self.is_warming_up else self.filter.posterior(stamp, noise.variance)
        return posterior and replace(posterior, covariance=posterior.covariance * self.correlation.variance_factor)


class Filter(Protocol):
    """The filter of one target, by any method."""

    needed: int
    """The frames that an answer needs."""

    @property
    def frames(self) -> int:
        """The frames that the filter has seen, as far as it remembers them."""

    def update(self, new: Measurement) -> None:
        """Take a distance."""

    def posterior(self, stamp: float, variance: float) -> Posterior | None:
        """Say what the filter knows of ``stamp``, from two frames on; ``variance`` is that of distances without one."""


def filter_of(method: Any) -> Filter:
    """Return the filter of a method."""
    if isinstance(method, MotionMixture):
        return FilterBank(method.memory, method.scale)
    if isinstance(method, KalmanCA):
        return KalmanFilter(acceleration_noise=0, jerk_noise=method.jerk, acceleration=method.acceleration, memory=None)
    if isinstance(method, KalmanCV):
        return KalmanFilter(acceleration_noise=method.acceleration, jerk_noise=0, acceleration=0, memory=None)
    if isinstance(method, AlphaBeta):
        return KalmanFilter(acceleration_noise=0, jerk_noise=0, acceleration=method.acceleration, memory=method.memory)
    if isinstance(method, SlidingParabola):
        return Window(method.window, degree=2, unmodelled=method.jerk)
    if isinstance(method, SlidingLine):
        return Window(method.window, degree=1, unmodelled=method.acceleration)
    if isinstance(method, TheilSen):
        return Window(method.window, degree=1, unmodelled=method.acceleration, theil_sen=True)
    raise TypeError(f"method must be a method object such as MotionMixture() or KalmanCA(), got {method!r}")


def clipped(normalized: float) -> float:
    """Count an outlier as 2.5 standard deviations: it is a sign of noise, but no measure of it."""
    return math.copysign(min(abs(normalized), 2.5), normalized)


class NoiseLevel:
    """The variance of one distance, given or learnt."""

    def __init__(self, noise: Any) -> None:
        self.estimated = noise if isinstance(noise, EstimatedNoise) else None
        if self.estimated:
            self.sum, self.weight = 3 * self.estimated.start**2, 3.0
        else:
            self.given = positive("noise", noise)

    @property
    def variance(self) -> float:
        """The variance of one distance, m^2."""
        if not self.estimated:
            return self.given**2
        return max(self.sum / self.weight, (self.estimated.start / 30) ** 2)

    @property
    def quantile(self) -> float:
        """Half of a 90 % interval, in standard deviations: Student's where the noise is learnt."""
        if not self.estimated:
            return NORMAL
        # Abramowitz and Stegun 26.7.5.
        terms: list[Callable[[float], float]] = [
            lambda z: z,
            lambda z: (z**3 + z) / 4,
            lambda z: (5 * z**5 + 16 * z**3 + 3 * z) / 96,
            lambda z: (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384,
        ]
        return sum(term(NORMAL) / self.weight**power for power, term in enumerate(terms))

    def learn(self, normalized: float, variance: float) -> None:
        """Learn from the normalized innovation of a distance that was taken to have ``variance``."""
        if self.estimated:
            kept = 1 - 1 / self.estimated.frames
            self.sum = self.sum * kept + clipped(normalized) ** 2 * variance
            self.weight = self.weight * kept + 1


class InnovationCorrelation:
    """How alike normalized innovations are from frame to frame."""

    def __init__(self) -> None:
        self.last, self.products, self.squares = 0.0, 0.0, 10.0

    def learn(self, normalized: float) -> None:
        """Remember an innovation for some 30 frames."""
        kept = 1 - 1 / 30
        self.products = self.products * kept + clipped(normalized) * self.last
        self.squares = self.squares * kept + clipped(normalized) ** 2
        self.last = clipped(normalized)

    @property
    def variance_factor(self) -> float:
        """The factor on the variance of a mean of errors that correlate from one to the next."""
        correlation = min(max(self.products / self.squares, 0.0), 0.9)
        return (1 + correlation) / (1 - correlation)


class StationaryTest:
    """Tests whether a gap is stationary: a line with fading memory is asked before any filter."""

    def __init__(self) -> None:
        self.line = KalmanFilter(acceleration_noise=0, jerk_noise=0, acceleration=0, memory=MEMORY)
        self.last, self.spread = 0.0, 1.0

    def update(self, new: Measurement) -> None:
        """Take a distance; a single outlier may not tilt the line."""
        if self.line.frames > 0:
            together = max(TOGETHER / (new.stamp - self.line.stamp), 1.0)
            new = replace(new, variance=new.variance * together)
        predicted = self.line.posterior(new.stamp, 0.0)
        if predicted is not None:
            deviation = math.sqrt(predicted.covariance[0, 0] + new.variance)
            normalized = (new.distance - predicted.mean[0]) / deviation
            is_single = math.copysign(1.0, normalized) * self.last < PULL
            pull = float(np.clip(normalized, -PULL, PULL)) if is_single else normalized
            self.last = normalized
            self.spread += (clipped(normalized) ** 2 - self.spread) / FRAMES
            new = replace(new, distance=predicted.mean[0] + pull * deviation)
        self.line.update(new)

    @property
    def is_young(self) -> bool:
        """Whether a level line proves nothing yet."""
        return self.line.frames < PROOF

    def closes(self, posterior: Posterior, quantile: float, variance_factor: float) -> bool:
        """Whether the gap closes, by the posterior of a filter.

        While the line may be level, the gap is stationary. Once the line is not level, the filter decides; against the
        line, which is late, only if it is certain.
        """
        line = self.line.posterior(self.line.stamp, 0.0)
        assert line is not None
        spread = min(max(self.spread, 1.0), MOST_SPREAD)
        deviations = line.mean[1] / math.sqrt(line.covariance[1, 1] * spread * variance_factor)
        significant = SIGNIFICANT * (1 + 4 / (self.line.frames - 2))  # a line through few frames proves less
        speed = posterior.mean[1] / math.sqrt(posterior.covariance[1, 1])
        return bool(deviations > significant or (deviations < -significant and speed > quantile))
