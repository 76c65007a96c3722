"""The first step of a decision: check what came, and make a frame of it. Nothing here is remembered."""

from __future__ import annotations

from math import hypot
from typing import TYPE_CHECKING, Any

from ttc_fast._validate import finite, interval, not_nan, number
from ttc_fast.brake.frame import CLOCK_TOLERANCE, Frame
from ttc_fast.brake.frozen import should_have_changed
from ttc_fast.brake.settings import BETWEEN_BEAMS
from ttc_fast.brake.types import Estimate, Motion
from ttc_fast.status import Status

if TYPE_CHECKING:
    from ttc_fast.brake.settings import BrakeSettings
    from ttc_fast.brake.state import ControllerState, Newest
    from ttc_fast.brake.threats import ThreatAssessment

LIGHT = 299_792_458.0
"""No vehicle is faster than light, m/s, nor do its wheels turn it so fast, rad/s."""


def receive(
    state: ControllerState,
    settings: BrakeSettings,
    assessment: ThreatAssessment,
    now: float,
    ranges: Any,
    points: Any,
    stamp: Any,
    motion: Any,
    estimate: Any,
    commanded: Any,
    time_increment: Any,
    path: Any,
) -> tuple[Newest, Frame | None]:
    """Check the arguments of an update; return the newest odometry and estimate, and the frame if one came."""
    latest, motion_at, known, known_since = newest = state.newest
    if motion is not None:
        motion = checked_motion("motion", motion)
        at = motion[3]
        if at is None:
            at = now
        if motion_at <= at <= now + CLOCK_TOLERANCE:
            latest, motion_at = motion, at
            newest = latest, motion_at, known, known_since
    if commanded is not None:
        commanded = checked_commanded(commanded)
    between = settings.time_increment
    if time_increment is not None:
        ordinary = type(time_increment) is float and 0.0 <= time_increment <= 1.0  # which needs no call
        between = time_increment if ordinary else BETWEEN_BEAMS.check("time_increment", time_increment)
    if estimate is not None:
        estimate = checked_estimate(estimate)
        if not estimate.saw_nothing:
            if not estimate.repeats(known):
                known_since = estimate.stamp
            known = estimate
            newest = latest, motion_at, known, known_since
    is_cloud = points is not None
    if is_cloud or ranges is not None:
        if is_cloud and ranges is not None:
            raise ValueError("a frame must be ranges or points, not both: give each scan and each cloud an update")
        if type(stamp) is not float or stamp - stamp != 0.0:
            stamp = finite("stamp", stamp)
        estimate = known
        if estimate is not None:  # it is as old as the measurement that it rests on, or the first of what it repeats
            measured = estimate.stamp - estimate.age
            if should_have_changed(estimate, estimate.stamp - known_since):
                measured = min(measured, known_since)
            if estimate.stamp > now + CLOCK_TOLERANCE or now - measured > settings.sensor_timeout:
                estimate = None
    elif estimate is not None and assessment.only_estimates:
        stamp = estimate.stamp
    else:
        return newest, None
    if not -CLOCK_TOLERANCE <= now - motion_at <= settings.motion_timeout:
        latest = None
    if path is not None:
        path = assessment.checked_path(path, latest)
    frame = Frame()
    frame.now = now
    frame.stamp = stamp
    frame.readings = points if is_cloud else ranges
    frame.is_cloud = is_cloud
    frame.source = state.clouds if is_cloud else state.scans
    frame.estimate = estimate
    frame.motion = latest
    frame.commanded = commanded
    frame.time_increment = between
    frame.path = path
    frame.looks = ()
    return newest, frame


def checked_motion(argument: str, value: Any) -> Motion:
    """Return ``value`` as a Motion if its numbers are those of a vehicle."""
    try:
        motion = value if type(value) is Motion else Motion(*value)
    except TypeError:
        raise TypeError(f"{argument} must be a Motion, such as Motion(4.0), got {value!r}") from None
    speed, yaw_rate, lateral_speed, stamp = motion
    try:
        if hypot(speed, yaw_rate, lateral_speed) < LIGHT and (stamp is None or stamp - stamp == 0.0):
            return motion
    except (TypeError, OverflowError):
        pass  # the loop finds which of them is not a number
    for name, each in motion._asdict().items():
        if each is not None or name != "stamp":
            got = finite(f"{argument}.{name}", each)
            if name != "stamp" and abs(got) >= LIGHT:
                unit = "rad/s" if name == "yaw_rate" else "m/s"
                raise ValueError(f"{argument}.{name} must be below that of light, {LIGHT:g} {unit}, got {got:g}")
    return motion


def checked_commanded(value: Any) -> Motion:
    """Return the argument ``commanded``, a Motion or a speed, as a Motion."""
    if isinstance(value, Motion):
        return checked_motion("commanded", value)
    return checked_motion("commanded", Motion(finite("commanded", value)))


def checked_estimate(value: Any) -> Estimate:
    """Return ``value`` as an Estimate if its numbers make sense; NaN and None stand for what is not known."""
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
        not_nan("estimate.age", estimate.age, 0.0, "s"),
    )
