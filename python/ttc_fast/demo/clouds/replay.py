"""A log through ``ttc_from_clouds``, each frame with the one before."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

from ttc_fast import Detection, Gate, KthSmallest, Minimum, ttc_from_clouds
from ttc_fast.demo.replay import Replay, collect
from ttc_fast.logs import CloudFrame, forward_left_up

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from ttc_fast import CloudTTC
    from ttc_fast.demo.clouds.estimators import Estimator
    from ttc_fast.logs import CloudLog, Lidar

STRAY = 0.1  # m; nearest points so far in front of the robust distance are worth telling of


TOO_LONG = "TTC is too long by (sensor to bumper) / closing speed"
"""What distances from the sensor mean for the TTC."""


class CloudRow(NamedTuple):
    """What one frame gave.

    Attributes
    ----------
    frame : int
        Its place in the log, from 0.
    stamp : float
        s.
    seen : CloudTTC
        Of this frame and the one before.
    plain : CloudTTC
        The same from the plain nearest points.
    """

    frame: int
    stamp: float
    seen: CloudTTC
    plain: CloudTTC

    @property
    def ttc(self) -> float:
        """TTC from the robust distances, s."""
        return self.seen.ttc

    @property
    def stray(self) -> float:
        """How far the plain nearest point lies in front of the robust distance, m; 0 where one of them is missing."""
        current = self.seen.current
        return current.x - current.nearest_x if current.detection == Detection.FOUND else 0.0


@dataclass(frozen=True)
class CloudReplay(Replay[CloudRow, CloudFrame]):
    """A log replayed, as ``Replay``, and what the rows rest on.

    Attributes
    ----------
    gate : Gate
        Which points counted.
    estimator : estimator object
        How outliers were survived.
    front_offset : float
        From the sensor to the bumper, m.
    clock : str
        Where the stamps come from.
    """

    gate: Gate
    estimator: Estimator
    front_offset: float
    clock: str

    @property
    def start(self) -> str:
        """What distances start from, for people."""
        return "bumper" if self.front_offset else "sensor"

    @cached_property
    def outvoted(self) -> list[CloudRow]:
        """Frames with a stray point in front of what is there."""
        return [row for row in self.rows if row.stray > STRAY]

    @property
    def worst_outvoted(self) -> CloudRow | None:
        """That of them in which the plain nearest points would have said least; None when there are none."""
        return min(self.outvoted, key=lambda row: row.plain.ttc, default=None)


def corridor(
    lidar: Lidar,
    *,
    gate_x: tuple[float, float] | None = None,
    lane_width: float = 4.0,
    height: tuple[float, float] | None = None,
    min_intensity: float | None = None,
) -> Gate:
    """Make the gate that a vehicle with this lidar needs: its lane, from the bumper on, above the road.

    Parameters
    ----------
    lidar : Lidar
        Where the lidar sits, how high above the road above all.
    gate_x : (float, float), optional
        From and to which distance ahead of the sensor, m; by default all that is not the vehicle itself.
    lane_width : float
        m, half of it to each side.
    height : (float, float), optional
        From and to which height above the road, m; by default where vehicles are seen well.
    min_intensity : float, optional
        Of a point that counts, in the units stored.

    Returns
    -------
    Gate

    Raises
    ------
    ValueError
        If bounds are swapped.

    Examples
    --------
    >>> from ttc_fast.demo.clouds.replay import corridor
    >>> from ttc_fast.logs import Lidar
    >>> corridor(Lidar(sensor_height=1.75, front_offset=2.0, own_reach=2.0), height=(0.25, 2.25))
    Gate(x=(2.0, inf), y=(-2.0, 2.0), z=(-1.5, 0.5))
    """
    if lidar.sensor_height is None:
        raise ValueError("it is not known how high the lidar sits above the road; say it with --sensor-height, in m")
    low, high = height or lidar.height
    return Gate.above_road(
        lidar.sensor_height,
        low,
        high,
        x=gate_x or (lidar.own_reach, math.inf),
        y=(-lane_width / 2, lane_width / 2),
        intensity=None if min_intensity is None else (min_intensity, math.inf),
    )


def replay(
    log: CloudLog,
    frames: Iterable[CloudFrame] | None = None,
    *,
    gate: Gate | None = None,
    estimator: Estimator | None = None,
    front_offset: float | None = None,
    rate: float | None = None,
    threshold: float = 2.5,
) -> CloudReplay:
    """Run a log through ``ttc_from_clouds``.

    Parameters
    ----------
    log : CloudLog
        What to replay.
    frames : iterable of CloudFrame, optional
        Its frames, if something watches the progress on the way.
    gate : Gate, optional
        Which points count; ``corridor`` of the log's lidar by default.
    estimator : estimator object, optional
        How outliers are survived; ``KthSmallest(10)`` by default.
    front_offset : float, optional
        From the sensor to the bumper instead of the log's, m.
    rate : float, optional
        Frames per second instead of the log's stamps.
    threshold : float
        TTC below which a frame is marked, s.

    Returns
    -------
    CloudReplay

    Raises
    ------
    LogError
        If the log is damaged or empty.
    ValueError
        If the gate bounds an intensity that the clouds lack, or the offset is not finite.

    Examples
    --------
    >>> from ttc_fast.demo import SAMPLES
    >>> from ttc_fast.demo.clouds.replay import replay
    >>> from ttc_fast.logs import open_log
    >>> result = replay(open_log(SAMPLES["clouds"]))
    >>> [(row.frame, round(row.stray, 1)) for row in result.outvoted]
    [(2, 1.6), (3, 0.7), (7, 2.4), (11, 0.9)]
    """
    gate = gate or corridor(log.lidar)
    estimator = estimator or KthSmallest(10)
    front_offset = log.lidar.front_offset if front_offset is None else front_offset

    def play() -> Iterator[tuple[CloudRow, CloudFrame]]:
        before = None
        for number, recorded in enumerate(log if frames is None else frames):
            frame = recorded._replace(points=forward_left_up(recorded.points, log.lidar.axes))
            if rate is not None:
                frame = frame._replace(stamp=number / rate)
            # Nothing was seen before the first frame, which makes it a WARMING_UP.
            previous, dt = (before.points, frame.stamp - before.stamp) if before else (frame.points[:0], 1.0)
            seen, plain = (
                ttc_from_clouds(previous, frame.points, dt, gate=gate, estimator=by, front_offset=front_offset)
                for by in (estimator, Minimum())
            )
            yield CloudRow(number, frame.stamp, seen, plain), frame
            before = frame

    clock = log.clock if rate is None else f"{rate:g} frames a second"
    return CloudReplay(*collect(log.path, play()), threshold, gate, estimator, front_offset, clock)
