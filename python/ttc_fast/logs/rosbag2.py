"""ROS 2 bags of rosbag2: SQLite databases (.db3), and the folders that a recording's .db3 or .mcap files lie in.

A database is read row by row in the order of recording. A recorder that was killed leaves its last messages in a
write-ahead log beside it (``.db3-wal``), which SQLite reads with it.

The files of a folder are read one after another. ``metadata.yaml`` is not needed: the files say the same, and a
recorder that crashed leaves none. Where it is there, it tells of files that are missing.
"""

from __future__ import annotations

import re
import sqlite3
from contextlib import closing
from typing import TYPE_CHECKING, Any

from ttc_fast.logs.container import Topic, plain_type
from ttc_fast.logs.files import UNPACKED, files_in, kind_of_file, most_unpacked, unpack_zstd, unpacked_name
from ttc_fast.logs.log import REPAIR, LogError
from ttc_fast.logs.mcap import McapFile
from ttc_fast.logs.stamps import natural
from ttc_fast.ros_messages import CDR

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator
    from pathlib import Path

    from ttc_fast.logs.container import Container, Message
    from ttc_fast.logs.log import ReadErrors

SUFFIXES = (".db3", ".mcap")
LARGEST_METADATA = 1 << 22  # bytes
WAL_MAGIC = (b"\x37\x7f\x06\x82", b"\x37\x7f\x06\x83")
ZSTD = b"\x28\xb5\x2f\xfd"
"""The first bytes of a message that the recorder compressed by itself; CDR never begins so."""
# What SQLite raises over a damaged file, such as one whose text is not UTF-8.
DAMAGED = (sqlite3.Error, UnicodeDecodeError, MemoryError, OverflowError)


class Budget:
    """Ends a query that takes more steps than a file of that size has rows for, and lets an interrupt come through.

    SQLite calls it every ``STEPS`` steps. A damaged file may lead it around in circles.
    """

    STEPS = 100_000

    def __init__(self, size: int) -> None:
        self._left = 10 + 4 * size // self.STEPS

    def __call__(self) -> int:
        """Count one more; return whether the query is to end."""
        self._left -= 1
        return self._left < 0

    def raise_interrupt(self, error: BaseException) -> None:
        """Raise an interrupt that ended the query: SQLite swallows what a call of this raises."""
        if str(error) == "interrupted" and self._left >= 0:
            raise KeyboardInterrupt from None


class Database:
    """A database of rosbag2.

    Parameters
    ----------
    path : Path
        The file.
    limit : int
        A chunk or a message may unpack to this many bytes.

    Raises
    ------
    LogError
        If it cannot be opened, or has no topics that can be read.
    """

    def __init__(self, path: Path, limit: int = UNPACKED) -> None:
        self.path = path
        self._limit = limit
        budget = Budget(self._size)
        try:
            with closing(self._open(budget)) as database:
                self._check_tables(database)
                rows = list(database.execute("SELECT id, name, type, serialization_format FROM topics"))
        except DAMAGED as error:
            budget.raise_interrupt(error)
            if self._has("-wal"):
                problem = f"cannot be read together with {path.name}-wal beside it, which has its last messages"
                raise LogError(path, f"{problem}; copy both to a folder that can be written to") from error
            other = kind_of_file(path)
            damaged = not other or other.startswith("an SQLite")
            got = f"or is damaged: its topics cannot be read; {REPAIR}" if damaged else f"but {other}"
            raise LogError(path, f"is no rosbag2 database, {got}") from error
        if not all(isinstance(number, int) and isinstance(name, str) for number, name, *_ in rows):
            raise LogError(path, "is a damaged rosbag2 database: its topics have no names")
        self._names = {number: name for number, name, _, form in rows if form == "cdr"}
        self.topics = [Topic(name, plain_type(str(kind)), CDR) for _, name, kind, form in rows if form == "cdr"]

    def messages(self, names: Collection[str], errors: ReadErrors) -> Iterator[Message]:
        """Read the messages of these topics, and note what is damaged."""
        wanted = {number: name for number, name in self._names.items() if name in names}
        self._check_beside(errors)
        marks = ",".join("?" * len(wanted))
        # By id, which is the order of recording: needs no sorting, and no index that may be damaged.
        query = f"SELECT id, topic_id, timestamp, data FROM messages WHERE topic_id IN ({marks}) ORDER BY id"
        last: Any = None
        budget = Budget(self._size)
        try:
            with closing(self._open(budget)) as database:
                for row, number, time, data in database.execute(query, tuple(wanted)):
                    if not isinstance(row, int) or (last is not None and row <= last):
                        raise sqlite3.DatabaseError
                    last = row
                    if not isinstance(data, bytes) or not isinstance(time, int):
                        errors.add(f"row {last} of messages is damaged")
                        continue
                    if data.startswith(ZSTD):
                        data = self._unpacked(data, last, errors)
                    yield wanted[number], time, data, 0, len(data)
        except DAMAGED as error:
            budget.raise_interrupt(error)
            where = "before the first message" if last is None else f"after row {last} of messages"
            errors.add(f"damaged or cut short {where}; what follows is lost")

    def _open(self, budget: Budget) -> sqlite3.Connection:
        # Immutable: no lock and no journal is looked for, so that logs in read-only places can be read.
        how = "" if self._has("-wal") else "&immutable=1"
        database = sqlite3.connect(f"{self.path.resolve().as_uri()}?mode=ro{how}", uri=True)
        database.set_progress_handler(budget, budget.STEPS)
        if hasattr(database, "setlimit"):  # from Python 3.11 on; nothing in the file is longer than the file
            database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, max(self._size, 1 << 20))
        return database

    @property
    def _size(self) -> int:
        """The bytes of the database and of what lies beside it."""
        beside = self.path.with_name(f"{self.path.name}-wal")
        return self.path.stat().st_size + (beside.stat().st_size if beside.is_file() else 0)

    def _check_tables(self, database: sqlite3.Connection) -> None:
        """Refuse what only looks like a table: a view or a computed column may have rows without end."""
        for name in ("topics", "messages"):
            named = "SELECT type, rootpage FROM sqlite_master WHERE name = ? COLLATE NOCASE"
            found = database.execute(named, (name,)).fetchone()
            hidden = database.execute("SELECT max(hidden) FROM pragma_table_xinfo(?)", (name,)).fetchone()[0]
            if found and (found[0] != "table" or not found[1] or (hidden or 0) > 1):
                raise LogError(self.path, f"is no rosbag2 database: its {name} is no table, but computed")

    def _unpacked(self, data: bytes, row: int, errors: ReadErrors) -> bytes:
        """Unpack a message; nothing is left of one that cannot be."""
        try:
            return unpack_zstd(data, most_unpacked(len(data), self._limit), errors.path)
        except ValueError as error:
            errors.add(f"row {row} of messages is damaged: it cannot be unpacked: {error}")
            return b""

    def _has(self, ending: str) -> bool:
        """Whether a file with something in it lies beside the database."""
        beside = self.path.with_name(self.path.name + ending)
        return beside.is_file() and beside.stat().st_size > 0

    def _check_beside(self, errors: ReadErrors) -> None:
        """Note what a recorder that was killed left beside the database and SQLite cannot read."""
        name = self.path.name
        if self._has("-wal"):
            with self.path.with_name(f"{name}-wal").open("rb") as file:
                if file.read(4) not in WAL_MAGIC:
                    errors.add(f"{name}-wal beside it is damaged: the messages in it are lost")
        if self._has("-journal"):
            errors.add(f"{name}-journal beside it says that the recorder was killed: the last messages may be missing")


