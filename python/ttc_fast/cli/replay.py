"""``ttc-fast replay``: recorded logs in, tables and pictures out, by the code that brakes.

One log is replayed in this process, and printed. Several logs are replayed in processes of their own, and end in a
table with a line each.
"""

from __future__ import annotations

import errno
import multiprocessing
import os
import signal
import threading
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

from ttc_fast._settings import ON_COMMAND_LINE
from ttc_fast.cli import options
from ttc_fast.cli.exits import FAILED, PARTIAL, UNREADABLE, USAGE, CommandError
from ttc_fast.configuration import ConfigurationError
from ttc_fast.logs import FORMATS, LogError

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterable, Iterator

    from rich.console import Console

    from ttc_fast.replay import Replay, Row, Settings, Summary

SUMMARY = "replay logs through the brake: when would it have braked, and why"
USAGE_LINE = "ttc-fast replay [OPTION ...] PATH [PATH ...]"
DESCRIPTION = f"""\
Replay recorded logs, frame by frame, through the code that brakes on the vehicle: when would it have braked, and why?

{fill(f"PATH is {FORMATS}.", 118)}
Several paths are replayed on all cores at once, and end in a table with a line each.

The brake assesses scans: what their beams or, with an outline, the path of the vehicle run into. Where a log has no
speed, the change of the ranges gives the closing speeds. Clouds and tables of distances go through a tracker, and the
brake evaluates its estimates.

  ttc-fast replay drive.bag --outline -0.1 0.4 -0.15 0.15 --plot drive.png
  ttc-fast replay drive.mcap --topic /scan --criterion IttcThreshold:threshold=0.7 --out rows.csv
  ttc-fast replay velodyne/ --speed 8 --gate-x 2 40 --out rows.parquet
  ttc-fast replay logs/*.bag --config car.toml --out rows.csv
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("paths", nargs="+", type=Path, metavar="PATH", help="A log to replay.")
    options.add(parser)
    out = parser.add_argument_group("what comes out")
    out.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="Write a row for each frame as .csv, .jsonl or .parquet. Each of several logs has a file of its own, with "
        "the name of the log behind that of FILE.",
    )
    out.add_argument(
        "--plot", type=Path, metavar="FILE", help="Draw a picture, .png or .svg; of several logs one each."
    )
    options.add_rows(out)
    out.add_argument(
        "--jobs", type=options.positive_count, metavar="N", help="Replay in at most N processes (default: all cores)."
    )


def run(arguments: argparse.Namespace) -> None:
    """Replay one log or several."""
    settings = options.settings(arguments)
    _check_outputs(arguments.out, arguments.plot)
    if len(arguments.paths) > 1:
        run_many(arguments.paths, settings, arguments.out, arguments.plot, arguments.jobs)
        return
    from ttc_fast.replay.terminal import open_console

    spare_logs(arguments.paths, [arguments.out])
    played = show(arguments.paths[0], settings, open_console(), arguments.rows, arguments.out, arguments.plot)
    check(played)


def show(path: Path, settings: Settings, console: Console, rows: int, out: Path | None, plot: Path | None) -> Replay:
    """Replay one log: write its rows, draw it, and print rows and summary."""
    from ttc_fast.replay.terminal import print_rows, print_summary, show_live

    played = opened(path, settings)
    play(played, show_live(played, console), out, plot)
    print_rows(played, console, rows)
    print_summary(played, console)
    return played


def check(played: Replay) -> None:
    """Raise if a part of a log was lost, or it has no frames."""
    if played.summary.lost:
        raise CommandError(PARTIAL if played.summary.frames else UNREADABLE, played.summary.lost)
    if not played.summary.frames:
        raise CommandError(UNREADABLE, f"{played.log.path}: has no frames")


def _check_outputs(out: Path | None, plot: Path | None) -> None:
    """Raise if a name says no format, or a package that it needs is missing."""
    from ttc_fast.replay.row import WRITERS

    if out is not None:
        suffix = out.suffix.lower()
        if suffix not in WRITERS:
            raise CommandError(USAGE, f"--out must end in {', '.join(WRITERS)}, got {out}")
        if suffix == ".parquet":
            import pyarrow  # noqa: F401
    if plot is not None:
        if plot.suffix.lower() not in (".png", ".svg"):
            raise CommandError(USAGE, f"--plot must end in .png or .svg, got {plot}")
        import matplotlib  # noqa: F401


def spare_logs(paths: list[Path], outs: list[Path | None]) -> None:
    """Raise if rows would be written over a log that is to be read."""
    for out in outs:
        if out is not None and out.exists() and any(path.exists() and out.samefile(path) for path in paths):
            raise CommandError(USAGE, f"{out}: is a log that is to be replayed; choose another --out")


def opened(path: Path, settings: Settings) -> Replay:
    """Open a log. Settings that make no sense for it are a mistake of usage."""
    from ttc_fast.replay import Replay

    try:
        return Replay(path, settings)
    except ConfigurationError as error:
        raise CommandError(USAGE, f"{path}: {settings.typed(error)}") from error


def play(played: Replay, rows: Iterable[Row], out: Path | None, plot: Path | None) -> None:
    """Replay to the end, write and draw. The summary says what was lost on the way."""
    try:
        _write(played, rows, out)
    except OSError as error:
        raise CommandError(FAILED, f"cannot write {out}: {error.strerror or error}; choose another --out") from error
    if plot is not None and played.summary.frames:
        from ttc_fast.replay.picture import save

        try:
            make_folder(plot.parent)
            save(played, plot)
        except OSError as error:
            problem = f"cannot write {plot}: {error.strerror or error}; choose another place"
            raise CommandError(FAILED, problem) from error


def make_folder(folder: Path) -> None:
    """Make a folder and those that it is in, or raise if one of them is a file."""
    for each in (folder, *folder.parents):
        if each.exists():
            if not each.is_dir():
                raise NotADirectoryError(errno.ENOTDIR, f"{each} is not a folder")
            break
    folder.mkdir(parents=True, exist_ok=True)


def _write(played: Replay, rows: Iterable[Row], out: Path | None) -> None:
    from ttc_fast.replay.row import WRITERS

    try:
        if out is None:
            for _ in rows:
                pass
            return
        make_folder(out.parent)
        with WRITERS[out.suffix.lower()](out) as writer:
            for row in rows:
                writer.write(row)
    except LogError:
        pass  # the summary says it
    except ConfigurationError as error:
        raise CommandError(USAGE, f"{played.log.path}: {error}") from error


def run_many(paths: list[Path], settings: Settings, out: Path | None, plot: Path | None, jobs: int | None) -> None:
    """Replay several logs, and print a line for each."""
    from ttc_fast.replay.terminal import open_console, print_summaries

    outs, plots = each_of(out, paths), each_of(plot, paths)
    spare_logs(paths, outs)
    jobs = min(jobs or os.cpu_count() or 1, len(paths))
    summaries = _replay_all(paths, settings, outs, plots, jobs)
    print_summaries(summaries, open_console())
    damaged = [summary for summary in summaries if summary.lost]
    if damaged:
        nothing = not any(summary.frames for summary in summaries)
        problem = f"of {len(paths)} logs {len(damaged)} could not be read whole"
        raise CommandError(UNREADABLE if nothing else PARTIAL, problem)


def _replay_all(
    paths: list[Path], settings: Settings, outs: list[Path | None], plots: list[Path | None], jobs: int
) -> list[Summary]:
    from rich.console import Console
    from rich.progress import Progress

    stderr = Console(stderr=True)
    progress = Progress(console=stderr, transient=True, disable=not stderr.is_terminal)
    context = multiprocessing.get_context("spawn")
    with progress, ProcessPoolExecutor(jobs, mp_context=context, initializer=_begin_process) as pool:
        try:
            with _interrupts_held():
                each = pool.map(_one_of_many, paths, [settings] * len(paths), outs, plots)
            return list(progress.track(each, total=len(paths), description=f"{len(paths)} logs"))
        except BaseException as error:
            pool.shutdown(wait=False, cancel_futures=True)
            for process in multiprocessing.active_children():
                process.terminate()  # the rest of a long log is not waited for
            if isinstance(error, BrokenProcessPool):
                problem = "a process was killed, perhaps because memory ran out; try fewer of them with --jobs"
                raise CommandError(FAILED, problem) from error
            raise


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Hold interrupts back, here and in the processes that begin meanwhile: Python would print where it was."""
    if not hasattr(signal, "pthread_sigmask") or threading.current_thread() is not threading.main_thread():
        yield  # on Windows
        return
    held: list[int] = []
    handler = signal.signal(signal.SIGINT, lambda number, _: held.append(number))  # by another thread it comes anyway
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # which a process that begins inherits
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        signal.signal(signal.SIGINT, handler)
        if held:
            raise KeyboardInterrupt


