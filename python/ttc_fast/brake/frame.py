"""What comes with an update: the measurement, and the odometry and the estimate that are fresh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ttc_fast.brake.state import Source
    from ttc_fast.brake.types import Estimate, Motion

CLOCK_TOLERANCE = 0.1
"""A stamp may lie this far in the future, s, because two clocks are never the same."""


@dataclass(slots=True, init=False)
class Frame:
    """What came with an update, and what was known then. ``receive`` makes it; an ``__init__`` would take 0.2 us.

    Attributes
    ----------
    now, stamp : float
        Time of the decision and of the measurement, s.
    readings
        The scan or the cloud; None where the estimate is the frame.
    is_cloud : bool
        Whether the readings are a cloud.
    source : Source
        What is remembered of frames of this kind.
    estimate : Estimate or None
        The newest estimate that is fresh.
    motion : Motion or None
        The newest odometry that is fresh.
    commanded : Motion or None
        What the vehicle would do if it were not braked, where that is given.
    time_increment : float
        The time between two beams of the scan, s.
    path : ndarray, shape (N, 2), or None
        The points that the vehicle will follow, m, where they are given.
    looks : tuple of int
        The edges of the outline that the cloud turned out to look at.
    """

    now: float
    stamp: float
    readings: Any
    is_cloud: bool
    source: Source
    estimate: Estimate | None
    motion: Motion | None
    commanded: Motion | None
    time_increment: float
    path: NDArray[np.float64] | None
    looks: tuple[int, ...]
