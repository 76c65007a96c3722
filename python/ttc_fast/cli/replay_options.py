"""Options of ``ttc-fast replay``, by the names of ``LogOptions``, ``Gate`` and ``BrakeController``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ttc_fast._settings import Flag, Number, Numbers, Texts, settings_of
from ttc_fast.cli.exits import USAGE, CommandError
from ttc_fast.cli.numbers import bound, count, finite, positive, positive_count
from ttc_fast.logs import LogOptions

if TYPE_CHECKING:
    import argparse

    from ttc_fast._settings import Setting
    from ttc_fast.replay import Settings

__all__ = ["add", "add_rows", "positive_count", "settings"]


# Which options of ``LogOptions`` a heading has; what each means is said there.
GROUPS = {
    "how it was recorded": ("topic", "odometry_topic", "speed", "max_speed_age", "rate", "column", "stamp_column"),
    "the vehicle": (
        "mount", "upside_down", "outline", "range_min", "range_max", "sensor_height", "front_offset", "axes",
    ),
}  # fmt: skip
GATE = {"x": "ahead of the lidar", "y": "to its left", "z": "above it", "intensity": "of points, in the units stored"}


def add(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    described = {setting.name: setting for setting in settings_of(LogOptions)}
    for title, names in GROUPS.items():
        group = parser.add_argument_group(title)
        for name in names:
            _add_setting(group, described[name])
    gate = parser.add_argument_group("which points of a cloud count")
    for name, what in GATE.items():
        unit = "" if name == "intensity" else ", m"
        gate.add_argument(f"--gate-{name}", type=bound, nargs=2, metavar=("LOW", "HIGH"), help=f"{what}{unit}")
    brake = parser.add_argument_group("the brake")
    brake.add_argument(
        "--criterion",
        action="append",
        metavar="KIND[:NAME=VALUE,...]",
        help="when to brake, such as SweptPathThreshold:threshold=1.0 or StoppingDistance; may be given again, and any "
        "of them brakes (default: SweptPathThreshold, IttcThreshold without outline, EstimateThreshold of clouds and "
        "distances; and StoppingDistance)",
    )
    brake.add_argument(
        "--sensor-timeout", type=positive, metavar="S", help="a longer gap between frames brakes, s (default: 0.3)"
    )
    brake.add_argument(
        "--config",
        type=Path,
        metavar="FILE",
        help="settings of scanner, gate, criteria and brake, or parameters of the node: the file that ttc-fast node "
        "takes (.toml, .yaml); options win over it",
    )


def _add_setting(group: Any, setting: Setting) -> None:
    """Declare an option for a setting."""
    kind, text = setting.kind, setting.description
    how: dict[str, Any]
    if isinstance(kind, Flag):
        how = {"action": "store_true", "default": None}
    elif isinstance(kind, Number):
        how = {"type": bound if kind.infinite else finite, "metavar": kind.unit.upper()}
    elif isinstance(kind, Numbers):
        how = {"type": finite, "nargs": len(kind.names), "metavar": tuple(name.upper() for name in kind.names)}
    elif isinstance(kind, Texts):
        how = {"type": lambda text: tuple(text.split(",")), "metavar": "X,Y,Z"}
        text += f" Write {_flag(setting.name)}=-y,x,z where the first is negative."
    else:
        how = {"metavar": "NAME"}
    group.add_argument(_flag(setting.name), help=text, **how)


def _flag(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _log_options(arguments: argparse.Namespace) -> dict[str, Any]:
    """Return what was said of the log, checked."""
    given = {}
    for setting in settings_of(LogOptions):
        value = getattr(arguments, setting.name)
        if value is None:
            continue
        try:
            given[setting.name] = setting.check(value)
        except ValueError as error:
            problem = str(error).replace(setting.name, _flag(setting.name), 1)
            raise CommandError(USAGE, problem) from None
    return given


def add_rows(group: Any) -> None:
    """Declare how many rows are printed."""
    group.add_argument(
        "--rows",
        type=count,
        default=20,
        metavar="N",
        help="about how many rows to print; 0 prints none (default: %(default)s)",
    )


def settings(arguments: argparse.Namespace) -> Settings:
    """Put together what was said."""
    from ttc_fast.configuration import Configuration, ConfigurationError
    from ttc_fast.replay import Settings
    from ttc_fast.ros.files import read_configuration

    try:
        configuration = Configuration() if arguments.config is None else read_configuration(arguments.config)
        criteria = None
        if arguments.criterion:
            criteria = Configuration.of({"criteria": [_criterion(text) for text in arguments.criterion]}).criteria
        if arguments.sensor_timeout is not None:
            brake = {**configuration.brake, "sensor_timeout": arguments.sensor_timeout}
            configuration = replace(configuration, brake=brake)
    except ConfigurationError as error:
        raise CommandError(USAGE, str(error)) from error
    bounds = {name: getattr(arguments, f"gate_{name}") for name in GATE}
    gate = {name: (low_high[0], low_high[1]) for name, low_high in bounds.items() if low_high is not None}
    return Settings(configuration, _log_options(arguments), gate, criteria)


def _criterion(text: str) -> dict[str, Any]:
    """Read ``KIND:name=value,name=value`` into what a configuration has."""
    kind, _, rest = text.partition(":")
    read: dict[str, Any] = {"kind": kind}
    for part in filter(None, rest.split(",")):
        name, equals, value = part.partition("=")
        try:
            read[name.strip()] = float(value)
        except ValueError:
            got = f"got {part!r}" if equals else f"got {part!r} without a value"
            raise CommandError(USAGE, f"--criterion {kind}: must be NAME=VALUE with a number, {got}") from None
    return read
