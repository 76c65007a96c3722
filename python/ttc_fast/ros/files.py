"""Parameters of the node from a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ttc_fast.configuration import PARTS, Configuration, ConfigurationError, read_toml
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
        By name; for ``NodeSettings.of``.

    Raises
    ------
    SettingError
        If it cannot be read, or is not what its name says.
    """
    path = Path(path)
    readers = {".toml": read_toml, ".yaml": _yaml, ".yml": _yaml}
    if path.suffix not in readers:
        raise SettingError(f"{path}: must end in .toml, .yaml or .yml, which says how it is to be read")
    try:
        return readers[path.suffix](path.read_text(encoding="utf-8"))
    except OSError as error:
        raise SettingError(f"{path}: cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise SettingError(f"{path}: {error}") from None


def read_configuration(path: str | PathLike[str]) -> Configuration:
    """Read the settings of a brake from a file: a configuration, or the parameters of a node.

    Parameters
    ----------
    path : path
        As ``read_parameters`` takes it.

    Returns
    -------
    Configuration
        Of a file that has nothing but its parts, these; else what a node with these parameters brakes by.

    Raises
    ------
    ConfigurationError
        If it cannot be read, or something in it cannot be used.
    """
    parameters = read_parameters(path)
    parameters.pop("dds", None)
    try:
        if set(parameters) <= set(PARTS):
            return Configuration.of(parameters)
        return NodeSettings.of(parameters).configuration()
    except ValueError as error:
        raise ConfigurationError(f"{path}: {error}") from None


def _yaml(text: str) -> dict[str, Any]:
    try:
        import yaml
    except ModuleNotFoundError:
        raise ValueError("needs PyYAML to be read: pip install pyyaml, or write it as TOML") from None
    try:
        table = yaml.safe_load(text) or {}
    except yaml.YAMLError as error:
        raise ValueError(f"is not YAML: {error}") from None
    while isinstance(table, dict) and len(table) == 1 and isinstance(next(iter(table.values())), dict):
        table = next(iter(table.values()))  # ROS 2 puts them below the name of the node, and that below ros__parameters
    if not isinstance(table, dict):
        raise ValueError(f"must be a table of parameters, got {table!r}")
    return table
