"""What a user would write in NumPy, with SciPy or with Open3D: tables made once, then a line for each step."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np

from benches.car import MIN_CLOSING_SPEED, RANGE_MAX, RANGE_MIN
from benches.street import INTENSITY, X, Y, Z


def _imported(name: str) -> Any:
    """Return a module, or None where it is not installed, or lacks a library of the system."""
    try:
        return import_module(name) if find_spec(name.partition(".")[0]) else None
    except ImportError:
        return None


open3d = _imported("open3d")
spatial, distance, sparse, csgraph = (
    _imported(f"scipy.{name}") for name in ("spatial", "spatial.distance", "sparse", "sparse.csgraph")
)


# Scans


def times(ranges: Any, closing: Any, offsets: Any) -> Any:
    usable = (ranges >= RANGE_MIN) & (ranges <= RANGE_MAX) & (closing > MIN_CLOSING_SPEED)
    return np.where(usable, np.maximum(ranges - offsets, 0.0) / closing, np.inf)


def per_beam(ranges: Any, speed: Any, cosines: Any, offsets: Any) -> Any:
    return times(ranges, speed * cosines, offsets)


def least(ranges: Any, speed: Any, cosines: Any, offsets: Any) -> Any:
    return times(ranges, speed * cosines, offsets).min()


def least_turning(ranges: Any, vx: Any, vy: Any, cosines: Any, sines: Any, offsets: Any) -> Any:
    return times(ranges, vx * cosines + vy * sines, offsets).min()


def nearest(ranges: Any, speed: Any, cosines: Any, offsets: Any) -> Any:
    return _nearest(times(ranges, speed * cosines, offsets))


def nearest_turning(ranges: Any, vx: Any, vy: Any, cosines: Any, sines: Any, offsets: Any) -> Any:
    return _nearest(times(ranges, vx * cosines + vy * sines, offsets))


def _nearest(ttc: Any) -> Any:
    beam = ttc.argmin()
    return ttc[beam], beam


def least_each(ranges: Any, speeds: Any, cosines: Any, offsets: Any) -> Any:
    return times(ranges, speeds[:, np.newaxis] * cosines, offsets).min(axis=1)


def least_turning_each(ranges: Any, vx: Any, vy: Any, cosines: Any, sines: Any, offsets: Any) -> Any:
    return times_each(ranges, vx, vy, cosines, sines, offsets).min(axis=1)


def times_each(ranges: Any, vx: Any, vy: Any, cosines: Any, sines: Any, offsets: Any) -> Any:
    return times(ranges, vx[:, np.newaxis] * cosines + vy[:, np.newaxis] * sines, offsets)


def nearest_each(ranges: Any, speeds: Any, cosines: Any, offsets: Any) -> Any:
    ttc = times(ranges, speeds[:, np.newaxis] * cosines, offsets)
    beam = ttc.argmin(axis=1)
    return np.take_along_axis(ttc, beam[:, np.newaxis], axis=1)[:, 0], beam


def ittc(ranges: Any, closing: Any) -> Any:
    return np.where((ranges >= 0.0) & (closing > 0.0), ranges / closing, np.inf)


def per_beam_each(ranges: Any, speeds: Any, cosines: Any, offsets: Any) -> Any:
    return times(ranges, speeds[:, np.newaxis] * cosines, offsets)


# Clouds


def columns(points: Any) -> Any:
    """Return x, y, z and intensity of rows or records."""
    return points.T if points.dtype.names is None else [points[name] for name in ("x", "y", "z", "intensity")]


def as_rows(points: Any) -> Any:
    """Copy records to plain rows."""
    return np.column_stack(columns(points))


def mask(points: Any) -> Any:
    x, y, z, intensity = columns(points)
    inside = (x >= X[0]) & (x <= X[1]) & (y >= Y[0]) & (y <= Y[1])
    return inside & (z >= Z[0]) & (z <= Z[1]) & (intensity >= INTENSITY[0]) & (intensity <= INTENSITY[1])


def gated(points: Any) -> Any:
    return columns(points)[0][mask(points)]


def minimum(points: Any) -> Any:
    return gated(points).min()


def kth_smallest(points: Any, k: int) -> Any:
    return np.partition(gated(points), k - 1)[k - 1]


def quantile(points: Any, q: float) -> Any:
    return np.quantile(gated(points), q)


def mean_of_lowest(points: Any, k: int) -> Any:
    return np.partition(gated(points), k - 1)[:k].mean()


def interquartile_fence(points: Any, factor: float) -> Any:
    x = gated(points)
    low, high = np.quantile(x, (0.25, 0.75))
    return x[x >= low - factor * (high - low)].min()


def supported(points: Any, count: int, gap: float) -> Any:
    x = np.sort(gated(points))
    return x[: len(x) - count + 1][x[count - 1 :] <= x[: len(x) - count + 1] + gap][0]


def scipy_cluster(points: Any, tolerance: float, min_points: int) -> Any:
    """Return the least x of the large connected components of the graph of close pairs."""
    inside = points[mask(points), :3]
    pairs = spatial.cKDTree(inside).query_pairs(tolerance, output_type="ndarray")
    links = sparse.coo_matrix((np.ones(len(pairs), bool), pairs.T), shape=(len(inside), len(inside)))
    return _nearest_group(inside, csgraph.connected_components(links, directed=False)[1], min_points)


def open3d_cluster(points: Any, tolerance: float, min_points: int) -> Any:
    """Return the least x of the large clusters of DBSCAN in which every point is a core point: the same question."""
    inside = points[mask(points), :3]
    labels = np.asarray(open3d_cloud(inside).cluster_dbscan(tolerance, 1))
    return _nearest_group(inside, labels, min_points)


def open3d_cloud(points: Any) -> Any:
    """Copy coordinates to float64, as Open3D keeps them."""
    return open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points[:, :3].astype(np.float64)))


def open3d_box() -> Any:
    """Return the gate without the intensity, which clouds of Open3D do not have."""
    return open3d.geometry.AxisAlignedBoundingBox(*np.transpose((X, Y, Z)))


def open3d_minimum(cloud: Any, box: Any) -> Any:
    """Crop, remove outliers, take the least x: the usual recipe, which is another question with another answer."""
    kept, _ = cloud.crop(box).remove_statistical_outlier(20, 2.0)
    return kept.get_min_bound()[0]


def _nearest_group(inside: Any, labels: Any, min_points: int) -> Any:
    large = np.bincount(labels)[labels] >= min_points
    return inside[large, 0].min()


# Swept paths


def swept_least(points: Any, speed: Any, yaw_rate: Any, outline: Any, horizon: Any) -> Any:
    return swept_times(points, speed, yaw_rate, outline, horizon).min()


def swept_least_straight(points: Any, speed: Any, outline: Any, horizon: Any) -> Any:
    return swept_times_straight(points, speed, outline, horizon).min()


def swept_times_straight(points: Any, speed: Any, outline: Any, horizon: Any) -> Any:
    x_rear, x_front, y_right, y_left = outline
    x, y = points[:, 0], points[:, 1]
    ttc = np.maximum((x - x_front) / speed, 0.0)
    return np.where((y_right <= y) & (y <= y_left) & (x >= x_rear) & (ttc <= horizon), ttc, np.inf)


def swept_times(points: Any, speed: Any, yaw_rate: Any, outline: Any, horizon: Any) -> Any:
    """Turn each point backwards about the centre of the bend until its circle meets the line of an edge."""
    x_rear, x_front, y_right, y_left = outline
    centre = speed / yaw_rate
    x, y = points[:, 0], points[:, 1] - centre
    radius, angle = np.hypot(x, y), np.arctan2(y, x)
    first = np.full(radius.shape, np.inf)
    with np.errstate(invalid="ignore"):
        for edge in (x_rear, x_front):
            other = np.sqrt(radius**2 - edge**2)
            for side in (other, -other):
                inside = (y_right - centre <= side) & (side <= y_left - centre)
                first = np.where(inside, np.minimum(first, _wait(angle, np.arctan2(side, edge), yaw_rate)), first)
        for edge in (y_right - centre, y_left - centre):
            other = np.sqrt(radius**2 - edge**2)
            for side in (other, -other):
                inside = (x_rear <= side) & (side <= x_front)
                first = np.where(inside, np.minimum(first, _wait(angle, np.arctan2(edge, side), yaw_rate)), first)
    return np.where(first <= horizon, first, np.inf)


def _wait(angle: Any, there: Any, yaw_rate: Any) -> Any:
    """Return the seconds until a point at an angle has turned to another."""
    return np.mod((angle - there) * np.sign(yaw_rate), 2 * np.pi) / abs(yaw_rate)


# Trackers


def speeds(frames: list[tuple[float, float]], window: float) -> float:
    """Fit a line through the newest seconds after each frame; return the last closing speed."""
    distances, stamps = np.array(frames).T
    for last in range(2, len(frames) + 1):
        first = np.searchsorted(stamps, stamps[last - 1] - window)
        time = stamps[first:last] - stamps[last - 1]
        slope, _ = np.polyfit(time, distances[first:last], 1)
    return -float(slope)


# Camera


def median_ratio(previous: Any, current: Any, least: float) -> Any:
    i, j = np.triu_indices(len(previous), 1)
    before = np.linalg.norm(previous[i] - previous[j], axis=1)
    now = np.linalg.norm(current[i] - current[j], axis=1)
    kept = (before > 0) & (now >= least)
    return np.median(now[kept] / before[kept])


def median_ratio_by_scipy(previous: Any, current: Any, least: float) -> Any:
    before, now = distance.pdist(previous), distance.pdist(current)
    kept = (before > 0) & (now >= least)
    return np.median(now[kept] / before[kept])
