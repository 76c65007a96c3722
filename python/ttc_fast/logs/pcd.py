"""Clouds of the Point Cloud Library, one file each (.pcd): ascii, binary and binary_compressed.

A PCD file is a header of text lines, the last of which is DATA, and then the points. ``FIELDS`` names the numbers of a
point, and ``SIZE``, ``TYPE`` and ``COUNT`` say for each of them how many bytes it has, of which kind it is, and how
many there are of it. Versions .5 to .7 and the files of many programs differ in what they leave out and in blanks, tabs
and capital letters, so this reader takes whatever leaves one reading:

- ``SIZE``, ``TYPE`` and ``COUNT`` are 4, F and 1 where they are missing; ``COLUMNS`` stands for ``FIELDS``.
- ``WIDTH`` times ``HEIGHT`` is the number of points where ``POINTS`` is missing; ``VIEWPOINT`` is not needed.
- A field with a count of 0 has no bytes, or those of one number: the length of the data tells. It tells too whether a
  compressed file has its padding, the fields that are named ``_``.

https://pointclouds.org/documentation/tutorials/pcd_file_format.html
"""

from __future__ import annotations

import re
from collections import Counter
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ttc_fast.logs.cloud_files import CloudFormat
from ttc_fast.logs.files import UNPACKED, kind_of, most_unpacked, read_content, too_much
from ttc_fast.logs.log import REPAIR, Lidar, LogError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    Header = dict[str, list[str]]

LONGEST_HEADER = LARGEST_POINT = 1 << 16  # bytes
LONGEST_LINE = BLOCK = 1 << 20  # bytes
KINDS = {f"{kind}{size}": f"<{kind.lower()}{size}" for kind in "IU" for size in (1, 2, 4, 8)} | {
    "F4": "<f4",
    "F8": "<f8",
}
KNOWN_NAMES = ("x", "y", "z", "intensity")
INTENSITIES = ("i1", "u1", "i2", "u2", "i4", "u4", "f4", "f8")
WRONG_NAN = re.compile(rb"[-+]?(1\.#[A-Z]+|nan\([a-z]*\))", re.IGNORECASE)  # as some programs on Windows write it


class Field(NamedTuple):
    """A field of each point: its name, the type of its numbers (None if unknown), their bytes, and their count."""

    name: str
    kind: str | None
    size: int
    repeat: int


class Layout(NamedTuple):
    """The bytes of a point, and the fields that can be read in the order in which they are stored."""

    step: int
    numbers: int
    dtype: np.dtype[Any]


def read_pcd(frame: Path, limit: int = UNPACKED) -> NDArray[Any]:
    """Read one cloud: records with fields x, y and z, and all others that have names and known types."""
    content = read_content(frame, limit)
    header, start = _header(content)
    if "DATA" not in header or not ("FIELDS" in header or "COLUMNS" in header):
        other = kind_of(content)
        got = f"but {other}" if other else f"or is damaged: its first lines have no FIELDS or no DATA; {REPAIR}"
        raise LogError(frame, f"is not a PCD file, {got}")
    try:
        fields, count = _fields(header), _count(header)
    except ValueError as error:
        raise LogError(frame, f"is not a PCD file, or is damaged: {error}") from None
    _check(frame, fields)
    form = header["DATA"][0].lower() if header["DATA"] else ""
    if form not in READERS:
        raise LogError(frame, f"has DATA {form or 'nothing'}, but PCD is {', '.join(READERS)}; save it as one of these")
    return _with_intensity(READERS[form](frame, content, start, fields, count, limit))


def _with_intensity(points: NDArray[Any]) -> NDArray[Any]:
    """Copy points with an intensity of a type that no gate takes, as float64."""
    names = points.dtype.names or ()
    if "intensity" not in names or points.dtype["intensity"].str[1:] in INTENSITIES:
        return points
    return points.astype([(name, "<f8" if name == "intensity" else points.dtype[name]) for name in names])


# The header


def _header(content: bytes) -> tuple[Header, int]:
    """Read the lines up to DATA: what they say by their first word, and where the points begin."""
    header: Header = {}
    at = 3 if content.startswith(b"\xef\xbb\xbf") else 0
    while at < min(len(content), LONGEST_HEADER) and "DATA" not in header:
        end = content.find(b"\n", at)
        end = len(content) if end < 0 else end
        words = content[at:end].decode("ascii", "replace").split()
        at = end + 1
        if words and not words[0].startswith("#"):
            header[words[0].upper()] = words[1:]
    return header, at


