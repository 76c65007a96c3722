"""The outline along a planned path: points that the vehicle's origin will follow, instead of a motion that stays.

A pose is made for each point: its place, and the direction in which the path leads there. Between two poses the vehicle
moves by a constant twist, which is what ``Sweep`` is about, with the way in the place of time. A static point enters in
the first piece in which it meets the outline; its time is its way along the points over the speed. Beyond the end the
vehicle goes straight on along its last heading.
"""

from __future__ import annotations

import math
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ttc_fast.reference.arguments import finite
from ttc_fast.reference.path.sweep import Sweep
from ttc_fast.reference.vehicle import LARGEST, Motion

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ttc_fast.reference.vehicle import Outline

    Doubles = NDArray[np.float64]
    Bools = NDArray[np.bool_]

NEAR = 1.0
"""The path may begin this far from the vehicle's origin, in lengths of the vehicle."""
FADE = 2.0
"""What the path begins off the vehicle's origin fades over this way, in lengths of the vehicle."""
SHORTEST = 1e-3
"""Points nearer to the one before than this, in lengths of the vehicle, are left out."""
LONGEST = 3.0
"""Pieces longer than this, in lengths of the vehicle, are straight in their middle."""

Point = tuple[float, float]


class Pose(NamedTuple):
    """A place, m, and a heading as its cosine and sine."""

    x: float
    y: float
    cos: float
    sin: float

    def seen(self, x: Any, y: Any) -> tuple[Any, Any]:
        """Return points as they are seen from here."""
        dx, dy = x - self.x, y - self.y
        return dx * self.cos + dy * self.sin, dy * self.cos - dx * self.sin


class Step(NamedTuple):
    """A point of the path, and the way to it from the one before, m."""

    place: Point
    way: float


class PlannedPath:
    """A path that a vehicle will follow, from where it is now."""

    def __init__(self, outline: Outline, path: Any) -> None:
        self._outline = outline
        size = max(outline.x_front - outline.x_rear, outline.y_left - outline.y_right)
        steps = split(led_from_origin(checked_points(path, size), size), size)
        self._ways = list(accumulate(step.way for step in steps))
        self._poses = poses(steps)
        self._reverses = self._poses[1].x < 0.0

    def motion(self, speed: Any) -> Motion:
        """Return how the vehicle moves now, if it follows the path at a speed."""
        speed = finite("speed", speed)
        if speed != 0.0 and (speed < 0.0) is not self._reverses:
            leads = "backwards" if self._reverses else "forward"
            raise ValueError(f"path leads {leads}, and speed is {speed}: give the way that is driven")
        vx, vy, omega = self._twist(0)
        return Motion(abs(speed) * vx, abs(speed) * omega, abs(speed) * vy)

    def ttc(self, x: Doubles, y: Doubles, contact: Bools, speed: float, horizon: float) -> Doubles:
        """Return the time until each point hits the vehicle, s, as ``Sweep.ttc`` does."""
        now = Sweep(self._outline, horizon, self.motion(speed))
        pace = abs(speed)
        way = np.full_like(x, np.inf)
        if pace > 0.0:
            for piece, pose in enumerate(self._poses):
                seen_x, seen_y = pose.seen(x, y)
                last = piece + 1 == len(self._poses)
                end = pace * horizon if last else self._ways[piece + 1] - self._ways[piece]
                sweep = Sweep.unchecked(self._outline, end, *self._twist(piece))
                entry = sweep.entry(seen_x, seen_y)
                entry = np.where(entry <= end, entry, np.inf)
                if piece > 0:
                    entry = np.where(sweep.is_inside(seen_x, seen_y), 0.0, entry)
                way = np.where(way < np.inf, way, self._ways[piece] + entry)
        with np.errstate(divide="ignore", invalid="ignore"):
            time = way / pace
        time[~(time <= horizon)] = np.inf
        return np.where(contact, now.ttc(x, y, contact), time)

    def _twist(self, piece: int) -> tuple[float, float, float]:
        """Return how the vehicle moves in a piece, for each m along the points; the last piece is beyond the end."""
        if piece + 1 == len(self._poses):
            return (-1.0 if self._reverses else 1.0), 0.0, 0.0
        at, to = self._poses[piece], self._poses[piece + 1]
        dx, dy = at.seen(to.x, to.y)
        c, w = at.cos * to.cos + at.sin * to.sin, at.cos * to.sin - at.sin * to.cos
        angle = math.atan2(w, c)
        half = angle / 2.0
        along = half * (1.0 + c) / w if abs(w) > 1e-3 else 1.0 - angle * angle / 12.0
        way = self._ways[piece + 1] - self._ways[piece]
        return (along * dx + half * dy) / way, (along * dy - half * dx) / way, angle / way


