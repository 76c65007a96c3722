"""What a brake controller decides: a command, the reason for it, and everything that it rests on. Data only."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from ttc_fast.status import NamedInt

if TYPE_CHECKING:
    from ttc_fast.brake.types import Criterion, Threat, Threats
    from ttc_fast.status import Status


class Command(NamedInt):
    """What the vehicle is to do. The larger command wins.

    Attributes
    ----------
    NONE
        Go on.
    WARN
        Go on with care, at most at ``speed_limit``.
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


class Reason(NamedInt):
    """Why a command was given.

    Attributes
    ----------
    CLEAR
        Nothing is within the threshold of any criterion.
    NEAR
        Something is within the warning threshold of a criterion.
    VOTING
        A criterion triggers, but too few of the last frames have triggered to brake.
    CRITERION
        A criterion triggers, and enough of the last frames have triggered.
    HOLD
        The vehicle still brakes: the hold time runs, or too few frames are clear by the release threshold.
    STANDSTILL
        The vehicle still brakes: it stands, and would trigger a criterion again if it went on as before.
    ESCAPE
        The vehicle is in contact and moves away from it, which is allowed.
    WAITING
        No sensor data have come yet.
    STALE
        The newest sensor data are too old, or repeat to the bit what was seen long ago.
    BLIND
        For too long the frames have had neither a valid reading nor free space, or fewer returns than ``min_returns``.
    NO_MOTION
        There is no odometry, or it is too old, and nothing else gives a closing speed.
    OVERRIDE
        The driver took over.
    CONTACT
        The vehicle is in contact, and neither its motion nor ``commanded`` says which way it will go.
    UNSEEN
        No sensor looks at a part of the path, or of the path that a braked vehicle would go on with.

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
    UNSEEN = 13


_IN_WORDS = {
    Reason.HOLD: "the brake is held until enough frames are clear",
    Reason.STANDSTILL: "the vehicle stands, and would brake again if it went on as before",
    Reason.ESCAPE: "in contact, and moving away from it",
    Reason.WAITING: "no sensor data have come yet",
    Reason.STALE: "the newest sensor data are too old, by the clock of now, or repeat what was seen long ago",
    Reason.BLIND: "the sensor data have been without enough valid readings for too long",
    Reason.NO_MOTION: "the odometry is missing or too old",
    Reason.OVERRIDE: "the driver took over",
    Reason.CONTACT: "in contact, and nothing says which way the vehicle will go",
    Reason.UNSEEN: "no sensor looks at a part of the path",
}
_OF_SENSORS = {Reason.WAITING, Reason.STALE, Reason.BLIND, Reason.NO_MOTION, Reason.OVERRIDE, Reason.UNSEEN}
"""These rest on no criterion."""


class Counters(NamedTuple):
    """Numbers of frames and votes.

    Attributes
    ----------
    frames : int
        Frames that were assessed, blind ones included, since the controller was made or reset.
    ignored : int
        Frames that were not assessed: their stamps were not newer than the last one's, or lay in the future.
    blind : int
        Assessed frames with too few returns.
    triggered : int
        How many of the last frames that vote on braking triggered.
    clear : int
        How many of the last frames that vote on release were clear.

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
        The deceleration to brake with, m/s^2; 0 without BRAKE.
    speed_limit : float
        Greatest speed, m/s: 0 with BRAKE; with WARN the speed at which the criterion would brake now; else inf.
    criterion : Criterion or None
        The most urgent criterion of the newest evaluated frame; None before the first.
    value, threshold : float
        What that criterion compares, in its own unit (s, or m of clearance). It triggers when ``value < threshold``.
    threat : Threat or None
        The threat that the criterion compares: beam or point, range, clearance, closing speed, TTC and their age.
    stamp : float
        The time of the decision, s.
    counters : Counters
        Numbers of frames and votes.
    status : Status or None
        Status of the frame that came with this update; None when none came, as when the watchdog asks. NO_DATA is a
        blind frame, INVALID one that was ignored, WARMING_UP one whose closing speeds are not known, STALE one of a
        frozen sensor, without threats. Any other status says what the nearest TTC of the frame means.
    threats : Threats or None
        What that frame shows, by the vehicle's motion; None when it could not be evaluated, or none came.

    Examples
    --------
    >>> import numpy as np
    >>> from ttc_fast import BrakeController, Motion, ScanTTC
    >>> controller = BrakeController(scan=ScanTTC(0.0, 0.1, 3), trigger=(1, 1))
    >>> decision = controller.update(0.02, ranges=np.array([2.0, 5.0, 5.0]), stamp=0.0, motion=Motion(4.0))
    >>> decision.command.name, decision.reason.name, round(decision.value, 2), decision.status.name
    ('BRAKE', 'CRITERION', 0.48, 'CLOSING')
    >>> print(decision)
    BRAKE (CRITERION): IttcThreshold: 0.48 < 1.5 s; return 0 at 2.00 m, 1.92 m clear, closing at 4.00 m/s, TTC 0.48 s
    >>> later = controller.update(0.05)                      # no frame came: the threat is that of the last one
    >>> later.status is None, later.threats is None, later.threat == decision.threat
    (True, True, True)
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
    status: Status | None
    threats: Threats | None

    def __str__(self) -> str:
        """Describe the decision in one line."""
        said = [_IN_WORDS[self.reason]] if self.reason in _IN_WORDS else []
        if self.criterion is not None and math.isfinite(self.value) and self.reason not in _OF_SENSORS:
            sign = "<" if self.value < self.threshold else ">="
            compared = f"{self.value:.2f} {sign} {self.threshold:.3g} {self.criterion.unit}"
            said += [f"{self.criterion.name}: {compared}", str(self.threat)]
        head = f"{self.command.name} ({self.reason.name})"
        return f"{head}: {'; '.join(said)}" if said else head
