"""A replay on the screen: a live table with a bar, rows, and the summary."""

from __future__ import annotations

import math
import time
from collections import deque
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console, Group
from rich.live import Live
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from ttc_fast.brake import Command, Reason
from ttc_fast.demo.table import STYLES, frames, line

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from ttc_fast.replay.row import Row
    from ttc_fast.replay.run import Replay
    from ttc_fast.replay.summary import Summary

TICK = 0.1
"""s between two updates of the screen."""
LIVE_ROWS = 8
MOST_EVENTS = 10
COMMANDS = {Command.NONE: "dim", Command.WARN: "yellow", Command.BRAKE: "bold red"}
COLUMNS = ("frame", "t, s", "distance, m", "closing, m/s", "TTC, s")


def table_of(rows: Iterable[Row], threshold: float) -> Table:
    """Make a table of rows."""
    table = Table(box=None, header_style="bold", pad_edge=False, padding=(0, 2, 0, 0))
    for name in COLUMNS:
        table.add_column(name, justify="right")
    for name in ("status", "command", "reason"):
        table.add_column(name, no_wrap=True)
    for row in rows:
        table.add_row(
            str(row.frame),
            f"{row.stamp:.3f}",
            _number(row.distance, 2),
            _number(row.closing_speed, 2),
            Text(_number(row.ttc, 3), style="bold red" if row.ttc < threshold else ""),
            Text(row.status.name, style=STYLES.get(row.status, "")),
            Text(row.command.name, style=COMMANDS[row.command]),
            row.reason.name,
        )
    return table


def _number(value: float, digits: int) -> str:
    return "-" if math.isnan(value) else f"{value:.{digits}f}"


def watch(replay: Replay, console: Console) -> Iterator[Row]:
    """Give the rows of a replay, and show the last of them on a terminal meanwhile."""
    if not console.is_terminal:
        yield from replay
        return
    last: deque[Row] = deque(maxlen=LIVE_ROWS)
    bar = Progress(
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), console=console
    )
    task = bar.add_task(replay.log.path.name, total=replay.log.frame_count)
    due = time.monotonic() + TICK
    with Live(console=console, transient=True, auto_refresh=False) as live:
        for row in replay:
            last.append(row)
            if time.monotonic() >= due:
                bar.update(task, completed=row.frame + 1)
                live.update(Group(table_of(last, replay.threshold), bar), refresh=True)
                due = time.monotonic() + TICK
            yield row


def print_rows(replay: Replay, console: Console, limit: int) -> None:
    """Print about so many rows evenly over the log, those where a command changes first among them; 0 prints none."""
    rows = replay.series.rows
    if limit == 0 or not rows:
        return
    told = [i for i in range(1, len(rows)) if rows[i].command is not rows[i - 1].command][: limit // 2]
    even = np.linspace(0, len(rows) - 1, max(min(limit, len(rows)) - len(told), 2)).round().astype(int).tolist()
    console.print(table_of([rows[i] for i in sorted({*even, *told})], replay.threshold))
    console.print()


def print_summary(summary: Summary, console: Console) -> None:
    """Print what a log came to."""
    for name, text in _lines(summary):
        line(console, name, text)


def _lines(summary: Summary) -> Iterator[tuple[str, str]]:
    yield "log", f"{summary.path}: {frames(summary.frames)} in {summary.duration:.1f} s, {summary.pace}"
    if summary.least is not None:
        least = summary.least
        if math.isfinite(least.ttc):
            where = f"{least.distance:.2f} m away, closing at {least.closing_speed:.2f} m/s"
            yield "least TTC", f"{least.ttc:.3f} s in frame {least.frame} at {least.stamp:.3f} s, {where}"
        else:
            yield "least TTC", "none, nothing ever closes"
    below = f"below {summary.threshold:g} s for {summary.exposed:.2f} s (TET)"
    yield "exposure", f"{below}, integrated {summary.integrated:.2f} s\N{SUPERSCRIPT TWO} (TIT)"
    yield "brakes", _times(summary.brakes) + (f", and warns in {frames(summary.warnings)}" if summary.warnings else "")
    for event in summary.events[:MOST_EVENTS]:
        begin = event.begin
        by = f" by {begin.criterion}: {begin.value:.2f} < {begin.threshold:.3g}"
        why = by if begin.reason is Reason.CRITERION else ""
        until = f"{begin.stamp:.3f} to {event.end:.3f} s, {frames(event.frames)}"
        yield "", f"frame {begin.frame}, {until}: {begin.reason.name}{why}"
    if summary.brakes > MOST_EVENTS:
        yield "", f"and {summary.brakes - MOST_EVENTS} more"
    if summary.invalid:
        yield "invalid", f"{frames(summary.invalid)} with nothing valid, or with a stamp that is not newer"
    if summary.unknown:
        yield "unknown", f"in {frames(summary.unknown)} nothing tells a closing speed; --speed does"
    if summary.stale:
        yield "stale", f"{_times(summary.stale)} no frame came for longer than the brake waits (--sensor-timeout)"
    if summary.resets:
        yield "clock", f"set back {_times(summary.resets)}; the brake began anew there"
    if summary.lost:
        yield "lost", summary.lost


def _times(number: int) -> str:
    return {0: "never", 1: "once"}.get(number, f"{number} times")


def print_summaries(summaries: list[Summary], console: Console) -> None:
    """Print a table of many logs, a line each."""
    table = Table(box=None, header_style="bold", pad_edge=False, padding=(0, 2, 0, 0))
    table.add_column("log", overflow="fold")
    for name in ("frames", "least TTC, s", "TET, s", "TIT, s\N{SUPERSCRIPT TWO}", "brakes", "invalid", "stale", "lost"):
        table.add_column(name, justify="right")
    for each in summaries:
        least = _number(each.least.ttc, 3) if each.least else "-"
        numbers = (str(each.frames), least, f"{each.exposed:.2f}", f"{each.integrated:.2f}", str(each.brakes))
        table.add_row(each.path, *numbers, str(each.invalid), str(each.stale), "yes" if each.lost else "")
    console.print(table)
    for each in summaries:
        if each.lost:
            line(console, "lost", each.lost)
