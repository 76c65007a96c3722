"""``ScaleTracker``: time-to-collision from how a target grows in the picture, with distances where there are any.

The state is distance, closing speed and closing acceleration. A scale tells the mean closing speed since the update
before, as a share of the distance now: ``(scale - 1) / dt``. A displacement tells it in metres. Both are linear in the
state, as a distance is, so that one bank of Kalman filters takes all three. As long as no distance was given, its unit
is free: after each update the distance is known, and is what the settings say.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from ttc_fast.reference.arguments import non_negative, number, positive, shows_settings
from ttc_fast.reference.mixture import MODELS, SYSTEMATIC, average
from ttc_fast.reference.tracker.answer import TrackedTTC, nothing, of_posterior, only_where
from ttc_fast.reference.tracker.bank import SPEED_NOISE
from ttc_fast.reference.tracker.filter import KalmanFilter, Posterior
from ttc_fast.reference.tracker.track import NORMAL
from ttc_fast.status import Status

MEMORY = 1.0
"""Time in which evidence falls to 1/e, s."""
NOISES = ((0.3, 0.5), (0.4, 1.0), (0.3, 2.0))
"""Prior probability of each noise, and its standard deviation over the standard error that is given."""
FASTEST = 50.0
"""Standard deviation of the closing speed before anything is measured, m/s."""
PULL = 3.0
"""An outlier pulls as if it were at most this many standard deviations away."""
OTHER = 6.0
"""A distance this many standard deviations away is that of another target."""
DISTANCES = 3
"""The distances that tell a motion, and those in a row that are too far away before they make another target."""
LEAST_SPREAD = 1e-6
"""No scale is more certain than this."""
SHARED = 0.05
"""The error that all scales of a target share is at least this part of ``scale - 1``."""
SHARED_OF_SPREAD = 0.5
"""It is at least this part of their standard error, too."""
SHARED_FOR = 0.5
"""Where there are other measurements, that error counts as if it changed after this time, s."""


@dataclass(frozen=True)
class _Linear:
    """A measurement of ``h @ state``, with its variance by the given standard error."""

    h: tuple[float, float, float]
    value: float
    variance: float
    systematic: float = 0.0


class _Member:
    """A Kalman filter of the bank, and the logarithm of its evidence."""

    def __init__(self, model: tuple[float, float, float], noise: tuple[float, float], distance: float) -> None:
        (share, acceleration, jerk), (part, factor) = model, noise
        self.prior = self.evidence = math.log(share * part)
        self.noise = factor**2
        self.before = distance
        self.filter = KalmanFilter(
            acceleration_noise=SPEED_NOISE if jerk == 0 else 0.0,
            jerk_noise=math.sqrt(jerk),
            acceleration=acceleration,
            memory=None,
        )
        self.begin(distance, 0.0)

    def begin(self, distance: float, noise: float) -> None:
        """Begin with a distance, and no idea of a motion."""
        self.filter.mean = np.array([distance, 0.0, 0.0])
        self.filter.covariance = np.diag([noise**2, FASTEST**2, self.filter.acceleration])

    def predict(self, stamp: float) -> None:
        self.filter.mean, self.filter.covariance = self.filter._predict(stamp)
        self.filter.stamp = stamp

    def correct(self, new: _Linear) -> None:
        """Correct the state, and learn how well it was predicted."""
        mean, covariance = self.filter.mean, self.filter.covariance
        h = np.array(new.h)
        reach = covariance @ h
        innovation = new.value - h @ mean
        total = max(h @ reach + new.variance * self.noise + new.systematic, (innovation / PULL) ** 2)
        self.filter.mean = mean + reach / total * innovation
        self.filter.covariance = covariance - np.outer(reach, reach) / total
        # The logarithm of the likelihood, in standard errors of the measurement.
        self.evidence -= 0.5 * (innovation**2 / total + math.log(total / (new.variance + new.systematic)))

    def scaled(self, distance: float, noise: float) -> None:
        """Let the distance now be ``distance``, with a standard error."""
        (z, v, a), covariance = self.filter.mean, self.filter.covariance
        if z <= 0 or distance <= 0:
            self.begin(distance, noise)
            return
        share = np.array([1.0, v / z, a / z])
        relative = (np.eye(3) - np.outer(share, [1, 0, 0])) * distance / z
        self.filter.mean = share * distance
        self.filter.covariance = relative @ covariance @ relative.T + np.outer(share, share) * noise**2
        if noise > 0:
            self.filter.covariance[1, 1] += (SHARED * self.filter.mean[1]) ** 2


@shows_settings("distance", "max_gap", "min_closing_speed")
class ScaleTracker:
    """Time-to-collision over several pictures, from scales, and from distances and displacements where there are any.

    Arguments, results and errors are those of ``ttc_fast.ScaleTracker``. Its state is all that it has seen.

    Examples
    --------
    >>> from ttc_fast import reference
    >>> tracker = reference.ScaleTracker()
    >>> for frame in range(6):
    ...     scale = (10.5 - 0.5 * frame) / (10.0 - 0.5 * frame) if frame else None
    ...     result = tracker.update(scale, 0.1 * frame, 1e-4)
    >>> round(result.ttc, 2), result.status.name
    (1.5, 'CLOSING')
    """

    def __init__(self, distance: float = 10.0, *, max_gap: float = 1.0, min_closing_speed: float = 0.05) -> None:
        self._distance = positive("distance", distance)
        self._max_gap = positive("max_gap", max_gap)
        self._min_closing_speed = non_negative("min_closing_speed", min_closing_speed)
        self._settings = {"distance": distance, "max_gap": max_gap, "min_closing_speed": min_closing_speed}
        self._frames: list[tuple[Any, ...]] = []
        self._origin: float | None = None
        self._newest = 0.0
        self._answer = nothing(Status.NO_DATA, math.nan)
        self._forget()

    def update(
        self,
        scale: float | None,
        stamp: float,
        spread: float | None = None,
        *,
        distance: float | None = None,
        distance_noise: float | None = None,
        displacement: float | None = None,
        displacement_noise: float | None = None,
    ) -> TrackedTTC:
        """Give the answer after one more picture."""
        stamp = number("stamp", stamp)
        scale, spread = _pair("scale", scale, "spread", spread)
        distance, distance_noise = _pair("distance", distance, "distance_noise", distance_noise)
        displacement, displacement_noise = _pair("displacement", displacement, "displacement_noise", displacement_noise)
        seconds = stamp - (stamp if self._origin is None else self._origin)
        if not math.isfinite(seconds) or (self._origin is not None and seconds <= self._newest):
            return replace(self._answer, status=Status.INVALID)
        self._frames.append((scale, stamp, spread, distance, distance_noise, displacement, displacement_noise))
        is_first, dt = self._origin is None, seconds - self._newest
        if self._origin is None:
            self._origin = stamp
        self._newest = seconds
        if seconds - self._measured > self._max_gap:
            self._forget()
            is_first = True
        self._predict(dt)
        if is_first:
            scale = displacement = math.nan
        self._take(dt, (scale, spread), (displacement, displacement_noise), (distance, distance_noise))
        numbers = [[each.evidence, *each.filter.mean, *each.filter.covariance.ravel()] for each in self._members]
        if np.isfinite(numbers).all():
            self._answer = self._answer_now()
        else:  # beyond what numbers can hold
            self._forget()
            self._answer = nothing(Status.INVALID, math.nan)
        return self._answer

    def reset(self) -> None:
        """Forget everything."""
        self.__init__(**self._settings)  # type: ignore[misc]

    def state(self) -> dict[str, Any]:
        """Return all that was seen, for ``restore``."""
        return {"frames": list(self._frames)}

    def restore(self, state: dict[str, Any]) -> None:
        """Remember what another tracker with the same settings remembered, by seeing all its pictures."""
        self.reset()
        for scale, stamp, spread, distance, distance_noise, displacement, displacement_noise in state["frames"]:
            self.update(
                scale,
                stamp,
                spread,
                distance=distance,
                distance_noise=distance_noise,
                displacement=displacement,
                displacement_noise=displacement_noise,
            )

    def _forget(self) -> None:
        """Begin anew with nothing but a guess at the distance."""
        self._members = [_Member(model, noise, self._distance) for model, noise in product(MODELS, NOISES)]
        for member in self._members:
            member.filter.stamp = self._newest
        self._metric = False
        self._spread = 0.0
        self._speeds = self._distances = self._too_far = 0
        self._measured = self._newest

    def _predict(self, dt: float) -> None:
        kept = math.exp(-dt / MEMORY)
        for member in self._members:
            member.before = float(member.filter.mean[0])
            member.predict(self._newest)
            member.evidence = member.prior + kept * (member.evidence - member.prior)

    def _take(
        self, dt: float, scale: tuple[float, float], displacement: tuple[float, float], distance: tuple[float, float]
    ) -> None:
        has_scale, has_displacement, has_distance = (
            not math.isnan(each[0]) for each in (scale, displacement, distance)
        )
        if self._metric and has_distance:
            beyond = self._beyond(*distance)
            self._too_far = self._too_far + 1 if beyond > OTHER else 0
            if beyond < -OTHER or self._too_far >= DISTANCES:
                self._forget()
                has_scale = has_displacement = False
            elif beyond > OTHER:
                has_distance = False
        was_metric, self._metric = self._metric, self._metric or has_distance
        has_displacement = has_displacement and self._metric
        if not (has_scale or has_displacement or has_distance):
            return
        for member in self._members:
            if has_distance and was_metric:
                member.correct(_Linear((1.0, 0.0, 0.0), distance[0], distance[1] ** 2))
            elif has_distance:
                member.scaled(*distance)
            if has_scale and member.before > 0:
                member.correct(self._of_scale(dt, *scale, member.before))
            if has_displacement:
                variance = (displacement[1] / dt) ** 2
                member.correct(_Linear((0.0, 1.0, -dt / 2), displacement[0] / dt, variance))
            if not self._metric:
                member.scaled(self._distance, 0.0)
        best = max(member.evidence for member in self._members)
        for member in self._members:
            member.evidence -= best
        if has_scale:
            old = math.exp(-dt / MEMORY) if self._speeds else 0.0
            self._spread = old * self._spread + (1.0 - old) * scale[1] / dt
        self._measured = self._newest
        self._speeds += has_scale or has_displacement
        self._distances += has_distance

    def _of_scale(self, dt: float, scale: float, spread: float, before: float) -> _Linear:
        rate, size = (scale - 1.0) / dt, before / scale
        variance = (max(spread, LEAST_SPREAD) * size / dt) ** 2
        shared = max(SHARED * abs(rate), SHARED_OF_SPREAD * spread / dt) * size
        systematic = shared**2 * SHARED_FOR / dt if self._metric else 0.0
        return _Linear((-rate, 1.0, -dt / 2), 0.0, variance, systematic)

    def _beyond(self, distance: float, noise: float) -> float:
        """Return how far a distance is beyond where the target is expected, in standard deviations."""
        posterior = self._posterior()
        return float(distance - posterior.mean[0]) / math.sqrt(posterior.covariance[0, 0] + noise**2)

    def _posterior(self) -> Posterior:
        evidence = np.array([member.evidence for member in self._members])
        means = np.array([member.filter.mean[:2] for member in self._members])
        covariances = np.array([each.filter.covariance[:2, :2] for each in self._members])
        posterior = Posterior(*average(evidence, means, covariances))
        distance, speed = posterior.mean
        shared = max(SHARED * abs(speed), SHARED_OF_SPREAD * self._spread * distance)
        posterior.covariance[1, 1] += (SYSTEMATIC * speed if self._metric else shared) ** 2
        return posterior

    def _answer_now(self) -> TrackedTTC:
        is_seen = self._measured == self._newest
        age = self._newest - self._measured
        if self._speeds == self._distances == 0:
            return nothing(Status.NO_DATA, math.nan)
        posterior = self._posterior()
        if self._speeds == 0 and self._distances < DISTANCES:
            answer = only_where(Status.WARMING_UP, float(posterior.mean[0]))
        else:
            closes = bool(posterior.mean[1] > self._min_closing_speed)
            answer = of_posterior(posterior, NORMAL, closes)
            if not self._metric and answer.status != Status.INVALID:
                answer = replace(answer, distance=math.nan, closing_speed=math.nan, closing_speed_interval=None)
        return replace(answer, status=answer.status if is_seen else Status.LOST, age=age)


def _pair(name: str, value: float | None, error_name: str, error: float | None) -> tuple[float, float]:
    """Give a measurement and its standard error; NaN where there is none."""
    value = math.nan if value is None else number(name, value)
    if error is None and not math.isnan(value):
        raise ValueError(f"{error_name} must be given with {name}")
    error = math.nan if error is None else number(error_name, error)
    if math.isnan(value):
        return math.nan, math.nan
    if name == "scale":
        value = positive(name, value)
        return (math.nan, math.nan) if math.isnan(error) else (value, non_negative(error_name, error))
    if math.isinf(value):
        raise ValueError(f"{name} must be finite, or NaN where there is none, got {value}")
    return value, positive(error_name, error)
