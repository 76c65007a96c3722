"""Files that are made to fill the memory or never to end: each reader bounds what it unpacks, and ends."""

import bz2
import gzip
import io
import os
import re
import sqlite3
import struct
import subprocess
import sys
import zipfile
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import lz4.frame  # type: ignore[import-untyped]
import numpy as np
import pytest
import zstandard
from mcap.writer import CompressionType, Writer

from tests.support.bags import Scan, drive, serialised, write
from tests.support.common import can_interrupt, interrupted_after, peak_of
from tests.support.log_files import PCD
from tests.support.opened import read
from ttc_fast.cli import main
from ttc_fast.logs import LogError, open_log
from ttc_fast.logs.rosbag2 import Budget, Database

SIZE = 400_000_000
"""Bytes that each bomb unpacks to."""
ENDLESS = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT "
MESSAGES = "i AS id, 1 AS topic_id, i AS timestamp, x'00' AS data FROM n"


def record(data: bytes, **fields: bytes) -> bytes:
    """Return a record of a ROS 1 bag."""
    parts = [name.encode() + b"=" + value for name, value in fields.items()]
    header = b"".join(struct.pack("<I", len(part)) + part for part in parts)
    return struct.pack("<I", len(header)) + header + struct.pack("<I", len(data)) + data


def bag(compression: bytes, packed: bytes, size: int = SIZE) -> bytes:
    """Return a bag of one chunk."""
    zero = struct.pack("<I", 0)
    head = record(b"", op=b"\x03", index_pos=struct.pack("<Q", 0), conn_count=zero, chunk_count=zero)
    chunk = record(packed, op=b"\x05", compression=compression, size=struct.pack("<I", size))
    return b"#ROSBAG V2.0\n" + head + chunk


def mcap(compression: bytes, packed: bytes, size: int = SIZE) -> bytes:
    """Return an MCAP file of one chunk."""
    chunk = struct.pack("<QQQII", 0, 0, size, 0, len(compression)) + compression
    chunk += struct.pack("<Q", len(packed)) + packed
    magic = b"\x89MCAP0\r\n"
    return magic + b"\x01" + struct.pack("<QII", 8, 0, 0) + b"\x06" + struct.pack("<Q", len(chunk)) + chunk


def zeros(pack: Callable[[bytes], bytes], size: int = SIZE) -> bytes:
    return pack(bytes(size))


def npz() -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr("ranges.npy", bytes(SIZE))
    return file.getvalue()


def database(path: Path, *statements: str) -> Path:
    """Write a database of rosbag2 with a topic of scans, and what the statements do."""
    with closing(sqlite3.connect(path)) as opened:
        opened.execute("CREATE TABLE topics (id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)")
        opened.execute("INSERT INTO topics VALUES (1, '/scan', 'sensor_msgs/msg/LaserScan', 'cdr')")
        for statement in statements:
            opened.execute(statement)
        opened.commit()
    return path


def bombs(folder: Path) -> Iterator[Path]:
    """Write a small file of each format that unpacks to ``SIZE`` bytes."""
    known, unknown = zstandard.ZstdCompressor(), zstandard.ZstdCompressor(write_content_size=False)
    packed = {"bz2": zeros(bz2.compress), "lz4": zeros(lz4.frame.compress), "zstd": zeros(known.compress)}
    gz = zeros(lambda content: gzip.compress(content, 1))
    files = {
        "a.bag": bag(b"bz2", packed["bz2"]),
        "b.bag": bag(b"lz4", packed["lz4"]),
        "a.mcap": mcap(b"zstd", packed["zstd"]),
        "b.mcap": mcap(b"lz4", packed["lz4"]),
        "c.mcap": mcap(b"zstd", packed["zstd"], size=1000),
        "d.mcap": mcap(b"lz4", packed["lz4"], size=1000),
        "e.mcap": mcap(b"zstd", zeros(unknown.compress), size=1000),
        "a.npz": npz(),
        "a.bin.gz": gz,
        "a.pcd.gz": gz,
        "a.log.gz": gz,
        "a.pcd": PCD.replace(b"40", b"25000000") + b"binary_compressed\n" + struct.pack("<II", 8, SIZE) + bytes(8),
    }
    for name, content in files.items():
        (folder / name).write_bytes(content)
        yield folder / name
    for name, pack in (("a.db3", known.compress), ("b.db3", unknown.compress)):
        table = "CREATE TABLE messages (id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)"
        row = f"INSERT INTO messages VALUES (1, 1, 0, x'{zeros(pack).hex()}')"
        yield database(folder / name, table, row)


