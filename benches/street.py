"""The clouds: recorded frames, or simulated ones of the same size where there are no recordings."""

from __future__ import annotations

import gzip
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from benches.inputs import turns
from evaluation.recorded import DATA

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Cloud = NDArray[Any]

X, Y, Z, INTENSITY = (2.0, 20.0), (-2.0, 2.0), (-1.5, -0.9), (0.1, 1.0)
"""The bounds of the gate: low things in the own lane that are no part of the own car, and reflect."""
FRAME = 114_000
"""The number of points of a whole frame."""
FRAMES, MOST_FRAMES = 3, 20
"""Frames that take turns, and the most of small clouds, which a branch predictor would learn by heart otherwise."""
STEPS = {16: 12, 22: 12, 32: 16, 48: 16}
"""Bytes from record to record, as drivers choose them, and where the intensity is in each."""

_FOLDER = DATA / "kitti" / "velodyne"
SOURCE = "recorded KITTI frames" if _FOLDER.is_dir() else "our own frames of the same size: no recordings here"


@lru_cache(maxsize=2)
def frames(count: int = FRAMES) -> list[Cloud]:
    """Return up to ``count`` frames as rows of x, y, z, intensity, float32, ring after ring."""
    if not _FOLDER.is_dir():
        return [drawn(seed) for seed in range(count)]
    files = sorted(_FOLDER.glob("*.bin.gz"))[:count]
    return [
        ahead(np.frombuffer(gzip.decompress(file.read_bytes()), np.float32).reshape(-1, 4), FRAME) for file in files
    ]


def drawn(seed: int) -> Cloud:
    """Simulate a frame: a road between houses, and a car 8 m ahead."""
    rng = np.random.default_rng(seed)
    elevation, azimuth = np.meshgrid(np.radians(np.linspace(2.0, -24.8, 64)), np.linspace(np.pi, -np.pi, 1782))
    elevation, azimuth = elevation.T.ravel()[:FRAME], azimuth.T.ravel()[:FRAME]
    cos, sin, slope = np.cos(azimuth), np.sin(azimuth), np.tan(elevation)
    with np.errstate(divide="ignore"):
        houses = np.minimum(10.0 / np.abs(sin), 60.0)
        road = np.where(slope < 0.0, -1.73 / slope, np.inf)
        car = np.where((cos > 0.0) & (np.abs(8.0 * sin / cos) < 0.9) & (8.0 * slope / cos < -0.2), 8.0 / cos, np.inf)
    distance = np.minimum(np.minimum(houses, road), car) + rng.normal(0.0, 0.02, FRAME)
    columns = (distance * cos, distance * sin, distance * slope, rng.random(FRAME))
    return np.column_stack(columns).astype(np.float32)


def ahead(cloud: Cloud, points: int) -> Cloud:
    """Return the points closest to the x axis, in the order in which they were."""
    angle = np.abs(np.arctan2(cloud[:, 1], cloud[:, 0]))
    return cloud[np.sort(np.argsort(angle, kind="stable")[:points])]


def clouds(points: int) -> list[Cloud]:
    """Make clouds of a number of points: what a frame has ahead, or frames over and over with noise upon them."""
    if points <= FRAME:
        return [ahead(frame, points) for frame in frames(turns(16 * points, MOST_FRAMES, FRAMES))]
    noise = np.random.default_rng(points).normal(0.0, 0.02, (points, 4)).astype(np.float32)
    noise[:, 3] = 0.0
    return [np.resize(frames()[0], (points, 4)) + noise]


def _inside(cloud: Cloud) -> Cloud:
    """Make a cloud of the same size whose every point is inside the gate."""
    rng = np.random.default_rng(len(cloud))
    columns = [rng.uniform(*bounds, len(cloud)) for bounds in (X, Y, Z, INTENSITY)]
    # Rounding cannot push one out, because the gate's bounds are rounded too.
    return np.column_stack(columns).astype(np.float32)


def _shuffled(cloud: Cloud) -> Cloud:
    return np.random.default_rng(0).permutation(cloud)


def _ascending(cloud: Cloud) -> Cloud:
    return cloud[np.argsort(cloud[:, 0], kind="stable")]


def _descending(cloud: Cloud) -> Cloud:
    return np.ascontiguousarray(_ascending(cloud)[::-1])


def _equal(cloud: Cloud) -> Cloud:
    middle = [sum(bounds) / 2 for bounds in (X, Y, Z, INTENSITY)]
    return np.tile(np.asarray(middle, cloud.dtype), (len(cloud), 1))


ORDERS: dict[str, Callable[[Cloud], Cloud]] = {
    "as recorded": lambda cloud: cloud,
    "random order": _shuffled,
    "ascending": _ascending,
    "descending": _descending,
    "all inside": _inside,
    "all inside, ascending": lambda cloud: _ascending(_inside(cloud)),
    "all inside, descending": lambda cloud: _descending(_inside(cloud)),
    "all equal": _equal,
}


def records(cloud: Cloud, step: int) -> Cloud:
    """Return the points as records of ``step`` bytes."""
    names, offsets = ["x", "y", "z", "intensity"], [0, 4, 8, STEPS[step]]
    dtype = np.dtype({"names": names, "formats": ["f4"] * 4, "offsets": offsets, "itemsize": step})
    out: Any = np.zeros(len(cloud), dtype)
    for column, name in enumerate(names):
        out[name] = cloud[:, column]
    return np.asarray(out)
