"""When the frames of a folder were recorded, by their names or by a list of stamps beside them, and in which order.

Names are ordered as people count: 9 before 10. A number in a name is a stamp if it can be a time since 1970, from 2000
to 2100, in s (10 digits, perhaps with a fraction), ms (13), us (16) or ns (19), or if it is a date and a time of day; a
name that is nothing but a decimal number is a stamp in s. A number beside its unit, as in ``us_1200050000`` or
``50ms``, is in that unit, however many digits it has. Names whose stamps do not increase are no stamps, nor are those
that would be a quarter of an hour apart: they count in another unit, perhaps since power-on.

What stays the same in the names of a sensor's frames, such as the names of the vehicle and of the sensor, is the series
that they belong to.
"""

from __future__ import annotations

import itertools
import re
from contextlib import suppress
from datetime import datetime, timezone
from decimal import Decimal, InvalidOperation
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ttc_fast._validate import shown
from ttc_fast.logs.files import open_text
from ttc_fast.logs.log import LogError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    Found = tuple[int, str] | None

LISTS = ("timestamps.txt", "times.txt")
"""Names of lists of stamps, one line a frame, as KITTI has them; in the folder or the one above."""
LARGEST_LIST = 64_000_000  # characters
UNITS = {10: 10**9, 13: 10**6, 16: 10**3, 19: 1}  # ns, by the number of digits of a time since 1970
FIRST, LAST = 946_684_800 * 10**9, 4_102_444_800 * 10**9  # ns, 2000 and 2100
SINCE_1970 = FIRST / 1e9
"""Stamps from 2000 on are times since 1970, s."""
BETWEEN = "_-. "
SHORTEST_GAP = 100_000  # ns; a number that counts up by one is no stamp
LONGEST_GAP = 2_000_000_000  # ns, between the frames of names that are nothing but decimal numbers
LONGEST_PAUSE = 900_000_000_000  # ns, between the frames of any names
MOST_OFTEN = 2_000_000  # ns; numbers beside a unit that differ by less may as well count the frames
EPOCH = re.compile(r"(?<![\d.])(\d{10}|\d{13}|\d{16}|\d{19})(?:\.(\d{1,9})|_(\d{9}))?(?!\d)")
DATE = re.compile(r"(\d{4})-?(\d\d)-?(\d\d)[T_ -](\d\d)[-:_]?(\d\d)[-:_]?(\d\d)(?:[.,](\d{1,9}))?(?!\d)")
UNITED = re.compile(
    r"(?:(?<![a-z])(?P<before>ns|us|ms)[_ .=-]?)?(?<!\d)(?P<number>\d+)(?!\d)(?:[_ -]?(?P<after>ns|us|ms)(?![a-z]))?",
    re.IGNORECASE,
)
NANOSECONDS = {"ns": 1, "us": 10**3, "ms": 10**6}
DECIMAL = re.compile(r"(\d+)\.(\d{1,9})")


class Series(NamedTuple):
    """Frames that belong together, in order.

    Attributes
    ----------
    name : str
        What their names have in common.
    frames : list of Path
        The frames.
    stamps : ndarray or None
        The stamps in their names, s since the first; None if the names say none.
    """

    name: str
    frames: list[Path]
    stamps: NDArray[np.float64] | None


def series_of(frames: Sequence[Path], stem: Callable[[Path], str]) -> list[Series]:
    """Sort frames into series, by their names without the ending, which ``stem`` returns."""
    for find in (_united, _epoch, _date, _decimal):
        found = [find(stem(frame)) for frame in frames]
        stamped = [(*each, frame) for each, frame in zip(found, frames, strict=True) if each]
        if len(stamped) <= len(frames) / 2:
            continue
        if find is _decimal and (len(stamped) < len(frames) or _counts_up([stem(frame) for frame in frames])):
            continue
        rests = [rest for _, rest, _ in stamped]
        names = rests if 2 * len(set(rests)) <= len(rests) else _series_names(rests)
        grouped: dict[str, list[tuple[int, Path]]] = {}
        for name, (stamp, _, frame) in zip(names, stamped, strict=True):
            grouped.setdefault(name.strip(BETWEEN), []).append((stamp, frame))
        if all(_plausible(sorted(stamp for stamp, _ in each), find) for each in grouped.values()):
            others = [Series(frame.name, [frame], None) for each, frame in zip(found, frames, strict=True) if not each]
            return [_stamped(name, sorted(each)) for name, each in sorted(grouped.items())] + others
    return _numbered(frames, stem)


