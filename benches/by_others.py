"""SciPy and Open3D, where they are installed."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np

from benches.by_numpy import mask
from benches.street import X, Y, Z


def _imported(name: str) -> Any:
    """A module, or None where it is not installed, or lacks a library of the system."""
    try:
        return import_module(name) if find_spec(name.partition(".")[0]) else None
    except ImportError:
        return None


open3d = _imported("open3d")
spatial, sparse, csgraph = (_imported(f"scipy.{name}") for name in ("spatial", "sparse", "sparse.csgraph"))


def scipy_cluster(points: Any, tolerance: float, min_points: int) -> Any:
    """The nearest connected component of the graph of close pairs that is large enough."""
    inside = points[mask(points), :3]
    pairs = spatial.cKDTree(inside).query_pairs(tolerance, output_type="ndarray")
    links = sparse.coo_matrix((np.ones(len(pairs), bool), pairs.T), shape=(len(inside), len(inside)))
    return _nearest_group(inside, csgraph.connected_components(links, directed=False)[1], min_points)


def open3d_cluster(points: Any, tolerance: float, min_points: int) -> Any:
    """DBSCAN of the gated points in which every point is a core point, which makes it the same question."""
    inside = points[mask(points), :3]
    labels = np.asarray(open3d_cloud(inside).cluster_dbscan(tolerance, 1))
    return _nearest_group(inside, labels, min_points)


def open3d_cloud(points: Any) -> Any:
    """Coordinates as Open3D keeps them: copied to float64."""
    return open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points[:, :3].astype(np.float64)))


def open3d_box() -> Any:
    """The gate, but for the intensity, which its clouds do not have."""
    return open3d.geometry.AxisAlignedBoundingBox(*np.transpose((X, Y, Z)))


def open3d_minimum(cloud: Any, box: Any) -> Any:
    """The usual recipe: crop, remove outliers, take the least x. Another question with another answer."""
    kept, _ = cloud.crop(box).remove_statistical_outlier(20, 2.0)
    return kept.get_min_bound()[0]


def _nearest_group(inside: Any, labels: Any, min_points: int) -> Any:
    large = np.bincount(labels)[labels] >= min_points
    return inside[large, 0].min()
