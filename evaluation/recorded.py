"""The recorded frames that methods are verified on; docs/accuracy.md says which settings were seen on them before."""

from __future__ import annotations

import csv
import gzip
import os
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast import Gate

if TYPE_CHECKING:
    from numpy.typing import NDArray

DATA = Path(os.environ.get("TTC_FAST_DATA", Path(__file__).parents[2] / "shared" / "data"))
"""The recordings, whose licences forbid shipping them."""
FOLDER = DATA / "kitti"
GATE = Gate(x=(2.0, 20.0), y=(-2.0, 2.0), z=(-1.5, -0.9), intensity=(0.1, 1.0))
"""The gate that the reference was cropped with."""
FIRST = 6
"""The first frame that counts; those before it warm methods up."""
RATE = 10.0


@lru_cache(maxsize=1)
def clouds() -> list[NDArray[Any]]:
    """Return clouds as rows of x, y, z, reflectivity; none where there are no recordings."""
    files = sorted((FOLDER / "velodyne").glob("*.bin.gz"))
    return [np.frombuffer(gzip.decompress(file.read_bytes()), np.float32).reshape(-1, 4) for file in files]


def truths(frames: int) -> list[float]:
    """Return the reference TTC of each frame, s, smoothed over its neighbours; NaN where a frame does not count."""
    with (FOLDER / "corridor_distances.csv").open() as lines:
        times = [float(row["ttc_ref"]) for row in csv.DictReader(lines)]
    return [time if frame >= FIRST else np.nan for frame, time in enumerate(times[:frames])]
