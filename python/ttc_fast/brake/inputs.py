"""What a controller is told at each update, checked with the reason when refused."""

from __future__ import annotations

import math
from typing import Any

from ttc_fast._validate import finite, interval, number
from ttc_fast.brake.sight import Estimate, Motion
from ttc_fast.status import Status


def checked_motion(argument: str, value: Any) -> Motion:
    """Return a motion, if it is one of finite numbers."""
    try:
        motion = value if type(value) is Motion else Motion(*value)
    except TypeError:
        raise TypeError(f"{argument} must be a Motion, such as Motion(4.0), got {value!r}") from None
    speed, yaw_rate, lateral_speed, stamp = motion
    try:
        if math.isfinite(speed + yaw_rate + lateral_speed + (0.0 if stamp is None else stamp)):
            return motion
    except TypeError:
        pass  # the loop says which of them
    for name, each in motion._asdict().items():
        if each is not None or name != "stamp":
            finite(f"{argument}.{name}", each)
    return motion


def commanded_motion(commanded: Any) -> Motion:
    """Return what is commanded as a motion."""
    if isinstance(commanded, Motion):
        return checked_motion("commanded", commanded)
    return Motion(finite("commanded", commanded))


def several(ranges: Any, points: Any) -> ValueError:
    """Say why more than one frame at a time is refused."""
    if points is not None:
        return ValueError("a frame must be ranges or points, not both: give each scan and each cloud an update")
    return ValueError(f"ranges must be one scan, of shape (beams,), got shape {tuple(ranges.shape)}")


def checked_estimate(value: Any) -> Estimate:
    """Return an estimate, if its numbers make sense; what is not known is NaN or None."""
    try:
        estimate = Estimate(*value)
    except TypeError:
        raise TypeError(f"estimate must be an Estimate, such as Estimate.of(tracked, stamp), got {value!r}") from None
    ttc = number("estimate.ttc", estimate.ttc)
    if not ttc >= 0.0:
        raise ValueError(f"estimate.ttc must be from 0 to inf, got {ttc:g}")
    if not (estimate.status is None or isinstance(estimate.status, Status)):
        raise TypeError(f"estimate.status must be None or a Status, such as Status.CLOSING, got {estimate.status!r}")
    return Estimate(
        finite("estimate.stamp", estimate.stamp),
        ttc,
        interval("estimate.ttc_interval", estimate.ttc_interval),
        number("estimate.distance", estimate.distance),
        number("estimate.closing_speed", estimate.closing_speed),
        interval("estimate.closing_speed_interval", estimate.closing_speed_interval),
        estimate.status,
    )
