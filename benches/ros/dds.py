"""Over DDS."""

from __future__ import annotations

import json
import os
import random
import struct
import subprocess
import sys
import time
from typing import TYPE_CHECKING, Any

import numpy as np
from rosbags.typesys import Stores, get_typestore

from benches.ros.dds_node import SETTINGS
from benches.ros.drive import FAR, NEAR, PATIENCE, SPEED, quantiles, resident
from evaluation.report import Report, console
from ttc_fast.ros.dds.participant import Participant
from ttc_fast.ros.dds.settings import DdsSettings
from ttc_fast.ros.dds_node import DdsNode
from ttc_fast.ros.settings import NodeSettings
from ttc_fast.ros_messages import laser_scan

if TYPE_CHECKING:
    import argparse

LOOPBACK = (
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces>'
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    '<MaxAutoParticipantIndex>9</MaxAutoParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers>'
    "</Discovery></Domain></CycloneDDS>"
)
STORE = get_typestore(Stores.ROS2_JAZZY)
WARMING_UP = 500
HEADER = bytes([0, 1, 0, 0])
"""What little-endian CDR begins with."""


class Sensor:
    """The rest of the car: publishes scans and a speed, and hears the answers."""

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
            self.ask(FAR, patience=0.1)
        time.sleep(0.3)
        self.participant.take()

    def ask(self, distance: float, patience: float = PATIENCE) -> float:
        """Publish a scan and wait for the answer to it; return how long that took, s, or NaN if none came."""
        self.answers.clear()
        cdr = HEADER + struct.pack("<iI", *divmod(time.time_ns(), 10**9)) + self.bodies[distance]
        began = time.perf_counter()
        self.scans.publish(cdr)
        while not self.answers:
            if not self.participant.wait(patience):
                return float("nan")
            self.participant.take()
        return time.perf_counter() - began


class Node:
    """The node, or what only answers, in a process of its own."""

    def __init__(self, domain: int, kind: str, keep: int) -> None:
        command = [sys.executable, "-m", "benches.ros.dds_node", str(domain), kind, str(keep)]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)

    def resident(self) -> float:
        """Memory in use, MB."""
        return resident(self._process.pid)

    def end(self) -> list[tuple[float, float]]:
        """End it, and return what it says of its times, us: its own, and sending."""
        self._process.terminate()
        said, _ = self._process.communicate(timeout=30)
        took: list[tuple[float, float]] = json.loads(said)
        return took


def measure(arguments: argparse.Namespace) -> None:
    """Time round trips, or soak."""
    os.environ.setdefault("CYCLONEDDS_URI", LOOPBACK)
    domain = random.randrange(100, 230)
    if arguments.soak:
        _soak(domain, arguments.soak, arguments.beams)
        return
    rows = [_round_trips(domain + which, kind, arguments) for which, kind in enumerate(("node", "echo"))]
    rows.append(_in_a_loop(domain + 2, arguments))
    legend = (
        f"us, {arguments.scans} scans of {arguments.beams} beams, {arguments.rate:g} a second. The round trip is from "
        "before a scan is published to the answer read, over loopback between two processes. The own share is reading, "
        "deciding and packing, after the node has been woken; sending is Cyclone's. The echo decides nothing. "
        "In a loop is the node's own share with nobody to wait for: the same code, of which the processor knows all."
    )
    header = ("", *(f"{what} {name}" for what in ("round trip", "own", "sending") for name in ("least", "p50", "p99")))
    console().print(Report("Round trips over DDS", legend, header, rows).rich())


def _round_trips(domain: int, kind: str, arguments: argparse.Namespace) -> tuple[str, ...]:
    node, sensor = Node(domain, kind, arguments.scans), Sensor(domain, arguments.beams)
    sensor.meet()
    took = []
    for i in range(WARMING_UP + arguments.scans):
        distance = NEAR if i % 2 else FAR
        took.append(sensor.ask(distance))
        if [answer[4] for answer in sensor.answers] != [i % 2]:
            raise AssertionError(f"{kind} said {sensor.answers} to a wall at {distance} m")
        if arguments.rate:
            time.sleep(1.0 / arguments.rate)
    sensor.participant.close()
    own, sending = np.array(node.end()).T
    trips = np.array(took[WARMING_UP:]) * 1e6
    return (kind, *quantiles(trips), *quantiles(own), *quantiles(sending))


def _in_a_loop(domain: int, arguments: argparse.Namespace) -> tuple[str, ...]:
    """Have a node in this process read scans and decide, and throw the answers away."""
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
    return ("node in a loop", "", "", "", *quantiles(took[WARMING_UP:]), "", "", "")


def _soak(domain: int, scans: int, beams: int) -> None:
    """Send scans as fast as they are answered; each has to be, and rightly."""
    node, sensor = Node(domain, "node", 1), Sensor(domain, beams)
    sensor.meet()
    unanswered = 0
    memory: list[float] = []
    for i in range(scans):
        if i % max(scans // 10, 1) == 0:
            memory.append(node.resident())
            print(f"{i:8d} scans, {unanswered} unanswered, {memory[-1]:.1f} MB", flush=True)
        sensor.ask(NEAR if i % 2 else FAR, patience=1.0)
        if not sensor.answers:
            unanswered += 1  # a scan may be lost: it is sent with best effort
        elif [answer[4] for answer in sensor.answers] != [i % 2]:
            raise AssertionError(f"the node said {sensor.answers} to scan {i}")
    lost, grown = sensor.brake.lost, node.resident() - memory[min(1, len(memory) - 1)]
    sensor.participant.close()
    node.end()
    print(f"{scans:8d} scans, {unanswered} unanswered, {lost} answers lost, {grown:+.2f} MB since the first tenth")


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
