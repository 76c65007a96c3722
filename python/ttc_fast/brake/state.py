"""The third step of a decision: what a controller remembers from one update to the next, and how votes change it.

Every field of ``ControllerState`` and ``Brake`` is a plain value, an enumeration or a named tuple, so that it can be
saved.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any

from ttc_fast._validate import votes
from ttc_fast.brake.evaluate import IGNORED
from ttc_fast.brake.frozen import NEVER
from ttc_fast.brake.receive import CLOCK_TOLERANCE
from ttc_fast.brake.types import NOTHING, STANDING
from ttc_fast.status import Status

if TYPE_CHECKING:
    from ttc_fast.brake.evaluate import Assessed
    from ttc_fast.brake.frozen import Held
    from ttc_fast.brake.receive import Frame, Newest
    from ttc_fast.brake.settings import BrakeSettings
    from ttc_fast.brake.types import Criterion, Estimate, Evaluation, Motion

__all__ = ["CLOCK_TOLERANCE", "Brake", "ControllerState", "NOfM", "Voting"]

NO_DATA, STALE = Status.NO_DATA, Status.STALE
SMOOTHING = 0.25
"""The weight of the newest time between two frames in the usual one."""

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
class Source:
    """What is remembered of the frames of one kind, scans or clouds. They are counted each for themselves."""

    newest_at: float = -math.inf
    """Stamp of the newest frame."""
    seen_at: float = -math.inf
    """Stamp of the newest frame that was not blind."""
    voted_at: float = -math.inf
    """Stamp of the newest frame that was evaluated: it was not blind, and its closing speeds were known."""
    period: float = math.inf
    """The usual time between two evaluated frames, s."""
    held: Held = NEVER
    """The readings of the newest frame, and how long they have been the same."""
    held_before: Held = NEVER
    """The readings before, which were others."""


@dataclass(slots=True)
class ControllerState:
    """The memory of a controller. Times are stamps, s, and -inf before the first."""

    scans: Source = field(default_factory=Source)
    """The scans, or the estimates where these are the only frames."""
    clouds: Source = field(default_factory=Source)
    """The clouds."""
    is_cloud: bool = False
    """Whether the newest frame is a cloud."""
    cloud_looks: dict[int, float] = field(default_factory=dict)
    """Stamp of the newest cloud that had a point ahead of an edge of the outline, by the number of the edge."""
    motion: Motion | None = None
    """The newest odometry."""
    motion_at: float = -math.inf
    """Stamp of the newest odometry."""
    estimate: Estimate | None = None
    """The newest estimate of a tracker or a camera."""
    estimate_since: float = -math.inf
    """The stamp with which its numbers came first, where a finite TTC is repeated."""

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

    @property
    def brakes(self) -> tuple[Brake, ...]:
        """The brake, and the brake without estimates if there is one."""
        without = self.brake_without_estimates
        return (self.brake,) if without is None else (self.brake, without)

    def saved(self) -> dict[str, Any]:
        """Return everything as plain values, enumerations, named tuples and dicts."""
        plain = {each.name: getattr(self, each.name) for each in fields(self)}
        for name, kind in PARTS.items():
            part = plain[name]
            plain[name] = part and {each.name: getattr(part, each.name) for each in fields(kind)}
        return plain

    @classmethod
    def of(cls, saved: dict[str, Any]) -> ControllerState:
        """Return the memory that ``saved`` returned. A ValueError says what is missing."""
        for name in (each.name for each in fields(cls)):
            if name not in saved:
                raise ValueError(f"state has no {name}: it must come from state()")
        plain = {each.name: saved[each.name] for each in fields(cls)}
        for name, kind in PARTS.items():
            if plain[name] is not None:
                plain[name] = kind(**plain[name])
        return cls(**plain)


PARTS: dict[str, Any] = {"scans": Source, "clouds": Source, "brake": Brake, "brake_without_estimates": Brake}


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


class Voting:
    """The rules by which the frames of a controller vote.

    Parameters
    ----------
    settings : BrakeSettings
        The settings of the controller.
    """

    __slots__ = ("_from", "_hold", "_quorums", "_release", "_timeout", "_to", "_trigger")

    def __init__(self, settings: BrakeSettings) -> None:
        self._trigger, self._release = NOfM(settings.trigger), NOfM(settings.release)
        self._hold, self._timeout = settings.hold, settings.sensor_timeout
        self._from = self._to = settings.sensor_timeout
        self._quorums = self._trigger.quorum(self._to), self._release.quorum(self._to)

    def _learn(self, period: float) -> None:
        """Find both quorums; they are the same for every period between two that have them."""
        quorums = self._trigger.quorum(period), self._release.quorum(period)
        is_known = quorums == self._quorums
        self._from, self._to = (min(self._from, period), max(self._to, period)) if is_known else (period, period)
        self._quorums = quorums

    def vote(self, state: ControllerState, newest: Newest, frame: Frame | None, assessed: Assessed) -> None:
        """Remember what came, count the two votes of a frame, and begin or end braking."""
        state.motion, state.motion_at, state.estimate, state.estimate_since = newest
        if frame is None:
            return
        if assessed is IGNORED:
            state.ignored += 1
            return
        state.frames += 1
        source, other = state.scans, state.clouds
        is_cloud = frame.points is not None
        if is_cloud:
            source, other = other, source
        if is_cloud is not state.is_cloud:
            state.is_cloud = is_cloud
            for brake in state.brakes:
                brake.turn()
        status, _, held, vote, without = assessed
        if held[0] is not source.held[0]:
            source.held_before = source.held
        source.newest_at, source.held = frame.stamp, held
        if vote is None:  # a frame that cannot be evaluated is not clear
            if status is NO_DATA:
                state.blind += 1
            elif status is STALE:  # as if nothing had come since the readings were new
                source.seen_at = source.voted_at = min(source.voted_at, held[1])
            else:
                source.seen_at = frame.stamp
            _, counts = self._release.quorum(source.period)
            for brake in state.brakes:
                brake.release_votes = brake.release_votes << 1 & counts
            return
        criterion, evaluation, triggers, clear, motion, rests, unseen, looks = vote
        source.seen_at = frame.stamp
        since, period = frame.stamp - source.voted_at, source.period
        source.voted_at = frame.stamp
        if since > self._timeout:  # after a gap the votes on release begin anew
            for brake in state.brakes:
                brake.release_votes = 0
            since = self._timeout if since < math.inf else period
        source.period = period = since if period == math.inf else period + SMOOTHING * (since - period)
        if not self._from <= period <= self._to:
            self._learn(period)
        trigger, release = self._quorums
        if looks:
            state.cloud_looks = {**state.cloud_looks, **dict.fromkeys(looks, frame.stamp)}
        state.criterion = criterion
        state.evaluation = evaluation
        state.rests_in_contact = rests
        state.unseen = unseen
        others = 0
        if other.voted_at >= frame.now - self._timeout:
            others, _ = self._release.quorum(other.period)
        if without is not None:
            if state.brake_without_estimates is None:
                state.brake_without_estimates = replace(state.brake)
            state.brake_without_estimates.vote(frame.now, *without[2:5], trigger, release, self._hold, others)
        state.brake.vote(frame.now, triggers, clear, motion, trigger, release, self._hold, others)
