"""PointCloud2 messages as drivers fill them, without ROS."""

from __future__ import annotations

import types
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast import from_pointcloud2

if TYPE_CHECKING:
    from numpy.typing import NDArray

DATATYPES = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "f4": 7, "f8": 8}
XYZ = (("x", 0, 7), ("y", 4, 7), ("z", 8, 7))
VELODYNE = (*XYZ, ("intensity", 12, 7), ("ring", 16, 4), ("time", 18, 7))  # steps of 22 bytes


def field(name: str, offset: int, datatype: int, count: int = 1) -> types.SimpleNamespace:
    return types.SimpleNamespace(name=name, offset=offset, datatype=datatype, count=count)


def message(width: int, fields: Any = VELODYNE, point_step: int = 22, **changes: Any) -> types.SimpleNamespace:
    """A message of ``width`` points in each row, whose bytes are zero unless given."""
    height, row_step = changes.get("height", 1), changes.get("row_step", width * point_step)
    whole: dict[str, Any] = {
        "height": height,
        "width": width,
        "fields": [field(*each) for each in fields],
        "is_bigendian": False,
        "point_step": point_step,
        "row_step": row_step,
        "data": b"" if "data" in changes else bytes(height * row_step),
        "is_dense": True,
    }
    return types.SimpleNamespace(**{**whole, **changes})


def filled(msg: types.SimpleNamespace, seed: int = 1) -> types.SimpleNamespace:
    """The message with points ahead, and noise wherever else there are bytes."""
    rng = np.random.default_rng(seed)
    msg.data = bytearray(rng.bytes(msg.height * msg.row_step))
    points = from_pointcloud2(msg)
    for name, (low, high) in {"x": (1, 40), "y": (-3, 3), "z": (-2, 2), "intensity": (0, 100)}.items():
        if name in (points.dtype.names or ()):
            points[name] = rng.uniform(low, high, points.shape)
    return msg


def rows(points: NDArray[np.void]) -> NDArray[Any]:
    """The same points as plain rows, by NumPy."""
    return np.stack([points[name] for name in ("x", "y", "z", "intensity") if name in (points.dtype.names or ())], -1)


def changed(msg: types.SimpleNamespace, **changes: Any) -> types.SimpleNamespace:
    return types.SimpleNamespace(**{**vars(msg), **changes})
