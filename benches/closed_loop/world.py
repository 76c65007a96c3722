"""What surrounds the car: walls that stand and boxes that move, all of it line segments in the plane."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Mover:
    """Something that moves by itself along a straight line, and may brake."""

    segments: Floats
    """(S, 4): x and y of both ends at time 0, m."""
    velocity: tuple[float, float]
    """m/s, until it brakes."""
    brakes_at: float = np.inf
    """s."""
    deceleration: float = 6.0
    """m/s^2, to a stop."""

    def travelled(self, time: float) -> float:
        """How long it has been under way, in seconds of its first speed."""
        speed = float(np.hypot(*self.velocity))
        after = max(time - self.brakes_at, 0.0)
        if speed == 0.0 or after == 0.0:
            return time
        after = min(after, speed / self.deceleration)
        return self.brakes_at + after - self.deceleration * after**2 / (2.0 * speed)

    def at(self, time: float) -> Floats:
        """Where it is."""
        return self.segments + np.tile(self.velocity, 2) * self.travelled(time)


@dataclass(frozen=True)
class World:
    """Everything there is to hit."""

    walls: Floats
    """(S, 4), m."""
    movers: tuple[Mover, ...] = field(default=())

    def at(self, time: float) -> Floats:
        """All segments."""
        return np.concatenate([self.walls, *(mover.at(time) for mover in self.movers)])


def box(x: float, y: float, length: float, width: float, heading: float = 0.0) -> Floats:
    """The four sides of a rectangle about (x, y)."""
    corners = np.array([[-length, -width], [length, -width], [length, width], [-length, width]]) / 2.0
    cos, sin = np.cos(heading), np.sin(heading)
    return chain(corners @ np.array([[cos, sin], [-sin, cos]]) + [x, y], closed=True)


def chain(points: Any, closed: bool = False) -> Floats:
    """Segments from point to point."""
    points = np.asarray(points, np.float64)
    ends = np.roll(points, -1, axis=0)
    joined = np.hstack([points, ends])
    return joined if closed else joined[:-1]


def arc(radius: float, begin: float, end: float, x: float, y: float, pieces: int = 48) -> Floats:
    """A piece of a circle about (x, y)."""
    angles = np.linspace(begin, end, pieces + 1)
    return chain(np.column_stack([x + radius * np.cos(angles), y + radius * np.sin(angles)]))


def seen_from(segments: Floats, x: Any, y: Any, heading: Any) -> Floats:
    """The same segments in the frame of somebody at (x, y); of many, if these are arrays, in a first axis."""
    x, y, heading = (np.asarray(each)[..., np.newaxis] for each in (x, y, heading))
    cos, sin = np.cos(heading), np.sin(heading)
    ends = []
    for end in (0, 2):
        east, north = segments[:, end] - x, segments[:, end + 1] - y
        ends += [cos * east + sin * north, cos * north - sin * east]
    return np.stack(ends, axis=-1)


def touch(segments: Floats, outline: tuple[float, float, float, float]) -> NDArray[np.bool_]:
    """Whether any of the segments (..., S, 4), in the vehicle's frame, meets the outline: clipped against its edges."""
    x_rear, x_front, y_right, y_left = outline
    begin, along = segments[..., :2], segments[..., 2:] - segments[..., :2]
    enter, leave = np.zeros(segments.shape[:-1]), np.ones(segments.shape[:-1])
    with np.errstate(divide="ignore", invalid="ignore"):
        for axis, low, high in ((0, x_rear, x_front), (1, y_right, y_left)):
            at, way = begin[..., axis], along[..., axis]
            one, other = (low - at) / way, (high - at) / way
            inside = (at >= low) & (at <= high)
            enter = np.maximum(enter, np.where(way == 0.0, np.where(inside, 0.0, np.inf), np.minimum(one, other)))
            leave = np.minimum(leave, np.where(way == 0.0, np.where(inside, 1.0, -np.inf), np.maximum(one, other)))
    touched: NDArray[np.bool_] = np.any(enter <= leave, axis=-1)
    return touched
