"""The car: a kinematic bicycle whose driver follows a plan, and whose brake bites after a delay."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

BODY = (-0.1, 0.4, -0.15, 0.15)
"""x_rear, x_front, y_right, y_left about the rear axle, m: a car of a tenth of the size."""


class Pose(NamedTuple):
    """Where it is, and how fast."""

    x: float
    y: float
    heading: float
    speed: float


@dataclass(frozen=True)
class Plan:
    """What the driver does without a brake: a speed, held or changed evenly, and a steady bend."""

    speed: float
    """m/s; negative when reversing."""
    acceleration: float = 0.0
    """m/s^2, down to a stop."""
    top_speed: float = 8.0
    """m/s, without sign."""
    curvature: float = 0.0
    """1/m, to the left."""

    def wanted(self, time: float) -> float:
        """The speed at a time, m/s."""
        speed = abs(self.speed) + self.acceleration * time
        return math.copysign(max(0.0, min(speed, self.top_speed)), self.speed)


@dataclass(frozen=True)
class Brake:
    """How it brakes."""

    deceleration: float = 6.0
    """m/s^2."""
    delay: float = 0.05
    """From the command to the bite, s."""


def step(pose: Pose, curvature: float, speed: float, dt: float) -> Pose:
    """Drive on along the bend for ``dt``, at the mean of the old and the new speed: exact on a circle."""
    way = 0.5 * (pose.speed + speed) * dt
    turn = curvature * way
    chord = way * (math.sin(turn / 2.0) / (turn / 2.0) if turn else 1.0)
    direction = pose.heading + turn / 2.0
    return Pose(pose.x + chord * math.cos(direction), pose.y + chord * math.sin(direction), pose.heading + turn, speed)


def slowed(speed: float, deceleration: float, dt: float) -> float:
    """A speed after braking for ``dt``."""
    return math.copysign(max(abs(speed) - deceleration * dt, 0.0), speed)
