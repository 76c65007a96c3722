"""A participant in a graph of real processes: what it says of itself, what it reads, and what it survives."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsParticipant,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import Policy

from tests.support import bags
from tests.support.dds_wire import LOOPBACK, STORE, Forger, free_domain, is_free, make, port, serialised, store_of
from ttc_fast.ros.dds.discovery import configuration
from ttc_fast.ros.dds.names import NameNotAllowedError, resolved
from ttc_fast.ros.dds.participant import Participant
from ttc_fast.ros.dds.settings import DdsSettingError, DdsSettings
from ttc_fast.ros.dds.types import DEFINITIONS, GID_OF_HUMBLE, message, serialized, type_hash
from ttc_fast.ros.dds_node import DdsNode
from ttc_fast.ros.settings import NodeSettings
from ttc_fast.ros_messages import float32, float64, laser_scan

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

PEER = Path(__file__).parents[1] / "support" / "dds_peer.py"
PATIENCE = 20.0
SCAN = bags.serialised(bags.Scan(1.5, 2.0), "little")


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    return free_domain()


@pytest.fixture
def node(domain: int) -> Iterator[Participant]:
    made = Participant(DdsSettings(domain_id=domain, namespace="/car"))
    yield made
    made.close()


class Peer:
    """Another process in the graph, which publishes what it is told to."""

    def __init__(self, domain: int, topic: str, name: str) -> None:
        command = [sys.executable, str(PEER), str(domain), topic, name]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.writer = bytes.fromhex(self.answer())

    def answer(self) -> str:
        assert self.process.stdout is not None
        return self.process.stdout.readline().strip()

    def publish(self, cdr: bytes) -> None:
        """Publish, once somebody reads it; return when it is sent."""
        assert self.process.stdin is not None
        self.process.stdin.write(cdr.hex() + "\n")
        self.process.stdin.flush()
        assert self.answer() == "sent"

    def close(self) -> None:
        self.process.kill()
        self.process.communicate()


@pytest.fixture
def peer(domain: int) -> Iterator[Callable[[str, str], Peer]]:
    made: list[Peer] = []

    def make_peer(topic: str, name: str) -> Peer:
        made.append(Peer(domain, topic, name))
        return made[-1]

    yield make_peer
    for each in made:
        each.close()


def until(node: Participant, fulfilled: Callable[[], Any]) -> None:
    """Take messages until something is so."""
    end = time.monotonic() + PATIENCE
    while not fulfilled():
        assert time.monotonic() < end, "waited in vain"
        if node.wait(0.05):
            node.take()


def seen(reader: Any, fulfilled: Callable[[Any], bool]) -> Any:
    """Wait until another participant sees something in the graph."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        for each in reader.take(64):
            if fulfilled(each):
                return each
        time.sleep(0.02)
    raise AssertionError("waited in vain")


def one_more(node: Participant, publisher: Peer, got: list[Any]) -> None:
    """Publish until a message comes: the first may leave before the node knows its sender."""
    before, end = len(got), time.monotonic() + PATIENCE
    while len(got) == before:
        assert time.monotonic() < end, "waited in vain"
        publisher.publish(SCAN)
        if node.wait(0.5):
            node.take()


def test_a_message_from_another_process_is_read_in_its_bytes(
    node: Participant, peer: Callable[[str, str], Peer]
) -> None:
    got: list[Any] = []
    node.subscribe("/scan", "sensor_msgs/LaserScan", lambda cdr: (cdr, laser_scan(cdr)), got.append, sensor_data=True)
    one_more(node, peer("/scan", "sensor_msgs/LaserScan"), got)
    ((cdr, scan),) = got
    assert cdr == SCAN
    assert np.shares_memory(scan.ranges, np.frombuffer(cdr, np.uint8))
    np.testing.assert_array_equal(scan.ranges, np.arange(1.0, 20.0))


@pytest.mark.parametrize("name", ["std_msgs/Float32", "std_msgs/Float64"])
def test_the_type_of_a_speed_is_found_in_the_graph(
    name: str, node: Participant, peer: Callable[[str, str], Peer]
) -> None:
    got: list[float] = []
    node.subscribe_by_type(
        "/speed", {"std_msgs/Float32": (float32, got.append), "std_msgs/Float64": (float64, got.append)}
    )
    assert not node.subscriptions
    publisher = peer("/speed", name)
    until(node, lambda: node.subscriptions)  # before the peer publishes
    publisher.publish(serialised(name, make(name, data=2.5)))
    until(node, lambda: got)
    assert got == [2.5]
    assert [each.topic for each in node.subscriptions] == ["/speed"]


def test_the_last_publisher_may_leave(node: Participant, peer: Callable[[str, str], Peer]) -> None:
    got: list[Any] = []
    node.subscribe("/scan", "sensor_msgs/LaserScan", laser_scan, got.append, sensor_data=True)
    first = peer("/scan", "sensor_msgs/LaserScan")
    one_more(node, first, got)
    first.close()
    second = peer("/scan", "sensor_msgs/LaserScan")
    one_more(node, second, got)
    assert node.dropped(node.subscriptions[0]) == 0


