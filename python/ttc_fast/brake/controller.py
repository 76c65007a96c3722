"""From what the sensors see to a command, and why: receive, assess, vote, decide."""

from __future__ import annotations

import copy
import threading
from dataclasses import asdict
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
from ttc_fast.brake.evaluate import Evaluator
from ttc_fast.brake.receive import receive
from ttc_fast.brake.settings import BrakeSettings
from ttc_fast.brake.state import ControllerState
from ttc_fast.brake.threats import ThreatAssessment
from ttc_fast.brake.types import STANDING
from ttc_fast.brake.unseen import FieldsOfView
from ttc_fast.brake.voting import Voting

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from ttc_fast import RangeRate, SweptPath
    from ttc_fast.brake.decision import Decision
    from ttc_fast.brake.types import Criterion, Estimate, Motion

CLASS, VERSION = "BrakeController", 4


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
        With fewer valid readings (``counts.valid``) a frame is blind. A frame with neither a valid reading nor free
        space always is. A scan of nothing but inf is free space, and CLEAR unless ``min_returns`` is above 0.
    when_blind : Command, default Command.BRAKE
        The command when sensor data are missing, too old or blind, when no closing speed is known, or no sensor looks
        at the path: BRAKE or WARN.
    views : sequence of ScanTTC, default ()
        Where the sensors look whose ``points`` come: a scanner, or a range finder with its mount and a few angles.
        Without them, a cloud looks along the path if it has a point there, and clouds without a scan look ahead.

    Raises
    ------
    ValueError
        If a setting is refused.
    TypeError
        If a setting is of the wrong type.

    Notes
    -----
    An ``estimate`` beside a scan or a cloud may add a brake and never takes one away. One that is too old, or repeated
    to the bit, adds nothing. A scan or cloud that is repeated to the bit while the vehicle drives is stale.

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
        assessment = self._assessment = ThreatAssessment(scan, path, range_rate, horizon)
        criteria = assessment.check(criteria if criteria is not None else self._default(), self._settings.deceleration)
        self._fields_of_view = FieldsOfView(assessment, views, self._settings)
        self._evaluator = Evaluator(criteria, assessment, self._fields_of_view, self._settings)
        self._voting = Voting(self._settings)
        self._brakes_when_blind = self._settings.when_blind == Command.BRAKE
        self._remember(ControllerState())
        self._lock = threading.RLock()

    @classmethod
    def racing(cls, scan: ScanTTC, **settings: Any) -> BrakeController:
        """Return a controller that stops a racing car at the last moment: it lets it drive its line between walls.

        Criteria: ``StoppingDistance(reaction_time=0.15)``, and ``PresentArc(sharpest=0.8 / length)`` for the arc that
        the car is on or, without a plan, may turn to: 0.8 over the length of the outline is a steering angle of 24
        degrees. Two of the last three frames trigger. Give ``path`` with each frame: without one, it keeps so much
        room that the car could turn into any wall, and a line close to a wall is a cause to brake. docs/racing.md has
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
        last three frames trigger, and it warns at twice a threshold. docs/racing.md has its figures.

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
            assessed along it instead of the present arc, at the speed of ``motion``. Where it leads nowhere, or the
            other way than the vehicle moves, and where there is no odometry, it does not count. Where the motion does
            not follow it, what the vehicle cannot stop short of on its present arc counts as well. It needs an outline.

        Returns
        -------
        Decision

        Raises
        ------
        ValueError
            If a number is not finite, a motion is faster than light, or there are data without a stamp or without
            anything that reads them.
        TypeError
            If an argument is of the wrong type.

        Examples
        --------
        >>> from ttc_fast import BrakeController, ScanTTC
        >>> controller = BrakeController(scan=ScanTTC(0.0, 0.1, 3))
        >>> print(controller.update(10.0))                       # nothing has come yet: that is not safe
        BRAKE (WAITING): no sensor data have come yet
        """
        if type(now) is not float or now - now != 0.0:
            now = finite("now", now)
        if override is not False:
            override = flag("override", override)
        with self._lock:  # nothing is remembered before the vote, so that a call that raises changes nothing
            state, settings = self._state, self._settings
            newest, frame = receive(
                state,
                settings,
                self._assessment,
                now,
                ranges,
                points,
                stamp,
                motion,
                estimate,
                commanded,
                time_increment,
                path,
            )
            status = threats = None
            if frame is None:
                state.newest = newest
            else:
                status, threats, held, vote, without = self._evaluator.assess(frame, state)
                self._voting.vote(state, newest, frame, status, held, vote, without)
            unsafe = watchdog(state, settings, now)
            if unsafe is not None and self._brakes_when_blind:
                for brake in state.brakes:
                    brake.brake(now, state.newest[0] or STANDING)
            return decide(state, settings, now, unsafe, override, status, threats)

    @property
    def criteria(self) -> tuple[Criterion, ...]:
        """The criteria, in the order in which they were given."""
        return self._evaluator.criteria

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
            self._remember(ControllerState())
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
        ('BrakeController', 4, False)
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
            self._remember(restored)

    def _remember(self, state: ControllerState) -> None:
        self._state = self._fields_of_view.state = state

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


def cover_for_one_another(controllers: Iterable[BrakeController]) -> None:
    """Let controllers of one vehicle know where the sensors of the others look, as long as data come from these."""
    views = [controller._fields_of_view for controller in controllers]
    for fields in views:
        fields.others = [each for each in views if each is not fields]
