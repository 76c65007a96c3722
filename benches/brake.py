"""``BrakeController.update``: what a decision takes beside the kernels that it asks, on the same scans and clouds."""

from __future__ import annotations

import itertools
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

import ttc_fast
from benches import car
from benches.case import OURS, Case, Goal, Implementation
from benches.inputs import turns
from ttc_fast import BrakeController, Command, Motion, StoppingDistance, reference

if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import ModuleType

BEAMS = 1080
PERIOD, LATENCY = 0.025, 0.01
KERNELS = "its kernels"
LIMIT = 3.0
"""How much longer than its kernels an update may take, us."""
WHY = (
    "An update is Python. One that decides nothing, and only copies the readings, reads the kernels' answers and makes "
    "the six named tuples of a decision, takes 2.4 us already; docs/braking.md has more."
)


class Situation(NamedTuple):
    """What is commanded; how fast the car drives through the rooms for it, m/s; which sensors take turns."""

    command: Command
    speed: float
    sensors: tuple[str, ...] = ("ranges",)

    def expression(self, template: str) -> str:
        """Return the expression that asks about the readings of each sensor."""
        return " ".join(f"{template.format(name, index)}," for index, name in enumerate(self.sensors))


SITUATIONS = {
    "nothing near": Situation(Command.NONE, 0.2),
    "near": Situation(Command.WARN, 1.2),
    "braking": Situation(Command.BRAKE, 5.0),
    "scan, then cloud": Situation(Command.NONE, 0.2, ("ranges", "points")),
}
UPDATE = "controller.update(next(clock), {}=frame[{}], stamp=next(stamps), motion=motion)"
ASK = "{}.nearest(frame[{}], speed, yaw_rate, 0.0), ranges.unseen(speed, yaw_rate, 0.0, ahead=ahead)"


def _decide(situation: Situation) -> Implementation:
    """Make a fresh controller with a clock of its own."""
    kernels: dict[str, Any] = {"scan": ttc_fast.ScanTTC(*car.place(BEAMS), **car.SETTINGS)}
    if "points" in situation.sensors:
        kernels["path"] = ttc_fast.SweptPath(car.OUTLINE)
    clocks = {"stamps": itertools.count(0.0, PERIOD), "clock": itertools.count(LATENCY, PERIOD)}
    names = {"controller": BrakeController(**kernels), "motion": Motion(situation.speed, car.YAW_RATE), **clocks}
    return Implementation(situation.expression(UPDATE), names, "frame")


def _ask(situation: Situation, module: ModuleType = ttc_fast) -> Implementation:
    """Make the kernels alone."""
    rule, speed = StoppingDistance(), situation.speed
    ahead = rule.reaction_time + speed / (2.0 * rule.deceleration)
    names: dict[str, Any] = {"speed": speed, "yaw_rate": car.YAW_RATE, "ahead": ahead}
    names["ranges"] = module.ScanSweptPath(module.ScanTTC(*car.place(BEAMS), **car.SETTINGS))
    names["points"] = module.SweptPath(car.OUTLINE)

    def is_right(frame: Any, answer: Any) -> bool:
        right = _ask(situation, reference).answer(frame)
        ttcs = [[nearest.ttc for nearest in each[::2]] for each in (answer, right)]
        return ttcs[0] == ttcs[1] and answer[1::2] == right[1::2]

    return Implementation(situation.expression(ASK), names, "frame", verify=is_right)


@lru_cache
def _frames(situation: Situation) -> list[Any]:
    """Return the rooms in which a command is given when they come again and again: a scan, and a cloud if there is one.

    The cloud has a point for each reading of the scan that is no error code.
    """
    cos, sin = car.directions(BEAMS)
    rooms = car.rooms(turns(4 * BEAMS), BEAMS, "float32")
    frames = []
    for ranges in rooms:
        distance = np.where(ranges > car.RANGE_MIN, ranges, np.nan)
        points = np.column_stack([distance * cos + car.MOUNT[0], distance * sin]).astype(np.float32)
        frames.append((ranges, points)[: len(situation.sensors)])

    def commanded_in(frame: Any) -> Command:
        controller = _decide(situation)
        answers = [controller.answer(frame) for _ in range(4)]
        command: Command = answers[-1][-1].command
        return command

    return [frame for frame in frames if commanded_in(frame) is situation.command]


def _case(name: str, situation: Situation) -> Case:
    def compare(implementation: Implementation, inputs: Sequence[Any]) -> None:
        """Hold command and TTC to those of the situation, once the controller has voted."""
        kernels = _ask(situation, reference)
        decisions = [implementation.answer(frame) for frame in (*inputs, *inputs)]
        for frame, decided in zip(inputs, decisions[len(inputs) :], strict=True):
            for decision, nearest in zip(decided, kernels.answer(frame)[::2], strict=True):
                assert decision.command is situation.command
                assert np.isclose(decision.threats.path.ttc, max(nearest.ttc - LATENCY, 0.0), atol=1e-9)

    return Case(
        "BrakeController.update",
        f"{BEAMS} float32 {name}",
        partial(_frames, situation),
        {OURS: partial(_decide, situation), KERNELS: partial(_ask, situation)},
        compare,
        [Goal(LIMIT * len(situation.sensors), KERNELS, more=True, why=WHY)],
    )


CASES = [_case(name, situation) for name, situation in SITUATIONS.items()]
