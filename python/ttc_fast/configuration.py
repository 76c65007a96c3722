"""Settings of a brake from a file or from options, by the names that they have everywhere else.

A TOML file has up to five parts, all optional:

.. code-block:: toml

    [scan]                                  # arguments of ScanTTC; the log or message gives the geometry of the beams
    mount = [0.27, 0.0, 0.0]
    outline = [-0.1, 0.4, -0.15, 0.15]

    [gate]                                  # arguments of Gate
    x = [2.0, 40.0]

    [range_rate]                            # arguments of RangeRate; even an empty table switches it on

    [[criteria]]                            # a table for each criterion: its kind, and its own settings
    kind = "SweptPathThreshold"
    threshold = 1.0

    [brake]                                 # arguments of BrakeController
    trigger = [2, 3]

``ttc_fast._settings`` and the classes themselves describe the settings; a value is checked when it is read.
"""

from __future__ import annotations

import importlib
import re
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ttc_fast._core import Gate, RangeRate, ScanTTC
from ttc_fast._settings import GATE, RANGE_RATE, SCAN, hint, settings_of
from ttc_fast._validate import shown
from ttc_fast.brake import (
    BrakeController,
    EstimateThreshold,
    IttcThreshold,
    PresentArc,
    RssDistance,
    StoppingDistance,
    SweptPathThreshold,
)
from ttc_fast.brake.settings import BrakeSettings

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from os import PathLike

    from ttc_fast._settings import Setting
    from ttc_fast.brake import Criterion

CRITERIA = {
    kind.__name__: kind
    for kind in (IttcThreshold, SweptPathThreshold, StoppingDistance, PresentArc, RssDistance, EstimateThreshold)
}
BRAKE = settings_of(BrakeSettings)
LARGEST_FILE = 1_000_000
"""Bytes of a file of settings; a larger one is something else."""
DEEPEST = 50
"""The most tables and lists that lie in one another, and the most parts of a key of TOML."""
KEYS = re.compile(r"[=,{}\[\]]")
"""What is around a key of TOML in its line."""
PARTS = ("scan", "gate", "range_rate", "criteria", "brake")


class ConfigurationError(ValueError):
    """A setting that cannot be used: which, what is wrong with it, and what would be right."""


@dataclass(frozen=True)
class Configuration:
    """Settings of a brake. A setting that is not given has its default.

    Attributes
    ----------
    scan : dict
        Arguments of ``ScanTTC``.
    gate : Gate or None
        The gate that selects the points of a cloud.
    range_rate : dict or None
        Arguments of ``RangeRate``; None is without one.
    criteria : tuple of criteria or None
        The criteria; None are the defaults of the controller.
    brake : dict
        Other arguments of ``BrakeController``.

    Examples
    --------
    >>> from ttc_fast.configuration import Configuration
    >>> settings = Configuration.of({"criteria": [{"kind": "IttcThreshold", "threshold": 0.5}], "brake": {"hold": 1.0}})
    >>> settings.criteria, settings.brake
    ((IttcThreshold(threshold=0.5),), {'hold': 1.0})
    """

    scan: dict[str, Any] = field(default_factory=dict)
    gate: Gate | None = None
    range_rate: dict[str, Any] | None = None
    criteria: tuple[Criterion, ...] | None = None
    brake: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, parts: Mapping[str, Any]) -> Configuration:
        """Make a configuration from plain values, as a TOML file has them.

        Raises
        ------
        ConfigurationError
            If a setting is unknown or cannot be used.
        """
        for name in parts:
            if name not in PARTS:
                raise ConfigurationError(f"the configuration has no setting {name!r}: {hint(name, PARTS)}")
        gate, rates, criteria = parts.get("gate"), parts.get("range_rate"), parts.get("criteria")
        return cls(
            scan=_read("scan", parts.get("scan", {}), SCAN),
            gate=None if gate is None else _made("gate", Gate, _read("gate", gate, GATE)),
            range_rate=None if rates is None else _read("range_rate", rates, RANGE_RATE),
            criteria=None if criteria is None else _criteria(criteria),
            brake=_read("brake", parts.get("brake", {}), BRAKE),
        )

    @classmethod
    def read(cls, path: str | PathLike[str]) -> Configuration:
        """Make a configuration from a TOML file.

        Raises
        ------
        ConfigurationError
            If the file cannot be read, or a setting in it is unknown or cannot be used.
        """
        parts = read_file(path, read_toml)
        try:
            return cls.of(parts)
        except ConfigurationError as error:
            raise ConfigurationError(f"{path}: {error}") from None

    def scanner(self, **geometry: Any) -> ScanTTC:
        """Make the scanner from what a log or message says of it; a configured value wins."""
        scan: ScanTTC = _made("scan", ScanTTC, {**geometry, **self.scan})
        return scan

    def controller(self, scan: ScanTTC | None = None, path: Any = None, **more: Any) -> BrakeController:
        """Make the controller with this scan or path and more arguments; a configured value wins."""
        rates = None
        if scan is not None and self.range_rate is not None:
            rates = _made("range_rate", RangeRate, {"scan": scan, **self.range_rate})
        settings = {"criteria": self.criteria, "scan": scan, "path": path, "range_rate": rates, **more, **self.brake}
        controller: BrakeController = _made("brake", BrakeController, settings)
        return controller


