"""Files of logs: which of a folder are meant, and their content, unpacked and bounded."""

from __future__ import annotations

import codecs
import gzip
import io
import math
import zlib
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, TextIO

from ttc_fast._settings import option
from ttc_fast.logs.log import REPAIR, LogError, need

if TYPE_CHECKING:
    from collections.abc import Iterator

PACKED = (".zstd", ".zst", ".gz", ".bz2", ".xz", ".lz4", ".zip", ".7z")
"""The endings of compressed files."""
DAMAGED_GZIP = (EOFError, zlib.error, gzip.BadGzipFile)
"""What a damaged file that ends in .gz raises."""
UNPACKED, MOST_RATIO = 64_000_000, 20  # bytes, and unpacked over packed
LARGEST = 2_000_000_000
"""The most bytes of a file that is read at once, such as one of a cloud."""
ARCHIVE = 4
"""A file that holds a whole log may unpack to this many times the limit of a chunk, message or cloud."""


BEGINNINGS = {
    b"version https://git-lfs": "a pointer of Git LFS, in whose place git lfs pull puts the file",
    b"<!doctype html": "a web page, perhaps of a download that failed",
    b"<html": "a web page, perhaps of a download that failed",
    b"\0\5\x16\7": "what macOS keeps beside a file",
    b"#rosbag v2.0": "a ROS 1 bag (.bag)",
    b"#rosbag v": "a ROS 1 bag of an old version, which rosbag fix converts",
    b"\x89mcap0": "an MCAP file (.mcap)",
    b"sqlite format 3": "an SQLite database (.db3)",
    b"# .pcd": "a PCD cloud (.pcd)",
    b"ply\n": "a PLY cloud",
    b"ply\r": "a PLY cloud",
    b"lasf": "a LAS cloud",
    b"\x89hdf": "an HDF5 file",
    b"\x93numpy": "a single NumPy array (.npy)",
    b"pk\3\4": "a zip archive (.zip, .npz, .xlsx)",
    b"\x1f\x8b": "compressed by gzip (.gz)",
    b"bzh": "compressed by bzip2 (.bz2)",
    b"\x28\xb5\x2f\xfd": "compressed by zstd (.zst)",
    b"\xfd7zxz": "compressed by xz (.xz)",
    b"7z\xbc\xaf": "a 7z archive",
}
"""The first bytes of files, in lower case, and what they are, for people."""


def kind_of(begin: bytes) -> str:
    """Say what a file is by its first bytes, for people; empty if that is not known.

    Examples
    --------
    >>> from ttc_fast.logs.files import kind_of
    >>> kind_of(b"#ROSBAG V2.0"), kind_of(b"hello")
    ('a ROS 1 bag (.bag)', '')
    """
    begin = begin[:64].lower()
    return next((kind for start, kind in BEGINNINGS.items() if begin.startswith(start)), "")


def kind_of_file(path: Path) -> str:
    """Say what a file is by its first bytes, for people; empty if that is not known."""
    with path.open("rb") as file:
        return kind_of(file.read(64))


def plain_number(word: str) -> float:
    """Return the number that a word is; raise ValueError if it is none, or too large to be told from inf.

    Examples
    --------
    >>> from ttc_fast.logs.files import plain_number
    >>> plain_number("-inf")
    -inf
    >>> plain_number("1e999")
    Traceback (most recent call last):
        ...
    ValueError: 1e999 is too large
    """
    value = float(word)
    if math.isinf(value) and "inf" not in word.lower():
        raise ValueError(f"{word} is too large")
    return value


def files_in(folder: Path) -> list[Path]:
    """Return the files of a folder, in the order of their names.

    Hidden files are left out, such as the ``._name`` that macOS puts beside a file on a disk of another system.
    """
    return sorted(file for file in folder.iterdir() if not file.name.startswith(".") and file.is_file())


def unpacked_name(name: str) -> str:
    """Return the name that a compressed file has when it is unpacked; of any other file its own."""
    return name[: -len(Path(name).suffix)] if name.lower().endswith(PACKED) else name


def most_unpacked(packed: int, limit: int) -> int:
    """Return how many bytes this many may be unpacked to; what comes to more would fill the memory, and is no data."""
    return max(limit, MOST_RATIO * packed)


def too_much(packed: int, most: int) -> str:
    """Say that something unpacks to more than it may, and how that is changed, for people.

    Examples
    --------
    >>> from ttc_fast.logs.files import too_much
    >>> too_much(600, 64_000_000)
    '600 bytes unpack to more than 64 MB; if they are sound, raise the option max_unpacked'
    """
    return f"{packed} bytes unpack to more than {most / 1e6:g} MB; if they are sound, raise {option('max_unpacked')}"


