"""The questions about clouds: each is an estimator, and how others do the same."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import ttc_fast

if TYPE_CHECKING:
    from collections.abc import Mapping


COPYING = "copied first"
OPEN3D_MINIMUM = "Open3D crop, outliers, min"


@dataclass(frozen=True)
class Job:
    """One question."""

    estimator: object
    numpy: str | None = None
    """Asked of ``by_numpy``."""
    others: Mapping[str, str] = field(default_factory=dict, hash=False)
    """Asked of ``by_others``."""

    @property
    def name(self) -> str:
        return str(self.estimator)


MINIMUM = Job(ttc_fast.Minimum(), "minimum(points)")
KTH = Job(ttc_fast.KthSmallest(20), "kth_smallest(points, 20)", {OPEN3D_MINIMUM: "open3d_minimum(points, box)"})
QUANTILE = Job(ttc_fast.Quantile(0.5), "quantile(points, 0.5)")
MEAN = Job(ttc_fast.MeanOfLowest(10), "mean_of_lowest(points, 10)")
FENCE = Job(ttc_fast.InterquartileFence(1.5), "interquartile_fence(points, 1.5)")
SUPPORTED = Job(ttc_fast.Supported(5, 0.1), "supported(points, 5, 0.1)")
CLUSTER = Job(
    ttc_fast.Cluster(0.2, 10),
    others={
        "SciPy": "scipy_cluster(points, 0.2, 10)",
        "Open3D": "open3d_cluster(points, 0.2, 10)",
    },
)
JOBS = (MINIMUM, KTH, QUANTILE, MEAN, FENCE, SUPPORTED, CLUSTER)