def read_file(path: str | PathLike[str], read: Callable[[str], dict[str, Any]]) -> dict[str, Any]:
    """Return what a reader makes of the text of a file; a ConfigurationError names the file."""
    try:
        with Path(path).open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
        if len(content) > LARGEST_FILE:
            raise ValueError(f"has more than {LARGEST_FILE / 1e6:g} MB, which are no settings")
        return read(content.decode("utf-8-sig"))
    except OSError as error:
        raise ConfigurationError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise ConfigurationError(f"{path}: is not UTF-8 text: {error}") from None
    except RecursionError:
        raise ConfigurationError(f"{path}: is nested too deeply") from None
    except ValueError as error:
        raise ConfigurationError(f"{path}: {error}") from None


def read_toml(text: str) -> dict[str, Any]:
    """Read TOML; a ValueError says what is wrong with it."""
    try:
        tomllib = importlib.import_module("tomllib" if sys.version_info >= (3, 11) else "tomli")
    except ModuleNotFoundError:
        raise ValueError("needs tomli to be read before Python 3.11: pip install tomli") from None
    # The memory for a key grows with the square of its parts.
    if any(part.count(".") > DEEPEST for line in text.splitlines() for part in KEYS.split(line.partition("#")[0])):
        raise RecursionError
    try:
        table: dict[str, Any] = tomllib.loads(text)
    except ValueError as error:
        raise ValueError(f"is not TOML: {error}") from None
    return table


def _criteria(tables: Any) -> tuple[Criterion, ...]:
    if isinstance(tables, dict):
        raise ConfigurationError("criteria must be a list of tables: write [[criteria]] instead of [criteria]")
    if not isinstance(tables, (list, tuple)):
        raise ConfigurationError(f"criteria must be a list of tables, got {shown(tables)}")
    return tuple(map(_criterion, tables))


def _criterion(table: Any) -> Criterion:
    name = table.get("kind") if isinstance(table, dict) else None
    if not isinstance(name, str) or name not in CRITERIA:
        meant = f": {hint(name, CRITERIA)}" if isinstance(name, str) else ""
        raise ConfigurationError(f"criteria: kind must be one of {', '.join(CRITERIA)}; got {shown(name)}{meant}")
    kind = CRITERIA[name]
    arguments = {key: value for key, value in table.items() if key != "kind"}
    criterion: Criterion = _made(name, kind, _read(f"criteria: {name}", arguments, settings_of(kind)))
    return criterion


def _read(part: str, table: Any, settings: Iterable[Setting]) -> dict[str, Any]:
    """Return the values of a table, each as its setting reads it."""
    if not isinstance(table, dict):
        raise ConfigurationError(f"{part} must be a table of settings, got {shown(table)}")
    by_name = {each.name: each for each in settings}
    for name in table:
        if name not in by_name:
            raise ConfigurationError(f"{part} has no setting {name!r}: {hint(str(name), by_name)}")
    try:
        return {name: by_name[name].read(value) for name, value in table.items()}
    except (TypeError, ValueError) as error:
        raise ConfigurationError(f"{part}: {error}") from None


def _made(part: str, kind: Any, settings: Mapping[str, Any]) -> Any:
    try:
        return kind(**settings)
    except (ValueError, TypeError, OverflowError) as error:
        raise ConfigurationError(f"{part}: {error}") from None
