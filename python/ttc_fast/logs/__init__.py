"""Recorded logs, read by one small interface: ``open_log(path)`` gives a log, whatever the sensor and the format."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ttc_fast.logs import kitti, npz_clouds, npz_scans
from ttc_fast.logs.clouds import CloudFrame, CloudLog, Lidar
from ttc_fast.logs.kitti import KittiFolder
from ttc_fast.logs.log import Log, LogError
from ttc_fast.logs.npz import Arrays
from ttc_fast.logs.npz_clouds import NpzClouds
from ttc_fast.logs.npz_scans import NpzScans
from ttc_fast.logs.scans import ScanFrame, ScanLog, Scanner

if TYPE_CHECKING:
    from os import PathLike

__all__ = [
    "FORMATS",
    "CloudFrame",
    "CloudLog",
    "Lidar",
    "Log",
    "LogError",
    "ScanFrame",
    "ScanLog",
    "Scanner",
    "open_log",
]

FORMATS = "a NumPy archive (.npz) of scans or clouds, or a folder of KITTI clouds (.bin, .bin.gz)"
"""What can be read, for people."""


def open_log(path: str | PathLike[str]) -> ScanLog | CloudLog:
    """Open a log with the reader for its kind.

    Parameters
    ----------
    path : path
        Of a NumPy archive, or a folder of KITTI frames.

    Returns
    -------
    ScanLog or CloudLog

    Raises
    ------
    LogError
        If it is not there, no reader knows the name, or it cannot be read as what its name says.

    Examples
    --------
    >>> import pathlib, ttc_fast
    >>> from ttc_fast.logs import open_log
    >>> samples = pathlib.Path(ttc_fast.__file__).parent / "samples"
    >>> log = open_log(samples / "approach.npz")
    >>> log.frame_count, log.scanner.beams, next(iter(log)).ranges.dtype.name
    (129, 541, 'float32')
    >>> log = open_log(samples / "following.npz")
    >>> log.frame_count, log.lidar.sensor_height, next(iter(log)).points.dtype.name
    (12, 1.73, 'float32')
    """
    path = Path(path)
    if not path.exists():
        raise LogError(path, "cannot be opened: no such file or folder")
    if path.is_dir():
        return KittiFolder(path)
    if path.suffix.lower() == ".npz":
        arrays = Arrays(path, {*npz_scans.NAMES, *npz_clouds.NAMES})
        return NpzClouds(arrays) if "points" in arrays else NpzScans(arrays)
    if kitti.is_frame(path):
        raise LogError(path, f"is one frame, and a TTC needs two: give the folder that holds them, {path.parent}")
    raise LogError(path, f"no reader for this kind of file; can read {FORMATS}")
