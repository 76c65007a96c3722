"""A car of a tenth of the size with a scanner at its front, and who steers it: along a line, or at random."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from ttc_fast import Motion, ScanTTC

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from evaluation.racing.course import Course, Line

    Floats = NDArray[np.float64]

WHEELBASE = 0.33
LENGTH, WIDTH = 0.58, 0.31
OVERHANG = (LENGTH - WHEELBASE) / 2.0
OUTLINE = (-OVERHANG, LENGTH - OVERHANG, -WIDTH / 2.0, WIDTH / 2.0)
"""x_rear, x_front, y_right, y_left about the rear axle, m."""
SHARPEST = 0.4189
"""The greatest steering angle, rad."""
STEERING_RATE = 3.2
"""The greatest rate of the steering angle, rad/s."""
GRIP = 10.0
"""The greatest lateral acceleration, m/s^2."""
ACCELERATION, DECELERATION = 6.0, 6.0
"""How the car reaches a greater and a smaller speed, m/s^2."""

BEAMS, VIEW = 1080, 4.7
PERIOD = 0.025
"""The time from scan to scan, s."""
STEP = 0.0125
"""The step of the simulation, s."""


class Pose(NamedTuple):
    """Place, m, and heading, rad, of the origin of the vehicle frame."""

    x: float
    y: float
    heading: float


class Car(Protocol):
    """What drives: the car below, or that of another simulator."""

    pose: Pose
    speed: float

    def scanner(self) -> ScanTTC:
        """Return the reader of its scans, with its outline and mount."""
        ...

    def drive(self, steering: float, speed: float) -> None:
        """Drive on for ``STEP`` with a wanted steering angle and a wanted speed."""
        ...

    def scan(self) -> Floats:
        """Return a scan, m."""
        ...

    def motion(self) -> Motion:
        """Return what odometry says."""
        ...

    def touches(self) -> bool:
        """Return whether the body touches a wall."""
        ...


class SingleTrack:
    """A kinematic single-track car with limits of steering, steering rate and acceleration.

    Parameters
    ----------
    course : Course
        Where it drives.
    pose, speed
        How it begins.
    rng : Generator
        It gives the noise.
    """

    noise = 0.01
    """The standard deviation of a reading, m."""

    def __init__(self, course: Course, pose: Pose, speed: float, rng: np.random.Generator) -> None:
        self.course, self.pose, self.speed, self.rng = course, pose, speed, rng
        self.steering = 0.0
        self.angles = np.linspace(-VIEW / 2.0, VIEW / 2.0, BEAMS)

    def scanner(self) -> ScanTTC:
        return ScanTTC(-VIEW / 2.0, VIEW / (BEAMS - 1), BEAMS, range_max=30.0, mount=(0.27, 0.0, 0.0), outline=OUTLINE)

    def drive(self, steering: float, speed: float) -> None:
        limited = min(max(steering, -SHARPEST), SHARPEST)
        self.steering += min(max(limited - self.steering, -STEERING_RATE * STEP), STEERING_RATE * STEP)
        faster = min(max(speed - self.speed, -DECELERATION * STEP), ACCELERATION * STEP)
        way = (self.speed + faster / 2.0) * STEP
        turn = way * self.curvature
        x, y, heading = self.pose
        middle = heading + turn / 2.0
        self.pose = Pose(x + way * math.cos(middle), y + way * math.sin(middle), heading + turn)
        self.speed += faster

    @property
    def curvature(self) -> float:
        """The curvature of its way, 1/m: the tires hold it up to ``GRIP``."""
        most = GRIP / max(self.speed * self.speed, 1e-6)
        return min(max(math.tan(self.steering) / WHEELBASE, -most), most)

    def scan(self) -> Floats:
        x, y, heading = self.pose
        ranges = self.course.rays(x + 0.27 * math.cos(heading), y + 0.27 * math.sin(heading), heading + self.angles)
        return ranges + self.rng.normal(0.0, self.noise, BEAMS)

    def motion(self) -> Motion:
        speed = self.speed * (1.0 + self.rng.normal(0.0, 0.01))
        return Motion(speed, self.speed * self.curvature + self.rng.normal(0.0, 0.01))

    def touches(self) -> bool:
        return self.course.hits(*self.pose, OUTLINE)


@dataclass
class PurePursuit:
    """Steers to a point of a line a distance ahead that grows with the speed, and drives as fast as its bends allow."""

    line: Line
    top_speed: float
    nearest: int = 0

    def command(self, car: Car, time: float) -> tuple[float, float]:
        """Return the wanted steering angle and speed."""
        x, y, heading = car.pose
        self.nearest = self.line.nearest(x, y, self.nearest)
        distance = 0.5 + 0.15 * abs(car.speed)
        goal = self.line.ahead(self.nearest, distance)[-1]
        dx, dy = self.line.x[goal] - x, self.line.y[goal] - y
        aside = dy * math.cos(heading) - dx * math.sin(heading)
        steering = math.atan(2.0 * WHEELBASE * aside / (dx * dx + dy * dy))
        return steering, min(self.top_speed, float(self.line.speed[self.nearest]))

    def plan(self, car: Car, distance: float = 8.0) -> Floats:
        """Return the points of the line ahead, in the vehicle frame, m."""
        ahead = self.line.ahead(self.nearest, distance)[1:]
        x, y, heading = car.pose
        dx, dy = self.line.x[ahead] - x, self.line.y[ahead] - y
        cos, sin = math.cos(heading), math.sin(heading)
        return np.column_stack([dx * cos + dy * sin, dy * cos - dx * sin])


@dataclass
class RandomSteering:
    """Holds a steering angle at random for a time at random, and a speed."""

    speed: float
    rng: np.random.Generator
    until: float = 0.0
    angle: float = 0.0

    def command(self, car: Car, time: float) -> tuple[float, float]:
        """Return the wanted steering angle and speed."""
        if time >= self.until:
            self.until = time + self.rng.uniform(0.2, 1.5)
            self.angle = self.rng.uniform(-SHARPEST, SHARPEST)
        return self.angle, self.speed
