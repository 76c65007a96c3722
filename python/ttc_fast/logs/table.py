"""Tables of distances (.csv, .tsv): a column of stamps and a column of distances, with a line of names above.

Spreadsheets write tables in their own ways. The text is UTF-8, UTF-16 or Windows-1252; the columns are parted by
commas, semicolons or tabs, as the line of names has them; and where it is not the comma that parts them, a decimal
comma is read as a point.

A column may say its unit in its name: ``distance_cm``, ``gap [mm]``, ``time (ms)``. Its numbers are in that unit,
however many digits they have. Without a unit a distance is in m, and a stamp is a number of seconds, a date and a time
of day, or a time since 1970 in ms, us or ns, which has 13, 16 or 19 digits. Numbers that are hardly in these units are
read all the same, and ``assumed`` says so.
"""

from __future__ import annotations

import contextlib
import csv
import itertools
import math
import re
from statistics import median
from typing import TYPE_CHECKING

from ttc_fast._settings import option
from ttc_fast.logs.files import kind_of_file, open_text, plain_number
from ttc_fast.logs.log import DistanceFrame, LogError, ReadErrors
from ttc_fast.logs.stamps import stamp_in
from ttc_fast.sensors.scans import FAR

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from ttc_fast.logs.options import LogOptions

OPTIONS = ("column", "stamp_column", "rate", "speed")
DELIMITERS = "\t;,"
LONGEST_LINE = 1 << 20  # characters
METRES = {"mm": 1e-3, "cm": 1e-2, "dm": 0.1, "m": 1.0, "km": 1e3, "ft": 0.3048, "feet": 0.3048, "inch": 0.0254}
SECONDS = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1.0, "sec": 1.0}
UNIT = re.compile(r"(?:[\s_.]+|(?=[\[(]))[\[(]?([a-z]+)[\])]?$|(?<=[a-z])([A-Z][a-z]+)$")
"""The unit at the end of a name, behind a blank, in brackets, or as in distanceCm."""
LIKELY = {"distance": ("dist", "range", "gap", "abstand"), "stamp": ("stamp", "time", "zeit", "sec")}
"""Parts of the names that people give to a column."""
SURVEYED = 200  # lines
SHORT, LONG = 5e-4, 5.0  # s between two stamps: no sensor is so fast or so slow
MOST_OFTEN = 2e-3  # s between two stamps of most sensors, at least


class DistanceTable:
    """A table of distances, one a line.

    The columns ``stamp`` (s) and ``distance`` (m), or those that the user names, in the units that their names end
    with. An empty distance is NaN: nothing was measured then.

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

    def __init__(self, path: Path, options: LogOptions) -> None:
        options.only(OPTIONS, path, "a table of distances")
        self.path = path
        self.column = options.column or "distance"
        self._stamp_column = None if options.rate else options.stamp_column or "stamp"
        self._rate = options.rate
        self._speed = options.speed
        self.unit = _unit(self.column, METRES) or "m"
        self._factor = METRES[self.unit]
        self._time_unit = _unit(self._stamp_column or "", SECONDS)
        by = f"column {self._stamp_column}, in {self._time_unit or 's'}"
        self.clock = by if self._stamp_column else f"{options.rate:g} frames a second"
        header = next(self._lines(ReadErrors(path)), (0, []))[1]
        other = kind_of_file(path)
        if other:
            raise LogError(path, f"is no table, but {other}")
        wanted = {"distance": self.column} | ({"stamp": self._stamp_column} if self._stamp_column else {})
        if not set(wanted.values()) <= set(header):
            raise LogError(path, _missing(wanted, header))
        self._columns = [header.index(name) for name in wanted.values()]
        self.assumed = self._survey()

    def __iter__(self) -> Iterator[DistanceFrame]:
        return self._read(self._time_unit)

    def _read(self, time_unit: str) -> Iterator[DistanceFrame]:
        """Read the frames, with stamps in this unit, or in one by the number of their digits where it is empty."""
        errors, frames, before = ReadErrors(self.path), 0, -math.inf
        lines = self._lines(errors)
        next(lines, None)
        for number, words in lines:
            try:
                distance = _number(words[self._columns[0]]) * self._factor
                stamps = [_time(words[column], time_unit) for column in self._columns[1:]]
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

    def _survey(self) -> str:
        """Say what is hardly in m or s, by the first lines, for people; empty if nothing is."""
        frames = self._first(self._time_unit)
        step = 0.0 if self._rate else _step(frames)
        distances = [abs(frame.distance) for frame in frames if math.isfinite(frame.distance)]
        said = []
        if step and not SHORT <= step <= LONG:
            what = f"the stamps of column {self._stamp_column} are {step:g} s apart, read as they are"
            number = _step(self._first("s"))
            likely = next((unit for unit, second in SECONDS.items() if MOST_OFTEN <= number * second <= 1.0), "ms")
            said.append(f"{what}; if they are in {likely}, name the column {_named(self._stamp_column, likely)}")
        if distances and median(distances) > FAR:
            what = f"the distances of column {self.column} have a median of {median(distances):g} m"
            named = f"name the column {self.column}_mm or {self.column}_cm"
            said.append(f"{what}, read as they are; if they are in mm or cm, {named}")
        return "; ".join(said)

    def _first(self, time_unit: str) -> list[DistanceFrame]:
        """Return the first frames; errors are met again where the table is read."""
        frames: list[DistanceFrame] = []
        with contextlib.suppress(LogError):
            frames.extend(itertools.islice(self._read(time_unit), SURVEYED))
        return frames

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
    return plain_number(word) if word else math.nan


def _step(frames: list[DistanceFrame]) -> float:
    return median([after.stamp - before.stamp for before, after in itertools.pairwise(frames)] or [0.0])


def _time(word: str, unit: str) -> float:
    if unit:
        with contextlib.suppress(ValueError):  # it may be a date all the same
            return _number(word) * SECONDS[unit]
    stamp = stamp_in(word)
    return _number(word) if stamp is None else stamp / 1e9


def _unit(name: str, units: dict[str, float]) -> str:
    """Return the unit that the name of a column ends with; empty if it ends with none."""
    found = UNIT.search(name)
    unit = (found[1] or found[2]).lower() if found else ""
    return unit if unit in units else ""


def _named(name: str | None, unit: str) -> str:
    """Return the name of a column that ends with another unit."""
    name = name or ""
    found = UNIT.search(name)
    return f"{name[: found.start()] if found and _unit(name, SECONDS) else name}_{unit}"


def _missing(wanted: dict[str, str], header: list[str]) -> str:
    """Say which columns are missing, and which are meant perhaps."""
    missing = {what: name for what, name in wanted.items() if name not in header}
    names = " and ".join(map(repr, missing.values()))
    has = ", ".join(header[:20])
    how = {"distance": "column", "stamp": "stamp_column"}
    if not has or all(_is_number(word) for word in header):
        got = f"numbers, {has}" if has else "nothing"
        return f"must have the names of its columns in its first line, such as stamp,distance; it has {got} there"
    fixes = []
    for what in missing:
        meant = [name for name in header if any(part in name.lower() for part in LIKELY[what])]
        fixes.append(option(how[what], meant[0]) if len(meant) == 1 else option(how[what]))
    rate = f", or say the rate with {option('rate')}" if "stamp" in missing else ""
    return f"has no column {names}; its first line has {has}: choose with {' and '.join(fixes)}{rate}"


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return stamp_in(word) is not None
    return True
