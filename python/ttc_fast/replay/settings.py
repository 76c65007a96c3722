"""What the user says of a replay: how the log was recorded, and how the brake is set."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from ttc_fast._core import Gate
from ttc_fast.brake.settings import BrakeSettings
from ttc_fast.configuration import Configuration, ConfigurationError
from ttc_fast.logs import LogError

if TYPE_CHECKING:
    from collections.abc import Collection
    from pathlib import Path

    from ttc_fast.brake import Criterion
    from ttc_fast.logs import Lidar

SCANNER = ("range_min", "range_max", "mount", "outline")
GATE = ("x", "y", "z", "intensity")
GATE_OPTIONS = tuple(f"gate_{name}" for name in GATE)
LANE = (-2.0, 2.0)  # m, left of the sensor


@dataclass(frozen=True)
class Settings:
    """What a replay is done with.

    Attributes
    ----------
    configuration : Configuration
        Of scanner, gate and brake, as a file has it.
    log_options : dict
        Fields of ``LogOptions``: what the user says of the log. Those of a scanner hold instead of ``configuration``'s.
    gate : dict
        Bounds ``x``, ``y``, ``z`` and ``intensity`` of the gate, instead of the configured ones.
    criteria : tuple of criteria or None
        Instead of the configured ones.

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

    @property
    def of_log(self) -> dict[str, Any]:
        """What a log is opened with: all but what is said of the scanner, which clouds have a use for as well."""
        return {name: value for name, value in self.log_options.items() if name not in SCANNER}

    @property
    def of_scanner(self) -> dict[str, Any]:
        """Arguments of ``ScanTTC`` that hold instead of the log's."""
        said = {name: self.log_options[name] for name in SCANNER if self.log_options.get(name) is not None}
        return {**self.configuration.scan, **said}

    @property
    def sensor_timeout(self) -> float:
        """The gap between frames from which the brake takes the sensor for lost, s."""
        return float(self.configuration.brake.get("sensor_timeout", BrakeSettings.sensor_timeout))

    def refuse_useless(self, path: Path, kind: str, uses: Collection[str]) -> None:
        """Refuse what is said of scanner or gate where a log has no use for it; a file may serve several kinds."""
        said = [name for name in SCANNER if self.log_options.get(name) is not None]
        for name in (*said, *(f"gate_{name}" for name in self.gate)):
            if name not in uses:
                raise LogError(path, f"{kind} has no use for the option {name}; leave it out")

    def configured(self) -> Configuration:
        """Return the configuration with what else was said."""
        criteria = self.criteria or self.configuration.criteria or None
        return replace(self.configuration, scan=self.of_scanner, criteria=criteria)

    def gate_of(self, lidar: Lidar) -> Gate:
        """Make the gate: as said, as configured, or else the lane ahead at the height of vehicles."""
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


def heights_of(lidar: Lidar) -> tuple[float, float]:
    """Return the heights at which vehicles are seen well, from the lidar."""
    if lidar.sensor_height is None:
        problem = "it is not known how high the lidar sits above the road"
        raise ConfigurationError(f"{problem}; say it with --sensor-height, or say which heights with --gate-z")
    low, high = lidar.height
    return low - lidar.sensor_height, high - lidar.sensor_height
