"""Files of logs: which of a folder are meant, and their content, unpacked and bounded."""

from __future__ import annotations

import codecs
import gzip
import io
import zlib
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from ttc_fast.logs.log import REPAIR, LogError

if TYPE_CHECKING:
    from collections.abc import Iterator

PACKED = (".zstd", ".zst", ".gz", ".bz2", ".xz", ".lz4", ".zip", ".7z")
"""The endings of compressed files."""
DAMAGED_GZIP = (EOFError, zlib.error, gzip.BadGzipFile)
"""What a damaged file that ends in .gz raises."""
SURELY_UNPACKED, MOST_RATIO = 1 << 28, 100  # bytes, and unpacked over packed


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


def files_in(folder: Path) -> list[Path]:
    """Return the files of a folder, in the order of their names.

    Hidden files are left out, such as the ``._name`` that macOS puts beside a file on a disk of another system.
    """
    return sorted(file for file in folder.iterdir() if not file.name.startswith(".") and file.is_file())


def unpacked_name(name: str) -> str:
    """Return the name that a compressed file has when it is unpacked; of any other file its own."""
    return name[: -len(Path(name).suffix)] if name.lower().endswith(PACKED) else name


def most_unpacked(packed: int) -> int:
    """Return how many bytes this many may be unpacked to; what comes to more would fill the memory, and is no data."""
    return max(SURELY_UNPACKED, MOST_RATIO * packed)


def read_content(path: Path) -> bytes:
    """Read a file, and unpack it if its name ends in .gz."""
    try:
        content = path.read_bytes()
        if path.suffix.lower() != ".gz":
            return content
        most = most_unpacked(len(content))
        with gzip.open(io.BytesIO(content)) as file:
            content = file.read(most + 1)
    except DAMAGED_GZIP as error:
        raise LogError(path, f"is not gzip, or is damaged; {REPAIR}") from error
    except OSError as error:
        raise LogError(path, f"cannot be read: {error.strerror or error}") from error
    if len(content) > most:
        raise LogError(path, f"is damaged: it unpacks to more than {most / 1e9:.2g} GB, which is no cloud; {REPAIR}")
    return content


@contextmanager
def open_text(path: Path) -> Iterator[TextIO]:
    """Open a text, unpacked if its name ends in .gz, in the encoding that its first bytes are in."""
    with path.open("rb") as file:
        unpacked: Any = gzip.GzipFile(fileobj=file) if path.suffix.lower() == ".gz" else file
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
