"""The vehicle: where its sensor sits, how far it reaches along a beam, and how it moves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ttc_fast.reference.arguments import finite

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.floating[Any]]

LIGHT_SPEED = 299_792_458.0
"""No vehicle is faster, m/s."""

LARGEST = 1e6
"""No plan of a vehicle reaches farther from its origin, m."""

LONGEST = 100.0
"""An outline that reaches farther from the vehicle's origin is more likely in millimetres, m."""

PARALLEL = 1e-12
"""Directions this close to the direction of an edge run along it: the cosine of a right angle is not exactly 0."""


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


def checked_mount(mount: Any) -> Mount:
    """Return where the sensor sits."""
    return Mount(*(finite("mount", value) for value in mount))


def checked_outline(outline: Any) -> Outline:
    """Return the shape of the vehicle."""
    result = Outline(*(finite("outline", edge) for edge in outline))
    if not (result.x_rear < result.x_front and result.y_right < result.y_left):
        raise ValueError(f"outline must have x_rear < x_front and y_right < y_left, got {result}")
    if not all(abs(edge) <= LONGEST for edge in result):
        raise ValueError(f"outline must lie within {LONGEST} m of the vehicle's origin; lengths are in metres")
    return result


def motions(ranges: Floats, speed: Any, yaw_rate: Any, lateral_speed: Any) -> list[Motion]:
    """Return the motion of each scan: numbers for one scan; for a batch, numbers or arrays with one entry per scan."""
    if ranges.ndim == 1:
        return [Motion(finite("speed", speed), finite("yaw_rate", yaw_rate), finite("lateral_speed", lateral_speed))]
    columns = (
        _one_each("speed", speed, len(ranges)),
        _one_each("yaw_rate", yaw_rate, len(ranges)),
        _one_each("lateral_speed", lateral_speed, len(ranges)),
    )
    return [Motion(*row) for row in zip(*columns, strict=True)]


def _one_each(argument: str, values: Any, scans: int) -> list[float]:
    array = np.asarray(values)
    if array.ndim == 0:
        return [finite(argument, values)] * scans
    if array.shape != (scans,):
        raise ValueError(f"{argument} must be a number or have shape ({scans},), got {array.shape}")
    return [finite(argument, value) for value in array]


def sensor_velocity(motion: Motion, mount: Mount) -> tuple[float, float]:
    """Return the velocity of the sensor in the vehicle frame, v + omega x p, m/s [rigid-body kinematics]."""
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
    """Return how much of each beam's range lies inside the vehicle, m.

    For a sensor strictly inside, that is the way to the edge. For one on the edge or outside, it is 0 where the beam
    never enters the rectangle, and NaN where it does, because that beam looks at the vehicle itself.
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
    """Return where along each beam a coordinate enters and leaves ``(low, high)``, m; (inf, -inf) if it never does."""
    between = low < position < high
    enter = np.full_like(rate, -np.inf if between else np.inf)
    leave = np.full_like(rate, np.inf if between else -np.inf)
    moves = np.abs(rate) >= PARALLEL
    with np.errstate(over="ignore", under="ignore"):
        np.divide(np.where(rate > 0, low, high) - position, rate, out=enter, where=moves)
        np.divide(np.where(rate > 0, high, low) - position, rate, out=leave, where=moves)
    return enter, leave
