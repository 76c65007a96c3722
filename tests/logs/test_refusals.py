"""A file that is not what its name says is refused by what it is."""

import gzip
import io
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.bags import drive, write
from ttc_fast.logs import LogError, open_log

NAMES = ("a.bag", "a.mcap", "a.db3", "a.npz", "a.pcd", "a.bin", "a.pcd.bin", "a.log", "a.csv")
POINTER = b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a2146\nsize 12345\n"


def npy() -> bytes:
    file = io.BytesIO()
    np.save(file, np.ones(3))
    return file.getvalue()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (POINTER, "a pointer of Git LFS, in whose place git lfs pull puts the file"),
        (b"<!DOCTYPE html>\n<html><body>Not found</body></html>\n", "a web page, perhaps of a download that failed"),
        (b"\x89HDF\r\n\x1a\n" + bytes(800), "an HDF5 file"),
        (b"ply\nformat ascii 1.0\n" * 40, "a PLY cloud"),
        (gzip.compress(b"hello" * 100, mtime=0), r"compressed by gzip \(\.gz\)"),
        (b"#ROSBAG V1.2\n" + bytes(800), "a ROS 1 bag of an old version, which rosbag fix converts"),
        (b"7z\xbc\xaf\x27\x1c" + bytes(800), "a 7z archive"),
    ],
)
@pytest.mark.parametrize("name", NAMES)
def test_a_file_of_something_else_is_named(name: str, content: bytes, said: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(LogError, match=rf"{name}: .*(but|it is) {said}"):
        list(open_log(tmp_path / name))


@pytest.mark.parametrize(("kind", "ending", "said"), [
    ("bag", ".mcap", "is no MCAP file, but a ROS 1 bag"),
    ("mcap", ".bag", "is no ROS 1 bag, but an MCAP file"),
    ("mcap", ".db3", "is no rosbag2 database, but an MCAP file"),
    ("db3", ".mcap", "is no MCAP file, but an SQLite database"),
])  # fmt: skip
def test_a_bag_of_another_kind_is_named(kind: str, ending: str, said: str, tmp_path: Path) -> None:
    path = write(tmp_path, kind, drive(2)).rename(tmp_path / f"renamed{ending}")
    with pytest.raises(LogError, match=said):
        open_log(path)


def test_a_database_of_something_else_is_one_of_rosbag2_that_is_damaged(tmp_path: Path) -> None:
    with closing(sqlite3.connect(tmp_path / "log.db3")) as database:
        database.execute("CREATE TABLE cooks (id INTEGER)")
        database.commit()
    with pytest.raises(
        LogError, match="is no rosbag2 database, or is damaged: its topics cannot be read; copy it again"
    ):
        open_log(tmp_path / "log.db3")


def test_a_single_array_is_an_archive_of_none(tmp_path: Path) -> None:
    (tmp_path / "a.npz").write_bytes(npy())
    with pytest.raises(LogError, match="is a single NumPy array, not an archive of several"):
        open_log(tmp_path / "a.npz")


@pytest.mark.parametrize("name", NAMES)
def test_an_empty_file_is_refused(name: str, tmp_path: Path) -> None:
    (tmp_path / name).touch()
    try:
        frames: list[Any] = list(open_log(tmp_path / name))
    except LogError:
        return
    assert name in ("a.bin", "a.pcd.bin")  # bare numbers, of which there may be none
    assert [len(frame.points) for frame in frames] == [0]
