"""``ttc-fast node``: the brake in a ROS graph."""

from __future__ import annotations

import signal
import sys
import textwrap
import threading
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ttc_fast._exit_codes import MISSING_EXTRA, USAGE
from ttc_fast._extras import install
from ttc_fast._validate import shown
from ttc_fast.cli.exits import CommandError
from ttc_fast.configuration import ConfigurationError
from ttc_fast.ros.files import read_parameters
from ttc_fast.ros.settings import NodeSettings, parameters_of_node

if TYPE_CHECKING:
    import argparse

SUMMARY = "run the brake as a node of ROS 1 or ROS 2"
USAGE_LINE = "ttc-fast node --ros1|--dds|--rclpy [OPTION ...] [ARGUMENT ...]"
DESCRIPTION = """\
  ttc-fast node --rclpy --config brake.toml
  ttc-fast node --rclpy -- --ros-args -r scan:=/front/scan
  ttc-fast node --ros1 --config brake.toml -- scan:=/front/scan _hold:=1.0
  ttc-fast node --dds --config brake.toml

Subscribe to laser scans (scan), clouds, odometry (odom, vesc/odom) and to what the driver asks for, decide when to
brake, and publish brake_bool, drive, /diagnostics and a marker of the cause.

FILE holds the node's parameters by their names: as TOML, or as YAML as ROS 1 or ROS 2 have it.

    min_range = 0.1         # m
    ttc_threshold = 0.8     # s
    outline = [-0.1, 0.4, -0.15, 0.15]

Without FILE every parameter has its default; --help-all lists them. A parameter that ROS gives the node wins.
Arguments after -- go to ROS, which --dds has none of.
"""
COMMON = ("--ros1", "--dds", "--rclpy", "--config")
ADAPTERS = {
    "ros1": ("rospy_node", "rospy comes with ROS 1, and on Debian and Ubuntu: apt-get install python3-rospy"),
    "dds": ("dds_node", install("dds")),
    "rclpy": ("rclpy_node", "rclpy comes with ROS 2: source /opt/ros/<distribution>/setup.bash first"),
}


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    how = parser.add_mutually_exclusive_group(required=True)
    how.add_argument("--ros1", dest="by", action="store_const", const="ros1", help="Be a node of ROS 1, by rospy.")
    how.add_argument(
        "--dds",
        dest="by",
        action="store_const",
        const="dds",
        help="Be a participant in a ROS 2 graph, without an installation of ROS.",
    )
    how.add_argument("--rclpy", dest="by", action="store_const", const="rclpy", help="Be a node of ROS 2, by rclpy.")
    parser.add_argument("--config", type=Path, metavar="FILE", help="The file of the parameters (.toml, .yaml).")
    parser.add_argument("ros_arguments", nargs="*", metavar="ARGUMENT", help="An argument for ROS, behind --.")
    lines = [f"{each.name:<19} {each.description}" for each in parameters_of_node()]
    wrapped = [textwrap.fill(line, 100, subsequent_indent=" " * 20, break_on_hyphens=False) for line in lines]
    parser.add_argument_group("parameters", textwrap.indent("\n".join(wrapped), "  "))


def run(arguments: argparse.Namespace) -> None:
    """Run the node until it is shut down."""
    name, remedy = ADAPTERS[arguments.by]
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))  # until the node has a handler of its own
    try:
        if arguments.by == "dds" and arguments.ros_arguments:
            given = " ".join(arguments.ros_arguments)
            raise ConfigurationError(
                f"--dds takes no arguments of ROS, got {given}: put parameters and [dds] into a file"
            )
        parameters = read_parameters(arguments.config) if arguments.config else {}
        dds = _dds_settings(parameters.pop("dds", {}))
        settings = NodeSettings.of(parameters)  # a mistake in the settings is said before the node waits for anything
        try:
            adapter = import_module(f"ttc_fast.ros.{name}")
        except ModuleNotFoundError as error:
            problem = f"--{arguments.by} needs {error.name}, which is not installed: {remedy}"
            raise CommandError(MISSING_EXTRA, problem) from None
        if arguments.by == "dds":
            adapter.run(settings, dds)
        else:
            adapter.run(parameters)
    except ConfigurationError as error:
        where = "" if str(error).startswith(f"{arguments.config}") or not arguments.config else f"{arguments.config}: "
        raise CommandError(USAGE, f"{where}{error}") from None


def _dds_settings(table: Any) -> Any:
    """Make the settings that only DDS has from the table [dds]."""
    try:
        if not isinstance(table, dict):
            raise TypeError(f"must be a table of settings, got {shown(table)}")
        return import_module("ttc_fast.ros.dds.settings").DdsSettings.of(table)
    except (TypeError, ValueError) as error:
        raise ConfigurationError(f"dds: {error}") from None
