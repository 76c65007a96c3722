"""CARMEN logs (.log, .log.gz, .clf): scans and poses as lines of text.

The first word of a line says what it is, and its last three are the stamp (s), the host, and the time of logging:

- ``ROBOTLASER1`` and ``RAWLASER1``: laser type, start angle, field of view, angular resolution, maximum range,
  accuracy, remission mode; the number of readings and the readings, the number of remissions and the remissions.
  ROBOTLASER1 goes on with the poses of the laser and of the robot, which tell where the laser sits, and with speeds.
- ``FLASER``, the older format: the number of readings and the readings, the pose of the laser and that of the odometry.
  It does not say the angles and the range. These scanners look ahead over half a turn, and give 50 m and more where
  nothing came back.
- ``ODOM``: the pose of the odometry, and speeds.

A second laser has lines of its own (``ROBOTLASER2``, ``RLASER``).

https://carmen.sourceforge.net/logger_playback.html
"""

from __future__ import annotations

import math
import zlib
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ttc_fast._settings import option
from ttc_fast.logs.files import kind_of_file, open_text, plain_number
from ttc_fast.logs.log import LogError, ReadErrors, ScanFrame, Scanner
from ttc_fast.logs.options import SCANNER
from ttc_fast.sensors.oddities import RefusedError
from ttc_fast.sensors.odometry import Odometer, Pose

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from ttc_fast.logs.options import LogOptions

DAMAGED = (EOFError, zlib.error, OSError)
LASERS = ("ROBOTLASER1", "FLASER", "RAWLASER1", "ROBOTLASER2", "RLASER", "RAWLASER2", "RAWLASER3", "RAWLASER4")
"""The lines that hold scans, first those that are read where a log has several."""
UNSAID = ("FLASER", "RLASER")
"""The older lines, which do not say the angles and the range."""
BEHIND = ("ROBOTLASER2", "RLASER", "RAWLASER2")
"""The lines of a second laser."""
LOOKED_AT = 1000  # lines, from which the lasers of a log are known
LONGEST_LINE = 1 << 20  # characters
MOST_BEAMS = 100_000
RANGE_MAX = 49.9  # m; FLASER gives 81.91, 51.15, 51.14 or 50 where nothing came back
SICK_CODES = 81.8  # m; scanners of SICK give 81.83 and more where something went wrong
MAX_SPEED_AGE = 5.0  # s; logs that were thinned out have a pose every few seconds


class _LineError(Exception):
    """A line is not what its first word says."""


class Scan(NamedTuple):
    """A line that holds a scan."""

    stamp: float
    ranges: NDArray[np.float32]
    pose: Pose | None
    scanner: Scanner


class CarmenLog:
    """The scans of one laser of a CARMEN log.

    Where a log has several, the front one is read, and ``assumed`` says so; the option ``topic`` chooses another by the
    first word of its lines. The speed is by the poses: of ``ODOM`` lines if there are any, else of the scans. Stamps
    are those of the messages, s since the first scan.

    Parameters
    ----------
    path : Path
        The file.
    options : LogOptions
        What the user says of it.

    Raises
    ------
    LogError
        If it cannot be read, or has no scans. While iterating, after the last frame, if something was damaged.
    """

    frame_count = None
    clock = "stamps of the log"

    def __init__(self, path: Path, options: LogOptions) -> None:
        options.only(("topic", *SCANNER, "speed", "max_speed_age"), path, "a CARMEN log")
        self.path = path
        self._options = options
        self.motion = options.motion("poses of the log")
        self.always_has_speed = options.speed is not None
        self._laser, self.assumed = self._choose()
        errors = ReadErrors(path)
        first = next((entry for entry in self._entries(errors) if isinstance(entry, Scan)), None)
        if first is None:
            errors.raise_if_any(0)
            raise LogError(path, f"has no {self._laser} lines that can be read; was anything recorded?")
        self._begin = first.stamp
        self._recorded = first.scanner
        self.scanner = options.applied(first.scanner, SCANNER)

    def __iter__(self) -> Iterator[ScanFrame]:
        errors, frames = ReadErrors(self.path), 0
        age = self._options.max_speed_age
        odometer = Odometer(self._options.speed, MAX_SPEED_AGE if age is None else age)
        odometry = False
        for entry in self._entries(errors):
            if not isinstance(entry, Scan):
                odometry = True
                try:
                    odometer.update(*entry)
                except RefusedError as error:
                    errors.add(f"odometry at {entry[0] - self._begin:.3f} s {error}")
                continue
            unlike = _unlike(entry.scanner, self._recorded)
            if unlike:
                errors.add(f"the scan at {entry.stamp - self._begin:.3f} s has {unlike}")
                continue
            if not odometry and entry.pose is not None:
                odometer.update(entry.stamp, entry.pose)
            frames += 1
            yield ScanFrame(entry.stamp - self._begin, entry.ranges, *odometer.at(entry.stamp))
        errors.raise_if_any(frames)

    def _choose(self) -> tuple[str, str]:
        """Choose the laser by the first lines of the log; say what else it has."""
        errors, found = ReadErrors(self.path), {}
        for number, words in self._lines(errors):
            found[words[0]] = True
            if number >= LOOKED_AT and any(laser in found for laser in LASERS):
                break
        lasers = [laser for laser in LASERS if laser in found]
        topic = self._options.topic
        if topic is not None:
            if topic not in lasers:
                has = ", ".join(lasers) or "none"
                raise LogError(self.path, f"has no laser {topic}; it has {has}: choose with {option('topic')}")
            return topic, ""
        if not lasers:
            errors.raise_if_any(0)
            has = ", ".join([word for word in found if word.isascii() and word.isupper()][:9]) or "other words"
            problem = f"has no {' or '.join(LASERS[:3])} lines: it is no CARMEN log, or one without scans"
            other = "" if self.path.suffix.lower() == ".gz" else kind_of_file(self.path)
            raise LogError(
                self.path, f"{problem}; it is {other}" if other else f"{problem}; its lines begin with {has}"
            )
        chosen = lasers[0]
        said = [f"beams over half a turn, up to {RANGE_MAX} m"] if chosen in UNSAID else []
        others = [laser for laser in lasers if laser in BEHIND]
        if others and chosen not in BEHIND:
            has = ", ".join(others)
            said.append(f"the front laser, {chosen}; the log has {has} too, choose with {option('topic')}")
        return chosen, "; ".join(said)

    def _entries(self, errors: ReadErrors) -> Iterator[Scan | tuple[float, Pose]]:
        """Read scans, and poses with their stamps."""
        for number, words in self._lines(errors):
            try:
                if words[0] == self._laser:
                    yield _old_scan(words) if self._laser in UNSAID else _scan(words)
                elif words[0] == "ODOM":
                    yield _pose(words)
            except (ValueError, OverflowError, FloatingPointError):
                errors.add(f"line {number} is damaged: {words[0]} with a word that is no number")
            except _LineError as error:
                errors.add(f"line {number} is damaged: {error}")

    def _lines(self, errors: ReadErrors) -> Iterator[tuple[int, list[str]]]:
        """Read lines, as words."""
        number = 0
        try:
            with open_text(self.path, self._options.unpacked) as file:
                while line := file.readline(LONGEST_LINE):
                    number += 1
                    words = line.split()
                    if words and not words[0].startswith("#"):
                        yield number, words
        except DAMAGED:
            errors.add(f"damaged or cut short after line {number}; what follows is lost")


