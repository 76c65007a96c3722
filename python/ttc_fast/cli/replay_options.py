"""Options of ``ttc-fast replay``, by the names of ``LogOptions``, ``Gate`` and ``BrakeController``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ttc_fast.cli.exits import USAGE, CommandError
from ttc_fast.cli.numbers import bound, count, finite, positive, positive_count

if TYPE_CHECKING:
    import argparse

    from ttc_fast.replay import Settings

__all__ = ["add", "add_rows", "positive_count", "settings"]


def axes(text: str) -> tuple[str, ...]:
    """Read three coordinates with commas between them."""
    return tuple(text.split(","))


RECORDING: dict[str, dict[str, Any]] = {
    "--topic": {"metavar": "NAME", "help": "of the scans or clouds, where a bag has several"},
    "--odometry-topic": {"metavar": "NAME", "help": "of the odometry, where a bag has several"},
    "--speed": {"type": finite, "metavar": "V", "help": "of the vehicle, m/s, negative when reversing, instead of the "
                "recorded one"},
    "--max-speed-age": {"type": finite, "metavar": "S", "help": "older odometry says nothing about the speed, s"},
    "--rate": {"type": positive, "metavar": "HZ", "help": "frames a second, instead of stamps: clouds, tables"},
    "--column": {"metavar": "NAME", "help": "of the distances in a table"},
    "--stamp-column": {"metavar": "NAME", "help": "of the stamps in a table"},
}  # fmt: skip
VEHICLE: dict[str, dict[str, Any]] = {
    "--mount": {"type": finite, "nargs": 3, "metavar": ("X", "Y", "YAW"), "help": "of the sensor on the vehicle, m and "
                "rad"},
    "--upside-down": {"action": "store_true", "default": None, "help": "the scanner hangs upside down: its beams run "
                      "the other way round"},
    "--outline": {"type": finite, "nargs": 4, "metavar": ("REAR", "FRONT", "RIGHT", "LEFT"), "help": "of the vehicle, "
                  "m, in its own frame; rear and right are usually negative. With it the vehicle's path is judged"},
    "--range-min": {"type": finite, "metavar": "M", "help": "readings below this are discarded, m"},
    "--range-max": {"type": finite, "metavar": "M", "help": "readings beyond this are discarded, m"},
    "--sensor-height": {"type": finite, "metavar": "M", "help": "of a lidar above the road, m"},
    "--front-offset": {"type": finite, "metavar": "M", "help": "from a lidar to the bumper, m"},
    "--axes": {"type": axes, "metavar": "X,Y,Z", "help": "which stored coordinates of a lidar are forward, left and "
               "up: x,-y,-z for one that hangs upside down, y,-x,z where y is forward; --axes=-y,x,z where the first "
               "is negative"},
}  # fmt: skip
GATE = {"x": "ahead of the lidar", "y": "to its left", "z": "above it", "intensity": "of points, in the units stored"}


def add(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    for title, options in (("how it was recorded", RECORDING), ("the vehicle", VEHICLE)):
        group = parser.add_argument_group(title)
        for flag, settings in options.items():
            group.add_argument(flag, **settings)
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
    said = {flag: getattr(arguments, flag[2:].replace("-", "_")) for flag in (*RECORDING, *VEHICLE)}
    log_options = {
        flag[2:].replace("-", "_"): tuple(value) if isinstance(value, list) else value
        for flag, value in said.items()
        if value is not None
    }
    bounds = {name: getattr(arguments, f"gate_{name}") for name in GATE}
    gate = {name: (low_high[0], low_high[1]) for name, low_high in bounds.items() if low_high is not None}
    return Settings(configuration, log_options, gate, criteria)


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
