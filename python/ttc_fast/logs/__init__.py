"""Recorded logs, read by one small interface: ``open_log(path)`` returns a log, whatever the sensor and the format."""

from __future__ import annotations

import weakref
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ttc_fast._settings import hint, settings_of
from ttc_fast.logs.carmen import CarmenLog
from ttc_fast.logs.cloud_files import CloudFiles
from ttc_fast.logs.files import files_in, unpacked_name
from ttc_fast.logs.log import (
    CloudFrame,
    CloudLog,
    DistanceFrame,
    DistanceLog,
    Lidar,
    Log,
    LogError,
    ScanFrame,
    ScanLog,
    Scanner,
    forward_left_up,
    origin,
)
from ttc_fast.logs.mcap import McapFile
from ttc_fast.logs.npz import open_archive
from ttc_fast.logs.options import LogOptions
from ttc_fast.logs.pcd import PCD
from ttc_fast.logs.raw_clouds import KITTI, NUSCENES
from ttc_fast.logs.ros import open_bag
from ttc_fast.logs.rosbag1 import Bag
from ttc_fast.logs.rosbag2 import BagFolder, Database, is_bag_folder
from ttc_fast.logs.storage import Copy, located
from ttc_fast.logs.table import DistanceTable

if TYPE_CHECKING:
    from collections.abc import Callable
    from os import PathLike

__all__ = [
    "FORMATS",
    "CloudFrame",
    "CloudLog",
    "DistanceFrame",
    "DistanceLog",
    "Lidar",
    "Log",
    "LogError",
    "LogOptions",
    "ScanFrame",
    "ScanLog",
    "Scanner",
    "forward_left_up",
    "open_log",
]

FORMATS = (
    "a NumPy archive (.npz) of scans or clouds, a ROS 1 bag (.bag), a ROS 2 bag (.db3, .mcap, or their folder), a "
    "CARMEN log (.log, .log.gz), a cloud or a folder of clouds of KITTI (.bin, .bin.gz), nuScenes (.pcd.bin) or PCL "
    "(.pcd), or a table of distances (.csv, .tsv)"
)
"""What can be read, for people."""

AnyLog = ScanLog | CloudLog | DistanceLog
CLOUDS = (NUSCENES, PCD, KITTI)  # in this order, as .pcd.bin ends in .bin too


def open_log(path: str | PathLike[str], **options: Any) -> AnyLog:
    """Open a log with the reader for its kind.

    Parameters
    ----------
    path : path
        The file or folder; ``FORMATS`` lists what can be read. What a URL of fsspec names, such as s3://fleet/drive.mcap,
        is fetched to a scratch folder, where it stays while the log is in use (extra ``fleet``).
    **options
        What the log does not say, or what is to hold instead: the fields of ``LogOptions``, by their names.

    Returns
    -------
    ScanLog, CloudLog or DistanceLog
        The log, of the kind that was recorded; ``isinstance`` tells which.

    Raises
    ------
    LogError
        If the path does not exist, its ending is unknown, it cannot be read as what its ending says, an option is not
        for that kind of log, or a package of the extra ``log`` is missing.
    TypeError, ValueError
        If an option is unknown, or makes no sense.

    Examples
    --------
    >>> import pathlib, ttc_fast
    >>> from ttc_fast.logs import open_log
    >>> samples = pathlib.Path(ttc_fast.__file__).parent / "samples"
    >>> log = open_log(samples / "approach.npz")
    >>> log.frame_count, log.scanner.beams, next(iter(log)).ranges.dtype.name
    (129, 541, 'float32')
    >>> log = open_log(samples / "following.npz", front_offset=2.0)
    >>> log.frame_count, log.lidar.sensor_height, log.lidar.front_offset, next(iter(log)).points.dtype.name
    (12, 1.73, 2.0, 'float32')
    """
    place = located(path)
    names = [*(each.name for each in settings_of(LogOptions)), "ignore_useless"]
    for name in options:
        if name not in names:
            raise TypeError(f"open_log has no option {name!r}: {hint(name, names)}")
    given = LogOptions(**options)
    if isinstance(place, Path):
        return _open(place, given)
    copy = Copy(place)
    try:
        log = _open(copy.path, given)
    except BaseException:
        copy.remove()
        raise
    weakref.finalize(log, copy.remove)
    return log


def _open(path: Path, given: LogOptions) -> AnyLog:
    try:
        if not path.exists():
            raise LogError(path, "cannot be opened: no such file or folder")
        return _open_folder(path, given) if path.is_dir() else _open_file(path, given)
    except OSError as error:
        raise LogError(path, f"cannot be opened: {error.strerror or error}") from error


def _open_folder(path: Path, options: LogOptions) -> AnyLog:
    if is_bag_folder(path):
        return open_bag(BagFolder(path, options.unpacked), options)
    files = files_in(path)
    found = {next((form for form in CLOUDS if form.has(file)), None) for file in files} - {None}
    if len(found) > 1:
        several = " and ".join(sorted(form.name for form in found if form))
        raise LogError(path, f"holds {several}; give each kind a folder of its own")
    form = found.pop() if found else None
    if form is None:
        logs = [file.name for file in files if file.name.lower().endswith(SUFFIXES)]
        if logs:
            raise LogError(
                path, f"is a folder of logs, {logs[0]} and others; give them by their names: {origin(path)}/*"
            )
        raise LogError(path, f"holds no frames that can be read; can read {FORMATS}; give the folder that holds them")
    return CloudFiles(path, form, options)


def _open_file(path: Path, options: LogOptions) -> AnyLog:
    name = path.name.lower()
    if name.startswith("._"):
        raise LogError(path, f"is what macOS keeps beside {path.name[2:]}, and no log; leave it out")
    form = next((form for form in CLOUDS if form.has(path)), None)
    opener = next((opener for suffixes, opener in FILES.items() if name.endswith(suffixes)), None)
    if not path.is_file():
        raise LogError(path, "is neither a file nor a folder, and cannot be read as a log")
    if (form or opener) and not path.stat().st_size:
        raise LogError(path, "is empty: nothing was recorded, or copied")
    if form is not None:
        return CloudFiles(path, form, options)
    if opener is None:
        unpacked = unpacked_name(name)
        if unpacked.endswith(SUFFIXES) or any(form.has(Path(unpacked)) for form in CLOUDS):
            raise LogError(path, f"is compressed; unpack it first, to {unpacked_name(path.name)}")
        raise LogError(path, f"no reader for this kind of file; can read {FORMATS}")
    return opener(path, options)


FILES: dict[tuple[str, ...], Callable[[Path, LogOptions], AnyLog]] = {
    (".npz",): open_archive,
    (".bag", ".bag.active"): lambda path, options: open_bag(Bag(path, options.unpacked), options),
    (".db3",): lambda path, options: open_bag(Database(path, options.unpacked), options),
    (".mcap",): lambda path, options: open_bag(McapFile(path, options.unpacked), options),
    (".log", ".log.gz", ".clf", ".clf.gz"): CarmenLog,
    (".csv", ".tsv"): DistanceTable,
}
SUFFIXES = tuple(suffix for suffixes in FILES for suffix in suffixes)
