"""What the driver asks for, in graphs of real processes: the node, and a car with its driver, over each transport."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from tests.support.common import CAR
from tests.support.dds_wire import LOOPBACK, free_domain
from tests.support.ros1_graph import MISSING, Ros1Graph

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parents[2]
CAR_AND_DRIVER = ROOT / "tests" / "support" / "driven_car.py"
SETTINGS = f"outline = {list(CAR)}\nmotion_timeout = 1.0\nsensor_timeout = 1.0\n"
"""The timeouts leave room for a machine that is busy with other tests."""


class Processes:
    """The processes of a graph of one transport."""

    def __init__(self, transport: str, folder: Path) -> None:
        self.transport, self.folder = transport, folder
        self.environment = {**os.environ, "PYTHONPATH": f"{ROOT / 'python'}:{ROOT}:{os.environ.get('PYTHONPATH', '')}"}
        self.running: list[subprocess.Popen[str]] = []
        self.master: Ros1Graph | None = None
        if transport == "ros1":
            self.master = Ros1Graph(folder)
            self.master.master()
            self.environment |= self.master.environment
        else:
            loopback = {"CYCLONEDDS_URI": LOOPBACK, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
            self.environment |= {**loopback, "ROS_DOMAIN_ID": str(free_domain())}

    def node(self, settings: str, *arguments: str) -> subprocess.Popen[str]:
        config = self.folder / "brake.toml"
        config.write_text(settings)
        command = ["-m", "ttc_fast.cli", "node", f"--{self.transport}", "--config", str(config)]
        return self._start(*command, *(("--", *arguments) if arguments else ()))

    def drive(self, scenario: str, asks: str, takes_over: str = "") -> Any:
        """Drive a car by a scenario, and return what happened."""
        car = self._start(str(CAR_AND_DRIVER), self.transport, scenario, asks, takes_over)
        said, complaint = car.communicate(timeout=90)
        assert car.returncode == 0, complaint
        heard = json.loads(said.splitlines()[-1])
        print({name: value for name, value in heard.items() if name != "drives"})
        return heard

    def _start(self, *command: str) -> subprocess.Popen[str]:
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        self.running.append(subprocess.Popen([sys.executable, *command], env=self.environment, **pipes))  # type: ignore[call-overload]
        return self.running[-1]

    def end(self) -> None:
        for each in self.running:
            each.kill()
            each.communicate()
        if self.master:
            self.master.end()


def needs(transport: str) -> None:
    if transport == "ros1":
        pytest.importorskip("rospy", reason="needs rospy: make ros1 installs it on Debian and Ubuntu")
        if MISSING:
            pytest.skip(f"needs {' and '.join(MISSING)}: make ros1 installs them")
    if transport == "rclpy" and find_spec("rclpy") is None:
        pytest.skip("needs rclpy: make ros2 installs it, and its tests run there")


@pytest.fixture(params=["dds", "ros1", "rclpy"])
def graph(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Processes]:
    needs(request.param)
    made = Processes(request.param, tmp_path)
    yield made
    made.end()


@pytest.mark.parametrize(("asks", "mux"), [("drive_in", True), ("cmd_vel", False)])
def test_a_driver_who_backs_out_after_a_stop_is_let_go(graph: Processes, asks: str, mux: bool) -> None:
    graph.node(f"{SETTINGS}wheelbase = 0.33\n" + ("mux = true" if mux else f'commanded_topic = "{asks}"'))
    said = graph.drive("back out", asks)
    assert said["held"]
    assert said["released after"] < 0.5
    assert not said["braked again"]
    assert said["at"] < said["stopped at"] - 0.5
    drives = said["drives"]
    if mux:  # what the driver asks for goes on, unless the node brakes
        changes = [speed for speed, before in zip(drives, [None, *drives], strict=False) if speed != before]
        assert changes[-3:] == [2.0, 0.0, -1.0]
    else:
        assert set(drives) == {0.0}


def test_a_driver_who_drives_on_is_let_go_and_a_node_that_is_ended_ends_well(graph: Processes) -> None:
    node = graph.node(f'{SETTINGS}commanded_topic = "drive_in"\nwheelbase = 0.33')
    said = graph.drive("drive on", "drive_in")
    assert said["held"]
    assert said["released after"] < 0.5
    assert not said["braked again"]
    assert said["at"] > said["stopped at"] + 0.5
    node.send_signal(signal.SIGTERM)
    began = time.monotonic()
    _, complaint = node.communicate(timeout=20)
    assert node.returncode == 0, complaint
    assert time.monotonic() - began < 5.0
    assert "Traceback" not in complaint


@pytest.mark.parametrize("takes_over", ["override", "joy"])
def test_a_driver_who_takes_over_is_let_go_until_nothing_says_so_any_more(graph: Processes, takes_over: str) -> None:
    settings = f'commanded_topic = "drive_in"\noverride_topic = "{takes_over}"\noverride_button = 2'
    graph.node(f"{SETTINGS}{settings}")
    said = graph.drive("take over", "drive_in", takes_over)
    assert said["held"]
    assert said["released after"] < 0.5
    assert not said["braked again"]
    assert 0.3 < said["ended after"] < 1.0
