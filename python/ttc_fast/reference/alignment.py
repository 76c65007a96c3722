"""How a body moves, from all of its profile: every cell is a witness, and what most of them say holds.

A cell sees the body at distances ``x = h + p(t)``: what the body looks like there, and how the body moves, which is the
same for all cells. Both are estimated together from all the frames of a window. What does not move like the rest (a
stray point, an edge that is met now and missed then, another car) is weighed down, by Tukey's biweight.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from ttc_fast._core import Alignment
    from ttc_fast.reference.profile import Profile

    Doubles = NDArray[np.float64]
    Ints = NDArray[np.int64]

ROUNDS = 3
"""How often weights are found anew."""
BIWEIGHT = 4.7
"""Where Tukey's biweight ends, in standard deviations: 95 % efficient where all is normal."""
NORMAL = 1.4826
"""Standard deviation of normal numbers, from the median of their sizes."""
EDGE = 0.04
"""How many points the edge of a body is worth: it is 5 times as noisy as a point, as other points make it each time."""
KNOWN_NOISE = 8.0
"""How many residuals the range noise that was given is worth."""
ENOUGH = 3
"""Cells in common that make a median."""
REACH = 10
"""Levels between two cells of a column that show how the surface leans."""
STEEPEST = 2.0
"""A step between two levels that is steeper than this is an edge."""
ACCELERATION = 5.0
"""m/s^2, standard deviation of an acceleration where there is one: hard braking is 2 of them."""
ACCELERATES = 0.1
"""How often there is one."""
KNOWN_FIT = 2.0
"""How many frames the belief is worth that frames differ by no more than their points do."""
MISFIT = 2.0
"""Frames that differ by so many times what they scatter, as a ratio of variances, do not move by one acceleration."""
RUN = 4
"""Frames of a difference that shows how they scatter."""
MEDIAN_SQUARE = 0.4549
"""Median of the square of a normal number."""
SYSTEMATIC = 0.003
"""Share of a closing speed that it may be off by, because rings pass from cell to cell."""
FEWEST = 3
"""Frames that a window is not shortened below."""


@dataclass(frozen=True)
class Sighting:
    """A body in one frame."""

    stamp: float
    """s"""
    edge: float
    """The robust nearest distance, m."""
    profile: Profile


class Trend(NamedTuple):
    """How a body moves at the last of its sightings."""

    distance: float
    """Of its edge, m."""
    closing_speed: float
    """m/s"""
    variance: float
    """Of the closing speed, m^2/s^2."""


@dataclass(frozen=True)
class Witnesses:
    """What cells say, one entry for each cell of each frame, frame after frame. The last cell is the edge itself."""

    frame: Ints
    cell: Ints
    count: Doubles
    x: Doubles
    rise: Doubles
    """Height above the mean height of the cell, m."""
    level: Ints
    """Of each cell, not each entry; so are the next two. The edge has none: -1."""
    column: Ints
    height: Doubles
    """Mean height, m."""


def trend(sightings: Sequence[Sighting], settings: Alignment) -> Trend | None:
    """How the body moves; ``None`` where nothing tells."""
    seen = _witnesses(sightings)
    stamps = np.array([sighting.stamp for sighting in sightings])
    edges = np.array([sighting.edge for sighting in sightings])
    time = stamps - stamps[-1]
    weight, x, position, noise = _weigh(seen, len(sightings), settings.range_noise)
    total = np.maximum(np.bincount(seen.frame, weight, len(sightings)), 1e-12)
    scatter = _scatter(time, position, total, noise)
    for first in range(len(sightings)):
        fit = _fit(seen, time, weight * (seen.frame >= first), x, (noise, scatter), len(sightings) - first)
        if fit is None or fit.misfit <= MISFIT * scatter or len(sightings) - first <= FEWEST:
            break
    if fit is None:
        return None
    moved = fit.speed * time + fit.bend * time**2
    return Trend(float(np.median(edges - moved)), -fit.speed, fit.variance)


