"""Clouds as the swept path wants them: the points of a vehicle's height."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.lib import recfunctions

if TYPE_CHECKING:
    from numpy.typing import NDArray

FAR_AWAY = 1e6
"""m: further than anything drives while it looks ahead."""


def only_heights(points: Any, low: float, high: float) -> NDArray[np.floating[Any]]:
    """Return a copy of a cloud in which only points of some height are in the way.

    The others are moved far away instead of taken out: the sensor saw them, so it is not blind, and the indices stay.

    Parameters
    ----------
    points : array_like, shape (N, 3 or more), or records with x, y and z
        m.
    low, high : float
        From and to which z, m.

    Returns
    -------
    ndarray, shape (N, 3)

    Raises
    ------
    ValueError
        If it is neither.

    Examples
    --------
    >>> from ttc_fast.ros.clouds import only_heights
    >>> only_heights([[3.0, 0.0, 0.5], [2.0, 0.0, 0.0], [0.0, 0.0, 0.0]], 0.1, 2.0)[:, 0]
    array([3.e+00, 1.e+06, 0.e+00])
    """
    points = np.asarray(points)
    if points.dtype.names:
        points = recfunctions.structured_to_unstructured(points[["x", "y", "z"]])
    if points.ndim != 2 or points.shape[1] < 3:
        raise ValueError(f"points must be rows x, y, z, got an array of shape {points.shape}")
    cloud = np.array(points[:, :3])
    z = cloud[:, 2]
    aside = (z < low) | (z > high)
    aside &= np.isfinite(cloud).all(axis=1) & (cloud != 0.0).any(axis=1)  # neither of which is a point
    cloud[aside, :2] = FAR_AWAY
    return cloud
