"""A bank of Kalman filters, averaged by their evidence.

Each filter has its own model of motion and its own guess at the noise. How well it predicted the newest distances is
its evidence, and older evidence fades (dynamic model averaging, Raftery, Karny and Ettler 2010).
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from ttc_fast.reference.mixture import MODELS, average
from ttc_fast.reference.tracker.filter import KalmanFilter, Posterior

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ttc_fast.reference.tracker.filter import Measurement

NOISES = ((0.3, 0.3), (0.4, 1.0), (0.3, 2.0))
"""Prior probability of each noise, and its standard deviation over the noise that is given or learnt."""
SPEED_NOISE = 0.03
"""How far the speed of the line drifts within one second, m/s: without that it would never forget."""


class FilterBank:
    """Kalman filters side by side, and how much each is believed."""

    needed = 3

    def __init__(self, memory: float, scale: float) -> None:
        self.memory = memory
        members = list(product(MODELS, NOISES))
        self.filters = [
            KalmanFilter(
                acceleration_noise=scale * (SPEED_NOISE if jerk == 0 else 0.0),
                jerk_noise=scale * math.sqrt(jerk),
                acceleration=scale * acceleration,
                memory=None,
            )
            for (_, acceleration, jerk), _ in members
        ]
        self.noises: NDArray[np.float64] = np.array([noise**2 for _, (_, noise) in members])
        self.prior: NDArray[np.float64] = np.log([model[0] * share for model, (share, _) in members])
        self.evidence = self.prior

    @property
    def frames(self) -> int:
        """How many frames the filters have seen."""
        return self.filters[0].frames

    def update(self, new: Measurement) -> None:
        """Take a distance into each filter, and learn how well it was predicted."""
        likelihood = np.zeros(len(self.filters))
        kept = math.exp(-(new.stamp - self.filters[0].stamp) / self.memory) if self.frames >= 2 else 1.0
        for i, (each, noise) in enumerate(zip(self.filters, self.noises, strict=True)):
            variance = new.variance * noise
            predicted = each.posterior(new.stamp, variance)
            if predicted is not None:
                total = predicted.covariance[0, 0] + variance
                # Lengths are in standard deviations of the noise.
                innovation = (new.distance - predicted.mean[0]) ** 2 / total
                likelihood[i] = -0.5 * (innovation + math.log(total / new.variance))
            each.update(replace(new, variance=variance))
        evidence = self.prior + kept * (self.evidence - self.prior) + likelihood
        self.evidence = evidence - evidence.max()

    def posterior(self, stamp: float, variance: float) -> Posterior | None:
        """Say what the mixture knows of ``stamp``, from two frames on."""
        parts = [part for each in self.filters if (part := each.posterior(stamp, variance)) is not None]
        if not parts:
            return None
        means, covariances = (np.array([getattr(part, name) for part in parts]) for name in ("mean", "covariance"))
        return Posterior(*average(self.evidence, means, covariances))
