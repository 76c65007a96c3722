"""Many logs are replayed by an executor: processes of this machine, or a cluster that loses some of its own.

A log is one task. What a task finds out about its log, damage included, is its result, which is final. A task that
ends otherwise says nothing about the log: its worker was killed, the scheduler restarted, a bucket answered 503, a disk
was full. It is submitted again, ``ATTEMPTS`` times in all, and is then a result with a reason and an exit code. So
every log has one result, whatever happens. A task may even be done twice at the same time, where a scheduler takes a
worker for dead that is not: both write the same part, the second over the first.

At most ``WINDOW`` tasks are with the executor at a time, so that neither its memory nor the effort of a restart grow
with the number of logs.
"""

from __future__ import annotations

import gzip
import math
import time
import uuid
from collections import deque
from concurrent.futures import CancelledError
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, NamedTuple

from ttc_fast import __version__
from ttc_fast._exit_codes import DONE, FAILED, INTERRUPTED, UNREADABLE, USAGE
from ttc_fast._settings import ON_COMMAND_LINE
from ttc_fast._validate import shown
from ttc_fast.configuration import ConfigurationError
from ttc_fast.logs import LogError
from ttc_fast.logs.log import UselessOptionError
from ttc_fast.logs.storage import StorageError, absolute, found, located, remove, size_and_time, written_whole
from ttc_fast.replay.dataset import Dataset, digest_of
from ttc_fast.replay.executors import Processes, StartError, ThisProcess, adapted
from ttc_fast.replay.output import Files, OutputError, each_of, play, prepare_folder, report_on, through
from ttc_fast.replay.replayed import Made, Replayed, exit_code_of
from ttc_fast.replay.row import ParquetWriter
from ttc_fast.replay.run import Replay
from ttc_fast.replay.settings import Settings
from ttc_fast.replay.summary import Summary

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from concurrent.futures import Executor, Future
    from os import PathLike

    from ttc_fast.logs.storage import Location
    from ttc_fast.replay.row import Row

ATTEMPTS = 4
WINDOW = 10_000
TICK = 0.5
"""s after which progress is shown even if nothing was done."""


class Progress(NamedTuple):
    """How far ``replay_many`` is.

    Attributes
    ----------
    logs, total : int
        Number of logs that are done, and of all.
    skipped : int
        Number of logs that an earlier run had done.
    frames : int
        Number of frames that were replayed.
    failures : int
        Number of logs whose exit code is not 0.
    seconds : float
        The time since the beginning, s.
    """

    logs: int
    total: int
    skipped: int
    frames: int
    failures: int
    seconds: float

    @property
    def rate(self) -> float:
        """Logs that are replayed in a second."""
        return (self.logs - self.skipped) / self.seconds if self.seconds > 0.0 else 0.0

    @property
    def left(self) -> float:
        """How long the rest takes at this rate, s; NaN while there is none."""
        return (self.total - self.logs) / self.rate if self.rate > 0.0 else math.nan


@dataclass(frozen=True)
class Task:
    """One log, as it goes to a worker.

    Attributes
    ----------
    number : int
        The place of the log among all.
    attempt : int
        How often it was tried before.
    log : Location
        The log.
    files : Files
        What is written of it beside the part.
    settings : Settings
        The settings.
    dataset : Dataset or None
        Where the part goes.
    again : bool
        Whether it is replayed though it is done.
    on_command_line : bool
        Whether messages are for a user of the command line.
    version : str
        The version of ttc_fast that asks.
    """

    number: int
    log: Location
    files: Files
    settings: Settings
    dataset: Dataset | None
    again: bool
    on_command_line: bool
    attempt: int = 0
    version: str = __version__

    @property
    def name(self) -> str:
        """The log, by the name that the results have for it."""
        return str(self.log)


