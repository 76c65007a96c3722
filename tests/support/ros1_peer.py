"""What is around the node in a graph of ROS 1: each a process of its own. `python ros1_peer.py KIND ...`."""

from __future__ import annotations

import itertools
import json
import sys
import threading
import time
from typing import TYPE_CHECKING

import numpy as np
import rospy
from nav_msgs.msg import Odometry
from rospy.numpy_msg import numpy_msg
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Bool, Float32, Float64

from ttc_fast.ros.rospy_node import AckermannDriveStamped

if TYPE_CHECKING:
    from collections.abc import Callable

BEAMS = 271
SPEEDS = {"/speed32": (Float32, Float32), "/speed64": (Float64, Float64)}


def a_scan(distance: float) -> LaserScan:
    scan = LaserScan(angle_min=-2.35, angle_increment=4.7 / (BEAMS - 1), range_min=0.05, range_max=30.0)
    scan.header.stamp = rospy.get_rostime()
    scan.ranges, scan.intensities = np.full(BEAMS, distance, np.float32), np.zeros(0, np.float32)
    return scan


def an_odometry(speed: float) -> Odometry:
    odometry = Odometry()
    odometry.header.stamp = rospy.get_rostime()
    odometry.twist.twist.linear.x = speed
    return odometry


def publisher(topic: str, kind: type) -> rospy.Publisher:
    return rospy.Publisher(topic, kind, queue_size=10, tcp_nodelay=True)


def listen() -> None:
    """Print what the node says, a line for each message, and tell `lockstep` when a decision has come whole."""
    lock, counts = threading.Lock(), {"brake": 0, "drive": 0}
    heard: list[rospy.Publisher] = []

    def say(kind: str, due: bool, *what: object) -> None:
        with lock:
            counts[kind] += due
            print(json.dumps([kind, *what]), flush=True)
            if heard and counts["brake"] == counts["drive"]:  # whoever brakes says so on both topics
                heard[0].publish(True)

    subscriptions = [
        rospy.Subscriber("/brake_bool", Bool, lambda msg: say("brake", msg.data, msg.data), tcp_nodelay=True),
        rospy.Subscriber(
            "/drive",
            AckermannDriveStamped,
            lambda msg: say("drive", True, msg.drive.speed, msg.drive.acceleration),
            tcp_nodelay=True,
        ),
    ]
    while not all(each.get_num_connections() for each in subscriptions):
        time.sleep(0.01)
    time.sleep(0.3)  # for what the watchdog said before anything came
    acknowledgements = publisher("/heard", Bool)
    with lock:
        counts.update(brake=0, drive=0)
        heard.append(acknowledgements)
    rospy.spin()


def lockstep(distances: str, speed: str) -> None:
    """Publish odometry and a scan for each distance of a file, the next once the listener has the answer."""
    answered = threading.Event()
    heard = rospy.Subscriber("/heard", Bool, lambda msg: answered.set(), tcp_nodelay=True)
    scans, odometry = publisher("/scan", numpy_msg(LaserScan)), publisher("/odom", Odometry)
    while not all(each.get_num_connections() for each in (heard, scans, odometry)):
        time.sleep(0.01)
    odometry.publish(an_odometry(float(speed)))
    time.sleep(0.2)
    for distance in np.load(distances):
        odometry.publish(an_odometry(float(speed)))
        answered.clear()
        scans.publish(a_scan(distance))
        if not answered.wait(5.0):
            sys.exit("the node does not answer")


def stream(topic: str, value: str) -> None:
    """Publish the same again and again, but for millimetres of scans: a frozen scanner is stale."""
    make, kind = SPEEDS.get(topic, (an_odometry, Odometry)) if topic != "/scan" else (a_scan, numpy_msg(LaserScan))
    out = publisher(topic, kind)
    change = itertools.cycle((0.0, 0.001, 0.002) if topic == "/scan" else (0.0,))
    while not rospy.is_shutdown():
        out.publish(make(float(value) + next(change)))
        time.sleep(0.025)


if __name__ == "__main__":
    kind, *arguments = sys.argv[1:]
    rospy.init_node(f"{kind}_{time.time_ns()}")
    peers: dict[str, Callable[..., None]] = {"listen": listen, "lockstep": lockstep, "stream": stream}
    peers[kind](*arguments)
