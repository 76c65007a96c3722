"""A car, its sensors and its driver in a graph, around a node that may brake it.

The car is in a long room, and a scanner looks all around, which sits the wrong way round on the car; a static transform
says so, from before the node comes. The driver asks for 2 m/s towards a wall, the node stops the car, and the driver
goes on asking for a second. Then something changes, as the scenario says.

The arguments are the transport, the scenario, the topics by which the driver asks and takes over, and the namespace. A
line on the standard output says that everything is there, and a second one, of JSON, what happened.
"""

from __future__ import annotations

import json
import math
import sys
import time
from typing import Any

import numpy as np

BEAMS, PERIOD, PATIENCE = 360, 0.025, 40.0
ANGLES = -math.pi + 2 * math.pi / BEAMS * np.arange(BEAMS)
"""The directions of the beams from the car. For the scanner they begin half a turn later."""
BESIDE, BEHIND = 3.0, 20.0
"""m from the scanner to the walls."""
ASKED = {"drive_in": "ackermann_msgs/AckermannDriveStamped", "cmd_vel": "geometry_msgs/Twist"}
LATCHED = {"/tf_static": "tf2_msgs/TFMessage"}
TAKES_OVER = {"override": "std_msgs/Bool", "joy": "sensor_msgs/Joy"}


class Graph:
    """The graph as the car sees it. What the node says is kept with the time when it came."""

    def __init__(self) -> None:
        self.braked: bool | None = None
        self.drives: list[float] = []

    def hear_brake(self, braked: bool) -> None:
        self.braked = bool(braked)

    def scan(self, ranges: Any) -> None:
        message = self.made("sensor_msgs/LaserScan")
        message.angle_min, message.angle_max = float(ANGLES[0] + math.pi), float(ANGLES[-1] + math.pi)
        message.angle_increment, message.range_min, message.range_max = 2 * math.pi / BEAMS, 0.05, 30.0
        message.ranges = self.numbers(ranges)
        self.send("scan", self.stamped(message, "laser"))

    def transform(self) -> None:
        message, placed = self.made("tf2_msgs/TFMessage"), self.made("geometry_msgs/TransformStamped")
        self.stamped(placed, "base_link").child_frame_id = "laser"
        placed.transform.rotation.z, placed.transform.rotation.w = 1.0, 0.0
        message.transforms = [placed]
        self.send("/tf_static", message)

    def odometry(self, speed: float) -> None:
        message = self.made("nav_msgs/Odometry")
        message.twist.twist.linear.x = float(speed)
        self.send("odom", self.stamped(message, "odom"))

    def ask(self, topic: str, speed: float) -> None:
        message = self.made(ASKED[topic])
        if topic == "cmd_vel":
            message.linear.x = float(speed)
        else:
            message.drive.speed = float(speed)
            self.stamped(message, "driver")
        self.send(topic, message)

    def take_over(self, topic: str) -> None:
        message = self.made(TAKES_OVER[topic])
        if topic == "joy":
            message.buttons = [0, 0, 1]
            self.stamped(message, "joy")
        else:
            message.data = True
        self.send(topic, message)

    def numbers(self, values: Any) -> Any:
        return [float(each) for each in values]

    def made(self, name: str) -> Any:
        raise NotImplementedError

    def stamped(self, message: Any, frame: str) -> Any:
        raise NotImplementedError

    def send(self, topic: str, message: Any) -> None:
        raise NotImplementedError

    def wait(self, seconds: float) -> None:
        time.sleep(seconds)


