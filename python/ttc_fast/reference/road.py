"""``fit_road``: the road as a plane, found in a point cloud."""

from __future__ import annotations

import itertools
import math
import operator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ttc_fast._core import Gate, Road
from ttc_fast.reference.arguments import finite, positive
from ttc_fast.reference.cloud.gate import candidates, height_above
from ttc_fast.reference.points import Cloud, cloud
from ttc_fast.status import RoadStatus

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Doubles = NDArray[np.float64]
    Interval = tuple[float, float]
    Plane = tuple[float, float, float]

LAYERS_PER_METRE = 5.0
"""Voxels are a metre long and wide, and there are this many in a metre of height."""

ONE_BELOW_IN = 10
"""One in this many points of a column may lie below the road, because reflections do."""

FLAT = 1000
"""The flatness of a column of which all points are in the ground or just above."""

SLOPE_STEP = 0.6
"""Two neighbouring slopes of the vote differ by this much in height across the whole region, m."""

REFINEMENT = (0.3, 0.2, 0.15, 0.0, 0.0, 0.0, 0.0, 0.0)
"""The tolerance of each step, m, unless that of the search is wider. The first is wide enough for the coarse plane."""

LEAST_WIDTH = 0.01
"""The least width of a strip that has a plane, m. Points on a narrower one lie on a line."""

MOST_VOXELS = 2**22
"""The most voxels of a region: more take more memory than a road is worth."""

STEEPEST = 1.0
"""The steepest road. A steeper plane is none, and takes long to look for."""


@dataclass(frozen=True)
class RoadFit:
    """The road of a cloud or the reason that there is none, and the patches that this rests on."""

    road: Road | None
    """The road; None unless found."""
    status: RoadStatus
    """Whether a road was found."""
    reason: str
    """The reason that there is none; empty when found."""
    inliers: int = 0
    """The points near the plane, in patches that agree."""
    patches: int = 0
    """The patches that agree, of a square metre each."""
    share: float = 0.0
    """The share of all patches that agree."""
    width: float = 0.0
    """Width of the road that is seen in its narrowest direction, m."""
    rms: float = math.nan
    """Root mean square of the heights of patches above the plane, m."""


def fit_road(
    points: Any,
    *,
    sensor_height: float = 1.73,
    x: Interval = (0.0, 30.0),
    y: Interval = (-6.0, 6.0),
    axes: tuple[str, str, str] = ("x", "y", "z"),
    height_tolerance: float = 0.5,
    max_slope: float = 0.2,
    tolerance: float = 0.1,
    min_patches: int = 25,
    min_width: float = 2.0,
    min_share: float = 0.25,
) -> RoadFit:
    """Find the road in a cloud, as a plane that a ``Gate`` can stand on.

    Arguments, result and errors are those of ``ttc_fast.fit_road``.

    Examples
    --------
    >>> import numpy as np
    >>> from ttc_fast import reference
    >>> x, y = np.meshgrid(np.arange(4.0, 30.0, 0.5), np.arange(-6.0, 6.0, 0.5))
    >>> fit = reference.fit_road(np.stack([x, y, 0.02 * x - 1.7], axis=-1))
    >>> fit.status.name, round(fit.road.slope_x, 4), round(fit.road.offset, 4)
    ('FOUND', 0.02, -1.7)
    """
    region = Region(finite("sensor_height", sensor_height), x, y, axes, height_tolerance, max_slope).checked()
    positive("tolerance", tolerance)
    if not LEAST_WIDTH <= min_width < math.inf:
        raise ValueError(f"min_width must be finite and at least {LEAST_WIDTH}, got {min_width}")
    if operator.index(min_patches) < 1:
        raise ValueError(f"min_patches must be at least 1, got {min_patches}")
    if not 0 <= min_share <= 1:
        raise ValueError(f"min_share must be in [0, 1], got {min_share}")

    seen = cloud("points", points)
    if not seen.valid().any():
        return RoadFit(None, RoadStatus.NO_DATA, "no valid point")
    columns = VoxelColumns.of(seen, region)
    if len(columns.points) == 0:
        return RoadFit(None, RoadStatus.NOT_FOUND, "no point where a road could be")

    refined = refine(columns, hough_vote(columns, region), tolerance, min_width)
    slope_x, slope_y, offset = refined.plane
    share = refined.patches / len(columns.points)
    if refined.patches < min_patches:
        reason = "fewer than min_patches of it are seen"
    elif refined.width < min_width:
        reason = "what is seen of it is narrower than min_width"
    elif max(abs(slope_x), abs(slope_y)) > max_slope:
        reason = "steeper than max_slope"
    elif offset >= 0 or abs(offset + sensor_height) > height_tolerance:
        reason = "above the sensor, or farther than height_tolerance from sensor_height"
    elif share < min_share:
        reason = "less than min_share of the patches agree"
    else:
        reason = ""
    road = Road(slope_x, slope_y, offset) if reason == "" else None
    status = RoadStatus.NOT_FOUND if road is None else RoadStatus.FOUND
    return RoadFit(road, status, reason, refined.inliers, refined.patches, share, refined.width, refined.rms)


