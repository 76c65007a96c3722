"""Where a sensor sits on the vehicle, by the static transforms of ROS: ``/tf_static``.

A transform places a frame in its parent, and a chain of them places the sensor in the frame of the vehicle
[tf2_msgs/TFMessage, REP 105]. A scanner is taken for planar: of its place, x, y and yaw count, and whether it hangs
upside down. Frames that are named ``*_optical_frame`` have z forward, x right and y down [REP 103].
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from ttc_fast.ros_messages import Transform

OPTICAL = ("z", "-x", "-y")
"""The coordinates of an optical frame that are forward, left and up."""
FROM_OPTICAL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Turns points of an optical frame into forward, left and up."""
UPRIGHT = math.radians(3.0)
"""rad; a scanner that is tilted by less than this is level."""
FALLEN = math.radians(20.0)
"""rad; a scanner that is tilted by more than this does not scan the plane in which the vehicle moves."""


class Mount(NamedTuple):
    """Where a sensor sits in the frame of the vehicle.

    Attributes
    ----------
    place : (float, float, float)
        x, y (m) and yaw (rad), as ``ScanTTC`` has them.
    upside_down : bool
        Whether it hangs upside down.
    text : str
        Where it was found, for people.
    turn, shift : ndarray, shapes (3, 3) and (3,)
        Points of the sensor, forward, left and up, are ``turn @ point + shift`` in the frame of the vehicle, m.
    """

    place: tuple[float, float, float]
    upside_down: bool
    text: str
    turn: NDArray[np.float64]
    shift: NDArray[np.float64]


class Transforms:
    """The static transforms that came.

    Examples
    --------
    A scanner that hangs upside down below a mast:

    >>> from ttc_fast.ros_messages import Transform
    >>> from ttc_fast.sensors.transforms import Transforms
    >>> known = Transforms()
    >>> known.add([Transform("base_link", "mast", (0.2, 0.0, 0.5), (0.0, 0.0, 0.0, 1.0))])
    True
    >>> known.add([Transform("mast", "laser", (0.0, 0.1, -0.1), (1.0, 0.0, 0.0, 0.0))])
    True
    >>> mount = known.mount("base_link", "laser")
    >>> mount.place, mount.upside_down
    ((0.2, 0.1, 0.0), True)
    """

    def __init__(self) -> None:
        self._parents: dict[str, tuple[str, NDArray[np.float64]]] = {}

    def add(self, transforms: Iterable[Transform]) -> bool:
        """Take up transforms; return whether any of them was new. Those that make no sense are left out."""
        new: dict[str, tuple[str, NDArray[np.float64]]] = {}
        for parent, child, translation, rotation in transforms:
            size = math.sqrt(sum(each * each for each in rotation))
            if not (0.0 < size < math.inf and math.isfinite(sum(translation))):
                continue
            placed = np.eye(4)
            placed[:3, :3] = turn_of(*(each / size for each in rotation))
            placed[:3, 3] = translation
            name, before = child.lstrip("/"), self._parents.get(child.lstrip("/"))
            if before is None or before[0] != parent.lstrip("/") or not np.array_equal(before[1], placed):
                new[name] = parent.lstrip("/"), placed
        self._parents.update(new)  # all of a message or, where one of them raises, none
        return bool(new)

    def __len__(self) -> int:
        return len(self._parents)

    def mount(self, base: str, frame: str) -> Mount | None:
        """Return where a frame is in that of the vehicle; None where no chain of transforms leads there."""
        base, frame = base.lstrip("/"), frame.lstrip("/")
        ups, downs = self._to_root(base), self._to_root(frame)
        common = next((name for name in downs if name in ups), None)
        if common is None or frame == base:
            return None
        placed = np.linalg.inv(ups[common]) @ downs[common]
        turn, shift = placed[:3, :3], placed[:3, 3]
        if is_optical(frame):
            turn = turn @ FROM_OPTICAL.T
        yaw = math.atan2(turn[1, 0], turn[0, 0])
        place = float(shift[0]), float(shift[1]), yaw
        tilt = math.acos(min(abs(float(turn[2, 2])), 1.0))
        upside_down = bool(turn[2, 2] < 0.0)
        text = f"by the static transforms from {base} to {frame}"
        if upside_down:
            text += ", upside down"
        if tilt > UPRIGHT:
            text += f", tilted by {math.degrees(tilt):.0f} degrees"
        return Mount(place, upside_down, text, turn, shift)

    def _to_root(self, frame: str) -> dict[str, NDArray[np.float64]]:
        """Return where a frame is in each of the frames above it, and in itself."""
        placed, above = np.eye(4), dict[str, Any]()
        while frame not in above:  # transforms that make a circle end as well
            above[frame] = placed
            if frame not in self._parents:
                break
            frame, step = self._parents[frame]
            placed = step @ placed
        return above


def is_level(mount: Mount) -> bool:
    """Return whether a scanner that is mounted so scans the plane in which the vehicle moves."""
    return bool(abs(mount.turn[2, 2]) >= math.cos(FALLEN))


def tilted(mount: Mount, how: str) -> str:
    """Return the sentence that refuses a scanner which is not level; ``how`` is how the user places it instead."""
    degrees = math.degrees(math.acos(min(abs(float(mount.turn[2, 2])), 1.0)))
    why = "and does not scan the plane in which the vehicle moves"
    return f"is tilted by {degrees:.0f} degrees by the static transforms, {why}; {how} places it all the same"


def is_optical(frame: str) -> bool:
    """Return whether a frame has the axes of a camera."""
    return frame.endswith("_optical_frame")


def turn_of(x: float, y: float, z: float, w: float) -> NDArray[np.float64]:
    """Return the rotation of a quaternion."""
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
            [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
            [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )
