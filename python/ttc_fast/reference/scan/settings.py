"""The settings of a scanner, and how they are checked."""

from __future__ import annotations

import math
import operator
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast._core import KthSmallest, NeighbourSupport
from ttc_fast.reference.arguments import choice, finite, non_negative, number
from ttc_fast.reference.scan.readings import Rules

if TYPE_CHECKING:
    from numpy.typing import NDArray

WIDEST_VIEW = 4 * math.pi
"""A sensor whose beams span more than this is more likely described in degrees, rad."""

FARTHEST = 1e30
"""No scanner's range begins farther away than this, m."""


def checked_angles(angle_min: Any, angle_increment: Any, beams: Any) -> NDArray[np.float64]:
    """Return the direction of each beam in the sensor frame, rad."""
    angle_min, angle_increment = finite("angle_min", angle_min), finite("angle_increment", angle_increment)
    beams = operator.index(beams)
    if beams < 1:
        raise ValueError(f"beams must be at least 1, got {beams}")
    if angle_increment == 0 and beams > 1:
        raise ValueError("angle_increment must not be 0 with more than one beam")
    if abs(angle_increment) * (beams - 1) > WIDEST_VIEW:
        raise ValueError(f"angle_increment {angle_increment} is too large for {beams} beams; angles are in radians")
    angles: NDArray[np.float64] = angle_min + angle_increment * np.arange(beams, dtype=np.float64)
    return angles


def checked_rules(range_min: Any, range_max: Any, limits: Any, limits_policy: Any, too_close: Any) -> Rules:
    """Return the rules by which readings count."""
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
    clamps = choice("limits_policy", limits_policy, ("horizon", "clamp")) == "clamp"
    too_close_is_hit = choice("too_close", too_close, ("hit", "ignore")) == "hit"
    return Rules(range_min, range_max, near, far, clamps=clamps, too_close_is_hit=too_close_is_hit)


def checked_mask(mask: Any, beams: int) -> NDArray[np.bool_]:
    """Return which beams are ignored."""
    values = list(mask)
    if not all(isinstance(value, bool | np.bool_) for value in values):
        raise TypeError("mask must be a sequence of bools, True where a beam is to be ignored")
    if len(values) != beams:
        raise ValueError(f"mask must have one entry for each of the {beams} beams, got {len(values)}")
    return np.array(values, np.bool_)


def checked_beam_vote(minimum: Any) -> KthSmallest | NeighbourSupport | None:
    """Return which vote decides."""
    if minimum is not None and not isinstance(minimum, KthSmallest | NeighbourSupport):
        raise TypeError(f"minimum must be KthSmallest(k) or NeighbourSupport(...), got {minimum!r}")
    return minimum
