"""Occupancy maps with a line to drive: the walls, the rays of a scanner against them, and the race line.

A map is what ``map_server`` reads: a picture, and a YAML file with its resolution and origin. The distance from each
cell to the nearest wall is computed once. A ray then marches: nothing is nearer than that distance, so it may go as far
at once. A track comes with its race line. A map without one is driven half-way between its outer walls and what stands
inside them. For courses that nobody has seen there are those made at random, ``random 7``, and the others turned
round: ``berlin mirrored``, ``berlin reversed``.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import contourpy
import numba
import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy import ndimage

Floats = NDArray[np.float64]

CORNER = 1.4143
"""The distance between the middles of two cells is at most this much more than that between the cells, in cells."""
SHORTEST_STEP = 0.25
"""Close to a wall a ray goes this far at once, in cells."""
SPACING = 0.2
"""The distance between the points of a line, about, m."""
LEAST = 0.3
"""What a line keeps from the walls at least, m: the car is 0.31 m wide."""
NEIGHBOURS = 15
"""A line that is moved for a wall is moved this many points before and after it, too."""
LATERAL = 6.0
"""The lateral acceleration in the bends of a line half-way, which are as sharp as the map, m/s^2."""
RACING_LATERAL = 9.0
"""The lateral acceleration in the bends of a race line, m/s^2: 1 less than the tires of the car hold."""
FASTEST = 8.0
"""The top speed of the race lines, m/s."""


@dataclass(frozen=True)
class Line:
    """A closed line to drive along.

    Attributes
    ----------
    x, y, curvature : ndarray, shape (n,)
        Place, m, and curvature, 1/m, of points that are evenly spaced.
    speed : ndarray, shape (n,)
        The speed that the bends allow, m/s.
    spacing : float
        The distance from point to point, m.
    """

    x: Floats
    y: Floats
    curvature: Floats
    speed: Floats
    spacing: float

    @property
    def points(self) -> Floats:
        """The points, shape (n, 2), m."""
        return np.column_stack([self.x, self.y])

    @property
    def length(self) -> float:
        """The length of a lap, m."""
        return self.spacing * len(self.x)

    def heading(self, index: int) -> float:
        """Return the direction in which the line leaves a point, rad."""
        after = (index + 1) % len(self.x)
        return float(np.arctan2(self.y[after] - self.y[index], self.x[after] - self.x[index]))

    def nearest(self, x: float, y: float, near: int | None = None) -> int:
        """Return the point nearest to a place; with ``near``, among the 80 about that one."""
        begin, count = (0, len(self.x)) if near is None else (near - 40, 80)
        return int(nearest_of(self.x, self.y, x, y, begin, count))

    def ahead(self, index: int, distance: float) -> NDArray[np.intp]:
        """Return the points from ``index`` on over a distance, m."""
        return (index + np.arange(int(distance / self.spacing) + 2)) % len(self.x)


@numba.njit(cache=True)
def nearest_of(line_x: Floats, line_y: Floats, x: float, y: float, begin: int, count: int) -> int:
    """Return the point of a closed line that is nearest to a place, among ``count`` from one on."""
    best, least = 0, np.inf
    for step in range(count):
        at = (begin + step) % len(line_x)
        apart = (line_x[at] - x) ** 2 + (line_y[at] - y) ** 2
        if apart < least:
            best, least = at, apart
    return best


@dataclass(frozen=True)
class Course:
    """A map, and the line to drive in it.

    Attributes
    ----------
    name : str
        Its name.
    clearance : ndarray, shape (rows, columns)
        The distance from the middle of a cell to that of the nearest wall, m, and 0 in walls; the first row is at the
        bottom.
    resolution : float
        The width of a cell, m.
    origin : ndarray, shape (2,)
        The place of the lower left corner, m.
    line : Line
        The line to drive.
    """

    name: str
    clearance: Floats
    resolution: float
    origin: Floats
    line: Line

    def rays(self, x: float, y: float, angles: Floats, longest: float = 30.0) -> Floats:
        """Return the distance to the wall in each direction, m, at most ``longest``; to a quarter of a cell."""
        left, low = self.origin
        return march(self.clearance, 1.0 / self.resolution, x - left, y - low, np.cos(angles), np.sin(angles), longest)

    def hits(self, x: float, y: float, heading: float, outline: tuple[float, float, float, float]) -> bool:
        """Return whether a rectangle in a pose touches a wall."""
        left, low = self.origin
        return touches(self.clearance, self.resolution, x - left, y - low, heading, outline)


@numba.njit(cache=True)
def touches(
    clearance: Floats, resolution: float, x: float, y: float, heading: float, outline: tuple[float, float, float, float]
) -> bool:
    """Return whether the edges of a rectangle, half a cell from point to point, touch a wall or leave the map."""
    x_rear, x_front, y_right, y_left = outline
    rows, columns = clearance.shape
    step, cos, sin = resolution / 2.0, math.cos(heading), math.sin(heading)
    along, across = int((x_front - x_rear) / step) + 2, int((y_left - y_right) / step) + 2
    for point in range(2 * (along + across)):
        if point < 2 * along:
            px, py = min(x_rear + point // 2 * step, x_front), y_right if point % 2 else y_left
        else:
            beside = point - 2 * along
            px, py = x_rear if beside % 2 else x_front, min(y_right + beside // 2 * step, y_left)
        column, row = (x + px * cos - py * sin) / resolution, (y + px * sin + py * cos) / resolution
        if not (0.0 <= column < columns and 0.0 <= row < rows) or clearance[int(row), int(column)] == 0.0:
            return True
    return False


@numba.njit(cache=True)
def march(clearance: Floats, per_metre: float, x: float, y: float, cos: Floats, sin: Floats, longest: float) -> Floats:
    """Return how far each ray goes before it is in a wall or beyond the map, m."""
    rows, columns = clearance.shape
    distance = np.empty_like(cos)
    shortest, corner = SHORTEST_STEP / per_metre, CORNER / per_metre
    for ray in range(len(cos)):
        way = 0.0
        while way < longest:
            column, row = (x + way * cos[ray]) * per_metre, (y + way * sin[ray]) * per_metre
            if not (0.0 <= column < columns and 0.0 <= row < rows):
                break
            free = clearance[int(row), int(column)]
            if free == 0.0:
                break
            way += max(free - corner, shortest)
        distance[ray] = min(way, longest)
    return distance


def folder() -> Path:
    """Return the folder of the recordings, which has the maps and tracks in ``sim``."""
    return Path(os.environ.get("TTC_FAST_DATA", Path(__file__).parents[3] / "shared" / "data")) / "sim"


def names() -> list[str]:
    """Return the names of all courses there are: tracks with a race line, and maps without one."""
    tracks = sorted(each.parent.name for each in folder().glob("tracks/*/*_raceline.csv"))
    return [*tracks, *sorted(each.stem for each in folder().glob("maps/*.yaml"))]


@lru_cache
def course(name: str) -> Course:
    """Return a course by its name: a track or map there is, or ``random`` with a number, and how it is turned round."""
    kind, _, turned = name.partition(" ")
    if kind == "random":
        return random_course(int(turned))
    if turned:
        return turned_round(course(kind), turned)
    track = folder() / "tracks" / name
    described = track / f"{name}_map.yaml" if track.is_dir() else folder() / "maps" / f"{name}.yaml"
    told = dict(line.split(":", 1) for line in described.read_text().splitlines() if ":" in line)
    resolution = float(told["resolution"])
    origin = np.array([float(each) for each in told["origin"].strip(" []").split(",")[:2]])
    picture = np.asarray(Image.open(described.with_name(told["image"].strip())).convert("L"))[::-1]
    free = picture > 255 * (1.0 - float(told["occupied_thresh"]))
    free = np.pad(free[1:-1, 1:-1], 1)
    clearance = resolution * ndimage.distance_transform_edt(free)
    if track.is_dir():
        points = np.loadtxt(track / f"{name}_raceline.csv", delimiter=";")[:, 1:3]
        points = points[:-1] if np.allclose(points[0], points[-1], atol=1e-3) else points
        line = with_speeds(away_from_walls(evenly(points), clearance, resolution, origin), RACING_LATERAL)
    else:
        line = with_speeds(line_half_way(free, resolution, origin), LATERAL)
    return Course(name, clearance, resolution, origin, line)


def turned_round(where: Course, how: str) -> Course:
    """Return a course mirrored, or driven the other way round, which is ``reversed``."""
    name, points, clearance, origin = f"{where.name} {how}", where.line.points, where.clearance, where.origin
    lateral = float(np.max(where.line.speed**2 * np.abs(where.line.curvature)))
    if how == "mirrored":
        width = clearance.shape[1] * where.resolution
        clearance, origin = np.ascontiguousarray(clearance[:, ::-1]), np.array([-origin[0] - width, origin[1]])
        points = points * [-1.0, 1.0]
    elif how == "reversed":
        points = points[::-1]
    else:
        raise ValueError(f"a course is mirrored or reversed, got {name!r}")
    return Course(name, clearance, where.resolution, origin, with_speeds(evenly(points), lateral))


def random_course(seed: int) -> Course:
    """Return a closed track at random, 1.6 to 3 m wide, with a line that cuts its bends as a race line does."""
    rng, resolution = np.random.default_rng([23, seed]), 0.05
    width, corners = rng.uniform(1.6, 3.0), int(rng.integers(9, 15))
    angle = (np.arange(corners) + rng.uniform(-0.3, 0.3, corners)) * 2.0 * np.pi / corners
    radius = rng.uniform(4.0, 16.0, corners)
    middle = evenly(np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]))
    while np.abs(middle.curvature).max() > 1.0 / (0.5 * width + 0.3):
        middle = evenly(ndimage.gaussian_filter1d(middle.points, 2.0, axis=0, mode="wrap"))
    origin = middle.points.min(axis=0) - width
    rows, columns = (((middle.points.max(axis=0) + width - origin) / resolution).astype(np.intp) + 1)[::-1]
    fine = np.arange(0.0, len(middle.x), 0.1)
    x, y = (np.interp(fine, np.arange(len(each) + 1), np.append(each, each[0])) for each in (middle.x, middle.y))
    solid = np.ones((rows, columns), np.bool_)
    solid[((y - origin[1]) / resolution).astype(np.intp), ((x - origin[0]) / resolution).astype(np.intp)] = False
    clearance = resolution * ndimage.distance_transform_edt(
        resolution * ndimage.distance_transform_edt(solid) < width / 2.0
    )
    line = middle
    for _ in range(60):
        smoothed = ndimage.gaussian_filter1d(line.points, 6.0, axis=0, mode="wrap")
        line = away_from_walls(evenly(smoothed), clearance, resolution, origin)
    return Course(f"random {seed}", clearance, resolution, origin, with_speeds(line, RACING_LATERAL))


def away_from_walls(line: Line, clearance: Floats, resolution: float, origin: Floats) -> Line:
    """Return a line that keeps ``LEAST`` from the walls: some race lines are drawn along them.

    It is moved sideways, and gently, well before the wall: a kink could not be driven.
    """
    slopes: Any = np.gradient(clearance, resolution)
    up, right = slopes
    for _ in range(60):
        cells = ((line.y - origin[1]) / resolution).astype(np.intp), ((line.x - origin[0]) / resolution).astype(np.intp)
        lacks = np.maximum(LEAST - clearance[cells], 0.0)
        if not lacks.any():
            break
        to_x, to_y = np.roll(line.y, 1) - np.roll(line.y, -1), np.roll(line.x, -1) - np.roll(line.x, 1)
        length = np.hypot(to_x, to_y)
        left = right[cells] * to_x + up[cells] * to_y > 0.0
        move = np.zeros_like(length)
        for side, way in ((left, 0.5), (~left, -0.5)):
            most = ndimage.maximum_filter1d(np.where(side, lacks, 0.0), 2 * NEIGHBOURS + 1, mode="wrap")
            move += way * ndimage.gaussian_filter1d(most, 2.0 * NEIGHBOURS / 3.0, mode="wrap")
        line = evenly(np.column_stack([line.x + move * to_x / length, line.y + move * to_y / length]))
    return line


def line_half_way(free: NDArray[np.bool_], resolution: float, origin: Floats) -> Line:
    """Return the line half-way between the outer walls and what stands inside them, smoothed."""
    labels, _ = ndimage.label(~free, structure=np.ones((3, 3)))
    outer = labels == labels[0, 0]
    sizes = np.bincount(labels.ravel())
    sizes[[0, labels[0, 0]]] = 0
    island = labels == np.argmax(sizes)
    apart = ndimage.distance_transform_edt(~outer) - ndimage.distance_transform_edt(~island)
    lines: Any = contourpy.contour_generator(z=apart).lines(0.0)
    longest = max((each for each in lines if np.allclose(each[0], each[-1])), key=len)
    points = (longest[:-1] + 0.5) * resolution + origin
    return evenly(ndimage.gaussian_filter1d(evenly(points).points, 2.5, axis=0, mode="wrap"))


def evenly(points: Floats) -> Line:
    """Return a closed line of points that are evenly spaced, without a limit of the speed."""
    closed = np.vstack([points, points[:1]])
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(closed, axis=0).T))])
    count = int(way[-1] / SPACING)
    spacing = way[-1] / count
    x, y = (np.interp(np.arange(count) * spacing, way, closed[:, axis]) for axis in (0, 1))
    heading = np.arctan2(np.roll(y, -1) - np.roll(y, 1), np.roll(x, -1) - np.roll(x, 1))
    turn = np.angle(np.exp(1j * (np.roll(heading, -1) - np.roll(heading, 1))))
    return Line(x, y, turn / (2.0 * spacing), np.full(count, np.inf), spacing)


def with_speeds(line: Line, lateral: float) -> Line:
    """Return a line with the speeds that a lateral acceleration allows in its bends, and slowing down before them."""
    speed = np.sqrt(lateral / np.maximum(np.abs(line.curvature), 1e-3))
    return replace(line, speed=slowing(np.minimum(speed, FASTEST), line.spacing))


def slowing(speed: Floats, spacing: float, deceleration: float = 4.0) -> Floats:
    """Return speeds that can be reached by slowing down evenly before each bend, m/s."""
    speed = speed.copy()
    for index in range(2 * len(speed) - 1, -1, -1):
        here, after = index % len(speed), (index + 1) % len(speed)
        speed[here] = min(speed[here], np.sqrt(speed[after] ** 2 + 2.0 * deceleration * spacing))
    return speed
