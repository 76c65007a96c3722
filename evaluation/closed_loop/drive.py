"""One drive with the controller in the loop, and the same drive without it."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from evaluation.closed_loop.scenarios import Scenario, scenario
from evaluation.closed_loop.simulator import BODY, Brake, Pose, seen_from, slowed, step, touch
from ttc_fast import BrakeController, Command, Motion

if TYPE_CHECKING:
    from collections.abc import Sequence

MARGIN = 0.05
"""What the outline of the controller is larger than the body, on each side, m."""
OUTLINE = (BODY[0] - MARGIN, BODY[1] + MARGIN, BODY[2] - MARGIN, BODY[3] + MARGIN)

PHYSICS = 0.0125
"""Step of the simulation, s."""
FUTURE = np.arange(0.0, 3.0, 0.04)
"""Steps of the true prediction, s."""
CLEAR = 1.25
"""At this multiple of every threshold, or more, a frame is clear to the controller as it comes."""


@dataclass(frozen=True)
class Truth:
    """What a drive comes to without a brake, which no controller has a part in."""

    hits: float
    """When it hits something, s; infinite if never."""
    nearest: float
    """The least that the true TTC ever was, as a multiple of the threshold of the default criteria."""
    possible: bool
    """Whether it hits something that a brake at the first chance, after all delays, would have prevented."""


@dataclass(frozen=True)
class Drive:
    """How a drive went."""

    run: int
    kind: str
    truth: Truth
    collided: bool
    """Whether it hit something while it moved."""
    braked_at: float
    """s; infinite if never."""
    blind_from: float
    """When the scanner went blind, s; infinite if never."""
    reason: str
    """Why it braked."""
    margin: float
    """What was left before the car when it stood, m; NaN if it never stood."""

    @property
    def crashed(self) -> bool:
        """A collision where braking was possible."""
        return self.collided and self.truth.possible

    @property
    def unavoidable(self) -> bool:
        """A collision that no brake would have prevented."""
        return self.collided and not self.truth.possible

    @property
    def needless(self) -> bool:
        """Braked where the driver alone would not have hit anything, with a scanner that saw."""
        return self.braked_at < self.blind_from and self.truth.hits == math.inf

    @property
    def false_stop(self) -> bool:
        """Braked for nothing: nothing was ever near where the criteria let it pass for clear."""
        return self.needless and self.truth.nearest >= CLEAR

    @property
    def early(self) -> float:
        """How long before the collision it braked, s; NaN where it did not, or where that was not possible."""
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
    hits, foreseen, nearest = without_brake(made)
    reaction = made.scanner.latency + 4 * made.scanner.period + Brake().delay
    return Truth(hits, nearest, hits < math.inf and not braked_from(made, foreseen + reaction))


def without_brake(made: Scenario) -> tuple[float, float, float]:
    """Drive as planned: when it hits, when that could first be foreseen, and how near it came to a threshold."""
    pose, time = Pose(0.0, 0.0, 0.0, made.plan.speed), 0.0
    foreseen, nearest = math.inf, math.inf
    while time < made.duration:
        segments = seen_from(made.world.at(time), pose.x, pose.y, pose.heading)
        if touch(segments, BODY):
            return time, foreseen, nearest
        ahead = true_ttc(segments, pose.speed, made.plan.curvature, OUTLINE)
        foreseen = min(foreseen, time) if ahead < math.inf else math.inf
        nearest = min(nearest, ahead / max(1.5, stopping_time(pose.speed)))
        for _ in range(round(made.scanner.period / PHYSICS)):
            time += PHYSICS
            pose = step(pose, made.plan.curvature, made.plan.wanted(time), PHYSICS)
    return math.inf, math.inf, nearest


def stopping_time(speed: float) -> float:
    """The TTC at which the default stopping distance is used up."""
    return 0.1 + abs(speed) / 12.0 + 0.2 / max(abs(speed), 1e-6)


def true_ttc(segments: Any, speed: float, curvature: float, outline: tuple[float, float, float, float]) -> float:
    """When the outline touches what stands where it is now, by small steps; infinite beyond the last."""
    way = speed * FUTURE
    turn = curvature * way
    chord = way * np.sinc(turn / (2.0 * np.pi))
    touched = touch(seen_from(segments, chord * np.cos(turn / 2.0), chord * np.sin(turn / 2.0), turn), outline)
    return float(FUTURE[np.argmax(touched)]) if touched.any() else math.inf


def braked_from(made: Scenario, begin: float) -> bool:
    """Whether it hits something all the same when it brakes fully from ``begin`` on."""
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
    """Drive with the controller: whether it hit something, when it braked, was blind, why it braked, what was left."""
    scanner, brake = made.scanner, Brake()
    blind_from = scanner.blind_from
    controller = BrakeController(**{"scan": scanner.reader(OUTLINE), "deceleration": brake.deceleration, **settings})
    pose, time, next_scan = Pose(0.0, 0.0, 0.0, made.plan.speed), 0.0, 0.0
    under_way: deque[tuple[float, float, Any, Motion]] = deque()
    bites, braked_at, reason = math.inf, math.inf, ""
    while time < made.duration:
        if time > next_scan - PHYSICS / 2.0:
            next_scan += scanner.period
            segments = seen_from(made.world.at(time), pose.x, pose.y, pose.heading)
            if touch(segments, BODY):
                return True, braked_at, blind_from, reason, math.nan
            motion = measured(pose, made.plan.curvature, time, rng)
            under_way.append((time + scanner.latency, time, scanner.scan(time, segments, rng), motion))
        while under_way and under_way[0][0] <= time:
            _, stamp, ranges, motion = under_way.popleft()
            decision = controller.update(time, ranges=ranges, stamp=stamp, motion=motion)
            if decision.command is Command.BRAKE and braked_at == math.inf:
                braked_at, bites, reason = time, time + brake.delay, str(decision)
        time += PHYSICS
        speed = slowed(pose.speed, brake.deceleration, PHYSICS) if time >= bites else made.plan.wanted(time)
        pose = step(pose, made.plan.curvature, speed, PHYSICS)
        if pose.speed == 0.0:
            segments = seen_from(made.world.at(time), pose.x, pose.y, pose.heading)
            left = room(segments, math.copysign(1.0, made.plan.speed), made.plan.curvature)
            return False, braked_at, blind_from, reason, left
    return False, braked_at, blind_from, reason, math.nan


def measured(pose: Pose, curvature: float, time: float, rng: np.random.Generator) -> Motion:
    """Odometry, with its noise."""
    speed = pose.speed * (1.0 + rng.normal(0.0, 0.01)) + rng.normal(0.0, 0.01)
    return Motion(speed, pose.speed * curvature + rng.normal(0.0, 0.005), stamp=time)


def room(segments: Any, direction: float, curvature: float) -> float:
    """How far it could have gone on, m; 3 when farther."""
    return min(true_ttc(segments, direction, curvature, BODY), 3.0)