def length(dx: float, dy: float) -> float:
    """Return the length of a vector."""
    return math.sqrt(dx * dx + dy * dy)


def checked_points(path: Any, size: float) -> list[Point]:
    """Return the points of the argument ``path``, if they begin near the vehicle's origin."""
    if isinstance(path, np.ma.MaskedArray):
        raise TypeError("path must not be a masked array")
    try:
        array = np.asarray(path)
    except ValueError:
        raise TypeError(f"path must be points, of shape (N, 2), got {path!r}") from None
    if array.dtype.kind not in "fiu":
        raise TypeError(f"path must be points, of shape (N, 2), got {path!r}")
    if array.ndim != 2 or array.shape[1] != 2:
        raise ValueError(f"path must have shape (N, 2), got {array.shape}")
    points = [(float(x), float(y)) for x, y in array]
    if len(points) < 2:
        raise ValueError(f"path must have two points or more, got {len(points)}")
    for x, y in points:
        if not (abs(x) <= LARGEST and abs(y) <= LARGEST):
            raise ValueError(f"path must be finite and lie within {LARGEST} m, got ({x}, {y})")
    if length(*points[0]) > NEAR * size:
        raise ValueError(f"path must start at the vehicle: its first point is {length(*points[0])} m from the origin")
    return points


def led_from_origin(points: list[Point], size: float) -> list[Step]:
    """Return the points that lead on from the origin: what they begin off it fades on the way."""
    led = [Step((0.0, 0.0), 0.0)]
    share, way, off = 1.0, 0.0, points[0]
    for before, point in pairwise(points):
        if share > 0.0:
            way += length(point[0] - before[0], point[1] - before[1])
            share = max(1.0 - way / (FADE * size), 0.0)
        place = point[0] - off[0] * share, point[1] - off[1] * share
        step = length(place[0] - led[-1].place[0], place[1] - led[-1].place[1])
        if step >= SHORTEST * size:
            led.append(Step(place, step))
    if len(led) < 2:
        raise ValueError("path must lead somewhere: all of its points are in one place")
    return led


def split(steps: list[Step], size: float) -> list[Step]:
    """Return the points with two more on each long piece, so that the vehicle turns near its ends."""
    made = [steps[0]]
    for (before, _), (place, way) in pairwise(steps):
        if way > LONGEST * size:
            dx, dy, share = place[0] - before[0], place[1] - before[1], size / way
            made.append(Step((before[0] + dx * share, before[1] + dy * share), size))
            made.append(Step((place[0] - dx * share, place[1] - dy * share), way - 2.0 * size))
            made.append(Step(place, size))
        else:
            made.append(Step(place, way))
    return made


def poses(steps: list[Step]) -> list[Pose]:
    """Return the poses at the points. The heading at one lies between those of its two pieces, as on a circle."""
    side = -1.0 if steps[1].place[0] < 0.0 else 1.0
    made = [Pose(*steps[0].place, 1.0, 0.0)]
    before, way_before = (1.0, 0.0), 0.0
    for index, (place, way) in enumerate(steps[1:], 1):
        scale = side / way
        chord = (place[0] - made[-1].x) * scale, (place[1] - made[-1].y) * scale
        if chord[0] * before[0] + chord[1] * before[1] <= 0.0:
            raise ValueError(f"path turns by 90 degrees or more at {made[-1][:2]}: end it there")
        if index > 1:
            x, y = before[0] * way + chord[0] * way_before, before[1] * way + chord[1] * way_before
            scale = 1.0 / length(x, y)
            made[-1] = made[-1]._replace(cos=x * scale, sin=y * scale)
        _, _, cos, sin = made[-1]
        twice = 2.0 * (chord[0] * cos + chord[1] * sin)
        made.append(Pose(*place, twice * chord[0] - cos, twice * chord[1] - sin))
        before, way_before = chord, way
    return made
