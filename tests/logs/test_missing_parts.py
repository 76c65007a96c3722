"""No part of a recording is lost in silence: it is read, or an error says what was not."""

import shutil
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.bags import drive, scans_of, write
from tests.support.opened import read
from ttc_fast.cli import main
from ttc_fast.logs import LogError, open_log


def split(folder: Path, items: list[Any], parts: int, kind: str = "db3") -> Path:
    """Write a bag in parts into a folder, without metadata."""
    whole = folder / "split"
    whole.mkdir()
    each = len(items) // parts
    for part in range(parts):
        (folder / str(part)).mkdir()
        path = write(folder / str(part), kind, items[each * part : each * (part + 1)])
        path.rename(whole / f"split_{part}.{kind}")
    return whole


# A write-ahead log


@pytest.fixture
def killed(tmp_path: Path) -> Path:
    """Make the folder of a recorder that was killed: half of the messages are in the write-ahead log alone."""
    path = write(tmp_path, "db3", drive(20))
    with closing(sqlite3.connect(path)) as database:
        rows = database.execute("SELECT topic_id, timestamp, data FROM messages ORDER BY id").fetchall()
        database.execute("DELETE FROM messages WHERE id > 20")
        database.commit()
        database.execute("PRAGMA journal_mode=WAL")
        database.execute("PRAGMA wal_autocheckpoint=0")
        database.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)", rows[20:])
        database.commit()
        folder = tmp_path / "killed"
        folder.mkdir()
        for file in path.parent.glob("*.db3*"):
            shutil.copy(file, folder / file.name)
    return folder


@pytest.mark.parametrize("shared_memory", [True, False])
def test_messages_in_a_write_ahead_log_are_read(shared_memory: bool, killed: Path) -> None:
    if not shared_memory:
        (killed / "log.db3-shm").unlink()
    before = {file.name: file.read_bytes() for file in killed.iterdir() if not file.name.endswith("-shm")}
    for path in (killed, killed / "log.db3"):
        frames, said = read(path)
        np.testing.assert_array_equal([frame.ranges for frame in frames], scans_of(drive(20)))
        assert said == ""
    assert before == {file.name: file.read_bytes() for file in killed.iterdir() if not file.name.endswith("-shm")}


def test_a_write_ahead_log_that_is_damaged_is_named(killed: Path) -> None:
    (killed / "log.db3-wal").write_bytes(b"damaged" * 1000)
    frames, said = read(killed / "log.db3")
    assert len(frames) == 10
    assert "log.db3-wal beside it is damaged: the messages in it are lost. The 10 frames" in said


def test_a_write_ahead_log_in_a_folder_that_cannot_be_written_to(killed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*arguments: Any, **options: Any) -> None:
        raise sqlite3.OperationalError("unable to open database file")

    monkeypatch.setattr(sqlite3, "connect", refuse)
    with pytest.raises(LogError, match=r"cannot be read together with log\.db3-wal beside it, .*copy both to a folder"):
        open_log(killed / "log.db3")


def test_an_empty_write_ahead_log_is_nothing(tmp_path: Path) -> None:
    path = write(tmp_path, "db3", drive(20))
    path.with_name("log.db3-wal").touch()
    frames, said = read(path)
    assert (len(frames), said) == (20, "")


def test_a_journal_of_a_recorder_that_was_killed_is_named(tmp_path: Path) -> None:
    path = write(tmp_path, "db3", drive(20))
    path.with_name("log.db3-journal").write_bytes(b"\xd9\xd5\x05\xf9\x20\xa1\x63\xd7" + bytes(504))
    frames, said = read(path)
    assert len(frames) == 20
    assert "log.db3-journal beside it says that the recorder was killed" in said


# Parts


@pytest.mark.parametrize("packed", [{0, 1, 2}, {0}, {1, 2}])
@pytest.mark.parametrize("ending", [".zstd", ".zst", ".gz"])
def test_a_folder_with_parts_that_are_packed_names_them(packed: set[int], ending: str, tmp_path: Path) -> None:
    folder = split(tmp_path, drive(30), 3)
    for part in packed:
        (folder / f"split_{part}.db3").rename(folder / f"split_{part}.db3{ending}")
    names = " ".join(f"split_{part}.db3{ending}" for part in sorted(packed))
    with pytest.raises(LogError, match=f"unpack its files first: zstd -d {names}"):
        open_log(folder)


def test_parts_that_are_unpacked_beside_the_packed_ones_are_read(tmp_path: Path) -> None:
    folder = split(tmp_path, drive(30), 3)
    for part in range(3):
        (folder / f"split_{part}.db3.zstd").touch()
    assert len(read(folder)[0]) == 30


def test_a_part_that_metadata_lists_and_that_is_missing(tmp_path: Path) -> None:
    folder = split(tmp_path, drive(30), 3)
    listed = "".join(f"    - split/split_{part}.db3\n" for part in range(3))
    (folder / "metadata.yaml").write_text(f"info:\n  version: 5\n  relative_file_paths:\n{listed}  duration: 3\n")
    assert read(folder)[1] == ""
    (folder / "split_1.db3").unlink()
    frames, said = read(folder)
    assert len(frames) == 20
    assert "split_1.db3 is missing, which metadata.yaml lists. The 20 frames" in said
    assert main(["replay", str(folder), "--rows", "0"]) == 5


def test_parts_that_were_renamed_are_not_missing(tmp_path: Path) -> None:
    folder = split(tmp_path, drive(20), 2)
    (folder / "metadata.yaml").write_text("  relative_file_paths:\n  - old_0.db3\n  - old_1.db3\n")
    frames, said = read(folder)
    assert (len(frames), said) == (20, "")


def test_a_bag_that_was_converted_in_its_folder_is_not_read_twice(tmp_path: Path) -> None:
    folder = split(tmp_path, drive(20), 1)
    (folder / "split_0.mcap").touch()
    with pytest.raises(LogError, match=r"holds split_0\.db3 and split_0\.mcap, the same messages twice"):
        open_log(folder)


def test_hidden_files_are_no_parts(tmp_path: Path) -> None:
    folder = split(tmp_path, drive(20), 2)
    for part in range(2):
        (folder / f"._split_{part}.db3").write_bytes(b"\0\5\x16\7" + bytes(4092))
    frames, said = read(folder)
    assert (len(frames), said) == (20, "")


# Files


@pytest.mark.parametrize("name", ["drive.bag.zst", "drive_0.db3.zstd", "drive.mcap.gz", "gap.csv.zip", "0.pcd.xz"])
def test_a_compressed_file_says_that_it_is_to_be_unpacked(name: str, tmp_path: Path) -> None:
    (tmp_path / name).touch()
    with pytest.raises(LogError, match=rf"is compressed; unpack it first, to {name.rpartition('.')[0]}$"):
        open_log(tmp_path / name)


def test_frames_that_cannot_be_unpacked_are_named(tmp_path: Path) -> None:
    for i in range(4):
        (tmp_path / f"{i}.bin").write_bytes(np.ones((3, 4), "<f4").tobytes())
    (tmp_path / "3.bin.zst").touch()  # is there unpacked as well
    assert read(tmp_path)[1] == ""
    for i in (4, 5):
        (tmp_path / f"{i}.bin.zst").touch()
    frames, said = read(tmp_path)
    assert len(frames) == 4
    assert "2 frames are compressed and were not read: unpack 4.bin.zst and the others" in said
