"""What a brake controller answers, and why."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from ttc_fast.brake.scene import Criterion
    from ttc_fast.brake.sight import Threat


class Command(IntEnum):
    """What the vehicle is to do; the larger wins.

    Attributes
    ----------
    NONE
        Go on.
    WARN
        Go on with care: not above ``speed_limit``.
    BRAKE
        Brake with ``deceleration``.

    Examples
    --------
    >>> from ttc_fast import Command
    >>> max(Command.NONE, Command.BRAKE).name
    'BRAKE'
    """

    NONE = 0
    WARN = 1
    BRAKE = 2


class Reason(IntEnum):
    """Why a command was given.

    Attributes
    ----------
    CLEAR
        Nothing is within the threshold of any criterion.
    NEAR
        Something is within the warning threshold of a criterion.
    VOTING
        A criterion triggers, and has not done so often enough yet to brake.
    CRITERION
        A criterion triggered often enough.
    HOLD
        Still braking: for the hold time, or until enough frames are clear by the release threshold.
    STANDSTILL
        Still braking: the vehicle stands, and would trigger a criterion again if it went on as before.
    ESCAPE
        In contact, and moving away from it: allowed.
    WAITING
        No sensor data have come yet.
    STALE
        The newest sensor data are too old.
    BLIND
        The sensor speaks and sees nothing valid, or fewer returns than ``min_returns``, for too long.
    NO_MOTION
        There is no odometry, or it is too old, and nothing else tells a closing speed.
    OVERRIDE
        The driver took over.
    CONTACT
        In contact, and neither the motion nor what is commanded says which way the vehicle will go.

    Examples
    --------
    >>> from ttc_fast import Reason
    >>> Reason.STALE.name
    'STALE'
    """

    CLEAR = 0
    NEAR = 1
    VOTING = 2
    CRITERION = 3
    HOLD = 4
    STANDSTILL = 5
    ESCAPE = 6
    WAITING = 7
    STALE = 8
    BLIND = 9
    NO_MOTION = 10
    OVERRIDE = 11
    CONTACT = 12


class Counters(NamedTuple):
    """How often what happened, since the controller was made.

    Attributes
    ----------
    frames : int
        Sensor frames that were judged.
    ignored : int
        Frames that were not: their stamps were not newer than the last one's, or lay in the future.
    blind : int
        Judged frames with too few returns.
    triggered : int
        Of the last frames that vote on braking, how many triggered.
    clear : int
        Of the last frames that vote on release, how many were clear.

    Examples
    --------
    >>> from ttc_fast.brake import Counters
    >>> Counters(frames=10, ignored=0, blind=0, triggered=2, clear=0).triggered
    2
    """

    frames: int
    ignored: int
    blind: int
    triggered: int
    clear: int


class Decision(NamedTuple):
    """What to do, and why.

    Attributes
    ----------
    command : Command
        What to do.
    reason : Reason
        Why.
    deceleration : float
        To brake with, m/s^2; 0 without BRAKE.
    speed_limit : float
        m/s: 0 with BRAKE; with WARN the speed at which the criterion would brake now; else inf.
    criterion : Criterion or None
        The one that is nearest to its threshold, or beyond it by most; None when nothing was judged.
    value, threshold : float
        What it compares, in its own unit (s, or m of clearance). It triggers when ``value < threshold``.
    threat : Threat or None
        What it judged: beam or point, range, clearance, closing speed, TTC and their age.
    stamp : float
        The time of the decision, s.
    counters : Counters
        Frames, and votes.

    Examples
    --------
    >>> import numpy as np
    >>> from ttc_fast import BrakeController, Motion, ScanTTC
    >>> controller = BrakeController(scan=ScanTTC(0.0, 0.1, 3), trigger=(1, 1))
    >>> decision = controller.update(0.02, ranges=np.array([2.0, 5.0, 5.0]), stamp=0.0, motion=Motion(4.0))
    >>> decision.command.name, decision.reason.name, round(decision.value, 2)
    ('BRAKE', 'CRITERION', 0.48)
    >>> print(decision)
    BRAKE (CRITERION): IttcThreshold: 0.48 < 1.5 s; return 0 at 2.00 m, 1.92 m clear, closing at 4.00 m/s, TTC 0.48 s
    """

    command: Command
    reason: Reason
    deceleration: float
    speed_limit: float
    criterion: Criterion | None
    value: float
    threshold: float
    threat: Threat | None
    stamp: float
    counters: Counters

    def __str__(self) -> str:
        """Say why, in one line."""
        head = f"{self.command.name} ({self.reason.name})"
        if self.criterion is None or not math.isfinite(self.value):
            return head
        sign = "<" if self.value < self.threshold else ">="
        compared = f"{self.value:.2f} {sign} {self.threshold:.3g} {self.criterion.unit}"
        return f"{head}: {self.criterion.name}: {compared}; {self.threat}"
