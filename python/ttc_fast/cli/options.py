"""The options of ``ttc-fast replay`` and ``ttc-fast demo``. Those that are settings follow from their descriptions."""

from __future__ import annotations

import argparse
import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from ttc_fast import _settings
from ttc_fast._exit_codes import USAGE
from ttc_fast._settings import Flag, Number, Numbers, Setting, Texts, flag_of, settings_of
from ttc_fast.brake import BrakeSettings
from ttc_fast.cli.exits import CommandError
from ttc_fast.configuration import CRITERIA, Configuration, ConfigurationError
from ttc_fast.logs import LogOptions
from ttc_fast.logs.raw_clouds import KITTI_LIDAR
from ttc_fast.logs.storage import Copy, Location, located

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from ttc_fast.replay import Settings

T = TypeVar("T", float, int)


def _number(kind: type[T], wanted: str, accepts: Callable[[T], bool]) -> Callable[[str], T]:
    """Return a reader of numbers that says what it wanted."""

    def read(text: str) -> T:
        try:
            number = kind(text)
        except ValueError:
            number = None
        if number is None or not accepts(number):
            raise argparse.ArgumentTypeError(f"must be {wanted}, got {text!r}")
        return number

    return read


finite = _number(float, "a finite number", math.isfinite)
bound = _number(float, "a number, inf included", lambda number: not math.isnan(number))
count = _number(int, "a whole number from 0", lambda number: number >= 0)
positive_count = _number(int, "a whole number from 1", lambda number: number >= 1)


def _named(settings: Iterable[Setting], *names: str) -> tuple[Setting, ...]:
    by_name = {each.name: each for each in settings}
    return tuple(by_name[name] for name in names)


LOG = settings_of(LogOptions)
VEHICLE = _named(
    LOG, "mount", "upside_down", "outline", "range_min", "range_max", "sensor_height", "front_offset", "axes"
)
RECORDING = tuple(each for each in LOG if each not in VEHICLE)
# A bound that is not given is that of the configured gate, or fits the lidar.
GATE = tuple(
    replace(each, name=f"gate_{each.name}", default=None) for each in _named(_settings.GATE, "x", "y", "z", "intensity")
)
REACH = f" By default they begin where the vehicle ends, {KITTI_LIDAR.vehicle_reach:g} m ahead for KITTI."
BRAKE = _named(settings_of(BrakeSettings), "sensor_timeout")


def add(parser: argparse.ArgumentParser) -> None:
    """Declare the options that say how a log is replayed."""
    for title, settings in (
        ("how it was recorded", RECORDING),
        ("the vehicle", VEHICLE),
        ("which points of a cloud count", GATE),
    ):
        group = parser.add_argument_group(title)
        for each in settings:
            _add_setting(group, each)
    brake = parser.add_argument_group("the brake")
    brake.add_argument(
        "--criterion",
        action="append",
        metavar="KIND[:NAME=VALUE,...]",
        help="A criterion of the brake, such as SweptPathThreshold:threshold=1.0 or StoppingDistance. Given again, any "
        "of the criteria brakes. The default is SweptPathThreshold with an outline, IttcThreshold without, "
        "EstimateThreshold for clouds and distances; and StoppingDistance. KIND and NAME are " + _criteria() + ".",
    )
    for each in BRAKE:
        _add_setting(brake, each)
    brake.add_argument(
        "--config",
        type=located,
        metavar="FILE",
        help="Settings of scanner, gate, criteria and brake, or parameters of the node, in the file that ttc-fast node "
        "takes (.toml, .yaml). Options win over it.",
    )


def add_rows(group: Any) -> None:
    """Declare the option for the number of rows that are printed."""
    group.add_argument(
        "--rows",
        type=count,
        default=20,
        metavar="N",
        help="About this many rows are printed; 0 prints none (default %(default)s).",
    )


def settings(arguments: argparse.Namespace) -> Settings:
    """Return the settings that the arguments say."""
    from ttc_fast.replay import Settings

    try:
        configuration = Configuration() if arguments.config is None else _configuration(arguments.config)
        criteria = None
        if arguments.criterion:
            criteria = Configuration.of({"criteria": [_criterion(text) for text in arguments.criterion]}).criteria
    except ConfigurationError as error:
        raise CommandError(USAGE, str(error)) from error
    configuration = replace(configuration, brake={**configuration.brake, **_given(arguments, BRAKE)})
    gate = {name.removeprefix("gate_"): (low, high) for name, (low, high) in _given(arguments, GATE).items()}
    return Settings(configuration, _given(arguments, LOG), gate, criteria)


def _configuration(place: Location) -> Configuration:
    """Read a file of settings, which may be at a URL."""
    from ttc_fast.ros.files import read_configuration

    if isinstance(place, Path):
        return read_configuration(place)
    copy = Copy(place)
    try:
        return read_configuration(copy.path)
    except ConfigurationError as error:
        raise ConfigurationError(str(error).replace(str(copy.path), place)) from None
    finally:
        copy.remove()


def _add_setting(group: Any, setting: Setting) -> None:
    """Declare the option of a setting."""
    kind, text = setting.kind, setting.description + (REACH if setting.name == "gate_x" else "")
    how: dict[str, Any]
    if isinstance(kind, Flag):
        how = {"action": "store_true", "default": None}
    elif isinstance(kind, Number):
        how = {"type": bound if kind.infinite else finite, "metavar": kind.unit.upper()}
    elif isinstance(kind, Numbers):
        read = bound if setting in GATE else finite
        how = {"type": read, "nargs": len(kind.names), "metavar": tuple(name.upper() for name in kind.names)}
    elif isinstance(kind, Texts):
        how = {"type": lambda text: tuple(text.split(",")), "metavar": "X,Y,Z"}
        text += f" Write {flag_of(setting.name)}=-y,x,z where the first is negative."
    else:
        how = {"metavar": "NAME"}
    group.add_argument(flag_of(setting.name), help=text, **how)


def _given(arguments: argparse.Namespace, settings: Iterable[Setting]) -> dict[str, Any]:
    """Return the settings that were given, checked."""
    given = {}
    for setting in settings:
        value = getattr(arguments, setting.name)
        if value is None:
            continue
        try:
            given[setting.name] = setting.kind.check(flag_of(setting.name), value)
        except ValueError as error:
            raise CommandError(USAGE, str(error)) from None
    return given


def _criteria() -> str:
    """Return the kinds of criteria, each with the names of its settings."""
    kinds = {name: ", ".join(each.name for each in settings_of(kind)) for name, kind in CRITERIA.items()}
    *first, last = [f"{name} ({names})" for name, names in kinds.items()]
    return f"{', '.join(first)} and {last}"


def _criterion(text: str) -> dict[str, Any]:
    """Return the table that a configuration has for ``KIND:name=value,name=value``."""
    kind, _, rest = text.partition(":")
    if "=" in kind:
        kind, _, value = text.partition("=")
        name = "threshold" if kind.endswith("Threshold") else "NAME"
        raise CommandError(USAGE, f"--criterion {text}: the value has no name, write {kind}:{name}={value}")
    table: dict[str, Any] = {"kind": kind}
    for part in filter(None, rest.split(",")):
        name, equals, value = part.partition("=")
        try:
            table[name.strip()] = float(value)
        except ValueError:
            got = f"got {part!r}" if equals else f"got {part!r} without a value"
            raise CommandError(USAGE, f"--criterion {kind}: must be NAME=VALUE with a number, {got}") from None
    return table
