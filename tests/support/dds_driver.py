"""The rest of a car around the node under test: sensors that publish, and listeners; the node is another process."""

from __future__ import annotations

import itertools
import json
import os
import struct
import subprocess
import sys
import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from tests.support.dds_wire import deserialised, header, make, serialised
from ttc_fast.ros.dds.participant import Participant
from ttc_fast.ros.dds.settings import DdsSettings

if TYPE_CHECKING:
    from collections.abc import Callable

NODES = {
    "dds": "from ttc_fast.ros.dds_node import run\n"
    "from ttc_fast.ros.settings import NodeSettings\n"
    "run(NodeSettings.of(json.loads(sys.argv[1])))",
    "rclpy": "from ttc_fast.ros.rclpy_node import run\nrun(json.loads(sys.argv[1]))",
}
"""The node by its own transport; the driver comes by DDS to either."""
AT_ONCE = {"trigger": [1, 1], "release": [1, 1], "hold": 0.0, "stopping_distance": False, "use_range_rate": False}
"""The settings with which each scan decides alone."""
NEAR, FAR = 2.0, 29.0
"""Distances, m: half a second away at 4 m/s, and so far that a scan may be seconds old before it is read."""
PATIENCE = 60.0
"""The longest wait, s: what is waited for comes much sooner, except on a busy machine."""
BEAMS = 181
TYPES = {
    "/brake_bool": "std_msgs/Bool",
    "/drive": "ackermann_msgs/AckermannDriveStamped",
    "/diagnostics": "diagnostic_msgs/DiagnosticArray",
    "/ttc_fast/cause": "visualization_msgs/Marker",
}


def scan(distance: float, *, beams: int = BEAMS) -> bytes:
    """Return a scan of a wall all around at one distance, m, by the front half of a circle of beams."""
    message = make(
        "sensor_msgs/LaserScan",
        header=header(time.time_ns(), "laser"),
        angle_min=-np.pi / 2,
        angle_max=np.pi / 2,
        angle_increment=np.pi / (beams - 1),
        time_increment=0.0,
        scan_time=0.025,
        range_min=0.05,
        range_max=30.0,
        ranges=np.full(beams, distance, np.float32),
        intensities=np.zeros(0, np.float32),
    )
    return serialised("sensor_msgs/LaserScan", message)


SENT = itertools.count()


def stamped(cdr: bytes) -> bytes:
    """Return the message with the stamp of now. Its last number differs a little from those before, as with noise."""
    noisy = bytearray(cdr)
    noisy[4:12] = struct.pack("<iI", *divmod(time.time_ns(), 10**9))
    noisy[-8] = next(SENT) % 256
    return bytes(noisy)


def odometry(speed: float) -> bytes:
    zero = make("geometry_msgs/Vector3", x=0.0, y=0.0, z=0.0)
    pose = make(
        "geometry_msgs/Pose",
        position=make("geometry_msgs/Point", x=0.0, y=0.0, z=0.0),
        orientation=make("geometry_msgs/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0),
    )
    twist = make("geometry_msgs/Twist", linear=make("geometry_msgs/Vector3", x=speed, y=0.0, z=0.0), angular=zero)
    covariance = np.zeros(36)
    message = make(
        "nav_msgs/Odometry",
        header=header(time.time_ns(), "odom"),
        child_frame_id="base_link",
        pose=make("geometry_msgs/PoseWithCovariance", pose=pose, covariance=covariance),
        twist=make("geometry_msgs/TwistWithCovariance", twist=twist, covariance=covariance),
    )
    return serialised("nav_msgs/Odometry", message)


@dataclass
class Heard:
    """The messages that the node has published, by topic, oldest first."""

    messages: dict[str, list[Any]] = field(default_factory=lambda: {topic: [] for topic in TYPES})

    def take(self, topic: str) -> Callable[[bytes], None]:
        def keep(cdr: bytes) -> None:
            self.messages[topic].append(deserialised(TYPES[topic], cdr))

        return keep


class Driver:
    """A participant with a scanner and odometry, that hears all the node says."""

    def __init__(self, domain: int, *, speed: str = "nav_msgs/Odometry", topic: str = "/odom") -> None:
        self.participant = Participant(DdsSettings(domain_id=domain, node_name="driver"))
        self.heard = Heard()
        for heard, name in TYPES.items():
            self.participant.subscribe(heard, name, bytes, self.heard.take(heard))
        self.scans = self.participant.publisher("/scan", "sensor_msgs/LaserScan")
        self.speeds = self.participant.publisher(topic, speed)

    def __getitem__(self, topic: str) -> list[Any]:
        return self.heard.messages[topic]

    def wait(self, seconds: float) -> None:
        if self.participant.wait(seconds):
            self.participant.take()

    def until(self, fulfilled: Callable[[], Any], patience: float = PATIENCE) -> None:
        end = time.monotonic() + patience
        while not fulfilled():
            assert time.monotonic() < end, f"waited in vain; heard {self.heard.messages}"
            self.wait(0.02)

    def meet(self) -> None:
        """Wait until the node is there."""
        writers = [self.scans.writer, self.speeds.writer]
        self.until(lambda: all(writer.get_matched_subscriptions() for writer in writers))
        self.until(lambda: all(each.reader.get_matched_publications() for each in self.participant.subscriptions))

    def ask(self, distance: float) -> bool:
        """Send a scan and return what the node says to it; it says nothing on its own meanwhile."""
        said = self["/brake_bool"]
        before = len(said)
        self.scans.publish(stamped(scan(distance)))
        self.until(lambda: len(said) > before)
        return bool(said[-1].data)

    def drive_until(self, fulfilled: Callable[[Any], bool], scan: bytes | None, speed: bytes | None) -> None:
        """Publish both about every 20 ms until ten answers in a row are as they should be."""
        end = time.monotonic() + PATIENCE
        in_a_row = 0
        while in_a_row < 10:
            assert time.monotonic() < end, f"waited in vain; heard {self.heard.messages}"
            self["/brake_bool"].clear()
            for publisher, cdr in ((self.speeds, speed), (self.scans, scan)):
                if cdr is not None:
                    publisher.publish(stamped(cdr) if len(cdr) > 12 else cdr)  # a bare number has no stamp
            self.wait(0.02)
            for each in self["/brake_bool"]:
                in_a_row = in_a_row + 1 if fulfilled(each) else 0

    def listen_out(self) -> None:
        """Wait until each scan was answered, and forget all that was heard. What was shown last is far away."""
        said = self["/brake_bool"]
        self.scans.publish(scan(NEAR))
        self.until(lambda: said and said[-1].data)  # answers come in the order of the scans
        self.scans.publish(scan(FAR))
        self.until(lambda: not said[-1].data)
        for each in self.heard.messages.values():
            each.clear()

    def close(self) -> None:
        self.participant.close()


class NodeProcess:
    """The node under test."""

    def __init__(self, domain: int, *, by: str = "dds", **settings: Any) -> None:
        command = [sys.executable, "-c", f"import json, sys\n{NODES[by]}", json.dumps(AT_ONCE | settings)]
        where = {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        self.process = subprocess.Popen(command, env={**os.environ, **where})

    def resident(self) -> int:
        """Return the memory in use, bytes."""
        with open(f"/proc/{self.process.pid}/statm", encoding="ascii") as statm:
            return int(statm.read().split()[1]) * 4096

    def close(self) -> int:
        """End it as a launch file would, and return what it says to that."""
        self.process.terminate()
        try:
            return self.process.wait(PATIENCE)
        finally:
            self.process.kill()
