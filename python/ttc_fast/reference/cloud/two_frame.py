"""``ttc_from_clouds``: time-to-collision from how the nearest distance shrinks between two clouds."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ttc_fast.reference.arguments import checked_dt, finite
from ttc_fast.reference.cloud.estimator import MinX, checked_estimator, nearest
from ttc_fast.reference.cloud.gate import checked_gate
from ttc_fast.reference.motion import ttc_from_distances
from ttc_fast.reference.points import cloud
from ttc_fast.status import Detection, Status

if TYPE_CHECKING:
    from ttc_fast._core import Gate
    from ttc_fast.reference.cloud.estimator import Estimator


@dataclass(frozen=True)
class CloudTTC:
    """Time-to-collision from two clouds, and the distances that it rests on."""

    ttc: float
    """Time-to-collision, s, in [0, inf]; inf where nothing closes or too little is known."""
    status: Status
    """What the numbers mean."""
    distance: float
    """Distance from the bumper to the nearest thing in the current cloud, m. inf when clear, NaN without data."""
    closing_speed: float
    """Closing speed, m/s, positive when approaching. NaN unless both clouds show a distance."""
    previous: MinX
    """What was found in the earlier cloud."""
    current: MinX
    """What was found in the later cloud."""


def ttc_from_clouds(
    previous: Any,
    current: Any,
    dt: float,
    *,
    gate: Gate | None = None,
    estimator: Estimator | None = None,
    front_offset: float = 0.0,
) -> CloudTTC:
    """Time-to-collision from two clouds taken ``dt`` seconds apart.

    Arguments, result and errors are those of ``ttc_fast.ttc_from_clouds``. Where either cloud has too few points for
    the estimator, both are taken at their plain nearest, and the status says so.

    Examples
    --------
    >>> import numpy as np
    >>> from ttc_fast import reference
    >>> car = np.array([[10.0, 0.0, 0.5], [10.2, 0.1, 0.5], [10.1, -0.4, 0.6]])
    >>> seen = reference.ttc_from_clouds(car, car - [0.5, 0, 0], 0.1, estimator=reference.Minimum())
    >>> round(seen.ttc, 6), seen.status.name, round(seen.closing_speed, 6)
    (1.9, 'CLOSING', 5.0)
    """
    gate, estimator = checked_gate(gate), checked_estimator(estimator)
    clouds = cloud("previous", previous), cloud("current", current)
    if clouds[0].xyz.dtype != clouds[1].xyz.dtype:
        raise TypeError("previous and current must have the same dtype")
    dt, front_offset = checked_dt(dt), finite("front_offset", front_offset)

    earlier, later = (nearest(each, gate, estimator) for each in clouds)
    too_few = Detection.TOO_FEW in (earlier.detection, later.detection)
    before, now = ((seen.nearest_x if too_few else seen.x) - front_offset for seen in (earlier, later))
    ttc, closing_speed = math.inf, math.nan
    if math.isfinite(before) and math.isfinite(now):
        ttc, closing_speed = ttc_from_distances(before, now, dt), (before - now) / dt
    # The first that holds.
    cases = {
        Status.NO_DATA: later.detection is Detection.NO_DATA,
        Status.CLEAR: later.detection is Detection.CLEAR,
        Status.CONTACT: now <= 0,
        Status.WARMING_UP: not math.isfinite(before),
        Status.TOO_FEW: too_few,
        Status.CLOSING: ttc < math.inf,
        Status.NOT_CLOSING: True,
    }
    status = next(status for status, holds in cases.items() if holds)
    return CloudTTC(ttc, status, now, closing_speed, earlier, later)