def replay_many(
    paths: str | PathLike[str] | Iterable[str | PathLike[str]],
    settings: Settings | None = None,
    *,
    files: Files | None = None,
    out: str | PathLike[str] | None = None,
    again: bool = False,
    executor: Executor | None = None,
    jobs: int | None = None,
    progress: Callable[[Progress], None] = lambda _: None,
) -> list[Replayed]:
    """Replay many logs, and lose none: each has a result, also where it cannot be read or its worker is killed.

    Parameters
    ----------
    paths : path, or iterable of path
        The logs. Each is a path, or a URL of fsspec (extra ``fleet``); ``*``, ``?`` and ``[`` match in both.
    settings : Settings, optional
        The settings of all logs. Several logs ignore the options that they have no use for (``ignore_useless``).
    files : Files, optional
        The files that are written: rows, pictures and recordings of each log, and a report of all.
    out : path, optional
        A folder or URL for the results as Parquet: ``rows/`` has a part for each log, ``logs.parquet`` a line for each
        (extra ``parquet``). A log that is given twice is replayed once. A log whose part is there already, made with
        the same version and settings when its size and time were the same, is not replayed again.
    again : bool
        Replay those as well.
    executor : concurrent.futures.Executor, optional
        What replays them, such as ``client.get_executor()`` of a Dask client; by default processes of this machine.
    jobs : int, optional
        How many processes of this machine there are; by default one for each core. An executor has its own number.
        One log, or any number with ``jobs=1``, is replayed in this process.
    progress : function, optional
        It is called with a ``Progress`` once in a while.

    Returns
    -------
    list of Replayed
        A result for each log, in the order of ``paths``.

    Raises
    ------
    LogError
        If nothing matches one of the paths.
    OutputError
        If ``out`` cannot be written.
    RuntimeError
        If no process of this machine can begin: they import the script that calls, so a script has to call from below
        ``if __name__ == "__main__":``.

    Examples
    --------
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> from ttc_fast.replay import replay_many, sample
    >>> with ThreadPoolExecutor(2) as executor:
    ...     results = replay_many([sample("scans"), sample("clouds")], executor=executor)
    >>> [(each.summary.frames, each.summary.brakes, each.exit_code) for each in results]
    [(129, 1, 0), (12, 1, 0)]
    """
    settings = Settings() if settings is None else settings
    files = Files() if files is None else files
    if not isinstance(files, Files):
        raise TypeError(f"files must be Files, such as Files(plot='drive.png'), got {shown(files)}")
    logs = found(paths)
    settings = replace(settings, ignore_useless=settings.ignore_useless or len(logs) > 1)
    if executor is not None:
        runs: Executor = adapted(executor)
    else:
        runs = ThisProcess() if len(logs) == 1 or jobs == 1 else Processes(jobs)
    apart = [None if each is None else located(each) for each in files[:-1]]
    if executor is not None or out is not None:  # workers may be in another folder, and a later run as well
        logs, apart = [absolute(each) for each in logs], [each and absolute(each) for each in apart]
    for each in apart:
        if isinstance(each, Path):
            prepare_folder(each.parent, each)
    dataset = None
    if out is not None:
        logs = list(dict.fromkeys(logs))
        dataset = Dataset(absolute(located(out)), uuid.uuid4().hex[:8])
        dataset.begin()
    of_each = map(Files, *(each_of(each, logs) for each in apart))
    typed = ON_COMMAND_LINE.get()
    tasks = [
        Task(number, log, each._replace(report=files.report), settings, dataset, again, typed)
        for number, (log, each) in enumerate(zip(logs, of_each, strict=True))
    ]
    run = _Run(tasks, runs, progress)
    done = False
    try:
        run.to_the_end()
        done = True
    finally:
        if runs is not executor:
            runs.shutdown(cancel_futures=not done)
        if dataset is not None:
            dataset.end(run.in_order())
    results = run.in_order()
    report_on(results, files.report)
    return results


