"""What the readers of bags have in common: topics, and messages in the order in which they were recorded."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple, Protocol

from ttc_fast.logs.files import kind_of
from ttc_fast.logs.log import LogError

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator
    from pathlib import Path

    from ttc_fast.logs.log import ReadErrors
    from ttc_fast.ros_messages import Encoding


class Topic(NamedTuple):
    """A topic of a bag.

    Attributes
    ----------
    name : str
        The name, as it was recorded.
    type : str
        The type of its messages as ROS 1 writes it, "sensor_msgs/LaserScan".
    encoding : Encoding
        How its messages are serialised.
    messages : int or None
        How many messages there are; None when that is only known after reading.
    """

    name: str
    type: str
    encoding: Encoding
    messages: int | None = None

    def joined(self, other: Topic | None) -> Topic:
        """Return the topic with the messages of another part of it."""
        if other is None:
            return self
        known = self.messages is not None and other.messages is not None
        return self._replace(messages=(self.messages or 0) + (other.messages or 0) if known else None)


Message = tuple[str, int, Any, int, int]
"""A message: its topic, when it was recorded (ns), a buffer, and where the message begins and ends in the buffer."""


class Container(Protocol):
    """A bag, whatever its format."""

    @property
    def path(self) -> Path:
        """The file or folder."""

    @property
    def topics(self) -> list[Topic]:
        """All topics."""

    def messages(self, names: Collection[str], errors: ReadErrors) -> Iterator[Message]:
        """Read the messages of these topics, and note what is damaged."""


@contextmanager
def opened(path: Path, magic: bytes, kind: str) -> Iterator[BinaryIO]:
    """Open a file, and refuse it if its first bytes are not those of its kind."""
    try:
        with path.open("rb") as file:
            start = file.read(len(magic))
            if start != magic:
                other = kind_of(start + file.read(64))
                got = f"but {other}" if other else f"or is damaged: it must begin with {magic!r}, got {start!r}"
                raise LogError(path, f"is no {kind}, {got}")
            yield file
    except OSError as error:
        raise LogError(path, f"cannot be opened: {error.strerror or error}") from error


def plain_type(name: str) -> str:
    """Return the name of a type as ROS 1 writes it."""
    return name.replace("/msg/", "/")
