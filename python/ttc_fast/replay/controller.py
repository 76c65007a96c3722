"""A brake controller beside a log: it decides on each frame as on the vehicle, with its watchdog."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from ttc_fast.brake import Motion, Reason
from ttc_fast.sensors.clock import SET_BACK

if TYPE_CHECKING:
    from ttc_fast._core import ScanTTC, SweptPath
    from ttc_fast.brake import BrakeController, Criterion, Decision
    from ttc_fast.configuration import Configuration

STILL_BRAKING = (Reason.HOLD, Reason.STANDSTILL)


class ReplayController:
    """Hands frames to a controller, and lets its watchdog look at every gap between them.

    Parameters
    ----------
    configuration : Configuration
        The settings of the controller.
    scan : ScanTTC, optional
        How scans are read.
    path : SweptPath, optional
        How clouds are read. With neither, every estimate is a frame.

    Attributes
    ----------
    brake : BrakeController
        The controller.
    stale : int
        Number of gaps that were longer than ``sensor_timeout``.
    longest_gap : float
        The longest of those, s.
    resets : int
        How often the clock of the log was set back.
    """

    def __init__(
        self, configuration: Configuration, *, scan: ScanTTC | None = None, path: SweptPath | None = None
    ) -> None:
        self.brake: BrakeController = configuration.controller(scan, path)
        self._timeout = self.brake.settings.sensor_timeout
        self._stamp = math.nan
        self.stale = self.resets = 0
        self.longest_gap = 0.0

    @property
    def criteria(self) -> tuple[Criterion, ...]:
        """The criteria that decide."""
        return self.brake.criteria

    @property
    def thresholds(self) -> list[float]:
        """The thresholds of the criteria that compare a TTC, s."""
        return [float(each.threshold) for each in self.criteria if each.unit == "s" and hasattr(each, "threshold")]

    def reset_if_set_back(self, stamp: float) -> bool:
        """Begin anew if the clock of the log was set back; return whether it was."""
        set_back = stamp < self._stamp - SET_BACK
        if set_back:
            self.resets += 1
            self.brake.reset()
            self._stamp = math.nan
        return set_back

    def decide(self, stamp: float, motion: Motion | None, /, **data: Any) -> Decision:
        """Decide on a frame. What still brakes for the gap before the frame has the reason STALE."""
        gap, self._stamp = stamp - self._stamp, stamp
        stale = gap > self._timeout
        if stale:
            self.stale += 1
            self.longest_gap = max(self.longest_gap, gap)
            self.brake.update(stamp)  # the watchdog, just before the frame comes
        decision = self.brake.update(stamp, motion=motion, **data)
        if stale and decision.reason in STILL_BRAKING:
            decision = decision._replace(reason=Reason.STALE)
        return decision


def motion_of(frame: Any) -> Motion | None:
    """Return the motion at a frame with the stamp of the odometry, or None where it is not known."""
    if frame.speed is None:
        return None
    age, lateral = frame.speed_age, frame.lateral_speed
    return Motion(frame.speed, frame.yaw_rate, lateral, frame.stamp - age if 0.0 < age < math.inf else frame.stamp)
