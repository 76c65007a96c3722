"""``robust_min_x``: the robust nearest distance ahead in a point cloud."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ttc_fast.reference.arguments import checked_threads
from ttc_fast.reference.estimators import checked_estimator, estimate
from ttc_fast.reference.gate import candidates, checked_gate
from ttc_fast.reference.points import cloud
from ttc_fast.status import Detection

if TYPE_CHECKING:
    from ttc_fast._core import Gate
    from ttc_fast.reference.estimators import Estimator
    from ttc_fast.reference.points import Cloud


@dataclass(frozen=True)
class MinX:
    """The robust nearest distance ahead, and what it rests on."""

    x: float
    """The estimate, m. NaN when there are too few candidates or no data, inf when clear."""
    nearest_x: float
    """The plain nearest candidate, m. inf when clear, NaN without data."""
    candidates: int
    """Points inside the gate."""
    support: int
    """How many of them stand behind the estimate."""
    index: int
    """Which point the estimate is; -1 where it is no single one."""
    detection: Detection
    """What was found."""


def robust_min_x(
    points: Any, *, gate: Gate | None = None, estimator: Estimator | None = None, threads: int = 1
) -> MinX:
    """Find the robust nearest distance ahead of the points inside a gate.

    Arguments, result and errors are those of ``ttc_fast.robust_min_x``.

    Examples
    --------
    >>> import numpy as np
    >>> from ttc_fast import reference
    >>> points = np.array([[3.0, 0.0, 0.5], [8.0, 0.1, 0.5], [8.1, 0.2, 0.5], [9.0, 5.0, 0.5]])
    >>> found = reference.robust_min_x(points, estimator=reference.KthSmallest(2))
    >>> found.x, found.nearest_x, found.candidates
    (8.0, 3.0, 3)
    """
    checked_threads(threads)  # the answer does not depend on them
    return nearest(cloud("points", points), checked_gate(gate), checked_estimator(estimator))


def nearest(cloud: Cloud, gate: Gate, estimator: Estimator) -> MinX:
    """Find it in a cloud whose layout does not matter any more."""
    inside = candidates(cloud, gate)
    if not cloud.valid().any():
        return MinX(math.nan, math.nan, 0, 0, -1, Detection.NO_DATA)
    if len(inside.x) == 0:
        return MinX(math.inf, math.inf, 0, 0, -1, Detection.CLEAR)
    found = estimate(estimator, inside)
    nearest_x, count = float(inside.x[0]), len(inside.x)
    if found is None:
        return MinX(math.nan, nearest_x, count, 0, -1, Detection.TOO_FEW)
    return MinX(found.x, nearest_x, count, found.support, found.index, Detection.FOUND)
