"""From distances of one target to a posterior of distance and closing speed, by each method."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from ttc_fast._core import AlphaBeta, KalmanCA, KalmanCV, SlidingLine, SlidingParabola, TheilSen

if TYPE_CHECKING:
    from numpy.typing import NDArray

MOST_FRAMES = 512
MOST_FRAMES_OF_PAIRS = 64


@dataclass(frozen=True)
class Measured:
    """One distance, and how much it is trusted."""

    stamp: float
    """s, since the tracker's first."""
    distance: float
    """m"""
    variance: float
    """m^2"""
    own: bool
    """Whether the variance came with the distance, rather than from what is believed of all."""


@dataclass(frozen=True)
class Posterior:
    """What is believed of distance (m) and closing speed (m/s)."""

    mean: NDArray[np.float64]
    covariance: NDArray[np.float64]
    lag: float = 0.0
    """The part of the distance's variance that allows for motion which the method does not follow, m^2."""


class Filter(Protocol):
    """The memory of one target."""

    needed: int
    """How many frames it takes to say anything."""

    @property
    def frames(self) -> int:
        """How many it has."""

    def push(self, new: Measured) -> None:
        """Take a distance."""

    def at(self, stamp: float, variance: float) -> Posterior | None:
        """Say what is believed, from two frames on; ``variance`` is that of each distance that brought none."""


