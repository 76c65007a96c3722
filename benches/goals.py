"""The goals, and how far each is reached in one run.

``python -m benches.goals --markdown docs/performance.md --readme README.md``
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from rich.progress import track

import ttc_fast
from benches import machine, native, single, street
from benches.case import OURS, TWO_THREADS
from benches.cases import BY_NAME, CASES
from benches.timing import interleaved
from evaluation.report import Report, console, number, time_of, write_into

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

COMMAND = "python -m benches.goals"
LEVEL_LIMITS = {"avx2": 1.8, "baseline": 4}
"""How many times the time at the highest level a lower one may take."""
LEVEL_TURNS, LEVEL_ROUNDS = 3, 31
SHOWN = {
    "min 271 float32": "`ScanTTC.min`, 271 beams",
    "min 1080 float32": "`ScanTTC.min`, 1080 beams",
    "min 1024x1080 float32": "`ScanTTC.min`, batch of 1024 x 1080",
    "ScanSweptPath.nearest, turning 1080 float32": "`ScanSweptPath.nearest`, turning, 1080 beams",
    "KthSmallest(k=20) 114k float32": "`robust_min_x`, `KthSmallest(20)`, 114k points",
    "MedianRatio() 1000 float32": "`ttc_from_keypoints`, `MedianRatio`, 1000 matches",
}
"""The cases that the README shows, and what it calls them. All of their implementations are measured but the reference,
which is so slow that few turns would be left, where no goal asks for it."""
LEGEND = (
    "Medians of whole Python calls, one thread, each pair in turns in one process (levels: one process each, in turns, "
    "the best of three medians), each answer checked before. ≥: how many times as long the other one takes. ≤: how "
    "many times as long as the other one it takes; us more: how much longer it takes. "
    f"Clouds: {street.SOURCE}; 1M points are frames over and over with noise upon them. "
    "bare read, bare copy: a loop over the same bytes that does nothing else, called from Python."
)


def main(argv: Sequence[str] | None = None) -> None:
    """Measure everything, print it, and put it into the document."""
    arguments = _parser().parse_args(argv)
    machine.require_release()
    table, shortfalls, shown = goals(arguments.rounds)
    reports = [table, single.bounds(), single.latency(arguments.calls)]
    terminal = console()
    for report in reports:
        terminal.print(report.rich())
    for text in (*shortfalls, machine.sentence()):
        terminal.print(text, highlight=False)
    if arguments.markdown:
        reasons = ["### Where it falls short", "", *(f"- {text}" for text in shortfalls or ["Nowhere."]), ""]
        parts = [machine.sentence(), "", table.markdown(), *reasons, *(report.markdown() for report in reports[1:])]
        write_into(arguments.markdown, COMMAND, "\n".join(parts))
    if arguments.readme:
        write_into(arguments.readme, COMMAND, "\n".join([shown.table(), "", machine.sentence(), ""]))


def goals(rounds: int) -> tuple[Report, list[str], Report]:
    """Return the table, each reason with the rows that fall short for it, and the table of the README."""
    rows, shortfalls, shown = [], dict[str, list[str]](), dict[str, dict[str, float]]()
    for case, name, ours, who, theirs, wanted, ratio, is_met, why in (*_of_cases(rounds, shown), *_of_levels()):
        times = [time_of(ns) if ns else "" for ns in (ours, theirs)]
        result = ["", "not measured"] if ratio is None else [number(ratio), "yes" if is_met else "**no**"]
        rows.append([case, name, times[0], who, times[1], wanted, *result])
        if ratio is not None and not is_met:
            shortfalls.setdefault(why, []).append(f"{case} beside {who} ({number(ratio)}, goal {wanted})")
    header = ["call", "", "time", "beside", "time", "goal", "ratio", "met"]
    return (
        Report("Goals", LEGEND, header, rows),
        [f"**{'; '.join(short)}.** {reason or 'Not explained yet.'}" for reason, short in shortfalls.items()],
        _for_readme(shown),
    )


def _for_readme(shown: dict[str, dict[str, float]]) -> Report:
    """Return the times of some cases: those of ttc_fast, and of everyone else how many times as long they are."""
    rows = []
    for case, times in shown.items():
        beside = {name: f"{time_of(ns)} ({number(ns / times[OURS])}x)" for name, ns in times.items()}
        two = f", two threads {time_of(times[TWO_THREADS])}" if TWO_THREADS in times else ""
        peers = ("numba", native.CPP, "SciPy", "reference")
        others = ", ".join(f"{name} {beside[name]}" for name in peers if name in beside)
        ours = f"{time_of(times[OURS])}{two}"
        rows.append([SHOWN[case], ours, beside.get("NumPy", ""), others])
    header = ["call, float32", OURS, "NumPy as one would write it", "others"]
    return Report("Speed", "", header, rows)


_Row = tuple[str, str, float, str, float, str, "float | None", bool, str]
"""Case, whose time, its time (ns; 0 where it was not measured), beside whom, the time of that, the goal, the ratio of
the times (None where one is missing), whether the goal is met, and why not."""


def _of_cases(rounds: int, shown: dict[str, dict[str, float]]) -> Iterator[_Row]:
    """Measure all implementations that the goals of a case name together, in turns; note the times for the README."""
    for case in track([case for case in CASES if case.goals], description="goals", transient=True):
        beside = [goal.parts(case) for goal in case.goals]
        pairs = [(case, goal.ours) for goal in case.goals]
        pairs += [(part.case, part.name) for parts in beside for part in parts]
        if str(case) in SHOWN:
            pairs += [(case, name) for name in case.implementations if name != "reference"]
        times = interleaved([(at, name) for at, name in dict.fromkeys(pairs) if name in at.implementations], rounds)
        if str(case) in SHOWN:
            shown[str(case)] = {name: ns for (at, name), ns in times.items() if at is case}
        for goal, parts in zip(case.goals, beside, strict=True):
            ours = times.get((case, goal.ours), 0.0)
            shares = [times.get((part.case, part.name), 0.0) / part.of for part in parts]
            theirs = sum(shares) if all(shares) else 0.0
            ratio = goal.ratio(ours, theirs) if ours and theirs else None
            is_met = ratio is not None and goal.is_met(ratio)
            yield str(case), goal.ours, ours, goal.who, theirs, goal.wanted, ratio, is_met, goal.why or case.why


def _of_levels() -> Iterator[_Row]:
    """Measure the lower instruction-set levels beside the highest: the best of the turns of one process for each."""
    names = [str(case) for case in CASES if case.by_level]
    times: dict[tuple[str, str], float] = {}
    for level in ("avx512", *LEVEL_LIMITS) * LEVEL_TURNS:
        command = [sys.executable, "-c", "from benches import goals; goals.print_times()", *names]
        environment = {**os.environ, "TTC_FAST_SIMD": level}
        found = json.loads(subprocess.run(command, env=environment, check=True, capture_output=True).stdout)
        if found.pop("level") == level:  # this processor has it
            times |= {(name, level): min(times.get((name, level), ns), ns) for name, ns in found.items()}
    for level, limit in LEVEL_LIMITS.items():
        for name in names:
            ours, theirs = (times.get((name, each), 0.0) for each in (level, "avx512"))
            ratio = ours / theirs if ours and theirs else None
            is_met = ratio is not None and ratio <= limit
            yield name, level, ours, "AVX-512", theirs, f"≤ {limit:g}", ratio, is_met, ""


def print_times() -> None:
    """Print the level and the time of each case that the arguments name, as JSON: what each process of a level does."""
    times = interleaved([(BY_NAME[name], OURS) for name in sys.argv[1:]], LEVEL_ROUNDS)
    print(json.dumps({"level": ttc_fast.SIMD_LEVEL, **{str(case): ns for (case, _), ns in times.items()}}))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m benches.goals", description=__doc__)
    parser.add_argument("--rounds", type=int, default=101, help="turns of everyone, if time allows (%(default)s)")
    parser.add_argument("--calls", type=int, default=1_000_000, help="single calls back to back (%(default)s)")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="put the tables between the marks there")
    parser.add_argument("--readme", type=Path, metavar="FILE", help="put the README's table between the marks there")
    return parser


if __name__ == "__main__":
    main()
