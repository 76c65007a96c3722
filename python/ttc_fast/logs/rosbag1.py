"""ROS 1 bags (.bag, version 2.0), record by record.

A bag is read from record to record, without its index. So memory does not grow with the bag, and a bag that was cut
short or never closed is read as far as it goes. The index tells the topics, and where to go on behind damage.

https://wiki.ros.org/Bags/Format/2.0
"""

from __future__ import annotations

import bisect
import bz2
import struct
from typing import TYPE_CHECKING, BinaryIO, NamedTuple

from ttc_fast.logs.container import Topic, opened, plain_type
from ttc_fast.logs.files import UNPACKED, check_record, most_unpacked, too_much
from ttc_fast.logs.log import ReadErrors, need
from ttc_fast.ros_messages import ROS1

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator
    from pathlib import Path

    from ttc_fast.logs.container import Message

MAGIC = b"#ROSBAG V2.0\n"
MESSAGE, HEADER, INDEX, CHUNK, CHUNK_INFO, CONNECTION = range(2, 8)
LONGEST_HEADER = 1 << 20  # bytes; those of connections, which are the longest, hold names
U32, U64, TIME = struct.Struct("<I"), struct.Struct("<Q"), struct.Struct("<II")


class DamageError(Exception):
    """A record is not what the format says."""


class Record(NamedTuple):
    """A record: the fields of its header by their names, and where its data begin and end."""

    fields: dict[bytes, bytes]
    start: int
    end: int

    def number(self, name: bytes, kind: struct.Struct = U32) -> int:
        """Return a number of the header."""
        try:
            return int(kind.unpack(self.fields[name])[0])
        except (KeyError, struct.error):
            raise DamageError(f"a record without a sound {name.decode()!r}") from None

    @property
    def op(self) -> int:
        """The kind of the record; 0 if the header does not say it."""
        op = self.fields.get(b"op", b"")
        return op[0] if len(op) == 1 else 0


