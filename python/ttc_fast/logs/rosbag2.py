"""ROS 2 bags of rosbag2: SQLite databases (.db3), and the folders that a recording's .db3 or .mcap files lie in.

A database is read row by row in the order of recording. The files of a folder are read one after another.
``metadata.yaml`` is not needed: the files say the same, and a recorder that crashed leaves none.
"""

from __future__ import annotations

import re
import sqlite3
from contextlib import closing
from typing import TYPE_CHECKING

from ttc_fast.logs.container import Topic, plain_type
from ttc_fast.logs.log import LogError, files_in, need
from ttc_fast.logs.mcap import McapFile
from ttc_fast.ros_messages import CDR

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator
    from pathlib import Path

    from ttc_fast.logs.container import Container, Message
    from ttc_fast.logs.log import ReadErrors

SUFFIXES = (".db3", ".mcap")
PACKED = tuple(f"{suffix}.zstd" for suffix in SUFFIXES)
ZSTD = b"\x28\xb5\x2f\xfd"
"""The first bytes of a message that the recorder compressed by itself; CDR never begins so."""
# What SQLite raises over a damaged file, such as one whose text is not UTF-8.
DAMAGED = (sqlite3.Error, UnicodeDecodeError, MemoryError, OverflowError)


class Database:
    """A database of rosbag2.

    Parameters
    ----------
    path : Path
        The file.

    Raises
    ------
    LogError
        If it cannot be opened, or has no topics that can be read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            with closing(self._open()) as database:
                rows = list(database.execute("SELECT id, name, type, serialization_format FROM topics"))
        except DAMAGED as error:
            raise LogError(path, f"is no rosbag2 database, or is damaged: {error}") from error
        if not all(isinstance(number, int) and isinstance(name, str) for number, name, *_ in rows):
            raise LogError(path, "is a damaged rosbag2 database: its topics have no names")
        self._names = {number: name for number, name, _, form in rows if form == "cdr"}
        self.topics = [Topic(name, plain_type(str(kind)), CDR) for _, name, kind, form in rows if form == "cdr"]

    def messages(self, names: Collection[str], errors: ReadErrors) -> Iterator[Message]:
        """Read the messages of these topics, and note what is damaged."""
        wanted = {number: name for number, name in self._names.items() if name in names}
        marks = ",".join("?" * len(wanted))
        # By id, which is the order of recording: needs no sorting, and no index that may be damaged.
        query = f"SELECT id, topic_id, timestamp, data FROM messages WHERE topic_id IN ({marks}) ORDER BY id"
        last = None
        try:
            with closing(self._open()) as database:
                for last, number, time, data in database.execute(query, tuple(wanted)):
                    if not isinstance(data, bytes) or not isinstance(time, int):
                        errors.add(f"row {last} of messages is damaged")
                        continue
                    if data.startswith(ZSTD):
                        data = _unpacked(data, last, errors)
                    yield wanted[number], time, data, 0, len(data)
        except DAMAGED as error:
            where = "before the first message" if last is None else f"after row {last} of messages"
            errors.add(f"damaged or cut short {where}: {error}; what follows is lost")

    def _open(self) -> sqlite3.Connection:
        # Immutable: no lock and no journal is looked for, so that logs in read-only places can be read.
        return sqlite3.connect(f"{self.path.resolve().as_uri()}?mode=ro&immutable=1", uri=True)


def _unpacked(data: bytes, row: int, errors: ReadErrors) -> bytes:
    zstandard = need("zstandard", errors.path)
    try:
        unpacked: bytes = zstandard.ZstdDecompressor().decompressobj().decompress(data)
    except (zstandard.ZstdError, MemoryError) as error:
        errors.add(f"row {row} of messages is damaged: {error}")
        return b""
    return unpacked


class BagFolder:
    """A folder of rosbag2, its files one after another.

    Parameters
    ----------
    path : Path
        The folder.

    Raises
    ------
    LogError
        If a file cannot be opened, or all are compressed.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        files = [file for file in files_in(path) if file.name.lower().endswith(SUFFIXES)]
        if not files:
            packed = next((file.name for file in files_in(path) if file.name.lower().endswith(PACKED)), None)
            how = f"unpack its files first: zstd -d {packed}" if packed else f"it has no {' or '.join(SUFFIXES)} file"
            raise LogError(path, f"cannot be read as a folder of rosbag2; {how}")
        files.sort(key=_in_order)
        self._parts: list[Container] = [_open(file) for file in files]
        self.topics = self._all_topics()

    def messages(self, names: Collection[str], errors: ReadErrors) -> Iterator[Message]:
        """Read the messages of these topics, and note what is damaged."""
        for part in self._parts:
            errors.part = part.path.name
            yield from part.messages(names, errors)

    def _all_topics(self) -> list[Topic]:
        found: dict[str, Topic] = {}
        for part in self._parts:
            for topic in part.topics:
                found[topic.name] = topic.joined(found.get(topic.name))
        return list(found.values())


def is_bag_folder(path: Path) -> bool:
    """Whether a folder looks like one of rosbag2."""
    return any(file.name.lower().endswith((*SUFFIXES, *PACKED)) for file in files_in(path))


def _open(file: Path) -> Container:
    return Database(file) if file.suffix.lower() == ".db3" else McapFile(file)


def _in_order(file: Path) -> list[tuple[int, str]]:
    """Sort by the numbers in the name, so that part 10 comes after part 9."""
    return [(int(digits or -1), text) for text, digits in re.findall(r"(\D*)(\d*)", file.name)]
