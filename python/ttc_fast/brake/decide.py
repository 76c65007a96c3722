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
CLEAR, NEAR, CRITERION, UNSEEN = Reason.CLEAR, Reason.NEAR, Reason.CRITERION, Reason.UNSEEN


def watchdog(state: ControllerState, settings: BrakeSettings, now: float) -> Reason | None:
    """Return why the sensors do not see enough to be safe, or None if they do."""
    scans, clouds = state.scans, state.clouds
    newest_at = scans.newest_at if scans.newest_at > clouds.newest_at else clouds.newest_at
    if newest_at > now + CLOCK_TOLERANCE:  # the clock was set back: the age of that frame is not known
        return Reason.STALE
    oldest = now - settings.sensor_timeout
    if scans.voted_at >= oldest or clouds.voted_at >= oldest:  # a frame that was evaluated was seen as well
        return None
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
    if override:
        command, reason = NONE, Reason.OVERRIDE
    elif unsafe is not None:
        command, reason = (BRAKE if braking else WARN), unsafe
    elif braking:
        command, reason = BRAKE, why_braking(state, settings, now)
    else:
        command, reason = why_not_braking(state, settings)
    deceleration, limit = 0.0, math.inf
    if command is BRAKE:
        deceleration, limit = settings.deceleration, 0.0
    elif command is WARN:
        limit = speed_limit(state)
        if reason is UNSEEN and settings.creep_speed > 0.0:
            limit = min(limit, settings.creep_speed)
    triggered, clear = brake.trigger_votes.bit_count(), brake.release_votes.bit_count()
    counters = new(Counters, (state.frames, state.ignored, state.blind, triggered, clear))
    value, threshold, threat = state.evaluation
    return new(
        Decision,
        (
            command,
            reason,
            deceleration,
            limit,
            state.criterion,
            value,
            threshold,
            threat,
            now,
            counters,
            status,
            threats,
        ),
    )


def why_braking(state: ControllerState, settings: BrakeSettings, now: float) -> Reason:
    """Return why the controller brakes."""
    value, threshold, _ = state.evaluation
    if value < threshold:
        return CRITERION
    if state.unseen:
        return UNSEEN
    motion, fresh = state.motion, -CLOCK_TOLERANCE <= now - state.motion_at <= settings.motion_timeout
    stands = motion is not None and fresh and abs(motion.speed) < settings.standstill_speed
    return Reason.STANDSTILL if stands else Reason.HOLD


def why_not_braking(state: ControllerState, settings: BrakeSettings) -> tuple[Command, Reason]:
    """Return the command and its reason where the controller does not brake."""
    value, threshold, threat = state.evaluation
    if value < threshold:
        return WARN, Reason.VOTING
    if state.unseen:
        return WARN, UNSEEN
    if value < settings.warn_at * threshold:
        return WARN, NEAR
    if state.rests_in_contact:
        return WARN, Reason.CONTACT
    in_contact = threat is not None and threat.status is CONTACT
    return NONE, (Reason.ESCAPE if in_contact else CLEAR)


def speed_limit(state: ControllerState) -> float:
    """Return the speed at which the criterion would brake if all else were the same, m/s."""
    value, threshold, threat = state.evaluation
    if threat is None or not (threshold > 0.0 and value < math.inf):
        return math.inf
    return abs(threat.closing_speed) * value / threshold