READ_ALL = """
import resource, sys
import numpy, lz4.frame, zstandard
from ttc_fast.logs import LogError, open_log
for path in sys.argv[1:]:
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    try:
        said = str(sum(1 for _ in open_log(path)))
    except LogError as error:
        said = str(error)
    print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) // 1024, said.replace(chr(10), " "))
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="measures memory in KiB, as Linux has it")
def test_what_unpacks_to_too_much_is_refused_and_says_how_the_limit_is_raised(tmp_path: Path) -> None:
    paths = list(map(str, bombs(tmp_path)))
    done = subprocess.run([sys.executable, "-c", READ_ALL, *paths], capture_output=True, text=True, check=False)
    assert done.stderr == ""
    for path, line in zip(paths, done.stdout.splitlines(), strict=True):
        grown, said = line.split(" ", 1)
        assert int(grown) < 200, line  # MB
        if "0 frames" not in said or Path(path).name not in ("c.mcap", "d.mcap"):  # whose sizes contradict each other
            assert "raise the option max_unpacked" in said, line


@pytest.mark.parametrize("kind", ["bag.bz2", "bag.lz4", "db3.zstd", "mcap.zstd"])
def test_a_limit_is_raised_and_lowered(kind: str, tmp_path: Path) -> None:
    items = [Scan(i / 40, i / 40, np.zeros(100_000, np.float32)) for i in range(4)]
    path = write(tmp_path, kind, items)
    frames, said = read(path)
    assert (len(frames), said) == (4, "")
    frames, said = read(path, max_unpacked=0.01)
    assert not frames
    assert "unpack to more than" in said
    assert "raise the option max_unpacked" in said
    assert len(read(path, max_unpacked=2.0)[0]) == 4


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="measures memory in KiB, as Linux has it")
def test_a_cloud_of_many_lines_takes_little_more_memory_than_its_text(tmp_path: Path) -> None:
    lines = 20_000_000
    header = PCD.replace(b"40", str(lines).encode()) + b"ascii\n"
    (tmp_path / "a.pcd.gz").write_bytes(gzip.compress(header + b"11\n" * lines, 1))
    done = subprocess.run(
        [sys.executable, "-c", READ_ALL, str(tmp_path / "a.pcd.gz")], capture_output=True, text=True, check=False
    )
    grown, said = done.stdout.split(" ", 1)
    assert int(grown) < 200, done  # MB
    assert "numbers a line, and has 1 in point 0" in said


@pytest.mark.parametrize(
    ("name", "begin", "said"),
    [
        ("a.bag", bag(b"none", b"")[:-4] + b"\xff" * 4, "a record of 4294967295 bytes, more than 64 MB"),
        ("a.mcap", mcap(b"", b"", 0)[:25] + b"\x06" + struct.pack("<Q", 5 << 30), "a record of 5368709120 bytes"),
        (
            "b.mcap",
            mcap(b"", b"", 0)[:25] + b"\x09" + struct.pack("<Q", 5 << 30),
            "a record that does not say its kind",
        ),
        ("a.bin", b"", "is too large for one cloud: it has more than 2 GB"),
        ("a.pcd", PCD, "is too large for one cloud"),
        ("timestamps.txt", b"", "has more than 64 MB, which is no list of stamps"),
    ],
)
def test_what_a_file_says_is_long_is_not_read_at_once(name: str, begin: bytes, said: str, tmp_path: Path) -> None:
    """The files have holes, and take no place on the disk."""
    with (tmp_path / name).open("wb") as file:
        file.write(begin)
        file.truncate(6 << 30)
    if name == "timestamps.txt":
        (tmp_path / "1.bin").write_bytes(bytes(32))
    path = tmp_path if name == "timestamps.txt" else tmp_path / name

    def refuse() -> None:
        with pytest.raises(LogError, match=re.escape(said)):
            list(open_log(path))

    assert peak_of(refuse) < 300e6


def test_a_list_that_is_no_file_is_not_read(tmp_path: Path) -> None:
    path = write(tmp_path, "db3", drive(3))
    (path.parent / "metadata.yaml").unlink()
    os.mkfifo(path.parent / "metadata.yaml")
    assert len(read(path.parent)[0]) == 3


@pytest.mark.parametrize("stamp", ["1e9999999", "1e999990", "1e30", "-1e30", "nan", "sNaN", "inf", "9" * 5000])
def test_a_stamp_that_no_clock_gives_is_refused(stamp: str, tmp_path: Path) -> None:
    for i in range(2):
        (tmp_path / f"{i}.bin").write_bytes(bytes(32))
    (tmp_path / "timestamps.txt").write_text(f"0\n{stamp}")
    with pytest.raises(LogError, match="is no time"):
        open_log(tmp_path)


def test_a_message_about_a_log_is_short_and_does_nothing_to_a_terminal(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("\x1b[31m" + ",".join(["y" * 5000] * 100))
    with pytest.raises(LogError, match=r"its first line has \\x1b\[31my") as caught:
        open_log(tmp_path / "a.csv")
    assert len(str(caught.value)) < 2100


def test_chunks_of_zeros_are_damage(tmp_path: Path) -> None:
    for name, content in (
        ("a.bag", bag(b"bz2", zeros(bz2.compress, 60_000_000), 60_000_000)),
        ("a.mcap", mcap(b"zstd", zeros(zstandard.compress, 60_000_000), 60_000_000)),
    ):
        (tmp_path / name).write_bytes(content)
        assert "a record that does not say its kind" in read(tmp_path / name)[1]


def test_a_chunk_of_mcap_has_the_checksum_that_it_says(tmp_path: Path) -> None:
    with (tmp_path / "a.mcap").open("wb") as file:
        writer = Writer(file, compression=CompressionType.LZ4)
        writer.start("ros2", "test")
        schema = writer.register_schema("sensor_msgs/msg/LaserScan", "ros2msg", b"")
        channel = writer.register_channel("/scan", "cdr", schema)
        for i in range(3):
            writer.add_message(channel, i, serialised(Scan(i / 10, i / 10), "little"), i)
        writer.finish()  # type: ignore[no-untyped-call]
    assert len(read(tmp_path / "a.mcap")[0]) == 3


@pytest.mark.parametrize(
    ("statements", "name"),
    [
        ([f"CREATE VIEW messages AS {ENDLESS}{MESSAGES}"], "messages"),
        (
            [
                "CREATE TABLE messages (id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER,"
                " data BLOB AS (zeroblob(900000000)))",
                "INSERT INTO messages (id, topic_id, timestamp) VALUES (1, 1, 0)",
            ],
            "messages",
        ),
        (
            [f"CREATE VIEW MESSAGES AS {ENDLESS}{MESSAGES}"],
            "messages",
        ),
        (
            ["ALTER TABLE topics RENAME TO others", f"CREATE VIEW topics AS {ENDLESS} i, 'a', 'b', 'cdr' FROM n"],
            "topics",
        ),
    ],
)
def test_a_table_that_is_computed_is_refused(statements: list[str], name: str, tmp_path: Path) -> None:
    path = database(tmp_path / "log.db3", *statements)
    with pytest.raises(LogError, match=f"its {name} is no table, but computed"):
        open_log(path)
    assert main(["replay", str(path)]) == 3


@pytest.fixture
def endless(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A database whose messages never end, with a reader that takes it for a table that is damaged so."""
    monkeypatch.setattr(Database, "_check_tables", lambda *_: None)
    return database(
        tmp_path / "log.db3",
        f"CREATE VIEW messages AS {ENDLESS}i AS id, i + 1 AS topic_id, 0 AS timestamp, 0 AS data FROM n",
    )


