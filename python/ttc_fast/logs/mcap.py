"""MCAP files (.mcap) of ROS messages, by the package mcap.

A file is read from record to record. So memory does not grow with it, and a file that was cut short or never closed is
read as far as it goes.

https://mcap.dev/spec
"""

from __future__ import annotations

import io
import struct
import zlib
from typing import TYPE_CHECKING, Any

from ttc_fast.logs.container import Topic, opened, plain_type
from ttc_fast.logs.files import UNPACKED, check_record, most_unpacked, too_much, unpack_lz4, unpack_zstd
from ttc_fast.logs.log import ReadErrors, need
from ttc_fast.ros_messages import CDR, ROS1

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator
    from pathlib import Path

    from ttc_fast.logs.container import Message

FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, STATISTICS = 2, 3, 4, 5, 6, 11
# The beginnings of a record and of a message, and the footer.
RECORD, HEAD, END = struct.Struct("<BQ"), struct.Struct("<HIQQ"), struct.Struct("<BQQQI")
MAGIC = b"\x89MCAP0\r\n"
ENCODINGS = {"cdr": CDR, "ros1": ROS1}
# What the mcap package and its decompressors raise over a damaged record.
DAMAGED = (ValueError, EOFError, RuntimeError, MemoryError, KeyError, OverflowError, struct.error, OSError)


