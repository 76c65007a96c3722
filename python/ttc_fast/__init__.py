"""Time-to-collision from laser scans, point clouds and cameras.

Rust kernels on zero-copy NumPy views. ``ttc_fast.reference`` has the same names in plain NumPy: it is the
specification, and what the kernels are tested against.
"""

from ttc_fast._core import (
    SIMD_LEVEL,
    Counts,
    CountsBatch,
    KthSmallest,
    Nearest,
    NearestBatch,
    NeighbourSupport,
    NoDataError,
    ScanTTC,
    ittc,
)
from ttc_fast.signs import closing_speed_from_ego_velocity, range_rate_from_target_velocity
from ttc_fast.status import Status

__all__ = [
    "SIMD_LEVEL",
    "Counts",
    "CountsBatch",
    "KthSmallest",
    "Nearest",
    "NearestBatch",
    "NeighbourSupport",
    "NoDataError",
    "ScanTTC",
    "Status",
    "closing_speed_from_ego_velocity",
    "ittc",
    "range_rate_from_target_velocity",
]
