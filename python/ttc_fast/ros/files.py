"""Parameters of the node from a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ttc_fast._validate import shown
from ttc_fast.configuration import DEEPEST, PARTS, Configuration, ConfigurationError, read_file, read_toml
from ttc_fast.ros.settings import NodeSettings, SettingError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from os import PathLike

NAME = "ttc_fast"
"""The name of the node, unless it is renamed at launch."""
ROS_2 = "ros__parameters"
"""The key above the parameters of a node in files of ROS 2."""
MOST_ALIASES = 16
"""Aliases of YAML in a file. Each may double what those before it stand for."""
OF_EVERY_NODE = frozenset({"use_sim_time", "qos_overrides", "start_type_description_service"})
"""Parameters that ROS 2 gives to every node."""


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
        aliases = depth = 0
        for event in yaml.parse(text, yaml.SafeLoader):
            aliases += isinstance(event, yaml.AliasEvent)
            depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            if depth > DEEPEST:  # the time grows with the square of the depth
                raise RecursionError
        if aliases > MOST_ALIASES:
            raise ValueError(f"it has {aliases} aliases, more than {MOST_ALIASES}: write out what they stand for")
        table = yaml.safe_load(text) or {}
    except (yaml.YAMLError, ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise ValueError(f"is not YAML: {error}") from None  # PyYAML raises anything over a tag that does not fit
    if isinstance(table, dict):
        table = _of_node(table)
    if not isinstance(table, dict):
        raise ValueError(f"must be a table of parameters, got {shown(table)}")
    return table


def _of_node(table: dict[str, Any]) -> dict[str, Any]:
    """Return the parameters of the node in a file that may name several nodes, as ``ros2 param dump`` writes it.

    Wildcards hold for every node. A table of one node is this node's, whatever its name: nodes are renamed at launch.
    """
    nodes = dict(_nodes(table))
    if not nodes:
        nodes = {NAME: table}
    wildcards = [name for name in nodes if name.endswith("*")]
    named = [name for name in nodes if name.rpartition("/")[2] == NAME]
    others = [name for name in nodes if name not in wildcards]
    if not named and len(others) > 1:
        has = ", ".join(others)
        raise ValueError(
            f"has the parameters of several nodes, {has}, and none is {NAME}: name the table of this node so"
        )
    chosen: dict[str, Any] = {}
    for name in (*wildcards, *(named or others)):
        chosen |= nodes[name]
    return {name: value for name, value in chosen.items() if name not in OF_EVERY_NODE}


def _nodes(table: dict[str, Any], path: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """Find the tables of nodes with their full names: below ros__parameters in ROS 2, below the name in ROS 1."""
    for name, value in table.items():
        if not isinstance(value, dict):
            continue
        full = f"{path}/{str(name).strip('/')}"
        if isinstance(value.get(ROS_2), dict):
            yield full, value[ROS_2]
        elif name == NAME or (len(table) == 1 and name not in PARTS and name != "dds" and not _holds_nodes(value)):
            yield full, value
        else:
            yield from _nodes(value, full)


def _holds_nodes(table: dict[str, Any]) -> bool:
    """Return whether a node's table of ROS 2 is anywhere below: then the name above it is a namespace."""
    return any(isinstance(value, dict) and (ROS_2 in value or _holds_nodes(value)) for value in table.values())
