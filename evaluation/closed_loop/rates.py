"""``python -m evaluation.closed_loop.rates``: the same drives at several rates, with votes of frames and in time.

What is shown: how long after the first scan that triggers the controller brakes, and the drives that went wrong.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from evaluation.closed_loop import drive as driving
from evaluation.closed_loop.drive import Drive, truth_of, with_brake
from evaluation.closed_loop.scenarios import scenario
from evaluation.report import Report, console, write_into
from ttc_fast import BrakeController, Command, Motion, ScanTTC

RATES = (5.0, 7.5, 10.0, 20.0, 40.0, 100.0)
"""Scans in a second."""
RULES: dict[str, dict[str, Any]] = {
    "(0.75, 0.1), the default": {},
    "(3, 4)": {"trigger": (3, 4), "release": (3, 5)},
    "(1, 1)": {"trigger": (1, 1), "release": (3, 5)},
}
STEP = 0.005
"""The step of the simulation, s: two of them for the fastest scanner."""
LEGEND = (
    "Delay: from the first scan that triggers to the brake. Possible: there was a collision to prevent, and time to do "
    "so with four scans of 40 Hz. Collisions: in these. The drives are the same at each rate."
)


def delay(rate: float, **settings: Any) -> float:
    """Return the time from the first scan that triggers to the brake, s, for a wall that appears."""
    controller = BrakeController(scan=ScanTTC(-1.5, 0.1, 31, outline=(-0.1, 0.4, -0.15, 0.15)), **settings)
    far, near = np.full(31, 20.0), np.full(31, 1.5)
    for frame in range(200):
        stamp = frame / rate
        ranges = far if frame < 100 else near
        if controller.update(stamp, ranges=ranges, stamp=stamp, motion=Motion(2.0)).command is Command.BRAKE:
            return stamp - 100 / rate
    raise RuntimeError("it never braked")


def drives_at(seed: int, run: int) -> list[list[Drive]]:
    """Drive a scenario with each rule at each rate; what is possible is that of 40 Hz."""
    made, _ = scenario(seed, run)
    truth = truth_of(made)
    driving.PHYSICS = STEP
    results = []
    for rate in RATES:
        at_rate = replace(made, scanner=replace(made.scanner, period=1.0 / rate))
        each = [with_brake(at_rate, scenario(seed, run)[1], rule) for rule in RULES.values()]
        results.append([Drive(run, made.kind, truth, *outcome) for outcome in each])
    driving.PHYSICS = 0.0125
    return results


def table(results: list[list[list[Drive]]]) -> Report:
    """Make a table with a row for each rate and rule."""
    rows = []
    for at, rate in enumerate(RATES):
        for number, (name, rule) in enumerate(RULES.items()):
            drives = [each[at][number] for each in results]
            least = [each.margin for each in drives if each.truth.possible and each.margin == each.margin]
            rows.append(
                [
                    f"{rate:g} Hz",
                    name,
                    f"{delay(rate, **rule):.3f} s",
                    str(len(drives)),
                    str(sum(each.truth.possible for each in drives)),
                    str(sum(each.crashed for each in drives)),
                    str(sum(each.needless for each in drives)),
                    str(sum(each.false_stop for each in drives)),
                    f"{min(least):.2f} m" if least else "-",
                ]
            )
    head = ["rate", "trigger", "delay", "drives", "possible", "collisions", "needless stops", "of them false"]
    return Report("Votes of frames and of time, at several rates", LEGEND, [*head, "least room"], rows)


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(prog="python -m evaluation.closed_loop.rates", description=__doc__)
    parser.add_argument("--runs", type=int, default=1_000, help="drives for each rate and rule (default %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of all drives (default %(default)s)")
    parser.add_argument("--processes", type=int, help="default: as many as there are processors")
    parser.add_argument("--markdown", type=Path, help="a document to put the table into, such as docs/closed_loop.md")
    chosen = parser.parse_args()
    with ProcessPoolExecutor(chosen.processes) as pool:
        results = list(pool.map(partial(drives_at, chosen.seed), range(chosen.runs), chunksize=10))
    report = table(results)
    console().print(report.rich())
    if chosen.markdown:
        write_into(chosen.markdown, "python -m evaluation.closed_loop.rates", report.markdown())


if __name__ == "__main__":
    main()
