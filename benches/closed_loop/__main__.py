"""``python -m benches.closed_loop``: thousands of drives, in all processes there are, and the tables."""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.progress import track

from benches.closed_loop.drive import Drive, drives
from benches.closed_loop.table import gone_wrong, kinds, needless, table
from benches.document import replace
from benches.table import console
from ttc_fast import IttcThreshold, StoppingDistance, SweptPathThreshold

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from benches.table import Report

CHUNK = 20
"""Drives that a process takes at once."""
DEFAULT = "default"
SETTINGS: dict[str, dict[str, Any]] = {
    DEFAULT: {},
    "default, 2 of 3": {"trigger": (2, 3)},
    "default, 1 of 1": {"trigger": (1, 1)},
    "SweptPathThreshold(1.5)": {"criteria": [SweptPathThreshold(1.5)]},
    "StoppingDistance()": {"criteria": [StoppingDistance()]},
    "IttcThreshold(1.5)": {"criteria": [IttcThreshold(1.5)]},
    "IttcThreshold(0.5)": {"criteria": [IttcThreshold(0.5)]},
}
"""What is compared; ``{}`` is the controller as it comes."""


def main() -> None:
    """Run what the command line asks for; an interrupt ends it early, with tables of what was driven."""
    parser = argparse.ArgumentParser(prog="python -m benches.closed_loop", description=__doc__)
    parser.add_argument("--runs", type=int, default=10_000, help="drives of the default (default %(default)s)")
    parser.add_argument("--others", type=int, default=2_000, help="of them with every setting (default %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of all drives (default %(default)s)")
    parser.add_argument(
        "--held-out", type=int, default=0, help="drives of the default with the next seed (default none)"
    )
    parser.add_argument("--processes", type=int, help="default: as many as there are processors")
    parser.add_argument("--markdown", type=Path, help="a document to put the tables into, such as docs/braking.md")
    chosen = parser.parse_args()
    results: list[dict[str, list[Drive]]] = [{name: [] for name in SETTINGS}, {DEFAULT: []}]
    every, rest = range(min(chosen.others, chosen.runs)), range(min(chosen.others, chosen.runs), chosen.runs)
    try:
        with ProcessPoolExecutor(chosen.processes) as pool:
            run_all(pool, chosen.seed, every, results[0], list(SETTINGS))
            run_all(pool, chosen.seed + 1, range(chosen.held_out), results[1], [DEFAULT])
            run_all(pool, chosen.seed, rest, results[0], [DEFAULT])
    except KeyboardInterrupt:
        console().print("ended early: the tables have what was driven until then")
    reports, remarks = [], []
    for seed, made in zip((chosen.seed, chosen.seed + 1), results, strict=True):
        if made[DEFAULT]:
            reports += tables(seed, made)
            remarks += said(seed, made[DEFAULT])
    for report in reports:
        console().print(report.rich())
    for remark in remarks:
        console().print(remark)
    if chosen.markdown:
        parts = [*(each.markdown() for each in reports), *(f"- {remark}" for remark in remarks), ""]
        replace(chosen.markdown, "python -m benches.closed_loop", "\n".join(parts))


def run_all(
    pool: ProcessPoolExecutor, seed: int, runs: range, results: dict[str, list[Drive]], names: Sequence[str]
) -> None:
    """Drive the runs of a seed with each of the named settings, and put how it went into the results."""
    job = partial(drives, seed, each=[SETTINGS[name] for name in names])
    work = [pool.submit(several, job, runs[at : at + CHUNK]) for at in range(0, len(runs), CHUNK)]
    try:
        for done in track(work, f"seed {seed}", transient=True):
            for made in done.result():
                for name, each in zip(names, made, strict=True):
                    results[name].append(each)
    finally:
        for each_work in work:
            each_work.cancel()


def several(job: Callable[[int], list[Drive]], runs: range) -> list[list[Drive]]:
    """Drive a few, in one process."""
    return [job(run) for run in runs]


def tables(seed: int, results: dict[str, list[Drive]]) -> list[Report]:
    """Make a table of the kinds of scenarios, and one of the settings where there are several."""
    made = [table(f"Seed {seed}: the default", "kind", kinds(results[DEFAULT]))]
    fewest = min(map(len, results.values()))
    if len(results) > 1 and fewest:
        same = {name: each[:fewest] for name, each in results.items()}
        made.append(table(f"Seed {seed}: every setting, on the same drives", "setting", same))
    return made


def said(seed: int, drives: list[Drive]) -> list[str]:
    """Name every drive that went wrong, to look at it again, and say how needless stops came about."""
    wrong = "; ".join(gone_wrong(drives)) or "no collision where braking was possible, and no false stop"
    return [f"Seed {seed}, {len(drives)} drives of the default: {wrong}.", f"Seed {seed}: {needless(drives)}."]


if __name__ == "__main__":
    main()
