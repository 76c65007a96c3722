"""What a user would write in NumPy: the angle at which each point's circle meets the line of each edge."""

from __future__ import annotations

from typing import Any

import numpy as np


def least(points: Any, speed: Any, yaw_rate: Any, outline: Any, horizon: Any) -> Any:
    return times(points, speed, yaw_rate, outline, horizon).min()


def least_straight(points: Any, speed: Any, outline: Any, horizon: Any) -> Any:
    return times_straight(points, speed, outline, horizon).min()


def times_straight(points: Any, speed: Any, outline: Any, horizon: Any) -> Any:
    x_rear, x_front, y_right, y_left = outline
    x, y = points[:, 0], points[:, 1]
    ttc = np.maximum((x - x_front) / speed, 0.0)
    return np.where((y_right <= y) & (y <= y_left) & (x >= x_rear) & (ttc <= horizon), ttc, np.inf)


def times(points: Any, speed: Any, yaw_rate: Any, outline: Any, horizon: Any) -> Any:
    """Of points outside. A point on a circle of this radius is at this angle, and turns the other way."""
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
    """Until a point at an angle has turned to another, s."""
    return np.mod((angle - there) * np.sign(yaw_rate), 2 * np.pi) / abs(yaw_rate)
