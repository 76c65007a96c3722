"""The motion that the cells agree upon: where the body was in each frame, and how fast it is now."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ttc_fast.reference.alignment.weights import irls_weights, observe
from ttc_fast.reference.mixture import estimate

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from ttc_fast._core import Alignment
    from ttc_fast.reference.alignment.profile import Sighting
    from ttc_fast.reference.alignment.weights import CellObservations

    Doubles = NDArray[np.float64]

LEAST_WEIGHT = 1e-6
"""The weight of a frame whose cells say nothing, in points: its position is unknown, but not infinitely so."""


class Trend(NamedTuple):
    """The motion of a body at the last of its sightings."""

    distance: float
    """Distance of its edge, m."""
    closing_speed: float
    """Closing speed, m/s."""
    variance: float
    """Variance of the closing speed, m^2/s^2."""


def trend(sightings: Sequence[Sighting], settings: Alignment) -> Trend | None:
    """Find the motion of a body from its sightings; None where nothing tells it."""
    observed = observe(sightings)
    stamps = np.array([sighting.stamp for sighting in sightings])
    edges = np.array([sighting.edge for sighting in sightings])
    weight, x, noise, doubt = irls_weights(observed, len(sightings), settings.range_noise)
    position, covariance = positions(observed, weight, x, len(sightings))
    try:
        found = estimate(stamps - stamps[-1], position, noise * covariance + np.diag(doubt))
    except np.linalg.LinAlgError:  # squares of coordinates beyond 1e154 overflow
        return None
    return Trend(float(np.median(edges - position)) + found.position, -found.speed, found.ss)


def positions(observed: CellObservations, weight: Doubles, x: Doubles, frames: int) -> tuple[Doubles, Doubles]:
    """Return the position of the body in each frame, m, and the covariance of all for a point's variance of 1.

    It is the two-way least squares of frames and cells, with the cells eliminated: what is left are as many equations
    as there are frames. They say nothing about a common shift, so the weighted mean of the positions is taken to be 0.
    """
    cells = len(observed.level) + 1
    weights, sums = np.zeros((frames, cells)), np.zeros((frames, cells))
    np.add.at(weights, (observed.frame, observed.cell), weight)
    np.add.at(sums, (observed.frame, observed.cell), weight * x)
    of_cell = np.maximum(weights.sum(axis=0), 1e-12)
    of_frame = weights.sum(axis=1) + LEAST_WEIGHT
    normal = np.diag(of_frame) - (weights / of_cell) @ weights.T + np.outer(of_frame, of_frame) / of_frame.sum()
    right = (sums - weights * (sums.sum(axis=0) / of_cell)).sum(axis=1)
    inverse = np.linalg.inv(normal)
    return inverse @ right, inverse
