"""CARMEN logs (.log, .log.gz): scans and poses as lines of text."""

from __future__ import annotations

import gzip
import math
import zlib
from contextlib import contextmanager
from typing import TYPE_CHECKING, BinaryIO, NamedTuple

import numpy as np

from ttc_fast.logs.log import LogError, ReadErrors, ScanFrame, Scanner
from ttc_fast.logs.motion import Odometer, Pose
from ttc_fast.logs.options import SCANNER

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from ttc_fast.logs.options import LogOptions

DAMAGED = (EOFError, zlib.error, OSError)
AFTER_RANGES = 9  # x y theta odom_x odom_y odom_theta stamp host stamp
LONGEST_LINE = 1 << 20  # bytes
MOST_BEAMS = 100_000
# The logs do not say it. Where nothing came back, these scanners give 50 m and more (81.91, 51.15, 51.14, 50).
RANGE_MAX = 49.9
MAX_SPEED_AGE = 5.0  # s; logs that were thinned out have a pose every few seconds


class Scan(NamedTuple):
    """A line that begins with FLASER."""

    stamp: float
    ranges: NDArray[np.float32]
    pose: Pose


class CarmenLog:
    """A CARMEN log of one laser scanner that looks ahead over half a turn.

    ``FLASER`` lines are the scans, from right to left. The speed is by the poses: of ``ODOM`` lines if there are any,
    else of the scans. Stamps are those of the messages, s since the first scan.

    Parameters
    ----------
    path : Path
        Of the file.
    options : LogOptions
        What the user says of it.

    Raises
    ------
    LogError
        If it cannot be read, or has no scans. While iterating, after the last frame, if something was damaged.
    """

    frame_count = None
    clock = "stamps of the log"
    assumed = ""

    def __init__(self, path: Path, options: LogOptions) -> None:
        options.only((*SCANNER, "speed", "max_speed_age"), path, "a CARMEN log")
        self.path = path
        self._options = options
        self.motion = options.motion("poses of the log")
        errors = ReadErrors(path)
        first = next((entry for entry in self._entries(errors) if isinstance(entry, Scan)), None)
        if first is None:
            errors.raise_if_any(0)
            raise LogError(path, "has no FLASER lines: it is no CARMEN log, or one without scans")
        self._begin = first.stamp
        self.scanner = options.applied(_scanner(len(first.ranges)), SCANNER)

    def __iter__(self) -> Iterator[ScanFrame]:
        errors, frames, beams = ReadErrors(self.path), 0, self.scanner.beams
        age = self._options.max_speed_age
        odometer = Odometer(self._options.speed, MAX_SPEED_AGE if age is None else age)
        odometry = False
        for entry in self._entries(errors):
            if not isinstance(entry, Scan):
                odometry = True
                odometer.update(*entry)
                continue
            if len(entry.ranges) != beams:
                errors.add(f"the scan at {entry.stamp - self._begin:.3f} s has {len(entry.ranges)} beams, not {beams}")
                continue
            if not odometry:
                odometer.update(entry.stamp, entry.pose)
            frames += 1
            yield ScanFrame(entry.stamp - self._begin, entry.ranges, *odometer.at(entry.stamp))
        errors.raise_if_any(frames)

    def _entries(self, errors: ReadErrors) -> Iterator[Scan | tuple[float, Pose]]:
        """Read scans, and poses with their stamps."""
        number = 0
        try:
            with _open(self.path) as file:
                while line := file.readline(LONGEST_LINE):
                    number += 1
                    try:
                        if line.startswith(b"FLASER "):
                            yield _scan(line.split())
                        elif line.startswith(b"ODOM "):
                            yield _pose(line.split())
                    except (ValueError, IndexError) as error:
                        errors.add(f"line {number} is damaged: {error}")
        except DAMAGED as error:
            errors.add(f"damaged or cut short after line {number}: {error}; what follows is lost")


@contextmanager
def _open(path: Path) -> Iterator[BinaryIO]:
    """Open a file, unpacking it if its name ends in .gz."""
    with path.open("rb") as file:
        if path.suffix.lower() == ".gz":
            with gzip.open(file) as unpacked:
                yield unpacked  # type: ignore[misc]
        else:
            yield file


def _scanner(beams: int) -> Scanner:
    """Half a turn: 181 beams have both ends of it, 180 and 360 only the right one."""
    increment = math.pi / (beams - 1 if beams % 2 else beams)
    return Scanner(-math.pi / 2, increment, beams, range_min=0.0, range_max=RANGE_MAX)


def _scan(words: list[bytes]) -> Scan:
    beams = int(words[1])
    if not 1 < beams <= MOST_BEAMS or len(words) != 2 + beams + AFTER_RANGES:
        raise ValueError(f"FLASER with {beams} beams must have {11 + beams} words, got {len(words)}")
    x, y, yaw, _, _, _, stamp = map(float, words[2 + beams : 9 + beams])
    if not math.isfinite(stamp):
        raise ValueError(f"FLASER with the stamp {stamp}")
    return Scan(stamp, np.array(words[2 : 2 + beams], np.float32), Pose(x, y, yaw))


def _pose(words: list[bytes]) -> tuple[float, Pose]:
    x, y, yaw, stamp = (float(words[i]) for i in (1, 2, 3, 7))
    return stamp, Pose(x, y, yaw)
