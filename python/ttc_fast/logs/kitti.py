"""Point clouds as KITTI has them, ``0000000000.bin`` and so on: rows of x forward, y left, z up (m) and reflectance."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ttc_fast.logs.cloud_files import CloudFormat, no_stamp, read_rows
from ttc_fast.logs.clouds import Lidar

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

# Of KITTI's car: the sensor's height is from its data sheet, and its bonnet is seen up to 2.54 m ahead. The band is z
# from -1.5 to -0.9 m, as in published TTC tables: it ends below the tail lights, which glare up to 0.2 m too near.
LIDAR = Lidar(sensor_height=1.73, own_reach=2.6, height=(0.23, 0.83))


def read_points(frame: Path) -> NDArray[np.float32]:
    """Read the rows of one frame, shape (N, 4)."""
    return read_rows(frame, ("x", "y", "z", "reflectance"), "KITTI")


KITTI = CloudFormat("KITTI frames", (".bin", ".bin.gz"), LIDAR, 10.0, read_points, no_stamp)