def _witnesses(sightings: Sequence[Sighting]) -> Witnesses:
    """Put side by side the cells that more than one frame has: others say nothing about motion."""
    profiles = [sighting.profile for sighting in sightings]
    places = np.concatenate([np.column_stack([profile.column, profile.level]) for profile in profiles])
    unique, cell, shown = np.unique(places, axis=0, return_inverse=True, return_counts=True)
    shared = shown > 1
    number = np.where(shared, np.cumsum(shared) - 1, -1)[cell.ravel()]
    kept = number >= 0
    cells = int(shared.sum())

    def all_of(name: str) -> NDArray[Any]:
        joined: NDArray[Any] = np.concatenate([getattr(profile, name) for profile in profiles])[kept]
        return joined

    cell, count, z = number[kept], all_of("count"), all_of("z")
    height = np.bincount(cell, count * z, cells) / np.bincount(cell, count, cells)
    # The edge is a witness too: where nothing else is, it says how the body moves.
    frames = len(sightings)
    edges = [sighting.edge for sighting in sightings]
    frame = np.repeat(np.arange(frames), [len(profile.count) for profile in profiles])[kept]
    frame = np.append(frame, np.arange(frames))
    order = np.argsort(frame, kind="stable")
    return Witnesses(
        frame=frame[order],
        cell=np.append(cell, np.full(frames, cells))[order],
        count=np.append(count, np.full(frames, EDGE))[order],
        x=np.append(all_of("x"), edges)[order],
        rise=np.append(z - height[cell], np.zeros(frames))[order],
        level=unique[shared][:, 1],
        column=unique[shared][:, 0],
        height=height,
    )


def _weigh(seen: Witnesses, frames: int, range_noise: float) -> tuple[Doubles, Doubles, Doubles, float]:
    """Weights of entries, their x with the lean taken out, the position of each frame, and the variance of a point."""
    cells = len(seen.level) + 1
    position, lean, weight = _start(seen, frames), np.zeros(cells), seen.count
    known = range_noise**2
    free = max(len(seen.x) - cells - frames + 1, 1)
    for _ in range(ROUNDS):
        total = np.maximum(np.bincount(seen.cell, weight, cells), 1e-12)
        surface = (
            np.bincount(seen.cell, weight * (seen.x - position[seen.frame] - lean[seen.cell] * seen.rise), cells)
            / total
        )
        lean = _lean(seen, surface, total)
        moved = seen.x - surface[seen.cell] - lean[seen.cell] * seen.rise
        position = np.bincount(seen.frame, weight * moved, frames) / np.maximum(
            np.bincount(seen.frame, weight, frames), 1e-12
        )
        residual = (moved - position[seen.frame]) ** 2 * seen.count
        found = NORMAL**2 * float(np.median(residual)) * len(residual) / free
        noise = (KNOWN_NOISE * known + free * found) / (KNOWN_NOISE + free)
        weight = seen.count * np.clip(1.0 - residual / (BIWEIGHT**2 * noise), 0.0, 1.0) ** 2
    return weight, seen.x - lean[seen.cell] * seen.rise, position, noise


def _start(seen: Witnesses, frames: int) -> Doubles:
    """Each frame where it agrees best with those before it: the median of what its cells say."""
    cells = len(seen.level) + 1
    sums, counts, position = np.zeros(cells), np.zeros(cells), np.zeros(frames)
    for frame in range(frames):
        entries = seen.frame == frame
        cell, count, x = seen.cell[entries], seen.count[entries], seen.x[entries]
        if frame:
            known = counts[cell] > 0
            body = known & (cell < cells - 1)
            known = body if body.sum() >= ENOUGH else known
            position[frame] = np.median(x[known] - sums[cell[known]] / counts[cell[known]])
        sums[cell] += count * (x - position[frame])
        counts[cell] += count
    return position


def _lean(seen: Witnesses, surface: Doubles, total: Doubles) -> Doubles:
    """How much further ahead the surface is for each metre upwards, by level; 0 at edges and for the edge of the body.

    Rings move over the body as it comes nearer: without this, they would be seen to move along a slanted window. By the
    limiter MC [van Leer 1977]: the mean of both sides, but no more than twice either, and 0 where they disagree.
    """
    flat = np.zeros(len(surface))
    if len(seen.level) < 2:
        return flat
    step, rise = np.diff(surface[:-1]), np.maximum(np.diff(seen.height), 0.01)
    apart = np.diff(seen.level)
    joined = (np.diff(seen.column) == 0) & (apart <= REACH) & (np.abs(step) <= STEEPEST * rise)
    weight = joined * np.minimum(total[:-2], total[1:-1])
    level = seen.level - seen.level.min()
    above, below = (
        np.bincount(at, weight * step, level.max() + 1)
        / np.maximum(np.bincount(at, weight * rise, level.max() + 1), 1e-12)
        for at in (level[:-1], level[1:])
    )
    least = np.minimum(np.abs(above + below) / 2, 2 * np.minimum(np.abs(above), np.abs(below)))
    flat[:-1] = np.where(above * below > 0, np.sign(above) * least, 0.0)[level]
    return flat


