"""What comes out of the replay of a log: a file of rows, and a picture."""

from __future__ import annotations

import errno
from pathlib import Path
from typing import TYPE_CHECKING

from ttc_fast.logs import LogError
from ttc_fast.logs.storage import Location, is_url, join, name_in, written_whole
from ttc_fast.replay.row import WRITERS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from ttc_fast.replay.row import Row, Writer
    from ttc_fast.replay.run import Replay

PICTURES = (".png", ".svg")


class OutputError(Exception):
    """Something cannot be written: what, why, and what to do."""


def suffix_of(place: Location) -> str:
    """Return the ending of a name, in lower case."""
    return Path(name_in(place)).suffix.lower()


def play(replay: Replay, rows: Iterable[Row], out: Location | None, plot: Location | None) -> None:
    """Replay to the end, write rows and draw. The summary says what was lost on the way.

    Parameters
    ----------
    replay : Replay
        The replay.
    rows : iterable of Row
        Its rows, or what passes them on.
    out : Location or None
        The file of rows.
    plot : Location or None
        The picture.

    Raises
    ------
    OutputError
        If something cannot be written.
    ConfigurationError
        If a setting makes no sense for the log.
    """
    if out is None:
        read_to_the_end(rows)
    else:
        _into(out, "choose another --out", lambda file: _write(rows, WRITERS[suffix_of(out)](file)))
    if plot is not None and replay.summary.frames:
        from ttc_fast.replay.picture import save

        _into(plot, "choose another place", lambda file: save(replay, file))


def _into(place: Location, how: str, write: Callable[[Path], None]) -> None:
    """Let a function write a file; what goes to a URL is written whole or not at all."""
    try:
        if isinstance(place, Path):
            make_folder(place.parent)
            write(place)
        else:
            with written_whole(place, join(place.rpartition("/")[0], ".unfinished")) as file:
                write(file)
    except OSError as error:
        raise OutputError(f"cannot write {place}: {error.strerror or error}; {how}") from error


def read_to_the_end(rows: Iterable[Row], take: Callable[[Row], None] = lambda _: None) -> None:
    """Read rows to the end. What of the log was lost stands in the summary."""
    try:
        for row in rows:
            take(row)
    except LogError:
        pass  # the summary says it


def _write(rows: Iterable[Row], writer: Writer) -> None:
    with writer:
        read_to_the_end(rows, writer.write)


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


def each_of(file: Location | None, logs: Sequence[Location]) -> list[Location | None]:
    """Return a file for each log: its name has that of the log behind the name that was given."""
    if file is None:
        return [None] * len(logs)
    given = Path(name_in(file)) if is_url(file) else Path(file)
    named: dict[str, None] = {}
    for log in logs:
        stem = f"{given.stem}-{name_in(log)}"
        name, number = f"{stem}{given.suffix}", 2
        while name in named:
            name, number = f"{stem}-{number}{given.suffix}", number + 1
        named[name] = None
    folder = file.rpartition("/")[0] if isinstance(file, str) else file.parent
    return [join(folder, name) for name in named]
