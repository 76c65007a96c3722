"""What the round trips over every transport share: the walls, the loop over scans, and the tables."""

from __future__ import annotations

import math
import os
import time
from typing import TYPE_CHECKING, Protocol

import numpy as np

from evaluation.report import Report, console

if TYPE_CHECKING:
    import argparse
    from collections.abc import Mapping, Sequence

NEAR, FAR = 2.0, 20.0
"""m: a wall for which the node brakes at ``SPEED``, and one for which it does not."""
SPEED = 4.0
"""m/s"""
PATIENCE = 5.0
"""s: how long an answer may take."""
WARMING_UP = 500
"""Scans before those that count."""
Times = dict[str, "Sequence[float]"]
"""Times, us, by what they are of."""


class Sensor(Protocol):
    """The rest of the car: it publishes scans and a speed, and hears the answers."""

    def drive(self) -> None:
        """Publish the speed, where the node forgets it."""

    def ask(self, distance: float, patience: float = PATIENCE) -> float:
        """Publish a scan and wait for its answer; return how long that took, s, or NaN if none came.

        Raises
        ------
        AssertionError
            If the answer is wrong.
        """


def round_trips(sensor: Sensor, arguments: argparse.Namespace) -> list[float]:
    """Return how long each answer took, us."""
    took = []
    for i in range(WARMING_UP + arguments.scans):
        sensor.drive()
        time.sleep(1.0 / arguments.rate if arguments.rate else 0.0)
        took.append(sensor.ask(NEAR if i % 2 else FAR) * 1e6)
        assert not math.isnan(took[-1]), f"no answer to scan {i}"
    return took[WARMING_UP:]


def soak(sensor: Sensor, pid: int, scans: int) -> None:
    """Send scans as fast as they are answered, and print losses and the memory of the node."""
    unanswered, memory = 0, []
    for i in range(scans):
        if i % max(scans // 10, 1) == 0:
            sensor.drive()
            memory.append(resident(pid))
            print(f"{i:8d} scans, {unanswered} unanswered, {memory[-1]:.1f} MB", flush=True)
        unanswered += math.isnan(sensor.ask(NEAR if i % 2 else FAR, patience=1.0))
    grown = resident(pid) - memory[min(1, len(memory) - 1)]
    print(f"{scans:8d} scans, {unanswered} unanswered, {grown:+.2f} MB since the first tenth")


def resident(pid: int) -> float:
    """Return the memory of a process, MB."""
    with open(f"/proc/{pid}/statm", encoding="ascii") as statm:
        return int(statm.read().split()[1]) * os.sysconf("SC_PAGESIZE") / 1e6


def show(transport: str, legend: str, rows: Mapping[str, Times], arguments: argparse.Namespace) -> None:
    """Print the least, p50 and p99 of the times of each row; a row may lack some of the columns."""
    columns = list(dict.fromkeys(column for times in rows.values() for column in times))
    header = ["", *(f"{column} {name}" for column in columns for name in ("least", "p50", "p99"))]
    cells = []
    for name, times in rows.items():
        cells.append([name])
        for column in columns:
            found = np.quantile(times[column], [0.0, 0.5, 0.99]) if column in times else ()
            cells[-1] += [f"{each:.0f}" for each in found] or [""] * 3
    about = (
        f"us, {arguments.scans} scans of {arguments.beams} beams, {arguments.rate:g} a second. The round trip is from "
        f"before a scan is published to the answer read, over loopback between two processes. {legend}"
    )
    console().print(Report(f"Round trips over {transport}", about, header, cells).rich())
