"""The filters that remember one state instead of frames: Kalman's, and the alpha-beta filter with fading memory."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Measurement:
    """One distance, and how much it is trusted."""

    stamp: float
    """Time since the first stamp of the tracker, s."""
    distance: float
    """Measured distance, m."""
    variance: float
    """Variance of the distance, m^2."""
    has_own_variance: bool
    """Whether the variance came with the distance, rather than from the noise level that all distances share."""


@dataclass(frozen=True)
class Posterior:
    """Mean and covariance of distance (m) and closing speed (m/s)."""

    mean: NDArray[np.float64]
    covariance: NDArray[np.float64]
    model_bias: float = 0.0
    """The part of the distance's variance that allows for motion which the model does not follow, m^2."""


class KalmanFilter:
    """A recursive filter over the distances of one target.

    The state is distance, closing speed and closing acceleration, with the covariance of their errors. With ``memory``
    the gains are those of an alpha-beta filter, and the acceleration is a consider state: it stays 0, and the
    covariance carries what that may cost.
    """

    needed = 3

    def __init__(
        self, *, acceleration_noise: float, jerk_noise: float, acceleration: float, memory: float | None
    ) -> None:
        self.acceleration_process_noise, self.jerk_process_noise = acceleration_noise**2, jerk_noise**2
        self.acceleration, self.memory = acceleration**2, memory
        self.frames, self.stamp = 0, 0.0
        self.mean, self.covariance = np.zeros(3), np.zeros((3, 3))

    def update(self, new: Measurement) -> None:
        """Take a distance into the state; the first two make a line."""
        self.frames += 1
        if self.frames == 1:
            self.mean = np.array([new.distance, 0, 0])
            self.covariance = np.diag([new.variance, 0, 0])
        elif self.frames == 2:
            self._start(new)
        else:
            self._correct(new)
        self.stamp = new.stamp

    def _start(self, new: Measurement) -> None:
        """Start with the line through two distances; its errors come from their noise and from an acceleration."""
        dt, before = new.stamp - self.stamp, self.covariance[0, 0]
        noise = np.array([[1, 0], [-1 / dt, 1 / dt], [0, 0]])  # of the second distance, of the first
        ahead = np.array([0, dt / 2, 1])  # of the acceleration
        self.mean = np.array([new.distance, (self.mean[0] - new.distance) / dt, 0])
        self.covariance = noise @ np.diag([new.variance, before]) @ noise.T
        self.covariance += self.acceleration * np.outer(ahead, ahead)
        self.covariance[1, 1] += self.acceleration_process_noise * dt / 3

    def _correct(self, new: Measurement) -> None:
        """Correct the predicted state by the innovation."""
        mean, covariance = self._predict(new.stamp)
        innovation = new.distance - mean[0]
        dt = new.stamp - self.stamp
        if self.memory is None:
            gain = covariance[:, 0] / (covariance[0, 0] + new.variance)
        else:
            n, kept = self.frames, math.exp(-dt / self.memory)
            alpha = max(1 - kept**2, 2 * (2 * n - 1) / (n * (n + 1)))
            beta = max((1 - kept) ** 2, 6 / (n * (n + 1)))
            gain = np.array([alpha, -beta / dt, 0])
        left = np.eye(3) - np.outer(gain, [1, 0, 0])
        self.mean = mean + gain * innovation
        self.covariance = left @ covariance @ left.T + new.variance * np.outer(gain, gain)

    def _predict(self, stamp: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Move the state on to ``stamp``."""
        t = stamp - self.stamp
        step = np.array([[1, -t, -t * t / 2], [0, 1, t], [0, 0, 1]])
        speed = np.array([[t**3 / 3, -(t**2) / 2, 0], [-(t**2) / 2, t, 0], [0, 0, 0]])
        acceleration = np.array(
            [
                [t**5 / 20, -(t**4) / 8, -(t**3) / 6],
                [-(t**4) / 8, t**3 / 3, t**2 / 2],
                [-(t**3) / 6, t**2 / 2, t],
            ]
        )
        process_noise = self.acceleration_process_noise * speed + self.jerk_process_noise * acceleration
        return step @ self.mean, step @ self.covariance @ step.T + process_noise

    def posterior(self, stamp: float, variance: float) -> Posterior | None:
        """Say what the filter knows of ``stamp``, from two frames on."""
        if self.frames < 2:
            return None
        mean, covariance = self._predict(stamp)
        model_bias = 0.0
        if self.memory is not None and self.acceleration > 0:
            model_bias = covariance[0, 2] ** 2 / covariance[2, 2]
        return Posterior(mean[:2], covariance[:2, :2], model_bias)
