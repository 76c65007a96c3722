"""Logs of point clouds with a file for each: a folder of them, or a single one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast._settings import option
from ttc_fast.logs.files import files_in, unpacked_name
from ttc_fast.logs.log import CloudFrame, LogError, ReadErrors
from ttc_fast.logs.options import LIDAR
from ttc_fast.logs.stamps import LISTS, Series, frame_numbers, read_stamps, series_of
from ttc_fast.logs.table import LONG

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from ttc_fast.logs.log import Lidar
    from ttc_fast.logs.options import LogOptions

UNNAMED = "names of stamps alone"
OPTIONS = ("topic", *LIDAR, "rate", "speed")


@dataclass(frozen=True)
class CloudFormat:
    """A format of clouds, one a file.

    Attributes
    ----------
    name : str
        The name of the format, for people.
    suffixes : tuple of str
        The endings of the files' names, in lower case, without and with compression.
    lidar : Lidar
        Where the lidar sits, as far as the format says.
    rate : float
        How many frames a second are assumed where nothing says when they were.
    read : function
        Reads a file, of which a compressed one may unpack to that many bytes.
    """

    name: str
    suffixes: tuple[str, ...]
    lidar: Lidar
    rate: float
    read: Callable[[Path, int], NDArray[Any]]

    def has(self, path: Path) -> bool:
        """Whether the name is that of a frame."""
        return path.name.lower().endswith(self.suffixes)

    def has_packed(self, path: Path) -> bool:
        """Whether the name is that of a compressed frame."""
        return self.has(Path(unpacked_name(path.name)))

    def stem(self, path: Path) -> str:
        """Return the name of a frame without its ending."""
        suffix = max((suffix for suffix in self.suffixes if path.name.lower().endswith(suffix)), key=len)
        return path.name[: -len(suffix)]


class CloudFiles:
    """A folder of clouds, or a single one.

    The order of the frames is that of the stamps or numbers in their names. Stamps are those of a list beside the
    frames, such as ``timestamps.txt``, else those in the names; without either a rate is assumed, and ``assumed`` says
    so. A folder with the frames of several sensors or vehicles is several logs, of which the option ``topic`` chooses
    one; without it the one with the most frames is read, and the others are reported as an error.

    Parameters
    ----------
    path : Path
        The folder, or a file. Frames are read one by one, while iterating.
    form : CloudFormat
        The format of the files.
    options : LogOptions
        What the user says of them.

    Raises
    ------
    LogError
        If there are none, or the stamps do not fit them. While iterating, if a frame cannot be read; after the last
        frame, if there are frames of other sensors.
    """

    def __init__(self, path: Path, form: CloudFormat, options: LogOptions) -> None:
        options.only(OPTIONS, path, form.name)
        self.path = path
        self._form = form
        self._limit = options.unpacked
        self._errors = ReadErrors(path)
        series = self._chosen(options.topic) if path.is_dir() else Series("", [path], None)
        self._frames = series.frames
        self.frame_count = len(self._frames)
        self.lidar = options.applied(form.lidar, LIDAR)
        is_usual = form.lidar.sensor_height is not None and options.sensor_height is None
        self.height_of = form.name if is_usual else ""
        """The format whose usual car says the height of the lidar, where nothing else does."""
        self._speed = options.speed
        self.has_speed = options.speed is not None
        self.motion = options.motion("the speed is unknown")
        self.assumed = ""
        self._stamps, self.clock = self._timed(series, options.rate)

    def __iter__(self) -> Iterator[CloudFrame]:
        for stamp, frame in zip(self._stamps, self._frames, strict=True):
            yield CloudFrame(float(stamp), self._form.read(frame, self._limit), self._speed)
        self._errors.raise_if_any(self.frame_count)

    def _timed(self, series: Series, rate: float | None) -> tuple[NDArray[np.float64], str]:
        """Find the stamps, and where they come from."""
        if rate is not None:
            return self._at(rate), f"{rate:g} frames a second"
        if self.path.is_dir():
            places = (folder / name for folder in (self.path, self.path.parent) for name in LISTS)
            listed = next((file for file in places if file.is_file()), None)
            if listed:
                stamps = read_stamps(listed, self._frames)
                if len(stamps) > 1 and (step := np.diff(stamps).min()) > LONG:
                    what = f"the stamps of {listed.name} are {step:g} s apart or more, read as they are"
                    self.assumed = f"{what}: a line is a number of seconds, or a date and a time of day"
                return stamps, f"stamps of {listed}"
        if series.stamps is not None:
            return series.stamps, "stamps in the names"
        rate = self._form.rate
        if self.frame_count > 1:
            self.assumed = (
                f"{rate:g} frames a second, as neither the names nor a {LISTS[0]} say when the frames were; every "
                f"speed and time to collision rests on it: say it with {option('rate')}"
            )
        return self._at(rate), f"no {LISTS[0]}, so {rate:g} frames a second are assumed"

    def _at(self, rate: float) -> NDArray[np.float64]:
        """Return stamps by a rate. Where the names count the frames, a gap in their numbers is a gap in time."""
        numbers = frame_numbers([self._form.stem(frame) for frame in self._frames]) or range(self.frame_count)
        return np.array([number - numbers[0] for number in numbers], np.float64) / rate

    def _chosen(self, topic: str | None) -> Series:
        """Choose the frames of one sensor in a folder."""
        path, form = self.path, self._form
        frames = [file for file in files_in(path) if form.has(file)]
        if not frames:
            raise LogError(path, f"holds no {form.name} ({' or '.join(form.suffixes)})")
        stems: dict[str, Path] = {}
        for frame in frames:
            other = stems.setdefault(form.stem(frame), frame)
            if other is not frame:
                raise LogError(
                    path, f"holds {other.name} and {frame.name}, the same frame twice; take one of them away"
                )
        packed = [file.name for file in files_in(path) if form.has_packed(file) and not form.has(file)]
        packed = [name for name in packed if form.stem(Path(unpacked_name(name))) not in stems]
        if packed:
            self._errors.add(
                f"{len(packed)} frames are compressed and were not read: unpack {packed[0]} and the others"
            )
        found = series_of(frames, form.stem)
        has = ", ".join(f"{series.name or UNNAMED} ({len(series.frames)} frames)" for series in found[:9])
        if topic is not None:
            found = [each for each in found if each.name == topic] or [each for each in found if topic in each.name]
            if not found:
                raise LogError(path, f"has no frames of {topic}; it has {has}: choose with {option('topic')}")
        chosen = max(found, key=lambda each: len(each.frames))
        if len(found) > 1:
            several = f"it holds the frames of {len(found)} sensors or vehicles, {has}"
            how = f"choose one with {option('topic')}, or give each a folder of its own"
            self._errors.add(f"{several}, and only {chosen.name or UNNAMED} was read; {how}")
        return chosen
