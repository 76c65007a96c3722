"""Tables of distances (.csv, .tsv): a column of stamps and a column of distances, with a line of names above.

Spreadsheets write tables in their own ways. The text is UTF-8, UTF-16 or Windows-1252; the columns are parted by
commas, semicolons or tabs, as the line of names has them; and where it is not the comma that parts them, a decimal
comma is read as a point. A stamp is a number of seconds, a date and a time of day, or a time since 1970 in ms, us or
ns, which has 13, 16 or 19 digits.
"""

from __future__ import annotations

import csv
import itertools
import math
from typing import TYPE_CHECKING

from ttc_fast.logs.files import kind_of_file, open_text
from ttc_fast.logs.log import DistanceFrame, LogError, ReadErrors
from ttc_fast.logs.stamps import stamp_in

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from ttc_fast.logs.options import LogOptions

OPTIONS = ("column", "stamp_column", "rate", "speed")
DELIMITERS = "\t;,"
LONGEST_LINE = 1 << 20  # characters


class DistanceTable:
    """A table of distances, one a line.

    The columns ``stamp`` (s) and ``distance`` (m), or those that the user names. An empty distance is NaN: nothing was
    measured then.

    Parameters
    ----------
    path : Path
        The file.
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
        other = kind_of_file(path)
        if other:
            raise LogError(path, f"is no table, but {other}")
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
                distance = _number(words[self._columns[0]])
                stamps = [_time(words[column]) for column in self._columns[1:]]
            except ValueError:
                errors.add(f"line {number}: it has a word that is no number")
                continue
            except IndexError:
                errors.add(f"line {number}: it has {len(words)} columns, too few")
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
        """Read the lines that are not empty, as words; the first of them are the names."""
        number = begin = 1
        named = False
        try:
            with open_text(self.path) as file:
                lines = iter(lambda: file.readline(LONGEST_LINE), "")
                first = next(lines, "")
                if first.lower().startswith("sep="):  # says the delimiter to Excel
                    delimiter, begin = first[4:5].strip("\r\n") or ",", 2
                else:
                    delimiter = max(DELIMITERS, key=first.count)
                    lines = itertools.chain([first], lines)
                for number, words in enumerate(csv.reader(lines, delimiter=delimiter), begin):
                    words = [word.strip() for word in words]
                    if not any(words):
                        continue
                    if named and delimiter != ",":
                        words = [word.replace(",", ".") for word in words]
                    yield number, words
                    named = True
        except csv.Error:
            errors.add(f"damaged after line {number}: it is no table there; what follows is lost")
        except OSError as error:
            raise LogError(self.path, f"cannot be read: {error.strerror or error}") from error


def _number(word: str) -> float:
    return float(word) if word else math.nan


def _time(word: str) -> float:
    stamp = stamp_in(word)
    return _number(word) if stamp is None else stamp / 1e9
