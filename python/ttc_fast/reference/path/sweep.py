"""When a static point first enters a moving rectangle, in closed form; and how far it is from it.

Let omega be the yaw rate and tau = 2 tan(omega t / 2) / omega, which is t itself when omega is 0. In the vehicle frame
a static point moves by dp/dt = -(v + omega x p), so that its coordinates are sums of 1, sin(omega t) and cos(omega t).
Times 1 + (omega tau / 2)^2 they are polynomials:

    x(t) - X  ->  (x - X) + (omega y - vx) tau - omega/2 (vy + omega/2 (x + X)) tau^2
    y(t) - Y  ->  (y - Y) - (omega x + vy) tau + omega/2 (vx - omega/2 (y + Y)) tau^2

The line of each edge is crossed at the roots of a quadratic, with nothing singular as omega goes to 0. Of its two roots
one goes in. It is the first entry if the other coordinate is between the ends of the edge then, and no other edge is
entered earlier. Roots are kept as tau = n / d, n >= 0, so that half a turn, where tau is infinite, is one of them.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ttc_fast.reference.vehicle import LIGHT_SPEED, Mount, sensor_velocity

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ttc_fast.reference.vehicle import Motion, Outline

    Doubles = NDArray[np.float64]
    Bools = NDArray[np.bool_]

SLOWEST = 1e-30
"""Slower than this, m/s or rad/s, is standing still."""

TOUCH = 1e-11
"""A point that passes the outline this close, as a share of how far points may come from, touches it."""


class Quadratic(NamedTuple):
    """``c + b tau + a tau^2`` of each point."""

    c: Doubles
    b: Doubles
    a: Doubles

    def mirrored(self) -> Quadratic:
        """See the same edge from its other side."""
        return Quadratic(0.0 - self.c, 0.0 - self.b, 0.0 - self.a)


def fastest(outline: Outline, vx: float, vy: float, omega: float) -> float:
    """Return the speed of the outline's fastest point, m/s.

    A point keeps its speed on its way, and the points of a rectangle that move fastest are corners.
    """
    corners = [(x, y) for x in (outline.x_rear, outline.x_front) for y in (outline.y_right, outline.y_left)]
    squares = [(vx - omega * y, vy + omega * x) for x, y in corners]
    return math.sqrt(max(sx * sx + sy * sy for sx, sy in squares))


class Sweep:
    """An outline in motion."""

    def __init__(self, outline: Outline, horizon: float, motion: Motion) -> None:
        sensor_velocity(motion, Mount(0.0, 0.0, 0.0))  # refuses what is faster than light
        vx, vy, omega = (
            0.0 if abs(value) < SLOWEST else value for value in (motion.speed, motion.lateral_speed, motion.yaw_rate)
        )
        if not (fastest(outline, vx, vy, omega) < LIGHT_SPEED and abs(omega) < LIGHT_SPEED):
            raise ValueError(f"yaw_rate turns the outline faster than light, at {omega} rad/s")
        self._set(outline, horizon, vx, vy, omega)

    @classmethod
    def unchecked(cls, outline: Outline, horizon: float, vx: float, vy: float, omega: float) -> Sweep:
        """Make the sweep of a motion that makes sense."""
        sweep = cls.__new__(cls)
        sweep._set(outline, horizon, vx, vy, omega)
        return sweep

    def _set(self, outline: Outline, horizon: float, vx: float, vy: float, omega: float) -> None:
        self._outline, self._horizon = outline, horizon
        self._vx, self._vy, self._omega = vx, vy, omega
        self._half = omega / 2.0
        # The way of a point is no longer than its speed allows, and no farther than across its circle.
        turn = horizon if omega == 0 else min(horizon, 2.0 / abs(omega))
        self._reach = max(abs(edge) for edge in outline) + fastest(outline, vx, vy, omega) * turn
        self._touch = TOUCH * self._reach

    def is_inside(self, x: Doubles, y: Doubles) -> Bools:
        """Whether each point lies in the outline, its edges included."""
        edge = self._outline
        inside: Bools = (edge.x_rear <= x) & (x <= edge.x_front) & (edge.y_right <= y) & (y <= edge.y_left)
        return inside

    def ttc(self, x: Doubles, y: Doubles, contact: Bools) -> Doubles:
        """Return the time until each point hits the vehicle, s.

        For a point outside, that is until it first enters; it is infinite where that is not within the horizon. A point
        in contact has time 0, unless it stands or is on its way out; then it is infinite.
        """
        _, closing_speed = self.approach(x, y)
        deeper = np.where(self.is_inside(x, y), self._deepens(x, y), closing_speed > 0)
        entry = self.entry(x, y)
        entry[~(entry <= self._horizon)] = np.inf
        return np.where(contact, np.where(deeper, 0.0, np.inf), entry)

    def _deepens(self, x: Doubles, y: Doubles) -> Bools:
        """Whether each point inside goes deeper.

        It moves along a chord of the outline. It goes deeper if the end that it comes from is no farther than the one
        that it goes to. One that stands does not.
        """
        depths, rates = self._edges(x, y)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            came = np.where(rates > 0, depths / rates, np.inf).min(axis=0)
            leaves = np.where(rates < 0, depths / (0.0 - rates), np.inf).min(axis=0)
        deepens: Bools = (came < np.inf) & (came <= leaves)
        return deepens

    def _edges(self, x: Doubles, y: Doubles) -> tuple[Doubles, Doubles]:
        """Return the distance from each point inside to each edge, m, and how fast it grows, m/s; shape (4, N)."""
        edge = self._outline
        vx, vy = self._velocity(x, y)
        depths = np.array([edge.x_front - x, x - edge.x_rear, edge.y_left - y, y - edge.y_right])
        return depths, np.array([0.0 - vx, vx, 0.0 - vy, vy])

    def approach(self, x: Doubles, y: Doubles) -> tuple[Doubles, Doubles]:
        """Return the clearance of each point, m, negative inside; and how fast it shrinks, m/s.

        Inside, the nearest edge decides; of edges equally near, the one that recedes fastest.
        """
        edge = self._outline
        vx, vy = self._velocity(x, y)
        with np.errstate(invalid="ignore", over="ignore"):
            depths, rates = self._edges(x, y)
            depth = depths.min(axis=0)
            inward = np.where(depths == depth, rates, -np.inf).max(axis=0)

            dx, dy = x - np.clip(x, edge.x_rear, edge.x_front), y - np.clip(y, edge.y_right, edge.y_left)
            longer = np.maximum(np.abs(dx), np.abs(dy))
            ux, uy = (np.divide(d, longer, out=np.full_like(d, np.nan), where=longer > 0) for d in (dx, dy))
            norm = np.sqrt(ux * ux + uy * uy)
            distance, towards = longer * norm, 0.0 - (ux * vx + uy * vy) / norm
        inside = self.is_inside(x, y)
        return np.where(inside, 0.0 - depth, distance), np.where(inside, inward, towards)

    def _velocity(self, x: Doubles, y: Doubles) -> tuple[Doubles, Doubles]:
        """Return the velocity of static points in the vehicle frame, m/s."""
        with np.errstate(over="ignore"):
            return self._omega * y - self._vx, 0.0 - (self._omega * x + self._vy)

    def entry(self, x: Doubles, y: Doubles) -> Doubles:
        """Return when each point outside first enters, s; infinite if it never does."""
        near = (np.abs(x) <= self._reach) & (np.abs(y) <= self._reach)
        x, y = np.where(near, x, np.nan), np.where(near, y, np.nan)
        bx, by = self._velocity(x, y)

        def to_x(edge: float) -> Quadratic:
            return Quadratic(x - edge, bx, 0.0 - self._half * (self._vy + self._half * (x + edge)))

        def to_y(edge: float) -> Quadratic:
            return Quadratic(y - edge, by, self._half * (self._vx - self._half * (y + edge)))

        edge = self._outline
        roots = [
            self._crossing(to_x(edge.x_front), to_y(0.0), edge.y_right, edge.y_left),
            self._crossing(to_x(edge.x_rear).mirrored(), to_y(0.0), edge.y_right, edge.y_left),
            self._crossing(to_y(edge.y_left), to_x(0.0), edge.x_rear, edge.x_front),
            self._crossing(to_y(edge.y_right).mirrored(), to_x(0.0), edge.x_rear, edge.x_front),
        ]
        first: Doubles = np.min([self._time(n, d) for n, d in roots], axis=0, initial=np.inf)
        return first

    def _crossing(self, distance: Quadratic, other: Quadratic, low: float, high: float) -> tuple[Doubles, Doubles]:
        """Return when each point goes in through an edge, as (n, d); NaN where it does not.

        ``distance`` from the line of the edge is positive outside and falls to 0 then; the ``other`` coordinate has to
        be between the ends of the edge.
        """
        c, b, a = distance
        misses = b * b - 4.0 * a * c < 0
        # A circle that misses the line may come as close as touches it.
        c = np.where(misses, c - self._touch, c)
        a = np.where(misses, a - self._half * self._half * self._touch, a)
        discriminant = b * b - 4.0 * a * c
        h = np.abs(b) + np.sqrt(np.maximum(discriminant, 0.0))
        earlier = (b < 0) | ((b == 0) & (a == 0))
        n, d = np.where(earlier, 2.0 * c, 0.0 - h), np.where(earlier, h, 2.0 * a)
        n, d = np.where(n < 0, 0.0 - n, n), np.where(n < 0, 0.0 - d, d)
        scale = d * d + (self._half * n) * (self._half * n)
        place = (other.c * d + other.b * n) * d + other.a * n * n
        on_edge = ((low - self._touch) * scale <= place) & (place <= (high + self._touch) * scale) & (scale > 0)
        enters = (discriminant >= 0) & on_edge
        return np.where(enters, n, np.nan), np.where(enters, d, np.nan)

    def _time(self, n: Doubles, d: Doubles) -> Doubles:
        """Return the time at each root, s; infinite where there is none.

        It is computed by ``math.atan2``, which is the C library's as in the kernels; NumPy's own may differ in the last
        bit.
        """
        time = np.full_like(n, np.inf)
        omega = abs(self._omega)
        if omega == 0:
            np.divide(n, d, out=time, where=d > 0)
        else:
            crossed = ~np.isnan(n)
            angles = [math.atan2(s, c) for s, c in zip(omega * n[crossed], 2.0 * d[crossed], strict=True)]
            time[crossed] = 2.0 * np.array(angles) / omega
        time[n == 0] = 0.0
        return time
