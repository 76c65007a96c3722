"""The methods that are compared: each takes a sequence of clouds and gives its answer to each of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

import ttc_fast
from evaluation.tracking import METHODS

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

WINDOW = ttc_fast.Alignment().window
"""The window of the alignment, s."""
WINDOWS = (0.3, 0.5, WINDOW)
"""The windows of the lines, s: short ones are noisy, long ones late."""
ESTIMATORS: dict[str, Any] = {
    "minimum": ttc_fast.Minimum(),
    "k-th smallest, 5": ttc_fast.KthSmallest(5),
    "k-th smallest, 10": ttc_fast.KthSmallest(10),
    "k-th smallest, 20": ttc_fast.KthSmallest(20),
    "mean of 10": ttc_fast.MeanOfLowest(10),
    "5 % quantile": ttc_fast.Quantile(0.05),
    "20 % quantile": ttc_fast.Quantile(0.2),
    "median": ttc_fast.Quantile(0.5),
    "interquartile fence": ttc_fast.InterquartileFence(1.5),
    "supported": ttc_fast.Supported(10, 0.05),
    "cluster": ttc_fast.Cluster(0.3, 10),
}
TRACKED = ("k-th smallest, 10", "5 % quantile", "median")
"""The default, and the best of the statistics on either kind of data."""


class Answer(NamedTuple):
    """The answer of a method to one frame."""

    ttc: float
    closing_speed: float  # m/s, NaN where it says nothing
    interval: tuple[float, float] | None = None  # 90 %, of the time; None where it gives none


class Method(Protocol):
    """A function from clouds and their stamps to answers that never looks ahead."""

    def __call__(self, clouds: Sequence[NDArray[Any]], stamps: Sequence[float], gate: ttc_fast.Gate) -> list[Answer]:
        """Give one answer for each cloud."""


def distances(clouds: Sequence[NDArray[Any]], gate: ttc_fast.Gate, estimator: Any) -> NDArray[np.float64]:
    """Return one statistic of each cloud, m; NaN where there is none."""
    found = [ttc_fast.robust_min_x(cloud, gate=gate, estimator=estimator).x for cloud in clouds]
    return np.where(np.isfinite(found), found, np.nan)


def answer(distance: float, closing_speed: float) -> Answer:
    """Return the answer at a constant speed."""
    return Answer(distance / closing_speed if closing_speed > 0 else np.inf, closing_speed)


@dataclass(frozen=True)
class Line:
    """A line through one statistic of the frames of a window; through two frames if there is no window."""

    estimator: Any
    window: float | None = None

    def __call__(self, clouds: Sequence[NDArray[Any]], stamps: Sequence[float], gate: ttc_fast.Gate) -> list[Answer]:
        """Give one answer for each cloud."""
        time, x = np.asarray(stamps), distances(clouds, gate, self.estimator)
        return list(self._each(time, x))

    def _each(self, time: NDArray[np.float64], x: NDArray[np.float64]) -> Iterator[Answer]:
        for now in range(len(time)):
            first = now - 1 if self.window is None else int(np.searchsorted(time, time[now] - self.window - 1e-6))
            frames = np.arange(max(first, 0), now + 1)
            frames = frames[np.isfinite(x[frames])]
            if len(frames) < 2:
                yield Answer(np.inf, np.nan)
                continue
            slope, distance = np.polyfit(time[frames] - time[now], x[frames], 1)
            yield answer(distance, -slope)


@dataclass(frozen=True)
class Tracked:
    """One statistic of each cloud, followed by ``DistanceTracker``."""

    estimator: Any
    method: Any

    def __call__(self, clouds: Sequence[NDArray[Any]], stamps: Sequence[float], gate: ttc_fast.Gate) -> list[Answer]:
        """Give one answer for each cloud."""
        tracker = ttc_fast.DistanceTracker(self.method)
        measured = zip(distances(clouds, gate, self.estimator), stamps, strict=True)
        return [said(tracker.update(distance, stamp)) for distance, stamp in measured]


def said(seen: ttc_fast.TrackedTTC) -> Answer:
    """Return what counts of a tracker's answer."""
    return Answer(seen.ttc, seen.closing_speed, seen.ttc_interval)


def aligned(clouds: Sequence[NDArray[Any]], stamps: Sequence[float], gate: ttc_fast.Gate) -> list[Answer]:
    """Return the answers of ``CloudTracker``."""
    tracker = ttc_fast.CloudTracker(gate)
    return [said(tracker.update(cloud, stamp)) for cloud, stamp in zip(clouds, stamps, strict=True)]


def groups() -> dict[str, dict[str, Method]]:
    """Return all methods but the alignment, by what they make of the statistics, and by name."""
    return {
        "two frames": {f"{name}, two frames": Line(estimator) for name, estimator in ESTIMATORS.items()},
        **{
            f"line of {window:g} s": {
                f"{name}, line of {window:g} s": Line(estimator, window) for name, estimator in ESTIMATORS.items()
            }
            for window in WINDOWS
        },
        "`DistanceTracker`": {
            f"{name}, {type(method).__name__}": Tracked(ESTIMATORS[name], method)
            for name in TRACKED
            for method in METHODS
        },
    }


ALIGNMENT = "alignment"


def methods() -> dict[str, Method]:
    """Return all methods by name."""
    return {name: method for group in groups().values() for name, method in group.items()} | {ALIGNMENT: aligned}
