"""What a controller remembers from one update to the next: all of it, so that it can be saved."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ttc_fast.brake.scene import NOTHING
from ttc_fast.brake.sight import STANDING

if TYPE_CHECKING:
    from ttc_fast.brake.scene import Criterion, Evaluation
    from ttc_fast.brake.sight import Estimate, Motion

CLOCK_TOLERANCE = 0.1
"""s: how far in the future a stamp may lie, because two clocks are never the same."""


@dataclass(slots=True)
class ControllerState:
    """See the attributes; times are stamps, s, and -inf before the first."""

    frame_at: float = -math.inf
    """Of the newest frame."""
    seen_at: float = -math.inf
    """Of the newest frame that was not blind."""
    judged_at: float = -math.inf
    """Of the newest frame that could be judged: something told the closing speed."""
    motion: Motion | None = None
    """The newest odometry."""
    motion_at: float = -math.inf
    """Of the newest odometry."""
    estimate: Estimate | None = None
    """The newest estimate."""

    criterion: Criterion | None = None
    """The one that was nearest to its threshold in the newest frame, or beyond it by most."""
    evaluation: Evaluation = NOTHING
    """What it said."""
    rests_in_contact: bool = False
    """Whether something was inside the outline then, and nothing said which way the vehicle will go."""

    braking: bool = False
    """Whether it brakes."""
    triggered_at: float = -math.inf
    """The decision at which it last had a cause to brake."""
    braked_from: Motion = STANDING
    """The motion it braked from."""
    triggers: int = 0
    """The votes on braking, a bit for each frame."""
    clears: int = 0
    """The votes on release."""

    frames: int = 0
    """How many were judged or blind."""
    ignored: int = 0
    """How many had a stamp that was not newer, or lay in the future."""
    blind: int = 0
    """How many had too few returns."""

    def brake(self, now: float, motion: Motion | None) -> None:
        """Begin to brake, or begin the hold time again."""
        self.triggered_at = now
        self.clears = 0
        if not self.braking:
            self.braking = True
            self.braked_from = motion or self.motion or STANDING

    def fresh_motion(self, now: float, timeout: float) -> Motion | None:
        """Return the newest odometry, unless it is too old, or of a time to come: the clock was set back."""
        return self.motion if -CLOCK_TOLERANCE <= now - self.motion_at <= timeout else None

    def fresh_estimate(self, now: float, timeout: float) -> Estimate | None:
        """Return the newest estimate, unless it is too old, or of a time to come."""
        estimate = self.estimate
        return estimate if estimate is not None and -CLOCK_TOLERANCE <= now - estimate.stamp <= timeout else None
