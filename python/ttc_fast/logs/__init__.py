"""Recorded logs, read by one small interface: ``open_log(path)`` gives a ``ScanLog``, whatever the format."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ttc_fast.logs.log import LogError, ScanFrame, ScanLog, Scanner
from ttc_fast.logs.npz import NpzLog

if TYPE_CHECKING:
    from collections.abc import Callable
    from os import PathLike

__all__ = ["FORMATS", "LogError", "NpzLog", "ScanFrame", "ScanLog", "Scanner", "open_log"]

FORMATS: dict[str, Callable[[Path], ScanLog]] = {".npz": NpzLog}
"""Readers by the end of the file's name."""


def open_log(path: str | PathLike[str]) -> ScanLog:
    """Open a log with the reader that the end of its name asks for.

    Parameters
    ----------
    path : path
        Of the log.

    Returns
    -------
    ScanLog

    Raises
    ------
    LogError
        If no reader knows the name, or the file cannot be read as what its name says.

    Examples
    --------
    >>> import pathlib, ttc_fast
    >>> from ttc_fast.logs import open_log
    >>> log = open_log(pathlib.Path(ttc_fast.__file__).parent / "samples" / "approach.npz")
    >>> log.frame_count, log.scanner.beams, next(iter(log)).ranges.dtype.name
    (129, 541, 'float32')
    """
    path = Path(path)
    for suffix, reader in FORMATS.items():
        if path.name.lower().endswith(suffix):
            return reader(path)
    raise LogError(path, f"no reader for this kind of file; can read {', '.join(FORMATS)}")
