"""What a user would write: all pairs by NumPy, or by SciPy's pdist, then a median."""

from __future__ import annotations

from typing import Any

import numpy as np

try:
    from scipy.spatial import distance  # type: ignore[import-untyped, import-not-found, unused-ignore]
except ImportError:
    distance = None

HAS_SCIPY = distance is not None


def median_ratio(previous: Any, current: Any, least: float) -> Any:
    i, j = np.triu_indices(len(previous), 1)
    before = np.linalg.norm(previous[i] - previous[j], axis=1)
    now = np.linalg.norm(current[i] - current[j], axis=1)
    kept = (before > 0) & (now >= least)
    return np.median(now[kept] / before[kept])


def median_ratio_by_scipy(previous: Any, current: Any, least: float) -> Any:
    before, now = distance.pdist(previous), distance.pdist(current)
    kept = (before > 0) & (now >= least)
    return np.median(now[kept] / before[kept])
