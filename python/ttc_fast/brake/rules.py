"""The settings by which a controller turns what criteria say into commands."""

from __future__ import annotations

from typing import Any

from ttc_fast.brake.arguments import above_zero, at_least, count, not_negative
from ttc_fast.brake.command import Command
from ttc_fast.brake.votes import VoteRule


class Rules:
    """Checked settings, as ``BrakeController`` takes them.

    Parameters
    ----------
    trigger, release, warn_at, release_at, hold, deceleration, standstill_speed, sensor_timeout, motion_timeout
        See ``BrakeController``.
    min_returns, when_blind
        Likewise.
    """

    __slots__ = (
        "brakes_blind",
        "deceleration",
        "hold",
        "min_returns",
        "motion_timeout",
        "release",
        "release_at",
        "sensor_timeout",
        "standstill_speed",
        "trigger",
        "warn_at",
    )

    def __init__(
        self,
        *,
        trigger: Any,
        release: Any,
        warn_at: Any,
        release_at: Any,
        hold: Any,
        deceleration: Any,
        standstill_speed: Any,
        sensor_timeout: Any,
        motion_timeout: Any,
        min_returns: Any,
        when_blind: Any,
    ) -> None:
        self.trigger = VoteRule("trigger", trigger)
        self.release = VoteRule("release", release)
        self.warn_at = at_least("warn_at", warn_at, 1.0, "it multiplies the thresholds at which it brakes")
        self.release_at = at_least("release_at", release_at, 1.0, "below 1 it would let go while a criterion triggers")
        self.hold = not_negative("hold", hold, "s")
        self.deceleration = above_zero("deceleration", deceleration, "m/s^2")
        self.standstill_speed = not_negative("standstill_speed", standstill_speed, "m/s")
        self.sensor_timeout = above_zero("sensor_timeout", sensor_timeout, "s")
        self.motion_timeout = above_zero("motion_timeout", motion_timeout, "s")
        self.min_returns = count("min_returns", min_returns)
        if when_blind not in (Command.WARN, Command.BRAKE):
            raise ValueError(f"when_blind must be Command.WARN or Command.BRAKE, got {when_blind!r}: blind is not safe")
        self.brakes_blind = when_blind == Command.BRAKE
