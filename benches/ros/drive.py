"""What the drives over every transport have in common."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

NEAR, FAR = 2.0, 20.0
"""m: a wall for which it brakes at ``SPEED``, and one for which it does not."""
SPEED = 4.0
"""m/s"""
PATIENCE = 5.0
"""s: how long an answer may take."""


def quantiles(times: Sequence[float] | NDArray[np.float64]) -> list[str]:
    """Return the least, p50 and p99 of some times, in their unit."""
    return [f"{each:.0f}" for each in np.quantile(times, [0.0, 0.5, 0.99])]


def resident(pid: int) -> float:
    """Return the memory of a process, MB."""
    with open(f"/proc/{pid}/statm", encoding="ascii") as told:
        return int(told.read().split()[1]) * os.sysconf("SC_PAGESIZE") / 1e6
