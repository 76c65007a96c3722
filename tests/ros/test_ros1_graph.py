"""The node in a real graph of ROS 1: master, publishers, node and listener are processes, and are killed."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.support.bags import Odom, Scan, write
from tests.support.ros1_graph import MISSING, PATIENCE, Ros1Graph, kill

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

pytest.importorskip("rospy", reason="needs rospy: make ros1 installs it on Debian and Ubuntu")
if MISSING:
    pytest.skip(f"needs {' and '.join(MISSING)}: make ros1 installs them", allow_module_level=True)

THRESHOLD, SPEED = 1.5, 4.0
AT_ONCE = f"""\
ttc_threshold = {THRESHOLD}
criterion = "ittc"
stopping_distance = false
use_range_rate = false
trigger = [1, 1]
release = [1, 1]
release_at = 1.0
hold = 0.0
"""


@pytest.fixture
def graph(tmp_path: Path) -> Iterator[Ros1Graph]:
    graph = Ros1Graph(tmp_path)
    try:
        graph.master()
        yield graph
    finally:
        graph.end()
        print(graph.logs())  # pytest shows it when the test has failed


@pytest.mark.slow
@pytest.mark.parametrize(("setting", "asked"), [("brake_speed = 0.0", 0.0), ("brake_speed = 0.5", 0.5)])
def test_a_thousand_scans(graph: Ros1Graph, setting: str, asked: float) -> None:
    """Every decision is that of the bare rule: the range over the speed, below the threshold."""
    rng = np.random.default_rng(8)
    distances = np.where(rng.random(1000) < 0.5, rng.uniform(0.5, 5.9, 1000), rng.uniform(7.0, 20.0, 1000))
    # None is so close above the threshold that the time on the way, which is taken off, could matter.
    np.save(graph.folder / "distances.npy", distances.astype(np.float32))
    graph.node(f"{AT_ONCE}{setting}\nwatchdog_period = 100.0\n")
    graph.listen()
    publisher = graph.peer("lockstep", str(graph.folder / "distances.npy"), str(SPEED))
    assert publisher.wait(60) == 0
    expected = [bool(each) for each in distances / SPEED < THRESHOLD]
    # Before them the watchdog may have spoken once, which nobody need have heard.
    assert graph.said("brake") in (expected, [True, *expected])
    assert graph.said("drive")[-sum(expected) :] == [[asked, 6.0]] * sum(expected)
    assert len(graph.said("drive")) <= sum(expected) + 1


@pytest.mark.slow
def test_sources_that_are_killed_and_started_again(graph: Ros1Graph) -> None:
    graph.listen()
    graph.node(f"{AT_ONCE}motion_timeout = 0.3")
    graph.brakes(True)  # nothing comes yet
    scan, odometry = graph.peer("stream", "/scan", "20"), graph.peer("stream", "/odom", str(SPEED))
    graph.brakes(False)
    for process, topic, value in ((scan, "/scan", "20"), (odometry, "/odom", str(SPEED))):
        kill(process)
        graph.brakes(True)
        graph.peer("stream", topic, value)
        graph.brakes(False)


@pytest.mark.slow
def test_a_master_that_is_killed_and_started_again(graph: Ros1Graph) -> None:
    graph.listen()
    node = graph.node(AT_ONCE)
    scan, odometry = graph.peer("stream", "/scan", "20"), graph.peer("stream", "/odom", str(SPEED))
    graph.brakes(False)
    kill(graph.running[0])  # the master
    graph.brakes(False)  # connections live without it
    for process in (scan, odometry):
        kill(process)
    graph.brakes(True)
    graph.master()
    graph.peer("stream", "/scan", "20")
    graph.peer("stream", "/odom", str(SPEED))
    graph.brakes(False)  # it finds them by the new master
    kill(graph.running[1])  # the listener
    graph.heard.clear()
    graph.listen()
    graph.brakes(False)  # and another listener finds it
    assert node.poll() is None


def test_a_node_that_waits_for_the_master(graph: Ros1Graph) -> None:
    kill(graph.running[0])
    graph.node(AT_ONCE)
    time.sleep(0.5)
    graph.master()
    graph.listen()
    graph.brakes(True)


@pytest.mark.parametrize("topic", ["/odom", "/speed32"])
def test_a_speed_topic_that_appears_later(graph: Ros1Graph, topic: str) -> None:
    """Its type is that of whoever publishes it."""
    graph.listen()
    graph.node(f'{AT_ONCE}speed_topic = "{topic}"')
    graph.peer("stream", "/scan", "20")
    graph.brakes(True)
    graph.peer("stream", topic, str(SPEED))
    graph.brakes(False)


def test_parameters_and_remappings_of_ros(graph: Ros1Graph) -> None:
    graph.listen()
    graph.node(AT_ONCE, "_ttc_threshold:=1.0", "odom:=/wheels/odom", "__name:=brake")
    graph.peer("stream", "/scan", "20")  # 1.25 s
    graph.peer("stream", "/wheels/odom", "16")
    graph.brakes(False)
    assert parameter(graph, "getParam", "/brake/ttc_threshold") == 1.0


def test_a_parameter_that_cannot_be_used(graph: Ros1Graph) -> None:
    node = graph.node(AT_ONCE, "_ttc_treshold:=6.0")
    assert node.wait(PATIENCE) == 2
    assert "no parameter 'ttc_treshold': did you mean ttc_threshold?" in graph.logs()


def test_a_bag_that_is_played(graph: Ros1Graph) -> None:
    """A wall comes nearer, at 4 m/s from 20 m: it is 1.5 s away at 6 m, after 3.5 s."""
    times = np.arange(0.0, 5.0, 0.025)
    items: list[Any] = []
    for stamp in times:
        items.append(Odom(stamp, stamp, speed=SPEED))
        items.append(Scan(stamp, stamp, ranges=np.full(19, 20.0 - SPEED * stamp, np.float32)))
    bag = write(graph.folder, "bag", items)
    parameter(graph, "setParam", "/use_sim_time", True)
    graph.listen()
    graph.node(AT_ONCE)
    player = graph.start("rosbag", "play", "--clock", "--hz=200", "--delay=1", "--quiet", "--rate=2", str(bag))
    assert player.wait(60) == 0
    said = graph.said("brake")
    seen = said[said.index(False) :]
    assert seen[0] is False
    assert seen[-1] is True
    assert seen.index(True) > 50
    assert all(seen[seen.index(True) :])  # clear before, braking after


def parameter(graph: Ros1Graph, call: str, *arguments: Any) -> Any:
    from xmlrpc.client import ServerProxy

    with ServerProxy(graph.uri) as master:
        code, why, value = getattr(master, call)("/test", *arguments)
    assert code == 1, why
    return value