class Region(NamedTuple):
    """The region that a road could be in."""

    sensor_height: float
    x: Interval
    y: Interval
    axes: tuple[str, str, str]
    height_tolerance: float
    max_slope: float

    def checked(self) -> Region:
        """Return the region if it makes sense."""
        Gate(x=self.x, y=self.y, axes=self.axes)
        for name, bounds in (("x", self.x), ("y", self.y)):
            for bound in bounds:
                finite(name, bound)
        positive("height_tolerance", self.height_tolerance)
        positive("max_slope", self.max_slope)
        if self.max_slope > STEEPEST:
            raise ValueError(f"max_slope must be at most {STEEPEST}, got {self.max_slope}; it is rise per metre")
        if math.prod(self.shape()) > MOST_VOXELS:
            raise ValueError("x, y span too large a region for max_slope and height_tolerance: narrow one")
        return self

    def reach(self, x: Any, y: Any) -> Any:
        """Find the farthest that the road could be from minus the height of the sensor at a place, m."""
        return self.height_tolerance + self.max_slope * (abs(x) + abs(y))

    def farthest(self) -> float:
        """Find the farthest that it could be from there in the whole region, m."""
        return float(self.reach(max(map(abs, self.x)), max(map(abs, self.y))))

    def shape(self) -> tuple[int, int, int]:
        """Count voxels forward, to the left and up."""
        rows, columns = (max(math.ceil(high - low), 1) for low, high in (self.x, self.y))
        return rows, columns, math.ceil(2 * self.farthest() * LAYERS_PER_METRE)


@dataclass(frozen=True)
class VoxelColumns:
    """The ground in square metres, and the voxels above each, from the lowest up.

    Square metres without a point are left out. Every other counts as one patch: fitted to points, the road would be the
    road in front of the bumper, where most of them are.
    """

    points: Doubles
    """The number of points of each voxel, of shape (square metres, layers)."""
    sum: Doubles
    """The sum of each of their coordinates, m, of shape (square metres, layers, 3)."""
    ground: NDArray[np.intp]
    """The layer of the ground of each square metre: the lowest with no more than a tenth of the points below it."""

    @classmethod
    def of(cls, cloud: Cloud, region: Region) -> VoxelColumns:
        """Sort the points that could be road into voxels."""
        bottom, top = -region.sensor_height - region.farthest(), -region.sensor_height + region.farthest()
        found = candidates(cloud, Gate(x=region.x, y=region.y, z=(bottom, top), axes=region.axes))
        position = found.position[np.argsort(found.index)]
        x, y, z = position.T
        position = position[np.abs(z + region.sensor_height) <= region.reach(x, y)]

        shape = region.shape()
        corner, scale = np.array([region.x[0], region.y[0], bottom]), np.array([1.0, 1.0, LAYERS_PER_METRE])
        cells = np.clip(((position - corner) * scale).astype(np.intp), 0, np.array(shape) - 1)
        voxel = np.ravel_multi_index(tuple(cells.T), shape)
        size = math.prod(shape)
        points = np.bincount(voxel, minlength=size).astype(np.float64).reshape(-1, shape[2])
        sums = [np.bincount(voxel, each, minlength=size).astype(np.float64) for each in position.T]
        some = points.any(axis=1)
        points, total = points[some], np.stack(sums, axis=-1).reshape(-1, shape[2], 3)[some]
        enough = np.cumsum(points, axis=1) * ONE_BELOW_IN >= points.sum(axis=1, keepdims=True)
        return cls(points, total, enough.argmax(axis=1))

    def flatness(self) -> Doubles:
        """Find the share of the points of each column in its ground or just above, in whole thousandths.

        That is all of them over a road, and few where there is a wall or a bush. Sums of whole numbers are exact in any
        order, so equal votes are equal.
        """
        above = np.pad(self.points, ((0, 0), (0, 1)))  # nothing is above the top layer
        column = np.arange(len(self.ground))
        flat = above[column, self.ground] + above[column, self.ground + 1]
        flatness: Doubles = np.round(FLAT * (flat / self.points.sum(axis=1)))
        return flatness

    def mean(self) -> Doubles:
        """Find the mean position of the points of each voxel, m; NaN where there are none."""
        with np.errstate(invalid="ignore"):
            mean: Doubles = self.sum / self.points[..., None]
        return mean


