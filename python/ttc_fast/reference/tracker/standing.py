"""Whether a gap stands still: a line with fading memory is asked before any filter."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ttc_fast.reference.tracker.filters import Recursive
from ttc_fast.reference.tracker.noise import clipped

if TYPE_CHECKING:
    from ttc_fast.reference.tracker.filters import Measured, Posterior

MEMORY = 0.4
"""Of the line, s."""
SIGNIFICANT = 6.0
"""The line is not level when it rises or falls by this many standard deviations."""
TOGETHER = 0.1
"""Distances of so short a time count as one, s: the noise of a front edge that wanders does not average out in less."""
FRAMES = 30
"""For which the line remembers how much distances surprised it."""
MOST_SPREAD = 4.0
"""Surprises widen the doubt about its slope by no more than the root of this: it is no model of a car that brakes."""
PULL = 3.0
"""A lone distance pulls at it as if it were at most this many standard deviations away."""


class Standing:
    """The line, the surprise of the last distance, and the mean square of surprises."""

    def __init__(self) -> None:
        self.line = Recursive(speed_wander=0, acceleration_wander=0, acceleration=0, memory=MEMORY)
        self.last, self.spread = 0.0, 1.0

    def push(self, new: Measured) -> None:
        """Take a distance; no lone outlier may tilt the line."""
        if self.line.frames > 0:
            together = max(TOGETHER / (new.stamp - self.line.stamp), 1.0)
            new = replace(new, variance=new.variance * together)
        expected = self.line.at(new.stamp, 0.0)
        if expected is not None:
            deviation = math.sqrt(expected.covariance[0, 0] + new.variance)
            surprise = (new.distance - expected.mean[0]) / deviation
            alone = math.copysign(1.0, surprise) * self.last < PULL
            pull = float(np.clip(surprise, -PULL, PULL)) if alone else surprise
            self.last = surprise
            self.spread += (clipped(surprise) ** 2 - self.spread) / FRAMES
            new = replace(new, distance=expected.mean[0] + pull * deviation)
        self.line.push(new)

    def closes(self, posterior: Posterior, quantile: float, widening: float) -> bool:
        """Whether the gap closes, by what a filter believes of it.

        While the line may be level, the gap stands still. Once it is not, the filter decides; against the line, which
        is late, only if it is certain.
        """
        line = self.line.at(self.line.stamp, 0.0)
        assert line is not None
        spread = min(max(self.spread, 1.0), MOST_SPREAD)
        deviations = line.mean[1] / math.sqrt(line.covariance[1, 1] * spread * widening)
        significant = SIGNIFICANT * (1 + 4 / (self.line.frames - 2))  # a line through few frames proves less
        certain = posterior.mean[1] > quantile * math.sqrt(posterior.covariance[1, 1])
        return bool(deviations > significant or (deviations < -significant and certain))
