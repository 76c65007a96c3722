"""What a controller remembers from one update to the next, and the checks of what comes in.

Every field of ``ControllerState`` and ``Brake`` is a plain value, an enumeration or a named tuple, so that it can be
saved.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

from ttc_fast._validate import finite, interval, not_nan, number, votes
from ttc_fast.brake.types import NOTHING, STANDING, Estimate, Motion
from ttc_fast.status import Status

if TYPE_CHECKING:
    from ttc_fast.brake.types import Criterion, Evaluation

CLOCK_TOLERANCE = 0.1
"""A stamp may lie this far in the future, s, because two clocks are never the same."""


Quorum = tuple[int, int]
"""How many votes are needed, and the bits of the frames that count."""


@dataclass(slots=True)
class Brake:
    """Whether a brake is on, the votes about it, and what it was braked from."""

    on: bool = False
    """Whether it brakes."""
    triggered_at: float = -math.inf
    """Time of the last decision that had a cause to brake, s."""
    braked_from: Motion = STANDING
    """The fastest motion of the frames that had a cause, since the first of them."""
    trigger_votes: int = 0
    """The votes on braking of frames like the newest, scans or clouds; the newest is in the lowest bit."""
    release_votes: int = 0
    """Their votes on release, the newest in the lowest bit."""
    other_trigger_votes: int = 0
    """The votes on braking of the other frames: of the clouds where the newest is a scan, or of the scans."""
    other_release_votes: int = 0
    """Their votes on release."""

    def brake(self, now: float, motion: Motion) -> None:
        """Begin to brake, or begin the hold time again."""
        if not self.on or motion.over_ground > self.braked_from.over_ground:
            self.braked_from = motion
        self._hold(now)

    def _hold(self, now: float) -> None:
        self.on, self.triggered_at, self.release_votes, self.other_release_votes = True, now, 0, 0

    def turn(self) -> None:
        """Let the votes of scans and of clouds change places."""
        self.trigger_votes, self.other_trigger_votes = self.other_trigger_votes, self.trigger_votes
        self.release_votes, self.other_release_votes = self.other_release_votes, self.release_votes

    def vote(
        self,
        now: float,
        triggers: bool,
        clear: bool,
        motion: Motion | None,
        trigger: Quorum,
        release: Quorum,
        hold: float,
        others: int,
    ) -> None:
        """Count the two votes of a frame, and begin or end braking.

        ``motion`` is what it was evaluated for. ``others`` is how many votes on release are needed of the other frames,
        of which the newest has to be clear too; 0 where there are none.
        """
        needed, counts = trigger
        before = self.trigger_votes & counts
        self.trigger_votes = votes = (before << 1 | triggers) & counts
        self.release_votes = (self.release_votes << 1 | clear) & release[1]
        if triggers:
            motion = motion or STANDING
            if not (self.on or before) or motion.over_ground > self.braked_from.over_ground:
                self.braked_from = motion
            if self.on or votes.bit_count() >= needed:
                self._hold(now)
        elif self.on:
            if motion is not None and not any(self.braked_from[:3]):  # it began to brake when no motion was known
                self.braked_from = motion
            # The votes of older frames let nothing go that this one shows, nor what the other sensor shows.
            if clear and now - self.triggered_at >= hold and self.release_votes.bit_count() >= release[0]:
                other = self.other_release_votes
                if not others or (other & 1 and other.bit_count() >= others):
                    self.on, self.trigger_votes, self.other_trigger_votes = False, 0, 0


@dataclass(slots=True)
class ControllerState:
    """The memory of a controller. Times are stamps, s, and -inf before the first."""

    frame_at: float = -math.inf
    """Stamp of the newest frame."""
    seen_at: float = -math.inf
    """Stamp of the newest frame that was not blind."""
    evaluated_at: float = -math.inf
    """Stamp of the newest frame that was evaluated: it was not blind, and its closing speeds were known."""
    period: float = math.inf
    """The usual time between two evaluated frames like the newest, scans or clouds, s."""
    is_cloud: bool = False
    """Whether the newest frame is a cloud. Scans and clouds are counted each for themselves."""
    newest_at: float = -math.inf
    """Stamp of the newest frame like the newest."""
    voted_at: float = -math.inf
    """Stamp of the newest of these that was evaluated."""
    other_period: float = math.inf
    """``period`` of the other frames."""
    other_newest_at: float = -math.inf
    """``newest_at`` of the other frames."""
    other_voted_at: float = -math.inf
    """``voted_at`` of the other frames."""
    scan_at: float = -math.inf
    """Stamp of the newest scan that was not blind."""
    cloud_at: float = -math.inf
    """Stamp of the newest cloud that was not blind."""
    cloud_looks: dict[int, float] = field(default_factory=dict)
    """Stamp of the newest cloud that had a point ahead of an edge of the outline, by the number of the edge."""
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
    unseen: bool = False
    """Whether nothing looked at a part of the path then."""

    brake: Brake = field(default_factory=Brake)
    """The brake."""
    brake_without_estimates: Brake | None = None
    """The brake as it would be if there had been no estimate; None as long as there was none."""

    frames: int = 0
    """Number of frames that were assessed, blind ones included."""
    ignored: int = 0
    """Number of frames whose stamp was not newer than the last one's, or lay in the future."""
    blind: int = 0
    """Number of frames with too few returns."""

    @property
    def braking(self) -> bool:
        """Whether the controller brakes. An estimate can only add."""
        without = self.brake_without_estimates
        return self.brake.on or (without is not None and without.on)

    def turn_to(self, clouds: bool) -> None:
        """Let a cloud be the newest frame, or a scan."""
        if clouds is self.is_cloud:
            return
        self.is_cloud = clouds
        self.period, self.other_period = self.other_period, self.period
        self.newest_at, self.other_newest_at = self.other_newest_at, self.newest_at
        self.voted_at, self.other_voted_at = self.other_voted_at, self.voted_at
        for brake in self.brakes:
            brake.turn()

    @property
    def brakes(self) -> tuple[Brake, ...]:
        """The brake, and the brake without estimates if there is one."""
        without = self.brake_without_estimates
        return (self.brake,) if without is None else (self.brake, without)

    def saved(self) -> dict[str, Any]:
        """Return everything as plain values, enumerations, named tuples and dicts."""
        plain = {each.name: getattr(self, each.name) for each in fields(self)}
        for name in BRAKES:
            brake = plain[name]
            plain[name] = brake and {each.name: getattr(brake, each.name) for each in fields(Brake)}
        return plain

    @classmethod
    def of(cls, saved: dict[str, Any]) -> ControllerState:
        """Return the memory that ``saved`` returned. A ValueError says what is missing."""
        for name in (each.name for each in fields(cls)):
            if name not in saved:
                raise ValueError(f"state has no {name}: it must come from state()")
        plain = {each.name: saved[each.name] for each in fields(cls)}
        for name in BRAKES:
            if plain[name] is not None:
                plain[name] = Brake(**plain[name])
        return cls(**plain)


