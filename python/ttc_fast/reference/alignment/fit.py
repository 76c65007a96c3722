"""The motion that the cells agree upon.

All cells share one motion, so the regression is within cells: time and distance less their means in each cell.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ttc_fast.reference.alignment.weights import irls_weights, observe

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from ttc_fast._core import Alignment
    from ttc_fast.reference.alignment.profile import Sighting
    from ttc_fast.reference.alignment.weights import CellObservations

    Doubles = NDArray[np.float64]

MISFIT = 2.0
"""Frames whose residuals exceed this times their scatter, as a ratio of variances, have no single acceleration."""
FEWEST = 3
"""The fewest frames that a window is shortened to."""
RUN = 4
"""The frames of a third difference."""
MEDIAN_SQUARE = 0.4549
"""The median of the square of a normal number."""
ACCELERATION = 5.0
"""Standard deviation of an acceleration where there is one, m/s^2; hard braking is 2 of them."""
ACCELERATES = 0.1
"""The prior probability that there is an acceleration."""
KNOWN_FIT = 2.0
"""The prior weight, in frames, of the belief that frames differ no more than their points."""
SYSTEMATIC = 0.003
"""The error of a closing speed as a share of it, because rings pass from cell to cell."""


class Trend(NamedTuple):
    """The motion of a body at the last of its sightings."""

    distance: float
    """Distance of its edge, m."""
    closing_speed: float
    """Closing speed, m/s."""
    variance: float
    """Variance of the closing speed, m^2/s^2."""


def trend(sightings: Sequence[Sighting], settings: Alignment) -> Trend | None:
    """Find the motion of a body from its sightings; None where nothing tells it.

    Where the frames do not move by one acceleration, the oldest are left out.
    """
    observed = observe(sightings)
    stamps = np.array([sighting.stamp for sighting in sightings])
    edges = np.array([sighting.edge for sighting in sightings])
    time = stamps - stamps[-1]
    weight, x, position, noise = irls_weights(observed, len(sightings), settings.range_noise)
    total = np.maximum(np.bincount(observed.frame, weight, len(sightings)), 1e-12)
    scatter = _scatter(time, position, total, noise)
    for first in range(len(sightings)):
        fit = _fit(observed, time, weight * (observed.frame >= first), x, (noise, scatter), len(sightings) - first)
        if fit is None or fit.misfit <= MISFIT * scatter or len(sightings) - first <= FEWEST:
            break
    if fit is None:
        return None
    moved = fit.speed * time + fit.bend * time**2
    return Trend(float(np.median(edges - moved)), -fit.speed, fit.variance)


def _scatter(time: Doubles, position: Doubles, total: Doubles, noise: float) -> float:
    """Find the scatter of whole frames over that of their points, as a ratio of variances; at least 1.

    A car that nods sees the body at other heights in each frame, and all cells are off together. Of four frames in a
    row, the part of the motion that no parabola has (their third difference) should be no more than their points make
    it. Where a driver begins to brake only the few differences across that moment are larger.
    """
    ratios = []
    for first in range(len(time) - RUN + 1):
        run = slice(first, first + RUN)
        if (total[run] <= 1e-9).any():
            continue
        apart = np.subtract.outer(time[run], time[run])
        np.fill_diagonal(apart, 1.0)
        with np.errstate(all="ignore"):
            product = apart.prod(axis=1)
            ratio = (position[run] / product).sum() ** 2 / (noise / (product**2 * total[run])).sum()
        if np.isfinite(ratio):
            ratios.append(ratio)
    if not ratios:
        return 1.0
    count, typical = len(ratios), float(np.median(ratios)) / MEDIAN_SQUARE
    return max((KNOWN_FIT + count * typical) / (KNOWN_FIT + count), 1.0)


class Fit(NamedTuple):
    """A motion ``speed t + bend t^2``, and the variance of its speed."""

    speed: float
    bend: float
    variance: float
    misfit: float
    """The residuals of frames over what their points explain, as a ratio of variances."""


def _fit(
    observed: CellObservations, time: Doubles, weight: Doubles, x: Doubles, noises: tuple[float, float], frames: int
) -> Fit | None:
    """Regress within cells: a line and a parabola, averaged by their probabilities.

    ``noises`` are the variance of a point and the scatter of frames.
    """
    noise, scatter = noises
    cells = len(observed.level) + 1
    total = np.maximum(np.bincount(observed.cell, weight, cells), 1e-12)

    def within(values: Doubles) -> Doubles:
        return values - (np.bincount(observed.cell, weight * values, cells) / total)[observed.cell]

    y, t, q = within(x), within(time[observed.frame]), within(time[observed.frame] ** 2)
    tt, tq, qq = float(weight @ (t * t)), float(weight @ (t * q)), float(weight @ (q * q))
    ty, qy = float(weight @ (t * y)), float(weight @ (q * y))
    if tt <= 1e-12:
        return None

    def misfit(residual: Doubles, free: int) -> float:
        """Compare the residuals of frames with what their points explain, as a ratio of variances."""
        sums = np.maximum(np.bincount(observed.frame, weight, len(time)), 1e-12)
        means = np.bincount(observed.frame, weight * residual, len(time)) / sums
        return float((KNOWN_FIT + (sums @ means**2) / noise) / (KNOWN_FIT + free))

    line = ty / tt
    # The precision of the bend once the line is taken out, and that precision times the bend.
    known, weighted = max(qq - tq * tq / tt, 0.0) / noise, (qy - tq * ty / tt) / noise
    worse = 1.0
    if frames > 3 and known > 0.0:
        bend = weighted / known
        worse = misfit(y - (ty - tq * bend) / tt * t - bend * q, frames - 3)
    scale = max(worse, scatter)
    known, weighted = known / scale, weighted / scale
    # x bends by half the acceleration.
    expected = 4.0 / ACCELERATION**2
    sure = known + expected
    bend = weighted / sure
    parabola = (ty - tq * bend) / tt
    odds = (
        ACCELERATES
        / (1.0 - ACCELERATES)
        * np.sqrt(expected / sure)
        * np.exp(min(weighted * weighted / sure / 2.0, 300.0))
    )
    share = float(odds / (1.0 + odds))
    spread = scale * noise / tt
    variance = (
        spread
        + (SYSTEMATIC * line) ** 2
        + share * (tq / tt) ** 2 / sure
        + share * (1.0 - share) * (parabola - line) ** 2
    )
    return Fit((1.0 - share) * line + share * parabola, share * bend, variance, worse)
