"""Stamps in a text file beside the frames, as the raw data of KITTI have them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ttc_fast.logs.log import LogError

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

STAMPS = "timestamps.txt"


def read_stamps(path: Path, frames: list[Path]) -> NDArray[np.float64]:
    """Read the stamps of the frames, one line each, s since the first of them.

    A file that covers the whole drive may have more lines than there are frames here: then the number in a frame's name
    says which line is its own.
    """
    try:
        lines = path.read_text(encoding="ascii").rstrip().split("\n")
        if len(lines) != len(frames):
            lines = _lines_by_number(path, lines, frames)
        stamps = np.array([np.datetime64(line.strip(), "ns") for line in lines])
    except OSError as error:
        raise LogError(path, f"cannot be read: {error.strerror or error}") from error
    except ValueError as error:
        raise LogError(path, f"must have lines like 2011-09-26 13:02:25.951199337, one a frame: {error}") from error
    seconds: NDArray[np.float64] = (stamps - stamps[0]) / np.timedelta64(1, "s")
    wrong = np.flatnonzero(~(np.diff(seconds) > 0.0))
    if len(wrong):
        before, after = frames[wrong[0]].name, frames[wrong[0] + 1].name
        raise LogError(path, f"stamps must increase, but that of {after} does not follow that of {before}")
    return seconds


def _lines_by_number(path: Path, lines: list[str], frames: list[Path]) -> list[str]:
    numbers = [frame.name.partition(".")[0] for frame in frames]
    if not all(number.isdecimal() and int(number) < len(lines) for number in numbers):
        problem = f"has {len(lines)} stamps for {len(frames)} frames, and the names do not say which is whose"
        raise LogError(path, f"{problem}; take it away, or give it one line a frame")
    return [lines[int(number)] for number in numbers]
