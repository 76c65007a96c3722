"""From what a controller remembers to a decision: the command, and the one reason for it. Nothing here changes it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ttc_fast.brake.decision import Command, Counters, Decision, Reason
from ttc_fast.brake.frame import CLOCK_TOLERANCE
from ttc_fast.brake.types import new
from ttc_fast.status import Status

if TYPE_CHECKING:
    from ttc_fast.brake.settings import BrakeSettings
    from ttc_fast.brake.state import ControllerState
    from ttc_fast.brake.types import Threats

NONE, WARN, BRAKE = Command  # a name is looked up faster than the member of an enumeration
CONTACT = Status.CONTACT
CLEAR, NEAR, VOTING, CRITERION, UNSEEN = Reason.CLEAR, Reason.NEAR, Reason.VOTING, Reason.CRITERION, Reason.UNSEEN


def watchdog(state: ControllerState, settings: BrakeSettings, now: float) -> Reason | None:
    """Return why the sensors do not see enough to be safe, or None if they do."""
    scans, clouds = state.scans, state.clouds
    latest, oldest = now + CLOCK_TOLERANCE, now - settings.sensor_timeout
    if scans.newest_at > latest or clouds.newest_at > latest:  # the clock was set back: how old it is, is not known
        return Reason.STALE
    if scans.voted_at >= oldest or clouds.voted_at >= oldest:  # a frame that was evaluated was seen as well
        return None
    newest_at = max(scans.newest_at, clouds.newest_at)
    if newest_at == -math.inf:
        return Reason.WAITING
    if newest_at < oldest or scans.held[-1] or clouds.held[-1]:
        return Reason.STALE
    return Reason.BLIND if max(scans.seen_at, clouds.seen_at) < oldest else Reason.NO_MOTION


def decide(
    state: ControllerState,
    settings: BrakeSettings,
    now: float,
    unsafe: Reason | None,
    override: bool,
    status: Status | None,
    threats: Threats | None,
) -> Decision:
    """Return the decision.

    Parameters
    ----------
    state : ControllerState
        What the controller remembers.
    settings : BrakeSettings
        Its settings.
    now : float
        The time of the decision, s.
    unsafe : Reason or None
        The answer of ``watchdog``.
    override : bool
        Whether the driver took over.
    status, threats
        Status and threats of the frame that came, as ``Decision`` has them.
    """
    brake, without = state.brake, state.brake_without_estimates
    braking = brake.on or (without is not None and without.on)  # an estimate can only add
    criterion, evaluation, rests_in_contact, is_unseen = state.found
    value, threshold, threat = evaluation
    deceleration, limit = 0.0, math.inf
    command = BRAKE if braking else WARN
    if override:
        command, reason = NONE, Reason.OVERRIDE
    elif unsafe is not None:
        reason = unsafe
    elif value < threshold:
        reason = CRITERION if braking else VOTING
    elif is_unseen:
        reason = UNSEEN
    elif braking:
        reason = Reason.STANDSTILL if stands(state, settings, now) else Reason.HOLD
    elif value < settings.warn_at * threshold:
        reason = NEAR
    elif rests_in_contact:
        reason = Reason.CONTACT
    else:
        command, reason = NONE, Reason.ESCAPE if threat is not None and threat.status is CONTACT else CLEAR
    if command is BRAKE:
        deceleration, limit = settings.deceleration, 0.0
    elif command is WARN:
        if threat is not None and threshold > 0.0 and value < math.inf:
            limit = abs(threat.closing_speed) * value / threshold
        if reason is UNSEEN and settings.creep_speed > 0.0:
            limit = min(limit, settings.creep_speed)
    triggered, clear = brake.trigger_votes.bit_count(), brake.release_votes.bit_count()
    counters = new(Counters, (state.frames, state.ignored, state.blind, triggered, clear))
    return new(
        Decision,
        (
            command,
            reason,
            deceleration,
            limit,
            criterion,
            value,
            threshold,
            threat,
            now,
            counters,
            status,
            threats,
        ),
    )


def stands(state: ControllerState, settings: BrakeSettings, now: float) -> bool:
    """Return whether the vehicle surely stands."""
    motion, motion_at, _, _ = state.newest
    fresh = -CLOCK_TOLERANCE <= now - motion_at <= settings.motion_timeout
    return motion is not None and fresh and abs(motion.speed) < settings.standstill_speed