def natural(name: str) -> list[tuple[str, int, str]]:
    """Return a key that sorts names by the numbers in them, so that 10 comes after 9.

    Examples
    --------
    >>> from ttc_fast.logs.stamps import natural
    >>> sorted(["10.bin", "9.bin", "a1.bin"], key=natural)
    ['9.bin', '10.bin', 'a1.bin']
    """
    return [(text.lower(), int(digits or -1), digits) for text, digits in re.findall(r"(\D*)(\d*)", name)]


def stamp_in(stem: str) -> int | None:
    """Return the time since 1970 in a name without its ending, ns; None if there is none.

    Examples
    --------
    >>> from ttc_fast.logs.stamps import stamp_in
    >>> stamp_in("n015-2018-07-24-11-22-45+0800__LIDAR_TOP__1532402927647951")
    1532402927647951000
    >>> stamp_in("frame_20121214T142255.814212"), stamp_in("0000000042")
    (1355494975814212000, None)
    """
    found = _epoch(stem) or _date(stem)
    return found[0] if found else None


def read_stamps(path: Path, frames: list[Path]) -> NDArray[np.float64]:
    """Read the stamps of the frames, one line each, s since the first of them.

    A line is a date and a time of day, or a number of seconds. A file that covers the whole drive may have more lines
    than there are frames here: then the number in a frame's name says which line is its own.
    """
    try:
        with open_text(path) as file:
            text = file.read(LARGEST_LIST + 1)
        if len(text) > LARGEST_LIST:
            raise LogError(path, f"has more than {LARGEST_LIST / 1e6:g} MB, which is no list of stamps; take it away")
        lines = text.rstrip().split("\n")
        if len(lines) != len(frames):
            lines = _lines_by_number(path, lines, frames)
        stamps = [_line(line.strip()) for line in lines]
    except OSError as error:
        raise LogError(path, f"cannot be read: {error.strerror or error}") from error
    except ValueError as error:
        raise LogError(path, f"must have lines like 2011-09-26 13:02:25.951199337, one a frame: {error}") from error
    for i, (before, after) in enumerate(itertools.pairwise(stamps)):
        if before is None or after is None or after <= before:
            problem = f"that of {frames[i + 1].name} does not follow that of {frames[i].name}"
            raise LogError(path, f"stamps must increase, but {problem}")
    return _seconds([stamp or 0 for stamp in stamps])


def _lines_by_number(path: Path, lines: list[str], frames: list[Path]) -> list[str]:
    numbers = [frame.name.partition(".")[0] for frame in frames]
    if not all(number.isdecimal() and int(number) < len(lines) for number in numbers):
        problem = f"has {len(lines)} stamps for {len(frames)} frames, and the names do not say which is whose"
        raise LogError(path, f"{problem}; take it away, or give it one line a frame")
    return [lines[int(number)] for number in numbers]


def _line(line: str) -> int | None:
    """Read a line of a list of stamps, ns; None if it is empty."""
    if not line:
        return None
    stamp = stamp_in(line)
    if stamp is not None:
        return stamp
    with suppress(InvalidOperation):
        seconds = Decimal(line)
        if seconds.is_finite() and seconds.copy_abs() < LAST // 10**9:
            return int(seconds * 10**9)
    raise ValueError(f"{shown(line)} is no time")


# Stamps in names


def _epoch(stem: str) -> Found:
    """Find a time since 1970, ns, and the rest of the name."""
    for found in reversed(list(EPOCH.finditer(stem))):
        whole, fraction = found[1], found[2] or found[3]
        if fraction and len(whole) != 10:
            continue
        stamp = int(whole) * UNITS[len(whole)] + int((fraction or "").ljust(9, "0"))
        if FIRST <= stamp < LAST:
            return stamp, stem[: found.start()] + stem[found.end() :]
    return None


def _date(stem: str) -> Found:
    """Find a date and a time of day, ns since 1970, and the rest of the name."""
    for found in reversed(list(DATE.finditer(stem))):
        try:
            time = datetime(*map(int, found.groups()[:6]), tzinfo=timezone.utc)  # type: ignore[arg-type,misc]
        except ValueError:
            continue
        stamp = int(time.timestamp()) * 10**9 + int((found[7] or "").ljust(9, "0"))
        if FIRST <= stamp < LAST:
            return stamp, stem[: found.start()] + stem[found.end() :]
    return None