def _begin_process() -> None:
    """Let this process end without a message when the terminal interrupts it, or has already; and word messages."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    ON_COMMAND_LINE.set(True)


def _one_of_many(path: Path, settings: Settings, out: Path | None, plot: Path | None) -> Summary:
    """Replay one log in a process of its own. A log that cannot be read does not stop the others."""
    from ttc_fast.replay import Summary

    try:
        played = opened(path, settings)
        play(played, played, out, plot)
    except (LogError, CommandError) as error:
        if isinstance(error, CommandError) and error.code == FAILED:
            raise  # what cannot be written for one log cannot be written for the others
        summary = Summary(str(path), 0.0, 0.0)
        summary.lost = str(error)
        return summary
    if not played.summary.frames and not played.summary.lost:
        played.summary.lost = f"{path}: has no frames"
    return played.summary


def each_of(file: Path | None, paths: list[Path]) -> list[Path | None]:
    """Return a file for each log: its name has that of the log behind the name that was given."""
    if file is None:
        return [None] * len(paths)
    named: list[Path | None] = []
    for path in paths:
        stem = f"{file.stem}-{path.resolve().name}"
        name, number = file.with_name(stem + file.suffix), 2
        while name in named:
            name, number = file.with_name(f"{stem}-{number}{file.suffix}"), number + 1
        named.append(name)
    return named
