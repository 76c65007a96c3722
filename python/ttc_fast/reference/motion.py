"""Formulae of motion along a line: times, distances and decelerations, element by element."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast.reference.arguments import checked_dt, finite, floats, non_negative, not_nan, output, positive
from ttc_fast.status import Status

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray


def ttc_from_distances(previous: float, current: float, dt: float) -> float:
    """Return the time-to-collision from two distances, if the gap goes on shrinking as it did, s.

    Arguments, result and errors are those of ``ttc_fast.ttc_from_distances``. TTC = d1 dt / (d0 - d1).

    Examples
    --------
    >>> from ttc_fast import reference
    >>> round(reference.ttc_from_distances(10.0, 9.5, 0.1), 6)
    1.9
    """
    previous, current, dt = finite("previous", previous), finite("current", current), checked_dt(dt)
    if not previous > current:
        return math.inf
    if not current > 0:
        return 0.0
    product, shrunk = current * dt, previous - current
    return product / shrunk if product < math.inf else current / shrunk * dt


def ttc_constant_velocity(distance: Any, *, closing_speed: Any, status_out: NDArray[np.uint8] | None = None) -> Any:
    """Return the seconds until a distance is used up at constant closing speed.

    Arguments, result and errors are those of ``ttc_fast.ttc_constant_velocity``.

    Examples
    --------
    >>> from ttc_fast import reference
    >>> reference.ttc_constant_velocity(10.0, closing_speed=5.0)
    2.0
    """
    arguments = {"distance": (distance, not_nan), "closing_speed": (closing_speed, finite)}
    return _each(lambda d, v: _first_root(d, v, 0.0), arguments, status_out)


def ttc_constant_acceleration(
    distance: Any, *, closing_speed: Any, closing_acceleration: Any, status_out: NDArray[np.uint8] | None = None
) -> Any:
    """Return the first positive root of ``distance = closing_speed t + closing_acceleration t^2 / 2``.

    Arguments, result and errors are those of ``ttc_fast.ttc_constant_acceleration``.

    Examples
    --------
    >>> from ttc_fast import reference
    >>> round(reference.ttc_constant_acceleration(10.0, closing_speed=10.0, closing_acceleration=-2.0), 3)
    1.127
    """
    arguments = {
        "distance": (distance, not_nan),
        "closing_speed": (closing_speed, finite),
        "closing_acceleration": (closing_acceleration, finite),
    }
    return _each(_first_root, arguments, status_out)


def time_headway(distance: Any, *, speed: Any) -> Any:
    """Return the seconds until a follower is where the one ahead is now.

    Arguments, result and errors are those of ``ttc_fast.time_headway``.

    Examples
    --------
    >>> from ttc_fast import reference
    >>> reference.time_headway(30.0, speed=20.0)
    1.5
    """

    def headway(d: float, v: float) -> float:
        if math.isnan(d) or math.isnan(v):
            return math.nan
        if v <= 0:
            return math.inf
        return 0.0 if d <= 0 else _divided(d, v)

    return _each(headway, {"distance": (distance, not_nan), "speed": (speed, finite)})


def deceleration_to_avoid_crash(distance: Any, *, closing_speed: Any) -> Any:
    """Return the constant deceleration that just avoids a crash.

    Arguments, result and errors are those of ``ttc_fast.deceleration_to_avoid_crash``.

    Examples
    --------
    >>> from ttc_fast import reference
    >>> reference.deceleration_to_avoid_crash(10.0, closing_speed=10.0)
    5.0
    """

    def needed(d: float, v: float) -> float:
        if math.isnan(d) or math.isnan(v):
            return math.nan
        if v <= 0:
            return 0.0
        return math.inf if d <= 0 else v * _divided(v, 2 * d)

    return _each(needed, {"distance": (distance, not_nan), "closing_speed": (closing_speed, finite)})


def stopping_distance(speed: Any, *, deceleration: Any, reaction_time: Any) -> Any:
    """Return how far a vehicle goes until it stands.

    Arguments, result and errors are those of ``ttc_fast.stopping_distance``.

    Examples
    --------
    >>> from ttc_fast import reference
    >>> reference.stopping_distance(10.0, deceleration=5.0, reaction_time=0.5)
    15.0
    """

    def stopping(v: float, a: float, t: float) -> float:
        if not (a > 0 and t >= 0):
            return math.nan
        return abs(v) * t + abs(v) * _divided(abs(v), 2 * a)

    arguments = {
        "speed": (speed, finite),
        "deceleration": (deceleration, positive),
        "reaction_time": (reaction_time, non_negative),
    }
    return _each(stopping, arguments)


def rss_longitudinal_distance(
    rear_speed: Any,
    front_speed: Any,
    *,
    response_time: Any,
    acceleration_max: Any,
    braking_min: Any,
    braking_max: Any,
) -> Any:
    """Return the safe longitudinal distance of RSS.

    Arguments, result and errors are those of ``ttc_fast.rss_longitudinal_distance``.

    Examples
    --------
    >>> from ttc_fast import reference
    >>> braking = {"acceleration_max": 2.0, "braking_min": 4.0, "braking_max": 8.0}
    >>> reference.rss_longitudinal_distance(20.0, 20.0, response_time=1.0, **braking)
    56.5
    """

    def distance(rear: float, front: float, t: float, a: float, weakest: float, strongest: float) -> float:
        if not (t >= 0 and a >= 0 and weakest > 0 and strongest > 0):
            return math.nan
        after = rear + t * a
        gap = rear * t + 0.5 * a * t * t + after * _divided(abs(after), 2 * weakest)
        gap -= front * _divided(abs(front), 2 * strongest)
        return 0.0 if gap < 0 else gap

    arguments = {
        "rear_speed": (rear_speed, finite),
        "front_speed": (front_speed, finite),
        "response_time": (response_time, non_negative),
        "acceleration_max": (acceleration_max, non_negative),
        "braking_min": (braking_min, positive),
        "braking_max": (braking_max, positive),
    }
    return _each(distance, arguments)


def _first_root(d: float, v: float, a: float) -> float:
    """Solve ``d = v t + a t^2 / 2`` for the first ``t`` above 0."""
    closes = v > 0 or (v == 0 and a > 0)
    if math.isnan(d) or d == math.inf or not (math.isfinite(v) and math.isfinite(a)):
        return math.inf
    if d <= 0:
        return 0.0 if closes else math.inf
    if a == 0:
        return _divided(d, v) if closes else math.inf
    square = v * v + 2 * a * d
    if square < 0 or (not closes and (a < 0 or square == 0)):  # 0 by underflow: it comes back after ages
        return math.inf
    # Of (sqrt - v) / a and 2 d / (v + sqrt), which are equal, the one that does not subtract like from like.
    return 2 * _divided(d, v + math.sqrt(square)) if closes else _divided(math.sqrt(square) - v, a)


def _divided(x: float, y: float) -> float:
    """Divide as floats do: Python's would raise for 0 and for what is too large."""
    with np.errstate(all="ignore"):
        return float(np.float64(x) / np.float64(y))