def _scatter(time: Doubles, position: Doubles, total: Doubles, noise: float) -> float:
    """By how much more frames scatter than their points do, as a ratio of variances; at least 1.

    A car that nods sees the body at other heights in each frame, and all cells are off together. Of four frames in a
    row, the part of the motion that no parabola has (their third difference) should be no more than their points make
    it. Where somebody begins to brake only the few differences across that moment are larger.
    """
    ratios = []
    for first in range(len(time) - RUN + 1):
        run = slice(first, first + RUN)
        if (total[run] <= 1e-9).any():
            continue
        apart = np.subtract.outer(time[run], time[run])
        np.fill_diagonal(apart, 1.0)
        with np.errstate(all="ignore"):
            product = apart.prod(axis=1)
            ratio = (position[run] / product).sum() ** 2 / (noise / (product**2 * total[run])).sum()
        if np.isfinite(ratio):
            ratios.append(ratio)
    if not ratios:
        return 1.0
    count, typical = len(ratios), float(np.median(ratios)) / MEDIAN_SQUARE
    return max((KNOWN_FIT + count * typical) / (KNOWN_FIT + count), 1.0)


class Fit(NamedTuple):
    """A motion ``speed t + bend t^2``, and what is not known about its speed."""

    speed: float
    bend: float
    variance: float
    misfit: float


def _fit(
    seen: Witnesses, time: Doubles, weight: Doubles, x: Doubles, noises: tuple[float, float], frames: int
) -> Fit | None:
    """Regress within cells: a line and a parabola, averaged by how likely they are.

    ``noises``: the variance of a point, and by how much more frames scatter.
    """
    noise, scatter = noises
    cells = len(seen.level) + 1
    total = np.maximum(np.bincount(seen.cell, weight, cells), 1e-12)

    def within(values: Doubles) -> Doubles:
        return values - (np.bincount(seen.cell, weight * values, cells) / total)[seen.cell]

    y, t, q = within(x), within(time[seen.frame]), within(time[seen.frame] ** 2)
    tt, tq, qq = float(weight @ (t * t)), float(weight @ (t * q)), float(weight @ (q * q))
    ty, qy = float(weight @ (t * y)), float(weight @ (q * y))
    if tt <= 1e-12:
        return None

    def misfit(residual: Doubles, free: int) -> float:
        """By how much more frames differ than their points do, as a ratio of variances."""
        sums = np.maximum(np.bincount(seen.frame, weight, len(time)), 1e-12)
        means = np.bincount(seen.frame, weight * residual, len(time)) / sums
        return float((KNOWN_FIT + (sums @ means**2) / noise) / (KNOWN_FIT + free))

    line = ty / tt
    # What is known of the bend once the line is taken out.
    known, told = max(qq - tq * tq / tt, 0.0) / noise, (qy - tq * ty / tt) / noise
    worse = 1.0
    if frames > 3 and known > 0.0:
        bend = told / known
        worse = misfit(y - (ty - tq * bend) / tt * t - bend * q, frames - 3)
    scale = max(worse, scatter)
    known, told = known / scale, told / scale
    # x bends by half the acceleration.
    expected = 4.0 / ACCELERATION**2
    sure = known + expected
    bend = told / sure
    parabola = (ty - tq * bend) / tt
    odds = ACCELERATES / (1.0 - ACCELERATES) * np.sqrt(expected / sure) * np.exp(min(told * told / sure / 2.0, 300.0))
    share = float(odds / (1.0 + odds))
    spread = scale * noise / tt
    variance = (
        spread
        + (SYSTEMATIC * line) ** 2
        + share * (tq / tt) ** 2 / sure
        + share * (1.0 - share) * (parabola - line) ** 2
    )
    return Fit((1.0 - share) * line + share * parabola, share * bend, variance, worse)
