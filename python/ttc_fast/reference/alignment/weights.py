"""Which cells of which frames to believe.

A cell sees the body at ``x = h + p(t)``: the surface ``h`` of the body at this cell, and the position ``p`` of the
body. Both are estimated in turns with the weights of the observations. What does not move like the rest (a stray point,
an edge that is met in one frame and missed in the next, another car) loses its weight, by Tukey's biweight.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from ttc_fast.reference.alignment.profile import Sighting

    Doubles = NDArray[np.float64]
    Ints = NDArray[np.int64]

EDGE = 0.04
"""The weight of the edge of a body, in points: it is 5 times as noisy as a point, as other points make it each time."""
ROUNDS = 3
"""The rounds in which weights are computed again."""
BIWEIGHT = 4.7
"""The end of Tukey's biweight in standard deviations; it is 95 % efficient where all is normal."""
NORMAL = 1.4826
"""Standard deviation of normal numbers over the median of their absolute values."""
KNOWN_NOISE = 8.0
"""The prior weight of the given range noise, in residuals."""
ENOUGH = 3
"""The fewest cells in common that make a median."""
FAR = 5.0
"""Cells that are farther than this from the median of their frame contradict it, in range noises."""
MOST_FAR = 0.25
"""A frame contradicts itself where a larger share of its cells is far from the median."""
REACH = 10
"""The most levels between two cells of a column that show the slope of the surface."""
STEEPEST = 2.0
"""A step between two levels that is steeper than this is an edge."""


@dataclass(frozen=True)
class CellObservations:
    """What the cells of all frames show side by side: one entry for each cell of each frame, frame after frame.

    The last cell is the edge of the body.
    """

    frame: Ints
    """Frame of each entry."""
    cell: Ints
    """Cell of each entry."""
    count: Doubles
    """The number of points behind each entry."""
    x: Doubles
    """Mean distance ahead of each entry, m."""
    rise: Doubles
    """Height of each entry above the mean height of its cell, m."""
    level: Ints
    """Level of each cell but the edge."""
    column: Ints
    """Column of each cell but the edge."""
    height: Doubles
    """Mean height of each cell but the edge, m."""


def observe(sightings: Sequence[Sighting]) -> CellObservations:
    """Put side by side the cells that more than one frame shows; others say nothing about motion."""
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
    # The edge is an observation too: where there is no other, it says how the body moves.
    frames = len(sightings)
    edges = [sighting.edge for sighting in sightings]
    frame = np.repeat(np.arange(frames), [len(profile.count) for profile in profiles])[kept]
    frame = np.append(frame, np.arange(frames))
    order = np.argsort(frame, kind="stable")
    return CellObservations(
        frame=frame[order],
        cell=np.append(cell, np.full(frames, cells))[order],
        count=np.append(count, np.full(frames, EDGE))[order],
        x=np.append(all_of("x"), edges)[order],
        rise=np.append(z - height[cell], np.zeros(frames))[order],
        level=unique[shared][:, 1],
        column=unique[shared][:, 0],
        height=height,
    )


class Weights(NamedTuple):
    """The weights of the observations, and what they imply."""

    weight: Doubles
    """The weight of each entry."""
    x: Doubles
    """The distance of each entry with the slope of the surface taken out, m."""
    noise: float
    """The variance of a point, m^2."""
    doubt: Doubles
    """The variance of each frame because its cells contradict each other, m^2; 0 where they agree."""


def irls_weights(observed: CellObservations, frames: int, range_noise: float) -> Weights:
    """Estimate surface, position of each frame and weights in turns: iteratively reweighted least squares."""
    cells = len(observed.level) + 1
    position, doubt = _first_positions(observed, frames, FAR * range_noise)
    slope, weight = np.zeros(cells), observed.count
    known = range_noise**2
    free = max(len(observed.x) - cells - frames + 1, 1)
    for _ in range(ROUNDS):
        total = np.maximum(np.bincount(observed.cell, weight, cells), 1e-12)
        level = observed.x - position[observed.frame] - slope[observed.cell] * observed.rise
        surface = np.bincount(observed.cell, weight * level, cells) / total
        slope = _slopes(observed, surface, total)
        moved = observed.x - surface[observed.cell] - slope[observed.cell] * observed.rise
        position = np.bincount(observed.frame, weight * moved, frames) / np.maximum(
            np.bincount(observed.frame, weight, frames), 1e-12
        )
        residual = (moved - position[observed.frame]) ** 2 * observed.count
        found = NORMAL**2 * float(np.median(residual)) * len(residual) / free
        noise = (KNOWN_NOISE * known + free * found) / (KNOWN_NOISE + free)
        weight = observed.count * np.clip(1.0 - residual / (BIWEIGHT**2 * noise), 0.0, 1.0) ** 2
    return Weights(weight, observed.x - slope[observed.cell] * observed.rise, noise, doubt)


def _first_positions(observed: CellObservations, frames: int, far: float) -> tuple[Doubles, Doubles]:
    """Put each frame where it agrees best with those before it, and say how far its cells contradict each other.

    That is the median of what its cells say. Where the few rings of a lidar meet other parts of the body in one frame,
    the cells may fall into two groups, each of which agrees in itself. Then no majority is to be believed: the frame is
    put where the edge of the body says, with a variance that holds both groups.
    """
    cells = len(observed.level) + 1
    sums, counts = np.zeros(cells), np.zeros(cells)
    position, doubt = np.zeros(frames), np.zeros(frames)
    for frame in range(frames):
        entries = observed.frame == frame
        cell, count, x = observed.cell[entries], observed.count[entries], observed.x[entries]
        if frame:
            known = counts[cell] > 0
            body = known & (cell < cells - 1)
            differences = x[known] - sums[cell[known]] / counts[cell[known]]
            if body.sum() < ENOUGH:
                position[frame] = np.median(differences)
            else:
                of_cells, of_edge = differences[:-1], differences[-1]
                position[frame] = np.median(of_cells)
                apart = np.abs(of_cells - position[frame])
                if (apart > far).sum() > MOST_FAR * len(apart):
                    position[frame], doubt[frame] = of_edge, np.median(apart[apart > far]) ** 2
        sums[cell] += count * (x - position[frame])
        counts[cell] += count
    return position, doubt


def _slopes(observed: CellObservations, surface: Doubles, total: Doubles) -> Doubles:
    """Find the slope of the surface at each cell: how much farther ahead it is for each metre upwards.

    It is 0 at edges of the surface and for the edge of the body. Rings move over the body as it comes nearer, and along
    a slanted window they would seem to be motion. All columns together decide the slope of a level, by the limiter MC
    [van Leer 1977]: the mean of both sides, but no more than twice either, and 0 where their signs differ.
    """
    slopes = np.zeros(len(surface))
    if len(observed.level) < 2:
        return slopes
    step, rise = np.diff(surface[:-1]), np.maximum(np.diff(observed.height), 0.01)
    apart = np.diff(observed.level)
    joined = (np.diff(observed.column) == 0) & (apart <= REACH) & (np.abs(step) <= STEEPEST * rise)
    weight = joined * np.minimum(total[:-2], total[1:-1])
    level = observed.level - observed.level.min()
    above, below = (
        np.bincount(at, weight * step, level.max() + 1)
        / np.maximum(np.bincount(at, weight * rise, level.max() + 1), 1e-12)
        for at in (level[:-1], level[1:])
    )
    least = np.minimum(np.abs(above + below) / 2, 2 * np.minimum(np.abs(above), np.abs(below)))
    slopes[:-1] = np.where(above * below > 0, np.sign(above) * least, 0.0)[level]
    return slopes
