"""Times of all implementations side by side, taken in turns in one process: ``python -m benches.report``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rich.progress import track

from benches import machine, single
from benches.case import OURS
from benches.cases import DOMAINS
from benches.timing import interleaved
from evaluation.report import Report, console, number, time_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from benches.case import Case

LEGEND = (
    "Medians of whole Python calls, everyone in turns, each answer checked before. In brackets, how many times as "
    "long as ttc_fast. GB/s: of the input of ttc_fast. reference: ttc_fast.reference, the specification. NumPy: what "
    "a user would write. bare read, bare copy: a loop over the same bytes that does nothing else, called from Python. "
)


def main(argv: Sequence[str] | None = None) -> None:
    """Measure what the arguments ask for, and print it."""
    arguments = _parser().parse_args(argv)
    machine.require_release()
    reports = []
    for domain in DOMAINS:
        if cases := [case for case in domain.cases if arguments.only in str(case)]:
            reports.append(side_by_side(domain.title, LEGEND + domain.legend, cases, arguments.rounds))
    if arguments.latency:
        reports.append(single.latency(arguments.latency))
    terminal = console()
    for report in reports:
        terminal.print(report.rich())
    terminal.print(machine.sentence(), highlight=False)
    if arguments.markdown:
        text = "\n".join([*(report.markdown() for report in reports), machine.sentence(), ""])
        arguments.markdown.write_text(text, encoding="utf-8")


def side_by_side(title: str, legend: str, cases: Sequence[Case], rounds: int) -> Report:
    """Return the medians of all implementations over ``cases``."""
    peers = list(dict.fromkeys(name for case in cases for name in case.implementations if name != OURS))
    rows = []
    for case in track(cases, description=title, transient=True):
        measured = interleaved([(case, name) for name in case.implementations], rounds)
        times = {name: ns for (_, name), ns in measured.items()}
        own = times[OURS]
        compared = [f"{time_of(times[name])} ({number(times[name] / own)}x)" if name in times else "" for name in peers]
        rows.append([str(case), time_of(own), f"{case.nbytes / own:.3g}", *compared])
    return Report(title, legend, ["call", OURS, "GB/s", *peers], rows)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m benches.report", description=__doc__)
    parser.add_argument("--only", default="", metavar="TEXT", help="cases whose name has this in it: 'min 1080'")
    parser.add_argument("--rounds", type=int, default=101, help="turns of everyone, if time allows (%(default)s)")
    parser.add_argument(
        "--latency", type=int, metavar="CALLS", help="measure this many single calls too, 1000000 or so"
    )
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="write the tables there too")
    return parser


if __name__ == "__main__":
    main()