def _status(d: float, v: float, a: float = 0.0) -> Status:
    if math.isnan(d) or not (math.isfinite(v) and math.isfinite(a)):
        return Status.INVALID
    if d <= 0:
        return Status.CONTACT
    if d == math.inf:
        return Status.CLEAR
    return Status.CLOSING if _first_root(d, v, a) < math.inf else Status.NOT_CLOSING


def _each(
    formula: Callable[..., float],
    arguments: Mapping[str, tuple[Any, Callable[[str, Any], float]]],
    status_out: NDArray[np.uint8] | None = None,
) -> Any:
    """Apply ``formula`` to each element in float64, and round to the dtype of the arrays; a float if there are none."""
    values = {name: _checked(name, *argument) for name, argument in arguments.items()}
    arrays = {name: value for name, value in values.items() if isinstance(value, np.ndarray)}
    if not arrays:
        if status_out is not None:
            raise TypeError("status_out is for arrays; the arguments are numbers")
        return formula(*values.values())
    elements = np.broadcast(*values.values())
    out = np.empty(elements.shape, np.result_type(*arrays.values()))
    numbers = [tuple(map(float, element)) for element in elements]
    if status_out is not None:
        output("status_out", status_out, out, np.uint8)
        status_out[...] = np.array([_status(*element) for element in numbers], np.uint8).reshape(out.shape)
    with np.errstate(over="ignore", under="ignore"):
        out[...] = np.array([formula(*element) for element in numbers], np.float64).reshape(out.shape)
    return out


def _checked(argument: str, value: Any, check: Callable[[str, Any], float]) -> Any:
    """Return ``value`` as an array, or as a number that passes the check."""
    if np.ndim(value) > 0:
        return floats(argument, value)
    return check(argument, value)
