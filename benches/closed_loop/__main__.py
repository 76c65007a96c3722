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
    from benches.table import Report

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
    """Run what the command line asks for."""
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
    reports, remarks = [], []
    with ProcessPoolExecutor(chosen.processes) as pool:
        seeds = [(chosen.seed, chosen.runs, chosen.others), (chosen.seed + 1, chosen.held_out, 0)]
        for seed, runs, others in seeds[: 2 if chosen.held_out else 1]:
            made, said = of_seed(pool, seed, runs, others)
            reports += made
            remarks += said
    for report in reports:
        console().print(report.rich())
    for remark in remarks:
        console().print(remark)
    if chosen.markdown:
        parts = [*(each.markdown() for each in reports), *(f"- {remark}" for remark in remarks), ""]
        replace(chosen.markdown, "python -m benches.closed_loop", "\n".join(parts))


def of_seed(pool: ProcessPoolExecutor, seed: int, runs: int, others: int) -> tuple[list[Report], list[str]]:
    """Drive every scenario of a seed, the first ones with every setting: tables, and what there is to say."""
    results: dict[str, list[Drive]] = {name: [] for name in (SETTINGS if others else [DEFAULT])}
    every, default = range(min(others, runs)), range(min(others, runs), runs)
    for part, settings in ((every, SETTINGS), (default, {DEFAULT: SETTINGS[DEFAULT]})):
        job = partial(drives, seed, each=list(settings.values()))
        for made in track(pool.map(job, part, chunksize=20), f"seed {seed}", len(part), transient=True):
            for name, each in zip(settings, made, strict=True):
                results[name].append(each)
    first = f"Seed {seed}"
    reports = [table(f"{first}: the default", "kind", kinds(results[DEFAULT]))]
    if others:
        first_ones = {name: each[:others] for name, each in results.items()}
        reports.append(table(f"{first}: every setting, on the same drives", "setting", first_ones))
    said = gone_wrong(results[DEFAULT])
    found = "; ".join(said) if said else "no collision where braking was possible, and no false stop"
    return reports, [f"{first}, {runs} drives of the default: {found}.", f"{first}: {needless(results[DEFAULT])}"]


if __name__ == "__main__":
    main()