def hough_vote(columns: VoxelColumns, region: Region) -> Plane:
    """Vote for a coarse plane on a grid of slopes and heights: a Hough transform.

    The ground of each column votes for the planes that it lies on, with as much weight as the column is flat. Of
    several planes with equal votes the flattest wins, then the lowest.
    """
    x, y, z = columns.mean()[np.arange(len(columns.ground)), columns.ground].T
    lowest = -region.sensor_height - region.height_tolerance
    flatness = columns.flatness()
    bins = max(math.ceil(2 * region.height_tolerance * LAYERS_PER_METRE), 2)
    best: tuple[float, Plane] = (0.0, (0.0, 0.0, -region.sensor_height))
    for slope_x in slopes(region.x, region.max_slope):
        for slope_y in slopes(region.y, region.max_slope):
            place = np.floor((z - slope_x * x - slope_y * y - lowest) * LAYERS_PER_METRE)
            possible = (place >= 0) & (place < bins)
            votes = np.bincount(place[possible].astype(np.intp), flatness[possible], minlength=bins)
            for lower, (first, second) in enumerate(itertools.pairwise(votes)):
                # Two bins together, or a road on the border between them would lose half its votes.
                if first + second > best[0]:
                    offset = lowest + (lower + 1) / LAYERS_PER_METRE
                    best = (first + second, (slope_x, slope_y, offset))
    return best[1]


def slopes(bounds: Interval, steepest: float) -> list[float]:
    """List the slopes of the grid up to the steepest, the flattest first."""
    steps = math.ceil(steepest * (bounds[1] - bounds[0]) / SLOPE_STEP)
    order = sorted(range(-steps, steps + 1), key=lambda step: (abs(step), step))
    return [step * steepest / max(steps, 1) for step in order]


class Refined(NamedTuple):
    """A fitted plane, and the patches that it rests on."""

    plane: Plane
    inliers: int
    patches: int
    width: float
    rms: float


def refine(columns: VoxelColumns, plane: Plane, tolerance: float, min_width: float) -> Refined:
    """Fit the plane again and again to the patches that agree with it, and stop when these are a mere line.

    This is iteratively reweighted least squares with Tukey's biweight [Beaton and Tukey 1974].
    """
    refined = Refined(plane, 0, 0, 0.0, math.nan)
    for step in REFINEMENT:
        wide = max(tolerance, step)
        near = distance(refined.plane, columns.mean(), wide) < 1
        near &= near[np.arange(len(near)), columns.ground, None]  # a patch agrees if its ground does
        agree = near.any(axis=1)
        points = np.where(near, columns.points, 0.0).sum(axis=1)[agree]
        patches = np.where(near[..., None], columns.sum, 0.0).sum(axis=1)[agree] / points[:, None]
        weights = (1 - distance(refined.plane, patches, wide) ** 2) ** 2

        refined = refined._replace(inliers=int(points.sum()), patches=len(patches), width=width(patches, weights))
        if refined.width < min_width:
            return refined
        root = np.sqrt(weights)
        unknowns = np.column_stack([patches[:, :2], np.ones(len(patches))])
        slope_x, slope_y, offset = np.linalg.lstsq(unknowns * root[:, None], patches[:, 2] * root, rcond=None)[0]
        plane = (float(slope_x), float(slope_y), float(offset))
        rms = math.sqrt(np.average(height_above(plane, *patches.T) ** 2, weights=weights))
        refined = refined._replace(plane=plane, rms=rms)
    return refined


def distance(plane: Plane, points: Doubles, tolerance: float) -> Doubles:
    """Find the distance of points from a plane, in tolerances; the tolerance below the plane is twice as large.

    Of two planes that a kerb parts, the lower is the road.
    """
    height = height_above(plane, *np.moveaxis(points, -1, 0))
    return np.where(height > 0, height / tolerance, -height / (2 * tolerance))


def width(patches: Doubles, weights: Doubles) -> float:
    """Find the width of an even strip that spreads as much as the patches in their narrowest direction, m."""
    if weights.sum() == 0:
        return 0.0
    offsets = patches[:, :2] - np.average(patches[:, :2], axis=0, weights=weights)
    covariance = (offsets * weights[:, None]).T @ offsets / weights.sum()
    return math.sqrt(12 * max(np.linalg.eigvalsh(covariance)[0], 0.0))
