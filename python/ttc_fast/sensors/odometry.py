"""How the vehicle moves, by odometry: its twist, where nothing is wrong with that.

An odometry says the motion twice: as a twist, which is to be in the frame of the vehicle [nav_msgs/Odometry], and by
its poses. Where both are there and the vehicle moves clearly, they are compared over intervals of half a second. Three
intervals in a row that say the same decide:

- The poses move as the twist says: the twist is used.
- The poses move as the twist says only if it is in the frame of the world, as simulators publish it: it is turned into
  the frame of the vehicle.
- Neither holds, as with a wrong sign or other units: nobody knows which of the two is right, so the speed is unknown,
  and not knowing it brakes.

A jump of the pose spoils one or two intervals, and changes nothing. Where the twist says that the vehicle stands, the
poses say how it moves: nobody filled in the velocity, though a yaw rate, as of an IMU, may be there.
"""

from __future__ import annotations

import math
from collections import deque
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

from ttc_fast.sensors.clock import SET_BACK
from ttc_fast.sensors.oddities import RefusedError, Tally

if TYPE_CHECKING:
    from collections.abc import Iterable

MAX_AGE = 0.5
"""s; older odometry says nothing about the speed now, unless the user says otherwise."""
SPAN = 0.2
"""s; a motion is derived from poses that are this far apart at least, where there are any: stamps jitter by some ms."""
INTERVAL = 0.5
"""s; a twist is compared with poses over this at least, as poses jitter by some cm."""
ROUNDING = 1e-3
"""s; intervals may be this much shorter, so that stamps which are rounded in another way end them alike."""
PAUSE = 1.0
"""s; poses that are further apart than this are not compared with a twist."""
CLEARLY = 0.3
"""m/s; twist and poses are compared where one of them says that the vehicle is faster than this."""
ALIKE = (0.1, 0.25)
"""m/s, and a part of the greater speed: two velocities that differ by less agree."""
STANDS = 1e-3
"""m/s and rad/s; a velocity below this says that the vehicle stands, or was not filled in."""
IN_A_ROW = 3
"""The number of intervals in a row that decide what a twist is."""
KEPT = 256  # entries: those within the delay of a frame, from a sensor until it is recorded
VEHICLE, WORLD, WRONG = "of the vehicle", "of the world", "wrong"


class Pose(NamedTuple):
    """Where the vehicle is, m and rad."""

    x: float
    y: float
    yaw: float


class Twist(NamedTuple):
    """How the vehicle moves, in its own frame: forward and to the left, m/s, and counter-clockwise, rad/s."""

    speed: float
    yaw_rate: float
    lateral_speed: float


class Motion(NamedTuple):
    """How the vehicle moves at the time of a frame.

    Attributes
    ----------
    speed : float or None
        Forward, m/s, negative when reversing; None when unknown.
    yaw_rate : float
        Counter-clockwise, rad/s; 0 when unknown.
    speed_age : float
        How much older than the frame the odometry is, s; inf when there was none yet.
    lateral_speed : float
        To the left, m/s; 0 when unknown.
    """

    speed: float | None
    yaw_rate: float
    speed_age: float
    lateral_speed: float = 0.0


UNKNOWN = Motion(None, 0.0, math.inf)


FASTEST = 1e6
"""No vehicle moves or turns so fast, m/s and rad/s: it is the number of a sensor that is broken."""


def no_motion(*motion: float, stamp: float = 0.0) -> str:
    """Return why no vehicle moves so, or an empty text: speeds are finite, as is the stamp, and below ``FASTEST``."""
    if not math.isfinite(sum(motion) + stamp):
        return "is not finite"
    return "" if all(-FASTEST < each < FASTEST for each in motion) else "is too fast, no motion of a vehicle"


