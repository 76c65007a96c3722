"""NumPy archives (.npz) of scans or clouds: the arrays of a recording under agreed names.

An archive of scans has the arrays ``t`` (N,) s, increasing; ``ranges`` (N, beams) float32 or float64, m, as recorded;
``angle_min``, ``angle_increment`` (rad), ``range_min``, ``range_max`` (m), one number each. Optional are ``v`` (N,)
m/s, signed; ``w`` (N,) rad/s, 0 when absent; ``mount`` (x, y, yaw) and ``outline`` (x_rear, x_front, y_right, y_left).

An archive of clouds has ``t`` (N,) s, increasing; ``points`` (M, 3) or wider, float32 or float64, the clouds one after
another, x forward, y left, z up (m) and perhaps the intensity; ``counts`` (N,) integers, how many points each cloud
has; ``sensor_height`` above the road, m. Optional is ``front_offset`` from the sensor to the bumper, m.

Arrays of other names are not read. ``assumed`` of the log names them, and what is hardly in m or s.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast.logs.files import ARCHIVE, UNPACKED, kind_of_file, most_unpacked, too_much
from ttc_fast.logs.log import CloudFrame, Lidar, LogError, ScanFrame, Scanner
from ttc_fast.logs.options import LIDAR, SCANNER
from ttc_fast.logs.table import LONG
from ttc_fast.sensors.scans import FAR, middle_of

if TYPE_CHECKING:
    import zipfile
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from ttc_fast.logs.options import LogOptions

BEAMS = ("angle_min", "angle_increment", "range_min", "range_max")
PLACES = {"mount": 3, "outline": 4}  # how many numbers each has
SCANS_NEED = ("t", "ranges", *BEAMS)
CLOUDS_NEED = ("t", "points", "counts", "sensor_height")
NAMES = {*SCANS_NEED, "v", "w", *PLACES, *CLOUDS_NEED, "front_offset"}
CLOCK = "stamps of the log"
SURVEYED = 200  # frames of scans, or points
UNREADABLE = "cannot be read as numbers; copy it again, or write it with numpy.savez"


def open_archive(path: Path, options: LogOptions) -> ScanArchive | CloudArchive:
    """Open an archive as the log that its arrays make it.

    Parameters
    ----------
    path : Path
        The archive. It is read at once.
    options : LogOptions
        What the user says of it.

    Raises
    ------
    LogError
        If it cannot be read, or an array is missing or of the wrong shape or type.
    """
    arrays = Arrays(path, NAMES, options.unpacked)
    return CloudArchive(arrays, options) if "points" in arrays else ScanArchive(arrays, options)


class ScanArchive:
    """An archive of scans."""

    clock = CLOCK

    def __init__(self, arrays: Arrays, options: LogOptions) -> None:
        options.only((*SCANNER, "speed"), arrays.path, "an archive of scans")
        arrays.require(SCANS_NEED)
        self.path = arrays.path
        shape = arrays["ranges"].shape
        self._ranges = arrays.readings("ranges", "(frames, beams)", fits=len(shape) == 2 and 0 not in shape)
        self.frame_count, beams = shape
        one_each = (self.frame_count, "scan of ranges")
        self._stamps = arrays.stamps(*one_each)
        self._speeds = arrays.per_frame("v", *one_each) if "v" in arrays else None
        self._yaw_rates = arrays.per_frame("w", *one_each) if "w" in arrays else np.zeros(self.frame_count)
        placed: dict[str, Any] = {name: arrays.numbers(name, n) for name, n in PLACES.items() if name in arrays}
        scanner = Scanner(**{name: arrays.numbers(name, 1)[0] for name in BEAMS}, beams=beams, **placed)
        self.scanner = options.applied(scanner, SCANNER)
        self.assumed = arrays.assumed(
            (*SCANS_NEED, "v", "w", *PLACES), "ranges", min(FAR, 10.0 * self.scanner.range_max)
        )
        self._speed = options.speed
        self.always_has_speed = self._speeds is not None or options.speed is not None
        self.motion = options.motion("the speed is unknown" if self._speeds is None else "speeds of the log")

    def __iter__(self) -> Iterator[ScanFrame]:
        for i, ranges in enumerate(self._ranges):
            speed = self._speed
            if speed is None and self._speeds is not None:
                speed = float(self._speeds[i])
            yield ScanFrame(float(self._stamps[i]), ranges, speed, float(self._yaw_rates[i]))


class CloudArchive:
    """An archive of clouds."""

    clock = CLOCK

    def __init__(self, arrays: Arrays, options: LogOptions) -> None:
        options.only((*LIDAR, "speed"), arrays.path, "an archive of clouds")
        arrays.require(CLOUDS_NEED)
        self.path = arrays.path
        shape = arrays["points"].shape
        self._points = arrays.readings("points", "(points, 3) or wider", fits=len(shape) == 2 and shape[1] >= 3)
        self._ends = np.cumsum(_counts(arrays, len(self._points)))
        self.frame_count = len(self._ends)
        self._stamps = arrays.stamps(self.frame_count, "cloud of counts")
        height = arrays.numbers("sensor_height", 1)[0]
        if height < 0.0:
            raise arrays.error("sensor_height", f"must be at least 0, got {height}")
        lidar = Lidar(height)
        if "front_offset" in arrays:
            front_offset = arrays.numbers("front_offset", 1)[0]
            lidar = replace(lidar, front_offset=front_offset, vehicle_reach=front_offset)
        self.lidar = options.applied(lidar, LIDAR)
        self.assumed = arrays.assumed((*CLOUDS_NEED, "front_offset"), "points", FAR)
        self._speed = options.speed
        self.has_speed = options.speed is not None
        self.motion = options.motion("the speed is unknown")

    def __iter__(self) -> Iterator[CloudFrame]:
        clouds = np.split(self._points, self._ends[:-1])
        for stamp, points in zip(self._stamps, clouds, strict=True):
            yield CloudFrame(float(stamp), points, self._speed)


def _counts(arrays: Arrays, points: int) -> NDArray[np.int64]:
    counts = arrays["counts"]
    if counts.ndim != 1 or counts.size == 0 or counts.dtype.kind not in "iu":
        raise arrays.error("counts", f"must be integers, one per cloud, got {counts.dtype} of shape {counts.shape}")
    if min(counts) < 0 or sum(counts.tolist()) != points:
        raise arrays.error("counts", f"must be from 0 and add up to the {points} rows of 'points'")
    return counts.astype(np.int64)


class Arrays:
    """The arrays of an archive, each checked where it is used.

    Parameters
    ----------
    path : Path
        The archive. It is read at once.
    names : iterable of str
        The arrays to read, where the archive has them.
    limit : int
        A chunk of a log may unpack to this many bytes, and an archive to ``ARCHIVE`` times as many.

    Raises
    ------
    LogError
        If it cannot be read; from the methods, if an array is not what it should be.
    """

    def __init__(self, path: Path, names: Iterable[str], limit: int = UNPACKED) -> None:
        self.path = path
        self._arrays, self.others = _load(path, names, limit)

    def __contains__(self, name: str) -> bool:
        return name in self._arrays

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self._arrays[name]

    def require(self, names: tuple[str, ...]) -> None:
        """Refuse an archive that lacks one of the names."""
        missing = [name for name in names if name not in self]
        if missing:
            has = f"; it has {', '.join(self.others)}" if self.others else ""
            raise LogError(self.path, f"has no array {', '.join(missing)}; a log needs {', '.join(names)}{has}")

    def assumed(self, names: tuple[str, ...], readings: str, far: float) -> str:
        """Say which arrays are not read, and what is hardly in s or m, for people; empty if nothing is."""
        said = []
        if unread := [*self.others, *(name for name in self._arrays if name not in names)]:
            said.append(f"not read: {', '.join(unread)}; what is read has the names {', '.join(names)}")
        stamps = self["t"]
        if len(stamps) > 1 and (step := np.median(np.diff(stamps))) > LONG:
            said.append(f"the stamps t are {step:g} s apart, read as they are; divide them by 1000 if they are in ms")
        if (middle := middle_of(self[readings][:SURVEYED])) > far:
            what = f"half of the numbers in {readings} are {middle:g} m or more"
            said.append(f"{what}, read as they are; divide them by 1000 if they are in mm")
        return "; ".join(said)

    def readings(self, name: str, shape: str, *, fits: bool) -> NDArray[Any]:
        """Return an array in metres, row by row in memory, if the shape that it should have fits."""
        readings = self[name]
        if not fits:
            raise self.error(name, f"must have the shape {shape}, got {readings.shape}")
        if readings.dtype not in (np.float32, np.float64):
            raise self.error(name, f"must be float32 or float64 in metres, got {readings.dtype}")
        return np.ascontiguousarray(readings)

    def per_frame(self, name: str, frames: int, each: str) -> NDArray[Any]:
        """Return an array of one finite number a frame."""
        numbers = self[name]
        if numbers.shape != (frames,):
            raise self.error(name, f"must have the shape ({frames},), one for each {each}, got {numbers.shape}")
        if numbers.dtype.kind not in "fiu":
            raise self.error(name, f"must be numbers, got {numbers.dtype}")
        bad = np.flatnonzero(~np.isfinite(numbers))
        if len(bad):
            raise self.error(name, f"must be finite, got {numbers[bad[0]]} in frame {bad[0]}")
        return numbers

    def stamps(self, frames: int, each: str) -> NDArray[Any]:
        """Return the array ``t``, which must increase."""
        stamps = self.per_frame("t", frames, each)
        backwards = np.flatnonzero(stamps[1:] <= stamps[:-1])
        if len(backwards):
            frame = backwards[0] + 1
            raise self.error("t", f"must increase, got {stamps[frame]} after {stamps[frame - 1]} in frame {frame}")
        return stamps

    def numbers(self, name: str, size: int) -> tuple[Any, ...]:
        """Return a setting that has this many numbers, which are finite; ``range_max`` may be inf."""
        numbers = self[name]
        if numbers.size != size or numbers.dtype.kind not in "fiu":
            wanted = "one number" if size == 1 else f"{size} numbers"
            raise self.error(name, f"must be {wanted}, got {numbers.dtype} of shape {numbers.shape}")
        if not (np.isfinite(numbers) | ((numbers > 0) & (name == "range_max"))).all():
            raise self.error(name, f"must be finite, got {', '.join(map(str, numbers.flat))}")
        return tuple(float(number) for number in numbers.flat)

    def error(self, name: str, problem: str) -> LogError:
        """Return the error that says what is wrong with an array."""
        return LogError(self.path, f"array {name!r} {problem}")


def _load(path: Path, names: Iterable[str], limit: int) -> tuple[dict[str, NDArray[Any]], list[str]]:
    try:
        with path.open("rb") as file:  # opened here, as np.load leaves a damaged archive open
            archive = np.load(file)
            if not isinstance(archive, np.lib.npyio.NpzFile):
                raise LogError(path, "is a single NumPy array, not an archive of several; write it with numpy.savez")
            _check_sizes(path, archive.zip, limit)
            arrays = {name: _array(path, archive, name) for name in names if name in archive}
            return arrays, [name for name in archive.files if name not in arrays]
    except LogError:
        raise
    except OSError as error:
        raise LogError(path, f"cannot be opened: {error.strerror or error}") from error
    except Exception as error:  # a damaged directory raises whatever zipfile and NumPy meet
        other = kind_of_file(path)
        got = f"but {other}" if other and not other.startswith("a zip") else f"or is damaged: it {UNREADABLE}"
        raise LogError(path, f"is not a NumPy archive, {got}") from error


def _check_sizes(path: Path, archive: zipfile.ZipFile | None, limit: int) -> None:
    members = archive.infolist() if archive else []
    packed, unpacked = sum(each.compress_size for each in members), sum(each.file_size for each in members)
    most = most_unpacked(packed, ARCHIVE * limit)
    if unpacked > most:
        raise LogError(path, f"is too large: {too_much(packed, most)}")


def _array(path: Path, archive: Any, name: str) -> NDArray[Any]:
    try:
        array = archive[name]  # bytes where a member is no array
        if isinstance(array, np.ndarray):
            return array
    except RuntimeError as error:  # of zipfile: LZMA that Python was built without, or a password
        raise LogError(path, f"array {name!r} cannot be unpacked here: {error}") from error
    except Exception as error:  # as above, from the header of an array to its last byte
        raise LogError(path, f"is not a NumPy archive, or is damaged: array {name!r} {UNREADABLE}") from error
    raise LogError(path, f"is not a NumPy archive, or is damaged: array {name!r} {UNREADABLE}")
