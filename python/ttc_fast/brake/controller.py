"""From what the sensors see to a command, and why."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ttc_fast._validate import finite, flag
from ttc_fast.brake.answer import decide, watchdog
from ttc_fast.brake.command import Command
from ttc_fast.brake.criteria import EstimateThreshold, IttcThreshold, StoppingDistance, SweptPathThreshold
from ttc_fast.brake.eyes import Frame, ThreatAssessment
from ttc_fast.brake.inputs import checked_estimate, checked_motion, commanded_motion, several
from ttc_fast.brake.memory import CLOCK_TOLERANCE, ControllerState
from ttc_fast.brake.settings import BrakeSettings
from ttc_fast.brake.sight import Motion
from ttc_fast.brake.votes import NOfM
from ttc_fast.status import Status

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ttc_fast import RangeRate, ScanTTC, SweptPath
    from ttc_fast.brake.command import Decision
    from ttc_fast.brake.scene import Criterion, Evaluation, Threats
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
    An estimate (``estimate``) may add a brake and never takes one away.

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
    >>> print(decision.threat)
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
        self._settings = BrakeSettings(
            time_increment=time_increment,
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
        self._trigger, self._release = NOfM(trigger), NOfM(release)
        self._brakes_blind = when_blind == Command.BRAKE
        self._assessment = ThreatAssessment(scan, path, range_rate, time_increment, horizon)
        self._first, *self._others = self._assessment.check(criteria if criteria is not None else self._default())
        self._state = ControllerState()

    def _default(self) -> list[Criterion]:
        if self._assessment.only_estimates:
            return [EstimateThreshold(), StoppingDistance()]
        first: Criterion = SweptPathThreshold() if self._assessment.sees_path else IttcThreshold()
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
            An estimate.
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
        state, settings = self._state, self._settings
        commanded = None if commanded is None else commanded_motion(commanded)
        override = override if type(override) is bool else flag("override", override)
        if motion is not None:
            self._take(motion, now)
        if estimate is not None:
            estimate = checked_estimate(estimate)
            if not estimate.saw_nothing:
                state.estimate = estimate
        if ranges is not None or points is not None:
            if ranges is not None and (points is not None or getattr(ranges, "ndim", 1) != 1):
                raise several(ranges, points)
            opinion = state.fresh_estimate(now, settings.sensor_timeout)
            self._look(Frame(now, finite("stamp", stamp), ranges, points, opinion), commanded)
        elif estimate is not None and self._assessment.only_estimates:
            self._look(Frame(now, estimate.stamp, None, None, estimate), commanded)
        unsafe = watchdog(state, settings, now)
        if unsafe is not None and self._brakes_blind:
            state.brake(now, None)
        return decide(state, settings, now, unsafe, override)

    def _take(self, motion: Motion, now: float) -> None:
        """Remember the newest odometry."""
        motion = checked_motion("motion", motion)
        stamp = now if motion.stamp is None else motion.stamp
        if self._state.motion_at <= stamp <= now + CLOCK_TOLERANCE:
            self._state.motion = motion
            self._state.motion_at = stamp

    def _look(self, frame: Frame, commanded: Motion | None) -> None:
        """Judge a frame, count its votes, and begin or end braking."""
        state, settings = self._state, self._settings
        now, stamp = frame.now, frame.stamp
        if not state.frame_at < stamp <= now + CLOCK_TOLERANCE:
            state.ignored += 1
            return
        motion = state.fresh_motion(now, settings.motion_timeout)
        threats = self._assessment.assess(frame, motion)  # which raises for data that it cannot read: they do not count
        state.frames += 1
        state.frame_at = stamp
        if not self._sees(threats, stamp):
            state.clears = self._release.push(state.clears, False)
            return
        state.criterion, state.evaluation = self._worst(threats)
        state.rests_in_contact = False
        if threats.status is CONTACT:
            motion = self._in_contact(frame, motion, commanded)
        value, threshold, _ = state.evaluation
        clear = value >= settings.release_at * threshold
        if clear and state.braking:
            clear = self._would_be_clear(frame, motion, commanded)
        triggered = value < threshold
        state.triggers = self._trigger.push(state.triggers, triggered)
        state.clears = self._release.push(state.clears, clear)
        if triggered or state.braking:
            self._count(now, triggered, motion)

    def _sees(self, threats: Threats, stamp: float) -> bool:
        """Whether a frame is not blind and can be judged; remember when that was so."""
        state = self._state
        if threats.status is NO_DATA or threats.returns < self._settings.min_returns:
            state.blind += 1
            return False
        state.seen_at = stamp
        if threats.judged:
            state.judged_at = stamp
        return threats.judged

    def _in_contact(self, frame: Frame, motion: Motion | None, commanded: Motion | None) -> Motion | None:
        """Judge what is commanded as well, as long as nothing brakes yet; give the motion that decided."""
        state = self._state
        state.rests_in_contact = not (moves(motion) or moves(commanded))
        if commanded is None or state.braking:
            return motion
        criterion, evaluation = self._worst(self._assessment.assess_along(frame, commanded))
        if not evaluation.more_urgent_than(state.evaluation):
            return motion
        state.criterion, state.evaluation = criterion, evaluation
        return commanded

    def _count(self, now: float, triggered: bool, motion: Motion | None) -> None:
        """Begin or end braking when the votes carry."""
        state, settings = self._state, self._settings
        if triggered:
            if state.braking or self._trigger.reached(state.triggers):
                state.brake(now, motion)
        elif self._release.reached(state.clears) and now - state.triggered_at >= settings.hold:
            state.braking = False
            state.triggers = 0

    def _worst(self, threats: Threats) -> tuple[Criterion, Evaluation]:
        """Judge by every criterion: the one nearest to its threshold, or beyond it by most."""
        worst, says = self._first, self._first.evaluate(threats)
        for criterion in self._others:
            evaluation = criterion.evaluate(threats)
            if evaluation.more_urgent_than(says):
                worst, says = criterion, evaluation
        return worst, says

    def _would_be_clear(self, frame: Frame, motion: Motion | None, commanded: Motion | None) -> bool:
        """Whether a braked vehicle sees nothing on what it would go on with: being slow is not being safe."""
        if self._assessment.only_estimates:
            return True  # nobody knows what else would be estimated then
        continued = commanded if commanded is not None else self._continued_motion(motion)
        if continued is None:
            return True
        _, (value, threshold, _) = self._worst(self._assessment.assess_along(frame, continued))
        return value >= self._settings.release_at * threshold

    def _continued_motion(self, motion: Motion | None) -> Motion | None:
        """Return what a vehicle would go on with if it were released and nothing is commanded."""
        if motion is None:
            return None  # the range rate has judged what there is to judge
        before = self._state.braked_from
        if motion.speed == 0.0 or abs(motion.speed) < self._settings.standstill_speed:
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
        return {"controller": replace(self._state), "assessment": self._assessment.state()}

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
            restored = replace(state["controller"])
            self._assessment.restore(state["assessment"])
        except (KeyError, TypeError):
            raise TypeError("state must be what a BrakeController's state() returned") from None
        self._state = restored


def moves(motion: Motion | None) -> bool:
    """Whether a motion goes anywhere."""
    return motion is not None and any(motion[:3])
