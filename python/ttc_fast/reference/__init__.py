"""``ttc_fast`` in plain NumPy: the same names and signatures, written to be read.

This is the specification of the kernels, and what they are tested against: it shares no arithmetic with them and does
nothing clever. Read it in this order:

- ``formula``: time-to-collision from clearance and closing speed; all else prepares its input or reads its output
- ``geometry``: where beams point, how the sensor moves, how far the vehicle reaches along a beam
- ``readings``: what a number in ``ranges`` means
- ``vote``: which beam decides
- ``scan`` and ``bare``: these put together, as ``ScanTTC`` and ``ittc``
- ``range_rate``: closing speeds from scan to scan instead of from the vehicle's speed, as ``RangeRate``
- ``results`` and ``arguments``: what comes out, and what may go in

and for point clouds:

- ``points``: what lies where in memory
- ``gate``: which points count, and how far ahead they are
- ``estimators``: from those to one distance
- ``cloud`` and ``shrinking``: these put together, as ``robust_min_x`` and ``ttc_from_clouds``
- ``road``: what a gate may stand on, found in the cloud
- ``profile`` and ``alignment``: how a body moves, from all of its cells
- ``cloud_tracker``: which body that is, as ``CloudTracker``

and for keypoints of a camera:

- ``similarity`` and ``consensus``: which matches move as one body
- ``scales``: from matches to one scale
- ``camera``: a time of that, as ``ttc_from_keypoints``

What has no arithmetic of its own (``Status``, ``Detection``, ``NoDataError``, the settings such as ``KthSmallest``,
``Gate`` and ``Road``, ``from_pointcloud2``, the two sign helpers) is not written twice: those are the same objects as
in ``ttc_fast``.
"""

from ttc_fast._core import (
    Alignment,
    Cluster,
    Consensus,
    Gate,
    InterquartileFence,
    KthSmallest,
    LeastSquares,
    MeanOfLowest,
    MedianRatio,
    Minimum,
    NeighbourSupport,
    NoDataError,
    Quantile,
    Road,
    Supported,
    TrimmedMeanRatio,
)
from ttc_fast.pointcloud2 import from_pointcloud2
from ttc_fast.reference.bare import ittc
from ttc_fast.reference.camera import KeypointTTC, ttc_from_heights, ttc_from_keypoints, ttc_from_scale
from ttc_fast.reference.cloud import MinX, robust_min_x
from ttc_fast.reference.cloud_tracker import CloudTracker, TrackedTTC
from ttc_fast.reference.range_rate import RangeRate, RangeRateNearest
from ttc_fast.reference.results import Counts, CountsBatch, Nearest, NearestBatch
from ttc_fast.reference.road import RoadFit, fit_road
from ttc_fast.reference.scan import ScanTTC
from ttc_fast.reference.shrinking import CloudTTC, ttc_from_clouds, ttc_from_distances
from ttc_fast.signs import closing_speed_from_ego_velocity, range_rate_from_target_velocity
from ttc_fast.status import Detection, RoadStatus, Status

__all__ = [
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
