"""The simulated car, its scanner, and what surrounds them: line segments in the plane."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from ttc_fast import ScanTTC

BODY = (-0.1, 0.4, -0.15, 0.15)
"""x_rear, x_front, y_right, y_left about the rear axle, m: a car of a tenth of the size."""


class Pose(NamedTuple):
    """The position, heading and speed of the car."""

    x: float
    y: float
    heading: float
    speed: float


@dataclass(frozen=True)
class Plan:
    """What the driver does without a brake: a speed, held or changed evenly, and a steady bend."""

    speed: float
    """The speed at first, m/s; negative when reversing."""
    acceleration: float = 0.0
    """The change of the speed, m/s^2, down to a stop."""
    top_speed: float = 8.0
    """The limit of the speed, m/s, without sign."""
    curvature: float = 0.0
    """The curvature of the way, 1/m, positive to the left."""

    def wanted(self, time: float) -> float:
        """Return the speed at a time, m/s."""
        speed = abs(self.speed) + self.acceleration * time
        return math.copysign(max(0.0, min(speed, self.top_speed)), self.speed)


@dataclass(frozen=True)
class Brake:
    """The brake of the car."""

    deceleration: float = 6.0
    """The full deceleration, m/s^2."""
    delay: float = 0.05
    """The time from the command to the bite, s."""


def step(pose: Pose, curvature: float, speed: float, dt: float) -> Pose:
    """Drive on along the bend for ``dt``, at the mean of the old and the new speed: exact on a circle."""
    way = 0.5 * (pose.speed + speed) * dt
    turn = curvature * way
    chord = way * (math.sin(turn / 2.0) / (turn / 2.0) if turn else 1.0)
    direction = pose.heading + turn / 2.0
    return Pose(pose.x + chord * math.cos(direction), pose.y + chord * math.sin(direction), pose.heading + turn, speed)


def slowed(speed: float, deceleration: float, dt: float) -> float:
    """Return a speed after braking for ``dt``."""
    return math.copysign(max(abs(speed) - deceleration * dt, 0.0), speed)


Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Mover:
    """Something that moves by itself along a straight line, and may brake."""

    segments: Floats
    """x and y of both ends of each segment at time 0, shape (S, 4), m."""
    velocity: tuple[float, float]
    """The velocity until it brakes, m/s."""
    brakes_at: float = np.inf
    """The time at which it begins to brake, s."""
    deceleration: float = 6.0
    """The deceleration to a stop, m/s^2."""

    def travelled(self, time: float) -> float:
        """Return the time in which the first speed would lead as far, s."""
        speed = float(np.hypot(*self.velocity))
        after = max(time - self.brakes_at, 0.0)
        if speed == 0.0 or after == 0.0:
            return time
        after = min(after, speed / self.deceleration)
        return self.brakes_at + after - self.deceleration * after**2 / (2.0 * speed)

    def at(self, time: float) -> Floats:
        """Return the segments at a time."""
        return self.segments + np.array(2 * self.velocity) * self.travelled(time)


@dataclass(frozen=True)
class World:
    """Everything there is to hit."""

    walls: Floats
    """The segments that stand, shape (S, 4), m."""
    movers: tuple[Mover, ...] = field(default=())

    def at(self, time: float) -> Floats:
        """Return all segments at a time."""
        return np.concatenate([self.walls, *(mover.at(time) for mover in self.movers)]) if self.movers else self.walls


def box(x: float, y: float, length: float, width: float, heading: float = 0.0) -> Floats:
    """Return the four sides of a rectangle about (x, y)."""
    corners = np.array([[-length, -width], [length, -width], [length, width], [-length, width]]) / 2.0
    cos, sin = np.cos(heading), np.sin(heading)
    return chain(corners @ np.array([[cos, sin], [-sin, cos]]) + [x, y], closed=True)


def chain(points: Any, closed: bool = False) -> Floats:
    """Return the segments from point to point."""
    points = np.asarray(points, np.float64)
    ends = np.roll(points, -1, axis=0)
    joined = np.hstack([points, ends])
    return joined if closed else joined[:-1]


def arc(radius: float, begin: float, end: float, x: float, y: float, pieces: int = 48) -> Floats:
    """Return a piece of a circle about (x, y)."""
    angles = np.linspace(begin, end, pieces + 1)
    return chain(np.column_stack([x + radius * np.cos(angles), y + radius * np.sin(angles)]))


@numba.njit(cache=True)
def seen_from(segments: Floats, x: float, y: float, heading: float) -> Floats:
    """Return the segments in the frame of a pose."""
    cos, sin = math.cos(heading), math.sin(heading)
    seen = np.empty_like(segments)
    for end in (0, 2):
        east, north = segments[:, end] - x, segments[:, end + 1] - y
        seen[:, end], seen[:, end + 1] = cos * east + sin * north, cos * north - sin * east
    return seen


@numba.njit(cache=True, error_model="numpy")
def touch(segments: Floats, outline: tuple[float, float, float, float]) -> bool:
    """Return whether any of the segments (S, 4), in the vehicle frame, meets the outline, by clipping."""
    for segment in segments:
        enter, leave = 0.0, 1.0
        for axis in range(2):
            low, high = outline[2 * axis], outline[2 * axis + 1]
            at, way = segment[axis], segment[axis + 2] - segment[axis]
            if way != 0.0:
                one, other = (low - at) / way, (high - at) / way
                enter, leave = max(enter, min(one, other)), min(leave, max(one, other))
            elif not low <= at <= high:
                leave = -np.inf
        if enter <= leave:
            return True
    return False


@numba.njit(cache=True)
def first_touch(
    segments: Floats, speed: float, curvature: float, times: Floats, outline: tuple[float, float, float, float]
) -> int:
    """Return the first of the times at which the outline, moving on in a bend, meets any of the segments, or -1."""
    longest = np.hypot(max(-outline[0], outline[1]), max(-outline[2], outline[3])) + abs(speed) * times[-1]
    near = np.empty_like(segments)
    count = 0
    for segment in segments:
        x, y, along_x, along_y = segment[0], segment[1], segment[2] - segment[0], segment[3] - segment[1]
        length = along_x * along_x + along_y * along_y
        part = min(max(-(x * along_x + y * along_y) / length, 0.0), 1.0) if length > 0.0 else 0.0
        if np.hypot(x + part * along_x, y + part * along_y) <= longest:
            near[count] = segment
            count += 1
    if count == 0:
        return -1
    for at in range(len(times)):
        way = speed * times[at]
        half = curvature * way / 2.0
        chord = way * (math.sin(half) / half if half != 0.0 else 1.0)
        if touch(seen_from(near[:count], chord * math.cos(half), chord * math.sin(half), 2.0 * half), outline):
            return at
    return -1


BEAMS = 361
ANGLE_MIN = -0.75 * np.pi
INCREMENT = 1.5 * np.pi / (BEAMS - 1)
RANGE_MIN, RANGE_MAX = 0.05, 20.0
ANGLES = ANGLE_MIN + INCREMENT * np.arange(BEAMS)
DIRECTIONS = np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])


@dataclass(frozen=True)
class Scanner:
    """A scanner with its mount and its faults."""

    mount: tuple[float, float, float] = (0.25, 0.0, 0.0)
    """x, y (m) and yaw (rad) in the vehicle frame."""
    noise: float = 0.015
    """The standard deviation of a reading, m."""
    dropouts: float = 0.02
    """The share of readings that are missing."""
    speckle: float = 0.0005
    """The share of readings that are nearer than the truth by chance: dust, rain, sun."""
    latency: float = 0.02
    """The time from measuring to deciding, s."""
    period: float = 0.025
    """The time from scan to scan, s."""
    blind_from: float = np.inf
    """The time at which it goes blind, s."""

    def scan(self, time: float, segments: Floats, rng: np.random.Generator) -> Floats:
        """Return the readings of segments in the vehicle frame."""
        if time >= self.blind_from:
            return np.full(BEAMS, np.nan)
        ranges = distances(seen_from(segments, *self.mount))
        ranges += rng.normal(0.0, self.noise, BEAMS)
        ranges[ranges > RANGE_MAX] = np.inf
        speckled = rng.random(BEAMS) < self.speckle
        ranges[speckled] = rng.uniform(RANGE_MIN, np.clip(ranges[speckled], RANGE_MIN, RANGE_MAX))
        ranges[rng.random(BEAMS) < self.dropouts] = np.nan
        return ranges

    def met(self, segments: Floats) -> Floats:
        """Return the places that the beams meet without any fault, in the vehicle frame, as segments of no length."""
        ranges = distances(seen_from(segments, *self.mount))
        near = ranges <= RANGE_MAX
        x, y, yaw = self.mount
        cos, sin = math.cos(yaw), math.sin(yaw)
        places = ranges[near, np.newaxis] * DIRECTIONS[near] @ np.array([[cos, sin], [-sin, cos]]) + [x, y]
        return np.hstack([places, places])

    def reader(self, outline: tuple[float, float, float, float]) -> ScanTTC:
        """Return the ``ScanTTC`` that reads it."""
        return ScanTTC(
            ANGLE_MIN,
            INCREMENT,
            BEAMS,
            range_min=RANGE_MIN,
            range_max=RANGE_MAX,
            mount=self.mount,
            outline=outline,
        )


@numba.njit(cache=True, error_model="numpy")
def distances(segments: Floats) -> Floats:
    """Return the distance to the nearest segment along each beam, in the scanner frame; infinite without one."""
    nearest = np.full(BEAMS, np.inf)
    for x, y, x_end, y_end in segments:
        along_x, along_y = x_end - x, y_end - y
        area = x * along_y - y * along_x
        for beam in range(BEAMS):
            cos, sin = DIRECTIONS[beam]
            across = cos * along_y - sin * along_x
            distance, part = area / across, (x * sin - y * cos) / across
            if 0.0 < distance < nearest[beam] and 0.0 <= part <= 1.0:
                nearest[beam] = distance
    return nearest
