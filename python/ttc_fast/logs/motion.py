"""The motion of the vehicle at the time of a frame, from the odometry before it."""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

MAX_AGE = 0.5
"""Odometry that is older than this says nothing about the speed, unless the user says otherwise, s."""
SPAN = 0.2
"""Poses are compared over this time at least, if there are any so old, because stamps jitter by some ms; s."""
KEPT = 256  # entries; they cover the delay of a frame from the sensor until it is recorded


class Pose(NamedTuple):
    """Position and heading of the vehicle, m and rad."""

    x: float
    y: float
    yaw: float


class Motion(NamedTuple):
    """How the vehicle moves.

    Attributes
    ----------
    speed : float or None
        The forward speed, m/s, negative when reversing; None when unknown.
    yaw_rate : float
        The yaw rate, counter-clockwise, rad/s; 0 when unknown.
    speed_age : float
        How much older than the frame the odometry is, s; inf when there was none yet.
    """

    speed: float | None
    yaw_rate: float
    speed_age: float


UNKNOWN = Motion(None, 0.0, math.inf)


class Odometer:
    """Odometry in the order of recording, and the motion at the time of a frame by what was recorded until then.

    Parameters
    ----------
    speed : float, optional
        The speed that holds instead of that of the odometry, m/s.
    max_age : float, optional
        The speed is unknown where the odometry is older than this, s.

    Examples
    --------
    >>> from ttc_fast.logs.motion import Odometer, Pose
    >>> odometer = Odometer()
    >>> odometer.update(1.0, Pose(0.0, 0.0, 0.0), speed=2.0, yaw_rate=0.1)
    True
    >>> odometer.at(1.25)
    Motion(speed=2.0, yaw_rate=0.1, speed_age=0.25)
    >>> odometer.at(0.9).speed is None
    True
    """

    def __init__(self, speed: float | None = None, max_age: float | None = None) -> None:
        self._speed = speed
        self._max_age = MAX_AGE if max_age is None else max_age
        self._poses: deque[tuple[float, Pose]] = deque()
        self._recent: deque[tuple[float, float, float]] = deque(maxlen=KEPT)

    def update(self, stamp: float, pose: Pose, speed: float | None = None, yaw_rate: float = 0.0) -> bool:
        """Add odometry; without a speed, or where it was not filled in, the speed is that between its poses.

        A speed and a yaw rate of exactly zero while the pose changes were not filled in. Returns False, and adds
        nothing, if a number is not finite.
        """
        if not math.isfinite(sum(pose) + (speed or 0.0) + yaw_rate):
            return False
        before = self._pose_before(stamp)
        if not speed and yaw_rate == 0.0 and before is not None:
            speed, yaw_rate = between(before[1], pose, stamp - before[0])
        self._poses.append((stamp, pose))
        if speed is not None:
            self._recent.append((stamp, speed, yaw_rate))
        return True

    def _pose_before(self, stamp: float) -> tuple[float, Pose] | None:
        """Return the latest pose that is old enough, or the oldest; and forget those before it."""
        poses = self._poses
        if poses and not poses[-1][0] < stamp:  # the clock was set back, or nothing has passed
            poses.clear()
        while len(poses) > 1 and poses[1][0] <= stamp - SPAN:
            poses.popleft()
        return poses[0] if poses else None

    def at(self, stamp: float) -> Motion:
        """Return the latest motion that is not newer than the stamp."""
        motion = UNKNOWN
        for then, speed, yaw_rate in reversed(self._recent):
            if then <= stamp:
                age = stamp - then
                motion = Motion(speed, yaw_rate, age) if age <= self._max_age else Motion(None, 0.0, age)
                break
        return motion if self._speed is None else Motion(self._speed, motion.yaw_rate, 0.0)


def between(before: Pose, after: Pose, dt: float) -> tuple[float, float]:
    """Return speed and yaw rate from one pose to the next, ``dt`` s later.

    The speed is the way from one to the other over the time, and negative if it leads backwards. On an arc the way
    points along the mean of both headings.

    Examples
    --------
    >>> from ttc_fast.logs.motion import Pose, between
    >>> between(Pose(0.0, 0.0, 0.0), Pose(-1.0, 0.0, 0.0), 0.5)
    (-2.0, 0.0)
    """
    turn = math.remainder(after.yaw - before.yaw, 2.0 * math.pi)
    heading = before.yaw + turn / 2.0
    ahead = (after.x - before.x) * math.cos(heading) + (after.y - before.y) * math.sin(heading)
    return ahead / dt, turn / dt
