"""Whether a sensor is frozen: it sends the same readings to the bit, under new stamps, while the vehicle drives.

Readings scatter, so two scans of a real sensor are never equal. Those of a simulator may be: it publishes faster than
it measures, the vehicle stands, an open field shows nothing, or a corridor looks the same all along. So readings that
are equal are no evidence by themselves. They are stale if all of this holds since they came first:

- The vehicle has driven ``DRIVEN``. That is more than a slow vehicle may drive while a simulator waits for its next
  measurement, and less than what is needed to stop at the speeds at which it matters.
- They are older than ``sensor_timeout``. A frozen sensor is as bad as a silent one, and not worse.
- They contradict themselves: a return, were it at rest, would by now have come nearer than what is measured in its
  direction. So what drives ahead at the very speed of the vehicle, without any scatter, is taken for frozen.

The last two readings that differ are held, so that a driver which has stopped between two buffers is found as well, if
there are many readings: a few coarse ones flicker between two values by themselves.

An estimate that is the only frame is frozen if its numbers have been the same for longer than ``sensor_timeout`` and
contradict themselves: its TTC is finite, and its target should have come nearer by ``STEP``.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy import ndarray

from ttc_fast.brake.state import Driven

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ttc_fast.brake.frame import Frame
    from ttc_fast.brake.settings import BrakeSettings
    from ttc_fast.brake.state import Held
    from ttc_fast.brake.threats import ThreatAssessment
    from ttc_fast.brake.types import Estimate, Motion

    Floats = NDArray[np.float64]

DRIVEN = 0.75
"""A vehicle that has driven so far sees something else, m."""
FARTHEST = 1e4
"""Points that are farther away than this are no returns, m."""
TOLERANCE = 2e-3
"""A return may be nearer by this than what is seen in its direction, m: readings are rounded."""
STEP = 0.25
"""An estimated target may come nearer by this before its distance changes, m: radars give it in steps of 0.2 m."""
MOST_BYTES = 1 << 15
"""Of larger readings a part is compared, every so many rows."""
MANY_BYTES = 256
"""Readings that take turns with others are compared from this size on: a few coarse ones are equal by chance."""
BETWEEN_POINTS = 0.15
"""Returns are compared with those this near in direction, rad, or one and a half beams."""


def hold(frame: Frame, assessment: ThreatAssessment, settings: BrakeSettings) -> Held:
    """Return what is held after a frame."""
    readings, before = frame.readings, frame.source.held
    is_small = type(readings) is ndarray and readings.nbytes < MOST_BYTES
    bits = readings.tobytes() if is_small else bits_of(readings)
    if bits != before[0] or not bits:
        before = frame.source.held_before
        if bits != before[0] or len(bits) < MANY_BYTES:
            return bits, frame.stamp, frame.motion, None, False
    bits, since, motion, driven, is_frozen = before
    stamp, way, x, y, yaw = driven or Driven(since)
    motion = slower(motion, frame.motion) if frame.stamp - stamp > settings.sensor_timeout else frame.motion
    if motion is not None and motion.over_ground > settings.standstill_speed:
        passed = frame.stamp - stamp
        cos, sin = math.cos(yaw) * passed, math.sin(yaw) * passed
        x += motion.speed * cos - motion.lateral_speed * sin
        y += motion.speed * sin + motion.lateral_speed * cos
        yaw, way = yaw + motion.yaw_rate * passed, way + motion.over_ground * passed
    if not is_frozen and way > DRIVEN and frame.stamp - since > settings.sensor_timeout:
        share = DRIVEN / way  # what holds all along holds after the first of it, where most returns are still seen
        is_frozen = contradict(
            *returns(frame, assessment), *moved(frame, assessment, x * share, y * share, yaw * share)
        )
    return bits, since, frame.motion, Driven(frame.stamp, way, x, y, yaw), is_frozen


def hold_estimate(frame: Frame, assessment: ThreatAssessment, settings: BrakeSettings) -> Held:
    """Return what is held after an estimate that is the only frame."""
    estimate, held = frame.estimate, frame.source.held
    if estimate is None or estimate.saw_nothing:
        return held
    bits, stamp = repr(estimate[1:]).encode(), estimate.stamp
    readings, since, *_ = held
    if bits != readings:
        return bits, stamp, None, None, False
    is_old = stamp - since > settings.sensor_timeout
    return readings, since, None, None, is_old and should_have_changed(estimate, stamp - since)


def should_have_changed(estimate: Estimate, seconds: float) -> bool:
    """Return whether an estimate cannot be the same after a time: its TTC runs down, and its target comes nearer."""
    return 0.0 < estimate.ttc < math.inf and not estimate.distance * seconds <= STEP * estimate.ttc


def slower(one: Motion | None, other: Motion | None) -> Motion | None:
    """Return the slower of the motions at both ends of a gap, in which a vehicle may have started or stopped."""
    if one is None or other is None:
        return None
    return one if one.over_ground < other.over_ground else other


def bits_of(readings: Any) -> bytes:
    """Return readings of any kind as bytes: those of a large cloud in part."""
    if isinstance(readings, tuple) and readings and isinstance(readings[0], np.ndarray):
        return b"".join(map(bits_of, readings))
    rows = np.asarray(readings)
    if rows.dtype.hasobject or not rows.ndim:
        return b""
    return rows[:: rows.nbytes // MOST_BYTES | 1].tobytes()  # an odd step meets every ring of 2^n


def returns(frame: Frame, assessment: ThreatAssessment) -> tuple[Floats, Floats, float]:
    """Return directions, distances, and how far apart in direction two are that look at the same thing, rad.

    Directions increase; the distance is inf where nothing was.
    """
    scan = assessment.scan
    if not frame.is_cloud and scan is not None:
        distance = np.array(frame.readings, np.float64)
        bearing = np.remainder(np.asarray(scan.angles, np.float64) + math.pi, 2.0 * math.pi) - math.pi
        seen = (distance >= scan.range_min) & ((distance <= scan.range_max) | (distance == math.inf))
        free = scan.range_max if scan.limits is None else min(scan.limits[1], scan.range_max)
        distance[distance >= free] = math.inf  # some drivers give the greatest range where nothing is
        if scan.mask is not None:
            seen &= ~np.asarray(scan.mask)
        between = max(1.5 * abs(scan.angles[-1] - scan.angles[0]) / max(scan.beams - 1, 1), BETWEEN_POINTS)
    else:
        points = frame.readings
        if not isinstance(points, tuple):
            points = np.asarray(points)
            points = (points["x"], points["y"]) if points.dtype.names else (points[..., 0], points[..., 1])
        x, y = (np.asarray(each, np.float64).ravel() for each in points[:2])
        step = len(x) * 8 // MOST_BYTES | 1
        distance, bearing = np.hypot(x[::step], y[::step]), np.arctan2(y[::step], x[::step])
        seen, between = (distance > 0.0) & (distance < FARTHEST), BETWEEN_POINTS
    bearing, distance = bearing[seen], distance[seen]
    order = np.argsort(bearing, kind="stable")
    return bearing[order], distance[order], between


def moved(frame: Frame, assessment: ThreatAssessment, x: float, y: float, yaw: float) -> tuple[float, float, float]:
    """Return where the sensor has got, seen from where it was, when the vehicle has moved so; m and rad."""
    scan = assessment.scan
    if frame.is_cloud or scan is None:
        return x, y, yaw
    x_mount, y_mount, yaw_mount = scan.mount
    x += (math.cos(yaw) - 1.0) * x_mount - math.sin(yaw) * y_mount
    y += (math.cos(yaw) - 1.0) * y_mount + math.sin(yaw) * x_mount
    cos, sin = math.cos(yaw_mount), math.sin(yaw_mount)
    return x * cos + y * sin, y * cos - x * sin, yaw


def contradict(bearing: Floats, distance: Floats, between: float, x: float, y: float, yaw: float) -> bool:
    """Return whether a return at rest would be in the way of what a sensor that has moved still sees."""
    near = np.isfinite(distance)
    if not near.any():
        return False
    ahead = distance[near] * np.cos(bearing[near]) - x
    aside = distance[near] * np.sin(bearing[near]) - y
    where = np.remainder(np.arctan2(aside, ahead) - yaw + math.pi, 2.0 * math.pi) - math.pi
    after = np.searchsorted(bearing, where)
    neighbours = [np.maximum(after - 1, 0), np.minimum(after, len(bearing) - 1)]
    apart = [np.abs(bearing[each] - where) for each in neighbours]
    # One beside the direction tells of a wall that both are on, even if it is a little too far away by itself.
    behind = np.minimum(
        *(np.where(off <= 2.0 * between, distance[each], math.inf) for each, off in zip(neighbours, apart, strict=True))
    )
    looks = np.minimum(*apart) <= between
    return bool((looks & (behind > np.hypot(ahead, aside) + TOLERANCE)).any())
