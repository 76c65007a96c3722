"""From a posterior of distance and closing speed to a time-to-collision with its interval."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ttc_fast.status import Status

if TYPE_CHECKING:
    from ttc_fast.reference.tracker.filter import Posterior


@dataclass(frozen=True)
class TrackedTTC:
    """Time-to-collision over several frames, with its 90 % intervals."""

    ttc: float
    """Time-to-collision, s, in [0, inf]; inf where nothing closes or too little is known."""
    ttc_interval: tuple[float, float] | None
    """Lower and upper end, s; the upper one is inf where the gap may not be closing."""
    distance: float
    """Distance to contact, m. NaN without a target, inf when clear."""
    closing_speed: float
    """Closing speed, m/s, positive when approaching. NaN while warming up and without a target."""
    closing_speed_interval: tuple[float, float] | None
    """Lower and upper end, m/s."""
    status: Status
    """What the numbers mean."""
    age: float = math.inf
    """The time since the newest measurement that was not the one before again, s; inf before the first."""


def nothing(status: Status, distance: float) -> TrackedTTC:
    """Give an answer without a motion: nothing is known but the status and perhaps a distance."""
    return TrackedTTC(math.inf, None, distance, math.nan, None, status)


def only_where(status: Status, distance: float) -> TrackedTTC:
    """Give an answer that knows no more than the distance. Contact outranks the status, as the more urgent news."""
    return nothing(Status.CONTACT if distance <= 0 else status, distance)


def of_posterior(posterior: Posterior, quantile: float, closes: bool) -> TrackedTTC:
    """Give the answer of a posterior; ``closes`` says whether the gap closes."""
    distance, speed = (float(value) for value in posterior.mean)
    half = quantile * math.sqrt(posterior.covariance[1, 1])
    if not np.isfinite([half, distance, speed]).all():
        return nothing(Status.INVALID, math.nan)
    if distance <= 0:
        ttc, status = (0.0 if speed > 0 else math.inf), Status.CONTACT
    elif closes:
        ttc, status = distance / speed, Status.CLOSING
    else:
        ttc, status = math.inf, Status.NOT_CLOSING
    low, high = map(bounded, ratio_interval(posterior, quantile))
    return TrackedTTC(ttc, (min(low, ttc), max(high, ttc)), distance, speed, (speed - half, speed + half), status)


def bounded(time: float) -> float:
    """Give the time, or infinity beyond some days: so slow a motion is none."""
    return math.inf if time > 1e6 else time


def ratio_interval(posterior: Posterior, quantile: float) -> tuple[float, float]:
    """Give the interval of all times ``T >= 0`` at which contact may be (Fieller 1954).

    At such a time ``distance - T speed`` is within ``quantile`` standard deviations of 0: ``g T^2 - 2 b T + c <= 0``.
    Where ``g`` is below 0, the closing speed may be 0, and there is no upper end.
    """
    outer = np.outer(posterior.mean, posterior.mean) - quantile**2 * posterior.covariance
    c, b, g = float(outer[0, 0]), float(outer[0, 1]), float(outer[1, 1])
    if posterior.mean[0] <= 0:
        c = 0.0
    root = math.sqrt(max(b * b - g * c, 0.0))
    if c <= 0:
        low = 0.0
    elif b > 0:
        low = c / (b + root)
    elif g < 0:
        low = (b - root) / g
    else:
        low = math.inf  # certainly opening
    return low, (b + root) / g if g > 0 and b + root > 0 else math.inf
