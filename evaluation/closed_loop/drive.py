"""One drive with the controller in the loop, and the same drive without it."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from evaluation.closed_loop.scenarios import Scenario, scenario
from evaluation.closed_loop.simulator import BODY, Brake, Pose, first_touch, seen_from, slowed, step, touch
from ttc_fast import BrakeController, Command, Motion

if TYPE_CHECKING:
    from collections.abc import Sequence

MARGIN = 0.05
"""The distance by which the outline of the controller exceeds the body on each side, m."""
OUTLINE = (BODY[0] - MARGIN, BODY[1] + MARGIN, BODY[2] - MARGIN, BODY[3] + MARGIN)

PHYSICS = 0.0125
"""The step of the simulation, s."""
FUTURE = np.arange(0.0, 3.0, 0.04)
"""The times of the true prediction, s."""
CLEAR = 1.25
"""The multiple of every threshold from which on a frame is clear to the default controller."""


@dataclass(frozen=True)
class Truth:
    """The outcome of a drive without a brake, in which no controller has a part."""

    hits: float
    """The time at which it hits something, s; infinite if it never does."""
    nearest: float
    """The least true TTC of the drive, as a multiple of the threshold of the default criteria."""
    possible: bool
    """Whether it hits something that a brake would have prevented, four scans and all delays after a beam met it."""
    with_perfect_sight: bool
    """Whether a brake would have prevented it that long after it came onto the path, between the beams or not."""


@dataclass(frozen=True)
class Drive:
    """The outcome of a drive with a controller."""

    run: int
    kind: str
    truth: Truth
    collided: bool
    """Whether it hit something while it moved."""
    braked_at: float
    """The time at which it began to brake, s; infinite if it never did."""
    blind_from: float
    """The time at which the scanner went blind, s; infinite if it never did."""
    reason: str
    """The reason why it braked."""
    margin: float
    """The distance that was left before the car when it stood, m; NaN if it never stood."""

    @property
    def crashed(self) -> bool:
        """Whether it hit something where braking was possible."""
        return self.collided and self.truth.possible

    @property
    def unavoidable(self) -> bool:
        """Whether it hit something that no brake would have prevented."""
        return self.collided and not self.truth.possible

    @property
    def needless(self) -> bool:
        """Whether it braked where the driver alone would not have hit anything, while the scanner saw."""
        return self.braked_at < self.blind_from and self.truth.hits == math.inf

    @property
    def false_stop(self) -> bool:
        """Whether it braked for nothing: no frame of the drive came within ``CLEAR`` of a threshold."""
        return self.needless and self.truth.nearest >= CLEAR

    @property
    def early(self) -> float:
        """The time from the brake to the collision, s; NaN where it did not brake or could not prevent it."""
        return self.truth.hits - self.braked_at if self.truth.possible and self.braked_at < math.inf else math.nan


def drive(seed: int, run: int, **settings: Any) -> Drive:
    """Drive scenario ``run`` of ``seed`` with a controller of these settings."""
    return drives(seed, run, [settings])[0]


def drives(seed: int, run: int, each: Sequence[dict[str, Any]]) -> list[Drive]:
    """Drive the same scenario, faults and noise with several settings."""
    made, _ = scenario(seed, run)
    truth = truth_of(made)
    return [Drive(run, made.kind, truth, *with_brake(made, scenario(seed, run)[1], settings)) for settings in each]


def truth_of(made: Scenario) -> Truth:
    """Drive without a brake, and with one that brakes fully as soon as it could."""
    hits, foreseen, seen, nearest = without_brake(made)
    reaction = made.scanner.latency + 4 * made.scanner.period + Brake().delay
    possible, with_perfect_sight = (
        hits < math.inf and not braked_from(made, each + reaction) for each in (seen, foreseen)
    )
    return Truth(hits, nearest, possible, with_perfect_sight)


def without_brake(made: Scenario) -> tuple[float, float, float, float]:
    """Drive as planned.

    Returns
    -------
    hits, foreseen, seen : float
        When it hits, since when what it hits is on its path, and when a beam first met that there, s. A scanner that
        does not look there, or has gone blind, need not meet anything: the controller knows that it sees nothing.
    nearest : float
        The least multiple of a threshold.
    """
    pose, time = Pose(0.0, 0.0, 0.0, made.plan.speed), 0.0
    foreseen, seen, nearest = math.inf, math.inf, math.inf
    while time < made.duration:
        segments = seen_from(made.world.at(time), pose.x, pose.y, pose.heading)
        if touch(segments, BODY):
            return time, foreseen, seen, nearest
        ahead = true_ttc(segments, pose.speed, made.plan.curvature, OUTLINE)
        if ahead == math.inf:
            foreseen = seen = math.inf
        else:
            foreseen = min(foreseen, time)
            if seen == math.inf:
                dark = made.unseen or time >= made.scanner.blind_from
                met = segments if dark else made.scanner.met(segments)
                if true_ttc(met, pose.speed, made.plan.curvature, OUTLINE) < math.inf:
                    seen = time
        nearest = min(nearest, ahead / max(1.5, stopping_time(pose.speed)))
        for _ in range(round(made.scanner.period / PHYSICS)):
            time += PHYSICS
            pose = step(pose, made.plan.curvature, made.plan.wanted(time), PHYSICS)
    return math.inf, math.inf, math.inf, nearest


def stopping_time(speed: float) -> float:
    """Return the TTC at which the default stopping distance is used up, s."""
    return 0.1 + abs(speed) / 12.0 + 0.2 / max(abs(speed), 1e-6)


def true_ttc(segments: Any, speed: float, curvature: float, outline: tuple[float, float, float, float]) -> float:
    """Return the time until the outline touches a segment that stands, by small steps; infinite beyond the last."""
    first = first_touch(segments, speed, curvature, FUTURE, outline)
    return float(FUTURE[first]) if first >= 0 else math.inf


def braked_from(made: Scenario, begin: float) -> bool:
    """Return whether it hits something although it brakes fully from ``begin`` on."""
    pose, time = Pose(0.0, 0.0, 0.0, made.plan.speed), 0.0
    while time < made.duration and pose.speed != 0.0:
        if touch(seen_from(made.world.at(time), pose.x, pose.y, pose.heading), BODY):
            return True
        for _ in range(round(made.scanner.period / PHYSICS)):
            time += PHYSICS
            speed = slowed(pose.speed, Brake().deceleration, PHYSICS) if time > begin else made.plan.wanted(time)
            pose = step(pose, made.plan.curvature, speed, PHYSICS)
    return False


def with_brake(
    made: Scenario, rng: np.random.Generator, settings: dict[str, Any]
) -> tuple[bool, float, float, str, float]:
    """Drive with the controller; return the last five fields of ``Drive``."""
    scanner, brake = made.scanner, Brake()
    blind_from = 0.0 if made.unseen else scanner.blind_from
    controller = BrakeController(**{"scan": scanner.reader(OUTLINE), "deceleration": brake.deceleration, **settings})
    pose, time, next_scan, restarts_at = Pose(0.0, 0.0, 0.0, made.plan.speed), 0.0, 0.0, made.restarts_at
    under_way: deque[tuple[float, float, Any, Motion]] = deque()
    bites, braked_at, reason = math.inf, math.inf, ""
    wish = Motion(made.plan.speed, made.plan.speed * made.plan.curvature) if made.says_so else None
    while time < made.duration:
        if time > next_scan - PHYSICS / 2.0:
            next_scan += scanner.period
            segments = seen_from(made.world.at(time), pose.x, pose.y, pose.heading)
            if touch(segments, BODY) and pose.speed != 0.0:
                return True, braked_at, blind_from, reason, math.nan
            motion = measured(pose, made.plan.curvature, time, rng)
            under_way.append((time + scanner.latency, time, scanner.scan(time, segments, rng), motion))
        if time >= restarts_at:
            restarts_at = math.inf
            controller.reset()
        while under_way and under_way[0][0] <= time:
            _, stamp, ranges, motion = under_way.popleft()
            decision = controller.update(time, ranges=ranges, stamp=stamp, motion=motion, commanded=wish)
            brakes = decision.command is Command.BRAKE
            if brakes and bites == math.inf:
                bites = time + brake.delay
                if braked_at == math.inf:
                    braked_at, reason = time, str(decision)
            elif made.goes_on and not brakes:
                bites = math.inf
        time += PHYSICS
        if time >= bites:
            speed = slowed(pose.speed, brake.deceleration, PHYSICS)
        else:
            speed = faster(pose.speed, made.plan.wanted(time), PHYSICS) if made.goes_on else made.plan.wanted(time)
        pose = step(pose, made.plan.curvature, speed, PHYSICS)
        if pose.speed == 0.0 and not made.goes_on:
            segments = seen_from(made.world.at(time), pose.x, pose.y, pose.heading)
            left = room(segments, math.copysign(1.0, made.plan.speed), made.plan.curvature)
            return False, braked_at, blind_from, reason, left
    return False, braked_at, blind_from, reason, math.nan


def faster(speed: float, wanted: float, dt: float, acceleration: float = 3.0) -> float:
    """Return a speed after going on for ``dt`` towards what the driver wants."""
    return speed + min(max(wanted - speed, -acceleration * dt), acceleration * dt)


def measured(pose: Pose, curvature: float, time: float, rng: np.random.Generator) -> Motion:
    """Return odometry with its noise."""
    speed = pose.speed * (1.0 + rng.normal(0.0, 0.01)) + rng.normal(0.0, 0.01)
    return Motion(speed, pose.speed * curvature + rng.normal(0.0, 0.005), stamp=time)


def room(segments: Any, direction: float, curvature: float) -> float:
    """Return the distance that it could have gone on, m, at most 3."""
    return min(true_ttc(segments, direction, curvature, BODY), 3.0)
