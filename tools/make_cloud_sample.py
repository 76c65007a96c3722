"""Make the point clouds that the package ships: a car follows another one, which brakes.

A ray-caster simulates a lidar of 27 rings on the roof of a car in a street of boxes. Nothing in it is from another
recording, so it can be shipped with the package. The random numbers are seeded, so the file is the same every time.

    python tools/make_cloud_sample.py [FILE]
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

SAMPLE = Path(__file__).parent.parent / "python" / "ttc_fast" / "samples" / "following.npz"

RINGS = np.radians(np.linspace(-22.0, 4.0, 27))  # rad, up from the horizon
AZIMUTHS = np.radians(np.linspace(-32.0, 32.0, 161))  # rad, left of straight ahead
RATE = 10.0  # turns per second
FRAMES = 12
REACH = 60.0  # m

SENSOR_HEIGHT = 1.73  # m above the road
FRONT_OFFSET = 2.0  # m from the sensor to the bumper
SPEED = 13.0  # m/s, of the car that follows
GAP = 16.0  # m from the sensor to the car ahead, at the start
CLOSING_SPEED, BRAKING = 4.0, 5.0  # m/s and m/s^2, of the car ahead

RANGE_NOISE = 0.015  # m, standard deviation
INTENSITY_NOISE = 0.03
LOST = 0.03  # share of returns that come back as (0, 0, 0)
STRAYS = {2: 1.6, 3: 0.7, 7: 2.4, 11: 0.9}  # spray: number of the frame, and how much nearer than the car ahead, m
STEP = 1 / 512  # m; coordinates are whole steps, exact in float32 and small when compressed


class Box(NamedTuple):
    """A box that returns light: x, y and height above the road as (low, high), m, and its brightness from 0 to 1."""

    x: tuple[float, float]
    y: tuple[float, float]
    height: tuple[float, float]
    intensity: float


ROAD = Box((-100.0, 300.0), (-60.0, 60.0), (-1.0, 0.0), 0.12)
BONNET = Box((0.7, FRONT_OFFSET - 0.1), (-0.8, 0.8), (0.5, 0.98), 0.25)
STREET = (
    Box((-20.0, 120.0), (6.5, 9.0), (0.0, 0.9), 0.3),  # a wall on the left
    Box((17.0, 21.3), (-4.9, -3.1), (0.2, 1.45), 0.4),  # parked on the right
    Box((24.5, 28.6), (-5.0, -3.2), (0.2, 1.5), 0.2),
    Box((31.0, 31.3), (-6.3, -6.0), (0.0, 6.0), 0.35),  # posts
    Box((43.0, 43.3), (-6.3, -6.0), (0.0, 6.0), 0.35),
    Box((44.0, 44.4), (-6.0, 6.5), (4.6, 5.6), 0.8),  # a sign above the road
)


def car_ahead(x: float) -> tuple[Box, ...]:
    """Return body, number plate and cabin of the car ahead, whose bumper is at x."""
    return (
        Box((x + 0.03, x + 4.3), (-0.80, 0.96), (0.22, 0.95), 0.35),
        Box((x, x + 0.05), (-0.18, 0.34), (0.55, 0.67), 0.95),
        Box((x + 0.55, x + 3.2), (-0.65, 0.81), (0.95, 1.45), 0.1),
    )


def cast(directions: np.ndarray, boxes: list[Box]) -> tuple[np.ndarray, np.ndarray]:
    """Return the distance to the first box along each direction (inf where none), m, and its brightness."""
    origin = np.array([0.0, 0.0, SENSOR_HEIGHT])
    nearest, intensity = np.full(len(directions), np.inf), np.zeros(len(directions))
    for box in boxes:
        low, high = np.array(box[:3]).T
        with np.errstate(divide="ignore"):
            sides = np.sort([(low - origin) / directions, (high - origin) / directions], axis=0)
        enter, leave = sides[0].max(axis=1), sides[1].min(axis=1)
        hit = (enter > 0.0) & (enter <= leave) & (enter < nearest)
        nearest[hit], intensity[hit] = enter[hit], box.intensity
    return nearest, intensity


def turn(frame: int, rng: np.random.Generator) -> np.ndarray:
    """Return the points of one turn of the lidar with all its flaws: x, y, z, intensity, ring by ring."""
    t = frame / RATE
    x = GAP - CLOSING_SPEED * t - BRAKING * t**2 / 2
    street = [box._replace(x=(box.x[0] - SPEED * t, box.x[1] - SPEED * t)) for box in STREET]
    elevation, azimuth = (angles.ravel() for angles in np.meshgrid(RINGS, AZIMUTHS, indexing="ij"))
    flat = np.cos(elevation)
    directions = np.column_stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)])
    distance, intensity = cast(directions, [ROAD, BONNET, *street, *car_ahead(x)])
    returned = distance < REACH
    directions, distance, intensity = directions[returned], distance[returned], intensity[returned]
    distance = distance + RANGE_NOISE * rng.standard_normal(distance.shape)
    intensity = np.clip(intensity + INTENSITY_NOISE * rng.standard_normal(distance.shape), 0.0, 1.0)
    points = np.column_stack([distance[:, None] * directions, intensity])
    points[rng.random(len(points)) < LOST] = 0.0
    if frame in STRAYS:
        points[len(points) // 2, :3] = x - STRAYS[frame], rng.uniform(-0.6, 0.6), rng.uniform(-1.3, -0.8)
    return points


def make_sample() -> dict[str, Any]:
    """Return the arrays of the file, by name."""
    rng = np.random.default_rng(20)
    clouds = [turn(frame, rng) for frame in range(FRAMES)]
    points = np.concatenate(clouds)
    points[:, :3] = np.round(points[:, :3] / STEP) * STEP
    points[:, 3] = np.round(points[:, 3] * 64) / 64
    return {
        "t": np.arange(FRAMES) / RATE,
        "points": points.astype(np.float32),
        "counts": np.array([len(cloud) for cloud in clouds]),
        "sensor_height": SENSOR_HEIGHT,
        "front_offset": FRONT_OFFSET,
    }


if __name__ == "__main__":
    from small_archive import save

    save(Path(sys.argv[1]) if len(sys.argv) > 1 else SAMPLE, make_sample())