class OdometryReader:
    """Checks the odometry of one topic, and says what twist it comes to.

    Parameters
    ----------
    name : str
        The topic, which oddities are counted by.
    odd : Tally
        Counts what is odd.

    Examples
    --------
    A simulator publishes the twist in the frame of the world. The vehicle looks and drives along -x:

    >>> import math
    >>> from ttc_fast.sensors.oddities import Tally
    >>> from ttc_fast.sensors.odometry import OdometryReader, Pose
    >>> reader = OdometryReader("/odom", Tally())
    >>> for i in range(20):
    ...     twist = reader.read(0.1 * i, Pose(-0.1 * i, 0.0, math.pi), speed=-1.0)
    >>> round(twist.speed, 3)
    1.0
    """

    def __init__(self, name: str = "odometry", odd: Tally | None = None) -> None:
        self._name = name
        self._odd = Tally() if odd is None else odd
        self._poses: deque[tuple[float, Pose]] = deque()
        self._compared = TwistCheck()
        self._newest = -math.inf
        """The stamp of the newest odometry, s."""

    def read(
        self,
        stamp: float,
        pose: Pose | None = None,
        speed: float | None = None,
        yaw_rate: float = 0.0,
        lateral_speed: float = 0.0,
    ) -> Twist | None:
        """Return the twist; None where it is unknown, or where newer odometry has come before.

        Raise RefusedError if a number is not finite, or if no vehicle moves so fast.
        """
        why_not = no_motion(speed or 0.0, yaw_rate, lateral_speed, stamp=stamp)
        if why_not:
            numbers = f"speed {speed}, yaw rate {yaw_rate}, lateral speed {lateral_speed}"
            raise RefusedError(f"{why_not}: {numbers}, stamp {stamp}")
        if 0.0 < self._newest - stamp <= SET_BACK:
            self._odd.count(f"{self._name}, order", "is older than what came before, and is not used")
            return None
        self._newest = stamp
        said = None if speed is None else Twist(speed, yaw_rate, lateral_speed)
        if pose is None:
            return said
        if not math.isfinite(sum(pose)):
            self._odd.count(f"{self._name}, pose", "is not finite; the twist is used without it")
            return said
        is_first, before = not self._poses, self._pose_before(stamp)
        self._poses.append((stamp, pose))
        if said is None or math.hypot(said.speed, said.lateral_speed) < STANDS:  # the poses tell
            derived = said if is_first else None
            if before is not None:
                derived = between(before[1], pose, stamp - before[0])
                if abs(yaw_rate) >= STANDS:
                    derived = derived._replace(yaw_rate=yaw_rate)
            if derived is not None and (why_not := no_motion(*derived)):
                raise RefusedError(f"{why_not}: from pose to pose the vehicle would move by {derived}")
            return derived
        check = self._compared
        check.add(stamp, pose, said)
        if check.kind is VEHICLE:
            return said
        self._odd.count(f"{self._name}, twist", check.why)
        return in_frame_of(pose, said) if check.kind is WORLD else None

    def not_used(self, why: str) -> None:
        """Count a frame for which the odometry says nothing because of its stamp."""
        self._odd.count(f"{self._name}, clock", why)

    def _pose_before(self, stamp: float) -> tuple[float, Pose] | None:
        """Return the latest pose that is old enough, or the oldest; and forget those before it.

        After a pause there is none: how the vehicle moved during it says nothing about its speed now.
        """
        poses = self._poses
        if poses and not 0.0 < stamp - poses[-1][0] <= PAUSE + ROUNDING:
            poses.clear()  # after a pause; or the clock was set back, or nothing has passed
        while len(poses) > 1 and poses[1][0] <= stamp - SPAN + ROUNDING:
            poses.popleft()
        return poses[0] if poses else None


