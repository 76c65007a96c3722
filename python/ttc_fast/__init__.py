"""Time-to-collision from laser scans and point clouds.

Rust kernels on zero-copy NumPy views. ``ttc_fast.reference`` has the same names in plain NumPy: it is the
specification, and what the kernels are tested against.
"""

import importlib
from typing import TYPE_CHECKING, Any

try:
    from ttc_fast._core import (
        SIMD_LEVEL,
        Alignment,
        AlphaBeta,
        CloudTracker,
        CloudTTC,
        Cluster,
        Consensus,
        Counts,
        CountsBatch,
        DistanceTracker,
        EstimatedNoise,
        Gate,
        InterquartileFence,
        KalmanCA,
        KalmanCV,
        KeypointTTC,
        KthSmallest,
        LeastSquares,
        MeanOfLowest,
        MedianRatio,
        Minimum,
        MinX,
        MotionMixture,
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
        ScaleTracker,
        ScanSweptPath,
        ScanTTC,
        SlidingLine,
        SlidingParabola,
        Supported,
        SweptPath,
        TheilSen,
        TrackedTTC,
        TrimmedMeanRatio,
        __version__,
        deceleration_to_avoid_crash,
        fit_road,
        ittc,
        robust_min_x,
        rss_longitudinal_distance,
        stopping_distance,
        time_headway,
        ttc_constant_acceleration,
        ttc_constant_velocity,
        ttc_from_clouds,
        ttc_from_distances,
        ttc_from_heights,
        ttc_from_keypoints,
        ttc_from_scale,
    )
except ImportError as error:
    from ttc_fast._extras import does_not_fit

    raise does_not_fit(error) from None
from ttc_fast.pointcloud2 import from_pointcloud2
from ttc_fast.signs import closing_speed_from_ego_velocity, range_rate_from_target_velocity
from ttc_fast.status import Detection, RoadStatus, Status

if TYPE_CHECKING:
    from ttc_fast.brake import (
        BrakeController,
        Command,
        Decision,
        Estimate,
        EstimateThreshold,
        IttcThreshold,
        Motion,
        PresentArc,
        Reason,
        RssDistance,
        StoppingDistance,
        SweptPathThreshold,
    )
    from ttc_fast.plotting import plot

__all__ = [
    "SIMD_LEVEL",
    "Alignment",
    "AlphaBeta",
    "BrakeController",
    "CloudTTC",
    "CloudTracker",
    "Cluster",
    "Command",
    "Consensus",
    "Counts",
    "CountsBatch",
    "Decision",
    "Detection",
    "DistanceTracker",
    "Estimate",
    "EstimateThreshold",
    "EstimatedNoise",
    "Gate",
    "InterquartileFence",
    "IttcThreshold",
    "KalmanCA",
    "KalmanCV",
    "KeypointTTC",
    "KthSmallest",
    "LeastSquares",
    "MeanOfLowest",
    "MedianRatio",
    "MinX",
    "Minimum",
    "Motion",
    "MotionMixture",
    "Nearest",
    "NearestBatch",
    "NearestPoint",
    "NearestPointBatch",
    "NeighbourSupport",
    "NoDataError",
    "PresentArc",
    "Quantile",
    "RangeRate",
    "RangeRateNearest",
    "Reason",
    "Road",
    "RoadFit",
    "RoadStatus",
    "RssDistance",
    "ScaleTracker",
    "ScanSweptPath",
    "ScanTTC",
    "SlidingLine",
    "SlidingParabola",
    "Status",
    "StoppingDistance",
    "Supported",
    "SweptPath",
    "SweptPathThreshold",
    "TheilSen",
    "TrackedTTC",
    "TrimmedMeanRatio",
    "__version__",
    "closing_speed_from_ego_velocity",
    "deceleration_to_avoid_crash",
    "fit_road",
    "from_pointcloud2",
    "ittc",
    "plot",
    "range_rate_from_target_velocity",
    "robust_min_x",
    "rss_longitudinal_distance",
    "stopping_distance",
    "time_headway",
    "ttc_constant_acceleration",
    "ttc_constant_velocity",
    "ttc_from_clouds",
    "ttc_from_distances",
    "ttc_from_heights",
    "ttc_from_keypoints",
    "ttc_from_scale",
]


# Imported when first asked for: a perception loop does without them.
_MODULES = ("brake", "compat", "configuration", "logs", "reference", "replay", "ros", "sensors")


def __getattr__(name: str) -> Any:
    """Return a module of the package, such as ``ttc_fast.replay``, or a public name of brake or plotting."""
    if name in _MODULES:
        return importlib.import_module(f"ttc_fast.{name}")
    if name in __all__:
        module = importlib.import_module("ttc_fast.plotting" if name == "plot" else "ttc_fast.brake")
        return globals().setdefault(name, getattr(module, name))
    raise AttributeError(f"module 'ttc_fast' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*__all__, *_MODULES, "status"})
