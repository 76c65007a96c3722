"""Logs opened as what they hold, and damaged logs read as far as they go."""

from pathlib import Path
from typing import Any

from ttc_fast.logs import CloudLog, LogError, ScanLog, open_log


def open_scans(path: Path, **options: Any) -> ScanLog:
    log = open_log(path, **options)
    assert isinstance(log, ScanLog)
    return log


def open_clouds(path: Path, **options: Any) -> CloudLog:
    log = open_log(path, **options)
    assert isinstance(log, CloudLog)
    return log


def read(path: Path, **options: Any) -> tuple[list[Any], str]:
    """Read what there is, holding on to what came before an error."""
    frames: list[Any] = []
    try:
        for frame in open_log(path, **options):
            frames.append(frame)
    except LogError as error:
        return frames, str(error)
    return frames, ""
