"""Where the points of a cloud lie on the vehicle, and which of them are in its way.

A cloud is measured in the frame of its sensor. A rotation and a shift place it in the frame of the vehicle, where x is
forward, y left and z up; ``Placement`` keeps both. Points whose height is not that of an obstacle are moved far away
rather than removed: the sensor saw them, so it is not blind, and the indices stay. Rows that are no points stay none.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.lib import recfunctions

from ttc_fast.pointcloud2 import read_pointcloud2
from ttc_fast.sensors.transforms import FROM_OPTICAL, is_optical

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ttc_fast.sensors.oddities import Tally
    from ttc_fast.sensors.transforms import Mount

FAR_AWAY = 1e6
"""m: a distance further than anything drives within the horizon."""


class Placement(NamedTuple):
    """Where stored points are in the frame of the vehicle: ``turn @ point + shift``, m.

    Examples
    --------
    A lidar that looks to the left, 1 m above the origin of the vehicle:

    >>> import numpy as np
    >>> from ttc_fast.sensors.clouds import Placement
    >>> left = Placement(np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), np.array([0.0, 0.0, 1.0]))
    >>> left.placed(np.array([[3.0, 0.0, 0.0]])).tolist()
    [[0.0, 3.0, 1.0]]
    """

    turn: NDArray[np.float64]
    shift: NDArray[np.float64]

    @classmethod
    def of(cls, mount: Mount | None, frame: str) -> Placement | None:
        """Return where the static transforms, or the axes of its frame, place a sensor; None where neither does."""
        if is_optical(frame):
            return cls(FROM_OPTICAL, np.zeros(3)) if mount is None else cls(mount.turn @ FROM_OPTICAL, mount.shift)
        return None if mount is None else cls(mount.turn, mount.shift)

    def turned(self, points: NDArray[Any]) -> NDArray[np.float64]:
        """Return rows x, y, z that are turned as the vehicle, from the sensor on; what is no point is NaN."""
        rows = rows_of(points).astype(np.float64)
        nothing = ~rows.any(axis=1)  # where nothing came back (0, 0, 0) is stored, which would be moved
        rows = rows @ self.turn.T
        rows[nothing] = np.nan
        return rows

    def placed(self, points: NDArray[Any]) -> NDArray[np.float64]:
        """Return rows x, y, z in the frame of the vehicle; what is no point is NaN."""
        return self.turned(points) + self.shift


class CloudReader:
    """Reads the clouds of one topic, and counts what is odd about them by its name."""

    def __init__(self, name: str, odd: Tally) -> None:
        self._name = name
        self._odd = odd

    def read(self, message: Any, *, intensity: str | None = "intensity") -> NDArray[np.void]:
        """Return the points of a sensor_msgs/PointCloud2, as ``read_pointcloud2`` does."""
        points, oddities = read_pointcloud2(message, intensity=intensity)
        for part, text in oddities.items():
            self._odd.count(f"{self._name}, {part}", text)
        return points


def rows_of(points: Any) -> NDArray[Any]:
    """Return a cloud of any layout as rows x, y, z: a view where there is one.

    Parameters
    ----------
    points : array_like, shape (N, 3 or more) or (H, W, 3 or more), or records with x, y and z of shape (N,) or (H, W)
        The cloud, m; an organised one is taken row by row.

    Returns
    -------
    ndarray, shape (N, 3) or (H * W, 3)

    Raises
    ------
    ValueError
        If the cloud has another shape.

    Examples
    --------
    >>> from ttc_fast.sensors.clouds import rows_of
    >>> rows_of([[[3.0, 0.0, 0.5, 7.0]], [[2.0, 0.0, 0.0, 7.0]]]).shape
    (2, 3)
    """
    points = np.asarray(points)
    if points.dtype.names:
        points = recfunctions.structured_to_unstructured(points[["x", "y", "z"]])
    if points.ndim not in (2, 3) or points.shape[-1] < 3:
        raise ValueError(f"points must be rows x, y, z, or rows of them, got an array of shape {points.shape}")
    rows: NDArray[Any] = points[..., :3].reshape(-1, 3)
    return rows


def only_heights(points: Any, low: float, high: float) -> NDArray[np.floating[Any]]:
    """Return a copy of a cloud in which only the points between two heights are in the way.

    The other points are moved far away, not removed: the sensor saw them, so it is not blind, and the indices stay.

    Parameters
    ----------
    points : array_like
        The cloud, m, as ``rows_of`` takes it.
    low, high : float
        The least and the greatest z of the points that are in the way, m.

    Returns
    -------
    ndarray, shape (N, 3) or (H * W, 3)

    Raises
    ------
    ValueError
        If the cloud has another shape.

    Examples
    --------
    >>> from ttc_fast.sensors.clouds import only_heights
    >>> only_heights([[3.0, 0.0, 0.5], [2.0, 0.0, 0.0], [0.0, 0.0, 0.0]], 0.1, 2.0)[:, 0]
    array([3.e+00, 1.e+06, 0.e+00])
    """
    cloud = np.array(rows_of(points))
    z = cloud[:, 2]
    aside = (z < low) | (z > high)
    aside &= np.isfinite(cloud).all(axis=1) & (cloud != 0.0).any(axis=1)  # other rows are no points
    cloud[aside, :2] = FAR_AWAY
    return cloud
