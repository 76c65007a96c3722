"""Which part of the path no beam looks at: where the outline goes, in strips, and the directions of the beams.

A beam looks at its own direction and one increment to either side. A strip of the edge that leads is seen if a beam
looks at the place where the strip will be in good time; see ``ttc_fast.ScanSweptPath.unseen``.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ttc_fast.reference.scan import ScanTTC
    from ttc_fast.reference.vehicle import Motion, Outline

    Doubles = NDArray[np.float64]
    Bools = NDArray[np.bool_]

STRIPS = 32
"""An edge is divided into this many strips."""

ROUNDING = 1e-9
"""A gap narrower than this is rounding, rad."""

LOOKS = (0.0, 1.0, 2.0)
"""It is enough to look so many lengths of the edge ahead, or farther where ``ahead`` is."""

FARTHEST = 1e6
"""No look is farther ahead than this, s."""

STRAIGHT = 1e-6
"""Below this angle, sine and cosine are replaced by their first terms, rad."""


class FieldOfView:
    """Where a scanner sits, and where it does not look."""

    def __init__(self, scan: ScanTTC) -> None:
        self._x, self._y = scan._mount.x, scan._mount.y
        usable = ~np.isnan(scan._offset)
        angles = np.sort(np.mod(scan._angles[usable] + scan._mount.yaw, 2.0 * math.pi))
        looks = abs(scan._angle_increment)
        start, end = angles + looks, np.append(angles[1:], angles[:1] + 2.0 * math.pi) - looks
        if not usable.any():
            start, end = np.array([0.0]), np.array([2.0 * math.pi])
        gaps = end - start > ROUNDING
        self._start, self._width = start[gaps], (end - start)[gaps]

    def unseen(self, outline: Outline, motion: Motion, ahead: float) -> Bools:
        """Return which strips of the leading edge are not seen, bool of shape (STRIPS,)."""
        edge, length, advancing = leading_edge(outline, motion)
        quarter = math.pi / 2.0 / abs(motion.yaw_rate) if motion.yaw_rate else math.inf
        farthest = min(quarter, FARTHEST)
        unseen = advancing
        for lengths in LOOKS if advancing.any() else ():
            time = lengths * (length / math.hypot(motion.speed, motion.lateral_speed)) if lengths else 0.0
            unseen = unseen & self._is_in_gap(*place(edge, motion, min(max(time, ahead), farthest)))
        return unseen

    def _is_in_gap(self, x: Doubles, y: Doubles) -> Bools:
        angle = np.arctan2(y - self._y, x - self._x)
        after = np.mod(angle[:, None] - self._start, 2.0 * math.pi)
        return np.asarray(((after > 0.0) & (after < self._width)).any(axis=1))


def leading_edge(outline: Outline, motion: Motion) -> tuple[Doubles, float, Bools]:
    """Return the middles of the strips of the edge that leads, its length, and which strips move outwards."""
    vx, vy, omega = motion.speed, motion.lateral_speed, motion.yaw_rate
    share = (np.arange(STRIPS) + 0.5) / STRIPS
    x = outline.x_rear + share * (outline.x_front - outline.x_rear)
    y = outline.y_right + share * (outline.y_left - outline.y_right)
    if vx == vy == 0.0:
        return np.stack([x, y]), 0.0, np.zeros(STRIPS, bool)
    if abs(vx) >= abs(vy):
        edge = np.stack([np.full(STRIPS, outline.x_front if vx > 0.0 else outline.x_rear), y])
        return edge, outline.y_left - outline.y_right, np.asarray((vx - omega * y) * np.sign(vx) > 0.0)
    edge = np.stack([x, np.full(STRIPS, outline.y_left if vy > 0.0 else outline.y_right)])
    return edge, outline.x_front - outline.x_rear, np.asarray((vy + omega * x) * np.sign(vy) > 0.0)


def place(edge: Doubles, motion: Motion, time: float) -> Doubles:
    """Return where points of the vehicle will be after a time, in the frame of the vehicle now."""
    vx, vy, omega = motion.speed, motion.lateral_speed, motion.yaw_rate
    angle = omega * time
    sin, cos, along, across = angle, 1.0, time, time * angle / 2.0
    if abs(angle) >= STRAIGHT:
        sin, cos = math.sin(angle), math.cos(angle)
        along, across = sin / omega, (1.0 - cos) / omega
    x, y = edge
    moved = vx * along - vy * across, vx * across + vy * along
    return np.stack([cos * x - sin * y + moved[0], sin * x + cos * y + moved[1]])


def longest_run(strips: Bools) -> int:
    """Return the length of the longest run of strips."""
    longest = run = 0
    for strip in strips:
        run = run + 1 if strip else 0
        longest = max(longest, run)
    return longest
