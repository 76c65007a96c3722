"""Speed now from positions of the newest second, averaged over models of motion by their evidence.

A car does not move along a line or a parabola: its acceleration changes by 1 m/s^2 within half a second, or not at
all. So there are several models: a line, and on it an acceleration that begins with a given standard deviation and
changes as the integral of white jerk. Under each model the positions are jointly normal, so that the marginal
likelihood of what was measured and the speed now are both in closed form. The average over the models, weighed by their
likelihoods, is the estimate; its variance is that of the mixture.
"""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Doubles = NDArray[np.float64]

MODELS = ((0.3, 0.0, 0.0), (0.3, 0.5, 0.3), (0.3, 0.7, 3.0), (0.1, 3.0, 100.0))
"""Prior probability, sd of the acceleration at first (m/s^2) and density of the jerk (m^2/s^5) of each model."""
FRAME_NOISES = ((0.4, 0.3e-3), (0.4, 2e-3), (0.2, 6e-3))
"""Prior probability and sd (m) of the errors that are common to all of a frame."""
ROUNDING = 1e-9
"""A variance that keeps matrices regular, m^2."""
SYSTEMATIC = 0.015
"""The error of a speed as a share of it, which no number of frames averages out."""


class Kinematics(NamedTuple):
    """Position and speed at the newest frame, and the covariance of their errors."""

    position: float
    speed: float
    pp: float
    ps: float
    ss: float


def estimate(time: Doubles, measured: Doubles, covariance: Doubles, metre: float = 1.0) -> Kinematics:
    """Average over all models.

    Times are counted from now (s), so the last is 0. ``measured`` are positions, and ``covariance`` is that of their
    errors, up to a common shift. ``metre`` is the length of a metre in the unit of the positions.
    """
    evidence, means, covariances = [], [], []
    for (prior, acceleration, jerk), (share, noise) in product(MODELS, FRAME_NOISES):
        prior_covariance = metre**2 * _kernel(time, acceleration, jerk)
        total = prior_covariance[:-1, :-1] + covariance + metre**2 * (noise**2 + ROUNDING) * np.eye(len(time))
        log_evidence, mean, spread = _posterior(time, measured, total, prior_covariance)
        evidence.append(log_evidence + np.log(prior * share))
        means.append(mean)
        covariances.append(spread)
    mean, spread = average(np.array(evidence), np.array(means), np.array(covariances))
    position, speed = map(float, mean)
    return Kinematics(position, speed, spread[0, 0], spread[0, 1], spread[1, 1] + (SYSTEMATIC * speed) ** 2)


def average(evidence: Doubles, means: Doubles, covariances: Doubles) -> tuple[Doubles, Doubles]:
    """Return mean and covariance of a mixture whose parts are weighed by their evidence, a logarithm."""
    weight = np.exp(evidence - evidence.max())
    weight /= weight.sum()
    mean = weight @ means
    apart = means - mean
    return mean, np.einsum("i,ijk->jk", weight, covariances) + (weight * apart.T) @ apart


def _kernel(time: Doubles, acceleration: float, jerk: float) -> Doubles:
    """Return the covariance of the positions at all times, and then of the speed now, less the line.

    With white jerk the position is its threefold integral since the first time.
    """
    since = time - time[0]
    now = since[-1]
    earlier, apart = np.minimum.outer(since, since), np.abs(np.subtract.outer(since, since))
    left = now - since
    out = np.empty((len(time) + 1, len(time) + 1))
    out[:-1, :-1] = jerk / 4 * (earlier**5 / 5 + apart * earlier**4 / 2 + apart**2 * earlier**3 / 3)
    out[:-1, -1] = out[-1, :-1] = jerk * (since**4 / 8 + left * since**3 / 6)
    out[-1, -1] = jerk * now**3 / 3
    bend = np.append(since**2 / 2, now)
    return np.asarray(out + acceleration**2 * np.outer(bend, bend))


def _posterior(time: Doubles, position: Doubles, total: Doubles, kernel: Doubles) -> tuple[float, Doubles, Doubles]:
    """Return the log evidence of one model, and mean and covariance of position and speed now.

    The line has a flat prior, and is eliminated by generalized least squares.
    """
    factor = np.linalg.cholesky(total)
    line = np.column_stack([np.ones(len(time)), time])

    def whitened(values: Doubles) -> Any:
        return np.linalg.solve(factor, values)

    basis, seen, reached = whitened(line), whitened(position), whitened(kernel[:-1, -2:])
    normal = basis.T @ basis
    inverse = np.linalg.inv(normal)
    level = inverse @ (basis.T @ seen)
    left = seen - basis @ level
    evidence = -0.5 * left @ left - np.log(np.diag(factor)).sum() - 0.5 * np.log(np.linalg.det(normal))
    unexplained = np.eye(2) - basis.T @ reached
    spread = kernel[-2:, -2:] - reached.T @ reached + unexplained.T @ inverse @ unexplained
    return float(evidence), level + reached.T @ left, spread
