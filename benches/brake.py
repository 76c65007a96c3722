"""``BrakeController.update``: what a decision takes beside the kernel that it asks, on the same scans."""

from __future__ import annotations

import itertools
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any

import ttc_fast
from benches import car
from benches.case import OURS, Case, Implementation
from benches.inputs import turns
from ttc_fast import BrakeController, Command, Motion, reference

if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import ModuleType

BEAMS = 1080
PERIOD, LATENCY = 0.025, 0.01
SITUATIONS = {"nothing near": (Command.NONE, 0.2), "near": (Command.WARN, 1.2), "braking": (Command.BRAKE, 5.0)}
"""What is commanded, and how fast the car drives through the rooms for it, m/s."""
UPDATE = "controller.update(next(clock), ranges=ranges, stamp=next(stamps), motion=motion)"


def _decide(speed: float) -> Implementation:
    """Make a fresh controller with a clock of its own."""
    controller = BrakeController(scan=ttc_fast.ScanTTC(*car.place(BEAMS), **car.SETTINGS))
    clocks = {"stamps": itertools.count(0.0, PERIOD), "clock": itertools.count(LATENCY, PERIOD)}
    return Implementation(UPDATE, {"controller": controller, "motion": Motion(speed, car.YAW_RATE), **clocks})


def _ask(speed: float, module: ModuleType = ttc_fast) -> Implementation:
    """Make the kernel alone."""
    path = module.ScanSweptPath(module.ScanTTC(*car.place(BEAMS), **car.SETTINGS))
    names = {"path": path, "speed": speed, "yaw_rate": car.YAW_RATE}
    verify = None if module is reference else lambda ranges, ttc: bool(ttc == _ask(speed, reference).answer(ranges))
    return Implementation("path.nearest(ranges, speed, yaw_rate, 0.0).ttc", names, verify=verify)


@lru_cache
def _rooms(situation: str) -> list[Any]:
    """Return the rooms in which a command is given when the same scan comes again and again."""
    command, speed = SITUATIONS[situation]

    def commanded_in(room: Any) -> Command:
        controller = _decide(speed)
        answers = [controller.answer(room) for _ in range(4)]
        command: Command = answers[-1].command
        return command

    return [room for room in car.rooms(turns(4 * BEAMS), BEAMS, "float32") if commanded_in(room) is command]


def _case(situation: str) -> Case:
    command, speed = SITUATIONS[situation]

    def compare(implementation: Implementation, inputs: Sequence[Any]) -> None:
        """Hold the command to that of the situation, once the controller has voted."""
        decisions = [implementation.answer(ranges) for ranges in (*inputs, *inputs)]
        assert all(decision.command is command for decision in decisions[len(inputs) :])

    implementations = {OURS: partial(_decide, speed), "kernel alone": partial(_ask, speed)}
    return Case(
        "BrakeController.update", f"{BEAMS} float32 {situation}", partial(_rooms, situation), implementations, compare
    )


CASES = [_case(situation) for situation in SITUATIONS]
