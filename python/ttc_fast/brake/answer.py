"""From what a controller remembers to what it says: the command, and the one reason for it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ttc_fast.brake.command import Command, Counters, Decision, Reason
from ttc_fast.brake.memory import CLOCK_TOLERANCE
from ttc_fast.status import Status

if TYPE_CHECKING:
    from ttc_fast.brake.memory import ControllerState
    from ttc_fast.brake.settings import BrakeSettings

NONE, WARN, BRAKE = Command  # the look-up of an enum's member takes longer than that of a name
CONTACT = Status.CONTACT
CLEAR, NEAR, CRITERION = Reason.CLEAR, Reason.NEAR, Reason.CRITERION


def decide(
    state: ControllerState, settings: BrakeSettings, now: float, unsafe: Reason | None, override: bool
) -> Decision:
    """Put the command and its reason together.

    Parameters
    ----------
    state : ControllerState
        What is known.
    settings : BrakeSettings
        Of the controller.
    now : float
        s.
    unsafe : Reason or None
        Why what was seen is not enough, if so.
    override : bool
        Whether the driver took over.
    """
    if override:
        command, reason = NONE, Reason.OVERRIDE
    elif unsafe is not None:
        command, reason = (BRAKE if state.braking else WARN), unsafe
    elif state.braking:
        command, reason = BRAKE, why_braking(state, settings, now)
    else:
        command, reason = why_not_braking(state, settings)
    value, threshold, threat = state.evaluation
    counters = Counters(state.frames, state.ignored, state.blind, state.triggers.bit_count(), state.clears.bit_count())
    deceleration, limit = 0.0, math.inf
    if command is BRAKE:
        deceleration, limit = settings.deceleration, 0.0
    elif command is WARN:
        limit = speed_limit(state)
    return Decision(command, reason, deceleration, limit, state.criterion, value, threshold, threat, now, counters)


def watchdog(state: ControllerState, settings: BrakeSettings, now: float) -> Reason | None:
    """Return why what was seen is not enough to be safe, if so."""
    oldest = now - settings.sensor_timeout
    if state.frame_at > now + CLOCK_TOLERANCE:  # the clock was set back: how old that frame is, nobody knows
        return Reason.STALE
    if state.judged_at >= oldest:  # and so were the others
        return None
    if state.frame_at == -math.inf:
        return Reason.WAITING
    if state.frame_at < oldest:
        return Reason.STALE
    return Reason.BLIND if state.seen_at < oldest else Reason.NO_MOTION


def why_braking(state: ControllerState, settings: BrakeSettings, now: float) -> Reason:
    """Return why it brakes."""
    value, threshold, _ = state.evaluation
    if value < threshold:
        return CRITERION
    motion = state.fresh_motion(now, settings.motion_timeout)
    stands = motion is not None and abs(motion.speed) < settings.standstill_speed
    return Reason.STANDSTILL if stands else Reason.HOLD


def why_not_braking(state: ControllerState, settings: BrakeSettings) -> tuple[Command, Reason]:
    """Return what there is to say where it does not brake, and why."""
    value, threshold, threat = state.evaluation
    if value < settings.warn_at * threshold:
        return WARN, (Reason.VOTING if value < threshold else NEAR)
    if state.rests_in_contact:
        return WARN, Reason.CONTACT
    in_contact = threat is not None and threat.status is CONTACT
    return NONE, (Reason.ESCAPE if in_contact else CLEAR)


def speed_limit(state: ControllerState) -> float:
    """Return the speed at which the criterion would brake, were all else the same."""
    value, threshold, threat = state.evaluation
    if threat is None or not (threshold > 0.0 and value < math.inf):
        return math.inf
    return abs(threat.closing_speed) * value / threshold