def _fields(header: Header) -> list[Field]:
    names = header.get("FIELDS") or header["COLUMNS"]
    each = len(names)
    sizes = [_whole("SIZE", size) for size in header.get("SIZE", ["4"] * each)]
    kinds = header.get("TYPE", ["F"] * each)
    counts = [_whole("COUNT", count) for count in header.get("COUNT", ["1"] * each)]
    if not len(sizes) == len(kinds) == len(counts) == each:
        raise ValueError(f"FIELDS names {each} fields, and SIZE, TYPE and COUNT must say as many values")
    step = sum(size * max(count, 1) for size, count in zip(sizes, counts, strict=True))
    if step > LARGEST_POINT:
        raise ValueError(f"SIZE and COUNT come to {step} bytes a point")
    lower = [name.lower() for name in names]
    times = Counter(lower)
    plain = [low if low in KNOWN_NAMES and times[low] == 1 else name for name, low in zip(names, lower, strict=True)]
    return [
        Field(name, KINDS.get(f"{kind.upper()}{size}"), size, count)
        for name, kind, size, count in zip(plain, kinds, sizes, counts, strict=True)
    ]


def _count(header: Header) -> int:
    if "POINTS" in header:
        return _whole("POINTS", *header["POINTS"])
    if "WIDTH" in header:
        return _whole("WIDTH", *header["WIDTH"]) * _whole("HEIGHT", *header.get("HEIGHT", ["1"]))
    raise ValueError("neither POINTS nor WIDTH says how many points it has")


def _whole(name: str, word: str = "", *more: str) -> int:
    """Read the one number of a line."""
    if more or not (word.isascii() and word.isdecimal() and len(word) < 16):
        raise ValueError(f"{name} must be a whole number, got {' '.join((word, *more)) or 'nothing'}")
    return int(word)


def _check(frame: Path, fields: list[Field]) -> None:
    """Refuse a cloud whose points have no coordinates that can be read in place."""
    named = {field.name: field for field in fields}
    missing = [name for name in ("x", "y", "z") if name not in named]
    if missing:
        raise LogError(frame, f"has no field {', '.join(missing)}; it has {', '.join(named)}")
    if [(named[name].kind, named[name].repeat) for name in ("x", "y", "z")] not in ([("<f4", 1)] * 3, [("<f8", 1)] * 3):
        raise LogError(frame, "must have x, y and z of one type, F 4 or F 8, once each; convert it with PCL")


# The points


def _layouts(fields: list[Field], *, compressed: bool) -> Iterator[Layout]:
    """Give the layouts that the fields may have, the likeliest first."""
    for padded in (False, True) if compressed and any(field.name == "_" for field in fields) else (True,):
        for least in (0, 1) if any(field.repeat == 0 for field in fields) else (0,):
            stored = [
                field._replace(repeat=max(field.repeat, least)) for field in fields if padded or field.name != "_"
            ]
            yield _layout(stored)


def _layout(stored: list[Field]) -> Layout:
    at = 0
    readable: dict[str, tuple[np.dtype[Any], int]] = {}
    for field in stored:
        if field.repeat and field.kind and field.name != "_":
            kind = np.dtype(field.kind) if field.repeat == 1 else np.dtype((field.kind, field.repeat))
            readable.setdefault(field.name, (kind, at))
        at += field.size * field.repeat
    kinds, offsets = ([each[i] for each in readable.values()] for i in (0, 1))
    dtype = np.dtype({"names": list(readable), "formats": kinds, "offsets": offsets, "itemsize": at})  # type: ignore[call-overload]
    return Layout(at, sum(field.repeat for field in stored), dtype)


