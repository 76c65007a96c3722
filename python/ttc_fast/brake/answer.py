"""From what a controller remembers to what it says: the command, and the one reason for it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ttc_fast.brake.command import Command, Counters, Decision, Reason
from ttc_fast.brake.memory import CLOCK_TOLERANCE
from ttc_fast.status import Status

if TYPE_CHECKING:
    from ttc_fast.brake.memory import Memory
    from ttc_fast.brake.settings import BrakeSettings

NONE, WARN, BRAKE = Command  # the look-up of an enum's member takes longer than that of a name
CONTACT = Status.CONTACT
CLEAR, NEAR, CRITERION = Reason.CLEAR, Reason.NEAR, Reason.CRITERION


def answer(memory: Memory, rules: BrakeSettings, now: float, unsafe: Reason | None, override: bool) -> Decision:
    """Put the command and its reason together.

    Parameters
    ----------
    memory : Memory
        What is known.
    rules : BrakeSettings
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
        command, reason = (BRAKE if memory.braking else WARN), unsafe
    elif memory.braking:
        command, reason = BRAKE, why_braking(memory, rules, now)
    else:
        command, reason = why_not_braking(memory, rules)
    value, threshold, sight = memory.judgement
    counters = Counters(
        memory.frames, memory.ignored, memory.blind, memory.triggers.bit_count(), memory.clears.bit_count()
    )
    deceleration, limit = 0.0, math.inf
    if command is BRAKE:
        deceleration, limit = rules.deceleration, 0.0
    elif command is WARN:
        limit = speed_limit(memory)
    return Decision(command, reason, deceleration, limit, memory.criterion, value, threshold, sight, now, counters)


def watch(memory: Memory, rules: BrakeSettings, now: float) -> Reason | None:
    """Return why what was seen is not enough to be safe, if so."""
    oldest = now - rules.sensor_timeout
    if memory.frame_at > now + CLOCK_TOLERANCE:  # the clock was set back: how old that frame is, nobody knows
        return Reason.STALE
    if memory.judged_at >= oldest:  # and so were the others
        return None
    if memory.frame_at == -math.inf:
        return Reason.WAITING
    if memory.frame_at < oldest:
        return Reason.STALE
    return Reason.BLIND if memory.seen_at < oldest else Reason.NO_MOTION


def why_braking(memory: Memory, rules: BrakeSettings, now: float) -> Reason:
    """Return why it brakes."""
    value, threshold, _ = memory.judgement
    if value < threshold:
        return CRITERION
    motion = memory.fresh_motion(now, rules.motion_timeout)
    stands = motion is not None and abs(motion.speed) < rules.standstill_speed
    return Reason.STANDSTILL if stands else Reason.HOLD


def why_not_braking(memory: Memory, rules: BrakeSettings) -> tuple[Command, Reason]:
    """Return what there is to say where it does not brake, and why."""
    value, threshold, sight = memory.judgement
    if value < rules.warn_at * threshold:
        return WARN, (Reason.VOTING if value < threshold else NEAR)
    if memory.rests_in_contact:
        return WARN, Reason.CONTACT
    in_contact = sight is not None and sight.status is CONTACT
    return NONE, (Reason.ESCAPE if in_contact else CLEAR)


def speed_limit(memory: Memory) -> float:
    """Return the speed at which the criterion would brake, were all else the same."""
    value, threshold, sight = memory.judgement
    if sight is None or not (threshold > 0.0 and value < math.inf):
        return math.inf
    return abs(sight.closing_speed) * value / threshold
