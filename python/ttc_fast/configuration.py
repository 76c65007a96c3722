"""Settings of a brake from a file or from options, by the names that they have everywhere else.

A TOML file has up to five parts, all optional:

.. code-block:: toml

    [scan]                                  # as ScanTTC names them; the log or message tells the rest
    mount = [0.27, 0.0, 0.0]
    outline = [-0.1, 0.4, -0.15, 0.15]

    [gate]                                  # as Gate names them
    x = [2.0, 40.0]

    [range_rate]                            # as RangeRate names them; here, even empty, it serves without odometry

    [[criteria]]                            # one for each criterion: its kind, and its own settings
    kind = "SweptPathThreshold"
    threshold = 1.0

    [brake]                                 # as BrakeController names them
    trigger = [2, 3]
"""

from __future__ import annotations

import difflib
import importlib
import inspect
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ttc_fast._core import Gate, RangeRate, ScanTTC
from ttc_fast.brake import (
    BrakeController,
    Command,
    EstimateThreshold,
    IttcThreshold,
    RssDistance,
    StoppingDistance,
    SweptPathThreshold,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from os import PathLike

    from ttc_fast.brake import Criterion

CRITERIA = {
    kind.__name__: kind
    for kind in (IttcThreshold, SweptPathThreshold, StoppingDistance, RssDistance, EstimateThreshold)
}
PARTS = ("scan", "gate", "range_rate", "criteria", "brake")


class ConfigurationError(ValueError):
    """A setting that cannot be used: which, what is wrong with it, and what would be right."""


@dataclass(frozen=True)
class Configuration:
    """Settings of a brake; what is not set is as it is by default.

    Attributes
    ----------
    scan : dict
        Arguments of ``ScanTTC``.
    gate : Gate or None
        Which points of a cloud count.
    range_rate : dict or None
        Arguments of ``RangeRate``; None is without one.
    criteria : tuple of criteria or None
        None are the controller's own.
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
        """Make it from plain values, as a TOML file has them."""
        _known("the configuration", parts, PARTS)
        gate, rates, criteria = parts.get("gate"), parts.get("range_rate"), parts.get("criteria")
        brake = dict(
            _settings("brake", parts.get("brake", {}), BrakeController, but={"criteria", "scan", "path", "range_rate"})
        )
        if "when_blind" in brake:
            brake["when_blind"] = _command(brake["when_blind"])
        for name in ("trigger", "release"):
            if isinstance(brake.get(name), list):
                brake[name] = tuple(brake[name])
        return cls(
            scan=_settings("scan", parts.get("scan", {}), ScanTTC),
            gate=None if gate is None else _made("gate", Gate, _settings("gate", gate, Gate)),
            range_rate=None if rates is None else _settings("range_rate", rates, RangeRate, but={"scan"}),
            criteria=None if criteria is None else tuple(_criterion(each) for each in criteria),
            brake=brake,
        )

    @classmethod
    def read(cls, path: str | PathLike[str]) -> Configuration:
        """Make it from a TOML file."""
        try:
            return cls.of(read_toml(Path(path).read_text(encoding="utf-8")))
        except OSError as error:
            raise ConfigurationError(f"{path}: cannot be read: {error.strerror}") from None
        except UnicodeDecodeError as error:
            raise ConfigurationError(f"{path}: is not TOML: {error}") from None
        except ValueError as error:
            raise ConfigurationError(f"{path}: {error}") from None

    def scanner(self, **told: Any) -> ScanTTC:
        """Make the scanner: of what a log or message tells, and what is set, which wins."""
        scan: ScanTTC = _made("scan", ScanTTC, {**told, **self.scan})
        return scan

    def controller(self, scan: ScanTTC | None = None, path: Any = None, **told: Any) -> BrakeController:
        """Make the controller that looks with these."""
        rates = None
        if scan is not None and self.range_rate is not None:
            rates = _made("range_rate", RangeRate, {"scan": scan, **self.range_rate})
        settings = {"criteria": self.criteria, "scan": scan, "path": path, "range_rate": rates, **told, **self.brake}
        controller: BrakeController = _made("brake", BrakeController, settings)
        return controller


def read_toml(text: str) -> dict[str, Any]:
    """Read TOML; a ValueError says what is wrong with it."""
    try:
        tomllib = importlib.import_module("tomllib" if sys.version_info >= (3, 11) else "tomli")
    except ModuleNotFoundError:
        raise ValueError("needs tomli to be read before Python 3.11: pip install tomli") from None
    try:
        table: dict[str, Any] = tomllib.loads(text)
    except ValueError as error:
        raise ValueError(f"is not TOML: {error}") from None
    return table


def _criterion(settings: Any) -> Criterion:
    kind = settings.get("kind") if isinstance(settings, dict) else None
    if kind not in CRITERIA:
        raise ConfigurationError(f"criteria: kind must be one of {', '.join(CRITERIA)}; got {kind!r}")
    arguments = {name: value for name, value in settings.items() if name != "kind"}
    criterion: Criterion = _made(kind, CRITERIA[kind], _settings(f"criteria: {kind}", arguments, CRITERIA[kind]))
    return criterion


def _settings(part: str, settings: Any, kind: Any, but: Iterable[str] = ()) -> dict[str, Any]:
    """Return the settings, if they are arguments of ``kind``."""
    if not isinstance(settings, dict):
        raise ConfigurationError(f"{part} must be a table of settings, got {settings!r}")
    _known(part, settings, [name for name in inspect.signature(kind).parameters if name not in but])
    return settings


def _known(part: str, settings: Iterable[str], names: Iterable[str]) -> None:
    names = list(names)
    for name in settings:
        if name not in names:
            raise ConfigurationError(f"{part} has no setting {name!r}: {hint(name, names)}")


def hint(name: str, names: Sequence[str]) -> str:
    """Say what somebody may have meant who wrote ``name``."""
    close = difflib.get_close_matches(name, names, 1)
    return f"did you mean {close[0]}?" if close else f"there are {', '.join(names)}"


def _made(part: str, kind: Any, settings: Mapping[str, Any]) -> Any:
    try:
        return kind(**settings)
    except (ValueError, TypeError) as error:
        raise ConfigurationError(f"{part}: {error}") from None


def _command(value: Any) -> Any:
    try:
        return Command[value.upper()] if isinstance(value, str) else value
    except KeyError:
        raise ConfigurationError(f"brake: when_blind must be 'brake' or 'warn', got {value!r}") from None
