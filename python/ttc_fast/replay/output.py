"""What comes out of the replay of a log: a file of rows, a picture, and recordings to scrub through."""

from __future__ import annotations

import errno
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ttc_fast.logs import LogError
from ttc_fast.logs.storage import Location, join, located, name_in, remove, written_whole
from ttc_fast.replay.row import WRITERS

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from os import PathLike

    from ttc_fast.replay.replayed import Chapter, Replayed
    from ttc_fast.replay.row import Row, Writer
    from ttc_fast.replay.run import Replay

PICTURES = (".png", ".svg")


class OutputError(Exception):
    """Something cannot be written: what, why, and what to do."""


def suffix_of(place: str | PathLike[str]) -> str:
    """Return the ending of a name, in lower case."""
    return Path(name_in(located(place))).suffix.lower()


class Files(NamedTuple):
    """The files that are written of one log or of many, each a path or a URL; None is not written.

    Of several logs, each has a file of its own, with the name of the log behind the name that is given; only the report
    is one for all.

    Attributes
    ----------
    rows : path or None
        The file of rows: .csv, .jsonl or .parquet.
    plot : path or None
        The picture: .png or .svg. A log that is left out gets none.
    rerun : path or None
        The recording for Rerun: .rrd (extra ``rerun``).
    mcap : path or None
        The recording for Foxglove: .mcap (extra ``foxglove``).
    report : path or None
        The report of all logs: .html (extra ``report``). It holds in memory what it shows, some 100 kB a log.

    Examples
    --------
    >>> from ttc_fast.replay import Files
    >>> Files(rows="rows.csv", report="report.html").plot is None
    True
    """

    rows: str | PathLike[str] | None = None
    plot: str | PathLike[str] | None = None
    rerun: str | PathLike[str] | None = None
    mcap: str | PathLike[str] | None = None
    report: str | PathLike[str] | None = None


def play(replay: Replay, rows: Iterable[Row], files: Files) -> Chapter | None:
    """Replay to the end, and write what is asked for. The summary says what was lost on the way.

    Parameters
    ----------
    replay : Replay
        The replay.
    rows : iterable of Row
        Its rows, or what passes them on.
    files : Files
        What is to be written.

    Returns
    -------
    Chapter or None
        What a report shows of the log, where one is to be written and there are frames.

    Raises
    ------
    OutputError
        If something cannot be written.
    ConfigurationError
        If a setting makes no sense for the log.
    """
    pictures = None
    with ExitStack() as stack:
        if files.report is not None:
            from ttc_fast.replay.report import Pictures

            pictures = Pictures(replay)
            rows = pictures.through(rows)
        if files.rerun is not None:
            from ttc_fast.replay.scrub import recorded

            rows = recorded(replay, rows, stack.enter_context(writing(files.rerun, "choose another place")))
        if files.mcap is not None:
            from ttc_fast.replay import foxglove

            file = stack.enter_context(writing(files.mcap, "choose another place", whole=True))
            rows = foxglove.recorded(replay, rows, file)
        if files.rows is not None:
            file = stack.enter_context(writing(files.rows, "choose another --out"))
            rows = through(rows, stack.enter_context(WRITERS[suffix_of(files.rows)](file)))
        with suppress(LogError):  # the summary says it
            for _ in rows:
                pass
    if not replay.summary.frames:  # a recording of nothing is none
        for path in (files.rerun, files.mcap):
            if path is not None:
                remove(located(path))
    if files.plot is not None and replay.summary.frames:
        from ttc_fast.replay.picture import save

        with writing(files.plot, "choose another place") as file:
            save(replay, file)
    return None if pictures is None else pictures.chapter()


def report_on(results: Sequence[Replayed], place: str | PathLike[str] | None) -> None:
    """Write the report of some logs, if one is to be written."""
    if place is not None:
        from ttc_fast.replay.report import write_report

        with writing(place, "choose another --report", whole=True) as file:
            write_report(results, file)


def through(rows: Iterable[Row], writer: Writer) -> Iterator[Row]:
    """Pass rows on, and write each."""
    for row in rows:
        writer.write(row)
        yield row


@contextmanager
def writing(path: str | PathLike[str], how: str, *, whole: bool = False) -> Iterator[Path]:
    """Yield the path to write to. What goes to a URL is there when it is whole, as anything is with ``whole``."""
    place = located(path)
    folder = place.parent if isinstance(place, Path) else place.rpartition("/")[0]
    try:
        if isinstance(folder, Path):
            make_folder(folder)
        if isinstance(place, Path) and not whole:
            yield place
            return
        unfinished = join(folder, ".unfinished")
        try:
            with written_whole(place, unfinished) as file:
                yield file
        finally:
            if isinstance(unfinished, Path):
                with suppress(OSError):  # another run has files there
                    unfinished.rmdir()
    except OSError as error:
        raise OutputError(f"cannot write {place}: {error.strerror or error}; {how}") from error


def make_folder(folder: Path) -> None:
    """Make a folder and those that it is in, or raise if one of them is a file."""
    for each in (folder, *folder.parents):
        if each.exists():
            if not each.is_dir():
                raise NotADirectoryError(errno.ENOTDIR, f"{each} is not a folder")
            break
    folder.mkdir(parents=True, exist_ok=True)


def prepare_folder(folder: Path, place: Path) -> None:
    """Make the folder that something is to be written into, before anything is replayed."""
    try:
        make_folder(folder)
    except OSError as error:
        raise OutputError(f"cannot write {place}: {error.strerror or error}; choose another --out") from error


def each_of(path: str | PathLike[str] | None, logs: Sequence[Location]) -> list[Location | None]:
    """Return a file for each log: its name has that of the log behind the name that was given."""
    if path is None:
        return [None] * len(logs)
    file = located(path)
    given = Path(name_in(file)) if isinstance(file, str) else file
    named: dict[str, None] = {}
    for log in logs:
        stem = f"{given.stem}-{name_in(log)}"
        name, number = f"{stem}{given.suffix}", 2
        while name in named:
            name, number = f"{stem}-{number}{given.suffix}", number + 1
        named[name] = None
    folder = file.rpartition("/")[0] if isinstance(file, str) else file.parent
    return [join(folder, name) for name in named]
