"""From what the sensors see to a command, and why."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ttc_fast._validate import finite, flag
from ttc_fast.brake.answer import answer, watch
from ttc_fast.brake.command import Command
from ttc_fast.brake.criteria import EstimateThreshold, IttcThreshold, StoppingDistance, SweptPathThreshold
from ttc_fast.brake.eyes import Eyes, Frame
from ttc_fast.brake.inputs import checked_estimate, checked_motion, several, wish_of
from ttc_fast.brake.memory import CLOCK_TOLERANCE, Memory
from ttc_fast.brake.settings import BrakeSettings
from ttc_fast.brake.sight import Motion
from ttc_fast.brake.votes import VoteRule
from ttc_fast.status import Status

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ttc_fast import RangeRate, ScanTTC, SweptPath
    from ttc_fast.brake.command import Decision
    from ttc_fast.brake.scene import Criterion, Judgement, Scene
    from ttc_fast.brake.sight import Estimate

NO_DATA, CONTACT = Status.NO_DATA, Status.CONTACT  # the look-up of an enum's member takes longer than that of a name


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
        self._rules = BrakeSettings(
            horizon=horizon,
            trigger=trigger,
            release=release,
            warn_at=warn_at,
            release_at=release_at,
            hold=hold,
            deceleration=deceleration,
            standstill_speed=standstill_speed,
            sensor_timeout=sensor_timeout,
            motion_timeout=motion_timeout,
            min_returns=min_returns,
            when_blind=when_blind,
        )
        self._trigger, self._release = VoteRule(trigger), VoteRule(release)
        self._brakes_blind = when_blind == Command.BRAKE
        self._eyes = Eyes(scan, path, range_rate, time_increment, horizon)
        self._first, *self._others = self._eyes.check(criteria if criteria is not None else self._default())
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
        memory, rules = self._memory, self._rules
        wish = None if commanded is None else wish_of(commanded)
        override = override if type(override) is bool else flag("override", override)
        if motion is not None:
            self._take(motion, now)
        if estimate is not None:
            estimate = checked_estimate(estimate)
            if not estimate.saw_nothing:
                memory.estimate = estimate
        if ranges is not None or points is not None:
            if ranges is not None and (points is not None or getattr(ranges, "ndim", 1) != 1):
                raise several(ranges, points)
            opinion = memory.fresh_estimate(now, rules.sensor_timeout)
            self._look(Frame(now, finite("stamp", stamp), ranges, points, opinion), wish)
        elif estimate is not None and self._eyes.only_estimates:
            self._look(Frame(now, estimate.stamp, None, None, estimate), wish)
        unsafe = watch(memory, rules, now)
        if unsafe is not None and self._brakes_blind:
            memory.brake(now, None)
        return answer(memory, rules, now, unsafe, override)

    def _take(self, motion: Motion, now: float) -> None:
        """Remember the newest odometry."""
        motion = checked_motion("motion", motion)
        stamp = now if motion.stamp is None else motion.stamp
        if self._memory.motion_at <= stamp <= now + CLOCK_TOLERANCE:
            self._memory.motion = motion
            self._memory.motion_at = stamp

    def _look(self, frame: Frame, wish: Motion | None) -> None:
        """Judge a frame, count its votes, and begin or end braking."""
        memory, rules = self._memory, self._rules
        now, stamp = frame.now, frame.stamp
        if not memory.frame_at < stamp <= now + CLOCK_TOLERANCE:
            memory.ignored += 1
            return
        motion = memory.fresh_motion(now, rules.motion_timeout)
        scene = self._eyes.look(frame, motion)  # which raises for data that it cannot read: they do not count
        memory.frames += 1
        memory.frame_at = stamp
        if not self._sees(scene, stamp):
            memory.clears = self._release.cast(memory.clears, False)
            return
        memory.criterion, memory.judgement = self._worst(scene)
        memory.rests_in_contact = False
        if scene.status is CONTACT:
            motion = self._in_contact(frame, motion, wish)
        value, threshold, _ = memory.judgement
        clear = value >= rules.release_at * threshold
        if clear and memory.braking:
            clear = self._would_be_clear(frame, motion, wish)
        triggered = value < threshold
        memory.triggers = self._trigger.cast(memory.triggers, triggered)
        memory.clears = self._release.cast(memory.clears, clear)
        if triggered or memory.braking:
            self._count(now, triggered, motion)

    def _sees(self, scene: Scene, stamp: float) -> bool:
        """Whether a frame is not blind and can be judged; remember when that was so."""
        memory = self._memory
        if scene.status is NO_DATA or scene.returns < self._rules.min_returns:
            memory.blind += 1
            return False
        memory.seen_at = stamp
        if scene.judged:
            memory.judged_at = stamp
        return scene.judged

    def _in_contact(self, frame: Frame, motion: Motion | None, wish: Motion | None) -> Motion | None:
        """Judge what is commanded as well, as long as nothing brakes yet; give the motion that decided."""
        memory = self._memory
        memory.rests_in_contact = not (moves(motion) or moves(wish))
        if wish is None or memory.braking:
            return motion
        criterion, judgement = self._worst(self._eyes.look_along(frame, wish))
        if not judgement.tighter(memory.judgement):
            return motion
        memory.criterion, memory.judgement = criterion, judgement
        return wish

    def _count(self, now: float, triggered: bool, motion: Motion | None) -> None:
        """Begin or end braking when the votes carry."""
        memory, rules = self._memory, self._rules
        if triggered:
            if memory.braking or self._trigger.carried(memory.triggers):
                memory.brake(now, motion)
        elif self._release.carried(memory.clears) and now - memory.triggered_at >= rules.hold:
            memory.braking = False
            memory.triggers = 0

    def _worst(self, scene: Scene) -> tuple[Criterion, Judgement]:
        """Judge by every criterion: the one nearest to its threshold, or beyond it by most."""
        worst, says = self._first, self._first.judge(scene)
        for criterion in self._others:
            judgement = criterion.judge(scene)
            if judgement.tighter(says):
                worst, says = criterion, judgement
        return worst, says

    def _would_be_clear(self, frame: Frame, motion: Motion | None, wish: Motion | None) -> bool:
        """Whether a braked vehicle sees nothing on what it would go on with: being slow is not being safe."""
        if self._eyes.only_estimates:
            return True  # nobody knows what else would be estimated then
        onward = wish if wish is not None else self._onward(motion)
        if onward is None:
            return True
        _, (value, threshold, _) = self._worst(self._eyes.look_along(frame, onward))
        return value >= self._rules.release_at * threshold

    def _onward(self, motion: Motion | None) -> Motion | None:
        """Return what a vehicle would go on with if it were released and nothing is commanded."""
        if motion is None:
            return None  # the range rate has judged what there is to judge
        before = self._memory.braked_from
        if motion.speed == 0.0 or abs(motion.speed) < self._rules.standstill_speed:
            return before
        faster = max(abs(before.speed / motion.speed), 1.0)  # the way it is on, at the speed it braked from
        return Motion(motion.speed * faster, motion.yaw_rate * faster, motion.lateral_speed * faster)

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


def moves(motion: Motion | None) -> bool:
    """Whether a motion goes anywhere."""
    return motion is not None and any(motion[:3])
