"""What a log is to everything that reads one, whatever the sensor and the format.

A format is one file beside this one: a class with the attributes of ``ScanLog``, ``CloudLog`` or ``DistanceLog``.
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
    """A recording. Iterating reads it from the start, in the order of recording, and holds a few frames at most.

    What a reader can know before reading is checked when it is made. Iterating gives every frame that can be read; if
    something was lost on the way, it raises ``LogError`` after the last of them, which says what. Stamps increase,
    except in bags, which hold whatever was sent.
    """

    @property
    def path(self) -> Path:
        """Where it was read from, for messages."""

    @property
    def frame_count(self) -> int | None:
        """How many frames there are; None when only reading tells."""

    def __iter__(self) -> Iterator[FrameT_co]:
        """All frames."""


class ReadErrors:
    """The errors of reading a log, collected while the rest of it is read.

    Parameters
    ----------
    path : Path
        The log, which the final error names.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.part = ""
        """Which file of it is being read, where it has several."""
        self._first: list[str] = []
        self._count = 0

    def add(self, problem: str) -> None:
        """Note an error: where it is, what is wrong there, and what is lost by it."""
        self._count += 1
        if self._count <= 3:  # a log that is damaged all over must not fill the memory
            self._first.append(f"{self.part}: {problem}" if self.part else problem)

    def raise_if_any(self, frames: int) -> None:
        """Raise ``LogError`` if there were any errors; ``frames`` is how many frames could be read."""
        if not self._count:
            return
        more = f"; and {self._count - len(self._first)} more" if self._count > len(self._first) else ""
        raise LogError(self.path, f"{'; '.join(self._first)}{more}. The {frames} frames that could be read were given")
