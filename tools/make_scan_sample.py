"""Make the simulated approach that the package ships: a small car that brakes late for a parked box.

A 2D ray-caster simulates an F1TENTH-like car in a corridor with doorways and a pillar. Nothing in it is from another
recording, so it can be shipped with the package. The random numbers are seeded, so the file is the same every time.

    python tools/make_scan_sample.py [FILE]
"""

from __future__ import annotations

import itertools
import sys
from pathlib import Path
from typing import Any

import numpy as np

Chains = list[list[tuple[float, float]]]

SAMPLE = Path(__file__).parent.parent / "python" / "ttc_fast" / "samples" / "approach.npz"

OUTLINE = (-0.10, 0.40, -0.15, 0.15)  # x_rear, x_front, y_right, y_left of the car, m
MOUNT = (0.27, 0.0, 0.0)  # x, y (m) and yaw (rad) of the scanner on it
BEAMS = 541
ANGLE_MIN = np.radians(-135.0)
ANGLE_INCREMENT = np.radians(0.5)
RANGE_MIN, RANGE_MAX = 0.06, 10.0
RATE = 30.0  # scans per second

START_SPEED, CRUISE_SPEED = 1.0, 4.0  # m/s
ACCELERATION, BRAKING = 3.0, 5.0  # m/s^2
BRAKE_AT = 1.90  # m from bumper to box: late, stopping from 4 m/s takes 1.6 m
BOX_FRONT = 11.5  # m along the corridor
STANDSTILL = 0.8  # s at the end

RANGE_NOISE = 0.006  # m, standard deviation
SPEED_NOISE = 0.01  # m/s
LOST = 0.006  # share of readings that come back as NaN
ERROR_CODES = 0.008  # share of readings that are error codes, below RANGE_MIN
SPECKLES = 8  # isolated readings of something that is not there


def world() -> np.ndarray:
    """Return the walls as segments (x0, y0, x1, y1), m, shape (N, 4)."""
    left = [
        (-4, 2.3),
        (3, 2.3),
        (3, 3.4),
        (4.2, 3.4),
        (4.2, 2.3),
        (9.5, 2.3),
        (9.5, 2.9),
        (13, 2.9),
        (13, 2.3),
        (18, 2.3),
    ]
    right = [
        (-4, -2.2),
        (6, -2.2),
        (6, -1.8),
        (6.4, -1.8),
        (6.4, -2.2),
        (8, -2.2),
        (8, -3.6),
        (9, -3.6),
        (9, -2.2),
        (18, -2.2),
    ]
    ends: Chains = [[(-4, 2.3), (-4, -2.2)], [(18, 2.3), (18, -2.2)]]
    box = [(BOX_FRONT, -0.40), (BOX_FRONT, 0.22), (BOX_FRONT + 0.8, 0.28), (BOX_FRONT + 0.8, -0.34), (BOX_FRONT, -0.40)]
    chains: Chains = [left, right, *ends, box]
    return np.array([(*a, *b) for chain in chains for a, b in itertools.pairwise(chain)], dtype=np.float64)


def drive() -> dict[str, np.ndarray]:
    """Return stamp, pose, speed and yaw rate of the car at each scan."""
    step = 1e-3
    t, x, speed, stood = 0.0, 0.0, START_SPEED, 0.0
    states = []
    while stood < STANDSTILL:
        yaw = 0.07 * np.sin(1.6 * t) * np.exp(-0.35 * t)  # it corrects its course, less and less
        states.append((t, x, yaw, speed))
        braking = BOX_FRONT - (x + OUTLINE[1]) < BRAKE_AT
        speed = max(speed - BRAKING * step, 0.0) if braking else min(speed + ACCELERATION * step, CRUISE_SPEED)
        x += speed * np.cos(yaw) * step
        stood += step if speed == 0.0 else 0.0
        t += step
    t, x, yaw, speed = np.array(states).T
    y = np.cumsum(speed * np.sin(yaw)) * step
    yaw_rate = np.where(speed > 0.0, np.gradient(yaw, step), 0.0)
    scans = np.searchsorted(t, np.arange(0.0, t[-1], 1.0 / RATE))
    return {"t": t[scans], "x": x[scans], "y": y[scans], "yaw": yaw[scans], "v": speed[scans], "w": yaw_rate[scans]}


def cast(origin: np.ndarray, directions: np.ndarray, walls: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the distance to the first wall along each direction (inf where none), and the cosine of incidence."""
    start, along = walls[:, :2] - origin, walls[:, 2:] - walls[:, :2]
    across = directions[:, None, 0] * along[:, 1] - directions[:, None, 1] * along[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0]) / across
        where = (start[:, 0] * directions[:, None, 1] - start[:, 1] * directions[:, None, 0]) / across
        incidence = np.abs(across) / np.hypot(along[:, 0], along[:, 1])
    distance = np.where((distance > 0.0) & (where >= 0.0) & (where <= 1.0), distance, np.inf)
    first = np.argmin(distance, axis=1)
    beams = np.arange(len(directions))
    return distance[beams, first], incidence[beams, first]


def measure(distance: np.ndarray, incidence: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the readings of the scanner for true distances, with all its flaws."""
    ranges = distance + RANGE_NOISE * rng.standard_normal(distance.shape)
    grazing = rng.random(distance.shape) > incidence / 0.12  # too flat to reflect
    ranges[grazing | (ranges > RANGE_MAX)] = np.inf
    ranges[rng.random(distance.shape) < LOST] = np.nan
    broken = rng.random(distance.shape) < ERROR_CODES
    ranges[broken] = rng.integers(0, 16, np.count_nonzero(broken)) * 1e-3
    frames = np.linspace(0, len(ranges) - 1, SPECKLES + 2).astype(int)[1:-1]
    ranges[frames, BEAMS // 2 + rng.integers(-60, 61, SPECKLES)] = rng.uniform(0.5, 1.5, SPECKLES)
    return np.round(ranges, 3).astype(np.float32)


def make_sample() -> dict[str, Any]:
    """Return the arrays of the file, by name."""
    rng = np.random.default_rng(20)
    run, walls = drive(), world()
    angles = ANGLE_MIN + ANGLE_INCREMENT * np.arange(BEAMS)
    distance, incidence = np.empty((2, len(run["t"]), BEAMS))
    for i, (x, y, yaw) in enumerate(zip(run["x"], run["y"], run["yaw"], strict=True)):
        origin = np.array([x + MOUNT[0] * np.cos(yaw), y + MOUNT[0] * np.sin(yaw)])
        directions = np.column_stack([np.cos(angles + yaw), np.sin(angles + yaw)])
        distance[i], incidence[i] = cast(origin, directions, walls)
    moving = run["v"] > 0.0
    speed = run["v"] + SPEED_NOISE * moving * rng.standard_normal(len(moving))
    return {
        "t": np.round(run["t"], 6),
        "ranges": measure(distance, incidence, rng),
        "v": np.round(speed, 3).astype(np.float32),
        "w": np.round(run["w"], 4).astype(np.float32),
        "angle_min": ANGLE_MIN,
        "angle_increment": ANGLE_INCREMENT,
        "range_min": RANGE_MIN,
        "range_max": RANGE_MAX,
        "mount": np.array(MOUNT),
        "outline": np.array(OUTLINE),
    }


if __name__ == "__main__":
    from small_archive import save

    save(Path(sys.argv[1]) if len(sys.argv) > 1 else SAMPLE, make_sample())
