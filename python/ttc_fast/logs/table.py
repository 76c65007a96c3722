"""Tables of distances (.csv): a column of stamps and a column of distances."""

from __future__ import annotations

import csv
import math
from typing import TYPE_CHECKING

from ttc_fast.logs.log import DistanceFrame, LogError, ReadErrors

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from ttc_fast.logs.options import LogOptions

OPTIONS = ("column", "stamp_column", "rate", "speed")
DAMAGED = (csv.Error, UnicodeDecodeError)


class DistanceTable:
    """A table of distances, one a line, with a line of names above.

    The columns ``stamp`` (s) and ``distance`` (m), or those that the user names. An empty distance is NaN: nothing was
    measured then.

    Parameters
    ----------
    path : Path
        Of the file.
    options : LogOptions
        What the user says of it.

    Raises
    ------
    LogError
        If it cannot be read or lacks a column. While iterating, after the last frame, if lines were no numbers.
    """

    frame_count = None
    assumed = ""

    def __init__(self, path: Path, options: LogOptions) -> None:
        options.only(OPTIONS, path, "a table of distances")
        self.path = path
        self.column = options.column or "distance"
        self._stamp_column = None if options.rate else options.stamp_column or "stamp"
        self._rate = options.rate
        self._speed = options.speed
        self.clock = f"column {self._stamp_column}" if self._stamp_column else f"{options.rate:g} frames a second"
        header = next(self._lines(ReadErrors(path)), (0, []))[1]
        fixes = {self.column: "option column", self._stamp_column: "option stamp_column, or say the rate"}
        for name, fix in fixes.items():
            if name is not None and name not in header:
                has = ", ".join(header[:20]) or "no names"
                raise LogError(path, f"has no column {name!r}; its first line has {has}: choose with the {fix}")
        self._columns = [header.index(name) for name in fixes if name is not None]

    def __iter__(self) -> Iterator[DistanceFrame]:
        errors, frames, before = ReadErrors(self.path), 0, -math.inf
        lines = self._lines(errors)
        next(lines, None)
        for number, words in lines:
            try:
                distance, *stamps = (_number(words[column]) for column in self._columns)
            except (ValueError, IndexError) as error:
                errors.add(f"line {number}: {error}")
                continue
            stamp = stamps[0] if stamps else frames / (self._rate or 1.0)
            if not before < stamp < math.inf:
                errors.add(f"line {number}: stamps must increase, got {stamp} after {before}")
                continue
            before = stamp
            frames += 1
            yield DistanceFrame(stamp, distance, self._speed)
        errors.raise_if_any(frames)

    def _lines(self, errors: ReadErrors) -> Iterator[tuple[int, list[str]]]:
        number = 0
        try:
            with self.path.open(encoding="utf-8-sig", newline="") as file:
                for number, words in enumerate(csv.reader(file), 1):
                    if words:
                        yield number, [word.strip() for word in words]
        except DAMAGED as error:
            errors.add(f"damaged after line {number}: {error}; what follows is lost")
        except OSError as error:
            raise LogError(self.path, f"cannot be read: {error.strerror or error}") from error


def _number(word: str) -> float:
    return float(word) if word else math.nan
