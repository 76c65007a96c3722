"""Parameters of the node. ``NodeSettings`` describes each of them once; ``ttc_fast._settings`` says what follows."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from ttc_fast import _validate
from ttc_fast._core import ScanTTC
from ttc_fast._settings import (
    MOUNT,
    OUTLINE,
    POLICY,
    Choice,
    Count,
    Flag,
    Kind,
    Number,
    Numbers,
    Text,
    Texts,
    check_fields,
    hint,
    setting,
    settings_of,
)
from ttc_fast._validate import shown
from ttc_fast.brake import IttcThreshold, StoppingDistance, SweptPathThreshold
from ttc_fast.configuration import BRAKE, PARTS, Configuration, ConfigurationError
from ttc_fast.ros.dds.names import TOPIC

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from ttc_fast._settings import Setting
    from ttc_fast.brake import Criterion

OF_THE_VEHICLE = ("outline", "mount")
"""Settings of the table ``scan`` that are parameters of the node as well."""
PERIOD = Number(unit="s", positive=True)
VIEW = ("angle_min", "angle_max", "x", "y", "yaw")
"""Where a sensor looks, rad, about its own direction, and its place and direction in the vehicle's frame, m and rad."""
TURN = 2.0 * math.pi + 1e-6
BEAM = 0.02
"""A view is that of a scanner with beams about so far apart, rad."""


class SettingError(ConfigurationError):
    """A parameter that cannot be used: which, what is wrong with it, and what would be right."""


@dataclass(frozen=True, kw_only=True)
class Topic(Text):
    """The name of a topic, or "" where there is none."""

    def check(self, name: str, value: Any) -> str:
        """Return the value."""
        return _topic(name, super().check(name, value)) if value != "" else ""


@dataclass(frozen=True, kw_only=True)
class Topics(Texts):
    """A list of the names of topics."""

    what: str = "names of topics"

    def check(self, name: str, value: Any) -> tuple[str, ...]:
        """Return the value as a tuple."""
        return tuple(_topic(name, each) for each in super().check(name, value))


