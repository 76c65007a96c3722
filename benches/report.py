"""Everybody side by side, in turns, in one process: ``python -m benches.report``."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from benches import jobs, machine
from benches.answers import check
from benches.cases import CASES, Case
from benches.contestant import Contestant
from benches.timing import interleaved, latencies

if TYPE_CHECKING:
    from collections.abc import Sequence

WIDTH = 110
"""Of the widest table; a narrower terminal wraps it."""
LEGEND = (
    "Medians of whole Python calls, everybody in turns, each answer checked before. In brackets, how many times as "
    "long as ttc_fast. GB/s: of ranges that ttc_fast reads. reference: ttc_fast.reference, the specification. NumPy: "
    "what a user would write, with tables made once. numba: the loop of the F1TENTH gym's collision check, giving the "
    "least time and, for nearest, its beam."
)
LATENCY_LEGEND = "Single calls back to back, with what reading the clock takes, which is the last row of each."


@dataclass(frozen=True)
class Report:
    """A table, for the terminal and for documents."""

    title: str
    legend: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]

    def rich(self) -> Table:
        table = Table(title=self.title, caption=self.legend, caption_justify="left", title_justify="left")
        for column, name in enumerate(self.header):
            table.add_column(name, justify="left" if column == 0 else "right", no_wrap=True)
        for row in self.rows:
            table.add_row(*row)
        return table

    def markdown(self) -> str:
        rule = ["---", *("---:" for _ in self.header[1:])]
        lines = [f"| {' | '.join(row)} |" for row in (self.header, rule, *self.rows)]
        return "\n".join([f"### {self.title}", "", self.legend, "", *lines, ""])


def main(argv: Sequence[str] | None = None) -> None:
    """Measure what the arguments ask for, and print it."""
    arguments = _parser().parse_args(argv)
    cases = [case for case in CASES if arguments.only in str(case)]
    reports = [throughput(cases, arguments.rounds)]
    if arguments.latency:
        reports.append(latency(arguments.latency))
    measured_on = ", ".join(f"{name} {value}" for name, value in machine.describe().items())
    console = Console()
    console.width = max(console.width, WIDTH)
    for report in reports:
        console.print(report.rich())
    console.print(measured_on, highlight=False)
    if arguments.markdown:
        text = "\n".join([*(report.markdown() for report in reports), f"Measured on: {measured_on}.", ""])
        arguments.markdown.write_text(text, encoding="utf-8")


def throughput(cases: Sequence[Case], rounds: int) -> Report:
    """Medians of everybody over ``cases``."""
    peers = ("reference", "NumPy", "numba")
    rows = []
    for case in track(cases, description="side by side", transient=True):
        contestants = [case.contestant(name) for name in case.names]
        for contestant in contestants:
            check(case, contestant)
        medians = dict(zip(case.names, interleaved(case, contestants, rounds), strict=True))
        own = medians["ttc_fast"]
        compared = [_compared(medians[name], own) if name in medians else "" for name in peers]
        speed = f"{case.nbytes / own:.3g}"
        rows.append([case.job.name, case.size, case.dtype, _time(own), speed, *compared])
    return Report("Side by side", LEGEND, ["call", "beams", "dtype", "ttc_fast", "GB/s", *peers], rows)


def latency(calls: int) -> Report:
    """How single calls spread. Without the reference, which is too slow for so many."""
    rows = []
    for job in (jobs.MIN, jobs.NEAREST):
        case = Case(job, 1080)
        contestants = [case.contestant(name) for name in case.names if name != "reference"]
        for contestant in contestants:
            check(case, contestant)
        for contestant in [*contestants, Contestant("the clock", "None", {})]:
            samples = latencies(case, contestant, calls)
            quantiles = np.quantile(samples, (0.5, 0.99, 0.999, 1.0))
            rows.append([str(case), contestant.name, *(_time(quantile) for quantile in quantiles)])
    return Report(f"Latency of {calls} calls", LATENCY_LEGEND, ["call", "", "p50", "p99", "p99.9", "max"], rows)


def _time(ns: float) -> str:
    """Three digits of a time."""
    for unit, size in (("ms", 1e6), ("us", 1e3)):
        if ns >= 0.9995 * size:
            return f"{ns / size:.3g} {unit}"
    return f"{ns:.0f} ns"


def _compared(ns: float, own: float) -> str:
    """A time, and how many times as long as ours it is."""
    ratio = ns / own
    return f"{_time(ns)} ({ratio:.0f}x)" if ratio >= 10 else f"{_time(ns)} ({ratio:.1f}x)"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m benches.report", description=__doc__)
    parser.add_argument("--only", default="", metavar="TEXT", help="cases whose name has this in it: 'min 1080'")
    parser.add_argument("--rounds", type=int, default=101, help="turns of everybody, if time allows (%(default)s)")
    parser.add_argument("--latency", type=int, metavar="CALLS", help="measure this many single calls too, 100000 or so")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="write the tables there too")
    return parser


if __name__ == "__main__":
    main()
