"""Clouds, gates and estimators for hypothesis: ordinary ones, and all that is known to break code like this."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import ttc_fast
from tests.support.cloud_layouts import IN_COLUMNS, LAYOUTS
from tests.support.strategies import dtypes, seeds

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

# Lanes are 16 points, records are read up to the last but one, and beyond 2048 points a sample is looked at first.
SIZES = (0, 1, 2, 15, 16, 17, 18, 31, 32, 33, 34, 127, 255, 2048, 2049, 2050, 4097, 6007)

INTENSITIES: list[Any] = [
    np.int8,
    np.uint8,
    np.int16,
    np.uint16,
    np.int32,
    np.uint32,
    np.float32,
    np.float64,
]

AXES = [
    (signs[0] + x, signs[1] + y, signs[2] + z)
    for x, y, z in itertools.permutations("xyz")
    for signs in itertools.product(["", "-"], repeat=3)
]


@dataclass
class CloudCase:
    """One cloud in some layout, and the settings to look at it with."""

    columns: Any
    layout: str
    gate: ttc_fast.Gate
    estimator: Any

    @property
    def points(self) -> Any:
        return LAYOUTS[self.layout](self.columns)

    @property
    def settings(self) -> dict[str, Any]:
        return {"gate": self.gate, "estimator": self.estimator}


forwards = st.sampled_from(
    [(0.0, math.inf), (2.0, 20.0), (0.1, 0.3), (-5.0, 5.0), (-math.inf, math.inf), (5.0, 5.0), (math.inf, math.inf)]
)
lefts = st.sampled_from([(-2.0, 2.0), (-2.0, 2.0), (-0.1, 0.1), (0.0, 0.0), (-math.inf, 0.7), (-math.inf, math.inf)])
ups = st.sampled_from([None, None, (-1.5, -0.9), (0.1, math.inf), (-1e300, 1e300)])
brightnesses = st.sampled_from([(0.1, 1.0), (0.0, 0.0), (-math.inf, math.inf), (10.0, 200.5), (0.3, 1e300)])
curvatures = st.sampled_from([0.0, 0.0, 0.0, -0.0, 0.05, -0.02, 1e-9, -0.5, 1e4, 1e-300])
roads = st.builds(ttc_fast.Road, *[st.sampled_from([0.0, 0.02, -0.1])] * 2, st.sampled_from([-1.73, 0.0]))
heights = st.sampled_from([(0.2, 2.0), (0.0, math.inf), (-math.inf, math.inf), (0.63, 0.83)])

gaps = st.sampled_from([0.0, 0.05, 0.1, 0.5, 1e300])
few = st.integers(1, 12)
estimators = (
    st.just(ttc_fast.Minimum())
    | st.builds(ttc_fast.KthSmallest, few | st.sampled_from([31, 32, 33, 1000, 2**62]))
    | st.builds(ttc_fast.Quantile, st.sampled_from([0.0, 0.05, 0.25, 0.5, 1.0]) | st.floats(0, 1))
    | st.builds(ttc_fast.MeanOfLowest, few | st.sampled_from([33, 100]))
    | st.builds(ttc_fast.InterquartileFence, st.sampled_from([0.0, 0.5, 1.5, 1e300]))
    | st.builds(ttc_fast.Supported, few | st.just(2**62), gaps)
    | st.builds(ttc_fast.Cluster, st.sampled_from([1e-6, 0.05, 0.15, 1.0, 1e6]), few)
)


@st.composite
def gates(draw: st.DrawFn, *, has_intensity: bool) -> ttc_fast.Gate:
    road = draw(st.none() | st.none() | roads)
    return ttc_fast.Gate(
        x=draw(forwards),
        y=draw(lefts),
        z=draw(ups),
        intensity=draw(st.none() | brightnesses) if has_intensity else None,
        axes=draw(st.just(("x", "y", "z")) | st.sampled_from(AXES)),
        curvature=draw(curvatures),
        road=road,
        height=None if road is None else draw(heights),
    )


def special(gate: ttc_fast.Gate, dtype: Any) -> NDArray[Any]:
    """Return coordinates that mean something special to a gate, in ``dtype``."""
    info = np.finfo(dtype)
    huge = min(float(info.max), 1e300)  # differences and sums of a few stay finite
    with np.errstate(over="ignore", under="ignore"):
        edges = np.array([*gate.x, *gate.y, *(gate.z or ())], dtype)
        around = [edges, -edges, np.nextafter(edges, dtype(-np.inf)), np.nextafter(edges, dtype(np.inf))]
        return np.concatenate(
            [
                np.clip(np.concatenate(around), -huge, huge),
                np.array([np.nan, -np.nan, np.inf, -np.inf, 0.0, -0.0, huge, -huge], dtype),
                np.array([info.smallest_subnormal, -info.smallest_subnormal, info.tiny, 0.1, 0.2, 1.0], dtype),
            ]
        )


def stored(gate: ttc_fast.Gate, ahead: tuple[NDArray[Any], ...]) -> tuple[NDArray[Any], ...]:
    """Return forward, left and up as the x, y and z that the axes of the gate make them of."""
    columns = {axis[-1]: -value if axis[0] == "-" else value for axis, value in zip(gate.axes, ahead, strict=True)}
    return columns["x"], columns["y"], columns["z"]


def world(rng: np.random.Generator, gate: ttc_fast.Gate, size: int, dtype: Any) -> tuple[NDArray[Any], ...]:
    """Draw coordinates of any number of points: some scene, with special values and missing points sprinkled in."""
    low, high = np.clip([gate.x, gate.y, gate.z or (-2.0, 1.0)], -30, 30).T

    def everywhere() -> NDArray[np.float64]:
        return rng.uniform(low - 1, high + 1, (size, 3))

    scenes: list[Callable[[], NDArray[np.float64]]] = [
        everywhere,
        lambda: np.round(everywhere(), 1),  # ties, and duplicates
        lambda: rng.normal(rng.uniform(low, high, (5, 3))[rng.integers(5, size=size)], [0.05, 0.3, 0.3]),  # things
        lambda: np.repeat(rng.uniform(low, high, (1, 3)), size, axis=0),
        lambda: rng.choice([-1, 1], (size, 3)) * 10.0 ** rng.uniform(-44, 37, (size, 3)),
    ]
    with np.errstate(over="ignore", under="ignore"):
        points: NDArray[Any] = scenes[rng.integers(len(scenes))]().astype(dtype)
    odd = rng.random(points.shape) < rng.choice([0.0, 0.01, 0.3, 0.9])
    points[odd] = rng.choice(special(gate, dtype), np.count_nonzero(odd))
    points[rng.random(size) < rng.choice([0.0, 0.0, 0.3])] = 0
    return stored(gate, tuple(points.T))


def brightness(rng: np.random.Generator, gate: ttc_fast.Gate, size: int, dtype: Any) -> NDArray[Any]:
    """Draw intensities, some of them exactly on the bounds."""
    if np.issubdtype(dtype, np.integer):
        return rng.integers(0, rng.choice([2, 256]), size).astype(dtype)
    edges = np.array(gate.intensity or (0.0, 1.0))
    with np.errstate(over="ignore"):
        values: NDArray[Any] = rng.uniform(0, 1, size).astype(dtype)
        choices = np.concatenate([edges.astype(dtype), np.array([np.nan, np.inf, -np.inf, 0.0], dtype)])
    odd = rng.random(size) < 0.2
    values[odd] = rng.choice(choices, np.count_nonzero(odd))
    return values


@st.composite
def points(draw: st.DrawFn, gate: ttc_fast.Gate, dtype: Any, intensity: Any) -> tuple[NDArray[Any], ...]:
    """Draw columns of a cloud. Few points are drawn one by one, so that failures shrink; many come from a seed."""
    rng = np.random.default_rng(draw(seeds))
    if draw(st.booleans()):
        values = st.floats(-3, 25, width=32) | st.sampled_from(list(special(gate, dtype)))
        drawn = draw(hnp.arrays(dtype, (3, draw(st.integers(0, 20))), elements=values, fill=st.nothing()))
        columns: tuple[NDArray[Any], ...] = tuple(drawn)
    else:
        columns = world(rng, gate, draw(st.sampled_from(SIZES)), dtype)
    return columns if intensity is None else (*columns, brightness(rng, gate, len(columns[0]), intensity))


@st.composite
def clouds(draw: st.DrawFn) -> CloudCase:
    """Draw one cloud, its layout and settings."""
    dtype, intensity = draw(dtypes), draw(st.none() | st.sampled_from(INTENSITIES))
    gate = draw(gates(has_intensity=intensity is not None))
    columns = draw(points(gate, dtype, intensity))
    layout = draw(st.sampled_from(list(LAYOUTS if intensity in (None, dtype) else IN_COLUMNS)))
    return CloudCase(columns, layout, gate, draw(estimators))


def stored_as(columns: tuple[NDArray[Any], ...]) -> tuple[Any, Any]:
    """Return the dtypes of coordinates and intensity, None if there is none."""
    coordinates, intensity = columns[0].dtype.type, columns[3].dtype.type if len(columns) == 4 else None
    return coordinates, intensity
