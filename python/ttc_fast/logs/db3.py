"""rosbag2 databases (.db3), by SQLite, row by row in the order of recording."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from typing import TYPE_CHECKING, Any

from ttc_fast.logs.container import Topic, need, plain_type
from ttc_fast.logs.log import LogError
from ttc_fast.ros_messages import CDR

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator
    from pathlib import Path

    from ttc_fast.logs.container import Message
    from ttc_fast.logs.log import ReadErrors

ZSTD = b"\x28\xb5\x2f\xfd"
"""Begins a message that the recorder compressed by itself; CDR never begins so."""
# What SQLite raises over a damaged file: text that is none included.
DAMAGED = (sqlite3.Error, UnicodeDecodeError, MemoryError, OverflowError)


class Database:
    """A database of rosbag2.

    Parameters
    ----------
    path : Path
        Of the file.

    Raises
    ------
    LogError
        If it cannot be opened, or has no topics to be read.
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
        # By id, which is the order of recording: needs no sorting, and no index that may be damaged.
        query = f"SELECT id, topic_id, timestamp, data FROM messages WHERE topic_id IN ({_marks(wanted)}) ORDER BY id"
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


def _marks(wanted: dict[int, Any]) -> str:
    return ",".join("?" * len(wanted))