class _Run:
    """The tasks of a call of ``replay_many``, and what came of them."""

    def __init__(self, tasks: list[Task], executor: Executor, progress: Callable[[Progress], None]) -> None:
        self._tasks, self._executor, self._show = tasks, executor, progress
        self._window = 1 if isinstance(executor, ThisProcess) else WINDOW
        self._waiting = deque(tasks)
        self._running: dict[Future[Replayed], Task] = {}
        self._finished: SimpleQueue[Future[Replayed]] = SimpleQueue()
        self._results: dict[int, Replayed] = {}
        self._began = time.monotonic()
        self._progress = Progress(0, len(tasks), 0, 0, 0, 0.0)

    def to_the_end(self) -> None:
        """Submit the tasks and take their results until there are none left."""
        try:
            while self._waiting or self._running:
                while self._waiting and len(self._running) < self._window:
                    self._submit(self._waiting.popleft())
                with suppress(Empty):
                    future = self._finished.get(timeout=TICK)
                    self._take(self._running.pop(future), future)
                self._show(self._progress._replace(seconds=time.monotonic() - self._began))
        finally:
            for future in self._running:
                future.cancel()

    def _submit(self, task: Task) -> None:
        try:
            future = self._executor.submit(replay_one, task)
        except Exception as error:  # the executor is gone; each has errors of its own
            self._fail(task, error)
            return
        self._running[future] = task
        future.add_done_callback(self._finished.put)

    def _take(self, task: Task, future: Future[Replayed]) -> None:
        try:
            self._have(task, future.result())
        except CancelledError:  # its scheduler is gone, which is no fault of the log; the executor says when to end
            self._waiting.append(task)
        except StartError as error:
            raise StartError(str(error)) from None
        except Exception as error:
            if task.attempt + 1 < ATTEMPTS:
                self._waiting.append(replace(task, attempt=task.attempt + 1))
            else:
                self._fail(task, error)

    def _fail(self, task: Task, error: BaseException) -> None:
        known = isinstance(error, (StorageError, OutputError))
        why = str(error) if known else f"{type(error).__name__}: {error}"
        said = f"{task.name}: failed {task.attempt + 1} times, at last by {why}" if task.attempt else why
        self._have(task, _without_rows(task, said, UNREADABLE if isinstance(error, StorageError) else FAILED))

    def _have(self, task: Task, result: Replayed) -> None:
        self._results[task.number] = result
        logs, total, skipped, frames, failures, seconds = self._progress
        frames += 0 if result.skipped else result.summary.frames
        self._progress = Progress(
            logs + 1, total, skipped + result.skipped, frames, failures + (result.exit_code != DONE), seconds
        )

    def in_order(self) -> list[Replayed]:
        """Return a result for each task; one that was not done was interrupted."""
        interrupted = "interrupted before it was done"
        return [
            self._results.get(each.number) or _without_rows(each, f"{each.name}: {interrupted}", INTERRUPTED)
            for each in self._tasks
        ]


# In the worker


def replay_one(task: Task) -> Replayed:
    """Replay a log. What its rows come to is returned; what says nothing about the log is raised."""
    if task.version != __version__:
        problem = f"the worker has ttc_fast {__version__}, and {task.version} asks: install the same one everywhere"
        return _without_rows(task, f"{task.name}: {problem}", FAILED)
    token = ON_COMMAND_LINE.set(task.on_command_line)
    try:
        return _into_files(task) if task.dataset is None else _into_part(task, task.dataset)
    finally:
        ON_COMMAND_LINE.reset(token)


def _into_files(task: Task) -> Replayed:
    replay = _opened(task, None)
    return replay if isinstance(replay, Replayed) else _played(task, replay, replay, None)


def _into_part(task: Task, dataset: Dataset) -> Replayed:
    """Replay a log into its part, unless that is there."""
    try:
        made = Made(*size_and_time(task.log), digest_of(task.settings))
    except FileNotFoundError:
        made = None
    if made is not None and (not task.again or task.attempt):  # a worker that was killed may have been done
        done = dataset.done(task.name, made)
        if done is not None:
            return done
    part = dataset.part(task.name)
    try:
        remove(part)
        replay = _opened(task, made)
        if isinstance(replay, Replayed) and replay.made is None:
            return replay
        with written_whole(part, dataset.unfinished) as file, ParquetWriter(file, task.name) as writer:
            if isinstance(replay, Replay):
                replay = _played(task, replay, through(replay, writer), made)
            dataset.note(writer, replay)
    except OSError as error:
        raise OutputError(f"cannot write {part}: {error.strerror or error}") from error
    return replay


def _opened(task: Task, made: Made | None) -> Replay | Replayed:
    """Open a log, or say why it cannot be."""
    try:
        return Replay(task.log, task.settings)
    except StorageError:
        raise
    except LogError as error:
        why = error.__cause__
        of_the_log = not isinstance(why, (ImportError, OSError)) or isinstance(why, gzip.BadGzipFile)
        of_the_log = of_the_log and not isinstance(error, UselessOptionError)
        return _without_rows(task, str(error), UNREADABLE, made if of_the_log else None)
    except ConfigurationError as error:
        return _without_rows(task, f"{task.name}: {task.settings.typed(error)}", USAGE)


def _played(task: Task, replay: Replay, rows: Iterable[Row], made: Made | None) -> Replayed:
    try:
        chapter = play(replay, rows, task.files)
    except ConfigurationError as error:
        return _without_rows(task, f"{task.name}: {error}", USAGE)
    summary = replay.summary
    if not summary.frames and not summary.lost:
        summary.lost = f"{task.name}: has no frames"
    return Replayed(task.name, summary, exit_code_of(summary), made, chapter=chapter)


def _without_rows(task: Task, problem: str, code: int, made: Made | None = None) -> Replayed:
    summary = Summary(task.name, 0.0, 0.0)
    summary.lost = problem
    return Replayed(task.name, summary, code, made)