class BagFolder:
    """A folder of rosbag2, its files one after another.

    Parameters
    ----------
    path : Path
        The folder.
    limit : int
        A chunk or a message may unpack to this many bytes.

    Raises
    ------
    LogError
        If a file cannot be opened, or one is compressed.
    """

    def __init__(self, path: Path, limit: int = UNPACKED) -> None:
        self.path = path
        present = [file.name for file in files_in(path)]
        files = sorted((name for name in present if _is_part(name)), key=natural)
        packed = [name for name in present if _is_packed_part(name) and unpacked_name(name) not in files]
        if packed:
            names = " ".join(sorted(packed, key=natural)[:9])
            raise LogError(path, f"cannot be read as a folder of rosbag2; unpack its files first: zstd -d {names}")
        if not files:
            raise LogError(path, f"cannot be read as a folder of rosbag2; it has no {' or '.join(SUFFIXES)} file")
        stems: dict[str, str] = {}
        for name in files:
            other = stems.setdefault(name.rpartition(".")[0], name)
            if other != name:
                raise LogError(path, f"holds {other} and {name}, the same messages twice; take one of them away")
        listed = _listed(path)
        renamed = len(listed) <= len(files)
        self._missing = [] if renamed else [name for name in listed if unpacked_name(name) not in files]
        self._parts: list[Container] = [_open(path / name, limit) for name in files]
        self.topics = self._all_topics()

    def messages(self, names: Collection[str], errors: ReadErrors) -> Iterator[Message]:
        """Read the messages of these topics, and note what is damaged or missing."""
        for missing in self._missing:
            errors.add(f"{missing} is missing, which metadata.yaml lists")
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
    return any(_is_part(file.name) or _is_packed_part(file.name) for file in files_in(path))


def _is_part(name: str) -> bool:
    return name.lower().endswith(SUFFIXES)


def _is_packed_part(name: str) -> bool:
    return unpacked_name(name) != name and _is_part(unpacked_name(name))


def _listed(folder: Path) -> list[str]:
    """Return the files that metadata.yaml lists, if it is there and can be read."""
    path = folder / "metadata.yaml"
    if not path.is_file():
        return []
    with path.open("rb") as file:
        text = file.read(LARGEST_METADATA).decode("utf-8", "replace")
    listed = re.search(r"^ *relative_file_paths: *\n((?: *- .*\n?)*)", text, re.MULTILINE)
    lines = listed[1].splitlines() if listed else []
    return [line.partition("- ")[2].strip().strip("'\"").rpartition("/")[2] for line in lines]


def _open(file: Path, limit: int) -> Container:
    return Database(file, limit) if file.suffix.lower() == ".db3" else McapFile(file, limit)