BRAKES = ("brake", "brake_without_estimates")


def is_fresh(stamp: float, now: float, timeout: float) -> bool:
    """Return whether data are not too old, and not in the future, as they are when the clock was set back."""
    return -CLOCK_TOLERANCE <= now - stamp <= timeout


class NOfM:
    """A vote of at least N of the last M frames, or of a share of the frames of the last seconds.

    The votes are the bits of an int that the caller keeps, the newest in the lowest bit. A frame that never came counts
    as a no. By time at least two frames count, and have to agree.

    Parameters
    ----------
    rule : (int, int) or (float, float)
        N and M, or share and seconds, as ``BrakeSettings`` checks them.
    """

    __slots__ = ("_quorums", "_seconds")

    def __init__(self, rule: tuple[float, float]) -> None:
        first, second = votes("votes", rule)
        self._seconds = 0.0
        if isinstance(first, int) and isinstance(second, int):
            self._quorums = [(first, (1 << second) - 1)]
        else:
            self._seconds, self._quorums = second, shares(first)

    def quorum(self, period: float) -> Quorum:
        """Return how many votes are needed, and which count, where a frame comes every ``period`` seconds."""
        frames = self._seconds / period + 0.5
        return self._quorums[int(frames) if frames < 64.0 else 64]


@functools.cache
def shares(share: float) -> list[Quorum]:
    """Return the quorum of each number of frames up to 64; two frames at least count, and have to agree."""
    frames = [max(frames, 2) for frames in range(65)]
    return [(max(math.ceil(share * each - 1e-9), 2), (1 << each) - 1) for each in frames]


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
        not_nan("estimate.age", estimate.age, 0.0, "s"),
    )
