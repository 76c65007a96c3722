"""A cloud with every kind of point, and every question that can be asked of it, for the tests of clouds."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any

import numpy as np

import ttc_fast
from ttc_fast import (
    Cluster,
    Gate,
    InterquartileFence,
    KthSmallest,
    MeanOfLowest,
    Minimum,
    Quantile,
    Road,
    Supported,
)

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

ESTIMATORS: dict[str, Any] = {
    "minimum": Minimum(),
    "third": KthSmallest(3),
    "median": Quantile(0.5),
    "fifth percentile": Quantile(0.05),
    "mean of five": MeanOfLowest(5),
    "fence": InterquartileFence(0.5),
    "supported": Supported(3, 0.1),
    "cluster": Cluster(0.4, 4),
}
GATES: dict[str, Gate] = {
    "lane": Gate(),
    "box": Gate(x=(2.0, 20.0), y=(-1.7, 1.9), z=(-1.5, 0.9)),
    "everything": Gate(x=(-np.inf, np.inf), y=(-np.inf, np.inf)),
    "other axes": Gate(x=(0.5, 3.0), y=(-20.0, -4.0), axes=("y", "-x", "z")),
    "curve": Gate(x=(1.0, 25.0), curvature=0.04),
    "above a road": Gate(road=Road(0.02, -0.01, -1.0), height=(0.2, 2.0)),
}
BRIGHT: dict[str, Gate] = {
    "bright": Gate(intensity=(20.0, 70.0)),
    "bright, in a box": Gate(x=(2.0, 20.0), z=(-1.5, 0.9), intensity=(0.0, 33.0)),
    "bright, on a curve": Gate(x=(1.0, 25.0), curvature=-0.03, intensity=(50.0, 255.0)),
}


def make_points(count: int, dtype: Any) -> NDArray[Any]:
    """Make plain rows x, y, z, intensity: some without a return, some invalid, some alike, some on a bound of a gate.

    Intensities are whole numbers from 0 to 100, so that every type can hold them.
    """
    rng = np.random.default_rng(11)
    columns = [rng.uniform(low, high, count) for low, high in ((0.5, 40.0), (-3.0, 3.0), (-2.0, 2.0))]
    points: NDArray[Any] = np.column_stack([*columns, rng.integers(0, 101, count)]).astype(dtype)
    for special in (np.nan, np.inf, -np.inf, 0.0, -1.0):
        for column in range(3):
            points[rng.random(count) < 0.003, column] = special
    points[rng.random(count) < 0.05, :3] = 0.0
    points[rng.random(count) < 0.002, 0] = 2.0
    points[rng.random(count) < 0.02, 1] = -1.7
    alike = rng.random(count) < 0.05
    points[alike, 0] = np.round(points[alike, 0])
    return points


def answer(found: ttc_fast.MinX) -> tuple[Any, ...]:
    """Return what was found, in a form where equal means bit for bit, NaN included."""
    bits = struct.pack("<dd", found.x, found.nearest_x)
    return bits, found.candidates, found.support, found.index, found.detection


def answers(
    points: Any, gates: Iterable[Gate] = GATES.values(), estimators: Iterable[Any] = ESTIMATORS.values()
) -> list[tuple[Any, ...]]:
    """Return all answers for these points."""
    chosen = list(estimators)
    return [answer(ttc_fast.robust_min_x(points, gate=gate, estimator=each)) for gate in gates for each in chosen]
