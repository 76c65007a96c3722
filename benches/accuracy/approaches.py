"""Approaches to a car ahead, simulated with exact truth, and the labelled ones of KITTI."""

from __future__ import annotations

import csv
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

SECONDS = 6.0
FINE = 6000
"""Steps in which a motion is integrated."""


@dataclass(frozen=True)
class Approach:
    """What was measured when, and what is true then."""

    stamps: Floats
    """s"""
    measured: Floats
    """Distance to contact with its noise, m; NaN where the target was not seen."""
    distance: Floats
    """m; NaN where it is not known."""
    closing_speed: Floats
    """m/s; NaN where it is not known."""

    @property
    def ttc(self) -> Floats:
        """Give distance over closing speed, inf where it does not close, s."""
        closes = self.closing_speed > 0
        return np.where(closes, self.distance / np.where(closes, self.closing_speed, 1.0), np.inf)


def constant(rng: np.random.Generator, time: Floats) -> Floats:
    """Closing acceleration 0."""
    return np.zeros_like(time)


def accelerating(rng: np.random.Generator, time: Floats) -> Floats:
    """Closing faster and faster from the first frame on."""
    return np.full_like(time, rng.uniform(0.5, 3.0))


def braking(rng: np.random.Generator, time: Floats) -> Floats:
    """Closing less and less from the first frame on."""
    return np.full_like(time, -rng.uniform(0.5, 4.0))


def manoeuvre(rng: np.random.Generator, time: Floats) -> Floats:
    """A constant speed until somebody brakes or accelerates, with a jerk of 2 to 8 m/s^3 up to 1 to 6 m/s^2."""
    start, jerk, most = rng.uniform(1.0, 4.0), rng.uniform(2.0, 8.0), rng.uniform(1.0, 6.0)
    return np.asarray(np.clip((time - start) * jerk, 0.0, most) * rng.choice([-1.0, 1.0]))


KINDS: dict[str, Callable[[np.random.Generator, Floats], Floats]] = {
    "constant": constant,
    "accelerating": accelerating,
    "braking": braking,
    "manoeuvre": manoeuvre,
}


def simulated(kind: str, count: int, rate: float = 10.0, seed: int = 2026) -> Iterator[Approach]:
    """Make approaches of one kind, closing at 0.5 to 15 m/s at first from 5 to 60 m away."""
    rng = np.random.default_rng([seed, list(KINDS).index(kind)])
    for _ in range(count):
        time = np.linspace(0.0, SECONDS, FINE)
        speed = rng.uniform(0.5, 15.0) + _integral(KINDS[kind](rng, time), time)
        speed = np.maximum(speed, -2.0)
        distance = rng.uniform(5.0, 60.0) - _integral(speed, time)
        yield _measured(rng, time, distance, speed, rate)


def standing(count: int, rate: float = 10.0, seed: int = 2026) -> Iterator[Approach]:
    """Make standing cars behind standing cars, 1 to 8 m apart."""
    rng = np.random.default_rng([seed, len(KINDS)])
    for _ in range(count):
        time = np.linspace(0.0, SECONDS, FINE)
        yield _measured(rng, time, np.full(FINE, rng.uniform(1.0, 8.0)), np.zeros(FINE), rate)


def _integral(values: Floats, time: Floats) -> Floats:
    return np.concatenate([[0.0], np.cumsum((values[1:] + values[:-1]) / 2 * np.diff(time))])


def _measured(rng: np.random.Generator, time: Floats, distance: Floats, speed: Floats, rate: float) -> Approach:
    """Look at a motion through a sensor.

    Frames come with 10 % of jitter, distances with white noise of 1 to 5 cm; the front edge jitters as a whole by up to
    2 cm with a memory of 0.1 to 0.4 s; 2 % are outliers of 0.1 to 0.8 m and 2 % are missing.
    """
    frames = int(SECONDS * rate)
    stamps = np.cumsum((1 + rng.uniform(-0.1, 0.1, frames)) / rate)
    stamps = stamps[stamps < SECONDS]
    n = len(stamps)
    at = np.interp(stamps, time, distance)
    noise = rng.normal(0.0, rng.uniform(0.01, 0.05), n)
    edge = _wandering(rng, stamps, rng.uniform(0.0, 0.02), rng.uniform(0.1, 0.4))
    outlier = (rng.random(n) < 0.02) * rng.choice([-1.0, 1.0], n) * rng.uniform(0.1, 0.8, n)
    measured = np.where(rng.random(n) < 0.02, np.nan, at + noise + edge + outlier)
    ahead = at > 0.3
    return Approach(1.7e9 + stamps[ahead], measured[ahead], at[ahead], np.interp(stamps, time, speed)[ahead])


def _wandering(rng: np.random.Generator, stamps: Floats, std: float, memory: float) -> Floats:
    """Give noise that resembles that of the frame before."""
    kept = np.exp(-np.diff(stamps, prepend=stamps[0]) / memory)
    steps: Floats = (
        rng.normal(0.0, 1.0, len(stamps)) * std * np.sqrt(1 - np.where(np.arange(len(stamps)) > 0, kept, 0.0) ** 2)
    )
    values: Floats = np.empty_like(steps)
    value = 0.0
    for i, step in enumerate(steps):
        value = values[i] = kept[i] * value + step
    return values


def labelled() -> Iterator[tuple[str, Approach]]:
    """Give the lead vehicles of KITTI's tracking labels, by name; nothing where there are no recordings.

    Measured is the near face of the labelled box. True is the slope of a line through the labels of +-5 frames: it
    knows the future, and its noise is that of the labels.
    """
    path = Path(os.environ.get("TTC_FAST_DATA", "../shared/data")) / "ground_truth" / "kitti_lead_tracks.csv"
    if not path.exists():
        return
    tracks: dict[str, list[dict[str, str]]] = {}
    with path.open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            tracks.setdefault(f"{row['seq']}/{row['track_id']}", []).append(row)
    for name, rows in tracks.items():
        columns = ("t_s", "near_face_m", "d_ref_m", "v_closing_ref_mps")
        yield name, Approach(*(np.array([float(row[column] or "nan") for row in rows]) for column in columns))