def _binary(frame: Path, content: bytes, start: int, fields: list[Field], count: int, _: int) -> NDArray[Any]:
    """View the points, one after another."""
    layouts, size = list(_layouts(fields, compressed=False)), len(content) - start
    layout = next((each for each in layouts if each.step * count == size), layouts[0])
    if size < layout.step * count:
        raise _differs(frame, count, size // layout.step)
    return np.frombuffer(content, layout.dtype, count, start) if count else np.empty(0, layout.dtype)


def _compressed(frame: Path, content: bytes, start: int, fields: list[Field], count: int, limit: int) -> NDArray[Any]:
    """Unpack the points, which are stored field by field."""
    layouts = list(_layouts(fields, compressed=True))
    if not count:
        return np.empty(0, layouts[0].dtype)
    sizes = np.frombuffer(content[start : start + 8].ljust(8, b"\0"), "<u4").tolist()
    packed = content[start + 8 : start + 8 + sizes[0]]
    layout = next((each for each in layouts if each.step * count == sizes[1]), None)
    if layout is None:
        raise _differs(frame, count, sizes[1] // layouts[0].step)
    most = most_unpacked(len(packed), limit)
    if sizes[1] > most:
        raise LogError(frame, f"is too large: {too_much(len(packed), most)}")
    try:
        plain = unpack_lzf(packed, sizes[1])
    except ValueError as error:
        raise LogError(frame, f"is damaged or cut short: {error}; {REPAIR}") from None
    points = np.zeros(count, layout.dtype)
    for name in layout.dtype.names or ():
        kind, offset = layout.dtype.fields[name][:2]  # type: ignore[index]
        points[name] = np.frombuffer(plain, kind, count, offset * count)
    return points


def _ascii(frame: Path, content: bytes, start: int, fields: list[Field], count: int, _: int) -> NDArray[Any]:
    """Read the points as lines of numbers, with any blanks between them."""
    lines = partial(_lines, frame, content, start)
    layouts = list(_layouts(fields, compressed=False))
    width = len(next(lines(), b"").split())
    layout = next((each for each in layouts if each.numbers == width), layouts[0])
    found = sum(1 for _ in lines())
    if found != count:
        raise _differs(frame, count, found)
    points = np.zeros(count, layout.dtype)
    if not count:
        return points
    stored = [field._replace(repeat=max(field.repeat, layout is not layouts[0])) for field in fields]
    kinds = [(f"{i}_{j}", field.kind or "<f8") for i, field in enumerate(stored) for j in range(field.repeat)]
    numbers: Any = _table(lines, np.dtype(kinds))
    if numbers is None:
        widths = ((at, len(line.split())) for at, line in enumerate(lines()))
        odd = next(((at, width) for at, width in widths if width != layout.numbers), None)
        what = "something that is no number" if odd is None else f"{odd[1]} in point {odd[0]}"
        raise LogError(frame, f"is damaged: it must have {layout.numbers} numbers a line, and has {what}; {REPAIR}")
    for i, field in reversed(list(enumerate(stored))):  # of fields with one name the first is read
        if field.name in (layout.dtype.names or ()):
            columns = [numbers[f"{i}_{j}"] for j in range(field.repeat)]
            with np.errstate(invalid="ignore"):  # an integer that is not a number
                points[field.name] = columns[0] if field.repeat == 1 else np.column_stack(columns)
    return points


def _lines(frame: Path, content: bytes, start: int) -> Iterator[bytes]:
    """Yield the lines that are not blank. They come from one block after another, as all at once fill the memory."""
    at, ends = start, b"\n" if b"\n" in content[start : start + BLOCK] else b"\r"
    while at < len(content):
        end = content.find(ends, at + BLOCK, at + BLOCK + LONGEST_LINE) + 1 or len(content)
        if end - at > BLOCK + LONGEST_LINE:
            raise LogError(frame, f"is damaged: it has a line of more than {LONGEST_LINE} bytes; {REPAIR}")
        text = content[at:end]
        if b"#" in text or b"(" in text:
            text = WRONG_NAN.sub(b"nan", text)
        yield from (line for line in text.splitlines() if line.strip())
        at = end


def _table(lines: Callable[[], Iterator[bytes]], kinds: np.dtype[Any]) -> NDArray[Any] | None:
    """Read lines of numbers as these kinds, or as floats where an integer is written as one; None if that fails."""
    for dtype in (kinds, np.dtype([(name, "<f8") for name in kinds.names or ()])):
        try:
            return np.loadtxt(lines(), dtype, comments=None, ndmin=1)
        except (ValueError, OverflowError):
            pass
    return None


READERS = {"ascii": _ascii, "binary": _binary, "binary_compressed": _compressed}


def _differs(frame: Path, said: int, found: int) -> LogError:
    kind = "is cut short" if found < said else "is damaged"
    return LogError(frame, f"{kind}: it says {said} points and has {found}; {REPAIR}")


def unpack_lzf(packed: bytes, size: int) -> bytes:
    r"""Decompress LZF, to exactly ``size`` bytes.

    A control byte below 32 is followed by that many bytes and one more. Any other is a reference to bytes that were
    written before: its upper three bits are their number less 2, 7 for one that is in the next byte, and its lower five
    bits and the byte behind are how far back they begin, less 1.

    Raises
    ------
    ValueError
        If the bytes are something else.

    Examples
    --------
    >>> from ttc_fast.logs.pcd import unpack_lzf
    >>> unpack_lzf(b"\x01ab\x60\x01", 7)
    b'abababa'
    """
    plain, at, end = bytearray(), 0, len(packed)
    try:
        while at < end and len(plain) < size:
            control = packed[at]
            if control < 32:
                plain += packed[at + 1 : at + control + 2]
                at += control + 2
                continue
            length = (control >> 5) + 2
            if length == 9:
                at += 1
                length += packed[at]
            back = ((control & 31) << 8) + packed[at + 1] + 1
            at += 2
            begin = len(plain) - back
            if begin < 0:
                raise ValueError("its compressed points refer to what is before them")
            if length <= back:
                plain += plain[begin : begin + length]
            else:  # it goes on into itself
                plain += (plain[begin:] * (length // back + 1))[:length]
    except IndexError:
        at = end + 1
    if len(plain) != size or at != end:
        raise ValueError(f"its compressed points come to {len(plain)} bytes, not {size}")
    return bytes(plain)


PCD = CloudFormat("PCD clouds", (".pcd", ".pcd.gz"), Lidar(sensor_height=None), 10.0, read_pcd)
