"""Round trips over ROS 1: rosmaster, node and sensor are a process each, connected by TCP over loopback."""

from __future__ import annotations

import io
import json
import os
import socket
import subprocess
import sys
import tempfile
import threading
import time
from typing import TYPE_CHECKING, Any

import numpy as np
import rospy
from nav_msgs.msg import Odometry
from rospy.numpy_msg import numpy_msg
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Bool

from benches.ros.drive import FAR, NEAR, PATIENCE, SPEED, WARMING_UP, round_trips, show, soak
from benches.ros.ros1_node import SETTINGS, TimedNode
from ttc_fast.ros.settings import NodeSettings

if TYPE_CHECKING:
    import argparse


class Sensor:
    """The rest of the car: it publishes scans and a speed, and hears the answers."""

    def __init__(self, beams: int) -> None:
        rospy.init_node("sensor", disable_signals=True)
        self._answered = threading.Event()
        self._answer = False
        self._beams = beams
        self._scans = rospy.Publisher("/scan", numpy_msg(LaserScan), queue_size=10, tcp_nodelay=True)
        self._odometry = rospy.Publisher("/odom", Odometry, queue_size=10, tcp_nodelay=True)
        self._brake = rospy.Subscriber("/brake_bool", Bool, self._on_brake, tcp_nodelay=True)

    def _on_brake(self, msg: Any) -> None:
        self._answer = msg.data
        self._answered.set()

    def meet(self) -> None:
        """Wait until all are connected, and the node has what it needs."""
        while not all(each.get_num_connections() for each in (self._scans, self._odometry, self._brake)):
            time.sleep(0.01)
        self.drive()
        time.sleep(0.5)
        for _ in range(WARMING_UP):
            self.drive()
            self.ask(FAR)

    def drive(self) -> None:
        """Publish the speed."""
        self._odometry.publish(_odometry())

    def ask(self, distance: float, patience: float = PATIENCE) -> float:
        """Publish a scan and wait for the right answer."""
        scan = _scan(distance, self._beams)
        self._answered.clear()
        began = time.perf_counter()
        self._scans.publish(scan)
        while self._answered.wait(max(began + patience - time.perf_counter(), 0.0)):
            if self._answer is (distance == NEAR):
                return time.perf_counter() - began
            self._answered.clear()  # what the watchdog said meanwhile, of the scan before
        return float("nan")


def measure(arguments: argparse.Namespace) -> None:
    """Time round trips, or soak."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with tempfile.TemporaryDirectory() as home:
        os.environ |= {"ROS_MASTER_URI": f"http://127.0.0.1:{port}", "ROS_IP": "127.0.0.1", "ROS_HOME": home}
        master = subprocess.Popen(["rosmaster", "--core", "-p", str(port)], stdout=subprocess.DEVNULL)
        time.sleep(1.0)
        node = subprocess.Popen([sys.executable, "-m", "benches.ros.ros1_node"], stdout=subprocess.PIPE, text=True)
        try:
            sensor = Sensor(arguments.beams)
            sensor.meet()
            if arguments.soak:
                soak(sensor, node.pid, arguments.soak)
            else:
                _show(sensor, node, arguments)
        finally:
            node.kill()
            node.wait()
            rospy.signal_shutdown("done")
            master.terminate()
            master.wait()


def _show(sensor: Sensor, node: subprocess.Popen[str], arguments: argparse.Namespace) -> None:
    trips = round_trips(sensor, arguments)
    node.terminate()
    own = json.loads(node.communicate(timeout=30)[0])[-arguments.scans :]
    rows = {"node": {"round trip": trips, "own": own}, "node in a loop": {"own": _in_a_loop(arguments)}}
    legend = (
        "The own share is from the bytes of a scan to its answers in the queue to be sent: reading by genpy, deciding, "
        "packing. In a loop is the same with nobody to wait for and nobody to send to."
    )
    show("ROS 1", legend, rows, arguments)


def _in_a_loop(arguments: argparse.Namespace) -> list[float]:
    """Have a node in this process read scans and decide, pack the answers and throw them away; return its times, us."""
    topics = {f"{name}_topic": f"/loop/{name}" for name in ("scan", "brake", "drive", "diagnostics", "marker")}
    node = TimedNode(NodeSettings.of({**SETTINGS, **topics}))
    said: list[bool] = []

    def pack(brake: bool) -> None:
        Bool(brake).serialize(io.BytesIO())
        said.append(brake)

    node._brake.publish = pack
    for i in range(WARMING_UP + arguments.scans):
        data = io.BytesIO()
        _scan(NEAR if i % 2 else FAR, arguments.beams).serialize(data)
        node._on_odometry("/odom", _odometry())
        node.receive(data.getvalue())
        if said[-1] is not bool(i % 2):
            raise AssertionError(f"the node said {said[-1]} to scan {i}")
    return [each * 1e6 for each in node.took][WARMING_UP:]


def _scan(distance: float, beams: int) -> LaserScan:
    scan = LaserScan(angle_min=-2.35, angle_increment=4.7 / beams, range_min=0.06, range_max=30.0)
    scan.ranges, scan.intensities = np.full(beams, distance, np.float32), np.zeros(0, np.float32)
    scan.header.stamp, scan.header.frame_id = rospy.get_rostime(), "laser"
    return scan


def _odometry() -> Odometry:
    odometry = Odometry()
    odometry.header.stamp = rospy.get_rostime()
    odometry.pose.pose.position.x = SPEED * odometry.header.stamp.to_sec()
    odometry.pose.pose.orientation.w = 1.0
    odometry.twist.twist.linear.x = SPEED
    return odometry
