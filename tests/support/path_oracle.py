"""A simulation that knows no closed form: the vehicle is driven through the world in fine steps, and looked at.

``python -m tests.support.path_oracle 1000000`` holds ``SweptPath`` to it in a million random worlds,
each a point and a motion; the tests do so in fewer.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np

import ttc_fast
from tests.support.common import CAR

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Doubles = NDArray[np.float64]
    Outline = tuple[float, float, float, float]

NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)
CHUNK = 4096
"""The number of worlds at once: few enough to stay near the processor."""


@dataclass
class Worlds:
    """Worlds, one for each entry of the arrays: a point in the vehicle frame, and a motion."""

    x: Doubles
    y: Doubles
    speed: Doubles
    yaw_rate: Doubles
    lateral_speed: Doubles

    def __len__(self) -> int:
        return len(self.x)

    def take(self, chosen: Any) -> Worlds:
        return Worlds(*(getattr(self, field.name)[chosen] for field in fields(self)))

    def kernel(self, path: Any) -> Doubles:
        """Return the answer of a swept path to each point, in its own motion."""
        points = np.stack([self.x, self.y], axis=-1)[:, np.newaxis]
        ttc: Doubles = path.min(points, self.speed, self.yaw_rate, self.lateral_speed)
        return ttc

    def path(self, seconds: Doubles) -> NDArray[np.complex128]:
        """Return the way of the vehicle's origin in ``seconds``, which are few, m: by quadrature."""
        half = seconds / 2
        moments = half * (NODES[:, np.newaxis] + 1)
        way: NDArray[np.complex128] = half * (WEIGHTS @ np.exp(1j * self.yaw_rate * moments))
        return way * (self.speed + 1j * self.lateral_speed)

    def seen(self, position: Any, heading: Any) -> tuple[Doubles, Doubles]:
        """Return the point as the vehicle sees it after that way."""
        relative = (self.x + 1j * self.y - position) * np.conj(heading)
        return relative.real, relative.imag


def clearance(outline: Outline, x: Doubles, y: Doubles) -> Doubles:
    """Return the distance from a rectangle to points, m; negative inside."""
    x_rear, x_front, y_right, y_left = outline
    out_x, out_y = np.maximum(x_rear - x, x - x_front), np.maximum(y_right - y, y - y_left)
    outside = np.hypot(np.maximum(out_x, 0), np.maximum(out_y, 0))
    return np.where(np.maximum(out_x, out_y) > 0, outside, np.maximum(out_x, out_y))


def check(worlds: Worlds, outline: Outline, horizon: float, steps: int, rng: np.random.Generator) -> int:
    """Hold the kernel to the simulation and return the number of hits; AssertionError names a world that differs."""
    ttc = worlds.kernel(ttc_fast.SweptPath(outline, horizon=horizon))
    start = clearance(outline, worlds.x, worlds.y)
    touching = start <= 0
    _check_contacts(worlds.take(touching), outline, ttc[touching])
    outside, ttc = worlds.take(~touching), ttc[~touching]
    for at in range(0, len(outside), CHUNK):
        _check_entries(outside.take(slice(at, at + CHUNK)), outline, ttc[at : at + CHUNK], horizon, steps, rng)
    return int(np.count_nonzero(ttc < np.inf))


def _check_contacts(worlds: Worlds, outline: Outline, ttc: Doubles) -> None:
    """Hold points in contact: inf if the way out is the shorter, else 0; either where a little turn decides that."""
    moment = np.full(len(worlds), 1e-7)
    there = worlds.seen(worlds.path(moment), np.exp(1j * worlds.yaw_rate * moment))
    step = (there[0] - worlds.x) + 1j * (there[1] - worlds.y)
    told = np.abs(step) > 1e-4 * moment
    worlds, ttc_told, step = worlds.take(told), ttc[told], step[told] / np.abs(step[told])
    longer = np.array(
        [
            _until_out(worlds, outline, step * turn) - _until_out(worlds, outline, -step * turn)
            for turn in np.exp(1j * np.array([-1e-3, 0.0, 1e-3]))
        ]
    )
    size = outline[1] - outline[0] + outline[3] - outline[2]
    deeper, leaves = (longer > 1e-6 * size).all(axis=0), (longer < -1e-6 * size).all(axis=0)
    assert (ttc_told[deeper] == 0.0).all()
    assert np.isinf(ttc_told[leaves]).all()
    assert deeper.any()
    assert leaves.any()
    assert np.isin(ttc, (0.0, np.inf)).all()


def _until_out(worlds: Worlds, outline: Outline, direction: NDArray[np.complex128]) -> Doubles:
    """Return how far a point inside goes before it is outside, m: by bisection, as a rectangle has no dents."""
    inside, out = np.zeros(len(worlds)), np.full(len(worlds), 2 * (outline[1] - outline[0] + outline[3] - outline[2]))
    for _ in range(50):
        middle = (inside + out) / 2
        is_out = clearance(outline, worlds.x + middle * direction.real, worlds.y + middle * direction.imag) > 0
        inside, out = np.where(is_out, inside, middle), np.where(is_out, middle, out)
    return out


