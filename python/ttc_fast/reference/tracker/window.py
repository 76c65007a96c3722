"""The filters that remember the frames of the newest seconds, and fit a line or a parabola to them anew each time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast.reference.tracker.filter import Posterior

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ttc_fast.reference.tracker.filter import Measurement

MOST_FRAMES = 512
"""The most frames that a window remembers."""
MOST_FRAMES_OF_PAIRS = 64
"""The most frames for a Theil-Sen line, because its time grows with the square of them."""


class Window:
    """The frames of the newest seconds, and the curve to fit to them."""

    def __init__(self, window: float, *, degree: int, unmodelled: float, theil_sen: bool = False) -> None:
        self.window, self.degree, self.unmodelled, self.theil_sen = window, degree, unmodelled, theil_sen
        self.needed = degree + 2
        self.newest: list[Measurement] = []

    @property
    def frames(self) -> int:
        """How many frames the window holds."""
        return len(self.newest)

    def update(self, new: Measurement) -> None:
        """Take a distance, and drop frames older than the window as long as enough stay for the fit."""
        self.newest.append(new)
        while len(self.newest) > self.needed and self.newest[0].stamp < new.stamp - self.window:
            self.newest.pop(0)
        self.newest = self.newest[-(MOST_FRAMES_OF_PAIRS if self.theil_sen else MOST_FRAMES) :]

    def posterior(self, stamp: float, variance: float) -> Posterior | None:
        """Say what the fit knows of ``stamp``, from two frames on; ``variance`` is that of frames without their own."""
        if self.frames < 2:
            return None
        times = np.array([frame.stamp - stamp for frame in self.newest])
        distances = np.array([frame.distance for frame in self.newest])
        variances = np.array([frame.variance if frame.has_own_variance else variance for frame in self.newest])
        if self.theil_sen:
            return self._theil_sen(times, distances, variances)
        degree = min(self.degree, self.frames - 1)
        return self._least_squares(times, distances, variances, degree)

    def _least_squares(
        self, times: NDArray[Any], distances: NDArray[Any], variances: NDArray[Any], degree: int
    ) -> Posterior:
        """Fit a polynomial by weighted least squares; the next power of time moves it by a known vector, its bias."""
        scale = -times[0]
        powers = np.vander(times / scale, degree + 1, increasing=True)
        to_coefficients = np.linalg.pinv(powers / np.sqrt(variances)[:, None]) / np.sqrt(variances)
        bias = self.unmodelled * times ** (degree + 1) / math.factorial(degree + 1)
        to_answer = np.diag([1, -1 / scale]) @ to_coefficients[:2]
        mean = to_answer @ (distances - distances[-1]) + [distances[-1], 0]
        model_bias = to_answer @ bias
        return Posterior(
            mean, (to_answer * variances) @ to_answer.T + np.outer(model_bias, model_bias), model_bias[0] ** 2
        )

    def _theil_sen(self, times: NDArray[Any], distances: NDArray[Any], variances: NDArray[Any]) -> Posterior:
        """Fit the median slope of all pairs and the median of what it leaves; its bias is that of least squares."""
        n, noise = len(times), variances.mean()
        later, earlier = np.tril_indices(n, -1)
        slope = np.median((distances[later] - distances[earlier]) / (times[later] - times[earlier]))
        distance = np.median(distances - slope * times)
        centre, spread = times.mean(), times.var()
        of_centre, of_slope = math.pi / 2 * noise / n, math.pi / 3 * noise / (n * spread)
        bias = self.unmodelled * times**2 / 2
        tilt = ((times - centre) * (bias - bias.mean())).mean() / spread
        model_bias = np.array([bias.mean() - tilt * centre, -tilt])
        covariance = np.array([[of_centre + centre**2 * of_slope, centre * of_slope], [centre * of_slope, of_slope]])
        return Posterior(
            np.array([distance, -slope]), covariance + np.outer(model_bias, model_bias), model_bias[0] ** 2
        )
