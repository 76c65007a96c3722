"""A replayed log of scans as a table that a person can read."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ttc_fast import Status
from ttc_fast.demo.scans.replay import TOO_LONG
from ttc_fast.demo.table import chosen, columns, frames, line, mark, status_cell, ttc_cell

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import Console
    from rich.text import Text

    from ttc_fast.demo.scans.replay import ScanReplay, ScanRow

READINGS = ("valid", "no_return", "invalid", "out_of_range", "too_close", "masked", "contact")
MANY = 1 / 3  # of the readings discarded is worth a line of its own
COLUMNS = ("\nframe", "t\ns", "speed\nm/s", "TTC\ns", "angle\n°", "range\nm")


def report(result: ScanReplay, console: Console, *, rows: int = 20) -> None:
    """Print the table and its summary.

    Parameters
    ----------
    result : ScanReplay
        What to print.
    console : Console
        Where to.
    rows : int
        About how many rows to print of a longer log; 0 prints all. The first and the last row and those that the
        summary speaks of are always among them.
    """
    outvoted = result.worst_outvoted
    kinds = [kind for kind in READINGS if any(getattr(row.nearest.counts, kind) for row in result.rows)]
    table = columns(COLUMNS, [_two_lines(kind) for kind in kinds])
    for row in chosen(result, rows, outvoted):
        counts = (str(getattr(row.nearest.counts, kind)) for kind in kinds)
        table.add_row(mark(row, result, outvoted), *_cells(row, result.threshold), *counts)
    console.print(table)
    console.print()
    for title, text in _summary(result, kinds):
        line(console, title, text)


def _two_lines(kind: str) -> str:
    """Break a heading before its last word, so that columns stay narrow."""
    head, _, tail = kind.rpartition("_")
    return f"{head.replace('_', ' ')}\n{tail}"


def _cells(row: ScanRow, threshold: float) -> list[Text | str]:
    nearest = row.nearest
    angle, distance = ("", "") if nearest.beam < 0 else (f"{math.degrees(nearest.angle):.1f}", f"{nearest.range:.3f}")
    return [
        str(row.frame),
        f"{row.stamp:.3f}",
        f"{row.speed:.2f}",
        ttc_cell(row.ttc, nearest.status, threshold),
        angle,
        distance,
        status_cell(nearest.status),
    ]


def _summary(result: ScanReplay, kinds: list[str]) -> Iterator[tuple[str, str]]:
    """Say in lines of a name and a text what happened in the log."""
    rows, least, under, worst = result.rows, result.least, result.under, result.worst_outvoted
    yield "  log", f"{frames(len(rows))} of {result.scan.beams} beams in {result.duration:.1f} s"
    if math.isfinite(least.ttc):
        place = f"frame {least.frame}, {least.nearest.clearance:.2f} m from the {result.start}, closing at"
        yield "* least TTC", f"{least.ttc:.3f} s in {place} {least.nearest.closing_speed:.2f} m/s"
    else:
        yield "* least TTC", "none, nothing ever closes"
    if under:
        first = f"the first is {under[0].frame}, at {under[0].stamp:.3f} s and {under[0].speed:.2f} m/s"
        yield f"< {result.threshold:g} s", f"{frames(len(under))}, {first}"
    if worst:
        told = f"a lone reading would have said less, {worst.lone_ttc:.3f} s in frame {worst.frame}"
        yield "! outvoted", f"in {frames(len(result.outvoted))} {told}"
    blind = sum(row.nearest.status == Status.NO_DATA for row in rows)
    if blind:
        yield "  blind", f"nothing valid was seen in {frames(blind)}"
    readings = len(rows) * result.scan.beams
    shares = {kind: sum(getattr(row.nearest.counts, kind) for row in rows) / readings for kind in kinds}
    yield "  distance", _distance(result)
    yield "  mount", "x {:g} m, y {:g} m, yaw {:g} rad".format(*result.scanner.mount)
    yield "  vote", f"{result.vote}" if result.vote else "none, a lone reading decides"
    yield "  readings", ", ".join(f"{share:.1%} {kind.replace('_', ' ')}" for kind, share in shares.items())
    discarded = shares.get("out_of_range", 0.0)
    if discarded > MANY:
        low, high = result.scanner.range_min, result.scanner.range_max
        yield "  discarded", f"{discarded:.1%} of the readings are outside the scanner's {low:g} to {high:g} m"


def _distance(result: ScanReplay) -> str:
    """Say what a TTC counts from."""
    if result.scanner.outline is None:
        return f"from the scanner, so {TOO_LONG}; say where the vehicle ends with --outline"
    rear, front, right, left = result.scanner.outline
    return f"from the outline, x {rear:g} to {front:g} m, y {right:g} to {left:g} m; range is from the scanner"
