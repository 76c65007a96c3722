"""What a log of point clouds gives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from ttc_fast.logs.log import Log

if TYPE_CHECKING:
    from numpy.typing import NDArray


Axes = tuple[str, str, str]
REP_103: Axes = ("x", "y", "z")


@dataclass(frozen=True)
class Lidar:
    """Where the lidar of a log sits on its vehicle.

    Attributes
    ----------
    sensor_height : float or None
        Above the road, m; None when the log does not say.
    front_offset : float
        From the sensor to the bumper, m; 0 when the log does not say, so that distances are those from the sensor.
    own_reach : float
        Points ahead that are nearer than this are the vehicle itself, m.
    height : (float, float)
        From and to which height above the road other vehicles are seen well, m.
    axes : (str, str, str)
        Which stored coordinates of the points are forward, left and up, as in ``Gate``.
    """

    sensor_height: float | None
    front_offset: float = 0.0
    own_reach: float = 0.0
    height: tuple[float, float] = (0.2, 2.0)
    axes: Axes = REP_103


class CloudFrame(NamedTuple):
    """One cloud.

    Attributes
    ----------
    stamp : float
        s, since whatever the log counts from.
    points : ndarray, float32 or float64, shape (N, 3) or wider; or records with fields x, y and z
        x, y, z (m), and perhaps the intensity, as recorded; ``Lidar.axes`` says which of them is forward. Stays as it
        is when the log is read on.
    speed : float or None
        Of the vehicle's origin, forward, m/s, negative when reversing; None when the log does not know, or no longer.
    yaw_rate : float
        Counter-clockwise, rad/s; 0 when the log does not know.
    speed_age : float
        How much older than the cloud the odometry is that the motion is from, s; 0 where the user said the speed, inf
        where there was none yet.
    """

    stamp: float
    points: NDArray[Any]
    speed: float | None = None
    yaw_rate: float = 0.0
    speed_age: float = 0.0


@runtime_checkable
class CloudLog(Log[CloudFrame], Protocol):
    """A log of point clouds."""

    @property
    def lidar(self) -> Lidar:
        """The lidar of every frame."""

    @property
    def clock(self) -> str:
        """Where the stamps come from, for people."""

    @property
    def motion(self) -> str:
        """Where the speeds come from, for people."""


def forward_left_up(points: NDArray[Any], axes: Axes = REP_103) -> NDArray[Any]:
    """Return points as plain rows of x forward, y left, z up and perhaps the intensity, to look at; a copy if needed.

    Parameters
    ----------
    points : ndarray
        Of a ``CloudFrame``.
    axes : (str, str, str)
        Of its ``Lidar``.

    Returns
    -------
    ndarray, shape (N, 3) or wider

    Examples
    --------
    >>> import numpy as np
    >>> from ttc_fast.logs.clouds import forward_left_up
    >>> forward_left_up(np.array([[1.0, 2.0, 3.0]]), ("y", "-x", "z"))
    array([[ 2., -1.,  3.]])
    """
    if points.dtype.names is None and axes == REP_103:
        return points.reshape(-1, points.shape[-1])
    columns = _columns(points)
    oriented = [-columns[axis[1:]] if axis.startswith("-") else columns[axis] for axis in axes]
    return np.column_stack([*oriented, *([columns["intensity"]] if "intensity" in columns else [])])


def _columns(points: NDArray[Any]) -> dict[str, NDArray[Any]]:
    names = ("x", "y", "z", "intensity")
    if points.dtype.names is None:
        return {name: points[..., i].ravel() for i, name in enumerate(names[: points.shape[-1]])}
    return {name: points[name].ravel() for name in names if name in points.dtype.names}