def test_what_is_no_message_is_dropped_and_counted(
    node: Participant, domain: int, peer: Callable[[str, str], Peer], capfd: pytest.CaptureFixture[str]
) -> None:
    got: list[Any] = []
    scans = node.subscribe("/scan", "sensor_msgs/LaserScan", laser_scan, got.append, sensor_data=True)
    publisher = peer("/scan", "sensor_msgs/LaserScan")
    one_more(node, publisher, got)
    forger = Forger(domain, publisher.writer, first=1000)  # beyond what the publisher has sent
    forger.send(SCAN)
    until(node, lambda: len(got) == 2)  # so what follows is refused for what it is, and not for who sends it

    for size in range(1, len(SCAN)):  # of nothing at all there is nothing to count
        forger.send(SCAN[:size])
        node.take()
    until(node, lambda: node.dropped(scans) + node.malformed == len(SCAN) - 1)
    assert len(got) == 2

    rng = np.random.default_rng(8)
    for _ in range(1000):
        damaged = bytearray(SCAN)
        damaged[rng.integers(0, len(SCAN))] ^= 1 << rng.integers(0, 8)
        forger.send(bytes(damaged))
        node.wait(0.0)
        node.take()
    before = len(got)
    forger.send(SCAN)
    until(node, lambda: got[-1].ranges[0] == 1.0 and len(got) > before)
    forger.close()
    assert "deserialization" in capfd.readouterr().err  # Cyclone says so there as well


def test_the_graph_is_told_of_types_and_of_the_node(node: Participant, domain: int) -> None:
    other = Participant(DdsSettings(domain_id=domain))
    reader = node.subscribe("scan", "sensor_msgs/LaserScan", laser_scan, print, sensor_data=True).reader
    writer = node.publisher("~/brake", "std_msgs/Bool").writer
    node.announce()
    look = other._participant
    participant = seen(
        BuiltinDataReader(look, BuiltinTopicDcpsParticipant), lambda it: it.key == node._participant.guid
    )
    assert bytes(participant.qos[Policy.Userdata].data) == b"enclave=/;"
    subscription = seen(BuiltinDataReader(look, BuiltinTopicDcpsSubscription), lambda it: it.key == reader.guid)
    assert (subscription.topic_name, subscription.type_name) == ("rt/car/scan", "sensor_msgs::msg::dds_::LaserScan_")
    assert bytes(subscription.qos[Policy.Userdata].data) == type_hash("sensor_msgs/LaserScan")
    assert subscription.qos[Policy.Reliability] == Policy.Reliability.BestEffort
    assert subscription.qos[Policy.History] == Policy.History.KeepLast(5)
    publication = seen(BuiltinDataReader(look, BuiltinTopicDcpsPublication), lambda it: it.key == writer.guid)
    assert (publication.topic_name, publication.type_name) == ("rt/car/ttc_fast/brake", "std_msgs::msg::dds_::Bool_")
    assert bytes(publication.qos[Policy.Userdata].data) == type_hash("std_msgs/Bool")
    assert isinstance(publication.qos[Policy.Reliability], Policy.Reliability.Reliable)
    other.close()


@pytest.mark.parametrize("size", [16, 24])
def test_who_comes_later_is_told_the_name_of_the_node(size: int, domain: int) -> None:
    settings = DdsSettings(domain_id=domain, node_name="brake", namespace="/car", gid_size=size)
    node = Participant(settings)
    reader = node.subscribe("/scan", "sensor_msgs/LaserScan", laser_scan, print, sensor_data=True).reader
    writer = node.publisher("/brake_bool", "std_msgs/Bool").writer
    node.announce()
    command = [sys.executable, str(PEER), str(domain), "--discovery", str(size)]
    cdr = bytes.fromhex(subprocess.run(command, capture_output=True, text=True, timeout=60, check=True).stdout)
    store = STORE if size == 16 else store_of({**DEFINITIONS, **GID_OF_HUMBLE})
    told: Any = store.deserialize_cdr(cdr, "rmw_dds_common/msg/ParticipantEntitiesInfo")
    (entities,) = told.node_entities_info_seq

    def gid(entity: Any) -> bytes:
        raw: bytes = entity.guid.bytes
        return raw + bytes(size - 16)

    assert bytes(told.gid.data) == gid(node._participant)
    assert (entities.node_namespace, entities.node_name) == ("/car", "brake")
    assert [bytes(each.data) for each in entities.reader_gid_seq] == [gid(reader)]
    assert [bytes(each.data) for each in entities.writer_gid_seq] == [gid(writer)]
    node.close()


def test_a_closed_node_leaves_its_domain(domain: int) -> None:
    node = DdsNode(NodeSettings.of({}), DdsSettings(domain_id=domain))
    assert not is_free(port(domain))
    node.close()
    assert is_free(port(domain))


