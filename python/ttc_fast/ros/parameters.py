"""What a graph may know of each parameter: its default, its range, and what it is."""

from __future__ import annotations

import inspect
import re
from dataclasses import fields
from typing import Any, NamedTuple

from ttc_fast.brake import BrakeController
from ttc_fast.ros.settings import OF_THE_CONTROLLER, NodeSettings

RANGES = {
    "min_range": (0.0, 1000.0),
    "ttc_threshold": (0.0, 60.0),
    "brake_speed": (0.0, 100.0),
    "watchdog_period": (0.001, 10.0),
    "diagnostics_period": (0.01, 3600.0),
    "horizon": (0.0, 60.0),
    "warn_at": (1.0, 100.0),
    "release_at": (1.0, 100.0),
    "hold": (0.0, 60.0),
    "deceleration": (0.0, 100.0),
    "standstill_speed": (0.0, 10.0),
    "sensor_timeout": (0.0, 10.0),
    "motion_timeout": (0.0, 10.0),
}
"""For sliders; what NodeSettings refuses is refused all the same."""
AT_START = frozenset(
    {name for name in NodeSettings.__dataclass_fields__ if "_topic" in name or name.endswith("_period")}
)
"""Parameters that are read when the node starts, and cannot be changed later."""


class Parameter(NamedTuple):
    """A parameter of the node."""

    name: str
    default: Any
    limits: tuple[float, float] | None
    description: str


def parameters() -> list[Parameter]:
    """Return every parameter, with values as ROS has them.

    Examples
    --------
    >>> from ttc_fast.ros.parameters import parameters
    >>> hold = next(each for each in parameters() if each.name == "hold")
    >>> hold.default, hold.limits
    (0.5, (0.0, 60.0))
    >>> hold.description
    'How long it brakes at least after the last frame that triggered, s.'
    """
    described = {**_described(BrakeController), **_described(NodeSettings)}
    defaults = {each.name: each.default for each in fields(NodeSettings) if each.name not in ("brake", "parts")}
    signature = inspect.signature(BrakeController).parameters
    defaults |= {name: signature[name].default for name in OF_THE_CONTROLLER}
    return [Parameter(name, _plain(default), RANGES.get(name), described[name]) for name, default in defaults.items()]


def _plain(value: Any) -> Any:
    """Return a default as a value that ROS has: no None, no tuple, no enumeration."""
    if value is None:
        return []
    if isinstance(value, tuple):
        return list(value)
    return value.name.lower() if hasattr(value, "name") else value


def _described(kind: type) -> dict[str, str]:
    """Return what the docstring says of each parameter or attribute."""
    heading = re.compile(r"^(\w+(?:, \w+)*) : .*\n((?:    .*\n?)+)", flags=re.MULTILINE)
    found = heading.findall(inspect.getdoc(kind) or "")
    return {name: " ".join(text.split()) for names, text in found for name in names.split(", ")}
