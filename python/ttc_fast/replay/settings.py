"""The settings of a replay: how the log was recorded, which points count, and how the brake is set."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from ttc_fast import _settings
from ttc_fast._core import Gate
from ttc_fast._settings import hint, option
from ttc_fast._validate import shown
from ttc_fast.brake import EstimateThreshold
from ttc_fast.brake.criteria import TtcThreshold
from ttc_fast.brake.settings import BrakeSettings
from ttc_fast.brake.types import Needs
from ttc_fast.configuration import Configuration, ConfigurationError
from ttc_fast.logs.log import REP_103, UselessOptionError

if TYPE_CHECKING:
    from collections.abc import Collection
    from pathlib import Path

    from ttc_fast.brake import Criterion
    from ttc_fast.logs import Lidar

SCANNER = ("range_min", "range_max", "mount", "outline")
GATE = ("x", "y", "z", "intensity")
BOUNDS = {each.name: each for each in _settings.GATE if each.name in GATE}
GATE_OPTIONS = tuple(f"gate_{name}" for name in GATE)
NEEDED = {Needs.BEAMS: "a scan", Needs.PATH: "a scan, or a cloud with an outline and a speed"}
LANE = (-2.0, 2.0)  # m, left of the sensor


@dataclass(frozen=True)
class Settings:
    """The settings of a replay.

    Attributes
    ----------
    configuration : Configuration
        The settings of scanner, gate and brake, as a file has them.
    log_options : dict
        Arguments of ``LogOptions``. Those that describe the scanner win over ``configuration``.
    gate : dict
        Bounds ``x``, ``y``, ``z`` and ``intensity`` of the gate, which win over ``configuration``.
    criteria : tuple of criteria or None
        The criteria; None leaves them to ``configuration``.
    ignore_useless : bool
        Whether options and criteria that a log has no use for are treated as those of a file: options are ignored, and
        an ``EstimateThreshold`` takes the place of a criterion. Otherwise they are refused. ``replay_many`` sets it
        where there are several logs.

    Examples
    --------
    >>> from ttc_fast import IttcThreshold
    >>> from ttc_fast.replay import Settings
    >>> settings = Settings(log_options={"speed": 2.0}, criteria=(IttcThreshold(0.5),))
    >>> settings.sensor_timeout
    0.3
    """

    configuration: Configuration = field(default_factory=Configuration)
    log_options: dict[str, Any] = field(default_factory=dict)
    gate: dict[str, tuple[float, float]] = field(default_factory=dict)
    criteria: tuple[Criterion, ...] | None = None
    ignore_useless: bool = field(default=False, repr=False)

    def __post_init__(self) -> None:
        for name, table in (("log_options", self.log_options), ("gate", self.gate)):
            if not isinstance(table, dict):
                raise TypeError(f"{name} must be a dict of settings, got {shown(table)}")
        for name, bounds in self.gate.items():
            if name not in BOUNDS:
                raise ValueError(f"gate has no setting {name!r}: {hint(str(name), BOUNDS)}")
            BOUNDS[name].kind.check(f"gate: {name}", bounds)

    @property
    def of_log(self) -> dict[str, Any]:
        """The options that a log is opened with. Those of the scanner are left out, as clouds use some of them too."""
        said = {name: value for name, value in self.log_options.items() if name not in SCANNER}
        return {**said, "ignore_useless": self.ignore_useless}

    @property
    def of_scanner(self) -> dict[str, Any]:
        """The arguments of ``ScanTTC`` that win over what the log says."""
        said = {name: self.log_options[name] for name in SCANNER if self.log_options.get(name) is not None}
        return {**self.configuration.scan, **said}

    @property
    def sensor_timeout(self) -> float:
        """The age from which sensor data are too old for the brake, s."""
        return float(self.configuration.brake.get("sensor_timeout", BrakeSettings.sensor_timeout))

    def refuse_useless(self, path: Path, kind: str, uses: Collection[str]) -> None:
        """Raise if an option of scanner or gate has no use for this kind of log. A file may serve several kinds."""
        if self.ignore_useless:
            return
        said = [name for name in SCANNER if self.log_options.get(name) is not None]
        for name in (*said, *(f"gate_{name}" for name in self.gate)):
            if name not in uses:
                raise UselessOptionError(path, f"{kind} has no use for {option(name)}; leave it out")

    def typed(self, error: ConfigurationError) -> str:
        """Return what is wrong, in which an option that the user gave has the name by which it is typed."""
        part, _, rest = str(error).partition(": ")
        name, _, problem = rest.partition(" ")
        if part == "scan" and self.log_options.get(name) is not None:
            return f"{option(name)} {problem}"
        if part == "gate" and name in self.gate:
            return f"{option(f'gate_{name}')} {problem}"
        return str(error)

    def configured(self) -> Configuration:
        """Return the configuration with the options that win over it."""
        criteria = self.criteria or self.configuration.criteria or None
        return replace(self.configuration, scan=self.of_scanner, criteria=criteria)

    def for_estimates(self, *, path: bool) -> tuple[Configuration, str]:
        """Return the configuration for a log without scans, and what was done to the criteria of a file, for people.

        A criterion of a file that such a log cannot evaluate is not left out in silence: an ``EstimateThreshold`` of
        the same threshold takes its place, unless the file has one. ``path`` says whether there is an outline and a
        speed. Criteria that are given otherwise hold as they are.
        """
        configured = self.configured()
        criteria = None if self.criteria and not self.ignore_useless else configured.criteria
        origin = "" if self.criteria else " of the file"
        out = [each for each in criteria or () if each.needs is Needs.BEAMS or (each.needs is Needs.PATH and not path)]
        if not out or criteria is None:
            return configured, ""
        thresholds = [each.threshold for each in out if isinstance(each, TtcThreshold)]
        kept: list[Criterion] = [each for each in criteria if each not in out]
        said = " and ".join(f"{each}{origin} needs {NEEDED[each.needs]}" for each in out)
        if thresholds and not any(isinstance(each, EstimateThreshold) for each in kept):
            kept.insert(0, EstimateThreshold(max(thresholds)))
            return replace(configured, criteria=tuple(kept)), f"{said}: {kept[0]} takes its place here"
        if not kept:
            raise ConfigurationError(f"{said}, and there is no other criterion; add an EstimateThreshold to the file")
        return replace(configured, criteria=tuple(kept)), f"{said}: it is left out here"

    @property
    def says_where_gate_begins(self) -> bool:
        """Whether the user says which points ahead count."""
        return "x" in self.gate or self.configuration.gate is not None

    @property
    def says_heights(self) -> bool:
        """Whether the user says at which heights points count."""
        return "z" in self.gate or self.configuration.gate is not None

    @property
    def says_axes(self) -> bool:
        """Whether the user says which stored coordinates are forward, left and up."""
        gate = self.configuration.gate
        return self.log_options.get("axes") is not None or (gate is not None and gate.axes != REP_103)

    def gate_of(self, lidar: Lidar) -> Gate:
        """Return the gate: by the options, as configured, or else the lane ahead at the height of vehicles."""
        configured = self.configuration.gate
        if configured is not None and not self.gate:
            return configured
        bounds: dict[str, Any]
        if configured is not None:
            bounds = {name: getattr(configured, name) for name in (*GATE, "axes", "curvature", "road", "height")}
        else:
            bounds = {"x": (lidar.own_reach, math.inf), "y": LANE, "axes": lidar.axes}
            if "z" not in self.gate:
                bounds["z"] = heights_of(lidar)
        try:
            return Gate(**{**bounds, **self.gate})
        except ValueError as error:
            raise ConfigurationError(f"gate: {error}") from None

    def gate_within(self, lidar: Lidar) -> Gate:
        """Make the gate on what is nearer than the vehicle is assumed to reach."""
        return replace(self, gate={**self.gate, "x": (0.0, lidar.own_reach)}).gate_of(lidar)


def heights_of(lidar: Lidar) -> tuple[float, float]:
    """Return the heights at which vehicles are seen well, m above the lidar."""
    if lidar.sensor_height is None:
        problem = "it is not known how high the lidar sits above the road"
        how = f"say it with {option('sensor_height')}, or say which heights with {option('gate_z')}"
        raise ConfigurationError(f"{problem}; {how}")
    low, high = lidar.height
    return low - lidar.sensor_height, high - lidar.sensor_height
