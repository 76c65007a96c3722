"""The gate: which points count. It is a corridor ahead, straight or curved, above the road, of points bright enough."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast._core import Gate
from ttc_fast.reference.formula import rounded
from ttc_fast.reference.points import COORDINATES

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ttc_fast.reference.points import Cloud

    Floats = NDArray[np.floating[Any]]
    Doubles = NDArray[np.float64]
    Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Candidates:
    """The points inside a gate, nearest first, and of two at one distance the one with the lower index first."""

    x: Doubles
    """Distances ahead, m, of shape (N,), rounded to the dtype of the cloud."""
    index: NDArray[np.intp]
    """Index of each in the cloud, of shape (N,)."""
    position: Doubles
    """Forward, left and up, m, of shape (N, 3)."""


def candidates(cloud: Cloud, gate: Gate) -> Candidates:
    """Find the points inside the gate."""
    if gate.intensity is not None and cloud.intensity is None:
        raise ValueError("gate has bounds on intensity, but the points have no intensity")
    forward, left, up = (_oriented(cloud.xyz, axis) for axis in gate.axes)
    straight = abs(gate.curvature) < np.finfo(np.float64).tiny
    x, y = (forward, left) if straight else path_coordinates(forward, left, gate.curvature)

    inside = cloud.valid() & _within(x, gate.x) & _within(y, gate.y)
    if gate.z is not None:
        inside &= _within(up, gate.z)
    if gate.intensity is not None and cloud.intensity is not None:
        inside &= _within(cloud.intensity, gate.intensity)
    if gate.road is not None and gate.height is not None:
        road = (gate.road.slope_x, gate.road.slope_y, gate.road.offset)
        inside &= _within(height_above(road, forward, left, up), gate.height)

    index = np.flatnonzero(inside)
    with np.errstate(over="ignore", under="ignore"):
        distance = x[index].astype(cloud.xyz.dtype).astype(np.float64)
    order = np.argsort(distance, kind="stable")  # stable: ties go to the lowest index
    index = index[order]
    return Candidates(distance[order], index, np.column_stack([forward, left, up])[index].astype(np.float64))


def path_coordinates(x: Floats, y: Floats, curvature: float) -> tuple[Doubles, Doubles]:
    """Distance along a curved path and offset from it, to the left, m, in float64.

    The path starts at the origin, forward, and is a circle about (0, 1 / curvature). The angle about its centre is by
    ``math.atan2``, which is the C library's as in the kernels.
    """
    x, y = x.astype(np.float64), y.astype(np.float64)
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        # Behind the circle's centre the sign of a zero decides half a turn: it is the path's, not the stored number's.
        ahead = np.where(x == 0, math.copysign(0.0, curvature), curvature * x)
        across = 1 - curvature * y
        angle = np.array(
            [math.atan2(*point) for point in zip(ahead.tolist(), across.tolist(), strict=True)], np.float64
        )
        offset = (2 * y - curvature * (x * x + y * y)) / (1 + np.sqrt(ahead * ahead + across * across))
        return angle / curvature, offset


def height_above(road: tuple[float, float, float], x: Floats, y: Floats, z: Floats) -> Doubles:
    """Height above the plane ``z = slope_x x + slope_y y + offset``, m, in float64."""
    slope_x, slope_y, offset = road
    x, y, z = x.astype(np.float64), y.astype(np.float64), z.astype(np.float64)
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        return z - (slope_x * x + slope_y * y + offset)


def checked_gate(gate: Any) -> Gate:
    """Return the gate; None stands for ``Gate()``."""
    if gate is None:
        return Gate()
    if not isinstance(gate, Gate):
        raise TypeError(f"gate must be a Gate, got {gate!r}")
    return gate


def _oriented(xyz: Floats, axis: str) -> Floats:
    """Give the coordinate along an axis such as "x" or "-y"; "-" says that the stored one points the other way."""
    stored: Floats = xyz[COORDINATES.index(axis.removeprefix("-"))]
    # Not -stored: that would give 0 a sign, which decides which way half a turn along the path goes.
    return 0 - stored if axis.startswith("-") else stored


def _within(values: NDArray[Any], bounds: tuple[float, float]) -> Bools:
    """Whether values are in the interval, ends included. The ends are rounded to the dtype of floats."""
    if values.dtype.kind != "f":
        values = values.astype(np.float64)
    low, high = (rounded(bound, values.dtype) for bound in bounds)
    inside: Bools = (low <= values) & (values <= high)
    return inside
