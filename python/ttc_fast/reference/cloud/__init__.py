"""The robust nearest distance ahead in a point cloud, and a time-to-collision from how it shrinks.

- ``gate``: which points count, and how far ahead they are
- ``cluster``: the nearest group of points
- ``estimator``: from the points inside a gate to one distance, as ``robust_min_x``
- ``two_frame``: from two clouds to a time, as ``ttc_from_clouds``
- ``tracker``: from many clouds to a time
- ``own_vehicle``: the same past the vehicle itself, as ``CloudTracker``
"""

from ttc_fast.reference.cloud.estimator import MinX, robust_min_x
from ttc_fast.reference.cloud.own_vehicle import CloudTracker
from ttc_fast.reference.cloud.two_frame import CloudTTC, ttc_from_clouds

__all__ = ["CloudTTC", "CloudTracker", "MinX", "robust_min_x", "ttc_from_clouds"]
