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
from tests.support.dds_wire import free_domain
from tests.support.ros1_graph import MISSING, Ros1Graph

if TYPE_CHECKING:
    from collections.abc import Iterator

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
CAR_AND_DRIVER = ROOT / "tests" / "support" / "driven_car.py"
SETTINGS = f"outline = {list(CAR)}\nmotion_timeout = 1.0\nsensor_timeout = 1.0\n"
"""The timeouts leave room for a machine that is busy with other tests."""
NAMESPACE = "/fleet/car"


class Processes:
    """A node, and a car in the same graph, each over its own transport and in the same namespace."""

    def __init__(self, node: str, car: str, folder: Path) -> None:
        self._node, self._car, self._folder = node, car, folder
        self._environment = {**os.environ, "PYTHONPATH": f"{ROOT / 'python'}:{ROOT}:{os.environ.get('PYTHONPATH', '')}"}
        self._environment.pop("CYCLONEDDS_URI", None)
        self._running: list[subprocess.Popen[str]] = []
        self._ros1 = Ros1Graph(folder) if node == "ros1" else None
        if self._ros1:
            self._ros1.master()
            self._environment |= self._ros1.environment | {"ROS_NAMESPACE": NAMESPACE}
        else:
            self._environment |= {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "ROS_DOMAIN_ID": str(free_domain())}

    def drive(self, settings: str, scenario: str, asks: str, takes_over: str = "") -> Any:
        """Drive a car by a scenario around a node, and return what happened."""
        car = self._start(str(CAR_AND_DRIVER), self._car, scenario, asks, takes_over, NAMESPACE)
        assert car.stdout is not None
        if car.stdout.readline() != "ready\n":
            pytest.fail(car.communicate()[1])
        config = self._folder / "brake.toml"
        config.write_text(SETTINGS + settings + (f'\n[dds]\nnamespace = "{NAMESPACE}"' if self._node == "dds" else ""))
        named = ["--", "--ros-args", "-r", f"__ns:={NAMESPACE}"] if self._node == "rclpy" else []
        self.node = self._start("-m", "ttc_fast.cli", "node", f"--{self._node}", "--config", str(config), *named)
        said, complaint = car.communicate(timeout=90)
        assert car.returncode == 0, complaint
        heard = json.loads(said.splitlines()[-1])
        print({name: value for name, value in heard.items() if name != "drives"})
        return heard

    def _start(self, *command: str) -> subprocess.Popen[str]:
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        self._running.append(subprocess.Popen([sys.executable, *command], env=self._environment, **pipes))  # type: ignore[call-overload]
        return self._running[-1]

    def end(self) -> None:
        for each in self._running:
            each.kill()
            each.communicate()
        if self._ros1:
            self._ros1.end()


ALIKE = ["dds-dds", "ros1-ros1", "rclpy-rclpy"]
"""The transports of the node and of the car."""


@pytest.fixture(params=ALIKE)
def graph(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Processes]:
    if "ros1" in request.param:
        pytest.importorskip("rospy", reason="needs rospy: make ros1 installs it on Debian and Ubuntu")
        if MISSING:
            pytest.skip(f"needs {' and '.join(MISSING)}: make ros1 installs them")
    if "rclpy" in request.param and find_spec("rclpy") is None:
        pytest.skip("needs rclpy: make ros2 installs it, and its tests run there")
    node, car = request.param.split("-")
    made = Processes(node, car, tmp_path)
    yield made
    made.end()


@pytest.mark.parametrize(("asks", "mux"), [("drive_in", True), ("cmd_vel", False)])
def test_a_driver_who_backs_out_after_a_stop_is_let_go(graph: Processes, asks: str, mux: bool) -> None:
    said = graph.drive(
        "wheelbase = 0.33\n" + ("mux = true" if mux else f'commanded_topic = "{asks}"'), "back out", asks
    )
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


@pytest.mark.parametrize("graph", [*ALIKE, "dds-rclpy", "rclpy-dds"], indirect=True)
def test_a_driver_who_drives_on_is_let_go_and_a_node_that_is_ended_ends_well(graph: Processes) -> None:
    said = graph.drive('commanded_topic = "drive_in"\nwheelbase = 0.33', "drive on", "drive_in")
    assert said["held"]
    assert said["released after"] < 0.5
    assert not said["braked again"]
    assert said["at"] > said["stopped at"] + 0.5
    graph.node.send_signal(signal.SIGTERM)
    began = time.monotonic()
    _, complaint = graph.node.communicate(timeout=20)
    assert graph.node.returncode == 0, complaint
    assert time.monotonic() - began < 5.0
    assert "Traceback" not in complaint
    assert f"{NAMESPACE}/scan: the scanner is mounted" in complaint


@pytest.mark.parametrize("takes_over", ["override", "joy"])
def test_a_driver_who_takes_over_is_let_go_until_nothing_says_so_any_more(graph: Processes, takes_over: str) -> None:
    settings = f'commanded_topic = "drive_in"\noverride_topic = "{takes_over}"\noverride_button = 2'
    said = graph.drive(settings, "take over", "drive_in", takes_over)
    assert said["held"]
    assert said["released after"] < 0.5
    assert not said["braked again"]
    assert 0.3 < said["ended after"] < 1.0
