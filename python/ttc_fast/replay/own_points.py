"""Which points may be the vehicle itself: places close to the lidar that hold points in nearly all of the first clouds.

They tell something only while the rest of the world moves: of the places farther away, few may stay. The road is left
out, as its rings stay too. What is found is named, and nothing is done about it: a car that drives ahead at the same
speed stays in its place as a bonnet does, and clouds alone do not tell them apart. So the user decides, by an option.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast._settings import option

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ttc_fast._core import Gate

FRAMES, LEAST_FRAMES = 20, 8
"""How many of the first clouds are looked at, and the fewest that tell anything."""
STAYS = 0.9
"""The share of the clouds in which a place that stays holds points."""
NEAR, CELL = np.array([3.0, 1.5, 2.0]), 0.1
"""The box around the lidar in which the vehicle may be, to each side, and the size of a place in it, m."""
FAR, FAR_CELL = 20.0, 0.5
"""How far the rest of the world is looked at, and the size of a place in it, m."""
GRID = (128, 128, 128)
"""How many places there are along x, y and z; the lidar is in the middle."""
MOVES, LEAST_PLACES = 0.3, 20
"""The world moves where at most this share of its places stays, of at least this many in a cloud."""
ABOVE_ROAD = 0.2
"""What is lower above the road, m, may be the road."""


class OwnPoints:
    """Takes the first clouds of a log, and says which points may be the vehicle itself.

    Parameters
    ----------
    sensor_height : float
        Height of the lidar above the road, m.

    Examples
    --------
    >>> import numpy as np
    >>> from ttc_fast.replay.own_points import OwnPoints
    >>> rng, bonnet, own = np.random.default_rng(1), np.array([[1.5, 0.0, -0.5], [1.7, 0.2, -0.5]]), OwnPoints(1.6)
    >>> for _ in range(20):
    ...     own.add(np.vstack([bonnet, rng.uniform([5, -9, -1], [19, 9, 1], (200, 3))]))
    >>> own.box().round(1).tolist()
    [[1.5, 0.0, -0.5], [1.8, 0.3, -0.4]]
    """

    def __init__(self, sensor_height: float) -> None:
        self._lowest = ABOVE_ROAD - sensor_height
        self.frames, self._far_places = 0, 0
        self._near: dict[int, int] = {}
        self._far: dict[int, int] = {}

    def add(self, points: NDArray[Any]) -> None:
        """Take a cloud: x forward, y left and z up from the lidar, m, shape (N, 3) or wider."""
        if self.frames >= FRAMES:
            return
        self.frames += 1
        xyz = np.asarray(points[:, :3], np.float64)
        xyz = xyz[(xyz[:, 2] > self._lowest) & (np.abs(xyz) < FAR).all(axis=1) & xyz.any(axis=1)]
        near = (np.abs(xyz) < NEAR).all(axis=1)
        _count(self._near, xyz[near], CELL)
        self._far_places += _count(self._far, xyz[~near], FAR_CELL)

    def box(self) -> NDArray[np.float64] | None:
        """Return the lower and the upper corner of what stays, m; None where nothing does, or it tells nothing."""
        if self.frames < LEAST_FRAMES or self._far_places < LEAST_PLACES * self.frames:
            return None
        enough = STAYS * self.frames
        staying = sum(count >= enough for count in self._far.values())
        if staying * self.frames > MOVES * self._far_places:
            return None
        keys = [key for key, count in self._near.items() if count >= enough]
        if not keys:
            return None
        places = np.array(np.unravel_index(keys, GRID)) - GRID[0] // 2
        return np.array([places.min(axis=1), places.max(axis=1) + 1]) * CELL

    def text(self, gate: Gate) -> str:
        """Return what was found, for people; empty where nothing was."""
        box = self.box()
        if box is None:
            return ""
        where = ", ".join(f"{name} {low:.1f} to {high:.1f} m" for name, low, high in zip("xyz", *box, strict=True))
        seen = f"points stay at {where} of the lidar in the first {self.frames} clouds, while the rest moves"
        bounds = (gate.x, gate.y, gate.z or (-np.inf, np.inf))
        if all(low < upper and high > lower for (low, high), lower, upper in zip(bounds, *box, strict=True)):
            how = f"if they are its own bonnet or roof, {option('gate_x')} from {box[1, 0]:.1f} m on leaves them out"
            return f"{seen}; {how}. They may be a car that drives along, and count"
        return f"{seen}: bonnet, roof or what drives along; the gate leaves them out"


def _count(places: dict[int, int], xyz: NDArray[np.float64], size: float) -> int:
    """Count a cloud for each place that holds a point; return how many those are."""
    cells = np.floor(xyz / size).astype(np.int64) + GRID[0] // 2
    found = np.unique(np.ravel_multi_index(tuple(cells.T), GRID)).tolist()
    for key in found:
        places[key] = places.get(key, 0) + 1
    return len(found)
