"""Approaches to a car ahead: how the gap shrinks, exactly, and what the scanner sees of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from benches.accuracy.scanner import RATE, Pose, Scanner, turn
from ttc_fast import Gate

if TYPE_CHECKING:
    from numpy.typing import NDArray

GATE = Gate.above_road(1.73, clearance=0.25, headroom=2.0, x=(2.0, np.inf))
"""What is above the road, in the own lane, and not the own bonnet."""


class Frame(NamedTuple):
    """A cloud, when it was taken, and what was true then."""

    stamp: float  # s
    points: NDArray[np.float32]
    distance: float  # m, from the sensor
    closing_speed: float  # m/s

    @property
    def ttc(self) -> float:
        """At the closing speed of the moment, s."""
        return self.distance / self.closing_speed if self.closing_speed > 0.0 else np.inf


@dataclass(frozen=True)
class Approach:
    """A gap that shrinks: closing speed at first, and how it grows from some moment on."""

    name: str
    distance: float
    """From the sensor to the bumper ahead at first, m."""
    closing_speed: float
    """m/s"""
    acceleration: float = 0.0
    """Of the closing speed, m/s^2."""
    since: float = 0.0
    """When the acceleration begins, s."""
    duration: float = 2.0
    """s"""
    drift: float = 0.1
    """Sideways, m/s."""
    scanner: Scanner = field(default_factory=Scanner)

    def truth(self, t: float) -> tuple[float, float]:
        """Distance and closing speed at a time."""
        later = max(t - self.since, 0.0)
        gone = self.closing_speed * t + self.acceleration * later**2 / 2.0
        return self.distance - gone, self.closing_speed + self.acceleration * later

    def frames(self, seed: int) -> list[Frame]:
        """What the scanner sees, turn by turn, while anything is left of the gap."""
        rng = np.random.default_rng(seed)
        y = rng.uniform(-0.3, 0.3)
        frames = []
        for stamp in np.arange(round(self.duration * RATE) + 1) / RATE:
            distance, closing = self.truth(stamp)
            if distance < 3.0:
                break
            points = turn(self.scanner, [Pose(distance, y + self.drift * stamp)], rng)
            frames.append(Frame(float(stamp), points, distance, closing))
        return frames


STEADY = tuple(
    Approach(f"{speed:g} m/s from {distance:g} m", distance, speed)
    for speed, distance in ((0.5, 8), (1, 12), (1, 6), (2, 12), (2, 30), (5, 20), (10, 28), (15, 40))
)
CHANGING = tuple(
    Approach(f"{speed:g} m/s from {distance:g} m, {change:+g} m/s^2", distance, speed, change, since)
    for speed, distance, change, since in (
        (0.6, 8, 0.2, 0.0),
        (1, 15, 0.3, 0.0),
        (1, 15, 1.0, 0.0),
        (2, 25, 4.0, 0.5),
        (8, 20, -6.0, 0.0),
        (10, 30, -4.0, 0.3),
        (15, 45, -5.0, 0.5),
    )
)
STANDING = tuple(Approach(f"standing {distance:g} m behind", distance, 0.0, drift=0.0) for distance in (4, 8, 20, 40))
