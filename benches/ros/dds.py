"""Round trips over DDS."""

from __future__ import annotations

import json
import os
import random
import struct
import subprocess
import sys
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
from rosbags.typesys import Stores, get_typestore

from benches.ros.dds_node import SETTINGS
from benches.ros.drive import FAR, NEAR, PATIENCE, SPEED, WARMING_UP, Times, round_trips, show, soak
from ttc_fast.ros.dds.participant import Participant
from ttc_fast.ros.dds.settings import DdsSettings
from ttc_fast.ros.dds_node import DdsNode
from ttc_fast.ros.settings import NodeSettings
from ttc_fast.ros_messages import laser_scan

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterator

LOOPBACK = (
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces>'
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    '<MaxAutoParticipantIndex>9</MaxAutoParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers>'
    "</Discovery></Domain></CycloneDDS>"
)
STORE = get_typestore(Stores.ROS2_JAZZY)
HEADER = bytes([0, 1, 0, 0])
"""What little-endian CDR begins with."""


class Sensor:
    """The rest of the car: it publishes scans and a speed, and hears the answers."""

    def __init__(self, domain: int, beams: int) -> None:
        self.participant = Participant(DdsSettings(domain_id=domain, node_name="sensor"))
        self.scans = self.participant.publisher("/scan", "sensor_msgs/LaserScan")
        self.speeds = self.participant.publisher("/speed", "std_msgs/Float64")
        self.answers: list[bytes] = []
        self.brake = self.participant.subscribe("/brake_bool", "std_msgs/Bool", bytes, self.answers.append)
        self.bodies = {distance: _scan(distance, beams)[12:] for distance in (NEAR, FAR)}

    def meet(self) -> None:
        """Go on until the node knows its speed, and lets go."""
        end = time.monotonic() + 4 * PATIENCE
        while not self.answers or self.answers[-1][4]:
            if time.monotonic() > end:
                raise RuntimeError("the node does not answer")
            self.speeds.publish(HEADER + struct.pack("<d", SPEED))
            self._ask(FAR, patience=0.1)
        time.sleep(0.3)
        self.participant.take()

    def drive(self) -> None:
        """Do nothing: the node keeps the speed that it got when both met."""

    def ask(self, distance: float, patience: float = PATIENCE) -> float:
        """Publish a scan and wait for its answer, which has to be right."""
        took = self._ask(distance, patience)
        if self.answers and [answer[4] for answer in self.answers] != [distance == NEAR]:
            raise AssertionError(f"the answer to a wall at {distance} m was {self.answers}")
        return took

    def _ask(self, distance: float, patience: float) -> float:
        self.answers.clear()
        cdr = HEADER + struct.pack("<iI", *divmod(time.time_ns(), 10**9)) + self.bodies[distance]
        began = time.perf_counter()
        self.scans.publish(cdr)
        while not self.answers:
            if not self.participant.wait(patience):
                return float("nan")  # a scan may be lost: it is sent with best effort
            self.participant.take()
        return time.perf_counter() - began


def measure(arguments: argparse.Namespace) -> None:
    """Time round trips, or soak."""
    os.environ.setdefault("CYCLONEDDS_URI", LOOPBACK)
    domain = random.randrange(100, 230)
    if arguments.soak:
        with _started(domain, "node", 1, arguments.beams) as (process, sensor):
            soak(sensor, process.pid, arguments.soak)
        return
    rows = {kind: _timed(domain + which, kind, arguments) for which, kind in enumerate(("node", "echo"))}
    rows["node in a loop"] = {"own": _in_a_loop(domain + 2, arguments)}
    legend = (
        "The own share is reading, deciding and packing, after the node has been woken; sending is Cyclone's. The echo "
        "decides nothing. In a loop is the node's own share with nobody to wait for: the same code, of which the "
        "processor knows all."
    )
    show("DDS", legend, rows, arguments)


@contextmanager
def _started(domain: int, kind: str, keep: int, beams: int) -> Iterator[tuple[subprocess.Popen[str], Sensor]]:
    """Start the node, or what only answers, in a process of its own, and a sensor that has met it."""
    command = [sys.executable, "-m", "benches.ros.dds_node", str(domain), kind, str(keep)]
    process, sensor = subprocess.Popen(command, stdout=subprocess.PIPE, text=True), Sensor(domain, beams)
    sensor.meet()
    yield process, sensor
    sensor.participant.close()
    process.terminate()
    process.wait(timeout=30)


def _timed(domain: int, kind: str, arguments: argparse.Namespace) -> Times:
    with _started(domain, kind, arguments.scans, arguments.beams) as (process, sensor):
        trips = round_trips(sensor, arguments)
        process.terminate()
        own, sending = np.array(json.loads(process.communicate(timeout=30)[0])).T
    return {"round trip": trips, "own": own, "sending": sending}


def _in_a_loop(domain: int, arguments: argparse.Namespace) -> list[float]:
    """Have a node in this process read scans and decide, throw the answers away, and return its times, us."""
    node = DdsNode(NodeSettings.of(SETTINGS), DdsSettings(domain_id=domain))
    node.core.on_speed(time.time(), SPEED)
    answers: list[bytes] = []
    for each in node.participant.publishers:
        each.publish = answers.append  # type: ignore[assignment]
    took = []
    bodies = [_scan(distance, arguments.beams)[12:] for distance in (FAR, NEAR)]
    for i in range(WARMING_UP + arguments.scans):
        cdr = HEADER + struct.pack("<iI", *divmod(time.time_ns(), 10**9)) + bodies[i % 2]
        answers.clear()
        began = time.perf_counter_ns()
        node._on_scan(laser_scan(cdr))
        took.append((time.perf_counter_ns() - began) * 1e-3)
        if answers[0][4] != i % 2:
            raise AssertionError(f"the node said {answers} to scan {i}")
    node.close()
    return took[WARMING_UP:]


def _scan(distance: float, beams: int) -> bytes:
    """A wall all around, that half a circle of beams sees."""
    types: Any = STORE.types
    header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](0, 0), "laser")
    ranges = np.full(beams, distance, np.float32)
    angles = (-np.pi / 2, np.pi / 2, np.pi / (beams - 1))
    scan = types["sensor_msgs/msg/LaserScan"](header, *angles, 0.0, 0.025, 0.05, 30.0, ranges, np.zeros(0, np.float32))
    cdr = bytes(STORE.serialize_cdr(scan, "sensor_msgs/msg/LaserScan"))
    assert laser_scan(cdr).ranges[0] == np.float32(distance)
    return cdr
