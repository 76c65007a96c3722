"""Parameters of the node, and what a launch file may say about them."""

from __future__ import annotations

import inspect
import math
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

from ttc_fast.brake import BrakeController, IttcThreshold, StoppingDistance, SweptPathThreshold
from ttc_fast.configuration import PARTS, Configuration, ConfigurationError, hint

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ttc_fast.brake import Criterion

CRITERIA = ("", "ittc", "swept")
TOPICS = ("odom_topics",)
OF_THE_VEHICLE = ("outline", "mount")
"""Of the table ``scan``, what the node has to know itself."""
SCALARS = {bool: "true or false", float: "a number", str: "a text"}
OF_THE_NODE = frozenset({"criteria", "scan", "path", "range_rate", "time_increment"})
"""Arguments of the controller that the node finds out by itself."""
OF_THE_CONTROLLER = tuple(name for name in inspect.signature(BrakeController).parameters if name not in OF_THE_NODE)


class SettingError(ConfigurationError):
    """A parameter that cannot be used: which, what is wrong with it, and what would be right."""


@dataclass(frozen=True)
class NodeSettings:
    """Parameters of the node, by the names that they have in ROS.

    Attributes
    ----------
    min_range, max_range : float
        The horizon of scans, m: ``limits`` of ``ScanTTC``. Not the sensor's own limits, which the scan tells.
    limits_policy : str
        "horizon", or "clamp" for the literal clamping of ranges.
    ttc_threshold : float
        Brakes when the TTC is below, s.
    criterion : str
        "ittc", "swept", or "" for "swept" where there is an outline, else "ittc".
    stopping_distance : bool
        Brakes as well when the vehicle could only just stop.
    outline : (float, float, float, float) or None
        (x_rear, x_front, y_right, y_left) of the vehicle in its own frame, m; rear and right usually negative.
    mount : (float, float, float)
        (x, y, yaw) of the scanner in the vehicle's frame, m and rad.
    use_range_rate : bool
        Whether closing speeds come from the scans when there is no odometry.
    use_stamps : bool
        Whether data are as old as their stamps say. False counts them as measured when they came: for clocks that were
        never set to the same time, and bags that are played without ``--clock``.
    scan_topic : str
        LaserScan; "" is none.
    points_topic : str
        PointCloud2 in the vehicle's frame; "" is none. Needs an outline.
    odom_topics : tuple of str
        Odometry; any of them serves.
    speed_topic : str
        Odometry, Float32 or Float64, by the type it has; "" is none. When set it replaces ``odom_topics``.
    height : (float, float)
        Which points of a cloud count, z in the vehicle's frame, m.
    brake_topic : str
        Bool; "" is not to publish.
    drive_topic : str
        AckermannDriveStamped, when it brakes; "" is not to publish.
    diagnostics_topic : str
        DiagnosticArray; "" is not to publish.
    marker_topic : str
        Marker of the beam or point that decided; "" is not to publish.
    brake_speed : float
        What ``drive_topic`` asks for when braking, m/s: 0 is zero throttle, above 0 a reduced speed.
    drive_always : bool
        Whether ``drive_topic`` speaks also when it does not brake.
    base_frame : str
        The vehicle's frame.
    watchdog_period : float
        How often it looks whether data still come, s of wall time.
    diagnostics_period : float
        How often ``diagnostics_topic`` speaks, s of wall time.
    brake : dict
        Other arguments of ``BrakeController``; as parameters they have their own names, like ``hold``.

    parts : dict
        Tables as ``ttc_fast.configuration`` has them (scan, range_rate, criteria, brake), so that the file of a replay
        serves the node as well; they win over the parameters. The node has no use for a gate.

    Examples
    --------
    >>> from ttc_fast.ros.settings import NodeSettings
    >>> settings = NodeSettings.of({"ttc_threshold": 0.8, "hold": 1.0})
    >>> settings.ttc_threshold, settings.brake
    (0.8, {'hold': 1.0})
    """

    min_range: float = 0.0
    max_range: float = math.inf
    limits_policy: str = "horizon"
    ttc_threshold: float = 1.5
    criterion: str = ""
    stopping_distance: bool = True
    outline: tuple[float, float, float, float] | None = None
    mount: tuple[float, float, float] = (0.0, 0.0, 0.0)
    use_range_rate: bool = True
    use_stamps: bool = True
    scan_topic: str = "/scan"
    points_topic: str = ""
    odom_topics: tuple[str, ...] = ("/odom", "/vesc/odom")
    speed_topic: str = ""
    height: tuple[float, float] = (0.05, 2.0)
    brake_topic: str = "/brake_bool"
    drive_topic: str = "/drive"
    diagnostics_topic: str = "/diagnostics"
    marker_topic: str = "/ttc_fast/cause"
    brake_speed: float = 0.0
    drive_always: bool = False
    base_frame: str = "base_link"
    watchdog_period: float = 0.05
    diagnostics_period: float = 1.0
    brake: dict[str, Any] = field(default_factory=dict)
    parts: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, parameters: Mapping[str, Any]) -> NodeSettings:
        """Make them from plain values; those of the controller go by their own names."""
        own = {each.name: each for each in fields(cls) if each.name not in ("brake", "parts")}
        known = [*own, *OF_THE_CONTROLLER, *PARTS]
        parts = {name: value for name, value in parameters.items() if name in PARTS}
        scan = parts.get("scan")
        told = {name: scan[name] for name in OF_THE_VEHICLE if name in scan} if isinstance(scan, dict) else {}
        mine: dict[str, Any] = {}
        brake: dict[str, Any] = {}
        for name, value in {**parameters, **told}.items():
            if name in own:
                mine[name] = tuple(value) if isinstance(value, list) else value
                if name == "outline" and value is not None and len(value) == 0:
                    mine[name] = None  # a parameter of ROS 2 cannot be None
            elif name in OF_THE_CONTROLLER:
                brake[name] = value
            elif name not in PARTS:
                raise SettingError(f"there is no parameter {name!r}: {hint(name, known)}")
        return cls(**mine, brake=brake, parts=parts).checked()

    def checked(self) -> NodeSettings:
        """Return these, if a node can be made of them."""
        for each in fields(self):
            _check_type(each.name, getattr(self, each.name), each.default)
        if self.criterion not in CRITERIA:
            raise SettingError(f"criterion must be 'ittc', 'swept' or '' for either, got {self.criterion!r}")
        for name in ("ttc_threshold", "watchdog_period", "diagnostics_period"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise SettingError(f"{name} must be finite and above 0 s, got {getattr(self, name)}")
        if not 0.0 <= self.brake_speed < math.inf:
            raise SettingError(f"brake_speed must be finite and at least 0 m/s, got {self.brake_speed}")
        if self.criterion == "swept" and not self.outline:
            raise SettingError("criterion 'swept' needs an outline: (x_rear, x_front, y_right, y_left), m")
        if self.points_topic and not self.outline:
            raise SettingError("points_topic needs an outline: (x_rear, x_front, y_right, y_left), m")
        if self.points_topic and self.criterion == "ittc":
            raise SettingError("criterion 'ittc' judges beams, and points_topic is set: use 'swept', or leave it out")
        if not (self.scan_topic or self.points_topic):
            raise SettingError("scan_topic or points_topic must be set: without either there is nothing to look with")
        try:
            settings = self.configuration()
            settings.controller(settings.scanner(angle_min=0.0, angle_increment=0.1, beams=2))
        except (ValueError, TypeError) as error:
            raise SettingError(str(error)) from None
        return self

    def configuration(self) -> Configuration:
        """Return the same as settings of scanner and controller."""
        scan: dict[str, Any] = {"limits": [self.min_range, self.max_range], "limits_policy": self.limits_policy}
        scan |= {name: list(getattr(self, name)) for name in OF_THE_VEHICLE if any(getattr(self, name) or ())}
        settings, parts = Configuration.of({"scan": scan, "brake": self.brake}), Configuration.of(self.parts)
        rates: dict[str, Any] | None = {} if self.use_range_rate else None
        return Configuration(
            scan={**settings.scan, **parts.scan},
            gate=parts.gate,
            range_rate=rates if parts.range_rate is None else parts.range_rate,
            criteria=parts.criteria or self.criteria(),
            brake={**settings.brake, **parts.brake},
        )

    def criteria(self) -> tuple[Criterion, ...]:
        """Return what brakes."""
        swept = self.criterion == "swept" or (not self.criterion and bool(self.outline))
        first: Criterion = (SweptPathThreshold if swept else IttcThreshold)(self.ttc_threshold)
        return (first, StoppingDistance(**self._braking())) if self.stopping_distance else (first,)

    def _braking(self) -> dict[str, float]:
        return {"deceleration": self.brake["deceleration"]} if "deceleration" in self.brake else {}


def _check_type(name: str, value: Any, default: Any) -> None:
    """Refuse a parameter of another type than its default's."""
    kind: type = tuple if name == "outline" else type(default)
    if kind is tuple:
        if name == "outline" and value is None:
            return
        element = str if name in TOPICS else float
        wanted = "names of topics" if element is str else "numbers"
        if not isinstance(value, tuple) or not all(_is(element, each) for each in value):
            raise SettingError(f"{name} must be a list of {wanted}, got {value!r}")
        length = {"height": 2, "mount": 3, "outline": 4}.get(name, len(value))
        if len(value) != length:
            raise SettingError(f"{name} must be {length} numbers, got {value!r}")
    elif kind in SCALARS and not _is(kind, value):
        raise SettingError(f"{name} must be {SCALARS[kind]}, got {value!r}")


def _is(kind: type, value: Any) -> bool:
    if kind is float:
        return isinstance(value, (int, float)) and not isinstance(value, bool)
    return isinstance(value, kind)
