"""``ttc_fast`` in plain NumPy: the same names and signatures, written to be read.

This is the specification of the kernels, and what they are tested against: it shares no arithmetic with them and does
nothing clever. Read it in this order:

- ``formula``: time-to-collision from clearance and closing speed; all else prepares its input or reads its output
- ``vehicle``: where the sensor sits, how far the vehicle reaches along a beam, how it moves
- ``ittc``: the bare formula over arrays
- ``scan``: iTTC of the beams of a scanner, as ``ScanTTC``; in it ``settings``, ``readings`` (what a number in
  ``ranges`` means) and ``vote`` (which beam decides)
- ``range_rate``: closing speeds from scan to scan instead of from the vehicle's speed, as ``RangeRate``
- ``path``: when points enter the moving outline, as ``SweptPath``; in it ``sweep``, the way of one point
- ``scan.swept``: when the points of beams do, as ``ScanSweptPath``
- ``hit`` and ``arguments``: counts and batches that come out, and checks of what goes in

and for point clouds:

- ``points``: what lies where in memory
- ``cloud``: the robust nearest distance ahead, as ``robust_min_x``, and times from it, as ``ttc_from_clouds`` and
  ``CloudTracker``; in it ``gate`` (which points count), ``estimator``, ``cluster``, ``two_frame`` and ``tracker``
- ``alignment``: how a body moves, from all of its profile; in it ``profile``, ``weights`` and ``fit``
- ``road``: the plane that a gate may stand on, as ``fit_road``

and for motion:

- ``motion``: the formulae of motion along a line
- ``tracker``: closing speed and time-to-collision over several frames, as ``DistanceTracker`` and ``ScaleTracker``

and for keypoints of a camera:

- ``camera``: times from how a thing grows, as ``ttc_from_keypoints``; in it ``matches``, ``pairs``, ``similarity``,
  ``consensus`` and ``estimator``

What has no arithmetic of its own (``Status``, ``Detection``, ``NoDataError``, the settings such as ``KthSmallest``,
``Gate``, ``Road`` and ``KalmanCA``, ``from_pointcloud2``, the two sign helpers) is not written twice: those are the
same objects as in ``ttc_fast``.
"""

from ttc_fast._core import (
    Alignment,
    AlphaBeta,
    Cluster,
    Consensus,
    EstimatedNoise,
    Gate,
    InterquartileFence,
    KalmanCA,
    KalmanCV,
    KthSmallest,
    LeastSquares,
    MeanOfLowest,
    MedianRatio,
    Minimum,
    MotionMixture,
    NeighbourSupport,
    NoDataError,
    Quantile,
    Road,
    SlidingLine,
    SlidingParabola,
    Supported,
    TheilSen,
    TrimmedMeanRatio,
)
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
from ttc_fast.pointcloud2 import from_pointcloud2
from ttc_fast.reference.camera import KeypointTTC, ttc_from_heights, ttc_from_keypoints, ttc_from_scale
from ttc_fast.reference.cloud import CloudTracker, CloudTTC, MinX, robust_min_x, ttc_from_clouds
from ttc_fast.reference.hit import Counts, CountsBatch
from ttc_fast.reference.ittc import ittc
from ttc_fast.reference.motion import (
    deceleration_to_avoid_crash,
    rss_longitudinal_distance,
    stopping_distance,
    time_headway,
    ttc_constant_acceleration,
    ttc_constant_velocity,
    ttc_from_distances,
)
from ttc_fast.reference.path import NearestPoint, NearestPointBatch, SweptPath
from ttc_fast.reference.range_rate import RangeRate, RangeRateNearest
from ttc_fast.reference.road import RoadFit, fit_road
from ttc_fast.reference.scan import Nearest, NearestBatch, ScanTTC
from ttc_fast.reference.scan.swept import ScanSweptPath
from ttc_fast.reference.tracker import DistanceTracker, ScaleTracker, TrackedTTC
from ttc_fast.signs import closing_speed_from_ego_velocity, range_rate_from_target_velocity
from ttc_fast.status import Detection, RoadStatus, Status

__all__ = [
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
    "closing_speed_from_ego_velocity",
    "deceleration_to_avoid_crash",
    "fit_road",
    "from_pointcloud2",
    "ittc",
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
