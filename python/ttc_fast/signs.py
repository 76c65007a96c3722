"""The two signs of a speed along a beam, each with its own name.

``closing_speed`` is positive when approaching, ``range_rate`` is dr/dt and positive when opening. The classic formulae
of courses and papers differ in whose velocity they project. Both are here, so that no sign has to be flipped by hand.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


def closing_speed_from_ego_velocity(speed: ArrayLike, angle: ArrayLike) -> Any:
    """Return the speed at which a car driving straight closes along a beam: ``speed * cos(angle)``.

    Parameters
    ----------
    speed : array_like
        Forward speed of the car, m/s; negative when reversing. Odometry without a sign would take reversing for
        driving forward.
    angle : array_like
        Direction of the beam, counter-clockwise from straight ahead, rad.

    Returns
    -------
    float or ndarray
        m/s, positive when approaching, float64. NaN where an input is NaN.

    Notes
    -----
    This is the projection of the sensor's velocity on the beam [rigid-body kinematics].

    Examples
    --------
    >>> import numpy as np, ttc_fast
    >>> ranges = np.array([10.0])                                  # a wall ahead
    >>> ttc_fast.ittc(ranges, closing_speed=ttc_fast.closing_speed_from_ego_velocity(5.0, 0.0))
    array([2.])
    >>> ttc_fast.ittc(ranges, closing_speed=ttc_fast.closing_speed_from_ego_velocity(-5.0, 0.0))
    array([inf])
    """
    return _numbers("speed", speed) * np.cos(_numbers("angle", angle))


def range_rate_from_target_velocity(velocity: ArrayLike, angle: ArrayLike) -> Any:
    """Return the rate of the range to a target: ``velocity * cos(angle)``, with angle 0 moving straight away.

    Parameters
    ----------
    velocity : array_like
        Speed of the target relative to the sensor, m/s.
    angle : array_like
        Angle between the target's velocity and the beam, rad. At 0 the target moves away along the beam, at pi it comes
        straight at the sensor.

    Returns
    -------
    float or ndarray
        dr/dt, m/s, positive when opening, float64. NaN where an input is NaN.

    Notes
    -----
    This is the course's ``r_dot = Vx cos(theta)`` as it is written: the *target's* velocity along the beam [F1TENTH
    lecture].

    Examples
    --------
    >>> import math, numpy as np, ttc_fast
    >>> float(ttc_fast.range_rate_from_target_velocity(5.0, math.pi))
    -5.0
    >>> ttc_fast.ittc(np.array([10.0]), range_rate=-5.0)
    array([2.])
    """
    return _numbers("velocity", velocity) * np.cos(_numbers("angle", angle))


def _numbers(argument: str, value: ArrayLike) -> NDArray[np.float64]:
    numbers = np.asarray(value)
    if numbers.dtype.kind not in "fiu":
        raise TypeError(f"{argument} must be a number or an array of numbers, got {value!r}")
    return numbers.astype(np.float64)
