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
    Consensus,
    Counts,
    CountsBatch,
    Gate,
    InterquartileFence,
    KeypointTTC,
    KthSmallest,
    LeastSquares,
    MeanOfLowest,
    MedianRatio,
    Minimum,
    MinX,
    Nearest,
    NearestBatch,
    NeighbourSupport,
    NoDataError,
    Quantile,
    RangeRate,
    RangeRateNearest,
    Road,
    RoadFit,
    ScanTTC,
    Supported,
    TrackedTTC,
    TrimmedMeanRatio,
    fit_road,
    ittc,
    robust_min_x,
    ttc_from_clouds,
    ttc_from_distances,
    ttc_from_heights,
    ttc_from_keypoints,
    ttc_from_scale,
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
    "Consensus",
    "Counts",
    "CountsBatch",
    "Detection",
    "Gate",
    "InterquartileFence",
    "KeypointTTC",
    "KthSmallest",
    "LeastSquares",
    "MeanOfLowest",
    "MedianRatio",
    "MinX",
    "Minimum",
    "Nearest",
    "NearestBatch",
    "NeighbourSupport",
    "NoDataError",
    "Quantile",
    "RangeRate",
    "RangeRateNearest",
    "Road",
    "RoadFit",
    "RoadStatus",
    "ScanTTC",
    "Status",
    "Supported",
    "TrackedTTC",
    "TrimmedMeanRatio",
    "closing_speed_from_ego_velocity",
    "fit_road",
    "from_pointcloud2",
    "ittc",
    "range_rate_from_target_velocity",
    "robust_min_x",
    "ttc_from_clouds",
    "ttc_from_distances",
    "ttc_from_heights",
    "ttc_from_keypoints",
    "ttc_from_scale",
]


def __getattr__(name: str) -> Any:
    """``ttc_fast.reference``, imported when first asked for: a perception loop does without it."""
    if name == "reference":
        return importlib.import_module("ttc_fast.reference")
    raise AttributeError(f"module 'ttc_fast' has no attribute {name!r}")