@dataclass(frozen=True, kw_only=True)
class Views(Kind):
    """Where sensors look: five numbers for each of them, of which the first angle is less than the second."""

    def check(self, name: str, value: Any) -> tuple[float, ...]:
        """Return the value as a tuple of floats."""
        count = max(len(value) // len(VIEW), 1) if isinstance(value, (list, tuple)) else 1
        numbers = _validate.numbers(name, value, VIEW * count)
        for begin in range(0, len(numbers), len(VIEW)):
            if not numbers[begin] < numbers[begin + 1] <= numbers[begin] + TURN:
                raise ValueError(f"{name} must have angle_min below angle_max, by a turn at most, got {shown(numbers)}")
        return numbers


def _topic(name: str, value: str) -> str:
    if not TOPIC.fullmatch(value):
        raise ValueError(
            f"{name} must be the name of a topic, such as scan, /front/scan or ~/cause, got {shown(value)}"
        )
    return value


def full_name(topic: str) -> str:
    """Return the full name of a topic where there is no namespace.

    Examples
    --------
    >>> from ttc_fast.ros.settings import full_name
    >>> full_name("scan"), full_name("/front/scan")
    ('/scan', '/front/scan')
    """
    return topic if topic.startswith("/") else f"/{topic}"


@dataclass(frozen=True)
class NodeSettings:
    """Parameters of the node, by the names that they have in ROS. The fields describe themselves.

    Attributes
    ----------
    brake : dict
        Other arguments of ``BrakeController``; as parameters they have their own names, like ``hold``.
    parts : dict
        Tables as ``ttc_fast.configuration`` has them (scan, range_rate, criteria, brake), so that the file of a replay
        serves the node as well. They win over the parameters. The node ignores a gate.

    Raises
    ------
    SettingError
        If a node cannot be made with these settings.

    Examples
    --------
    >>> from ttc_fast.ros.settings import NodeSettings
    >>> settings = NodeSettings.of({"ttc_threshold": 0.8, "hold": 1.0})
    >>> settings.ttc_threshold, settings.brake
    (0.8, {'hold': 1.0})
    """

    min_range: float = setting(
        0.0, Number(unit="m"), "The horizon of scans begins here. A reading below it counts as it is.", (0.0, 1000.0)
    )
    max_range: float = setting(
        math.inf, Number(unit="m", infinite=True), "The horizon of scans ends here. A reading beyond it never counts."
    )
    limits_policy: str = setting("horizon", POLICY, "With clamp, readings are moved into the horizon.")
    ttc_threshold: float = setting(
        1.5, Number(unit="s", positive=True), "The node brakes when the time-to-collision is below this.", (0.0, 60.0)
    )
    criterion: str = setting(
        "",
        Choice(options=("ittc", "swept", "")),
        "ittc judges every beam, swept the path of the outline. Empty is swept where there is an outline, else ittc.",
    )
    stopping_distance: bool = setting(True, Flag(), "The node also brakes when the vehicle could only just stop.")
    outline: tuple[float, float, float, float] | None = setting(
        None, OUTLINE, "Outline of the vehicle in its own frame: x_rear, x_front, y_right, y_left."
    )
    mount: tuple[float, float, float] = setting(
        (0.0, 0.0, 0.0), MOUNT, "Position and direction of the scanner in the vehicle's frame: x, y, yaw."
    )
    use_range_rate: bool = setting(True, Flag(), "Closing speeds come from the scans where there is no odometry.")
    use_stamps: bool = setting(
        True, Flag(), "Data are as old as their stamps say; with false, they count as measured when they came."
    )
    scan_topic: str = setting("scan", Topic(), "Topic of the LaserScan; empty is none.")
    points_topic: str = setting(
        "", Topic(), "Topic of the PointCloud2 in the vehicle's frame; empty is none. It needs an outline."
    )
    points_views: tuple[float, ...] | None = setting(
        None,
        Views(unit="rad, m"),
        "Where the sensors of the cloud look: angle_min, angle_max, x, y, yaw of each, one after the other. Empty is "
        "where it has points.",
    )
    frame_id: str = setting(
        "", Text(), "The frame_id of the sensor, where several of them share its topic; messages of others are ignored."
    )
    odom_topics: tuple[str, ...] = setting(
        ("odom", "vesc/odom"), Topics(), "Topics of the Odometry, any of which serves."
    )
    speed_topic: str = setting(
        "", Topic(), "Topic of a speed: Odometry, Float32 or Float64. It replaces odom_topics; empty is none."
    )
    height: tuple[float, float] = setting(
        (0.05, 2.0), Numbers(unit="m"), "Points of a cloud between these heights above the vehicle's origin count."
    )
    commanded_topic: str = setting(
        "",
        Topic(),
        "Topic of what the driver or planner asks for: AckermannDriveStamped or Twist. Empty is none, and with mux "
        "drive_in.",
    )
    commanded_timeout: float = setting(
        0.5, Number(unit="s", positive=True), "What was asked for this long ago is not asked for any more.", (0.0, 10.0)
    )
    wheelbase: float = setting(
        0.0,
        Number(unit="m", least=0.0),
        "Distance between the axles, by which a commanded steering angle bends the path; 0 takes it for straight.",
        (0.0, 10.0),
    )
    override_topic: str = setting(
        "", Topic(), "Topic by which the driver takes over, and nothing brakes: Bool or Joy; empty is none."
    )
    override_button: int = setting(0, Count(), "The button of the Joy that takes over while it is held, from 0.")
    override_timeout: float = setting(
        0.5,
        Number(unit="s", positive=True),
        "An override ends when nothing has confirmed it for this long.",
        (0.0, 10.0),
    )
    mux: bool = setting(
        False,
        Flag(),
        "Messages of commanded_topic go out on drive_topic as they came, unless the node brakes; they are "
        "AckermannDriveStamped.",
    )
    brake_topic: str = setting("brake_bool", Topic(), "Topic of the Bool; empty does not publish it.")
    drive_topic: str = setting("drive", Topic(), "Topic of the AckermannDriveStamped; empty does not publish it.")
    diagnostics_topic: str = setting(
        "/diagnostics", Topic(), "Topic of the DiagnosticArray; empty does not publish it."
    )
    marker_topic: str = setting(
        "ttc_fast/cause", Topic(), "Topic of the Marker of the beam or point that decided; empty does not publish it."
    )
    brake_speed: float = setting(
        0.0,
        Number(unit="m/s", least=0.0),
        "A drive message asks for this speed while it brakes.",
        (0.0, 100.0),
    )
    drive_always: bool = setting(False, Flag(), "Drive messages are published also while the node does not brake.")
    base_frame: str = setting("base_link", Text(), "Frame of the vehicle, which published messages carry.")
    watchdog_period: float = setting(
        0.05, PERIOD, "The watchdog looks this often, in wall time, whether data still come.", (0.001, 3600.0)
    )
    diagnostics_period: float = setting(1.0, PERIOD, "Diagnostics are published this often.", (0.01, 3600.0))
    brake: dict[str, Any] = field(default_factory=dict)
    parts: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, parameters: Mapping[str, Any]) -> NodeSettings:
        """Make settings from plain values, as files and ROS have them; a SettingError says what cannot be used."""
        parts = {name: value for name, value in parameters.items() if name in PARTS}
        scan = parts.get("scan")
        vehicle = {name: scan[name] for name in OF_THE_VEHICLE if name in scan} if isinstance(scan, dict) else {}
        by_name = {each.name: each for each in parameters_of_node()}
        read: dict[str, Any] = {}
        for name, value in {**parameters, **vehicle}.items():
            if name in by_name:
                try:
                    read[name] = by_name[name].read(value)
                except (TypeError, ValueError) as error:
                    raise SettingError(str(error)) from None
            elif name not in PARTS:
                raise SettingError(f"there is no parameter {name!r}: {hint(str(name), (*by_name, *PARTS))}")
        brake = {each.name: read.pop(each.name) for each in BRAKE if each.name in read}
        return cls(**read, brake=brake, parts=parts)

    def __post_init__(self) -> None:
        try:
            check_fields(self)
            if self.criterion == "swept" and not self.outline:
                raise ValueError("criterion 'swept' needs an outline: (x_rear, x_front, y_right, y_left), m")
            if self.points_topic and not self.outline:
                raise ValueError("points_topic needs an outline: (x_rear, x_front, y_right, y_left), m")
            if self.points_views and not self.points_topic:
                raise ValueError("points_views needs a points_topic, whose sensors they are")
            if self.points_topic and self.criterion == "ittc":
                raise ValueError("criterion 'ittc' judges beams, and points_topic is set: use 'swept', or leave it out")
            if not (self.scan_topic or self.points_topic):
                raise ValueError("scan_topic or points_topic must be set: without either there is nothing to look with")
            if self.mux and not self.drive_topic:
                raise ValueError("mux needs a drive_topic, where it publishes")
            if self.mux and self.drive_always:
                raise ValueError("drive_always must be false with mux, which publishes what the driver asks for")
            if self.driver_topic and self.driver_topic == self.drive_topic:
                raise ValueError(
                    f"commanded_topic and drive_topic are both {self.drive_topic}, where the node would hear itself: "
                    "name another topic for what the driver asks for"
                )
            settings = self.configuration()
            settings.controller(settings.scanner(angle_min=0.0, angle_increment=0.1, beams=2))
            self.views()
        except (ValueError, TypeError) as error:
            raise SettingError(str(error)) from None

    @property
    def driver_topic(self) -> str:
        """The topic of what the driver asks for, or "" where there is none."""
        return self.commanded_topic or ("drive_in" if self.mux else "")

    def resolved(self, resolve: Callable[[str], str] = full_name) -> NodeSettings:
        """Return the settings with the full names of the topics, as ``resolve`` gives them.

        Examples
        --------
        >>> from ttc_fast.ros.settings import NodeSettings
        >>> NodeSettings().resolved().odom_topics
        ('/odom', '/vesc/odom')
        """
        topics = {each.name: getattr(self, each.name) for each in settings_of(NodeSettings) if each.kind == Topic()}
        topics["commanded_topic"] = self.driver_topic
        full: dict[str, Any] = {name: resolve(topic) for name, topic in topics.items() if topic}
        full["odom_topics"] = tuple(resolve(topic) for topic in self.odom_topics)
        return replace(self, **full) if any(full[name] != getattr(self, name) for name in full) else self

    def configuration(self) -> Configuration:
        """Return the settings of the scanner and the controller."""
        scan: dict[str, Any] = {"limits": (self.min_range, self.max_range), "limits_policy": self.limits_policy}
        scan |= {name: getattr(self, name) for name in OF_THE_VEHICLE if any(getattr(self, name) or ())}
        parts = Configuration.of(self.parts)
        rates: dict[str, Any] | None = {} if self.use_range_rate else None
        return Configuration(
            scan={**scan, **parts.scan},
            gate=parts.gate,
            range_rate=rates if parts.range_rate is None else parts.range_rate,
            criteria=parts.criteria or self.criteria(),
            brake={**self.brake, **parts.brake},
        )

    def views(self) -> tuple[ScanTTC, ...]:
        """Return where the sensors of the cloud look, as ``BrakeController`` takes it."""
        numbers, views = self.points_views or (), []
        for begin in range(0, len(numbers), len(VIEW)):
            angle_min, angle_max, x, y, yaw = numbers[begin : begin + len(VIEW)]
            steps = math.ceil((angle_max - angle_min) / BEAM)
            step = (angle_max - angle_min) / steps
            views.append(ScanTTC(angle_min, step, steps + 1, mount=(x, y, yaw), outline=self.outline))
        return tuple(views)

    def criteria(self) -> tuple[Criterion, ...]:
        """Return the criteria that the parameters name."""
        swept = self.criterion == "swept" or (not self.criterion and bool(self.outline))
        first: Criterion = (SweptPathThreshold if swept else IttcThreshold)(self.ttc_threshold)
        braking = {name: self.brake[name] for name in ("deceleration",) if name in self.brake}
        return (first, StoppingDistance(**braking)) if self.stopping_distance else (first,)


def parameters_of_node() -> tuple[Setting, ...]:
    """Return the description of every parameter: those of the node, and those of the controller.

    Examples
    --------
    >>> from ttc_fast.ros.settings import parameters_of_node
    >>> hold = next(each for each in parameters_of_node() if each.name == "hold")
    >>> hold.default, hold.usual
    (0.5, (0.0, 60.0))
    >>> hold.description
    'A brake is held this long after the last frame that triggered (s, default 0.5).'
    """
    # The node takes the time between two beams from each scan.
    return (*settings_of(NodeSettings), *(each for each in BRAKE if each.name != "time_increment"))


AT_START = frozenset(
    each.name for each in settings_of(NodeSettings) if "_topic" in each.name or each.name.endswith(("_period", "mux"))
)
"""Parameters that are read when the node starts, and cannot be changed later."""