def _scan(words: list[str]) -> Scan:
    """Read a line that says the angles and the range itself: of a robot with its poses, or of a laser alone."""
    robot = words[0].startswith("ROBOT")
    _need(words, 10)
    start, turn, step, furthest = map(float, words[2:6])
    beams = _beams(words[8])
    behind = 9 + beams
    tail = 14 if robot else 3
    if len(words) > behind + tail and words[behind].isdecimal():  # older logs have no remissions
        behind += 1 + int(words[behind])
    if len(words) != behind + tail:
        raise _LineError(f"{words[0]} with {beams} beams must have {behind + tail} words, got {len(words)}")
    increment = step if step > 0.0 else turn / max(beams - 1, 1)
    furthest = float(np.nextafter(furthest, 0.0)) if furthest > 0.0 else RANGE_MAX  # at which nothing came back
    mount, pose = (0.0, 0.0, 0.0), None
    if robot:
        laser, pose = (Pose(*map(float, words[at : at + 3])) for at in (behind, behind + 3))
        mount = _between(pose, laser)
    scanner = Scanner(start, increment, beams, 0.0, min(furthest, SICK_CODES), mount)
    if not all(map(math.isfinite, (start, increment, scanner.range_max, *scanner.mount))):
        raise _LineError(f"{words[0]} with angles or poses that are not finite")
    return Scan(_stamp(words), _readings(words[9 : 9 + beams]), pose, scanner)


def _old_scan(words: list[str]) -> Scan:
    """Read a line that does not say its angles: 181 beams have both ends of half a turn, 180 and 360 only the right."""
    _need(words, 2)
    beams = _beams(words[1])
    if len(words) != 11 + beams:
        raise _LineError(f"{words[0]} with {beams} beams must have {11 + beams} words, got {len(words)}")
    increment = math.pi / (beams - 1 if beams % 2 else beams)
    mount = (0.0, 0.0, math.pi if words[0] in BEHIND else 0.0)
    scanner = Scanner(-math.pi / 2, increment, beams, 0.0, RANGE_MAX, mount)
    x, y, yaw = map(float, words[2 + beams : 5 + beams])
    return Scan(_stamp(words), _readings(words[2 : 2 + beams]), Pose(x, y, yaw), scanner)


def _pose(words: list[str]) -> tuple[float, Pose]:
    _need(words, 10)
    x, y, yaw = map(float, words[1:4])
    return float(words[7]), Pose(x, y, yaw)


def _readings(words: list[str]) -> NDArray[np.float32]:
    """Read distances; one that is too large for its type would be read as inf, which is free space."""
    with np.errstate(over="raise"):
        readings = np.array(words, np.float32)
    for at in np.flatnonzero(np.isinf(readings)):
        plain_number(words[at])
    return readings


def _stamp(words: list[str]) -> float:
    stamp = float(words[-3])
    if not math.isfinite(stamp):
        raise _LineError(f"{words[0]} with the stamp {stamp}")
    return stamp


def _beams(word: str) -> int:
    beams = int(word)
    if not 1 < beams <= MOST_BEAMS:
        raise _LineError(f"a scan of {beams} beams")
    return beams


def _need(words: list[str], count: int) -> None:
    if len(words) < count:
        raise _LineError(f"{words[0]} with {len(words)} words")


def _between(robot: Pose, laser: Pose) -> tuple[float, float, float]:
    """Return where the laser sits on the robot."""
    x, y, turned = laser.x - robot.x, laser.y - robot.y, math.remainder(laser.yaw - robot.yaw, 2.0 * math.pi)
    ahead, left = math.cos(robot.yaw), math.sin(robot.yaw)
    return x * ahead + y * left, y * ahead - x * left, turned


def _unlike(scanner: Scanner, first: Scanner) -> str:
    """Say in what a scan is unlike the first; empty if in nothing."""
    if scanner.beams != first.beams:
        return f"{scanner.beams} beams, not {first.beams}"
    if (scanner.angle_min, scanner.angle_increment) != (first.angle_min, first.angle_increment):
        return "other angles than the first"
    return ""
