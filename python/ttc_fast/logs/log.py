"""What a log is to everything that reads one.

A format is one file beside this one: a class with the attributes of ``ScanLog``, named in ``FORMATS`` of the package.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray


class LogError(Exception):
    """A log that cannot be read: which file, what is wrong with it, and what would be right."""

    def __init__(self, path: Path, problem: str) -> None:
        super().__init__(f"{path}: {problem}")


@dataclass(frozen=True)
class Scanner:
    """The scanner of a log, and where it sits: arguments of ``ScanTTC``, by their names there.

    Attributes
    ----------
    angle_min, angle_increment : float
        rad, in the sensor frame.
    beams : int
        Readings of each scan.
    range_min, range_max : float
        m; finite readings outside are discarded.
    mount : (float, float, float)
        x, y (m) and yaw (rad) in the vehicle frame.
    outline : (float, float, float, float) or None
        x_rear, x_front, y_right, y_left of the vehicle, m; None when the log does not say.
    """

    angle_min: float
    angle_increment: float
    beams: int
    range_min: float
    range_max: float
    mount: tuple[float, float, float] = (0.0, 0.0, 0.0)
    outline: tuple[float, float, float, float] | None = None


class ScanFrame(NamedTuple):
    """One scan and the motion of the vehicle at that time.

    Attributes
    ----------
    stamp : float
        s, since whatever the log counts from.
    ranges : ndarray, float32 or float64, shape (beams,)
        m, as recorded: error codes, NaN and inf included. Stays as it is when the log is read on.
    speed : float or None
        Of the vehicle's origin, forward, m/s, negative when reversing; None when the log does not know.
    yaw_rate : float
        Counter-clockwise, rad/s; 0 when the log does not know.
    """

    stamp: float
    ranges: NDArray[Any]
    speed: float | None
    yaw_rate: float = 0.0


class ScanLog(Protocol):
    """A log of laser scans. Iterating reads it from the start, in the order of its stamps.

    What a reader can know before reading is checked when it is made; iterating may raise ``LogError`` at a damaged
    record, after the frames before it.
    """

    @property
    def path(self) -> Path:
        """Where it was read from, for messages."""

    @property
    def scanner(self) -> Scanner:
        """The scanner of every frame."""

    @property
    def frame_count(self) -> int | None:
        """How many frames there are; None when only reading tells."""

    def __iter__(self) -> Iterator[ScanFrame]:
        """All frames."""
