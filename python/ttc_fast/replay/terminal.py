"""A replay in the terminal: a live table with a bar, then rows, then the summary."""

from __future__ import annotations

import math
import time
from collections import deque
from contextlib import contextmanager
from datetime import timedelta
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console, Group
from rich.live import Live
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bars
from rich.table import Table
from rich.text import Text

from ttc_fast._settings import option
from ttc_fast.brake import Command
from ttc_fast.replay.summary import frames_of
from ttc_fast.status import Status

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from ttc_fast.replay.many import Progress
    from ttc_fast.replay.row import Row
    from ttc_fast.replay.run import Replay
    from ttc_fast.replay.summary import Summary

PIPE_WIDTH = 120
"""Columns where output goes into a pipe, which has no width."""
TICK = 0.1
"""s between two updates of the screen."""
LINE_EACH = 60.0
"""s between two lines of progress where there is no terminal."""
LIVE_ROWS = 8
MOST_EVENTS = 10
COMMANDS = {Command.NONE: "dim", Command.WARN: "yellow", Command.BRAKE: "bold red"}
STATUSES = {
    Status.CONTACT: "bold red",
    Status.NO_DATA: "bold magenta",
    Status.INVALID: "bold magenta",
    Status.TOO_FEW: "bold magenta",
    Status.NOT_CLOSING: "dim",
    Status.WARMING_UP: "dim",
    Status.CLEAR: "dim",
}
COLUMNS = ("frame", "t, s", "distance, m", "closing, m/s", "TTC, s")
MANY = ("frames", "least TTC, s", "TET, s", "TIT, s\N{SUPERSCRIPT TWO}", "brakes", "first, s", "invalid", "stale")
WITHOUT_TTC = (Status.WARMING_UP, Status.NO_DATA, Status.INVALID)


def open_console() -> Console:
    """Return a console on standard output, as wide as the terminal or, in a pipe, wide enough for the table."""
    console = Console(highlight=False)
    return console if console.is_terminal else Console(highlight=False, width=PIPE_WIDTH)


def line(console: Console, name: str, text: str) -> None:
    """Print a line of a summary."""
    console.print(Text.assemble((f"{name:<12}", "bold"), text), soft_wrap=True)


def number(value: float, digits: int) -> str:
    """Return a number as a text, or a dash where it is not known."""
    return "-" if math.isnan(value) else f"{value:.{digits}f}"


def times(count: int) -> str:
    """Return how often something happened as a text."""
    return {0: "never", 1: "once"}.get(count, f"{count} times")


def table_of(rows: Iterable[Row], threshold: float) -> Table:
    """Return a table of rows."""
    table = _table(COLUMNS)
    for name in ("status", "command", "reason"):
        table.add_column(name, no_wrap=True)
    for row in rows:
        ttc = "-" if row.status in WITHOUT_TTC else f"{row.ttc:.3f}"
        table.add_row(
            str(row.frame),
            f"{row.stamp:.3f}",
            number(row.distance, 2),
            number(row.closing_speed, 2),
            Text(ttc, style="bold red" if row.ttc < threshold else ""),
            Text(row.status.name, style=STATUSES.get(row.status, "")),
            Text(row.command.name, style=COMMANDS[row.command]),
            row.reason.name,
        )
    return table


def _table(numbers: Sequence[str]) -> Table:
    table = Table(box=None, header_style="bold", pad_edge=False, padding=(0, 2, 0, 0))
    for name in numbers:
        table.add_column(name, justify="right")
    return table


