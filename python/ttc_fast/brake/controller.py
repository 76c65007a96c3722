"""From what the sensors see to a command, and why: receive, assess, vote, decide."""

from __future__ import annotations

import copy
import math
import threading
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

from ttc_fast._core import ScanTTC
from ttc_fast._validate import finite, flag
from ttc_fast.brake.criteria import (
    EstimateThreshold,
    IttcThreshold,
    PresentArc,
    StoppingDistance,
    SweptPathThreshold,
)
from ttc_fast.brake.decide import decide, watchdog
from ttc_fast.brake.decision import Command
from ttc_fast.brake.settings import BETWEEN_BEAMS, BrakeSettings
from ttc_fast.brake.state import (
    CLOCK_TOLERANCE,
    Brake,
    ControllerState,
    NOfM,
    checked_commanded,
    checked_estimate,
    checked_motion,
    is_fresh,
)
from ttc_fast.brake.threats import Frame, ThreatAssessment
from ttc_fast.brake.types import NOTHING, STANDING, Motion
from ttc_fast.brake.unseen import FieldsOfView
from ttc_fast.status import Status

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ttc_fast import RangeRate, SweptPath
    from ttc_fast.brake.decision import Decision
    from ttc_fast.brake.types import Criterion, Estimate, Evaluation, Threats

BRAKE = Command.BRAKE  # a name is looked up faster than the member of an enumeration
NO_DATA, INVALID, WARMING_UP, CONTACT = Status.NO_DATA, Status.INVALID, Status.WARMING_UP, Status.CONTACT
CLASS, VERSION = "BrakeController", 2
SMOOTHING = 0.25
"""The weight of the newest time between two frames in the usual one."""

Newest = tuple["Motion | None", float, "Estimate | None"]
"""The newest odometry, its stamp, and the newest estimate."""


@dataclass(slots=True)
class Assessed:
    """What the assessment of a frame came to.

    Attributes
    ----------
    status, threats
        Status and threats as ``Decision`` has them.
    criterion : Criterion or None
        The most urgent criterion; None where the frame cannot be evaluated.
    evaluation : Evaluation
        The evaluation by that criterion.
    triggers, clear : bool
        The votes of the frame on braking and on release.
    motion : Motion or None
        The motion that it was evaluated for.
    without_estimates : Assessed or None
        What it would have come to without the estimate; None where no estimate has ever come.
    rests_in_contact : bool
        Whether something is inside the outline, and neither motion nor command says which way it will go.
    unseen : bool
        Whether nothing looks at a part of the path, or of the path that a braked vehicle would go on with.
    looks : tuple of int or None
        The edges of the outline that the cloud looks at, as far as that was asked; None for one that it does not.
    """

    status: Status | None
    threats: Threats | None = None
    criterion: Criterion | None = None
    evaluation: Evaluation = NOTHING
    triggers: bool = False
    clear: bool = False
    motion: Motion | None = None
    without_estimates: Assessed | None = None
    rests_in_contact: bool = False
    unseen: bool = False
    looks: tuple[int | None, ...] = ()


BETWEEN_FRAMES, IGNORED, BLIND, UNKNOWN = Assessed(None), Assessed(INVALID), Assessed(NO_DATA), Assessed(WARMING_UP)