def test_a_query_that_goes_around_in_circles_ends(endless: Path) -> None:
    with pytest.raises(LogError, match="damaged or cut short before the first message"):
        open_log(endless)


def test_rows_that_come_again_are_damage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Database, "_check_tables", lambda *_: None)
    rows = "SELECT i % 9 AS id, 1 AS topic_id, 0 AS timestamp, x'00' AS data FROM n"
    path = database(tmp_path / "log.db3", f"CREATE VIEW messages AS {ENDLESS}{rows[7:]}")
    with pytest.raises(LogError, match="damaged or cut short"):
        open_log(path)


@can_interrupt
def test_a_query_is_interrupted(endless: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    monkeypatch.setattr(Budget, "__init__", lambda self, _: setattr(self, "_left", 10**12))
    with interrupted_after(0.3), pytest.raises(KeyboardInterrupt):
        open_log(endless)
    with interrupted_after(0.3):
        assert main(["replay", str(endless)]) == 130
    assert capsys.readouterr().err == "ttc-fast: interrupted\n"


def test_a_device_is_no_log(tmp_path: Path) -> None:
    (tmp_path / "a.csv").symlink_to("/dev/zero")
    with pytest.raises(LogError, match="is neither a file nor a folder"):
        open_log(tmp_path / "a.csv")
    assert drive(1)
