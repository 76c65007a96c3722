"""The recorded frames that methods are verified on, and a truth that does not come from the lidar."""

from __future__ import annotations

import csv
import gzip
import os
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ttc_fast import Gate

if TYPE_CHECKING:
    from numpy.typing import NDArray

DATA = Path(os.environ.get("TTC_FAST_DATA", Path(__file__).parents[2] / "shared" / "data"))
"""The recordings, whose licences forbid shipping them."""
FOLDER = DATA / "kitti"
GATE = Gate.above_road(1.73, clearance=0.25, headroom=2.0, x=(2.0, 20.0))
"""All of the car ahead, and neither the road nor the own bonnet."""
CROP = Gate(x=(2.0, 20.0), y=(-2.0, 2.0), z=(-1.5, -0.9), intensity=(0.1, 1.0))
"""A crop by reflectivity, which students' work on these frames uses. It leaves a third of the points."""
FIRST = 6
"""The first frame that counts; those before it warm methods up."""
RATE = 10.0


@lru_cache(maxsize=1)
def clouds() -> list[NDArray[Any]]:
    """Return clouds as rows of x, y, z, reflectivity; none where there are no recordings."""
    files = sorted((FOLDER / "velodyne").glob("*.bin.gz"))
    return [np.frombuffer(gzip.decompress(file.read_bytes()), np.float32).reshape(-1, 4) for file in files]


class Truth(NamedTuple):
    """What the camera measured by how the rear of the car ahead grows; NaN where a frame does not count."""

    ttc: float  # s, of the bumper and the lidar
    closing_speed: float  # m/s, right to 0.01 m/s


def truths() -> list[Truth]:
    """Return the truth of each frame."""
    with (FOLDER / "truth.csv").open() as lines:
        rows = [Truth(float(row["ttc"]), float(row["closing_speed"])) for row in csv.DictReader(lines)]
    return [truth if frame >= FIRST else Truth(np.nan, np.nan) for frame, truth in enumerate(rows)]
