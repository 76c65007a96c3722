"""What the user says of a log: where it leaves something open, and where something else is to hold."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeVar

from ttc_fast._settings import (
    MOUNT,
    OUTLINE,
    Choice,
    Flag,
    Number,
    Text,
    Texts,
    check_fields,
    option,
    setting,
    settings_of,
)
from ttc_fast.logs.files import UNPACKED
from ttc_fast.logs.log import UselessOptionError

if TYPE_CHECKING:
    from collections.abc import Collection
    from pathlib import Path

SCANNER = ("range_min", "range_max", "mount", "outline", "upside_down")
LIDAR = ("sensor_height", "front_offset", "axes")
MOTION = ("odometry_topic", "speed", "max_speed_age")
SizeT = TypeVar("SizeT")


@dataclass(frozen=True)
class LogOptions:
    """What the user says of a log. None leaves it to the log. The fields describe themselves.

    A format knows the options that make sense for it, and refuses the others by name.

    Attributes
    ----------
    ignore_useless : bool
        Whether options that this kind of log has no use for are ignored instead of refused.

    Raises
    ------
    TypeError, ValueError
        If an option is of the wrong type, or makes no sense.
    """

    topic: str | None = setting(
        None,
        Text(),
        "The topic of the scans or clouds where a bag has several; the names of one sensor's frames in a folder of "
        "several; the laser of a CARMEN log, which is the first word of its lines.",
    )
    frame: str | None = setting(
        None, Text(), "The frame_id of the sensor, where several of them share the topic of a bag."
    )
    base_frame: str | None = setting(
        None, Text(), "The frame of the vehicle, in which /tf_static places the sensor; by default base_link."
    )
    clock: str | None = setting(
        None,
        Choice(options=("header", "recorded")),
        "Which times of a bag hold: header, the stamps of its messages, or recorded, when they were recorded.",
    )
    odometry_topic: str | None = setting(None, Text(), "The topic of the odometry, where a bag has several.")
    speed: float | None = setting(
        None,
        Number(unit="m/s"),
        "The forward speed of the vehicle, negative when reversing, instead of the recorded one.",
    )
    max_speed_age: float | None = setting(
        None,
        Number(unit="s", least=0.0, infinite=True),
        "Odometry that is older says nothing about the speed; by default 0.5, and 5 for CARMEN logs.",
    )
    rate: float | None = setting(
        None,
        Number(unit="Hz", least=0.001),
        "How many frames a second there are, instead of the stamps.",
    )
    max_unpacked: float | None = setting(
        None,
        Number(unit="MB", positive=True),
        "A chunk, a message or a cloud may unpack to this, or to 20 times its size; by default 64.",
    )
    column: str | None = setting(None, Text(), "The column of the distances in a table.")
    stamp_column: str | None = setting(None, Text(), "The column of the stamps in a table.")
    range_min: float | None = setting(None, Number(unit="m", least=0.0), "Readings below this are discarded.")
    range_max: float | None = setting(None, Number(unit="m", infinite=True), "Readings above this are discarded.")
    mount: tuple[float, float, float] | None = setting(
        None, MOUNT, "The position and direction of the scanner in the vehicle frame."
    )
    outline: tuple[float, float, float, float] | None = setting(
        None,
        OUTLINE,
        "The outline of the vehicle in its own frame, rear and right usually negative; with it the vehicle's path is "
        "judged.",
    )
    upside_down: bool | None = setting(
        None, Flag(), "The scanner hangs upside down, so that its beams run the other way round."
    )
    sensor_height: float | None = setting(None, Number(unit="m"), "The height of a lidar above the road.")
    front_offset: float | None = setting(
        None,
        Number(unit="m", least=0.0),
        "The distance from a lidar to the bumper. Distances count from there; nearer points are the vehicle itself.",
    )
    axes: tuple[str, str, str] | None = setting(
        None,
        Texts(what="coordinates"),
        "The stored coordinates of a lidar that are forward, left and up, such as x,-y,-z if it hangs upside down.",
    )

    ignore_useless: bool = False

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def unpacked(self) -> int:
        """How many bytes a chunk, a message or a cloud may unpack to."""
        return UNPACKED if self.max_unpacked is None else int(self.max_unpacked * 1e6)

    def only(self, known: Collection[str], path: Path, kind: str) -> None:
        """Refuse the options that this kind of log does not know, unless they are to be ignored."""
        if self.ignore_useless:
            return
        for name in (each.name for each in settings_of(LogOptions)):
            if getattr(self, name) is not None and name not in (*known, "max_unpacked"):
                has = ", ".join(option(each).removeprefix("the option ") for each in known)
                raise UselessOptionError(path, f"{kind} has no use for {option(name)}; leave it out (it knows {has})")

    def applied(self, thing: SizeT, names: Collection[str]) -> SizeT:
        """Return a scanner or a lidar with what the user said of it."""
        said: dict[str, Any] = {name: getattr(self, name) for name in names if getattr(self, name) is not None}
        if said.pop("upside_down", False):
            said |= {name: -getattr(thing, name) for name in ("angle_min", "angle_increment")}
        if "front_offset" in said:  # the vehicle reaches to the bumper at least
            said["vehicle_reach"] = max(said["front_offset"], getattr(thing, "vehicle_reach", None) or 0.0)
        return replace(thing, **said) if said else thing  # type: ignore[type-var]

    def motion(self, recorded: str) -> str:
        """Say where the speeds come from, for people: from the user, or else as the log has them."""
        return recorded if self.speed is None else "speed as given"