def show_live(replay: Replay, console: Console) -> Iterator[Row]:
    """Yield the rows of a replay, and show the last of them meanwhile if there is a terminal."""
    if not console.is_terminal:
        yield from replay
        return
    last: deque[Row] = deque(maxlen=LIVE_ROWS)
    bar = Bars(
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
    """Print about ``limit`` rows: those where the command changes first, the others evenly over the log."""
    rows = replay.series.rows
    if limit == 0 or not rows:
        return
    chosen = range(len(rows)) if len(rows) <= limit else _chosen(rows, limit)
    console.print(table_of([rows[i] for i in chosen], replay.threshold))
    console.print()


def _chosen(rows: list[Row], limit: int) -> list[int]:
    changes = [i for i in range(1, len(rows)) if rows[i].command is not rows[i - 1].command][: limit // 2]
    even = np.linspace(0, len(rows) - 1, max(limit - len(changes), 2)).round().astype(int).tolist()
    return sorted({*even, *changes})


def print_used(replay: Replay, console: Console) -> None:
    """Print what was used, and why: the log, its topic, clock and rate, the speed, the sensor, and what decides."""
    if replay.summary.frames:
        for name, text in _said(replay):
            line(console, name, text)
        console.print()


def print_summary(replay: Replay, console: Console) -> None:
    """Print what a log came to."""
    if replay.summary.frames:
        for name, text in _found(replay.summary):
            line(console, name, text)
        if replay.summary.assumed:
            line(console, "ASSUMED", replay.summary.assumed)


def _said(replay: Replay) -> Iterator[tuple[str, str]]:
    """Yield the lines that say what the log is, and what the numbers rest on."""
    summary, log = replay.summary, replay.log
    yield "log", f"{summary.path}: {summary.pace}"
    if sensor := getattr(log, "sensor", ""):
        yield "sensor", sensor
    yield "time", log.clock
    motion = getattr(log, "motion", "")
    if motion:
        rated = "; how the ranges change tells what closes" if replay.pipeline.rated else ""
        yield "speed", f"{motion}{rated}"
    yield from replay.pipeline.about
    yield "criteria", ", ".join(map(str, replay.pipeline.controller.criteria))


def _found(summary: Summary) -> Iterator[tuple[str, str]]:
    """Yield the lines that say what the log comes to."""
    least, isolated = summary.least, summary.least_isolated
    where = "" if least is None else f"{least.distance:.2f} m away, closing at {least.closing_speed:.2f} m/s"
    none = "none, nothing ever closes" if summary.with_known_ttc else "not known, no frame tells what comes closer"
    yield "least TTC", f"{_when(least)}, {where}" if least else none
    if isolated is not None:
        yield (
            "isolated",
            f"{frames_of(summary.isolated)} that both neighbours contradict, such as {_when(isolated)}; left out here",
        )
    below = f"at most {summary.threshold:g} s for {summary.exposed:.2f} s (TET) of {summary.judged:.2f} s judged"
    yield "exposure", f"{below}, integrated {summary.integrated:.2f} s\N{SUPERSCRIPT TWO} (TIT)"
    warns = f", and warns in {frames_of(summary.warnings)}" if summary.warnings else ""
    yield "brakes", times(summary.brakes) + warns
    for event in summary.events[:MOST_EVENTS]:
        yield "", str(event)
    if summary.brakes > MOST_EVENTS:
        yield "", f"and {summary.brakes - MOST_EVENTS} more"
    if summary.start is not None:
        yield "start", f"{summary.start}, before anything could be evaluated; it counts as no brake"
    if summary.invalid:
        yield "invalid", f"{frames_of(summary.invalid)} with nothing valid, or with a stamp that is not newer"
    if summary.unknown:
        why = f"odometry is missing ({option('speed')} gives one), or a tracker warms up"
        yield "unknown", f"in {frames_of(summary.unknown)} it is not known what comes closer: {why}"
    if summary.stale:
        gap = f"no frame came for longer than the brake waits, at most for {summary.longest_gap:.3g} s"
        yield "stale", f"{times(summary.stale)} {gap}; {option('sensor_timeout')} says how long it waits"
    if summary.resets:
        yield "clock", f"set back {times(summary.resets)}; the brake began anew there"
    for each in summary.odd:
        yield "odd", each
    if summary.lost:
        yield "lost", "a part of the log; the message on standard error says which"


def _when(row: Row) -> str:
    return f"{row.ttc:.3f} s in frame {row.frame} at {row.stamp:.3f} s"


@contextmanager
def show_progress() -> Iterator[Callable[[Progress], None]]:
    """Yield what shows on standard error how far many logs are: a bar, or a line a minute without a terminal."""
    console = Console(stderr=True, highlight=False)
    if not console.is_terminal:
        due = time.monotonic() + LINE_EACH

        def print_line(progress: Progress) -> None:
            nonlocal due
            if time.monotonic() >= due:
                due += LINE_EACH
                console.print(f"{time.strftime('%H:%M:%S')} {how_far(progress)}", soft_wrap=True)

        yield print_line
        return
    with Bars(BarColumn(), TextColumn("{task.description}"), console=console, transient=True) as bar:
        task = bar.add_task("", total=None)
        yield lambda progress: bar.update(
            task, total=progress.total, completed=progress.logs, description=how_far(progress)
        )


def how_far(progress: Progress) -> str:
    """Say how many logs and frames are done, how fast, how long it still takes, and how many logs failed.

    Examples
    --------
    >>> from ttc_fast.replay import Progress
    >>> from ttc_fast.replay.terminal import how_far
    >>> how_far(Progress(logs=30, total=90, skipped=0, frames=3870, failures=1, seconds=20.0))
    '30 of 90 logs, 3870 frames, 1.5 logs/s, 0:00:40 left, 1 failed'
    >>> how_far(Progress(logs=30, total=90, skipped=30, frames=0, failures=0, seconds=2.0))
    '30 of 90 logs, 0 frames, 0 logs/s, 30 done before'
    """
    said = [f"{progress.logs} of {progress.total} logs", frames_of(progress.frames), f"{progress.rate:.3g} logs/s"]
    if not math.isnan(progress.left):
        said.append(f"{timedelta(seconds=round(progress.left))} left")
    if progress.failures:
        said.append(f"{progress.failures} failed")
    if progress.skipped:
        said.append(f"{progress.skipped} done before")
    return ", ".join(said)


def print_summaries(summaries: list[Summary], console: Console) -> None:
    """Print a table of several logs, a line each."""
    table = _table(MANY)
    table.add_column("log", overflow="fold")
    for each in summaries:
        least = "-" if each.least is None else f"{each.least.ttc:.3f}"
        first = f"{each.events[0].begin.stamp:.2f}" if each.events else "-"
        brakes = f"{each.brakes}{' +1 start' if each.start else ''}"
        numbers = (str(each.frames), least, f"{each.exposed:.2f}", f"{each.integrated:.2f}", brakes, first)
        lost = Text(f"  {_fate(each)}" if each.lost else "", style="bold magenta")
        table.add_row(*numbers, str(each.invalid), str(each.stale), Text(each.path) + lost)
    console.print(table)
    for each in summaries:
        if each.assumed:
            line(console, "ASSUMED", f"{each.path}: {each.assumed}")
        for odd in each.odd:
            line(console, "odd", f"{each.path}: {odd}")
        if each.lost:
            line(console, _fate(each), each.lost)


def _fate(summary: Summary) -> str:
    """Return what became of a log with a problem: a part of it is lost, or it failed as a whole."""
    return "lost" if summary.frames else "failed"
