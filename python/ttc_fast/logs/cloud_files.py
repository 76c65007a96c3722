"""Logs of point clouds with a file for each: a folder of them, or a single one."""

from __future__ import annotations

import gzip
import zlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast.logs.log import CloudFrame, LogError
from ttc_fast.logs.options import LIDAR
from ttc_fast.logs.stamps import STAMPS, read_stamps

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from ttc_fast.logs.log import Lidar
    from ttc_fast.logs.options import LogOptions

DAMAGED = (EOFError, zlib.error, gzip.BadGzipFile)
OPTIONS = (*LIDAR, "rate", "speed")


@dataclass(frozen=True)
class CloudFormat:
    """A format of clouds, one a file.

    Attributes
    ----------
    name : str
        For people.
    suffixes : tuple of str
        Of the files, in lower case; without and with compression.
    lidar : Lidar
        Where it sits, as far as the format says.
    rate : float
        Frames per second, where nothing says when they were.
    read : function
        Reads a file.
    stamp : function
        Says when a frame was, by its name, s; or None.
    """

    name: str
    suffixes: tuple[str, ...]
    lidar: Lidar
    rate: float
    read: Callable[[Path], NDArray[Any]]
    stamp: Callable[[str], float | None]

    def has(self, path: Path) -> bool:
        """Whether the name is that of a frame."""
        return path.name.lower().endswith(self.suffixes)


class CloudFiles:
    """A folder of clouds in the order of their names, or a single one.

    Stamps are those of ``timestamps.txt`` in the folder or the one above, else those in the names; without either, as
    many frames a second as the format has.

    Parameters
    ----------
    path : Path
        Of the folder, or of a file. Frames are read one by one, while iterating.
    form : CloudFormat
        Of the files.
    options : LogOptions
        What the user says of them.

    Raises
    ------
    LogError
        If there are none, or the stamps do not fit them. While iterating, if a frame cannot be read.
    """

    def __init__(self, path: Path, form: CloudFormat, options: LogOptions) -> None:
        options.only(OPTIONS, path, form.name)
        self.path = path
        self._form = form
        self._frames = sorted(file for file in path.iterdir() if form.has(file)) if path.is_dir() else [path]
        if not self._frames:
            raise LogError(path, f"holds no {form.name} ({' or '.join(form.suffixes)})")
        self.frame_count = len(self._frames)
        self.lidar = options.applied(form.lidar, LIDAR)
        self._speed = options.speed
        self.motion = options.motion("the speed is unknown")
        self._stamps, self.clock = self._timed(options.rate)

    def __iter__(self) -> Iterator[CloudFrame]:
        for stamp, frame in zip(self._stamps, self._frames, strict=True):
            yield CloudFrame(float(stamp), self._form.read(frame), self._speed)

    def _timed(self, rate: float | None) -> tuple[NDArray[np.float64], str]:
        """Find the stamps, and where they come from."""
        numbers = np.arange(self.frame_count)
        if rate is not None:
            return numbers / rate, f"{rate:g} frames a second"
        folder = self.path if self.path.is_dir() else self.path.parent
        listed = next((file for file in (folder / STAMPS, folder.parent / STAMPS) if file.is_file()), None)
        if listed and self.path.is_dir():
            return read_stamps(listed, self._frames), f"stamps of {listed}"
        named = [self._form.stamp(file.name) for file in self._frames]
        stamps = np.array([stamp for stamp in named if stamp is not None])
        if len(stamps) == len(named) and (np.diff(stamps) > 0.0).all():
            return stamps - stamps[0], "stamps in the names"
        rate = self._form.rate
        return numbers / rate, f"no {STAMPS}, so {rate:g} frames a second are assumed"


def read_content(frame: Path) -> bytes:
    """Read a file, and unpack it if its name ends in .gz."""
    try:
        content = frame.read_bytes()
        return gzip.decompress(content) if frame.suffix.lower() == ".gz" else content
    except DAMAGED as error:
        raise LogError(frame, f"is not gzip, or is damaged: {error}") from error
    except OSError as error:
        raise LogError(frame, f"cannot be read: {error.strerror or error}") from error