class McapFile:
    """An MCAP file of ROS messages.

    Parameters
    ----------
    path : Path
        The file.
    limit : int
        A chunk or a message may unpack to this many bytes.

    Raises
    ------
    LogError
        If it cannot be opened or is no such file.
    """

    def __init__(self, path: Path, limit: int = UNPACKED) -> None:
        self.path = path
        self._limit = limit
        self._records = kinds = need("mcap.records", path)
        self._kinds = {
            SCHEMA: kinds.Schema,
            CHANNEL: kinds.Channel,
            MESSAGE: kinds.Message,
            CHUNK: kinds.Chunk,
            STATISTICS: kinds.Statistics,
        }
        self._stream = need("mcap.data_stream", path).ReadDataStream
        self._damaged = (*DAMAGED, need("mcap.exceptions", path).McapError, need("zstandard", path).ZstdError)
        self._channels: dict[int, Topic] = {}
        self._others: dict[int, Topic] = {}
        """The channels in another encoding, such as JSON, which are named and not read."""
        self._size = path.stat().st_size
        with opened(path, MAGIC, "MCAP file") as file:
            self._read_summary(file)
        if not self._channels and not self._others:
            # Without a summary the file is read once to find the topics; errors are reported by the next reading.
            for _ in self.messages((), ReadErrors(path)):
                pass

    @property
    def topics(self) -> list[Topic]:
        """All topics; several channels may be of one."""
        found: dict[str, Topic] = {}
        for topic in self._channels.values():
            found[topic.name] = topic.joined(found.get(topic.name))
        return list(({topic.name: topic for topic in self._others.values()} | found).values())

    def messages(self, names: Collection[str], errors: ReadErrors) -> Iterator[Message]:
        """Read the messages of these topics, and note what is damaged."""
        schemas: dict[int, str] = {}
        kinds = self._records
        with self.path.open("rb") as file:
            for record in self._all(file, errors):
                if isinstance(record, kinds.Message):
                    topic = self._channels.get(record.channel_id)
                    if topic is not None:
                        if topic.name in names:
                            yield topic.name, record.log_time, record.data, 0, len(record.data)
                    elif record.channel_id not in self._others:
                        errors.add(f"a message of an unknown channel, before byte {file.tell()} of {self._size}")
                elif isinstance(record, kinds.Schema):
                    schemas[record.id] = record.name
                elif isinstance(record, kinds.Channel):
                    self._add(record, schemas, None)

    def _all(self, file: Any, errors: ReadErrors) -> Iterator[Any]:
        """Read all records, also those in chunks. A damaged chunk is left out."""
        at = len(MAGIC)
        while True:
            try:
                record, following = self._read(file, at)
            except self._damaged as damage:
                errors.add(f"damaged or cut short at byte {at} of {self._size}: {_said(damage)}; what follows is lost")
                return
            if following is None:
                return
            try:
                if isinstance(record, self._records.Chunk):
                    yield from self._records_of(self._unpacked(record))
                elif record is not None:
                    yield record
            except self._damaged as damage:
                errors.add(f"chunk at byte {at} of {self._size} is damaged and left out: {_said(damage)}")
            at = following

    def _read(self, file: Any, at: int) -> tuple[Any, int | None]:
        """Read the record at a place, None if it is of no use here, and return where the next is; None at the end."""
        file.seek(at)
        opcode, length = RECORD.unpack(file.read(RECORD.size))
        begin = at + RECORD.size
        if opcode == FOOTER:
            return None, None
        if not opcode:
            raise ValueError("a record that does not say its kind")
        if begin + length > self._size:
            raise EOFError(f"a record of {length} bytes, {self._size - begin} are left")
        if opcode not in self._kinds:
            return None, begin + length
        check_record(length, self._limit)
        return self._parsed(opcode, file.read(length), 0, length), begin + length

    def _parsed(self, opcode: int, buffer: bytes, begin: int, end: int) -> Any:
        """Return the record with this content."""
        if opcode != MESSAGE:
            return self._kinds[opcode].read(self._stream(io.BytesIO(buffer[begin:end])))
        channel, sequence, logged, published = HEAD.unpack_from(buffer, begin)
        return self._records.Message(
            channel_id=channel,
            log_time=logged,
            data=buffer[begin + HEAD.size : end],
            publish_time=published,
            sequence=sequence,
        )

    def _unpacked(self, chunk: Any) -> bytes:
        """Unpack a chunk, and compare its checksum."""
        packed: bytes = chunk.data
        most = min(most_unpacked(len(packed), self._limit), chunk.uncompressed_size)
        if chunk.uncompressed_size > most:
            raise ValueError(too_much(len(packed), most))
        unpack = {"": lambda packed, *_: packed, "zstd": unpack_zstd, "lz4": unpack_lz4}.get(chunk.compression)
        if unpack is None:
            raise ValueError(f"unknown compression {chunk.compression!r}")
        unpacked: bytes = unpack(packed, most, self.path)
        if chunk.uncompressed_crc and zlib.crc32(unpacked) != chunk.uncompressed_crc:
            raise ValueError("crc validation failed: its checksum is that of other bytes")
        return unpacked

    def _records_of(self, chunk: bytes) -> Iterator[Any]:
        """Read the records of a chunk, one by one."""
        at = 0
        while at < len(chunk):
            opcode, length = RECORD.unpack_from(chunk, at)
            begin, at = at + RECORD.size, at + RECORD.size + length
            if at > len(chunk):
                raise EOFError(f"a record of {length} bytes, {len(chunk) - begin} are left")
            if opcode in (SCHEMA, CHANNEL, MESSAGE):
                yield self._parsed(opcode, chunk, begin, at)
            elif not opcode:
                raise ValueError("a record that does not say its kind")

    def _read_summary(self, file: Any) -> None:
        """Note the channels that are listed at the end, if they are."""
        schemas: dict[int, str] = {}
        channels, counts, kinds = [], None, self._records
        try:
            file.seek(-(END.size + len(MAGIC)), io.SEEK_END)
            opcode, _, at, *_ = END.unpack(file.read(END.size))
            following = at if opcode == FOOTER and at else None
            while following is not None:
                record, following = self._read(file, following)
                if isinstance(record, kinds.Schema):
                    schemas[record.id] = record.name
                elif isinstance(record, kinds.Channel):
                    channels.append(record)
                elif isinstance(record, kinds.Statistics):
                    counts = record.channel_message_counts
        except self._damaged:
            return
        for channel in channels:
            self._add(channel, schemas, None if counts is None else counts.get(channel.id, 0))

    def _add(self, channel: Any, schemas: dict[int, str], count: int | None) -> None:
        encoding = ENCODINGS.get(channel.message_encoding)
        kind = plain_type(schemas.get(channel.schema_id, ""))
        if encoding is not None:
            self._channels.setdefault(channel.id, Topic(channel.topic, kind, encoding, count))
        else:
            kind = f"{kind} in {channel.message_encoding or 'no encoding'}, which is not read".lstrip()
            self._others.setdefault(channel.id, Topic(channel.topic, kind, CDR, count))


def _said(damage: BaseException) -> str:
    return str(damage) or type(damage).__name__
