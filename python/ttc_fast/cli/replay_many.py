"""``ttc-fast replay`` of several logs: on all cores, and a table of what each came to."""

from __future__ import annotations

import multiprocessing
import os
import signal
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import TYPE_CHECKING

from ttc_fast.cli.exits import FAILED, PARTIAL, UNREADABLE, CommandError
from ttc_fast.cli.replay_log import opened, play, spare_logs
from ttc_fast.logs import LogError

if TYPE_CHECKING:
    from pathlib import Path

    from ttc_fast.replay import Settings, Summary


def run_many(paths: list[Path], settings: Settings, out: Path | None, plot: Path | None, jobs: int | None) -> None:
    """Replay the logs, and print a line for each."""
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
    with progress, ProcessPoolExecutor(jobs, mp_context=context, initializer=_quiet) as pool:
        each = pool.map(_one_of_many, paths, [settings] * len(paths), outs, plots)
        try:
            return list(progress.track(each, total=len(paths), description=f"{len(paths)} logs"))
        except BaseException as error:
            pool.shutdown(wait=False, cancel_futures=True)
            for process in multiprocessing.active_children():
                process.terminate()  # the rest of a long log is not waited for
            if isinstance(error, BrokenProcessPool):
                problem = "a process was killed, perhaps because memory ran out; try fewer of them with --jobs"
                raise CommandError(FAILED, problem) from error
            raise


def _quiet() -> None:
    """Let a process end without a word when the terminal interrupts it."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def _one_of_many(path: Path, settings: Settings, out: Path | None, plot: Path | None) -> Summary:
    """Replay one log, in a process of its own; what is wrong with it is no reason to leave the others."""
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
    """Name a file for each log: the name of the log is put behind the name that was given."""
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
