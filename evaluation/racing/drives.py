"""Drives with the brake in the loop: laps of a line, and steering at random."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from evaluation.racing.car import PERIOD, STEP, Car, Pose, PurePursuit, RandomSteering, SingleTrack
from evaluation.racing.course import Course, course
from ttc_fast import BrakeController, Command

if TYPE_CHECKING:
    from collections.abc import Callable

LATENCY = 0.0125
"""The time from measuring a scan to deciding, s."""
DELAY = 0.05
"""The time from the command to the bite of the brake, s."""
SEED = 11
"""The seed of the drives at random that the settings were chosen with."""
FASTEST_AT_RANDOM = 6.0
"""The greatest speed of a drive with steering at random, m/s."""
PATIENCE = 3.0
"""A car that stands for so long does not finish, s."""


@dataclass(frozen=True)
class Outcome:
    """What a drive came to."""

    course: str
    speed: float
    """The top speed, m/s."""
    laps: float
    """How many laps it drove, or parts of one."""
    hits: int
    """How often it hit a wall: 0 or 1, as a hit ends a drive."""
    hit_speed: float
    """Its speed then, m/s; 0 without a hit."""
    onsets: int
    """How often it began to brake."""
    braked: float
    """The share of frames in which it braked."""
    place: float
    """Where along the line it began to brake first, m; NaN if never."""


def lap_drive(
    name: str, speed: float, laps: float, settings: Callable[[Any], BrakeController], planned: bool, **made: Any
) -> Outcome:
    """Drive laps of a course's line at up to a speed, with a controller that knows the plan or does not."""
    where, rng = course(name), np.random.default_rng([7, int(10 * speed)])
    line = where.line
    begin = Pose(float(line.x[0]), float(line.y[0]), line.heading(0))
    car = made.get("car", SingleTrack)(where, begin, min(speed, float(line.speed[0])), rng)
    pursuit = PurePursuit(line, speed)
    return drive(where, car, pursuit, speed, settings, planned, laps, 3.0 * laps * line.length / speed + 10.0)


def random_drive(
    name: str, run: int, settings: Callable[[Any], BrakeController], seed: int = SEED, **made: Any
) -> Outcome:
    """Drive with steering at random from somewhere on a course's line, for at most 20 s."""
    where, rng = course(name), np.random.default_rng([seed, run])
    line = where.line
    speed, at = rng.uniform(1.5, FASTEST_AT_RANDOM), int(rng.integers(len(line.x)))
    begin = Pose(float(line.x[at]), float(line.y[at]), line.heading(at) + rng.normal(0.0, 0.1))
    car = made.get("car", SingleTrack)(where, begin, 0.0, rng)
    return drive(where, car, RandomSteering(speed, rng), speed, settings, False, np.inf, 20.0)


def drive(
    where: Course,
    car: Car,
    driver: PurePursuit | RandomSteering,
    speed: float,
    settings: Callable[[Any], BrakeController],
    planned: bool,
    laps: float,
    duration: float,
) -> Outcome:
    """Drive until the laps are done, a wall is hit, the time is over, or it stands for too long."""
    controller = settings(car.scanner())
    line, time, next_scan, stands = where.line, 0.0, 0.0, 0.0
    near, done = line.nearest(*car.pose[:2]), 0.0
    under_way: deque[tuple[float, dict[str, Any]]] = deque()
    commands: deque[tuple[float, bool]] = deque()
    frames = braked = onsets = 0
    was, brakes, place = False, False, np.nan
    while time < duration and done < laps and stands < PATIENCE:
        steering, wanted = driver.command(car, time)
        if time > next_scan - STEP / 2.0:
            next_scan += PERIOD
            frame: dict[str, Any] = {"ranges": car.scan(), "stamp": time, "motion": car.motion()._replace(stamp=time)}
            if planned and isinstance(driver, PurePursuit):
                frame["path"] = driver.plan(car)
            under_way.append((time + LATENCY, frame))
        while under_way and under_way[0][0] <= time + 1e-9:
            decision = controller.update(time, **under_way.popleft()[1])
            now = decision.command is Command.BRAKE
            if now and not was:
                onsets += 1
                place = near * line.spacing if np.isnan(place) else place
            was, frames, braked = now, frames + 1, braked + now
            commands.append((time + DELAY, now))
        while commands and commands[0][0] <= time + 1e-9:
            brakes = commands.popleft()[1]
        car.drive(steering, 0.0 if brakes else wanted)
        time += STEP
        stands = stands + STEP if abs(car.speed) < 0.05 else 0.0
        at = line.nearest(*car.pose[:2], near)
        done += ((at - near + len(line.x) // 2) % len(line.x) - len(line.x) // 2) / len(line.x)
        near = at
        if car.touches():
            return Outcome(where.name, speed, done, 1, abs(car.speed), onsets, braked / max(frames, 1), place)
    return Outcome(where.name, speed, done, 0, 0.0, onsets, braked / max(frames, 1), place)
