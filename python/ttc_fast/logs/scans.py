"""What a log of laser scans gives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, runtime_checkable

from ttc_fast.logs.log import Log

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Scanner:
    """The scanner of a log, and where it sits: arguments of ``ScanTTC``, by their names there.

    Attributes
    ----------
    angle_min, angle_increment : float
        rad, in the sensor frame.
    beams : int
        Readings of each scan.
    range_min, range_max : float
        m; finite readings outside are discarded.
    mount : (float, float, float)
        x, y (m) and yaw (rad) in the vehicle frame.
    outline : (float, float, float, float) or None
        x_rear, x_front, y_right, y_left of the vehicle, m; None when the log does not say.
    """

    angle_min: float
    angle_increment: float
    beams: int
    range_min: float
    range_max: float
    mount: tuple[float, float, float] = (0.0, 0.0, 0.0)
    outline: tuple[float, float, float, float] | None = None


class ScanFrame(NamedTuple):
    """One scan and the motion of the vehicle at that time.

    Attributes
    ----------
    stamp : float
        s, since whatever the log counts from.
    ranges : ndarray, float32 or float64, shape (beams,)
        m, as recorded: error codes, NaN and inf included. Stays as it is when the log is read on.
    speed : float or None
        Of the vehicle's origin, forward, m/s, negative when reversing; None when the log does not know, or no longer.
    yaw_rate : float
        Counter-clockwise, rad/s; 0 when the log does not know.
    speed_age : float
        How much older than the scan the odometry is that the motion is from, s; 0 where both were recorded together or
        the user said the speed, inf where there was none yet.
    """

    stamp: float
    ranges: NDArray[Any]
    speed: float | None
    yaw_rate: float = 0.0
    speed_age: float = 0.0


@runtime_checkable
class ScanLog(Log[ScanFrame], Protocol):
    """A log of laser scans."""

    @property
    def scanner(self) -> Scanner:
        """The scanner of every frame."""

    @property
    def clock(self) -> str:
        """Where the stamps come from, for people."""

    @property
    def motion(self) -> str:
        """Where the speeds come from, for people."""
