"""What the tables of all kinds of logs have in common."""

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
    from collections.abc import Iterator, Sequence

    from ttc_fast.demo.replay import FrameT, Replay, RowT
    from ttc_fast.logs import Log

STYLES = {
    Status.CONTACT: "bold red",
    Status.NO_DATA: "bold magenta",
    Status.TOO_FEW: "bold magenta",
    Status.NOT_CLOSING: "dim",
    Status.WARMING_UP: "dim",
    Status.CLEAR: "dim",
}
WORTH_A_BAR = 2000  # frames; fewer are over before a bar is drawn
PIPE_WIDTH = 120  # columns, where no terminal tells


def open_console() -> Console:
    """Open standard output: as wide as the terminal, or wide enough for the table in a pipe."""
    console = Console(highlight=False)
    return console if console.is_terminal else Console(highlight=False, width=PIPE_WIDTH)


def watch(log: Log[FrameT]) -> Iterator[FrameT]:
    """Read a log, with a progress bar on standard error if it is long."""
    console = Console(stderr=True)
    short = log.frame_count is not None and log.frame_count < WORTH_A_BAR
    with Progress(console=console, transient=True, disable=short or not console.is_terminal) as progress:
        yield from progress.track(log, total=log.frame_count, description=log.path.name)


def columns(names: Sequence[str], counts: Sequence[str]) -> Table:
    """Start a table of marks, numbers, a status and counts; headings may have two lines."""
    table = Table(box=None, header_style="bold", pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column("")
    for name in names:
        table.add_column(name, justify="right")
    table.add_column("\nstatus", no_wrap=True)
    for name in counts:
        table.add_column(name, justify="right", style="dim")
    return table


def chosen(result: Replay[RowT, FrameT], limit: int, outvoted: RowT | None) -> list[RowT]:
    """Pick about so many rows evenly over the log, 0 for all, and those that the summary speaks of."""
    rows = result.rows
    if limit == 0 or len(rows) <= limit:
        return rows
    told = {row.frame for row in (outvoted, *result.under[:1]) if row is not None}
    if math.isfinite(result.least.ttc):
        told.add(result.least.frame)
    even = np.linspace(0, len(rows) - 1, max(limit - len(told), 2)).round().astype(int).tolist()
    return [rows[frame] for frame in sorted({*even, *told})]


def mark(row: RowT, result: Replay[RowT, FrameT], outvoted: RowT | None) -> str:
    """Mark a row as the summary marks its lines; a row under the threshold may have a second mark."""
    marks = "<" if row.ttc < result.threshold else ""
    if outvoted is not None and row.frame == outvoted.frame:
        marks += "!"
    if row.frame == result.least.frame and math.isfinite(row.ttc):
        marks += "*"
    return marks


def ttc_cell(ttc: float, status: Status, threshold: float) -> Text:
    """Show a TTC, if there is one to speak of."""
    unknown = status in (Status.NO_DATA, Status.WARMING_UP)
    return Text("-" if unknown else f"{ttc:.3f}", style="bold red" if ttc < threshold else "")


def status_cell(status: Status) -> Text:
    """Show a status."""
    return Text(status.name, style=STYLES.get(status, ""))


def line(console: Console, name: str, text: str) -> None:
    """Print a line of the summary."""
    console.print(Text.assemble((f"{name:<12}", "bold"), text), soft_wrap=True)


def frames(number: int) -> str:
    """Say how many frames."""
    return "1 frame" if number == 1 else f"{number} frames"