class BrakeController:
    """Decides when to brake, and says why.

    It has no clock and does no I/O: the same inputs give the same decisions, to the bit. Several threads may use one
    controller; a call waits for the one before. A call that raises changes nothing.

    Parameters
    ----------
    criteria : sequence of criteria, optional
        The criteria, any of which may trigger. The default is ``SweptPathThreshold(1.5)`` and ``StoppingDistance()``
        where there is an outline, else ``IttcThreshold(1.5)`` and ``StoppingDistance()``.
    scan : ScanTTC, optional
        The scanner that reads ``ranges``. With an outline, its beams are assessed along the vehicle's path as well.
    path : SweptPath, optional
        The path that reads ``points``. With neither ``scan`` nor ``path``, each ``estimate`` is a frame, and the
        default criteria are ``EstimateThreshold(1.5)`` and ``StoppingDistance()``.
    range_rate : RangeRate, optional
        It gives the closing speeds when there is no odometry. It takes up every frame, so that it is warm then.
    time_increment : float, default 0.0
        Time between two beams of a scan, s, as in ``sensor_msgs/LaserScan``. The age of each beam is taken off its TTC.
    horizon : float, default 5.0
        The path of ``scan`` is looked at this far ahead, s; ``path`` has its own horizon.
    trigger : (float, float) or (int, int), default (0.75, 0.1)
        (share, seconds): the controller brakes when so large a share of the frames of this last time triggers, and two
        frames at least. (N, M): it brakes when N of the last M frames trigger. At 40 Hz the default is (3, 4).
    release : (float, float) or (int, int), default (0.6, 0.125)
        As ``trigger``, for the frames that have to be clear before the controller lets go. At 40 Hz it is (3, 5).
    warn_at : float, default 1.5
        The controller warns below this multiple of a criterion's threshold; at least 1.
    release_at : float, default 1.25
        A frame is clear from this multiple of every threshold on; at least 1.
    hold : float, default 0.5
        A brake is held at least this long after the last frame that triggered, s.
    deceleration : float, default 6.0
        A decision to brake asks for this deceleration, m/s^2, above 0.
    standstill_speed : float, default 0.05
        Below this speed the vehicle stands, m/s. A braked vehicle that stands sees nothing come closer. It is released
        only when the motion that it would continue with (``commanded``, else the one it braked from) is clear.
    creep_speed : float, default 0.0
        Up to this speed the path need not be seen, m/s. A vehicle whose sensors do not look back can reverse so fast.
    sensor_timeout : float, default 0.3
        Sensor data of this age are too old to be safe, s.
    motion_timeout : float, default 0.5
        Odometry of this age is not used any more, s.
    min_returns : int, default 0
        With fewer valid readings (``counts.valid``) a frame is blind. A frame without a valid reading always is.
    when_blind : Command, default Command.BRAKE
        The command when sensor data are missing, too old or blind, when no closing speed is known, or no sensor looks
        at the path: BRAKE or WARN.
    views : sequence of ScanTTC, default ()
        Where the sensors look whose ``points`` come: a scanner, or a range finder with its mount and a few angles.
        Without them, a cloud beside a scan looks along the path if it has a point there.

    Raises
    ------
    ValueError
        If a setting is refused.
    TypeError
        If a setting is of the wrong type.

    Notes
    -----
    An ``estimate`` beside a scan or a cloud may add a brake and never takes one away.

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
        trigger: tuple[float, float] = (0.75, 0.1),
        release: tuple[float, float] = (0.6, 0.125),
        warn_at: float = 1.5,
        release_at: float = 1.25,
        hold: float = 0.5,
        deceleration: float = 6.0,
        standstill_speed: float = 0.05,
        creep_speed: float = 0.0,
        sensor_timeout: float = 0.3,
        motion_timeout: float = 0.5,
        min_returns: int = 0,
        when_blind: Command = Command.BRAKE,
        views: Sequence[ScanTTC] = (),
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
            creep_speed=creep_speed,
            sensor_timeout=sensor_timeout,
            motion_timeout=motion_timeout,
            min_returns=min_returns,
            when_blind=when_blind,
        )
        self._trigger, self._release = NOfM(trigger), NOfM(release)
        self._assessment = ThreatAssessment(scan, path, range_rate, horizon)
        self._first, *self._others = self._assessment.check(criteria if criteria is not None else self._default())
        self._fields_of_view = FieldsOfView(self._assessment, views, self._settings, self.criteria)
        self._state = ControllerState()
        self._lock = threading.RLock()

    @classmethod
    def racing(cls, scan: ScanTTC, **settings: Any) -> BrakeController:
        """Return a controller that stops a racing car at the last moment: it lets it drive its line between walls.

        Criteria: ``StoppingDistance(reaction_time=0.15)``, and ``PresentArc(sharpest=0.8 / length)`` for the arc that
        the car is on or, without a plan, may turn to: 0.8 over the length of the outline is a steering angle of 24
        degrees. Two of the last three frames trigger. Give ``path`` with each frame: without one, it keeps so much
        room that the car could turn into any wall, and a line close to a wall is a cause to brake. docs/braking.md has
        the laps and the collisions of this set.

        Parameters
        ----------
        scan : ScanTTC
            The scanner, with the vehicle's outline.
        **settings
            Other arguments of the constructor; they replace those of the set.

        Returns
        -------
        BrakeController

        Raises
        ------
        TypeError, ValueError
            These are as in the constructor; also for a scanner without an outline.

        Examples
        --------
        >>> from ttc_fast import BrakeController, ScanTTC
        >>> scan = ScanTTC(-2.35, 0.005, 941, outline=(-0.1, 0.5, -0.15, 0.15))
        >>> BrakeController.racing(scan, deceleration=8.0).settings.trigger
        (2, 3)
        """
        arc = PresentArc()
        if isinstance(scan, ScanTTC) and scan.outline is not None:  # else the constructor says what is missing
            arc = PresentArc(sharpest=0.8 / (scan.outline[1] - scan.outline[0]))
        criteria = [StoppingDistance(reaction_time=0.15), arc]
        named: dict[str, Any] = {"criteria": criteria, "scan": scan, "trigger": (2, 3)}
        return cls(**(named | settings))

    @classmethod
    def careful(cls, scan: ScanTTC, **settings: Any) -> BrakeController:
        """Return a controller that would rather stop once too often.

        Criteria: ``SweptPathThreshold(1.5)`` and ``StoppingDistance(4.0, reaction_time=0.2, margin=0.3)``. Two of the
        last three frames trigger, and it warns at twice a threshold. docs/braking.md has its closed-loop figures.

        Parameters
        ----------
        scan : ScanTTC
            The scanner, with the vehicle's outline.
        **settings
            Other arguments of the constructor; they replace those of the set.

        Returns
        -------
        BrakeController

        Raises
        ------
        TypeError, ValueError
            These are as in the constructor; also for a scanner without an outline.

        Examples
        --------
        >>> from ttc_fast import BrakeController, ScanTTC
        >>> scan = ScanTTC(-2.35, 0.005, 941, outline=(-0.1, 0.5, -0.15, 0.15))
        >>> BrakeController.careful(scan).settings.warn_at
        2.0
        """
        criteria = [SweptPathThreshold(), StoppingDistance(4.0, reaction_time=0.2, margin=0.3)]
        named: dict[str, Any] = {"criteria": criteria, "scan": scan, "trigger": (2, 3), "warn_at": 2.0}
        return cls(**(named | settings))

    def _default(self) -> list[Criterion]:
        if self._assessment.only_estimates:
            return [EstimateThreshold(), StoppingDistance()]
        first: Criterion = SweptPathThreshold() if self._assessment.has_path else IttcThreshold()
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
        time_increment: float | None = None,
        path: Any = None,
    ) -> Decision:
        """Decide with what is new.

        Call it for each frame, and between frames as often as the watchdog is to look. What is not given stays as it
        was, and grows older.

        Parameters
        ----------
        now : float
            The time, s, by the clock of all stamps.
        ranges : ndarray, shape (beams,), optional
            A scan, as ``scan`` reads it, m.
        points : array_like, shape (N, 2 or more), optional
            A cloud in the vehicle's frame, as ``path`` reads it, m.
        stamp : float, optional
            Time of the measurement, s; for a scan that of the first beam. Scans and clouds need it. A scan whose stamp
            is not newer than that of the last scan, a cloud likewise, or a frame whose stamp lies more than 0.1 s in
            the future, is counted and ignored.
        motion : Motion, optional
            Odometry.
        estimate : Estimate, optional
            What a tracker or a camera estimates.
        commanded : Motion or float, optional
            What the vehicle would do if it were not braked; a float is its speed, straight ahead.
        override : bool, default False
            Whether the driver took over. As long as he does, the command is NONE.
        time_increment : float, optional
            Time between two beams of this scan, s, where the scanner measures it anew in each scan. The default is that
            of the constructor.
        path : array_like, shape (N, 2), or callable, optional
            Where the vehicle will go, with this frame: points in its present frame, m, as ``SweptPath.min`` takes them,
            or a function that returns such points for ways along the path, an array of shape (N,) in m. The frame is
            assessed along it instead of the present arc, at the speed of ``motion``. Where it leads the other way than
            the vehicle moves, and where there is no odometry, it does not count. It needs an outline.

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
        override = override if type(override) is bool else flag("override", override)
        with self._lock:  # nothing is remembered before the vote, so that a call that raises changes nothing
            newest, frame = self._receive(now, ranges, points, stamp, motion, estimate, commanded, time_increment, path)
            assessed = BETWEEN_FRAMES if frame is None else self._assess(frame)
            self._vote(newest, frame, assessed)
            state, settings = self._state, self._settings
            unsafe = watchdog(state, settings, now)
            if unsafe is not None and settings.when_blind == BRAKE:
                for brake in state.brakes:
                    brake.brake(now, state.motion or STANDING)
            return decide(state, settings, now, unsafe, override, assessed.status, assessed.threats)

    def _receive(
        self,
        now: float,
        ranges: Any,
        points: Any,
        stamp: Any,
        motion: Any,
        estimate: Any,
        commanded: Any,
        time_increment: Any,
        path: Any,
    ) -> tuple[Newest, Frame | None]:
        """Check what came; return the newest odometry and estimate, and the frame if one came."""
        state, settings = self._state, self._settings
        newest_motion, motion_at, newest_estimate = state.motion, state.motion_at, state.estimate
        if commanded is not None:
            commanded = checked_commanded(commanded)
        if motion is not None:
            motion = checked_motion("motion", motion)
            at = now if motion.stamp is None else motion.stamp
            if motion_at <= at <= now + CLOCK_TOLERANCE:
                newest_motion, motion_at = motion, at
        between = self._settings.time_increment
        if time_increment is not None:
            ordinary = type(time_increment) is float and 0.0 <= time_increment <= 1.0  # which needs no call
            between = time_increment if ordinary else BETWEEN_BEAMS.check("time_increment", time_increment)
        if estimate is not None:
            estimate = checked_estimate(estimate)
            if not estimate.saw_nothing:
                newest_estimate = estimate
        newest = newest_motion, motion_at, newest_estimate
        if ranges is not None or points is not None:
            if ranges is not None:
                if points is not None:
                    raise ValueError(
                        "a frame must be ranges or points, not both: give each scan and each cloud an update"
                    )
                if getattr(ranges, "ndim", 1) != 1:
                    raise ValueError(f"ranges must be one scan, of shape (beams,), got shape {tuple(ranges.shape)}")
            stamp, estimate = finite("stamp", stamp), newest_estimate
            if estimate is not None and not is_fresh(estimate.stamp, now, settings.sensor_timeout):
                estimate = None
        elif estimate is not None and self._assessment.only_estimates:
            stamp = estimate.stamp
        else:
            return newest, None
        fresh = newest_motion if is_fresh(motion_at, now, settings.motion_timeout) else None
        if path is not None:
            path = self._assessment.checked_path(path, fresh)
        return newest, Frame(now, stamp, ranges, points, estimate, fresh, commanded, between, path)

    def _assess(self, frame: Frame) -> Assessed:
        """Assess the threats of a frame, and evaluate them by every criterion."""
        state, assessment = self._state, self._assessment
        is_cloud = frame.points is not None
        newest_at = state.newest_at if is_cloud is state.is_cloud else state.other_newest_at
        if not newest_at < frame.stamp <= frame.now + CLOCK_TOLERANCE:
            return IGNORED
        threats = assessment.assess(frame)
        if threats.status is NO_DATA or threats.returns < self._settings.min_returns:
            assessed = BLIND
        elif not threats.closing_speed_known:
            assessed = UNKNOWN
        else:
            unseen, looks = self._fields_of_view.unseen(frame, state, frame.motion)
            assessed = self._evaluate(frame, threats, state.brake, unseen)
            assessed.looks += (looks,)
            without = state.brake_without_estimates
            if without is not None or (frame.estimate is not None and not assessment.only_estimates):
                other, seen = frame, threats
                if frame.estimate is not None:
                    other, seen = replace(frame, estimate=None), threats._replace(estimate=None, estimate_is_sure=False)
                assessed.without_estimates = self._evaluate(other, seen, without or state.brake, unseen)
        if assessment.range_rate is not None:
            assessment.take_up(frame)
        return assessed

    def _evaluate(self, frame: Frame, threats: Threats, brake: Brake, unseen: bool) -> Assessed:
        """Evaluate threats by every criterion, and return how the frame votes on a brake."""
        motion, commanded, settings = frame.motion, frame.commanded, self._settings
        criterion, evaluation = self._most_urgent(threats)
        rests_in_contact, looks = False, None
        if threats.status is CONTACT and not self._assessment.only_estimates:
            rests_in_contact = not (moves(motion) or moves(commanded))
            if commanded is not None and not brake.on:  # the vehicle must not be driven deeper into contact
                other, of_commanded = self._most_urgent(self._assessment.assess_along(frame, commanded))
                if of_commanded.more_urgent_than(evaluation):
                    criterion, evaluation, motion = other, of_commanded, commanded
        stops_unseen = unseen and settings.when_blind == BRAKE
        triggers = evaluation.value < evaluation.threshold or stops_unseen
        clear = evaluation.value >= settings.release_at * evaluation.threshold and not stops_unseen
        if clear and frame.estimate is not None:
            clear = frame.estimate.is_current(frame.now, settings.sensor_timeout)
        if clear and brake.on and not self._assessment.only_estimates:  # what would be estimated then is not known
            continued = commanded if commanded is not None else self._continued_motion(motion, brake)
            if continued is not None:
                clear, continues_unseen, looks = self._would_be_clear(frame, continued)
                unseen = unseen or continues_unseen
        motion = motion or self._state.motion
        votes = triggers, clear, motion, None, rests_in_contact, unseen
        return Assessed(threats.status, threats, criterion, evaluation, *votes, (looks,))

    def _vote(self, newest: Newest, frame: Frame | None, assessed: Assessed) -> None:
        """Remember what came, count the two votes of a frame, and begin or end braking."""
        state = self._state
        state.motion, state.motion_at, state.estimate = newest
        if frame is None:
            return
        if assessed is IGNORED:
            state.ignored += 1
            return
        state.frames += 1
        state.turn_to(frame.points is not None)
        state.newest_at = stamp = frame.stamp
        state.frame_at = max(state.frame_at, stamp)  # of two sensors, one may need longer
        if assessed is BLIND:
            state.blind += 1
        else:
            state.seen_at = max(state.seen_at, stamp)
            if frame.ranges is not None:
                state.scan_at = stamp
            elif frame.points is not None:
                state.cloud_at = stamp
        if assessed.criterion is None:  # a frame that cannot be evaluated is not clear
            _, counts = self._release.quorum(state.period)
            for brake in state.brakes:
                brake.release_votes = brake.release_votes << 1 & counts
            return
        self._keep_time(stamp)
        for edge in assessed.looks:
            if edge is not None:
                state.cloud_looks = {**state.cloud_looks, edge: stamp}
        state.criterion, state.evaluation = assessed.criterion, assessed.evaluation
        state.rests_in_contact, state.unseen = assessed.rests_in_contact, assessed.unseen
        trigger, release = self._trigger.quorum(state.period), self._release.quorum(state.period)
        now, hold, without = frame.now, self._settings.hold, assessed.without_estimates
        others = 0
        if state.other_voted_at >= now - self._settings.sensor_timeout:
            others, _ = self._release.quorum(state.other_period)
        if without is not None:
            if state.brake_without_estimates is None:
                state.brake_without_estimates = replace(state.brake)
            state.brake_without_estimates.vote(
                now, without.triggers, without.clear, without.motion, trigger, release, hold, others
            )
        state.brake.vote(now, assessed.triggers, assessed.clear, assessed.motion, trigger, release, hold, others)

    def _keep_time(self, stamp: float) -> None:
        """Learn how often such a frame comes. After a gap, its votes on release begin anew."""
        state, timeout = self._state, self._settings.sensor_timeout
        since, state.voted_at = stamp - state.voted_at, stamp
        state.evaluated_at = max(state.evaluated_at, stamp)
        if since > timeout:
            for brake in state.brakes:
                brake.release_votes = 0
            if since == math.inf:
                return
            since = timeout
        state.period = since if state.period == math.inf else state.period + SMOOTHING * (since - state.period)

    def _most_urgent(self, threats: Threats) -> tuple[Criterion, Evaluation]:
        """Return the criterion that is nearest to its threshold, or beyond it by most, and its evaluation."""
        urgent, evaluation = self._first, self._first.evaluate(threats)
        for criterion in self._others:
            other = criterion.evaluate(threats)
            if other.more_urgent_than(evaluation):
                urgent, evaluation = criterion, other
        return urgent, evaluation

    def _would_be_clear(self, frame: Frame, continued: Motion) -> tuple[bool, bool, int | None]:
        """Return whether a frame is clear for what a braked vehicle would go on with, and what is seen of its path.

        Being slow is not being safe: the vehicle sees nothing come closer because it is braked.
        """
        _, (value, threshold, _) = self._most_urgent(self._assessment.assess_along(frame, continued))
        if value < self._settings.release_at * threshold:
            return False, False, None
        unseen, looks = self._fields_of_view.unseen(frame, self._state, continued)
        return not unseen or self._settings.when_blind != BRAKE, unseen, looks

    def _continued_motion(self, motion: Motion | None, brake: Brake) -> Motion | None:
        """Return the motion of a vehicle that is released and not commanded, or None where that is not known."""
        before = brake.braked_from
        if motion is None:
            return before if moves(before) else None  # without odometry it may stand
        if motion.speed == 0.0 or abs(motion.speed) < self._settings.standstill_speed:
            return before
        faster = max(abs(before.speed / motion.speed), 1.0)  # the way it is on, at the speed it braked from
        return Motion(motion.speed * faster, motion.yaw_rate * faster, motion.lateral_speed * faster)

    @property
    def criteria(self) -> tuple[Criterion, ...]:
        """The criteria, in the order in which they were given."""
        return (self._first, *self._others)

    @property
    def settings(self) -> BrakeSettings:
        """The settings, defaults included."""
        return self._settings

    @property
    def scan(self) -> ScanTTC | None:
        """The scanner by which ``ranges`` are read."""
        return self._assessment.scan

    def use_scan(self, scan: ScanTTC) -> None:
        """Read ``ranges`` by another scanner from now on, and go on with everything that is remembered.

        It is for scanners whose beams are others in each scan. The range rate goes on by angle: a beam takes over what
        was measured in its direction, to half a beam.

        Parameters
        ----------
        scan : ScanTTC
            The scanner, with an outline where the one before it had one.

        Returns
        -------
        None

        Raises
        ------
        TypeError
            If it is no ``ScanTTC``.
        ValueError
            If the controller has no scanner, or if only one of the two scanners has an outline.

        Examples
        --------
        >>> import numpy as np
        >>> from ttc_fast import BrakeController, Motion, ScanTTC
        >>> controller = BrakeController(scan=ScanTTC(-1.0, 0.5, 5))
        >>> controller.use_scan(ScanTTC(-1.0, 0.4, 6))
        >>> controller.update(0.0, ranges=np.full(6, 9.0), stamp=0.0, motion=Motion(1.0)).reason.name
        'CLEAR'
        """
        if not isinstance(scan, ScanTTC):
            raise TypeError(f"scan must be a ScanTTC, got {type(scan).__name__}")
        with self._lock:
            if self._assessment.scan is None:
                raise ValueError("scan must replace another one: this controller reads no ranges")
            self._assessment.use_scan(scan)

    def reset(self) -> None:
        """Forget everything: frames, odometry, estimates, votes, and what the range rate has taken up.

        Returns
        -------
        None

        Examples
        --------
        >>> from ttc_fast import BrakeController, Estimate
        >>> controller = BrakeController()
        >>> controller.update(1.0, estimate=Estimate(1.0, ttc=9.0)).reason.name
        'CLEAR'
        >>> controller.reset()
        >>> controller.update(1.1).reason.name
        'WAITING'
        """
        with self._lock:
            self._state = ControllerState()
            self._assessment.reset()

    def state(self) -> dict[str, Any]:
        """Return everything that the controller remembers, to go on from later.

        Returns
        -------
        dict
            ``class`` and ``version`` of the state, the fields of ``ControllerState``, where a ``Brake`` is a dict, and
            ``range_rate``, the state of the range rate or None. Later updates do not change it, and it pickles.

        Examples
        --------
        >>> from ttc_fast import BrakeController, ScanTTC
        >>> controller = BrakeController(scan=ScanTTC(0.0, 0.1, 3))
        >>> state = controller.state()
        >>> state["class"], state["version"], state["brake"]["on"]
        ('BrakeController', 2, False)
        """
        with self._lock:
            return {"class": CLASS, "version": VERSION, **self._state.saved(), "range_rate": self._assessment.state()}

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a state: a controller of the same settings then decides as the saved one would have.

        Parameters
        ----------
        state : dict
            A state that ``state`` returned.

        Returns
        -------
        None

        Raises
        ------
        ValueError
            If it is the state of another class or version, is incomplete, or has a range rate where this controller
            has none, or the other way round. The controller then remembers what it did.
        TypeError
            If it is no dict.

        Examples
        --------
        >>> from ttc_fast import BrakeController, ScanTTC
        >>> controller = BrakeController(scan=ScanTTC(0.0, 0.1, 3))
        >>> controller.restore(controller.state())
        """
        if not isinstance(state, dict):
            raise TypeError(f"state must be a dict that the state() of a {CLASS} returned, got {state!r}")
        expected = {"class": CLASS, "version": VERSION}
        for name in (*expected, "range_rate"):
            if name not in state:
                raise ValueError(f"state has no {name}: it must come from state()")
            if name in expected and state[name] != expected[name]:
                raise ValueError(f"state must be of {name} {expected[name]}, got {state[name]}")
        restored = ControllerState.of(state)
        with self._lock:
            self._assessment.restore(state["range_rate"])
            self._state = restored

    def __getstate__(self) -> dict[str, Any]:
        with self._lock:
            assessment = self._assessment
            arguments = {
                "criteria": self.criteria,
                "scan": assessment.scan,
                "path": assessment.path,
                "range_rate": copy.deepcopy(assessment.range_rate),
                "views": self._fields_of_view.views,
                **asdict(self._settings),
            }
            return {"arguments": arguments, "state": self.state()}

    def __setstate__(self, pickled: dict[str, Any]) -> None:
        BrakeController.__init__(self, **pickled["arguments"])
        self.restore(pickled["state"])


def moves(motion: Motion | None) -> bool:
    """Return whether a motion moves or turns the vehicle."""
    return motion is not None and any(motion[:3])