def _united(stem: str) -> Found:
    """Find a number beside its unit, ns, and the rest of the name."""
    for found in reversed(list(UNITED.finditer(stem))):
        unit = found["after"] or found["before"]
        if unit:
            return int(found["number"]) * NANOSECONDS[unit.lower()], stem[: found.start()] + stem[found.end() :]
    return None


def _decimal(stem: str) -> Found:
    """Read a name that is nothing but a decimal number of seconds, ns."""
    found = DECIMAL.fullmatch(stem)
    return (int(found[1]) * 10**9 + int(found[2].ljust(9, "0")), "") if found else None


def _counts_up(stems: list[str]) -> bool:
    """Whether decimal numbers are counters with a point between them: 1.9 is followed by 1.10."""
    rows = sorted((int(whole), int(part)) for whole, part in (stem.split(".") for stem in stems))
    steps = {after[1] - before[1] for before, after in itertools.pairwise(rows) if before[0] == after[0]}
    return steps == {1} and len({len(stem.split(".")[1]) for stem in stems}) > 1


def _plausible(stamps: list[int], find: Callable[[str], Found]) -> bool:
    """Whether these can be the stamps of frames: they differ, and the time between them is that of a sensor."""
    gaps = sorted(after - before for before, after in itertools.pairwise(stamps))
    if not gaps:
        return True
    median = gaps[len(gaps) // 2]
    least = MOST_OFTEN if find is _united else SHORTEST_GAP
    return gaps[0] > 0 and least <= median <= (LONGEST_GAP if find is _decimal else LONGEST_PAUSE)


def _stamped(name: str, frames: list[tuple[int, Path]]) -> Series:
    return Series(name, [frame for _, frame in frames], _seconds([stamp for stamp, _ in frames]))


def _seconds(stamps: list[int]) -> NDArray[np.float64]:
    return np.array([stamp - stamps[0] for stamp in stamps]) / 1e9


# Numbers in names


def _numbered(frames: Sequence[Path], stem: Callable[[Path], str]) -> list[Series]:
    """Sort frames into series by what is no number of a frame; single frames make no series of their own."""
    ordered = sorted(frames, key=lambda frame: natural(frame.name))
    grouped: dict[str, list[Path]] = {}
    for name, frame in zip(_series_names([stem(frame) for frame in ordered]), ordered, strict=True):
        grouped.setdefault(name.strip(BETWEEN), []).append(frame)
    if sum(len(each) > 1 for each in grouped.values()) < 2:
        return [Series("", ordered, None)]
    return [Series(name, each, None) for name, each in sorted(grouped.items())]


def frame_numbers(stems: Sequence[str]) -> list[int] | None:
    """Return the numbers in names, in order, that count frames; None if they do not go up by one, but for gaps.

    Examples
    --------
    >>> from ttc_fast.logs.stamps import frame_numbers
    >>> frame_numbers(["a7", "a8", "a9", "a13", "a14"])
    [7, 8, 9, 13, 14]
    """
    rows = [re.findall(r"\d+", stem) for stem in stems]
    if len({len(row) for row in rows}) != 1 or not rows[0]:
        return None
    counting = _counting(rows)
    numbers = [int(row[counting]) for row in rows]
    steps = sorted(after - before for before, after in itertools.pairwise(numbers))
    return numbers if steps and steps[0] > 0 and steps[len(steps) // 2] == 1 else None


def _counting(rows: list[list[str]]) -> int:
    """Return which number of each name has the most different values, the last of them; -1 if there are none."""
    different = [len(set(column)) for column in zip(*rows, strict=True)]
    return max(range(len(different)), key=lambda i: (different[i], i), default=-1)


def _series_names(stems: list[str]) -> list[str]:
    """Return what names say beside the numbers of frames.

    Of the numbers in names that are alike but for their numbers, the one with the most different values counts the
    frames. Others belong to the name of a series if they follow a letter, as in lidar2 or n015.
    """
    shapes: dict[tuple[str, ...], list[int]] = {}
    for at, stem in enumerate(stems):
        shapes.setdefault(tuple(re.split(r"\d+", stem)), []).append(at)
    names = [""] * len(stems)
    for texts, alike in shapes.items():
        rows = [re.findall(r"\d+", stems[at]) for at in alike]
        counting = _counting(rows)
        kept = [i != counting and re.search(r"[^\W\d_]", text) is not None for i, text in enumerate(texts[:-1])]
        for at, row in zip(alike, rows, strict=True):
            numbers = [number if keep else "" for number, keep in zip(row, kept, strict=True)]
            names[at] = "".join(text + number for text, number in zip(texts, [*numbers, ""], strict=True))
    return names