class OverDds(Graph):
    def __init__(self, topics: dict[str, str], namespace: str) -> None:
        from tests.support.dds_wire import deserialised
        from ttc_fast.ros.dds import qos
        from ttc_fast.ros.dds.participant import Participant, Publisher
        from ttc_fast.ros.dds.settings import DdsSettings

        super().__init__()
        self.node = Participant(DdsSettings(node_name="car", namespace=namespace))
        drive = ASKED["drive_in"]
        self.node.subscribe("brake_bool", "std_msgs/Bool", bytes, lambda cdr: self.hear_brake(cdr[4] != 0))
        self.node.subscribe(
            "drive", drive, lambda cdr: deserialised(drive, cdr), lambda msg: self.drives.append(msg.drive.speed)
        )
        self.publishers = {topic: self.node.publisher(topic, name) for topic, name in topics.items()}
        writer = self.node._writer("rt/tf_static", LATCHED["/tf_static"], qos.LATCHED)
        self.publishers["/tf_static"] = Publisher(writer, self.node._type(LATCHED["/tf_static"]), "/tf_static")
        self.node.announce()

    def made(self, name: str) -> Any:
        from ttc_fast.ros.dds.types import message

        return message(name)

    def stamped(self, message: Any, frame: str) -> Any:
        from ttc_fast.ros.dds.types import time_of

        message.header.stamp, message.header.frame_id = time_of(time.time_ns()), frame
        return message

    def send(self, topic: str, message: Any) -> None:
        from ttc_fast.ros.dds.types import serialized

        self.publishers[topic].publish(serialized(message))

    def wait(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            if self.node.wait(left):
                self.node.take()


def kind_of(name: str) -> Any:
    package, own = name.split("/")
    return getattr(__import__(f"{package}.msg", fromlist=[own]), own)


class OverRospy(Graph):
    def __init__(self, topics: dict[str, str], namespace: str) -> None:
        import rospy

        from ttc_fast.ros.rospy_node import AckermannDriveStamped, TFMessage

        super().__init__()
        self.rospy = rospy
        self.made_by_the_node = {"ackermann_msgs/AckermannDriveStamped": AckermannDriveStamped}
        self.made_by_the_node["tf2_msgs/TFMessage"] = TFMessage
        rospy.init_node("car")  # the variable ROS_NAMESPACE says where
        rospy.Subscriber("brake_bool", kind_of("std_msgs/Bool"), lambda msg: self.hear_brake(msg.data))
        rospy.Subscriber("drive", AckermannDriveStamped, lambda msg: self.drives.append(msg.drive.speed))
        self.publishers = {
            topic: rospy.Publisher(topic, type(self.made(name)), queue_size=1, tcp_nodelay=True, latch=topic in LATCHED)
            for topic, name in topics.items()
        }

    def made(self, name: str) -> Any:
        return (self.made_by_the_node.get(name) or kind_of(name))()

    def stamped(self, message: Any, frame: str) -> Any:
        message.header.stamp, message.header.frame_id = self.rospy.get_rostime(), frame
        return message

    def send(self, topic: str, message: Any) -> None:
        self.publishers[topic].publish(message)


class OverRclpy(Graph):
    def __init__(self, topics: dict[str, str], namespace: str) -> None:
        import rclpy
        from rclpy.qos import DurabilityPolicy, QoSProfile

        super().__init__()
        self.rclpy = rclpy
        rclpy.init()
        self.node = rclpy.create_node("car", namespace=namespace)
        drive = kind_of(ASKED["drive_in"])
        self.node.create_subscription(kind_of("std_msgs/Bool"), "brake_bool", lambda msg: self.hear_brake(msg.data), 10)
        self.node.create_subscription(drive, "drive", lambda msg: self.drives.append(msg.drive.speed), 10)
        static = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)  # as a StaticTransformBroadcaster has
        self.publishers = {
            topic: self.node.create_publisher(kind_of(name), topic, static if topic in LATCHED else 1)
            for topic, name in topics.items()
        }

    def made(self, name: str) -> Any:
        return kind_of(name)()

    def stamped(self, message: Any, frame: str) -> Any:
        message.header.stamp, message.header.frame_id = self.node.get_clock().now().to_msg(), frame
        return message

    def send(self, topic: str, message: Any) -> None:
        self.publishers[topic].publish(message)

    def wait(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            self.rclpy.spin_once(self.node, timeout_sec=left)


GRAPHS = {"dds": OverDds, "ros1": OverRospy, "rclpy": OverRclpy}


class Car:
    """The car on its way, along x from 0."""

    def __init__(self, graph: Graph, asks: str, takes_over: str) -> None:
        self.graph, self._asks, self._takes_over = graph, asks, takes_over
        self.x = self.speed = 0.0
        self.wall, self.noise = 7.0, 1e-3
        self.asked = 0.0
        self.takes_over = self.parked = False
        self.ends = time.monotonic() + PATIENCE

    def step(self) -> bool:
        """Drive on for a period, and return whether the node brakes."""
        if time.monotonic() > self.ends:
            sys.exit(f"waited in vain: braked {self.graph.braked}, at {self.x:.2f} m, {self.speed:.2f} m/s")
        graph = self.graph
        wanted, change = (0.0, 6.0) if graph.braked else (0.0 if self.parked else self.asked, 3.0)
        step = change * PERIOD
        self.speed += min(max(wanted - self.speed, -step), step)
        self.x += self.speed * PERIOD
        with np.errstate(divide="ignore"):
            along = np.where(np.cos(ANGLES) > 0, self.wall - self.x, BEHIND + self.x) / np.abs(np.cos(ANGLES))
            across = BESIDE / np.abs(np.sin(ANGLES))
        graph.odometry(self.speed)
        self.noise = -self.noise  # a scanner never shows the same twice
        graph.scan(np.minimum(along, across) + self.noise)
        if self._asks:
            graph.ask(self._asks, self.asked)
        if self.takes_over:
            graph.take_over(self._takes_over)
        graph.wait(PERIOD)
        return graph.braked is not False

    def until(self, braked: bool) -> float:
        """Drive on until the node says so, and return how long that took, s."""
        began = time.monotonic()
        while self.step() is not braked:
            pass
        return time.monotonic() - began

    def for_seconds(self, seconds: float) -> list[bool]:
        """Drive on, and return what the node said in each period."""
        return [self.step() for _ in range(round(seconds / PERIOD))]


def main(transport: str, scenario: str, asks: str, takes_over: str, namespace: str) -> None:
    topics = {"scan": "sensor_msgs/LaserScan", "odom": "nav_msgs/Odometry", **LATCHED}
    topics |= {topic: name for topic, name in {**ASKED, **TAKES_OVER}.items() if topic in (asks, takes_over)}
    car = Car(GRAPHS[transport](topics, namespace), asks, takes_over)
    car.graph.transform()
    print("ready", flush=True)
    car.until(False)  # the node is there, and sees
    car.for_seconds(0.5)
    car.asked = 2.0
    car.until(True)
    while car.speed != 0.0:
        car.step()
    said: dict[str, Any] = {"held": all(car.for_seconds(1.0)), "stopped at": car.x}
    if scenario == "back out":
        car.asked = -1.0
        said["released after"] = car.until(False)
        said["braked again"] = any(car.for_seconds(1.0))
    elif scenario == "drive on":
        car.wall = 100.0
        said["released after"] = car.until(False)
        said["braked again"] = any(car.for_seconds(1.0))
    else:
        car.parked = car.takes_over = True
        said["released after"] = car.until(False)
        said["braked again"] = any(car.for_seconds(1.0))
        car.takes_over = False
        said["ended after"] = car.until(True)
    said["at"], said["speed"] = car.x, car.speed
    said["drives"] = car.graph.drives
    print(json.dumps(said), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
