"""Point clouds as nuScenes has them, ``.pcd.bin``: rows of x right, y forward, z up (m), intensity (0 to 255), ring."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from ttc_fast.logs.cloud_files import CloudFormat, read_rows
from ttc_fast.logs.clouds import Lidar

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

# Of the car of nuScenes: how high LIDAR_TOP sits is from its calibration, in which y of the sensor is forward; roof and
# bonnet are seen up to 2 m ahead.
LIDAR = Lidar(sensor_height=1.84, own_reach=2.2, axes=("y", "-x", "z"))


def read_points(frame: Path) -> NDArray[np.float32]:
    """Read the rows of one frame, shape (N, 5)."""
    return read_rows(frame, ("x", "y", "z", "intensity", "ring"), "nuScenes")


def stamp_of(name: str) -> float | None:
    """Read the stamp at the end of a name, microseconds, s.

    Examples
    --------
    >>> from ttc_fast.logs.nuscenes import stamp_of
    >>> stamp_of("n015-2018-07-24-11-22-45+0800__LIDAR_TOP__1532402927647951.pcd.bin")
    1532402927.647951
    """
    found = re.search(r"__(\d{10,})\.pcd\.bin", name)
    return int(found[1]) / 1e6 if found else None


NUSCENES = CloudFormat("nuScenes frames", (".pcd.bin", ".pcd.bin.gz"), LIDAR, 20.0, read_points, stamp_of)
