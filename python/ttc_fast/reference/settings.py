"""The settings of a scanner, checked."""

from __future__ import annotations

import math
import operator
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast._core import KthSmallest, NeighbourSupport
from ttc_fast.reference.arguments import finite, non_negative, number
from ttc_fast.reference.geometry import Mount, Outline, beam_angles
from ttc_fast.reference.readings import Rules

if TYPE_CHECKING:
    from numpy.typing import NDArray

WIDEST_VIEW = 4 * math.pi
"""A sensor whose beams span more than this is more likely described in degrees, rad."""

FARTHEST = 1e30
"""No scanner's range begins farther away than this, m."""


def checked_angles(angle_min: Any, angle_increment: Any, beams: Any) -> NDArray[np.float64]:
    """Give the direction of each beam in the sensor frame, rad."""
    angle_min, angle_increment = finite("angle_min", angle_min), finite("angle_increment", angle_increment)
    beams = operator.index(beams)
    if beams < 1:
        raise ValueError(f"beams must be at least 1, got {beams}")
    if angle_increment == 0 and beams > 1:
        raise ValueError("angle_increment must not be 0 with more than one beam")
    if abs(angle_increment) * (beams - 1) > WIDEST_VIEW:
        raise ValueError(f"angle_increment {angle_increment} is too large for {beams} beams; angles are in radians")
    return beam_angles(angle_min, angle_increment, beams)


def checked_rules(range_min: Any, range_max: Any, limits: Any, limits_policy: Any, too_close: Any) -> Rules:
    """Say what readings mean."""
    range_min, range_max = non_negative("range_min", range_min), number("range_max", range_max)
    if range_min > FARTHEST:
        raise ValueError(f"range_min must be below {FARTHEST} m, got {range_min}")
    if not range_max > range_min:
        raise ValueError(f"range_max must be above range_min = {range_min}, got {range_max}")
    near, far = (0.0, math.inf) if limits is None else (number("limits", limit) for limit in limits)
    if not 0 <= near < far:
        raise ValueError(f"limits must be (near, far) with 0 <= near < far, got {limits}")
    if far <= range_min:
        raise ValueError(f"limits end at {far}, not beyond range_min = {range_min}: no reading could ever count")
    if limits_policy not in ("horizon", "clamp"):
        raise ValueError(f"limits_policy must be 'horizon' or 'clamp', got {limits_policy!r}")
    if too_close not in ("hit", "ignore"):
        raise ValueError(f"too_close must be 'hit' or 'ignore', got {too_close!r}")
    return Rules(range_min, range_max, near, far, clamps=limits_policy == "clamp", too_close_is_hit=too_close == "hit")


def checked_mount(mount: Any) -> Mount:
    """Say where the sensor sits."""
    return Mount(*(finite("mount", value) for value in mount))


def checked_outline(outline: Any) -> Outline:
    """Give the shape of the vehicle."""
    result = Outline(*(finite("outline", edge) for edge in outline))
    if not (result.x_rear < result.x_front and result.y_right < result.y_left):
        raise ValueError(f"outline must have x_rear < x_front and y_right < y_left, got {result}")
    return result


def checked_mask(mask: Any, beams: int) -> NDArray[np.bool_]:
    """Say which beams to ignore."""
    values = list(mask)
    if not all(isinstance(value, bool | np.bool_) for value in values):
        raise TypeError("mask must be a sequence of bools, True where a beam is to be ignored")
    if len(values) != beams:
        raise ValueError(f"mask must have one entry for each of the {beams} beams, got {len(values)}")
    return np.array(values, np.bool_)


def checked_no_data(no_data: Any) -> float | None:
    """Say what ``min`` gives for a blind scan."""
    if no_data is None:
        return None
    seconds = number("no_data", no_data)
    if not seconds >= 0:
        raise ValueError(f"no_data must be a time in [0, inf], in seconds, got {seconds}")
    return seconds


def checked_minimum(minimum: Any) -> KthSmallest | NeighbourSupport | None:
    """Say how a speckle is outvoted."""
    if minimum is not None and not isinstance(minimum, KthSmallest | NeighbourSupport):
        raise TypeError(f"minimum must be KthSmallest(k) or NeighbourSupport(...), got {minimum!r}")
    return minimum
