"""``python -m benches.decision``: what a decision takes beside the kernel that it asks."""

from __future__ import annotations

import argparse
from time import perf_counter_ns
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Console
from rich.table import Table

from benches.scans import car
from benches.timing import no_collection
from ttc_fast import BrakeController, Command, Motion, ScanSweptPath, ScanTTC

if TYPE_CHECKING:
    from collections.abc import Callable

BEAMS, FRAMES = 1080, 64
PERIOD = 0.025
SITUATIONS = {"nothing near": (Command.NONE, 0.2), "near": (Command.WARN, 1.2), "braking": (Command.BRAKE, 5.0)}
"""What is commanded, and how fast to drive through the rooms for it, m/s."""


def main() -> None:
    """Time whole updates and bare kernel calls in turns, and print both."""
    parser = argparse.ArgumentParser(prog="python -m benches.decision", description=__doc__)
    parser.add_argument("--rounds", type=int, default=300, help="turns of each (default %(default)s)")
    rounds = parser.parse_args().rounds
    table = Table("situation", "decision", "kernel alone", "difference", "in the best turn")
    for name, (command, speed) in SITUATIONS.items():
        decide, ask = contestants(command, speed)
        with no_collection():
            turns = np.array([(decide(), ask()) for _ in range(rounds)]) / 1e3
        whole, kernel = np.median(turns, axis=0)
        difference = turns[:, 0] - turns[:, 1]
        best = turns[:, 0].min() - turns[:, 1].min()
        table.add_row(name, *(f"{each:.1f} us" for each in (whole, kernel, np.median(difference), best)))
    Console().print(table)


def contestants(command: Command, speed: float) -> tuple[Callable[[], float], Callable[[], float]]:
    """A turn of whole updates and one of the kernel over the same scans; each gives the time of a call, ns."""
    scan = ScanTTC(*car.place(BEAMS), **car.SETTINGS)
    path = ScanSweptPath(scan)
    rooms: list[Any] = list(car.rooms(FRAMES, BEAMS, "float32"))
    chosen = [room for room in rooms if _commanded(scan, room, speed) is command]
    assert chosen, f"no room leads to {command.name}"
    rooms = chosen
    controller, now = BrakeController(scan=scan), 0.0

    def decide() -> float:
        nonlocal now
        motion = Motion(speed, car.YAW_RATE)
        began = perf_counter_ns()
        for ranges in rooms:
            now += PERIOD
            decision = controller.update(now + 0.01, ranges=ranges, stamp=now, motion=motion)
        took = (perf_counter_ns() - began) / len(rooms)
        assert decision.command is command
        return took

    def ask() -> float:
        began = perf_counter_ns()
        for ranges in rooms:
            path.nearest(ranges, speed, car.YAW_RATE, 0.0)
        return (perf_counter_ns() - began) / len(rooms)

    decide()  # until it has made up its mind
    return decide, ask


def _commanded(scan: ScanTTC, room: Any, speed: float) -> Command:
    """What is commanded when the same is seen again and again."""
    controller = BrakeController(scan=scan)
    for frame in range(4):
        now = frame * PERIOD
        decision = controller.update(now, ranges=room, stamp=now, motion=Motion(speed, car.YAW_RATE))
    return decision.command


if __name__ == "__main__":
    main()
