"""The node of rclpy as a process: what it says of parameters that cannot be used."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

PYTHON = Path(__file__).parents[2] / "python"
if find_spec("rclpy") is None:
    pytest.skip("needs rclpy: make ros2 installs it, and its tests run there", allow_module_level=True)


def ended(tmp_path: Path, *arguments: str) -> tuple[int, str]:
    """Run the node with arguments of ROS, and return its exit code and what it said itself."""
    command = [sys.executable, "-m", "ttc_fast.cli", "node", "--rclpy", "--", "--ros-args", *arguments]
    inherited = os.environ.get("PYTHONPATH", "")
    environment = {**os.environ, "ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF", "ROS_LOG_DIR": str(tmp_path)}
    environment["PYTHONPATH"] = f"{PYTHON}:{inherited}"
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60)
    [said] = [line for line in done.stderr.splitlines() if "] [rcl]: " not in line]
    return done.returncode, said


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["-p", "holdd:=1.0"], "there is no parameter 'holdd': did you mean hold?"),
        (["-p", "hold:=abc"], "hold must be a number, got 'abc'"),
        (["-p", "hold:=-1.0"], "hold must be finite and at least 0 s, got -1.0"),
        (["-p", "trigger:=[3,2]"], "trigger must be two integers"),
        (["-p", "scan_topic:=1scan"], "scan_topic must be the name of a topic"),
        (["-p", "commanded_topic:=drive"], "commanded_topic and drive_topic are both drive"),
        (["-p", "mux:=true", "-r", "drive_in:=drive"], "commanded_topic and drive_topic are both /drive"),
        (["-p", "hold"], "rclpy refuses this: "),
        (["--params-file", "/nowhere.yaml"], "rclpy refuses this: "),
        (["--nonsense"], "rclpy refuses this: "),
    ],
)
def test_what_is_refused_is_one_line(tmp_path: Path, arguments: list[str], says: str) -> None:
    code, said = ended(tmp_path, *arguments)
    assert code == 2
    assert said.startswith(f"ttc-fast: {says}")


def test_a_value_beyond_the_usual_range_may_be_right(tmp_path: Path) -> None:
    """So ROS is not to refuse it; another mistake ends the node here."""
    code, said = ended(tmp_path, "-p", "hold:=100.0", "-p", "release:=[3,2]")
    assert code == 2
    assert said.startswith("ttc-fast: release must be two integers")


def test_a_signal_before_the_node_is_made_ends_it(tmp_path: Path) -> None:
    program = """if True:
        import rclpy
        from ttc_fast.ros import rclpy_node
        made = rclpy_node.RclpyNode

        def shut_down(parameters):
            rclpy.shutdown()
            return made(parameters)

        rclpy_node.RclpyNode = shut_down
        rclpy_node.run({"scan_topic": "/scan"})
    """
    environment = {**os.environ, "PYTHONPATH": str(PYTHON), "ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}
    environment["ROS_LOG_DIR"] = str(tmp_path)
    subprocess.run([sys.executable, "-c", program], env=environment, check=True, timeout=60)
