"""What the user says of a recording."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, TypeVar

from ttc_fast.logs.log import LogError

if TYPE_CHECKING:
    from collections.abc import Collection
    from pathlib import Path

SCANNER = ("range_min", "range_max", "mount", "outline", "upside_down")
LIDAR = ("sensor_height", "front_offset", "axes")
MOTION = ("odometry_topic", "speed", "max_speed_age")
SizeT = TypeVar("SizeT")


@dataclass(frozen=True)
class LogOptions:
    """What the user says of a recording: what it leaves open, and what is to hold instead of what it says itself.

    None leaves it to the recording. A format knows those that make sense for it, and refuses the others.

    Attributes
    ----------
    topic : str or None
        Of the scans or clouds, where there are several.
    odometry_topic : str or None
        Of the odometry, where there are several.
    speed : float or None
        Of the vehicle, forward, m/s, negative when reversing, instead of the recorded one.
    max_speed_age : float or None
        Odometry that is older than this at the time of a frame says nothing about its speed, s; 0.5 by default.
    range_min, range_max : float or None
        Of the scanner, m.
    mount : (float, float, float) or None
        x, y (m) and yaw (rad) of the scanner in the vehicle frame.
    outline : (float, float, float, float) or None
        x_rear, x_front, y_right, y_left of the vehicle, m.
    upside_down : bool or None
        Whether the scanner hangs upside down, so that its beams run the other way round.
    sensor_height, front_offset : float or None
        Of the lidar, above the road and from the bumper, m.
    axes : (str, str, str) or None
        Which stored coordinates of the points are forward, left and up: ("x", "y", "z") by REP 103, ("y", "-x", "z")
        where y is forward and x right; as in ``Gate``.
    rate : float or None
        Frames per second, instead of the stamps.
    column, stamp_column : str or None
        Of the distances and of their stamps, in a table.

    Raises
    ------
    ValueError
        If a number makes no sense.
    """

    topic: str | None = None
    odometry_topic: str | None = None
    speed: float | None = None
    max_speed_age: float | None = None
    range_min: float | None = None
    range_max: float | None = None
    mount: tuple[float, float, float] | None = None
    outline: tuple[float, float, float, float] | None = None
    upside_down: bool | None = None
    sensor_height: float | None = None
    front_offset: float | None = None
    axes: tuple[str, str, str] | None = None
    rate: float | None = None
    column: str | None = None
    stamp_column: str | None = None

    def __post_init__(self) -> None:
        for name in ("speed", "sensor_height", "front_offset"):
            value = getattr(self, name)
            if value is not None and not math.isfinite(value):
                raise ValueError(f"{name} must be finite, got {value}")
        if self.rate is not None and not 0.0 < self.rate < math.inf:
            raise ValueError(f"rate must be frames per second, above 0, got {self.rate}")
        if self.max_speed_age is not None and not self.max_speed_age >= 0.0:
            raise ValueError(f"max_speed_age must be at least 0 s, got {self.max_speed_age}")

    def only(self, known: Collection[str], path: Path, kind: str) -> None:
        """Refuse what this kind of log does not know."""
        for name in (field.name for field in fields(self)):
            if getattr(self, name) is not None and name not in known:
                has = f"it knows {', '.join(known)}" if known else "it knows none"
                raise LogError(path, f"{kind} has no use for the option {name}; leave it out ({has})")

    def applied(self, thing: SizeT, names: Collection[str]) -> SizeT:
        """Return a scanner or a lidar with what the user said of it."""
        said: dict[str, Any] = {name: getattr(self, name) for name in names if getattr(self, name) is not None}
        if said.pop("upside_down", False):
            said |= {name: -getattr(thing, name) for name in ("angle_min", "angle_increment")}
        return replace(thing, **said) if said else thing  # type: ignore[type-var]

    def motion(self, recorded: str) -> str:
        """Say where the speeds come from, for people: from the user, or else as the log has them."""
        return recorded if self.speed is None else "speed as given"
