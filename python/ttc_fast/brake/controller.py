"""From what the sensors see to a command, and why."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ttc_fast.brake.arguments import above_zero, at_least, finite, not_negative
from ttc_fast.brake.command import Command, Counters, Decision, Reason
from ttc_fast.brake.criteria import EstimateThreshold, IttcThreshold, StoppingDistance, SweptPathThreshold
from ttc_fast.brake.eyes import Eyes, Frame
from ttc_fast.brake.memory import Memory
from ttc_fast.brake.sight import STANDING, Estimate, Motion
from ttc_fast.brake.votes import VoteRule
from ttc_fast.status import Status

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ttc_fast import RangeRate, ScanTTC, SweptPath
    from ttc_fast.brake.criteria import Criterion, Judgement, Scene

CLOCK_TOLERANCE = 0.1
"""s: how far in the future a stamp may lie, because two clocks are never the same."""


class BrakeController:
    """Decides when to brake, and says why. No clock, no I/O: the same inputs give the same decisions, to the bit.

    Parameters
    ----------
    criteria : sequence of criteria, optional
        Any of them may trigger. By default ``SweptPathThreshold(1.5)`` and ``StoppingDistance()`` where there is an
        outline, else ``IttcThreshold(1.5)`` and ``StoppingDistance()``.
    scan : ScanTTC, optional
        How ``ranges`` are read. With an outline its beams are judged along the vehicle's path as well.
    path : SweptPath, optional
        How ``points`` are read. With neither ``scan`` nor ``path``, each ``estimate`` is a frame of its own, judged by
        ``EstimateThreshold(1.5)`` and ``StoppingDistance()``.
    range_rate : RangeRate, optional
        Tells closing speeds without odometry; sees each frame, so that it is warm when odometry fails.
    time_increment : float, default 0.0
        Between the beams of a scan, s, as in ``sensor_msgs/LaserScan``; each beam's own age is taken off its TTC.
    horizon : float, default 5.0
        How far ahead the path of ``scan`` looks, s; ``path`` has its own.
    trigger : (int, int), default (3, 4)
        N of M: how many of the last frames have to trigger before it brakes.
    release : (int, int), default (3, 5)
        N of M: how many of the last frames have to be clear before it lets go.
    warn_at : float, default 1.5
        Warns below this multiple of a criterion's threshold; at least 1.
    release_at : float, default 1.25
        A frame is clear at this multiple of every threshold, or more; at least 1.
    hold : float, default 0.5
        How long it brakes at least after the last frame that triggered, s.
    deceleration : float, default 6.0
        What to brake with, m/s^2, above 0: what a decision to brake asks for.
    standstill_speed : float, default 0.05
        Below it the vehicle stands, m/s. A braked vehicle that stands sees nothing come closer: it is released only
        when what it would go on with (``commanded``, else the motion it braked from) is clear.
    sensor_timeout : float, default 0.3
        The age from which sensor data are too old to be safe, s.
    motion_timeout : float, default 0.5
        The age from which odometry is not used any more, s.
    min_returns : int, default 0
        With fewer valid readings (``counts.valid``) a frame is blind. One without a valid reading always is.
    when_blind : Command, default Command.BRAKE
        What to do when sensor data are missing, too old or blind, or no closing speed can be told: BRAKE or WARN.

    Raises
    ------
    ValueError
        If a setting is refused.
    TypeError
        If a setting is of the wrong type.

    Notes
    -----
    A second opinion (``estimate``) may add a brake and never takes one away.

    Examples
    --------
    >>> import numpy as np
    >>> from ttc_fast import BrakeController, Motion, ScanTTC
    >>> scan = ScanTTC(-1.5, 0.1, 31, outline=(-0.1, 0.4, -0.15, 0.15))
    >>> controller = BrakeController(scan=scan)
    >>> wall = np.full(31, 6.0)
    >>> wall[14:17] = 3.0
    >>> for stamp in (0.0, 0.025, 0.05):
    ...     decision = controller.update(stamp + 0.02, ranges=wall, stamp=stamp, motion=Motion(4.0))
    >>> print(str(decision).split(";")[0])
    BRAKE (CRITERION): SweptPathThreshold: 0.63 < 1.5 s
    >>> print(decision.sight)
    return 15 at 3.00 m, 2.52 m clear, closing at 4.00 m/s, TTC 0.63 s
    """

    def __init__(
        self,
        criteria: Sequence[Criterion] | None = None,
        *,
        scan: ScanTTC | None = None,
        path: SweptPath | None = None,
        range_rate: RangeRate | None = None,
        time_increment: float = 0.0,
        horizon: float = 5.0,
        trigger: tuple[int, int] = (3, 4),
        release: tuple[int, int] = (3, 5),
        warn_at: float = 1.5,
        release_at: float = 1.25,
        hold: float = 0.5,
        deceleration: float = 6.0,
        standstill_speed: float = 0.05,
        sensor_timeout: float = 0.3,
        motion_timeout: float = 0.5,
        min_returns: int = 0,
        when_blind: Command = Command.BRAKE,
    ) -> None:
        self._eyes = Eyes(scan, path, range_rate, time_increment, horizon)
        self._criteria = self._eyes.check(criteria if criteria is not None else self._default())
        self._trigger = VoteRule("trigger", trigger)
        self._release = VoteRule("release", release)
        self._warn_at = at_least("warn_at", warn_at, 1.0, "it multiplies the thresholds at which it brakes")
        self._release_at = at_least("release_at", release_at, 1.0, "below 1 it would let go while a criterion triggers")
        self._hold = not_negative("hold", hold, "s")
        self._deceleration = above_zero("deceleration", deceleration, "m/s^2")
        self._standstill_speed = not_negative("standstill_speed", standstill_speed, "m/s")
        self._sensor_timeout = above_zero("sensor_timeout", sensor_timeout, "s")
        self._motion_timeout = above_zero("motion_timeout", motion_timeout, "s")
        self._min_returns = int(not_negative("min_returns", min_returns, "returns"))
        if when_blind not in (Command.WARN, Command.BRAKE):
            raise ValueError(f"when_blind must be Command.WARN or Command.BRAKE, got {when_blind!r}: blind is not safe")
        self._when_blind = Command(when_blind)
        self._memory = Memory()

    def _default(self) -> list[Criterion]:
        if self._eyes.only_estimates:
            return [EstimateThreshold(), StoppingDistance()]
        first: Criterion = SweptPathThreshold() if self._eyes.sees_path else IttcThreshold()
        return [first, StoppingDistance()]

    def update(
        self,
        now: float,
        *,
        ranges: Any = None,
        points: Any = None,
        stamp: float | None = None,
        motion: Motion | None = None,
        estimate: Estimate | None = None,
        commanded: Motion | float | None = None,
        override: bool = False,
    ) -> Decision:
        """Decide, with whatever is new.

        Call it for each frame, and between frames as often as the watchdog is to look. What is not given stays as it
        was, and ages.

        Parameters
        ----------
        now : float
            The time, s, of the clock of all stamps.
        ranges : ndarray, shape (beams,), optional
            A scan, as ``scan`` reads it, m.
        points : array_like, shape (N, 2 or more), optional
            A cloud in the vehicle's frame, as ``path`` reads it, m.
        stamp : float, optional
            When they were measured, s: of a scan's first beam. Needed with either. Frames whose stamp is not newer than
            the last one's, or lies more than 0.1 s in the future, are counted and ignored.
        motion : Motion, optional
            Odometry.
        estimate : Estimate, optional
            A second opinion.
        commanded : Motion or float, optional
            What the vehicle would do if it were not braked; a float is its speed, straight ahead.
        override : bool, default False
            The driver took over: no command, as long as this is given.

        Returns
        -------
        Decision

        Raises
        ------
        ValueError
            If a number is not finite, or there are data without a stamp or without anything that reads them.
        TypeError
            If an argument is of the wrong type.

        Examples
        --------
        >>> from ttc_fast import BrakeController, ScanTTC
        >>> controller = BrakeController(scan=ScanTTC(0.0, 0.1, 3))
        >>> print(controller.update(10.0))                       # nothing has come yet: that is not safe
        BRAKE (WAITING)
        """
        now = finite("now", now)
        if motion is not None:
            self._take(motion, now)
        if estimate is not None:
            self._memory.estimate = Estimate(*estimate)
        if ranges is not None or points is not None:
            self._look(Frame(now, finite("stamp", stamp), ranges, points, self._fresh_estimate(now)), commanded)
        elif estimate is not None and self._eyes.only_estimates:
            self._look(Frame(now, finite("estimate.stamp", estimate.stamp), None, None, estimate), commanded)
        return self._answer(now, override)

    def _take(self, motion: Motion, now: float) -> None:
        """Remember the newest odometry."""
        speed, yaw_rate, lateral_speed, stamp = motion
        stamp = now if stamp is None else finite("motion.stamp", stamp)
        if not math.isfinite(speed + yaw_rate + lateral_speed):
            for name, value in (("speed", speed), ("yaw_rate", yaw_rate), ("lateral_speed", lateral_speed)):
                finite(f"motion.{name}", value)
        if self._memory.motion_at <= stamp <= now + CLOCK_TOLERANCE:
            self._memory.motion = Motion(speed, yaw_rate, lateral_speed, stamp)
            self._memory.motion_at = stamp

    def _look(self, frame: Frame, commanded: Motion | float | None) -> None:
        """Judge a frame, count its votes, and begin or end braking."""
        memory = self._memory
        if not memory.frame_at < frame.stamp <= frame.now + CLOCK_TOLERANCE:
            memory.ignored += 1
            return
        memory.frames += 1
        memory.frame_at = frame.stamp
        motion = self._fresh_motion(frame.now)
        scene = self._eyes.look(frame, motion)
        blind = scene.status is Status.NO_DATA or scene.returns < self._min_returns
        if blind:
            memory.blind += 1
        else:
            memory.seen_at = frame.stamp
        if blind or not scene.judged:
            memory.clears = self._release.cast(memory.clears, False)
            return
        memory.judged_at = frame.stamp
        memory.criterion, memory.judgement = self._worst(scene)
        clear = self._is_clear(memory.judgement)
        if clear and memory.braking:
            clear = self._would_be_clear(frame, motion, commanded)
        self._vote(frame.now, triggered=memory.judgement.triggers, clear=clear, motion=motion)

    def _vote(self, now: float, *, triggered: bool, clear: bool, motion: Motion | None) -> None:
        """Count the votes of a frame, and begin or end braking when they carry."""
        memory = self._memory
        memory.triggers = self._trigger.cast(memory.triggers, triggered)
        memory.clears = self._release.cast(memory.clears, clear)
        if triggered and (memory.braking or self._trigger.carried(memory.triggers)):
            self._brake(now, motion)
        elif memory.braking and self._release.carried(memory.clears) and now - memory.triggered_at >= self._hold:
            memory.braking = False
            memory.triggers = 0

    def _brake(self, now: float, motion: Motion | None) -> None:
        """Begin to brake, or begin the hold time again."""
        memory = self._memory
        memory.triggered_at = now
        memory.clears = 0
        if not memory.braking:
            memory.braking = True
            memory.braked_from = motion or memory.motion or STANDING

    def _worst(self, scene: Scene) -> tuple[Criterion, Judgement]:
        """Judge by every criterion: the one nearest to its threshold, or beyond it by most."""
        worst, says = self._criteria[0], self._criteria[0].judge(scene)
        for criterion in self._criteria[1:]:
            judgement = criterion.judge(scene)
            if judgement.tighter(says):
                worst, says = criterion, judgement
        return worst, says

    def _is_clear(self, judgement: Judgement) -> bool:
        return judgement.value >= self._release_at * judgement.threshold

    def _would_be_clear(self, frame: Frame, motion: Motion | None, commanded: Motion | float | None) -> bool:
        """Whether a braked vehicle sees nothing on what it would go on with: being slow is not being safe."""
        onward = self._onward(motion, commanded)
        return onward is None or self._is_clear(self._worst(self._eyes.look_along(frame, onward))[1])

    def _onward(self, motion: Motion | None, commanded: Motion | float | None) -> Motion | None:
        """Return what a vehicle would go on with if it were released."""
        if commanded is not None:
            return commanded if isinstance(commanded, Motion) else Motion(finite("commanded", commanded))
        if motion is None:
            return None  # the range rate has judged what there is to judge
        before = self._memory.braked_from
        if motion.speed == 0.0 or abs(motion.speed) < self._standstill_speed:
            return before
        faster = max(abs(before.speed / motion.speed), 1.0)  # the way it is on, at the speed it braked from
        return Motion(motion.speed * faster, motion.yaw_rate * faster, motion.lateral_speed * faster)

    def _fresh_motion(self, now: float) -> Motion | None:
        return self._memory.motion if now - self._memory.motion_at <= self._motion_timeout else None

    def _watch(self, now: float) -> Reason | None:
        """Return why what was seen is not enough to be safe, if so."""
        memory = self._memory
        if memory.frame_at == -math.inf:
            return Reason.WAITING
        oldest = now - self._sensor_timeout
        if memory.frame_at < oldest:
            return Reason.STALE
        if memory.seen_at < oldest:
            return Reason.BLIND
        return Reason.NO_MOTION if memory.judged_at < oldest else None

    def _answer(self, now: float, override: bool) -> Decision:
        """Put the command and its reason together."""
        memory = self._memory
        unsafe = self._watch(now)
        if unsafe is not None and self._when_blind is Command.BRAKE:
            self._brake(now, None)
        if override:
            command, reason = Command.NONE, Reason.OVERRIDE
        elif unsafe is not None:
            command, reason = (Command.BRAKE if memory.braking else Command.WARN), unsafe
        elif memory.braking:
            command, reason = Command.BRAKE, self._why_braking(now)
        else:
            command, reason = self._why_not_braking()
        judged = memory.judgement
        return Decision(
            command,
            reason,
            self._deceleration if command is Command.BRAKE else 0.0,
            self._speed_limit(command),
            memory.criterion,
            judged.value,
            judged.threshold,
            judged.sight,
            now,
            Counters(
                memory.frames, memory.ignored, memory.blind, memory.triggers.bit_count(), memory.clears.bit_count()
            ),
        )

    def _why_braking(self, now: float) -> Reason:
        if self._memory.judgement.triggers:
            return Reason.CRITERION
        motion = self._fresh_motion(now)
        stands = motion is not None and abs(motion.speed) < self._standstill_speed
        return Reason.STANDSTILL if stands else Reason.HOLD

    def _why_not_braking(self) -> tuple[Command, Reason]:
        judged = self._memory.judgement
        if judged.triggers:
            return Command.WARN, Reason.VOTING
        if judged.value < self._warn_at * judged.threshold:
            return Command.WARN, Reason.NEAR
        in_contact = judged.sight is not None and judged.sight.status is Status.CONTACT
        return Command.NONE, Reason.ESCAPE if in_contact else Reason.CLEAR

    def _speed_limit(self, command: Command) -> float:
        """Return the speed at which the criterion would brake, were all else the same."""
        judged = self._memory.judgement
        if command is Command.BRAKE:
            return 0.0
        if command is Command.NONE or judged.sight is None or not judged.threshold > 0.0:
            return math.inf
        return abs(judged.sight.closing_speed) * judged.value / judged.threshold

    def _fresh_estimate(self, now: float) -> Estimate | None:
        estimate = self._memory.estimate
        return estimate if estimate is not None and now - estimate.stamp <= self._sensor_timeout else None

    def state(self) -> dict[str, Any]:
        """Return everything remembered, to go on from later.

        Returns
        -------
        dict
            Of plain values and named tuples, which pickle.

        Examples
        --------
        >>> from ttc_fast import BrakeController, ScanTTC
        >>> controller = BrakeController(scan=ScanTTC(0.0, 0.1, 3))
        >>> state = controller.state()
        >>> controller.restore(state)
        """
        return {"memory": replace(self._memory), "eyes": self._eyes.state()}

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a state: a controller of the same settings then decides as the saved one would have.

        Parameters
        ----------
        state : dict
            From ``state``.

        Returns
        -------
        None

        Raises
        ------
        TypeError
            If it is no such state.

        Examples
        --------
        >>> from ttc_fast import BrakeController, ScanTTC
        >>> controller = BrakeController(scan=ScanTTC(0.0, 0.1, 3))
        >>> controller.restore(controller.state())
        """
        try:
            memory = replace(state["memory"])
            self._eyes.restore(state["eyes"])
        except (KeyError, TypeError):
            raise TypeError("state must be what a BrakeController's state() returned") from None
        self._memory = memory
