"""The third step of a decision: how the vote of a frame changes what is remembered."""

from __future__ import annotations

import functools
import math
from dataclasses import replace
from typing import TYPE_CHECKING

from ttc_fast._validate import votes
from ttc_fast.status import Status

if TYPE_CHECKING:
    from ttc_fast.brake.evaluate import Vote
    from ttc_fast.brake.frame import Frame
    from ttc_fast.brake.settings import BrakeSettings
    from ttc_fast.brake.state import Brake, ControllerState, Held, Newest, Quorum, Source

NO_DATA, STALE = Status.NO_DATA, Status.STALE
SMOOTHING = 0.25
"""The weight of the newest time between two frames in the usual one."""


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

    def vote(
        self,
        state: ControllerState,
        newest: Newest,
        frame: Frame,
        status: Status,
        held: Held | None,
        vote: Vote | None,
        without: Vote | None,
    ) -> None:
        """Remember what came, count the two votes of a frame, and begin or end braking.

        ``status`` and what follows is what ``Evaluator.assess`` returned.
        """
        state.newest = newest
        if held is None:
            state.ignored += 1
            return
        state.frames += 1
        if frame.is_cloud is not state.is_cloud:
            state.is_cloud = frame.is_cloud
            for brake in state.brakes:
                brake.turn()
        source, stamp = frame.source, frame.stamp
        if held[0] is not source.held[0]:
            source.held_before = source.held
        source.newest_at, source.held = stamp, held
        if vote is None:
            self._not_evaluated(state, source, stamp, status, held)
            return
        since, period = stamp - source.voted_at, source.period
        source.seen_at = source.voted_at = stamp
        if since > self._timeout:  # after a gap the votes on release begin anew
            for brake in state.brakes:
                brake.release_votes = 0
            since = self._timeout if since < math.inf else period
        source.period = period = since if period == math.inf else period + SMOOTHING * (since - period)
        if not self._from <= period <= self._to:
            self._learn(period)
        state.found, triggers, clear, motion, looks = vote
        if looks:
            state.cloud_looks = {**state.cloud_looks, **dict.fromkeys(looks, stamp)}
        trigger, release = self._quorums
        if without is not None:
            alone = state.brake_without_estimates
            if alone is None:
                alone = state.brake_without_estimates = replace(state.brake)
            _, its_trigger, its_clear, its_motion, _ = without
            if alone.vote(frame.now, its_trigger, its_clear, its_motion, trigger, release, self._hold):
                self._let_go(alone, state, frame)
        if state.brake.vote(frame.now, triggers, clear, motion, trigger, release, self._hold):
            self._let_go(state.brake, state, frame)

    def _let_go(self, brake: Brake, state: ControllerState, frame: Frame) -> None:
        """End braking, if the frames of the other kind are clear as well, where there are any; the newest has to be."""
        other = state.scans if frame.is_cloud else state.clouds
        if other.voted_at >= frame.now - self._timeout:
            needed, _ = self._release.quorum(other.period)
            votes = brake.other_release_votes
            if not votes & 1 or votes.bit_count() < needed:
                return
        brake.on, brake.trigger_votes, brake.other_trigger_votes = False, 0, 0

    def _not_evaluated(self, state: ControllerState, source: Source, stamp: float, status: Status, held: Held) -> None:
        """Remember a frame that cannot be evaluated. It is not clear."""
        if status is NO_DATA:
            state.blind += 1
        elif status is STALE:  # as if nothing had come since the readings were new
            source.seen_at = source.voted_at = min(source.voted_at, held[1])
        else:
            source.seen_at = stamp
        _, counts = self._release.quorum(source.period)
        for brake in state.brakes:
            brake.release_votes = brake.release_votes << 1 & counts