class Bag:
    """A ROS 1 bag.

    Parameters
    ----------
    path : Path
        The file.
    limit : int
        A chunk or a message may unpack to this many bytes.

    Raises
    ------
    LogError
        If it cannot be opened or is no such bag.
    """

    def __init__(self, path: Path, limit: int = UNPACKED) -> None:
        self.path = path
        self._limit = limit
        self._chunks: list[int] = []  # where they begin, if the index is sound
        self._counts: dict[int, int] = {}
        self._connections: dict[int, tuple[str, str]] = {}
        self._size = path.stat().st_size
        with opened(path, MAGIC, "ROS 1 bag") as file:
            self._read_index(file)
        if not self._connections:
            # Without an index all of the bag is read once to find the topics; errors are reported by the next reading.
            for _ in self.messages((), ReadErrors(path)):
                pass

    @property
    def topics(self) -> list[Topic]:
        """All topics; several connections may be of one."""
        found: dict[str, Topic] = {}
        for number, (name, kind) in self._connections.items():
            count = self._counts.get(number, 0) if self._chunks else None
            found[name] = Topic(name, kind, ROS1, count).joined(found.get(name))
        return list(found.values())

    def messages(self, names: Collection[str], errors: ReadErrors) -> Iterator[Message]:
        """Read the messages of these topics, and note what is damaged."""
        with self.path.open("rb") as file:
            at = len(MAGIC)
            while at < self._size:
                try:
                    record = _read_record(file, at, self._size)
                    if record.op == CHUNK:
                        yield from self._messages_of(*self._unpacked(file, record), names, errors, at)
                    elif record.op in (MESSAGE, CONNECTION):
                        plain = self._read(file, at, record.end)
                        yield from self._messages_of(plain, len(plain), names, errors, at)
                    at = record.end
                except (DamageError, OSError) as damage:
                    following = bisect.bisect_right(self._chunks, at)
                    known = following < len(self._chunks)
                    lost = "reading went on at the next chunk" if known else "what follows is lost"
                    errors.add(f"damaged or cut short at byte {at} of {self._size}: {damage}; {lost}")
                    if not known:
                        return
                    at = self._chunks[following]

    def _messages_of(
        self, chunk: bytes, size: int, names: Collection[str], errors: ReadErrors, place: int
    ) -> Iterator[Message]:
        """Read the messages of a chunk, which should have that size but may be cut short."""
        at = 0
        try:
            while at < len(chunk):
                fields, start, end = _record(chunk, at)
                op = fields.get(b"op")
                if op == b"\x02":
                    known = self._connections.get(U32.unpack(fields[b"conn"])[0])
                    if known is None:
                        errors.add(f"message at byte {at} of the chunk at byte {place}: of an unknown connection")
                    elif known[0] in names:
                        seconds, nanoseconds = TIME.unpack(fields[b"time"])
                        yield known[0], seconds * 1_000_000_000 + nanoseconds, chunk, start, end
                elif op == b"\x07":
                    self._connect(Record(fields, start, end), chunk)
                elif op is None:  # as in a chunk of zeros
                    raise DamageError("a record that does not say its kind")
                at = end
            if at < size:
                raise DamageError(f"{size - at} bytes are missing")
        except (DamageError, KeyError, struct.error) as damage:
            errors.add(f"chunk at byte {place} of {self._size} is damaged or cut short at its byte {at}: {damage}")

    def _unpacked(self, file: BinaryIO, record: Record) -> tuple[bytes, int]:
        """Decompress a chunk as far as it goes, and return it with the size that it should have."""
        size = record.number(b"size")
        kind = record.fields.get(b"compression", b"").decode("ascii", "replace")
        packed = self._read(file, record.start, record.end)
        if kind == "none":
            return packed, max(size, len(packed))
        most = most_unpacked(len(packed), self._limit)
        if size > most:
            raise DamageError(too_much(len(packed), most))
        if kind == "bz2":
            unpacker = bz2.BZ2Decompressor()
        elif kind == "lz4":
            unpacker = need("lz4.frame", self.path).LZ4FrameDecompressor()
        else:
            raise DamageError(f"unknown compression {kind!r}")
        try:
            return unpacker.decompress(packed, max_length=size), size
        except (OSError, RuntimeError, ValueError, EOFError, MemoryError) as error:
            raise DamageError(f"its {kind} compression is damaged") from error

    def _read(self, file: BinaryIO, start: int, end: int) -> bytes:
        """Read some bytes, unless they are more than a record has."""
        try:
            check_record(end - start, self._limit)
        except ValueError as error:
            raise DamageError(*error.args) from None
        file.seek(start)
        return file.read(end - start)

    def _read_index(self, file: BinaryIO) -> None:
        """Read the connections and chunks that are listed at the end; nothing if the list is not sound."""
        try:
            at = _read_record(file, len(MAGIC), self._size).number(b"index_pos", U64)
            if not at:  # the recorder never closed the bag
                return
            while at < self._size:
                record = _read_record(file, at, self._size)
                if record.op not in (CONNECTION, CHUNK_INFO):
                    at = record.end
                    continue
                content = self._read(file, record.start, record.end)
                if record.op == CONNECTION:
                    self._connect(record._replace(start=0, end=len(content)), content)
                else:
                    self._chunks.append(record.number(b"chunk_pos", U64))
                    for number, count in struct.iter_unpack("<II", content[: len(content) // 8 * 8]):
                        self._counts[number] = self._counts.get(number, 0) + count
                at = record.end
        except DamageError:
            self._chunks, self._counts, self._connections = [], {}, {}
        self._chunks.sort()

    def _connect(self, record: Record, buffer: bytes) -> None:
        """Note a connection: the number that its messages have, and their topic and type."""
        kind = _fields(buffer, record.start, record.end).get(b"type")
        topic = record.fields.get(b"topic")
        if kind is None or topic is None:
            raise DamageError("a connection without a topic or a type")
        names = topic.decode("utf-8", "replace"), plain_type(kind.decode("utf-8", "replace"))
        self._connections.setdefault(record.number(b"conn"), names)


def _read_record(file: BinaryIO, at: int, size: int) -> Record:
    """Read the header of a record in a file of that size. A chunk may be cut short, another record may not."""
    file.seek(at)
    length = _number(file.read(4))
    if length > LONGEST_HEADER:
        raise DamageError(f"a header of {length} bytes")
    header = file.read(length)
    data = _number(file.read(4))
    start = at + 8 + length
    record = Record(_fields(header, 0, len(header)), start, start + data)
    if record.op not in range(MESSAGE, CONNECTION + 1):
        raise DamageError("no record of a known kind")
    if record.end > size:
        if record.op != CHUNK:
            raise DamageError(f"a record of {data} bytes, {size - start} are left")
        record = record._replace(end=size)
    return record


def _record(chunk: bytes, at: int) -> tuple[dict[bytes, bytes], int, int]:
    """Find a record in a chunk: the fields of its header, and where its data begin and end."""
    start = at + 8 + U32.unpack_from(chunk, at)[0]
    fields = _fields(chunk, at + 4, start - 4)
    end = start + U32.unpack_from(chunk, start - 4)[0]
    if end > len(chunk):
        raise DamageError(f"a record of {end - start} bytes, {len(chunk) - start} are left")
    return fields, start, end


def _fields(buffer: bytes, at: int, end: int) -> dict[bytes, bytes]:
    """Split a header into its fields, each of which is name=value behind its length."""
    fields = {}
    if end > len(buffer):
        raise DamageError(f"a header of {end - at} bytes, {len(buffer) - at} are left")
    while at < end:
        begin = at + 4
        at = begin + _number(buffer[at:begin])
        name, equals, value = buffer[begin:at].partition(b"=")
        if at > end or not equals:
            raise DamageError("a header that cannot be read")
        fields[name] = value
    return fields


def _number(four: bytes) -> int:
    if len(four) < 4:
        raise DamageError("it ends there")
    return int.from_bytes(four, "little")
