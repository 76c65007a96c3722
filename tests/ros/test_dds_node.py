"""The node of ROS 2, over DDS and by rclpy: in a process of its own, among sensors and listeners over DDS."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import pytest

from tests.support.dds_driver import FAR, NEAR, Driver, NodeProcess, odometry, scan, stamped
from tests.support.dds_wire import LOOPBACK, Forger, free_domain, make, serialised

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

SILENT = {"watchdog_period": 3600.0, "sensor_timeout": 3600.0, "motion_timeout": 3600.0}
"""Settings with which it says one thing to each scan, and nothing on its own."""


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    return free_domain()


BY_DDS = pytest.mark.parametrize("start", ["dds"], indirect=True)
"""For what only this node has."""


@pytest.fixture(params=["dds", "rclpy"])
def start(domain: int, request: pytest.FixtureRequest) -> Iterator[Callable[..., NodeProcess]]:
    if request.param == "rclpy" and find_spec("rclpy") is None:
        pytest.skip("needs rclpy: make ros2 installs it, and its tests run there")
    started: list[NodeProcess] = []

    def start_node(**settings: Any) -> NodeProcess:
        started.append(NodeProcess(domain, by=request.param, **settings))
        return started[-1]

    yield start_node
    for each in started:
        each.close()


@pytest.fixture
def driver(domain: int) -> Iterator[Driver]:
    made = Driver(domain)
    yield made
    made.close()


def go(driver: Driver) -> None:
    """Drive on until the node knows it: it brakes as long as it has no scan or no speed."""
    driver.meet()
    driver.drive_until(lambda said: not said.data, scan(FAR), odometry(4.0))
    driver.listen_out()


def test_every_decision_is_right(start: Callable[..., NodeProcess], driver: Driver) -> None:
    start(**SILENT)
    go(driver)
    before = len(driver["/brake_bool"])
    asked = [NEAR if i * i % 7 < 3 else FAR for i in range(500)]
    answers = [driver.ask(distance) for distance in asked]
    assert answers == [distance == NEAR for distance in asked]
    assert len(driver["/brake_bool"]) == before + len(asked)  # one each


@pytest.mark.parametrize("reduced", [0.0, 0.5])
def test_drive_is_zero_throttle_or_a_reduced_speed(
    reduced: float, start: Callable[..., NodeProcess], driver: Driver
) -> None:
    start(**SILENT, brake_speed=reduced, deceleration=5.0, base_frame="car")
    go(driver)
    assert driver.ask(NEAR)
    braked = time.time_ns()
    assert not any(driver.ask(FAR) for _ in range(20))
    freed = time.time_ns()
    assert driver.ask(NEAR)
    drives = driver["/drive"]
    driver.until(lambda: drives and asked_at(drives[-1]) > freed)
    assert (drives[-1].drive.speed, drives[-1].drive.acceleration) == (reduced, 5.0)
    assert drives[-1].header.frame_id == "car"
    assert any(asked_at(each) < braked for each in drives)
    assert not any(braked < asked_at(each) < freed for each in drives)  # silent otherwise


def asked_at(drive: Any) -> int:
    """When the node said so, ns."""
    return int(drive.header.stamp.sec) * 10**9 + int(drive.header.stamp.nanosec)


def test_marker_and_diagnostics_say_why(start: Callable[..., NodeProcess], driver: Driver) -> None:
    start(**SILENT, diagnostics_period=0.1)
    go(driver)
    driver.drive_until(lambda said: said.data, scan(NEAR), None)
    driver.until(lambda: driver["/ttc_fast/cause"])
    marker = driver["/ttc_fast/cause"][-1]
    assert (marker.pose.position.x, marker.pose.position.y) == (
        pytest.approx(NEAR, abs=0.01),
        pytest.approx(0.0, abs=0.1),
    )
    assert (marker.color.r, marker.color.g, marker.color.b) == (1.0, 0.0, 0.0)
    driver.until(lambda: diagnosed(driver).get("command") == "BRAKE")
    ttc, age = (float(diagnosed(driver)[name].split()[0]) for name in ("ttc", "age of the data"))
    assert ttc == pytest.approx(max(0.5 - age, 0.0), abs=0.02)


def diagnosed(driver: Driver) -> dict[str, str]:
    """The values of the latest diagnostics."""
    if not driver["/diagnostics"]:
        return {}
    (status,) = driver["/diagnostics"][-1].status
    return {each.key: each.value for each in status.values}


@pytest.mark.parametrize("name", ["std_msgs/Float32", "std_msgs/Float64", "nav_msgs/Odometry"])
def test_speed_topic_may_have_any_of_its_types(name: str, start: Callable[..., NodeProcess], domain: int) -> None:
    start(**SILENT, speed_topic="/speed")
    driver = Driver(domain, speed=name, topic="/speed")
    driver.meet()
    speed = odometry(4.0) if name.startswith("nav") else serialised(name, make(name, data=4.0))
    driver.drive_until(lambda said: not said.data, scan(FAR), speed)
    driver.listen_out()
    assert driver.ask(NEAR)
    driver.close()


def test_watchdog_acts_when_sensors_die_and_lets_go_when_they_live_again(
    start: Callable[..., NodeProcess], driver: Driver
) -> None:
    start(sensor_timeout=0.5, motion_timeout=0.5, watchdog_period=0.02, diagnostics_period=0.05)
    driver.meet()

    def all_is_well(said: Any) -> bool:
        return not said.data

    def brakes_for(reason: str) -> Callable[[Any], bool]:
        return lambda said: said.data and diagnosed(driver).get("reason") == reason

    driver.drive_until(all_is_well, scan(FAR), odometry(4.0))
    driver.drive_until(brakes_for("STALE"), None, odometry(4.0))
    driver.drive_until(all_is_well, scan(FAR), odometry(4.0))
    driver.drive_until(brakes_for("NO_MOTION"), scan(FAR), None)
    driver.drive_until(all_is_well, scan(FAR), odometry(4.0))


@pytest.mark.slow
def test_sensors_may_be_started_again_and_so_may_the_node(start: Callable[..., NodeProcess], domain: int) -> None:
    node = start(**SILENT)
    for _ in range(2):
        driver = Driver(domain)
        go(driver)
        assert not driver.ask(FAR)
        driver.close()
    driver = Driver(domain)
    go(driver)
    node.process.kill()
    node.process.wait()
    start(**SILENT)
    driver.until(
        lambda: all(len(each.reader.get_matched_publications()) == 1 for each in driver.participant.subscriptions)
    )
    go(driver)
    assert not driver.ask(FAR)
    driver.close()


@BY_DDS
def test_damaged_messages_are_counted_in_the_diagnostics(
    start: Callable[..., NodeProcess], driver: Driver, domain: int
) -> None:
    node = start(**SILENT, diagnostics_period=0.05)
    go(driver)
    # The node came second, so its ports are those of the second participant.
    forger = Forger(domain, driver.scans.writer.guid.bytes, first=1_000_000, participant=1)
    whole = scan(NEAR)
    for size in range(4, len(whole), 20):
        forger.send(whole[:size])
    sent = len(range(4, len(whole), 20))
    driver.until(lambda: diagnosed(driver).get("dropped: /scan", "").split(";")[0] == str(sent))
    before = len(driver["/brake_bool"])
    forger.send(whole)
    driver.until(lambda: len(driver["/brake_bool"]) == before + 1)  # it listens to the forger still
    forger.close()
    assert node.process.poll() is None


@pytest.mark.slow
def test_a_listener_that_is_stuck_holds_nobody_up(
    start: Callable[..., NodeProcess], driver: Driver, domain: int
) -> None:
    start(**SILENT)
    listener = subprocess.Popen(
        [
            sys.executable,
            "-c",
            "import sys, time\n"
            "from ttc_fast.ros.dds.participant import Participant\n"
            "from ttc_fast.ros.dds.settings import DdsSettings\n"
            "node = Participant(DdsSettings(domain_id=int(sys.argv[1])))\n"
            "brake = node.subscribe('/brake_bool', 'std_msgs/Bool', bytes, print)\n"
            "while not brake.reader.get_matched_publications():\n"
            "    time.sleep(0.01)\n"
            "print('listening', flush=True)\n"
            "time.sleep(60)\n",
            str(domain),
        ],
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert listener.stdout is not None
        assert listener.stdout.readline().strip() == "listening"
        os.kill(listener.pid, signal.SIGSTOP)
        go(driver)
        answers = [driver.ask(NEAR if i % 2 else FAR) for i in range(1000)]
        assert answers == [bool(i % 2) for i in range(1000)]
    finally:
        listener.kill()
        listener.communicate()


def test_it_ends_when_told_to(start: Callable[..., NodeProcess], driver: Driver) -> None:
    node = start()
    driver.meet()
    assert node.close() == 0


@pytest.mark.slow
def test_memory_stays_flat_and_nothing_is_lost(start: Callable[..., NodeProcess], driver: Driver) -> None:
    node = start(**SILENT, diagnostics_period=0.1)
    go(driver)
    scans = [scan(NEAR), scan(FAR)]
    said = driver["/brake_bool"]

    def drive(count: int) -> None:
        for i in range(count):
            said.clear()
            driver.scans.publish(stamped(scans[i % 2]))
            driver.until(lambda: said)
            assert [bool(each.data) for each in said] == [i % 2 == 0]

    drive(1000)
    before = node.resident()
    drive(6000)
    assert node.resident() - before < 1 << 20
