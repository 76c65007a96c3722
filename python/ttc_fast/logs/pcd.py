"""Point clouds of the Point Cloud Library, ``.pcd``: ascii, binary and binary_compressed."""

from __future__ import annotations

import io
import re
import struct
import warnings
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast.logs.cloud_files import CloudFormat, read_content
from ttc_fast.logs.log import Lidar, LogError, need

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

# What pypcd4 and what it stands on raise over a damaged file; pydantic's errors are ValueErrors.
WRONG = (ValueError, KeyError, IndexError, TypeError, struct.error)
DAMAGED = (*WRONG, EOFError, RuntimeError, MemoryError, OverflowError, UserWarning)
INTENSITIES = ("u1", "u2", "f4", "f8")


def read_points(frame: Path) -> NDArray[Any]:
    """Read one cloud: records with fields x, y and z, and intensity if there is one that a gate can take."""
    content = read_content(frame)
    cloud = need("pypcd4", frame).PointCloud
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # NumPy only warns of text that ends early
            points: NDArray[Any] = np.atleast_1d(cloud.from_fileobj(io.BytesIO(content)).pc_data)
    except DAMAGED as error:
        raise LogError(frame, f"is not a PCD file, or is damaged: {_said(error)}") from error
    return _checked(frame, points, content)


def _checked(frame: Path, points: NDArray[Any], content: bytes) -> NDArray[Any]:
    said = re.search(rb"^POINTS\s+(\d+)", content, re.MULTILINE)
    if said and int(said[1]) != len(points):
        raise LogError(frame, f"is cut short: it says {int(said[1])} points and has {len(points)}")
    names = points.dtype.names or ()
    missing = [name for name in ("x", "y", "z") if name not in names]
    if missing:
        raise LogError(frame, f"has no field {', '.join(missing)}; it has {', '.join(names)}")
    kinds = {points.dtype[name] for name in ("x", "y", "z")}
    if kinds not in ({np.dtype(np.float32)}, {np.dtype(np.float64)}):
        raise LogError(frame, "must have x, y and z of one type, F 4 or F 8")
    odd = "intensity" in names and points.dtype["intensity"] not in [np.dtype(kind) for kind in INTENSITIES]
    return points[["x", "y", "z"]] if odd else points


def stamp_of(name: str) -> float | None:
    """Read a name that is a stamp in s, as tools that unpack bags write them.

    Examples
    --------
    >>> from ttc_fast.logs.pcd import stamp_of
    >>> stamp_of("1305031102.175304.pcd"), stamp_of("000001.pcd")
    (1305031102.175304, None)
    """
    found = re.fullmatch(r"(\d+\.\d+)\.pcd(\.gz)?", name, re.IGNORECASE)
    return float(found[1]) if found else None


def _said(error: BaseException) -> str:
    return str(error).split("\n", 1)[0] or type(error).__name__


PCD = CloudFormat("PCD clouds", (".pcd", ".pcd.gz"), Lidar(sensor_height=None), 10.0, read_points, stamp_of)