def test_a_closed_node_is_gone_at_once_whoever_holds_its_parts(domain: int) -> None:
    node = Participant(DdsSettings(domain_id=domain))
    held = (
        node.subscribe("/scan", "sensor_msgs/LaserScan", laser_scan, print),
        node.publisher("/brake", "std_msgs/Bool"),
    )
    node.subscribe_by_type("/speed", {"std_msgs/Float32": (float32, print)})
    code = (
        "import sys, time\n"
        "from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication\n"
        "from ttc_fast.ros.dds.participant import Participant\n"
        "from ttc_fast.ros.dds.settings import DdsSettings\n"
        "node = Participant(DdsSettings(domain_id=int(sys.argv[1])))\n"
        "brake = node.subscribe('/brake', 'std_msgs/Bool', bytes, print)\n"
        "for there in (1, 0):\n"
        "    while len(brake.reader.get_matched_publications()) != there:\n"
        "        time.sleep(0.005)\n"
        "    print(time.time(), flush=True)\n"
    )
    other = subprocess.Popen([sys.executable, "-c", code, str(domain)], stdout=subprocess.PIPE, text=True)
    assert other.stdout is not None
    assert other.stdout.readline()
    before = time.time()
    node.close()
    assert is_free(port(domain))
    assert float(other.communicate(timeout=PATIENCE)[0]) - before < 1.0
    assert held[0].topic == "/scan"


def test_the_range_of_discovery_is_that_of_ros() -> None:
    none: dict[str, str] = {}
    localhost = configuration({"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"})
    assert '<Peers><Peer address="localhost"/></Peers>' in localhost
    assert "<AllowMulticast>false</AllowMulticast>" in localhost
    assert configuration({"ROS_LOCALHOST_ONLY": "1", "ROS_STATIC_PEERS": "10.0.0.2"}) == localhost
    assert configuration({"ROS_AUTOMATIC_DISCOVERY_RANGE": "nearby"}) == localhost
    assert "<Peer" not in configuration(none) == configuration({"ROS_LOCALHOST_ONLY": "0"})
    assert "Multicast" not in configuration(none)
    peers = configuration({"ROS_STATIC_PEERS": f"10.0.0.2;;{'x' * 256};a<b"})
    assert '<Peers><Peer address="10.0.0.2"/><Peer address="a&lt;b"/></Peers>' in peers
    off = configuration({"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF", "ROS_STATIC_PEERS": "10.0.0.2"})
    assert f"<Tag>ros_discovery_off_{os.getpid()}</Tag>" in off
    assert "10.0.0.2" not in off
    assert configuration({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT", "ROS_STATIC_PEERS": "10.0.0.2"}) == ""


@pytest.mark.parametrize(("reach", "hears"), [("LOCALHOST", True), ("OFF", False)])
def test_processes_find_each_other_as_far_as_they_look(
    reach: str, hears: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With nothing but the variables of ROS."""
    monkeypatch.delenv("CYCLONEDDS_URI", raising=False)
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", reach)
    domain = free_domain()
    node, got = Participant(DdsSettings(domain_id=domain)), list[float]()
    speed = node.subscribe("/speed", "std_msgs/Float32", float32, got.append)
    other = Peer(domain, "/speed", "std_msgs/Float32")
    if hears:
        other.publish(serialised("std_msgs/Float32", make("std_msgs/Float32", data=2.5)))
        until(node, lambda: got == [2.5])
    else:
        time.sleep(3.0)
        assert not speed.reader.get_matched_publications()
    other.close()
    node.close()


def test_bytes_that_do_not_fit_the_type_are_not_sent(node: Participant, caplog: pytest.LogCaptureFixture) -> None:
    brake = node.publisher("/brake_bool", "std_msgs/Bool")
    whole = serialized(message("std_msgs/Bool", data=True))
    brake.publish(whole)
    assert brake.unsent == 0
    brake.publish(whole[:4])
    assert brake.unsent == 1
    assert "could not be sent" in caplog.text


def test_the_domain_is_that_of_ros(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "42")
    assert DdsSettings().domain == 42
    assert DdsSettings(domain_id=7).domain == 7
    monkeypatch.setenv("ROS_DOMAIN_ID", "")
    assert DdsSettings().domain == 0
    for wrong in ("x", "-1", "233"):
        monkeypatch.setenv("ROS_DOMAIN_ID", wrong)
        with pytest.raises(DdsSettingError, match="from 0 to 232"):
            DdsSettings()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"domain_id": 233}, "domain_id must be from 0 to 232, got 233"),
        ({"gid_size": 20}, "gid_size is 16 from ROS 2 Iron on and 24 up to Humble, got 20"),
        ({"enclave": "car"}, "enclave begins with /"),
        ({"enclave": "/a;typehash="}, "enclave begins with /"),
        ({"node_name": "a-b"}, "node_name has letters, digits and _"),
        ({"node_name": ""}, "node_name has letters, digits and _"),
        ({"namespace": "car"}, "namespace is / or like /car/front"),
        ({"namespace": "/car/"}, "namespace is / or like /car/front"),
    ],
)
def test_settings_that_cannot_be_are_refused(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        DdsSettings(**settings)


@pytest.mark.parametrize("topic", ["", "/", "a b", "/1a", "a//b", "~a", "/a/"])
def test_topics_that_cannot_be_are_refused(topic: str) -> None:
    with pytest.raises(NameNotAllowedError, match="a topic has letters"):
        resolved(topic, "node", "/")
