"""Logs of point clouds as NumPy archives."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ttc_fast.logs.clouds import CloudFrame, Lidar
from ttc_fast.logs.options import LIDAR

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from ttc_fast.logs.npz import Arrays
    from ttc_fast.logs.options import LogOptions

REQUIRED = ("t", "points", "counts", "sensor_height")
NAMES = (*REQUIRED, "front_offset")


class NpzClouds:
    """Clouds in a NumPy archive (.npz).

    Its arrays: ``t`` (N,) s, increasing; ``points`` (M, 3) or wider, float32 or float64, the clouds one after another,
    x forward, y left, z up (m) and perhaps the intensity; ``counts`` (N,) integers, how many points each cloud has;
    ``sensor_height`` above the road, m. Optional: ``front_offset`` from the sensor to the bumper, m, 0 when absent.

    Parameters
    ----------
    arrays : Arrays
        Of the archive.
    options : LogOptions
        What the user says of it.

    Raises
    ------
    LogError
        If an array is missing or of the wrong shape or type, or the counts do not add up.
    """

    clock = "stamps of the log"

    def __init__(self, arrays: Arrays, options: LogOptions) -> None:
        options.only((*LIDAR, "speed"), arrays.path, "an archive of clouds")
        arrays.require(REQUIRED)
        self.path = arrays.path
        shape = arrays["points"].shape
        self._points = arrays.readings("points", "(points, 3) or wider", fits=len(shape) == 2 and shape[1] >= 3)
        self._ends = np.cumsum(_counts(arrays, len(self._points)))
        self.frame_count = len(self._ends)
        self._stamps = arrays.stamps(self.frame_count, "cloud of counts")
        front_offset = arrays.numbers("front_offset", 1)[0] if "front_offset" in arrays else 0.0
        lidar = Lidar(arrays.numbers("sensor_height", 1)[0], front_offset, own_reach=front_offset)
        self.lidar = options.applied(lidar, LIDAR)
        self._speed = options.speed
        self.motion = "the speed is unknown" if self._speed is None else "speed as given"

    def __iter__(self) -> Iterator[CloudFrame]:
        clouds = np.split(self._points, self._ends[:-1])
        for stamp, points in zip(self._stamps, clouds, strict=True):
            yield CloudFrame(float(stamp), points, self._speed)


def _counts(arrays: Arrays, points: int) -> NDArray[np.int64]:
    counts = arrays["counts"]
    if counts.ndim != 1 or counts.size == 0 or counts.dtype.kind not in "iu":
        raise arrays.error("counts", f"must be integers, one a cloud, got {counts.dtype} of shape {counts.shape}")
    if min(counts) < 0 or sum(counts.tolist()) != points:
        raise arrays.error("counts", f"must be from 0 and add up to the {points} rows of 'points'")
    return counts.astype(np.int64)
