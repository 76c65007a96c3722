"""Where beams point, how the sensor moves, and how far the vehicle reaches along a beam."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


LIGHT_SPEED = 299_792_458.0
"""No vehicle is faster, m/s."""


PARALLEL = 1e-12
"""Directions this close to an edge's run along it: the cosine of a right angle is not exactly 0."""


class Mount(NamedTuple):
    """Position (m) and yaw (rad) of the sensor in the vehicle frame."""

    x: float
    y: float
    yaw: float


class Outline(NamedTuple):
    """The vehicle as a rectangle in its own frame, m."""

    x_rear: float
    x_front: float
    y_right: float
    y_left: float


class Motion(NamedTuple):
    """Velocity (m/s) of the vehicle's origin, and its yaw rate (rad/s)."""

    speed: float
    yaw_rate: float
    lateral_speed: float


def beam_angles(angle_min: float, angle_increment: float, beams: int) -> NDArray[np.float64]:
    """Direction of each beam in the sensor frame, rad."""
    return angle_min + angle_increment * np.arange(beams, dtype=np.float64)


def directions(angles: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Cosine and sine of each angle.

    By ``math``, whose functions are the C library's as in the kernels. NumPy's own may differ from them in the last
    bit, depending on version and processor.
    """
    each = angles.tolist()
    return np.array([math.cos(angle) for angle in each]), np.array([math.sin(angle) for angle in each])


def sensor_velocity(motion: Motion, mount: Mount) -> tuple[float, float]:
    """Velocity of the sensor in the vehicle frame, v + omega x p, m/s [rigid-body kinematics]."""
    vx = motion.speed - motion.yaw_rate * mount.y
    vy = motion.lateral_speed + motion.yaw_rate * mount.x
    if not (abs(vx) < LIGHT_SPEED and abs(vy) < LIGHT_SPEED):
        fast = {"speed": motion.speed, "lateral_speed": motion.lateral_speed}
        argument = next((name for name, value in fast.items() if abs(value) >= LIGHT_SPEED), "yaw_rate")
        raise ValueError(f"{argument} moves the sensor faster than light, at ({vx}, {vy}) m/s")
    return vx, vy


def outline_offsets(
    outline: Outline, mount: Mount, cos: NDArray[np.float64], sin: NDArray[np.float64]
) -> NDArray[np.float64]:
    """How much of each beam's range lies inside the vehicle, m.

    Seen from strictly inside, the way to the edge. From the edge or outside, 0 for a beam that never enters the
    rectangle, and NaN for one that does, because it looks at the vehicle itself.
    """
    enter_x, leave_x = _crossing(mount.x, cos, outline.x_rear, outline.x_front)
    enter_y, leave_y = _crossing(mount.y, sin, outline.y_right, outline.y_left)
    enter, leave = np.maximum(enter_x, enter_y), np.minimum(leave_x, leave_y)
    if outline.x_rear < mount.x < outline.x_front and outline.y_right < mount.y < outline.y_left:
        return leave
    return np.where((enter < leave) & (leave > 0), np.nan, 0.0)


def _crossing(
    position: float, rate: NDArray[np.float64], low: float, high: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Where along each beam one coordinate enters and leaves ``(low, high)``, m; (inf, -inf) if it never does."""
    between = low < position < high
    enter = np.full_like(rate, -np.inf if between else np.inf)
    leave = np.full_like(rate, np.inf if between else -np.inf)
    moves = np.abs(rate) >= PARALLEL
    with np.errstate(over="ignore", under="ignore"):
        np.divide(np.where(rate > 0, low, high) - position, rate, out=enter, where=moves)
        np.divide(np.where(rate > 0, high, low) - position, rate, out=leave, where=moves)
    return enter, leave
