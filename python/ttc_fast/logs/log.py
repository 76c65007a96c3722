"""What a log is to everything that reads one: the frames of its three kinds, and the errors of reading it.

A log is a recording of laser scans, of point clouds or of distances. Each format is read by one file of this package,
by a class that has the attributes of ``ScanLog``, ``CloudLog`` or ``DistanceLog``.

A log that is damaged still gives every frame that can be read. Its reader collects what is wrong in a ``ReadErrors``
on the way, and raises one ``LogError`` after the last frame.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeVar, runtime_checkable

import numpy as np

from ttc_fast._core import Gate
from ttc_fast._extras import install

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path
    from types import ModuleType

    from numpy.typing import NDArray

    from ttc_fast.sensors.scans import Geometry

FrameT_co = TypeVar("FrameT_co", covariant=True)
Axes = tuple[str, str, str]
REP_103: Axes = ("x", "y", "z")
REPAIR = "copy it again, or leave it out"
"""What to do about a damaged file."""
MOST_SAID = 2000
"""The most characters of a message about a log."""


# Errors


ORIGINS: dict[str, str] = {}
"""Where copies in the scratch folder of this process come from: path to URL."""


def origin(path: Path | str) -> str:
    """Return the name of a log for people: the URL of a copy, of any other file its path."""
    text = str(path)
    for copy, url in list(ORIGINS.items()):
        if text == copy or text.startswith(copy + os.sep):
            return url + text[len(copy) :]
    return text


class LogError(Exception):
    """A log cannot be read: the message says which file, what is wrong with it, and what would be right."""

    def __init__(self, path: Path | str, problem: str) -> None:
        super().__init__(origin(path), problem)  # both, so that it pickles: it goes from one process to another

    def __str__(self) -> str:
        """Return which file, and what is wrong, as a terminal can show it: a log may hold names of any length."""
        said = "{}: {}".format(*self.args)
        if len(said) > MOST_SAID:
            said = f"{said[: MOST_SAID // 2]} ... {said[-MOST_SAID // 2 :]}"
        return "".join(each if each.isprintable() else repr(each)[1:-1] for each in said)


class UselessOptionError(LogError):
    """A log has no use for an option."""


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
        """The file that is being read, where the log has several."""
        self._first: dict[str, list[Any]] = {}
        self._more = 0

    def add(self, problem: str) -> None:
        """Note an error: where it is, what is wrong there, and what is lost by it."""
        problem = f"{self.part}: {problem}" if self.part else problem
        kind = re.sub(r"[\d.]+", "", problem)  # those that differ in a time or a place are of one kind
        if kind in self._first or len(self._first) < 3:  # a log that is damaged all over must not fill the memory
            self._first.setdefault(kind, [problem, 0])[1] += 1
        else:
            self._more += 1

    def raise_if_any(self, frames: int) -> None:
        """Raise ``LogError`` if there were any errors; ``frames`` is how many frames could be read."""
        if not self._first:
            return
        first = [f"{problem}, and {n - 1} more like it" if n > 1 else problem for problem, n in self._first.values()]
        more = f"; and {self._more} more" if self._more else ""
        raise LogError(self.path, f"{'; '.join(first)}{more}. The {frames} frames that could be read were given")


def need(package: str, path: Path) -> ModuleType:
    """Import a package of the extra ``log``, without which this log cannot be read."""
    try:
        return import_module(package)
    except ImportError as error:
        name = package.partition(".")[0]
        raise LogError(path, f"needs {name} to be read, which is not installed: {install('log')}") from error


# Logs


class Log(Protocol[FrameT_co]):
    """A recording. Iterating reads it from the start, in the order of recording, and holds a few frames at most.

    A reader checks on opening what it can know before it reads the frames. Iterating gives every frame that can be
    read; if something was lost on the way, it raises ``LogError`` after the last of them, which says what. Stamps
    increase, except in bags, which hold whatever was sent.
    """

    @property
    def path(self) -> Path:
        """The file or folder, for messages."""

    @property
    def frame_count(self) -> int | None:
        """How many frames there are; None when that is only known after reading."""

    @property
    def clock(self) -> str:
        """Where the stamps come from, for people."""

    @property
    def assumed(self) -> str:
        """What the reader assumed because the log does not say it, for people; empty if nothing."""

    def __iter__(self) -> Iterator[FrameT_co]:
        """All frames."""


# Scans


@dataclass(frozen=True)
class Scanner:
    """The scanner of a log, and where it sits: the fields are arguments of ``ScanTTC``, by their names there.

    Attributes
    ----------
    angle_min, angle_increment : float
        The angle of the first beam, and from each beam to the next, rad, in the sensor frame.
    beams : int
        How many readings each scan has.
    range_min, range_max : float
        Finite readings outside of these limits are discarded, m.
    mount : (float, float, float)
        The sensor's x, y (m) and yaw (rad) in the vehicle frame.
    outline : (float, float, float, float) or None
        The vehicle's x_rear, x_front, y_right, y_left, m; None when the log does not say.
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
        The time of the scan, s; the log chooses where it counts from.
    ranges : ndarray, float32 or float64, shape (beams,)
        The readings as recorded, m: error codes, NaN and inf included. Stays valid when the log is read on.
    speed : float or None
        The forward speed of the vehicle's origin, m/s, negative when reversing; None when the log does not know it, or
        knows only an old one.
    yaw_rate : float
        Counter-clockwise, rad/s; 0 when the log does not know it.
    speed_age : float
        How much older than the scan the odometry is that the motion comes from, s; 0 where both were recorded together
        or the user gave the speed, inf where there was none yet.
    lateral_speed : float
        The speed of the vehicle's origin to the left, m/s; 0 when the log does not know it.
    time_increment : float
        The time between two beams of this scan, s; 0 when the log does not know it.
    geometry : Geometry or None
        Where the beams of this scan point, where its log says it for each; None where they are those of the log's
        ``scanner``.
    recorded : int or None
        When a bag recorded it, ns since 1970; None in other logs.
    """

    stamp: float
    ranges: NDArray[Any]
    speed: float | None
    yaw_rate: float = 0.0
    speed_age: float = 0.0
    lateral_speed: float = 0.0
    time_increment: float = 0.0
    geometry: Geometry | None = None
    recorded: int | None = None


@runtime_checkable
class ScanLog(Log[ScanFrame], Protocol):
    """A log of laser scans."""

    @property
    def scanner(self) -> Scanner:
        """The scanner of every frame."""

    @property
    def always_has_speed(self) -> bool:
        """Whether every frame has a speed, as that of odometry which may fail has not."""

    @property
    def motion(self) -> str:
        """Where the speeds come from, for people."""


# Clouds


@dataclass(frozen=True)
class Lidar:
    """Where the lidar of a log sits on its vehicle.

    Attributes
    ----------
    sensor_height : float or None
        The height above the road, m; None when the log does not say.
    front_offset : float
        The distance from the sensor to the bumper, m; 0 when the log does not say, so that distances are measured from
        the sensor.
    vehicle_reach : float or None
        How far ahead of the sensor the vehicle itself is seen, m; None when it is not known.
    height : (float, float)
        The heights above the road between which other vehicles are seen well, m.
    axes : (str, str, str)
        Which stored coordinates of the points are forward, left and up, as in ``Gate``.
    """

    sensor_height: float | None
    front_offset: float = 0.0
    vehicle_reach: float | None = None
    height: tuple[float, float] = (0.2, 2.0)
    axes: Axes = REP_103

    @property
    def own_reach(self) -> float:
        """Points ahead that are nearer than this are taken for the vehicle itself, m.

        Where it is not known how far the vehicle reaches, it is 1.5 times ``sensor_height``, as in ``Gate.above_road``;
        0 where that is not known either.
        """
        if self.vehicle_reach is not None:
            return self.vehicle_reach
        return 0.0 if self.sensor_height is None else Gate.above_road(self.sensor_height).x[0]


class CloudFrame(NamedTuple):
    """One cloud and the motion of the vehicle at that time.

    Attributes
    ----------
    stamp : float
        The time of the cloud, s; the log chooses where it counts from.
    points : ndarray, float32 or float64, shape (N, 3) or wider; or records with fields x, y and z
        x, y, z (m), and perhaps the intensity, as recorded; ``Lidar.axes`` says which of them is forward. Stays valid
        when the log is read on.
    speed, yaw_rate, speed_age, lateral_speed
        The motion, as in ``ScanFrame``.
    recorded : int or None
        When a bag recorded it, as in ``ScanFrame``.
    """

    stamp: float
    points: NDArray[Any]
    speed: float | None = None
    yaw_rate: float = 0.0
    speed_age: float = 0.0
    lateral_speed: float = 0.0
    recorded: int | None = None


@runtime_checkable
class CloudLog(Log[CloudFrame], Protocol):
    """A log of point clouds."""

    @property
    def lidar(self) -> Lidar:
        """The lidar of every frame."""

    @property
    def has_speed(self) -> bool:
        """Whether frames may have a speed: there is odometry, or the user gives the speed."""

    @property
    def motion(self) -> str:
        """Where the speeds come from, for people."""


def forward_left_up(points: NDArray[Any], axes: Axes = REP_103) -> NDArray[Any]:
    """Return points as plain rows of x forward, y left, z up and perhaps the intensity, for drawing; a copy if needed.

    Parameters
    ----------
    points : ndarray
        The points of a ``CloudFrame``.
    axes : (str, str, str)
        The axes of its ``Lidar``.

    Returns
    -------
    ndarray, shape (N, 3) or wider

    Examples
    --------
    >>> import numpy as np
    >>> from ttc_fast.logs import forward_left_up
    >>> forward_left_up(np.array([[1.0, 2.0, 3.0]]), ("y", "-x", "z"))
    array([[ 2., -1.,  3.]])
    """
    if points.dtype.names is None and axes == REP_103:
        return points.reshape(-1, points.shape[-1])
    columns = _columns(points)
    oriented = [-columns[axis[1:]] if axis.startswith("-") else columns[axis] for axis in axes]
    return np.column_stack([*oriented, *([columns["intensity"]] if "intensity" in columns else [])])


def _columns(points: NDArray[Any]) -> dict[str, NDArray[Any]]:
    names = ("x", "y", "z", "intensity")
    if points.dtype.names is None:
        return {name: points[..., i].ravel() for i, name in enumerate(names[: points.shape[-1]])}
    return {name: points[name].ravel() for name in names if name in points.dtype.names}


# Distances


class DistanceFrame(NamedTuple):
    """One distance to what is ahead.

    Attributes
    ----------
    stamp : float
        The time of the measurement, s; the log chooses where it counts from.
    distance : float
        The distance, m; NaN where nothing was measured.
    speed : float or None
        The forward speed of the vehicle if the user gave it, m/s.
    """

    stamp: float
    distance: float
    speed: float | None = None


@runtime_checkable
class DistanceLog(Log[DistanceFrame], Protocol):
    """A log of distances."""

    @property
    def column(self) -> str:
        """The column of the table that the distances are read from."""

    @property
    def unit(self) -> str:
        """The unit of that column; frames are in m."""
