"""Time-to-collision from laser scans and point clouds.

Rust kernels on zero-copy NumPy views. ``ttc_fast.reference`` has the same names in plain NumPy: it is the
specification, and what the kernels are tested against.
"""

import importlib
from typing import Any

from ttc_fast._core import (
    SIMD_LEVEL,
    Alignment,
    CloudTracker,
    CloudTTC,
    Cluster,
    Counts,
    CountsBatch,
    Gate,
    InterquartileFence,
    KthSmallest,
    MeanOfLowest,
    Minimum,
    MinX,
    Nearest,
    NearestBatch,
    NearestPoint,
    NearestPointBatch,
    NeighbourSupport,
    NoDataError,
    Quantile,
    RangeRate,
    RangeRateNearest,
    Road,
    RoadFit,
    ScanSweptPath,
    ScanTTC,
    Supported,
    SweptPath,
    TrackedTTC,
    fit_road,
    ittc,
    robust_min_x,
    ttc_from_clouds,
    ttc_from_distances,
)
from ttc_fast.pointcloud2 import from_pointcloud2
from ttc_fast.signs import closing_speed_from_ego_velocity, range_rate_from_target_velocity
from ttc_fast.status import Detection, RoadStatus, Status

__all__ = [
    "SIMD_LEVEL",
    "Alignment",
    "CloudTTC",
    "CloudTracker",
    "Cluster",
    "Counts",
    "CountsBatch",
    "Detection",
    "Gate",
    "InterquartileFence",
    "KthSmallest",
    "MeanOfLowest",
    "MinX",
    "Minimum",
    "Nearest",
    "NearestBatch",
    "NearestPoint",
    "NearestPointBatch",
    "NeighbourSupport",
    "NoDataError",
    "Quantile",
    "RangeRate",
    "RangeRateNearest",
    "Road",
    "RoadFit",
    "RoadStatus",
    "ScanSweptPath",
    "ScanTTC",
    "Status",
    "Supported",
    "SweptPath",
    "TrackedTTC",
    "closing_speed_from_ego_velocity",
    "fit_road",
    "from_pointcloud2",
    "ittc",
    "range_rate_from_target_velocity",
    "robust_min_x",
    "ttc_from_clouds",
    "ttc_from_distances",
]


def __getattr__(name: str) -> Any:
    """``ttc_fast.reference``, imported when first asked for: a perception loop does without it."""
    if name == "reference":
        return importlib.import_module("ttc_fast.reference")
    raise AttributeError(f"module 'ttc_fast' has no attribute {name!r}")
