"""Logs of point clouds as KITTI has them: a folder of frames, ``0000000000.bin`` and so on."""

from __future__ import annotations

import gzip
import zlib
from typing import TYPE_CHECKING

import numpy as np

from ttc_fast.logs.clouds import CloudFrame, Lidar
from ttc_fast.logs.log import LogError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

SUFFIXES = (".bin", ".bin.gz")
STAMPS = "timestamps.txt"
RATE = 10.0  # turns per second of KITTI's lidar
# Of KITTI's car: the sensor's height is from its data sheet, and its bonnet is seen up to 2.54 m ahead. The band is z
# from -1.5 to -0.9 m, as in published TTC tables: it ends below the tail lights, which glare up to 0.2 m too near.
LIDAR = Lidar(sensor_height=1.73, own_reach=2.6, height=(0.23, 0.83))
ROW = 16  # bytes: float32 x, y, z, reflectance
DAMAGED = (EOFError, zlib.error, gzip.BadGzipFile)


class KittiFolder:
    """A folder of KITTI frames (.bin, or .bin.gz), in the order of their names.

    A frame is little-endian float32 rows of x forward, y left, z up (m) and reflectance (0 to 1). Stamps are those of
    ``timestamps.txt`` in the folder or the one above, as the raw data have it; without one, 10 frames a second.

    Parameters
    ----------
    path : Path
        Of the folder. Frames are read one by one, while iterating.

    Raises
    ------
    LogError
        If it holds fewer than two frames, or the stamps do not fit them. While iterating, if a frame cannot be read.
    """

    lidar = LIDAR

    def __init__(self, path: Path) -> None:
        self.path = path
        self._frames = sorted(file for file in path.iterdir() if is_frame(file))
        if len(self._frames) < 2:
            problem = f"holds {len(self._frames)} KITTI frames ({' or '.join(SUFFIXES)}), and a TTC needs two"
            raise LogError(path, f"{problem}; give the folder that holds them, velodyne_points/data in the raw data")
        self.frame_count = len(self._frames)
        listed = next((file for file in (path / STAMPS, path.parent / STAMPS) if file.is_file()), None)
        self._stamps = read_stamps(listed, self._frames) if listed else np.arange(self.frame_count) / RATE
        self.clock = f"stamps of {listed}" if listed else f"no {STAMPS}, so {RATE:g} frames a second are assumed"

    def __iter__(self) -> Iterator[CloudFrame]:
        for stamp, frame in zip(self._stamps, self._frames, strict=True):
            yield CloudFrame(float(stamp), read_points(frame))


def is_frame(path: Path) -> bool:
    """Whether the name is that of a frame."""
    return path.name.lower().endswith(SUFFIXES)


def read_points(frame: Path) -> NDArray[np.float32]:
    """Read the rows of one frame, shape (N, 4)."""
    try:
        content = frame.read_bytes()
        if frame.suffix.lower() == ".gz":
            content = gzip.decompress(content)
    except DAMAGED as error:
        raise LogError(frame, f"is not gzip, or is damaged: {error}") from error
    except OSError as error:
        raise LogError(frame, f"cannot be read: {error.strerror or error}") from error
    if len(content) % ROW:
        rows = f"rows of {ROW} bytes (float32 x, y, z, reflectance)"
        raise LogError(frame, f"has {len(content)} bytes, not whole {rows}: cut short, or not a KITTI frame")
    return np.frombuffer(content, "<f4").reshape(-1, 4)


def read_stamps(path: Path, frames: list[Path]) -> NDArray[np.float64]:
    """Read the stamps of the frames, one line each, s since the first of them.

    A file that covers the whole drive may have more lines than there are frames here: then the number in a frame's name
    says which line is its own.
    """
    try:
        lines = path.read_text(encoding="ascii").rstrip().split("\n")
        if len(lines) != len(frames):
            lines = _lines_by_number(path, lines, frames)
        stamps = np.array([np.datetime64(line.strip(), "ns") for line in lines])
    except OSError as error:
        raise LogError(path, f"cannot be read: {error.strerror or error}") from error
    except ValueError as error:
        raise LogError(path, f"must have lines like 2011-09-26 13:02:25.951199337, one a frame: {error}") from error
    seconds: NDArray[np.float64] = (stamps - stamps[0]) / np.timedelta64(1, "s")
    wrong = np.flatnonzero(~(np.diff(seconds) > 0.0))
    if len(wrong):
        before, after = frames[wrong[0]].name, frames[wrong[0] + 1].name
        raise LogError(path, f"stamps must increase, but that of {after} does not follow that of {before}")
    return seconds


def _lines_by_number(path: Path, lines: list[str], frames: list[Path]) -> list[str]:
    numbers = [frame.name.partition(".")[0] for frame in frames]
    if not all(number.isdecimal() and int(number) < len(lines) for number in numbers):
        problem = f"has {len(lines)} stamps for {len(frames)} frames, and the names do not say which is whose"
        raise LogError(path, f"{problem}; take it away, or give it one line a frame")
    return [lines[int(number)] for number in numbers]
