"""What a log of point clouds gives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, runtime_checkable

from ttc_fast.logs.log import Log

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Lidar:
    """Where the lidar of a log sits on its vehicle.

    Attributes
    ----------
    sensor_height : float
        Above the road, m.
    front_offset : float
        From the sensor to the bumper, m; 0 when the log does not say, so that distances are those from the sensor.
    own_reach : float
        Points ahead that are nearer than this are the vehicle itself, m.
    height : (float, float)
        From and to which height above the road other vehicles are seen well, m.
    """

    sensor_height: float
    front_offset: float = 0.0
    own_reach: float = 0.0
    height: tuple[float, float] = (0.2, 2.0)


class CloudFrame(NamedTuple):
    """One cloud.

    Attributes
    ----------
    stamp : float
        s, since whatever the log counts from.
    points : ndarray, float32 or float64, shape (N, 3) or wider
        x forward, y left, z up (m), and perhaps the intensity, as recorded. Stays as it is when the log is read on.
    """

    stamp: float
    points: NDArray[Any]


@runtime_checkable
class CloudLog(Log[CloudFrame], Protocol):
    """A log of point clouds. Every cloud has the same dtype."""

    @property
    def lidar(self) -> Lidar:
        """The lidar of every frame."""

    @property
    def clock(self) -> str:
        """Where the stamps come from, for people."""
