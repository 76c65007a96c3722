"""A brake controller beside the log: what it decides of each frame, and what it saw."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar

from ttc_fast.brake import EstimateThreshold, IttcThreshold, Motion, Reason, StoppingDistance, SweptPathThreshold
from ttc_fast.brake.scene import NOTHING, Criterion, Needs
from ttc_fast.status import Status

if TYPE_CHECKING:
    from ttc_fast._core import ScanTTC
    from ttc_fast.brake import BrakeController, Decision
    from ttc_fast.brake.scene import Evaluation, Threats
    from ttc_fast.configuration import Configuration

SET_BACK = 1.0
"""s: a clock that goes back by more was set anew, as where a simulation restarts; by less it is jitter."""

STILL_BRAKING = (Reason.HOLD, Reason.STANDSTILL)


class Witness(Criterion):
    """A criterion that never triggers, and keeps what the controller showed to the others."""

    name: ClassVar[str] = "Witness"
    unit: ClassVar[str] = "s"

    def __init__(self, needs: Needs) -> None:
        self.needs = needs
        self.threats: Threats | None = None

    def evaluate(self, threats: Threats) -> Evaluation:
        """Keep the first threats of a frame: later ones are of what the vehicle would do if it were released."""
        if self.threats is None:
            self.threats = threats
        return NOTHING


class ReplayController:
    """Hands frames to a controller, with its watchdog.

    Parameters
    ----------
    configuration : Configuration
        Of the controller.
    sensor_timeout : float
        Its own, s.
    scan, path
        What it looks with; neither for estimates.
    sees_path : bool
        Whether there is an outline.
    """

    def __init__(
        self,
        configuration: Configuration,
        sensor_timeout: float,
        *,
        scan: ScanTTC | None = None,
        path: Any = None,
        sees_path: bool = False,
    ) -> None:
        first: Criterion = EstimateThreshold()
        if sees_path:
            first = SweptPathThreshold()
        elif scan is not None:
            first = IttcThreshold()
        criteria = configuration.criteria or (first, StoppingDistance())
        self.criteria = criteria
        self._witness = Witness(Needs.ESTIMATE if scan is None and path is None else criteria[0].needs)
        self._configuration = replace(configuration, criteria=(*criteria, self._witness))
        self._scan, self._path = scan, path
        self._timeout = sensor_timeout
        self.stale = self.resets = 0
        self.longest_gap = 0.0
        self._begin()

    def _begin(self) -> None:
        self._controller: BrakeController = self._configuration.controller(self._scan, self._path)
        self._stamp = math.nan
        self._blind = self._ignored = 0

    @property
    def thresholds(self) -> list[float]:
        """Of the criteria that compare a TTC, s."""
        return [float(each.threshold) for each in self.criteria if each.unit == "s" and hasattr(each, "threshold")]

    def is_reset(self, stamp: float) -> bool:
        """Begin anew where the clock of the log was set back; say so."""
        if stamp < self._stamp - SET_BACK:
            self.resets += 1
            self._begin()
            return True
        return False

    def decide(self, stamp: float, motion: Motion | None, /, **data: Any) -> tuple[Decision, Threats | None, Status]:
        """Decide on a frame: what is done, what was seen, and what the frame is worth where nothing was seen."""
        update, witness = self._controller.update, self._witness
        gap, self._stamp = stamp - self._stamp, stamp
        stale = gap > self._timeout
        if stale:
            self.stale += 1
            self.longest_gap = max(self.longest_gap, gap)
            update(stamp)  # the watchdog, just before the frame comes
        witness.threats = None
        decision = update(stamp, motion=motion, **data)
        if stale and decision.reason in STILL_BRAKING:
            decision = decision._replace(reason=Reason.STALE)  # what it brakes for, though a frame has come now
        threats = witness.threats
        counters = decision.counters
        status = Status.WARMING_UP
        if counters.blind != self._blind:
            self._blind, status, threats = counters.blind, Status.NO_DATA, None
        elif counters.ignored != self._ignored:
            self._ignored, status, threats = counters.ignored, Status.INVALID, None
        return decision, threats, status


def motion_of(frame: Any) -> Motion | None:
    """Return the motion of a frame, as old as it is; None where it is not known."""
    if frame.speed is None:
        return None
    age = frame.speed_age
    return Motion(frame.speed, frame.yaw_rate, 0.0, frame.stamp - age if 0.0 < age < math.inf else frame.stamp)
