"""``python -m evaluation.closed_loop``: thousands of drives, in all processes there are, and the tables."""

from __future__ import annotations

import argparse
import math
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.progress import track

from evaluation.closed_loop.drive import Drive, drives
from evaluation.report import Report, console, write_into
from ttc_fast import IttcThreshold, StoppingDistance, SweptPathThreshold

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence


COUNTS = ("drives", "possible", "collisions", "unavoidable", "needless stops", "of them false")
MARGINS = ("earliest", "5 %", "median", "latest", "least room")
LEGEND = (
    "Possible: there was a collision to prevent, and time to do so after a beam had met what was in the way. "
    "Collisions: in these. Unavoidable: other collisions. Earliest to latest: from the brake to when the collision "
    "would have been; room: what was left before the car when it stood, at most 3 m. Both in possible drives."
)


def table(title: str, first: str, drives: Mapping[str, Sequence[Drive]]) -> Report:
    """Make a table with a row for each setting, or kind of scenario."""
    rows = [[name, *counts(each), *margins(each)] for name, each in drives.items()]
    return Report(title, LEGEND, [first, *COUNTS, *MARGINS], rows)


def kinds(drives: Sequence[Drive]) -> dict[str, Sequence[Drive]]:
    """Return all drives, and those of each kind."""
    names = dict.fromkeys(each.kind for each in drives)
    return {"all": drives, **{name: [each for each in drives if each.kind == name] for name in names}}


def counts(drives: Sequence[Drive]) -> list[str]:
    """Return the numbers of ``COUNTS``."""
    return [
        str(len(drives)),
        str(sum(each.truth.possible for each in drives)),
        str(sum(each.crashed for each in drives)),
        str(sum(each.unavoidable for each in drives)),
        str(sum(each.needless for each in drives)),
        str(sum(each.false_stop for each in drives)),
    ]


def margins(drives: Sequence[Drive]) -> list[str]:
    """Return the numbers of ``MARGINS``: when they braked, and what was left."""
    early = [each.early for each in drives if not math.isnan(each.early)]
    room = [each.margin for each in drives if each.truth.possible and not math.isnan(each.margin)]
    if not early or not room:
        return ["-"] * len(MARGINS)
    quantiles = np.quantile(early, [1.0, 0.95, 0.5, 0.0])
    return [*(f"{each:.2f} s" for each in quantiles), f"{min(room):.2f} m"]


def gone_wrong(drives: Iterable[Drive]) -> list[str]:
    """Return every drive that went wrong, to look at it again."""
    return [
        f"{'collision' if each.crashed else 'false stop'}: {each}" for each in drives if each.crashed or each.false_stop
    ]


def needless(drives: Sequence[Drive]) -> str:
    """Return how near to a threshold the truth was where a stop turned out needless."""
    nearest = sorted(each.truth.nearest for each in drives if each.needless)
    beyond = [f"{each:.2f}" for each in nearest if each >= 1.0]
    within = len(nearest) - len(beyond)
    text = f"of {len(nearest)} needless stops of the default {within} were within a threshold by the truth"
    return f"{text}; the others came to {', '.join(beyond)} of it" if beyond else text


CHUNK = 20
"""The number of drives that a process takes at once."""
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
"""The settings that are compared; ``{}`` is the default controller."""


def main() -> None:
    """Run what the command line asks for; an interrupt ends it early, with tables of what was driven."""
    parser = argparse.ArgumentParser(prog="python -m evaluation.closed_loop", description=__doc__)
    parser.add_argument("--runs", type=int, default=10_000, help="drives of the default (default %(default)s)")
    parser.add_argument("--others", type=int, default=2_000, help="of them with every setting (default %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of all drives (default %(default)s)")
    parser.add_argument(
        "--held-out", type=int, default=0, help="drives of the default with the next seed (default none)"
    )
    parser.add_argument("--processes", type=int, help="default: as many as there are processors")
    parser.add_argument("--markdown", type=Path, help="a document to put the tables into, such as docs/closed_loop.md")
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
        write_into(chosen.markdown, "python -m evaluation.closed_loop", "\n".join(parts))


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
    hidden = [each.run for each in drives if each.unavoidable and each.truth.with_perfect_sight]
    between = f"of the unavoidable collisions {len(hidden)} were possible to prevent for a scanner without gaps"
    runs = f" (runs {', '.join(map(str, hidden))})" if hidden else ""
    return [
        f"Seed {seed}, {len(drives)} drives of the default: {wrong}.",
        f"Seed {seed}: {between} between its beams{runs}.",
        f"Seed {seed}: {needless(drives)}.",
    ]


if __name__ == "__main__":
    main()
