"""Parameters of the node from a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ttc_fast.configuration import PARTS, Configuration, ConfigurationError, read_file, read_toml
from ttc_fast.ros.settings import NodeSettings, SettingError

if TYPE_CHECKING:
    from os import PathLike


def read_parameters(path: str | PathLike[str]) -> dict[str, Any]:
    """Read parameters from a file: TOML, or YAML as ROS 1 or ROS 2 have it.

    Parameters
    ----------
    path : path
        A file that ends in .toml, .yaml or .yml.

    Returns
    -------
    dict
        The values by name, for ``NodeSettings.of``.

    Raises
    ------
    SettingError
        If the file cannot be read, or is not what its name says.
    """
    readers = {".toml": read_toml, ".yaml": _read_yaml, ".yml": _read_yaml}
    suffix = Path(path).suffix
    if suffix not in readers:
        raise SettingError(f"{path}: must end in .toml, .yaml or .yml, which says how it is to be read")
    try:
        return read_file(path, readers[suffix])
    except ConfigurationError as error:
        raise SettingError(str(error)) from None


def read_configuration(path: str | PathLike[str]) -> Configuration:
    """Read the settings of a brake from a file: a configuration, or the parameters of a node.

    Parameters
    ----------
    path : path
        A file that ends in .toml, .yaml or .yml.

    Returns
    -------
    Configuration
        The parts in a file that has nothing else; otherwise the settings by which a node with these parameters brakes.

    Raises
    ------
    ConfigurationError
        If the file cannot be read, or something in it cannot be used.
    """
    parameters = read_parameters(path)
    parameters.pop("dds", None)
    try:
        if set(parameters) <= set(PARTS):
            return Configuration.of(parameters)
        return NodeSettings.of(parameters).configuration()
    except ValueError as error:
        raise ConfigurationError(f"{path}: {error}") from None


def _read_yaml(text: str) -> dict[str, Any]:
    """Read YAML; a ValueError says what is wrong with it."""
    try:
        import yaml
    except ModuleNotFoundError:
        raise ValueError("needs PyYAML to be read: pip install pyyaml, or write it as TOML") from None
    try:
        table = yaml.safe_load(text) or {}
    except (yaml.YAMLError, ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise ValueError(f"is not YAML: {error}") from None  # PyYAML raises anything over a tag that does not fit
    while isinstance(table, dict) and len(table) == 1 and isinstance(next(iter(table.values())), dict):
        table = next(iter(table.values()))  # ROS 2 puts them below the name of the node, and that below ros__parameters
    if not isinstance(table, dict):
        raise ValueError(f"must be a table of parameters, got {table!r}")
    return table
