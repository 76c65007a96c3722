"""The goals, and how far each is reached in one run: ``python -m benches.goals --markdown docs/performance.md``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rich.progress import track

from benches import bounds, latency, levels, machine
from benches.clouds import street
from benches.shortfalls import why
from benches.timing import interleaved
from benches.wanted import GROUPS, LEVELLED, LEVELS
from evaluation.report import Report, console, number, time_of, write_into

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from benches.case import Entrant
    from benches.goal import Goal

LEGEND = (
    "Medians of whole Python calls, one thread, each pair in turns in one process (levels: one process each, in turns, "
    "the best of three medians), each answer checked before. ≥: how many times as long the other one takes. ≤: how "
    f"many times as long as the other one it takes. Clouds: {street.SOURCE}; 1M points are frames over and over with "
    "noise upon them. bare read, bare copy: a loop over the same bytes that does nothing else, called from Python."
)


def main(argv: Sequence[str] | None = None) -> None:
    """Measure everything, print it, and put it into the document."""
    arguments = _parser().parse_args(argv)
    table, shortfalls = goals(arguments.rounds)
    reports = [table, bounds.report(), latency.report(arguments.calls)]
    terminal = console()
    for report in reports:
        terminal.print(report.rich())
    for text in (*shortfalls, machine.sentence()):
        terminal.print(text, highlight=False)
    if arguments.markdown:
        reasons = ["### Where it falls short", "", *(f"- {text}" for text in shortfalls or ["Nowhere."]), ""]
        parts = [machine.sentence(), "", table.markdown(), *reasons, *(report.markdown() for report in reports[1:])]
        write_into(arguments.markdown, "python -m benches.goals", "\n".join(parts))


def goals(rounds: int) -> tuple[Report, list[str]]:
    """The table, and each reason with the rows that fall short for it."""
    rows: list[list[str]] = []
    shortfalls: dict[str, list[str]] = {}
    for goal, times in _measured(rounds):
        ratio = goal.ratio(times)
        rows.append(_row(goal, times, ratio))
        if ratio is not None and not goal.is_met(ratio):
            short = f"{goal.ours.case} beside {goal.who} ({number(ratio)}, goal {goal.wanted})"
            shortfalls.setdefault(why(goal), []).append(short)
    table = Report("Goals", LEGEND, ["call", "", "time", "beside", "time", "goal", "ratio", "met"], rows)
    return table, [f"**{'; '.join(short)}.** {reason}" for reason, short in shortfalls.items()]


def _measured(rounds: int) -> list[tuple[Goal, Mapping[Entrant, float]]]:
    """Each goal with the times of the run that it was part of."""
    measured: list[tuple[Goal, Mapping[Entrant, float]]] = []
    for group in track(GROUPS, description="goals", transient=True):
        entrants = dict.fromkeys(entrant for goal in group for entrant in (goal.ours, goal.other) if entrant.exists)
        times = interleaved(list(entrants), rounds)
        measured += [(goal, times) for goal in group]
    times = levels.measure(LEVELLED)
    return [*measured, *((goal, times) for goal in LEVELS)]


def _row(goal: Goal, times: Mapping[Entrant, float], ratio: float | None) -> list[str]:
    ours, other = (time_of(times[who]) if who in times else "" for who in (goal.ours, goal.other))
    result = ["", "not measured"] if ratio is None else [number(ratio), "yes" if goal.is_met(ratio) else "**no**"]
    return [str(goal.ours.case), goal.ours.name, ours, goal.who, other, goal.wanted, *result]


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m benches.goals", description=__doc__)
    parser.add_argument("--rounds", type=int, default=101, help="turns of everybody, if time allows (%(default)s)")
    parser.add_argument("--calls", type=int, default=1_000_000, help="single calls back to back (%(default)s)")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="put the tables between the marks there")
    return parser


if __name__ == "__main__":
    main()
