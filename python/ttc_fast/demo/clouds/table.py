"""A replayed log of clouds as a table that a person can read."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ttc_fast import Status
from ttc_fast.demo.clouds.replay import STRAY, TOO_LONG
from ttc_fast.demo.table import chosen, columns, frames, line, mark, status_cell, ttc_cell

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import Console
    from rich.text import Text

    from ttc_fast.demo.clouds.replay import CloudReplay, CloudRow

COLUMNS = ("\nframe", "t\ns", "x\nm", "nearest x\nm", "from {start}\nm", "closing\nm/s", "TTC\ns")


def report(result: CloudReplay, console: Console, *, rows: int = 20) -> None:
    """Print the table and its summary.

    Parameters
    ----------
    result : CloudReplay
        What to print.
    console : Console
        Where to.
    rows : int
        About how many rows to print of a longer log; 0 prints all. The first and the last row and those that the
        summary speaks of are always among them.
    """
    outvoted = result.worst_outvoted
    table = columns([name.format(start=result.start) for name in COLUMNS], ["\ncandidates"])
    for row in chosen(result, rows, outvoted):
        table.add_row(mark(row, result, outvoted), *_cells(row, result.threshold), str(row.seen.current.candidates))
    console.print(table)
    console.print()
    for title, text in _summary(result):
        line(console, title, text)


def _cells(row: CloudRow, threshold: float) -> list[Text | str]:
    seen = row.seen
    return [
        str(row.frame),
        f"{row.stamp:.3f}",
        _number(seen.current.x),
        _number(seen.current.nearest_x),
        _number(seen.distance),
        _number(seen.closing_speed),
        ttc_cell(row.ttc, seen.status, threshold),
        status_cell(seen.status),
    ]


def _number(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.3f}"


def _summary(result: CloudReplay) -> Iterator[tuple[str, str]]:
    """Say in lines of a name and a text what happened in the log."""
    rows, least, under, worst = result.rows, result.least, result.under, result.worst_outvoted
    yield "  log", f"{frames(len(rows))} in {result.duration:.1f} s; {result.clock}"
    if math.isfinite(least.ttc):
        place = f"frame {least.frame}, {least.seen.distance:.2f} m from the {result.start}, closing at"
        yield "* least TTC", f"{least.ttc:.3f} s in {place} {least.seen.closing_speed:.2f} m/s"
    else:
        yield "* least TTC", "none, nothing ever closes"
    if under:
        first = f"the first is {under[0].frame}, at {under[0].stamp:.3f} s and {under[0].seen.distance:.2f} m"
        yield f"< {result.threshold:g} s", f"{frames(len(under))}, {first}"
    if worst:
        told = f"the nearest point strays more than {STRAY:g} m in front of x; frame {worst.frame} would be"
        yield "! outvoted", f"in {frames(len(result.outvoted))} {told} {worst.plain.ttc:.3f} s, not {worst.ttc:.3f} s"
    for status, told in ((Status.NO_DATA, "nothing valid was seen"), (Status.TOO_FEW, "too few points to outvote any")):
        many = sum(row.seen.status == status for row in rows)
        if many:
            yield f"  {status.name.lower().replace('_', ' ')}", f"{told} in {frames(many)}"
    yield "  gate", f"{result.gate}"
    yield "  estimator", f"{result.estimator}"
    if result.front_offset:
        yield "  distance", f"from the bumper, {result.front_offset:g} m ahead of the sensor"
    else:
        yield "  distance", f"from the sensor, so {TOO_LONG}; say how far that is with --front-offset"