def _check_entries(
    worlds: Worlds, outline: Outline, ttc: Doubles, horizon: float, steps: int, rng: np.random.Generator
) -> None:
    """Hold points outside: on the outline at the time that the kernel gives, and never inside before."""
    step = np.full(len(worlds), horizon / steps)
    moment = step * rng.random(len(worlds))  # samples begin anywhere, so that no place is never looked at
    position, heading = worlds.path(moment), np.exp(1j * worlds.yaw_rate * moment)
    stride, turn = worlds.path(step), np.exp(1j * worlds.yaw_rate * step)
    tolerance = 1e-8
    last = [np.zeros(len(worlds)), np.zeros(len(worlds), complex), np.ones(len(worlds), complex)]
    for _ in range(steps):
        before = moment < np.minimum(ttc, horizon) - 1e-9
        inside = clearance(outline, *worlds.seen(position, heading)) < -tolerance
        missed = np.flatnonzero(before & inside)
        assert missed.size == 0, f"inside at {moment[missed[0]]}: {_say(worlds, ttc, missed[0])}"
        for kept, now in zip(last, (moment, position, heading), strict=True):
            np.copyto(kept, now, where=moment <= ttc)
        position = position + heading * stride
        heading = heading * turn
        moment = moment + step
    hit = ttc < np.inf
    worlds, ttc = worlds.take(hit), ttc[hit]
    moment, position, heading = (kept[hit] for kept in last)
    rest = ttc - moment
    position, heading = position + heading * worlds.path(rest), heading * np.exp(1j * worlds.yaw_rate * rest)
    off = np.abs(clearance(outline, *worlds.seen(position, heading)))
    wrong = np.flatnonzero(~(off <= tolerance))
    assert wrong.size == 0, f"{off[wrong[0]]} m away then: {_say(worlds, ttc, wrong[0])}"


def _say(worlds: Worlds, ttc: Doubles, index: int) -> str:
    values = ", ".join(f"{field.name}={float(getattr(worlds, field.name)[index])!r}" for field in fields(worlds))
    return f"{values}, ttc={ttc[index]!r}"


def random_worlds(rng: np.random.Generator, count: int, outline: Outline) -> Worlds:
    """Make points anywhere, on the lines of the edges, on corners and just beside; and motions of every kind."""
    x_rear, x_front, y_right, y_left = outline
    size = max(x_front - x_rear, y_left - y_right)
    x, y = rng.uniform(-8, 8, (2, count)) * rng.choice([0.1 * size, size, 1.0], count)
    on_x, on_y = rng.random((2, count)) < 0.2
    x[on_x] = rng.choice([x_rear, x_front], np.count_nonzero(on_x))
    y[on_y] = rng.choice([y_right, y_left], np.count_nonzero(on_y))
    beside = rng.random(count) < 0.1
    x[beside] += rng.choice([-1, 1], np.count_nonzero(beside)) * 10.0 ** rng.uniform(-15, -3, np.count_nonzero(beside))
    magnitudes = [
        np.zeros(count),
        10.0 ** rng.uniform(-16, 1, count),
        rng.uniform(0, 3, count),
        rng.uniform(0, 10, count),
    ]
    yaw_rate = rng.choice([-1, 1], count) * np.choose(rng.integers(0, 4, count), magnitudes)
    speed = rng.uniform(-10, 10, count) * rng.choice([0.0, 0.01, 1.0, 1.0, 1.0], count)
    lateral_speed = rng.uniform(-2, 2, count) * rng.choice([0.0, 0.0, 1.0], count)
    worlds = Worlds(x, y, speed, yaw_rate, lateral_speed)
    aimed = rng.random(count) < 0.5
    _aim(rng, worlds, aimed, outline)
    return worlds


def _aim(rng: np.random.Generator, worlds: Worlds, aimed: NDArray[np.bool_], outline: Outline) -> None:
    """Move points to where, some time later, they will be on an edge or on a corner, nearly: many only graze it."""
    x_rear, x_front, y_right, y_left = outline
    count = np.count_nonzero(aimed)
    x, y = rng.uniform(x_rear, x_front, count), rng.uniform(y_right, y_left, count)
    at_end, at_side = rng.random((2, count)) < 0.6
    x = np.where(at_end | ~at_side, rng.choice([x_rear, x_front], count), x)
    y = np.where(at_side, rng.choice([y_right, y_left], count), y)
    moment = rng.uniform(0, 5, count)
    half = worlds.yaw_rate[aimed] * moment / 2
    velocity = worlds.speed[aimed] + 1j * worlds.lateral_speed[aimed]
    there = moment * np.sinc(half / np.pi) * np.exp(1j * half) * velocity + (x + 1j * y) * np.exp(2j * half)
    worlds.x[aimed], worlds.y[aimed] = there.real, there.imag


OUTLINES: list[Outline] = [
    CAR,
    (-1.0, 3.7, -0.9, 0.9),
    (0.5, 0.6, -2.0, -1.5),
    (-0.001, 0.001, -0.001, 0.001),
    (-2.0, -1.0, 0.25, 3.0),
]


def main(count: int) -> None:
    """A million worlds take about a minute."""
    rng, began, hits = np.random.default_rng(count), time.perf_counter(), 0
    for outline in OUTLINES:
        worlds = random_worlds(rng, count // len(OUTLINES), outline)
        hits += check(worlds, outline, 5.0, 400, rng)
    print(f"{count} worlds, {hits} of them with an entry: no difference; {time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000)