class TwistCheck:
    """Compares twists with the poses of the same odometry, interval by interval.

    Attributes
    ----------
    kind : str
        What the twist is: ``VEHICLE``, ``WORLD`` or ``WRONG``.
    why : str
        A sentence that says so, where it is not ``VEHICLE``.
    """

    def __init__(self) -> None:
        self.kind, self.why = VEHICLE, ""
        self._interval: list[tuple[float, Pose, Twist]] = []
        self._vote, self._votes = VEHICLE, 0

    def add(self, stamp: float, pose: Pose, said: Twist) -> None:
        """Take up a pose with its twist; at the end of an interval, compare."""
        interval = self._interval
        if interval and not 0.0 < stamp - interval[-1][0] <= PAUSE:
            interval.clear()
        interval.append((stamp, pose, said))
        if stamp - interval[0][0] >= INTERVAL - ROUNDING:
            self._compare()
            del interval[:-1]

    def _compare(self) -> None:
        """Compare the velocities of an interval in the frame of the world."""
        (begin, first, _), (end, last, _) = self._interval[0], self._interval[-1]
        moved = ((last.x - first.x) / (end - begin), (last.y - first.y) / (end - begin))
        if not any(moved):  # it stands, or nobody filled in the poses
            return
        of_world = mean((stamp, said.speed, said.lateral_speed) for stamp, _, said in self._interval)
        of_vehicle = mean((stamp, *turned(said, pose.yaw)) for stamp, pose, said in self._interval)
        if max(math.hypot(*moved), math.hypot(*of_world)) < CLEARLY:
            return
        fits_vehicle, fits_world = agree(of_vehicle, moved), agree(of_world, moved)
        vote = VEHICLE if fits_vehicle else WORLD if fits_world else WRONG
        if fits_vehicle and fits_world and WRONG not in (self.kind, self._vote):
            return  # it looks along x, where both frames are one
        self._votes = self._votes + 1 if vote is self._vote else 1
        self._vote = vote
        if self._votes < IN_A_ROW or vote is self.kind:
            return
        self.kind = vote
        middle = self._interval[len(self._interval) // 2][1].yaw
        ahead, left = turned(Twist(moved[0], 0.0, moved[1]), -middle)
        poses = f"the poses of the same odometry move at {ahead:.2f} m/s forward and {left:.2f} m/s to the left"
        text = f"its twist says {of_world[0]:.2f} and {of_world[1]:.2f} m/s, and {poses}: "
        self.why = text + (
            "the twist is in the frame of the world, and is turned into that of the vehicle"
            if vote is WORLD
            else "one of them is wrong, so the speed is taken as unknown"
        )


def mean(samples: Iterable[tuple[float, float, float]]) -> tuple[float, float]:
    """Return the mean of a velocity over time, by trapezoids between samples of stamp, x and y.

    Examples
    --------
    >>> from ttc_fast.sensors.odometry import mean
    >>> mean([(0.0, 1.0, 0.0), (1.0, 3.0, 0.0), (2.0, 3.0, 0.0)])
    (2.5, 0.0)
    """
    samples = list(samples)
    x = y = 0.0
    for (before, x0, y0), (after, x1, y1) in pairwise(samples):
        x += (x0 + x1) / 2.0 * (after - before)
        y += (y0 + y1) / 2.0 * (after - before)
    duration = samples[-1][0] - samples[0][0]
    return x / duration, y / duration


def agree(one: tuple[float, float], other: tuple[float, float]) -> bool:
    """Return whether two velocities are the same, but for noise."""
    least, part = ALIKE
    greater = max(math.hypot(*one), math.hypot(*other))
    return math.hypot(one[0] - other[0], one[1] - other[1]) <= least + part * greater


def turned(twist: Twist, angle: float) -> tuple[float, float]:
    """Return the velocity of a twist turned by an angle, rad."""
    cos, sin = math.cos(angle), math.sin(angle)
    return twist.speed * cos - twist.lateral_speed * sin, twist.speed * sin + twist.lateral_speed * cos


def in_frame_of(pose: Pose, twist: Twist) -> Twist:
    """Return a twist of the frame of the world in that of the vehicle."""
    speed, lateral_speed = turned(twist, -pose.yaw)
    return Twist(speed, twist.yaw_rate, lateral_speed)


def between(before: Pose, after: Pose, dt: float) -> Twist:
    """Return the twist from one pose to the next, ``dt`` s later.

    On an arc the way points along the mean of both headings, so that is forward.

    Examples
    --------
    >>> from ttc_fast.sensors.odometry import Pose, between
    >>> between(Pose(0.0, 0.0, 0.0), Pose(-1.0, 0.0, 0.0), 0.5)
    Twist(speed=-2.0, yaw_rate=0.0, lateral_speed=0.0)
    """
    turn = math.remainder(after.yaw - before.yaw, 2.0 * math.pi)
    heading = before.yaw + turn / 2.0
    cos, sin = math.cos(heading), math.sin(heading)
    x, y = after.x - before.x, after.y - before.y
    return Twist((x * cos + y * sin) / dt, turn / dt, (y * cos - x * sin) / dt)


class Odometer:
    """Odometry as it comes, and what it says at the time of a frame: by what was recorded until then, never later.

    Parameters
    ----------
    speed : float, optional
        The known speed, instead of that of the odometry, m/s.
    max_age : float, optional
        The age from which the speed is unknown, s.
    reader : OdometryReader, optional
        Checks the odometry.

    Examples
    --------
    >>> from ttc_fast.sensors.odometry import Odometer, Pose
    >>> odometer = Odometer()
    >>> odometer.update(1.0, Pose(0.0, 0.0, 0.0), speed=2.0, yaw_rate=0.1)
    >>> odometer.at(1.25)
    Motion(speed=2.0, yaw_rate=0.1, speed_age=0.25, lateral_speed=0.0)
    >>> odometer.at(0.9).speed is None
    True
    """

    def __init__(
        self, speed: float | None = None, max_age: float | None = None, reader: OdometryReader | None = None
    ) -> None:
        self._speed = speed
        self._max_age = MAX_AGE if max_age is None else max_age
        self._reader = OdometryReader() if reader is None else reader
        self._recent: deque[tuple[float, Twist, bool]] = deque(maxlen=KEPT)
        self._last_unknown = -math.inf
        """The stamp of the last odometry that was refused or has no known twist, which is said where it is read."""

    def update(
        self,
        stamp: float,
        pose: Pose | None = None,
        speed: float | None = None,
        yaw_rate: float = 0.0,
        lateral_speed: float = 0.0,
        *,
        came: bool = False,
    ) -> None:
        """Take in odometry; raise RefusedError, and take in nothing, if a number is not finite.

        ``came`` says that the stamp is only when it came, so that no frame which comes later is older.
        """
        last_unknown, self._last_unknown = self._last_unknown, stamp  # unless what follows knows it
        twist = self._reader.read(stamp, pose, speed, yaw_rate, lateral_speed)
        if twist is not None:
            self._recent.append((stamp, twist, came))
            self._last_unknown = last_unknown

    def at(self, stamp: float) -> Motion:
        """Return the latest motion that is not newer than the stamp."""
        motion = UNKNOWN
        for then, twist, came in reversed(self._recent):
            if then <= stamp or came:
                age = max(stamp - then, 0.0)
                motion = Motion(None, 0.0, age)
                if age <= self._max_age:
                    motion = Motion(twist.speed, twist.yaw_rate, age, twist.lateral_speed)
                elif not then < self._last_unknown <= stamp:
                    self._reader.not_used(f"is {age:.3g} s older than the frame, so the speed is unknown")
                break
        else:
            if self._recent:
                self._reader.not_used("is stamped later than the frame that came after it, and is not used")
        return motion if self._speed is None else Motion(self._speed, motion.yaw_rate, 0.0)
