"""One log from its path to the rows and the picture of its replay."""

from __future__ import annotations

import errno
from typing import TYPE_CHECKING

from ttc_fast.cli.exits import FAILED, USAGE, CommandError
from ttc_fast.logs import LogError

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from ttc_fast.replay import Replay, Row, Settings


def spare_logs(paths: list[Path], outs: list[Path | None]) -> None:
    """Refuse to write rows over what is to be read."""
    for out in outs:
        if out is not None and out.exists() and any(path.exists() and out.samefile(path) for path in paths):
            raise CommandError(USAGE, f"{out}: is a log that is to be replayed; choose another --out")


def opened(path: Path, settings: Settings) -> Replay:
    """Open a log; settings that make no sense for it are the user's mistake."""
    from ttc_fast.configuration import ConfigurationError
    from ttc_fast.replay import Replay

    try:
        return Replay(path, settings)
    except ConfigurationError as error:
        raise CommandError(USAGE, f"{path}: {error}") from error


def play(played: Replay, rows: Iterable[Row], out: Path | None, plot: Path | None) -> None:
    """Replay to the end; what is lost on the way is in the summary."""
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
    """Make a folder and those that it is in; of a file on the way, say that it is one."""
    for each in (folder, *folder.parents):
        if each.exists():
            if not each.is_dir():
                raise NotADirectoryError(errno.ENOTDIR, f"{each} is not a folder")
            break
    folder.mkdir(parents=True, exist_ok=True)


def _write(played: Replay, rows: Iterable[Row], out: Path | None) -> None:
    from ttc_fast.configuration import ConfigurationError
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
        pass  # the summary tells
    except ConfigurationError as error:
        raise CommandError(USAGE, f"{played.log.path}: {error}") from error