def check_record(size: int, limit: int) -> None:
    """Raise ValueError if a record has more bytes than one chunk or message does, unpacked or not."""
    most = max(limit, UNPACKED)
    if size > most:
        raise ValueError(
            f"a record of {size} bytes, more than {most / 1e6:g} MB; if it is sound, raise {option('max_unpacked')}"
        )


def unpack_zstd(packed: bytes, most: int, path: Path) -> bytes:
    """Unpack to at most ``most`` bytes; raise ValueError if it is damaged or comes to more."""
    zstandard = need("zstandard", path)
    try:
        size = zstandard.frame_content_size(packed)
        if size > most:
            raise ValueError(too_much(len(packed), most))
        # A frame that does not say its size needs a limit, for which memory is set aside.
        limit = {"max_output_size": most} if size < 0 else {}
        unpacked: bytes = zstandard.ZstdDecompressor().decompress(packed, **limit)
    except (zstandard.ZstdError, MemoryError) as error:
        raise ValueError(f"its zstd compression is damaged, or {too_much(len(packed), most)}") from error
    return unpacked


def unpack_lz4(packed: bytes, most: int, path: Path) -> bytes:
    """Unpack to at most ``most`` bytes; raise ValueError if it is damaged or comes to more."""
    unpacker = need("lz4.frame", path).LZ4FrameDecompressor()
    try:
        unpacked: bytes = unpacker.decompress(packed, max_length=most + 1)
    except (RuntimeError, ValueError, EOFError, MemoryError) as error:
        raise ValueError(f"its lz4 compression is damaged: {error}") from error
    if len(unpacked) > most:
        raise ValueError(too_much(len(packed), most))
    if not unpacker.eof:
        raise ValueError("its lz4 compression is cut short")
    return unpacked


def read_content(path: Path, limit: int = UNPACKED) -> bytes:
    """Read a file, and unpack it if its name ends in .gz."""
    if path.stat().st_size > LARGEST:
        raise LogError(path, f"is too large for one cloud: it has more than {LARGEST / 1e9:g} GB; cut it up")
    try:
        content = path.read_bytes()
        if path.suffix.lower() != ".gz":
            return content
        packed, most = len(content), most_unpacked(len(content), limit)
        with gzip.open(io.BytesIO(content)) as file:
            content = file.read(most + 1)
    except DAMAGED_GZIP as error:
        raise LogError(path, f"is not gzip, or is damaged; {REPAIR}") from error
    except OSError as error:
        raise LogError(path, f"cannot be read: {error.strerror or error}") from error
    except MemoryError as error:
        raise LogError(path, "cannot be read: there is too little memory for it") from error
    if len(content) > most:
        raise LogError(path, f"is too large: {too_much(packed, most)}")
    return content


class BoundedGzip(gzip.GzipFile):
    """A file of gzip that ends in a LogError where it unpacks to more than it may."""

    def __init__(self, path: Path, file: BinaryIO, limit: int) -> None:
        super().__init__(fileobj=file)
        self._path, self._packed = path, path.stat().st_size
        self._most = most_unpacked(self._packed, ARCHIVE * limit)

    def read1(self, size: int = -1) -> bytes:
        """Read some bytes."""
        if self.tell() > self._most:
            raise LogError(self._path, f"is too large: {too_much(self._packed, self._most)}")
        return super().read1(size)


@contextmanager
def open_text(path: Path, limit: int = UNPACKED) -> Iterator[TextIO]:
    """Open a text, unpacked if its name ends in .gz, in the encoding that its first bytes are in."""
    with path.open("rb") as file:
        unpacked: Any = BoundedGzip(path, file, limit) if path.suffix.lower() == ".gz" else file
        try:
            begin = unpacked.read(1 << 16)
        except DAMAGED_GZIP:
            begin = b""  # the damage is met again where the text is read
        unpacked.seek(0)
        with io.TextIOWrapper(unpacked, _encoding(begin), errors="replace", newline="") as text:
            yield text


def _encoding(begin: bytes) -> str:
    """Tell the encoding of a text by its first bytes: UTF-8, UTF-16 as Windows writes it, or Windows-1252."""
    if begin.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    if b"\0" in begin[:2] and len(begin) > 1:
        return "utf-16-le" if begin[1] == 0 else "utf-16-be"
    try:
        codecs.getincrementaldecoder("utf-8")().decode(begin)
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8-sig"
