"""What ``ScanTTC.nearest`` and ``SweptPath.nearest`` give, for one frame and for a batch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ttc_fast.status import Status


@dataclass(frozen=True)
class Counts:
    """How often each case of a reading occurred in one scan. Every beam is counted once in the first seven."""

    valid: int
    """Valid readings within the user's limits."""
    invalid: int
    """NaN."""
    too_close: int
    """-inf: an object nearer than ``range_min``."""
    no_return: int
    """+inf: observed free space."""
    out_of_range: int
    """Finite and outside the sensor's ``[range_min, range_max]``: discarded."""
    beyond_limits: int
    """Valid readings beyond the user's far limit."""
    masked: int
    """Ignored because of ``mask``, or because the beam looks at the vehicle itself."""
    contact: int
    """Readings inside the outline."""


@dataclass(frozen=True)
class Nearest:
    """The nearest beam in time of one scan, and everything that says why."""

    ttc: float
    """Least time-to-collision, s, in [0, inf]."""
    status: Status
    """What it means."""
    beam: int
    """The beam that decided: the one of ``ttc``, else the first in contact, else -1."""
    angle: float
    """Direction of that beam in the sensor frame, rad. NaN without a beam, as all that follows."""
    range: float
    """Its reading, m."""
    clearance: float
    """What is left of it outside the outline, m."""
    closing_speed: float
    """Speed of the sensor along the beam, m/s."""
    counts: Counts
    """How often each case of a reading occurred."""


class CountsBatch:
    """``Counts`` of a batch: the same names, each a uint32 array of shape (B,)."""

    def __init__(self, scans: Sequence[Counts]) -> None:
        self.valid = np.array([counts.valid for counts in scans], np.uint32)
        self.invalid = np.array([counts.invalid for counts in scans], np.uint32)
        self.too_close = np.array([counts.too_close for counts in scans], np.uint32)
        self.no_return = np.array([counts.no_return for counts in scans], np.uint32)
        self.out_of_range = np.array([counts.out_of_range for counts in scans], np.uint32)
        self.beyond_limits = np.array([counts.beyond_limits for counts in scans], np.uint32)
        self.masked = np.array([counts.masked for counts in scans], np.uint32)
        self.contact = np.array([counts.contact for counts in scans], np.uint32)

    def __len__(self) -> int:
        return len(self.valid)


class NearestBatch:
    """``Nearest`` of a batch: the same names, each an array of shape (B,). ``batch[i]`` is the ``Nearest`` of one scan.

    ``status`` is uint8, ``beam`` int64, ``counts`` a ``CountsBatch``, and everything else float64.
    """

    def __init__(self, scans: Sequence[Nearest]) -> None:
        self.ttc = np.array([nearest.ttc for nearest in scans], np.float64)
        self.status = np.array([nearest.status for nearest in scans], np.uint8)
        self.beam = np.array([nearest.beam for nearest in scans], np.int64)
        self.angle = np.array([nearest.angle for nearest in scans], np.float64)
        self.range = np.array([nearest.range for nearest in scans], np.float64)
        self.clearance = np.array([nearest.clearance for nearest in scans], np.float64)
        self.closing_speed = np.array([nearest.closing_speed for nearest in scans], np.float64)
        self.counts = CountsBatch([nearest.counts for nearest in scans])
        self._scans = tuple(scans)

    def __len__(self) -> int:
        return len(self._scans)

    def __getitem__(self, index: int) -> Nearest:
        return self._scans[index]


@dataclass(frozen=True)
class NearestPoint:
    """The point that is hit first, and everything that says why."""

    ttc: float
    """Least time until a point enters the outline, s."""
    status: Status
    """What it means."""
    index: int
    """The point that decided: the one of ``ttc``, else the first in contact, else -1."""
    x: float
    """Where it is, m. NaN without a point, as all that follows."""
    y: float
    """Where it is, m."""
    clearance: float
    """From the outline to the point, m; negative inside."""
    closing_speed: float
    """How fast the clearance shrinks now, m/s."""
    counts: Counts
    """How many points are ``valid``, ``invalid`` and in ``contact``; the rest is 0."""


class NearestPointBatch:
    """``NearestPoint`` of a batch: the same names, each an array of shape (B,). ``batch[i]`` is that of one cloud.

    ``status`` is uint8, ``index`` int64, ``counts`` a ``CountsBatch``, and everything else float64.
    """

    def __init__(self, clouds: Sequence[NearestPoint]) -> None:
        self.ttc = np.array([nearest.ttc for nearest in clouds], np.float64)
        self.status = np.array([nearest.status for nearest in clouds], np.uint8)
        self.index = np.array([nearest.index for nearest in clouds], np.int64)
        self.x = np.array([nearest.x for nearest in clouds], np.float64)
        self.y = np.array([nearest.y for nearest in clouds], np.float64)
        self.clearance = np.array([nearest.clearance for nearest in clouds], np.float64)
        self.closing_speed = np.array([nearest.closing_speed for nearest in clouds], np.float64)
        self.counts = CountsBatch([nearest.counts for nearest in clouds])
        self._clouds = tuple(clouds)

    def __len__(self) -> int:
        return len(self._clouds)

    def __getitem__(self, index: int) -> NearestPoint:
        return self._clouds[index]