class Recursive:
    """State (distance, closing speed, closing acceleration) and covariance, moved on and corrected frame by frame."""

    needed = 3

    def __init__(
        self, *, speed_wander: float, acceleration_wander: float, acceleration: float, memory: float | None
    ) -> None:
        self.speed_wander, self.acceleration_wander = speed_wander**2, acceleration_wander**2
        self.acceleration, self.memory = acceleration**2, memory
        self.frames, self.stamp = 0, 0.0
        self.mean, self.covariance = np.zeros(3), np.zeros((3, 3))

    def push(self, new: Measured) -> None:
        """Take a distance; the first two make a line, later ones correct."""
        self.frames += 1
        if self.frames == 1:
            self.mean = np.array([new.distance, 0, 0])
            self.covariance = np.diag([new.variance, 0, 0])
        elif self.frames == 2:
            self._by_two(new)
        else:
            self._correct(new)
        self.stamp = new.stamp

    def _by_two(self, new: Measured) -> None:
        """Begin with the line through both: its errors come from the noise of both, and from what no line follows."""
        dt, before = new.stamp - self.stamp, self.covariance[0, 0]
        noise = np.array([[1, 0], [-1 / dt, 1 / dt], [0, 0]])  # of the second distance, of the first
        ahead = np.array([0, dt / 2, 1])  # of the acceleration
        self.mean = np.array([new.distance, (self.mean[0] - new.distance) / dt, 0])
        self.covariance = noise @ np.diag([new.variance, before]) @ noise.T
        self.covariance += self.acceleration * np.outer(ahead, ahead)
        self.covariance[1, 1] += self.speed_wander * dt / 3

    def _correct(self, new: Measured) -> None:
        mean, covariance = self._moved(new.stamp)
        dt = new.stamp - self.stamp
        if self.memory is None:
            gain = covariance[:, 0] / (covariance[0, 0] + new.variance)
        else:
            n, kept = self.frames, math.exp(-dt / self.memory)
            alpha = max(1 - kept**2, 2 * (2 * n - 1) / (n * (n + 1)))
            beta = max((1 - kept) ** 2, 6 / (n * (n + 1)))
            gain = np.array([alpha, -beta / dt, 0])
        left = np.eye(3) - np.outer(gain, [1, 0, 0])
        self.mean = mean + gain * (new.distance - mean[0])
        self.covariance = left @ covariance @ left.T + new.variance * np.outer(gain, gain)

    def _moved(self, stamp: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
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
        wander = self.speed_wander * speed + self.acceleration_wander * acceleration
        return step @ self.mean, step @ self.covariance @ step.T + wander

    def at(self, stamp: float, variance: float) -> Posterior | None:
        """Move the state on to ``stamp``."""
        if self.frames < 2:
            return None
        mean, covariance = self._moved(stamp)
        lag = 0.0
        if self.memory is not None and self.acceleration > 0:
            lag = covariance[0, 2] ** 2 / covariance[2, 2]
        return Posterior(mean[:2], covariance[:2, :2], lag)


class Window:
    """The frames of the newest seconds, fitted anew each time."""

    def __init__(self, window: float, *, degree: int, unmodelled: float, median: bool = False) -> None:
        self.window, self.degree, self.unmodelled, self.median = window, degree, unmodelled, median
        self.needed = degree + 2
        self.newest: list[Measured] = []

    @property
    def frames(self) -> int:
        """How many frames the window holds."""
        return len(self.newest)

    def push(self, new: Measured) -> None:
        """Take a distance; what is too old goes, as long as enough stay."""
        self.newest.append(new)
        while len(self.newest) > self.needed and self.newest[0].stamp < new.stamp - self.window:
            self.newest.pop(0)
        self.newest = self.newest[-(MOST_FRAMES_OF_PAIRS if self.median else MOST_FRAMES) :]

    def at(self, stamp: float, variance: float) -> Posterior | None:
        """Fit, with time counted from ``stamp``."""
        if self.frames < 2:
            return None
        times = np.array([frame.stamp - stamp for frame in self.newest])
        distances = np.array([frame.distance for frame in self.newest])
        variances = np.array([frame.variance if frame.own else variance for frame in self.newest])
        if self.median:
            return self._median_line(times, distances, variances)
        degree = min(self.degree, self.frames - 1)
        return self._least_squares(times, distances, variances, degree)

    def _least_squares(
        self, times: NDArray[Any], distances: NDArray[Any], variances: NDArray[Any], degree: int
    ) -> Posterior:
        scale = -times[0]
        powers = np.vander(times / scale, degree + 1, increasing=True)
        to_coefficients = np.linalg.pinv(powers / np.sqrt(variances)[:, None]) / np.sqrt(variances)
        missed = self.unmodelled * times ** (degree + 1) / math.factorial(degree + 1)
        to_answer = np.diag([1, -1 / scale]) @ to_coefficients[:2]
        mean = to_answer @ (distances - distances[-1]) + [distances[-1], 0]
        lag = to_answer @ missed
        return Posterior(mean, (to_answer * variances) @ to_answer.T + np.outer(lag, lag), lag[0] ** 2)

    def _median_line(self, times: NDArray[Any], distances: NDArray[Any], variances: NDArray[Any]) -> Posterior:
        n, noise = len(times), variances.mean()
        later, earlier = np.tril_indices(n, -1)
        slope = np.median((distances[later] - distances[earlier]) / (times[later] - times[earlier]))
        distance = np.median(distances - slope * times)
        centre, spread = times.mean(), times.var()
        of_centre, of_slope = math.pi / 2 * noise / n, math.pi / 3 * noise / (n * spread)
        missed = self.unmodelled * times**2 / 2
        tilt = ((times - centre) * (missed - missed.mean())).mean() / spread
        lag = np.array([missed.mean() - tilt * centre, -tilt])
        covariance = np.array([[of_centre + centre**2 * of_slope, centre * of_slope], [centre * of_slope, of_slope]])
        return Posterior(np.array([distance, -slope]), covariance + np.outer(lag, lag), lag[0] ** 2)


def filter_of(method: Any) -> Filter:
    """Give the memory of a method."""
    if isinstance(method, KalmanCA):
        return Recursive(speed_wander=0, acceleration_wander=method.jerk, acceleration=method.acceleration, memory=None)
    if isinstance(method, KalmanCV):
        return Recursive(speed_wander=method.acceleration, acceleration_wander=0, acceleration=0, memory=None)
    if isinstance(method, AlphaBeta):
        return Recursive(speed_wander=0, acceleration_wander=0, acceleration=method.acceleration, memory=method.memory)
    if isinstance(method, SlidingParabola):
        return Window(method.window, degree=2, unmodelled=method.jerk)
    if isinstance(method, SlidingLine):
        return Window(method.window, degree=1, unmodelled=method.acceleration)
    if isinstance(method, TheilSen):
        return Window(method.window, degree=1, unmodelled=method.acceleration, median=True)
    raise TypeError(f"method must be a method object such as KalmanCA() or SlidingLine(window=0.5), got {method!r}")
