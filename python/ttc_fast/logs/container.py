"""What bags have in common: topics, and their messages in the order in which they were recorded."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple, Protocol

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
        As it was recorded.
    type : str
        As ROS 1 writes it, "sensor_msgs/LaserScan".
    encoding : Encoding
        Of its messages.
    messages : int or None
        How many there are; None when only reading tells.
    """

    name: str
    type: str
    encoding: Encoding
    messages: int | None = None

    def joined(self, other: Topic | None) -> Topic:
        """Add the messages of another part of the same topic."""
        if other is None:
            return self
        known = self.messages is not None and other.messages is not None
        return self._replace(messages=(self.messages or 0) + (other.messages or 0) if known else None)


Message = tuple[str, int, Any, int, int]
"""Name of the topic, when it was recorded (ns), the buffer that it lies in, and from and to which byte."""


class Container(Protocol):
    """A bag, whatever its format."""

    @property
    def path(self) -> Path:
        """Of the file or folder."""

    @property
    def topics(self) -> list[Topic]:
        """All topics."""

    def messages(self, names: Collection[str], errors: ReadErrors) -> Iterator[Message]:
        """Read the messages of these topics, and note what is damaged."""


@contextmanager
def opened(path: Path, magic: bytes, kind: str) -> Iterator[BinaryIO]:
    """Open a file that must begin as its kind does."""
    try:
        with path.open("rb") as file:
            start = file.read(len(magic))
            if start != magic:
                raise LogError(path, f"is no {kind}: it must begin with {magic!r}, got {start!r}")
            yield file
    except OSError as error:
        raise LogError(path, f"cannot be opened: {error.strerror or error}") from error


def plain_type(name: str) -> str:
    """Write the type as ROS 1 does."""
    return name.replace("/msg/", "/")
