"""The settings by which a controller turns what criteria say into commands."""

from __future__ import annotations

from dataclasses import dataclass

from ttc_fast._settings import Choice, Count, Number, Votes, check_fields, setting
from ttc_fast.brake.decision import Command

SECONDS = Number(unit="s", least=0.0)
BETWEEN_BEAMS = Number(unit="s", least=0.0, most=1.0)
TIMEOUT = Number(unit="s", positive=True)
WARN_AT = Number(least=1.0, reason="it multiplies the thresholds at which it brakes")
RELEASE_AT = Number(least=1.0, reason="below 1 it would let go while a criterion triggers")
WHEN_BLIND = Choice(options=(Command.BRAKE, Command.WARN), reason="blind is not safe")


@dataclass(frozen=True)
class BrakeSettings:
    """Settings of a ``BrakeController``, which describes them.

    Raises
    ------
    ValueError
        If a setting is out of range.
    TypeError
        If a setting is of the wrong type.
    """

    time_increment: float = setting(0.0, BETWEEN_BEAMS, "Time between two beams of a scan, as in a LaserScan message.")
    horizon: float = setting(5.0, TIMEOUT, "The path of the scan is looked at this far ahead.", (0.0, 60.0))
    trigger: tuple[float, float] = setting(
        (0.75, 0.1), Votes(), "(share, seconds) or (N, M): it brakes when so large a share of these frames triggers."
    )
    release: tuple[float, float] = setting(
        (0.6, 0.125), Votes(), "(share, seconds) or (N, M): it lets go when so large a share of these frames is clear."
    )
    warn_at: float = setting(1.5, WARN_AT, "The controller warns below this multiple of a threshold.", (1.0, 100.0))
    release_at: float = setting(
        1.25, RELEASE_AT, "A frame is clear from this multiple of every threshold.", (1.0, 100.0)
    )
    hold: float = setting(0.5, SECONDS, "A brake is held this long after the last frame that triggered.", (0.0, 60.0))
    deceleration: float = setting(
        6.0, Number(unit="m/s^2", positive=True), "A decision to brake asks for this deceleration.", (0.0, 100.0)
    )
    standstill_speed: float = setting(
        0.05, Number(unit="m/s", least=0.0), "Below this speed the vehicle stands.", (0.0, 10.0)
    )
    creep_speed: float = setting(
        0.0, Number(unit="m/s", least=0.0), "Up to this speed the path need not be seen.", (0.0, 10.0)
    )
    sensor_timeout: float = setting(0.3, TIMEOUT, "Sensor data of this age are too old to be safe.", (0.0, 10.0))
    motion_timeout: float = setting(0.5, TIMEOUT, "Odometry of this age is not used any more.", (0.0, 10.0))
    min_returns: int = setting(0, Count(), "With fewer valid readings a frame is blind.")
    when_blind: Command = setting(Command.BRAKE, WHEN_BLIND, "What is done when the sensors do not see: brake or warn.")

    def __post_init__(self) -> None:
        check_fields(self)
