"""Everybody side by side, in turns, in one process: ``python -m benches.report``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rich.progress import track

from benches import latency, machine
from benches.camera import cases as camera
from benches.case import Case, Entrant
from benches.clouds import street
from benches.clouds.cases import CASES as CLOUDS
from benches.paths.cases import CASES as PATHS
from benches.scans.cases import CASES as SCANS
from benches.scans.rates import CASES as RATES
from benches.timing import interleaved
from benches.tracks.cases import CASES as TRACKS
from evaluation.report import Report, console, number, time_of

if TYPE_CHECKING:
    from collections.abc import Sequence

LEGEND = (
    "Medians of whole Python calls, everybody in turns, each answer checked before. In brackets, how many times as "
    "long as ttc_fast. GB/s: of the input of ttc_fast. reference: ttc_fast.reference, the specification. NumPy: what "
    "a user would write. bare read, bare copy: a loop over the same bytes that does nothing else, called from Python. "
)
SCAN_LEGEND = (
    "NumPy and numba have tables made once. numba: the loop of the F1TENTH gym's collision check, giving the least "
    "time and, for nearest, its beam."
)
RATE_LEGEND = "One scan after the other, each with its stamp, a room seen by a car that stands."
CLOUD_LEGEND = f"Clouds: {street.SOURCE}. C++: one pass, then nth_element."
PATH_LEGEND = "The scans above, as points or as they are. NumPy: arc tangents of all points, without their checks."
TRACK_LEGEND = "Each is a tracker made and fed a hundred distances. NumPy: polyfit over the window, and no more."
KINDS: tuple[tuple[str, str, Sequence[Case]], ...] = (
    ("Scans", SCAN_LEGEND, SCANS),
    ("Range rates", RATE_LEGEND, RATES),
    ("Clouds", CLOUD_LEGEND, CLOUDS),
    ("Swept paths", PATH_LEGEND, PATHS),
    ("Trackers", TRACK_LEGEND, TRACKS),
    ("Camera", f"Matches: {camera.SOURCE}.", camera.CASES),
)


def main(argv: Sequence[str] | None = None) -> None:
    """Measure what the arguments ask for, and print it."""
    arguments = _parser().parse_args(argv)
    reports = []
    for title, legend, every in KINDS:
        if cases := [case for case in every if arguments.only in str(case)]:
            reports.append(side_by_side(title, LEGEND + legend, list(cases), arguments.rounds))
    if arguments.latency:
        reports.append(latency.report(arguments.latency))
    terminal = console()
    for report in reports:
        terminal.print(report.rich())
    terminal.print(machine.sentence(), highlight=False)
    if arguments.markdown:
        text = "\n".join([*(report.markdown() for report in reports), machine.sentence(), ""])
        arguments.markdown.write_text(text, encoding="utf-8")


def side_by_side(title: str, legend: str, cases: Sequence[Case], rounds: int) -> Report:
    """Medians of everybody over ``cases``."""
    peers = list(dict.fromkeys(name for case in cases for name in case.names[1:]))
    rows = []
    for case in track(cases, description=title, transient=True):
        entrants = [Entrant(case, name) for name in case.names]
        times = {entrant.name: ns for entrant, ns in interleaved(entrants, rounds).items()}
        own = times["ttc_fast"]
        compared = [f"{time_of(times[name])} ({number(times[name] / own)}x)" if name in times else "" for name in peers]
        rows.append([str(case), time_of(own), f"{case.nbytes / own:.3g}", *compared])
    return Report(title, legend, ["call", "ttc_fast", "GB/s", *peers], rows)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m benches.report", description=__doc__)
    parser.add_argument("--only", default="", metavar="TEXT", help="cases whose name has this in it: 'min 1080'")
    parser.add_argument("--rounds", type=int, default=101, help="turns of everybody, if time allows (%(default)s)")
    parser.add_argument(
        "--latency", type=int, metavar="CALLS", help="measure this many single calls too, 1000000 or so"
    )
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="write the tables there too")
    return parser


if __name__ == "__main__":
    main()
