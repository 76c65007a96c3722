"""How noisy distances are, and whether the model follows them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from ttc_fast._core import EstimatedNoise
from ttc_fast.reference.arguments import finite

if TYPE_CHECKING:
    from collections.abc import Callable

NORMAL = 1.6448536269514722
"""The 95 % quantile of a normal distribution."""


class NoiseLevel:
    """The variance of one distance, given or learnt."""

    def __init__(self, noise: Any) -> None:
        self.estimated = noise if isinstance(noise, EstimatedNoise) else None
        if self.estimated:
            self.sum, self.weight = 3 * self.estimated.start**2, 3.0
        else:
            self.given = finite("noise", noise)
            if not self.given > 0:
                raise ValueError(f"noise must be above 0, got {noise}")

    @property
    def variance(self) -> float:
        """In m^2."""
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

    def learn(self, surprise: float) -> None:
        """Learn from a distance that surprised by so many standard deviations."""
        if self.estimated:
            kept = 1 - 1 / self.estimated.frames
            self.sum = self.sum * kept + clipped(surprise) ** 2 * self.variance
            self.weight = self.weight * kept + 1


class Whiteness:
    """Whether surprises are alike from frame to frame."""

    def __init__(self) -> None:
        self.last, self.products, self.squares = 0.0, 0.0, 10.0

    def learn(self, surprise: float) -> None:
        """Remember one more for some 30 frames."""
        kept = 1 - 1 / 30
        self.products = self.products * kept + clipped(surprise) * self.last
        self.squares = self.squares * kept + clipped(surprise) ** 2
        self.last = clipped(surprise)

    @property
    def factor(self) -> float:
        """By how much surprises that are alike spoil the variance of a mean."""
        alike = min(max(self.products / self.squares, 0.0), 0.9)
        return (1 + alike) / (1 - alike)


def clipped(surprise: float) -> float:
    """Count an outlier as 2.5 standard deviations: it is a sign of noise, but no measure of it."""
    return math.copysign(min(abs(surprise), 2.5), surprise)
