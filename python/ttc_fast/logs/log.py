"""What a log is to everything that reads one, whatever the sensor and the format.

A format is one file beside this one: a class with the attributes of ``ScanLog`` or ``CloudLog``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, TypeVar

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

FrameT_co = TypeVar("FrameT_co", covariant=True)


class LogError(Exception):
    """A log that cannot be read: which file, what is wrong with it, and what would be right."""

    def __init__(self, path: Path, problem: str) -> None:
        super().__init__(f"{path}: {problem}")


class Log(Protocol[FrameT_co]):
    """A recording. Iterating reads it from the start, in the order of its stamps, which increase.

    What a reader can know before reading is checked when it is made; iterating may raise ``LogError`` at a damaged
    record, after the frames before it.
    """

    @property
    def path(self) -> Path:
        """Where it was read from, for messages."""

    @property
    def frame_count(self) -> int | None:
        """How many frames there are; None when only reading tells."""

    def __iter__(self) -> Iterator[FrameT_co]:
        """All frames."""
