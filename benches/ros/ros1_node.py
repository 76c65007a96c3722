"""The node of ROS 1 in a process of its own, which says at its end what each scan took it, us."""

from __future__ import annotations

import json
import time
from collections import deque
from typing import Any

import rospy
from rospy.numpy_msg import numpy_msg
from sensor_msgs.msg import LaserScan

from ttc_fast.ros.rospy_node import RospyNode, forgiving
from ttc_fast.ros.settings import NodeSettings

SETTINGS = {"criterion": "ittc", "use_range_rate": False, "trigger": [1, 1], "release": [1, 1], "hold": 0.0}


def timed(kind: Any) -> Any:
    """Return a message type that knows when its reading began."""

    class Timed(kind):  # type: ignore[misc] # made by genpy, which has no types
        def deserialize(self, buffer: Any) -> Any:
            self.began = time.perf_counter()
            return super().deserialize(buffer)

    return Timed


SCAN = timed(forgiving(numpy_msg(LaserScan)))


class TimedNode(RospyNode):
    """Times everything from the bytes of a scan to its answers on the way to be sent."""

    def __init__(self, settings: NodeSettings) -> None:
        self.took: deque[float] = deque(maxlen=20_000)
        super().__init__(settings)

    def _subscribe(self, topic: str, kind: Any, take: Any, variant: Any = lambda kind: kind) -> None:
        super()._subscribe(topic, kind, take, lambda kind: timed(variant(kind)))

    def receive(self, data: bytes) -> None:
        """Take the bytes of a scan as from a connection."""
        topic = self.core.settings.scan_topic
        self._safely(topic, self._on_scan, SCAN().deserialize(data))

    def _safely(self, topic: str, take: Any, msg: Any) -> None:
        super()._safely(topic, take, msg)
        if topic == self.core.settings.scan_topic:
            self.took.append(time.perf_counter() - msg.began)


if __name__ == "__main__":
    rospy.init_node("ttc_fast")
    node = TimedNode(NodeSettings.of(SETTINGS))
    node.spin()
    print(json.dumps([each * 1e6 for each in node.took]))
