"""A replayed log as a table that a person can read."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table
from rich.text import Text

from ttc_fast import Status

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ttc_fast.demo.replay import Replay, Row
    from ttc_fast.logs import ScanFrame, ScanLog

READINGS = ("valid", "no_return", "invalid", "out_of_range", "too_close", "masked", "contact")
STYLES = {Status.CONTACT: "bold red", Status.NO_DATA: "bold magenta", Status.NOT_CLOSING: "dim"}
WORTH_A_BAR = 2000  # frames; fewer are over before a bar is drawn
PIPE_WIDTH = 120  # columns, where no terminal tells


def open_console() -> Console:
    """Open standard output: as wide as the terminal, or wide enough for the table in a pipe."""
    console = Console(highlight=False)
    return console if console.is_terminal else Console(highlight=False, width=PIPE_WIDTH)


def watch(log: ScanLog) -> Iterator[ScanFrame]:
    """Read a log, with a progress bar on standard error if it is long."""
    console = Console(stderr=True)
    short = log.frame_count is not None and log.frame_count < WORTH_A_BAR
    with Progress(console=console, transient=True, disable=short or not console.is_terminal) as progress:
        yield from progress.track(log, total=log.frame_count, description=log.path.name)


def report(result: Replay, console: Console, *, rows: int = 20) -> None:
    """Print the table and its summary.

    Parameters
    ----------
    result : Replay
        What to print.
    console : Console
        Where to.
    rows : int
        About how many rows to print of a longer log; 0 prints all. The first, the last and the marked rows are always
        among them.
    """
    marks = _marks(result)
    kinds = [kind for kind in READINGS if any(getattr(row.nearest.counts, kind) for row in result.rows)]
    table = Table(box=None, header_style="bold", pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column("")
    for name in ("\nframe", "t\ns", "speed\nm/s", "TTC\ns", "angle\n°", "range\nm"):
        table.add_column(name, justify="right")
    table.add_column("\nstatus", no_wrap=True)
    for kind in kinds:
        table.add_column(_two_lines(kind), justify="right", style="dim")
    for row in _chosen(result.rows, rows, marks):
        counts = (str(getattr(row.nearest.counts, kind)) for kind in kinds)
        table.add_row(marks.get(row.frame, ""), *_cells(row, result.threshold), *counts)
    console.print(table)
    console.print()
    for name, text in _summary(result, kinds):
        line(console, name, text)


def line(console: Console, name: str, text: str) -> None:
    """Print a line of the summary."""
    console.print(Text.assemble((f"{name:<12}", "bold"), text), soft_wrap=True)


def _two_lines(kind: str) -> str:
    """Break a heading before its last word, so that columns stay narrow."""
    head, _, tail = kind.rpartition("_")
    return f"{head.replace('_', ' ')}\n{tail}"


def _marks(result: Replay) -> dict[int, str]:
    """Mark the frames that the summary speaks of, as it marks its lines."""
    marks: dict[int, str] = {}
    if result.outvoted:
        marks[_worst_outvoted(result).frame] = "!"
    if result.under:
        marks[result.under[0].frame] = "<"
    if math.isfinite(result.least.nearest.ttc):
        marks[result.least.frame] = "*"
    return marks


def _chosen(rows: list[Row], limit: int, marks: dict[int, str]) -> list[Row]:
    """Pick rows evenly over the log, and those with a mark."""
    if limit == 0 or len(rows) <= limit:
        return rows
    even = np.linspace(0, len(rows) - 1, max(limit - len(marks), 2)).round().astype(int).tolist()
    return [rows[frame] for frame in sorted({*even, *marks})]


def _cells(row: Row, threshold: float) -> list[Text | str]:
    nearest = row.nearest
    ttc = "-" if nearest.status == Status.NO_DATA else f"{nearest.ttc:.3f}"
    angle, distance = ("", "") if nearest.beam < 0 else (f"{math.degrees(nearest.angle):.1f}", f"{nearest.range:.3f}")
    return [
        str(row.frame),
        f"{row.stamp:.3f}",
        f"{row.speed:.2f}",
        Text(ttc, style="bold red" if nearest.ttc < threshold else ""),
        angle,
        distance,
        Text(nearest.status.name, style=STYLES.get(nearest.status, "")),
    ]


def _summary(result: Replay, kinds: list[str]) -> Iterator[tuple[str, str]]:
    """Say in lines of a name and a text what happened in the log."""
    rows, least, under, outvoted = result.rows, result.least, result.under, result.outvoted
    duration = rows[-1].stamp - rows[0].stamp
    yield "  log", f"{_frames(len(rows))} of {result.scan.beams} beams in {duration:.1f} s"
    if math.isfinite(least.nearest.ttc):
        place = f"frame {least.frame}, {least.nearest.clearance:.2f} m left, closing at"
        yield "* least TTC", f"{least.nearest.ttc:.3f} s in {place} {least.nearest.closing_speed:.2f} m/s"
    else:
        yield "* least TTC", "none, nothing ever closes"
    if under:
        first = f"the first is {under[0].frame}, at {under[0].stamp:.3f} s and {under[0].speed:.2f} m/s"
        yield f"< {result.threshold:g} s", f"{_frames(len(under))}, {first}"
    if outvoted:
        worst = _worst_outvoted(result)
        told = f"a lone reading would have said less, {worst.lone_ttc:.3f} s in frame {worst.frame}"
        yield "! outvoted", f"in {_frames(len(outvoted))} {told}"
    blind = sum(row.nearest.status == Status.NO_DATA for row in rows)
    if blind:
        yield "  blind", f"nothing valid was seen in {_frames(blind)}"
    readings = len(rows) * result.scan.beams
    shares = {kind: sum(getattr(row.nearest.counts, kind) for row in rows) / readings for kind in kinds}
    yield "  readings", ", ".join(f"{share:.1%} {kind.replace('_', ' ')}" for kind, share in shares.items())


def _frames(number: int) -> str:
    return "1 frame" if number == 1 else f"{number} frames"


def _worst_outvoted(result: Replay) -> Row:
    return min(result.outvoted, key=lambda row: row.lone_ttc)
