"""What a controller remembers from one update to the next, and the checks of what comes in.

Every field of ``ControllerState`` is a plain value, an enumeration or a named tuple, so that it can be saved.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ttc_fast._validate import finite, interval, number
from ttc_fast.brake.types import NOTHING, STANDING, Estimate, Motion
from ttc_fast.status import Status

if TYPE_CHECKING:
    from ttc_fast.brake.types import Criterion, Evaluation

CLOCK_TOLERANCE = 0.1
"""A stamp may lie this far in the future, s, because two clocks are never the same."""


@dataclass(slots=True)
class ControllerState:
    """The memory of a controller. Times are stamps, s, and -inf before the first."""

    frame_at: float = -math.inf
    """Stamp of the newest frame."""
    seen_at: float = -math.inf
    """Stamp of the newest frame that was not blind."""
    evaluated_at: float = -math.inf
    """Stamp of the newest frame that was evaluated: it was not blind, and its closing speeds were known."""
    motion: Motion | None = None
    """The newest odometry."""
    motion_at: float = -math.inf
    """Stamp of the newest odometry."""
    estimate: Estimate | None = None
    """The newest estimate of a tracker or a camera."""

    criterion: Criterion | None = None
    """The most urgent criterion of the newest evaluated frame."""
    evaluation: Evaluation = NOTHING
    """The evaluation by that criterion."""
    rests_in_contact: bool = False
    """Whether something was inside the outline then, and neither motion nor command said which way it will go."""

    braking: bool = False
    """Whether the controller brakes."""
    triggered_at: float = -math.inf
    """Time of the last decision that had a cause to brake."""
    braked_from: Motion = STANDING
    """The fastest motion since the controller began to brake, in frames that had a cause."""
    trigger_votes: int = 0
    """The votes on braking, as ``NOfM`` keeps them."""
    release_votes: int = 0
    """The votes on release, as ``NOfM`` keeps them."""

    frames: int = 0
    """Number of frames that were assessed, blind ones included."""
    ignored: int = 0
    """Number of frames whose stamp was not newer than the last one's, or lay in the future."""
    blind: int = 0
    """Number of frames with too few returns."""

    def brake(self, now: float, motion: Motion | None) -> None:
        """Begin to brake, or begin the hold time again. ``braked_from`` learns the fastest motion of all such calls."""
        self.triggered_at = now
        self.release_votes = 0
        motion = motion or self.motion or STANDING
        if not self.braking or motion.over_ground > self.braked_from.over_ground:
            self.braked_from = motion
        self.braking = True

    def release(self) -> None:
        """End braking. The votes on braking begin anew."""
        self.braking = False
        self.trigger_votes = 0


def is_fresh(stamp: float, now: float, timeout: float) -> bool:
    """Return whether data are not too old, and not in the future, as they are when the clock was set back."""
    return -CLOCK_TOLERANCE <= now - stamp <= timeout


class NOfM:
    """A vote of at least N of the last M frames. A frame that never came counts as a no.

    The votes are the bits of an int that the caller keeps, the newest in the lowest bit.

    Parameters
    ----------
    rule : (int, int)
        N and M, as ``BrakeSettings`` checks them.
    """

    __slots__ = ("_mask", "_needed")

    def __init__(self, rule: tuple[int, int]) -> None:
        self._needed, frames = rule
        self._mask = (1 << frames) - 1

    def push(self, votes: int, vote: bool) -> int:
        """Return the votes with one more, of which the last M count."""
        return (votes << 1 | vote) & self._mask

    def reached(self, votes: int) -> bool:
        """Return whether at least N of the votes are yes."""
        return votes.bit_count() >= self._needed


def checked_motion(argument: str, value: Any) -> Motion:
    """Return ``value`` as a Motion if its numbers are finite."""
    try:
        motion = value if type(value) is Motion else Motion(*value)
    except TypeError:
        raise TypeError(f"{argument} must be a Motion, such as Motion(4.0), got {value!r}") from None
    speed, yaw_rate, lateral_speed, stamp = motion
    try:
        if math.isfinite(speed + yaw_rate + lateral_speed + (0.0 if stamp is None else stamp)):
            return motion
    except TypeError:
        pass  # the loop finds which of them is not a number
    for name, each in motion._asdict().items():
        if each is not None or name != "stamp":
            finite(f"{argument}.{name}", each)
    return motion


def checked_commanded(value: Any) -> Motion:
    """Return the argument ``commanded``, a Motion or a speed, as a Motion."""
    if isinstance(value, Motion):
        return checked_motion("commanded", value)
    return Motion(finite("commanded", value))


def checked_estimate(value: Any) -> Estimate:
    """Return ``value`` as an Estimate if its numbers make sense; NaN and None stand for what is not known."""
    try:
        estimate = Estimate(*value)
    except TypeError:
        raise TypeError(f"estimate must be an Estimate, such as Estimate.of(tracked, stamp), got {value!r}") from None
    ttc = number("estimate.ttc", estimate.ttc)
    if not ttc >= 0.0:
        raise ValueError(f"estimate.ttc must be from 0 to inf, got {ttc:g}")
    if not (estimate.status is None or isinstance(estimate.status, Status)):
        raise TypeError(f"estimate.status must be None or a Status, such as Status.CLOSING, got {estimate.status!r}")
    return Estimate(
        finite("estimate.stamp", estimate.stamp),
        ttc,
        interval("estimate.ttc_interval", estimate.ttc_interval),
        number("estimate.distance", estimate.distance),
        number("estimate.closing_speed", estimate.closing_speed),
        interval("estimate.closing_speed_interval", estimate.closing_speed_interval),
        estimate.status,
    )
