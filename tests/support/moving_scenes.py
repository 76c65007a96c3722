"""A small scanner in a world of walls and moving discs, with exact truth."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

import ttc_fast

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

Point = tuple[float, float]

BEAMS = 541
ANGLE_MIN, INCREMENT = -0.75 * math.pi, 1.5 * math.pi / (BEAMS - 1)
RANGE_MIN, RANGE_MAX = 0.05, 30.0
PERIOD = 0.1


@dataclass(frozen=True)
class Disc:
    """A disc that moves at constant velocity."""

    centre: Point
    radius: float
    velocity: Point = (0.0, 0.0)


@dataclass(frozen=True)
class World:
    """Walls from point to point, discs, and a sensor that drives and turns at constant speeds."""

    walls: tuple[tuple[Point, Point], ...] = ()
    discs: tuple[Disc, ...] = ()
    start: Point = (0.0, 0.0)
    heading: float = 0.0
    speed: float = 0.0
    yaw_rate: float = 0.0
    noise: float = 0.0
    dropouts: float = 0.0
    seed: int = 1
    start_stamp: float = 1.7e9
    angles: NDArray[Any] = field(default_factory=lambda: ANGLE_MIN + INCREMENT * np.arange(BEAMS))

    def scans(self, frames: int, dtype: Any = np.float32) -> Iterator[tuple[NDArray[Any], float]]:
        """Return ranges and stamps."""
        rng = np.random.default_rng(self.seed)
        for frame in range(frames):
            time = PERIOD * frame
            ranges = self.ranges(time) + rng.normal(0, self.noise, BEAMS)
            ranges[rng.random(BEAMS) < self.dropouts] = np.nan
            yield ranges.astype(dtype), self.start_stamp + time

    def ranges(self, time: float) -> NDArray[np.float64]:
        """Return what a perfect scanner sees; infinite where there is nothing."""
        heading = self.heading + self.yaw_rate * time
        if self.yaw_rate == 0:
            x = self.start[0] + self.speed * time * math.cos(heading)
            y = self.start[1] + self.speed * time * math.sin(heading)
        else:
            radius = self.speed / self.yaw_rate
            x = self.start[0] + radius * (math.sin(heading) - math.sin(self.heading))
            y = self.start[1] - radius * (math.cos(heading) - math.cos(self.heading))
        along = np.stack([np.cos(self.angles + heading), np.sin(self.angles + heading)])
        ranges = np.full(BEAMS, np.inf)
        for first, second in self.walls:
            ranges = np.minimum(ranges, _to_wall(along, (first[0] - x, first[1] - y), (second[0] - x, second[1] - y)))
        for disc in self.discs:
            centre = (disc.centre[0] + disc.velocity[0] * time - x, disc.centre[1] + disc.velocity[1] * time - y)
            ranges = np.minimum(ranges, _to_disc(along, centre, disc.radius))
        return ranges


def scanner(**settings: Any) -> ttc_fast.ScanTTC:
    """Return the scanner of these worlds."""
    return ttc_fast.ScanTTC(ANGLE_MIN, INCREMENT, BEAMS, range_min=RANGE_MIN, range_max=RANGE_MAX, **settings)


def room(size: float) -> tuple[tuple[Point, Point], ...]:
    """Return four walls, `size` from the middle."""
    corners = [(size, -size), (size, size), (-size, size), (-size, -size)]
    return tuple(zip(corners, corners[1:] + corners[:1], strict=True))


def _to_wall(along: NDArray[np.float64], first: Point, second: Point) -> NDArray[np.float64]:
    dx, dy = second[0] - first[0], second[1] - first[1]
    with np.errstate(divide="ignore", invalid="ignore"):
        across = along[0] * dy - along[1] * dx
        distance = (first[0] * dy - first[1] * dx) / across
        share = (first[0] * along[1] - first[1] * along[0]) / across
    return np.where((distance > 0) & (share >= 0) & (share <= 1), distance, np.inf)


def _to_disc(along: NDArray[np.float64], centre: Point, radius: float) -> NDArray[np.float64]:
    ahead = along[0] * centre[0] + along[1] * centre[1]
    aside = along[0] * centre[1] - along[1] * centre[0]
    inside = radius * radius - aside * aside
    return np.where((ahead > 0) & (inside >= 0), ahead - np.sqrt(np.maximum(inside, 0)), np.inf)
