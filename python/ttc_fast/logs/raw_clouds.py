"""Clouds as bare rows of little-endian float32, one file each: the frames of KITTI (.bin) and nuScenes (.pcd.bin).

A KITTI frame has rows of x forward, y left, z up (m) and reflectance; a nuScenes frame has x right, y forward, z up
(m), intensity (0 to 255) and ring. Such files say nothing of themselves, so some of the numbers are looked at:
anything else with the same ending would be read as points that are not there.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ttc_fast.logs.cloud_files import CloudFormat
from ttc_fast.logs.files import UNPACKED, kind_of, read_content
from ttc_fast.logs.log import Lidar, LogError

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

LOOKED_AT = 4096  # rows
ODD_SHARE = 0.02
FARTHEST = 1000.0  # m
NEXT_TO_NOTHING = 1e-6  # m, or of any intensity
BRIGHTEST = 65535.0

# The car of KITTI: the sensor's height is from its data sheet, and its bonnet is seen up to 2.54 m ahead. The band is z
# from -1.5 to -0.9 m, as in published TTC tables: it ends below the tail lights, which glare up to 0.2 m too near.
KITTI_LIDAR = Lidar(sensor_height=1.73, vehicle_reach=2.6, height=(0.23, 0.83))
# The car of nuScenes: how high LIDAR_TOP sits is from its calibration, in which y of the sensor is forward; roof and
# bonnet are seen up to 2 m ahead.
NUSCENES_LIDAR = Lidar(sensor_height=1.84, vehicle_reach=2.2, axes=("y", "-x", "z"))


def read_kitti(frame: Path, limit: int = UNPACKED) -> NDArray[np.float32]:
    """Read the rows of a KITTI frame, shape (N, 4)."""
    return read_rows(frame, ("x", "y", "z", "reflectance"), "KITTI", limit)


def read_nuscenes(frame: Path, limit: int = UNPACKED) -> NDArray[np.float32]:
    """Read the rows of a nuScenes frame, shape (N, 5)."""
    return read_rows(frame, ("x", "y", "z", "intensity", "ring"), "nuScenes", limit)


def read_rows(frame: Path, names: tuple[str, ...], dataset: str, limit: int) -> NDArray[np.float32]:
    """Read rows of the named numbers, and refuse a file whose numbers are no points."""
    content, row = read_content(frame, limit), 4 * len(names)
    rows = f"rows of {row} bytes (float32 {', '.join(names)})"
    if len(content) % row:
        other = kind_of(content)
        got = f"it is {other}" if other else f"cut short, or not a {dataset} frame"
        raise LogError(frame, f"has {len(content)} bytes, not whole {rows}: {got}")
    points: NDArray[np.float32] = np.frombuffer(content, "<f4").reshape(-1, len(names))
    odd = _odd_share(points)
    if odd > ODD_SHARE:
        problem = f"is no {dataset} frame: read as {rows}, {odd:.0%} of them are no places that a lidar sees"
        other = kind_of(content)
        how = f"it is {other}" if other else "record it as a bag, or convert it to .pcd"
        raise LogError(frame, f"{problem}; {how}")
    return points


def _odd_share(points: NDArray[np.float32]) -> float:
    """Return the share of points that no lidar gives, among some thousand in the middle of the file."""
    begin = max(len(points) - LOOKED_AT, 0) // 2
    some = points[begin : begin + LOOKED_AT]
    if not len(some):
        return 0.0
    size = np.abs(some[:, :4])
    with np.errstate(invalid="ignore"):
        odd = (size[:, :3] > FARTHEST).any(axis=1)  # bytes of something else are huge, or next to nothing
        odd |= ((size > 0.0) & (size < NEXT_TO_NOTHING)).any(axis=1)
        odd |= (some[:, 3] < 0.0) | (size[:, 3] > BRIGHTEST)
    return float(odd.mean())


KITTI = CloudFormat("KITTI frames", (".bin", ".bin.gz"), KITTI_LIDAR, 10.0, read_kitti)
NUSCENES = CloudFormat("nuScenes frames", (".pcd.bin", ".pcd.bin.gz"), NUSCENES_LIDAR, 20.0, read_nuscenes)
