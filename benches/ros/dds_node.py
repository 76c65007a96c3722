"""The node over DDS, timed: a process that ``benches.ros.dds`` starts.

``echo`` as the second argument answers without deciding anything: what is left is Cyclone's and the system's.
"""

from __future__ import annotations

import json
import signal
import sys
import time
from collections import deque
from functools import partial
from typing import TYPE_CHECKING, Any

from ttc_fast.ros.dds.participant import Participant
from ttc_fast.ros.dds.settings import DdsSettings
from ttc_fast.ros.dds_node import TRUE_FALSE, DdsNode
from ttc_fast.ros.settings import NodeSettings
from ttc_fast.ros_messages import laser_scan

if TYPE_CHECKING:
    from collections.abc import Callable

SENDING: list[int] = []
"""How long what was published since the wake took, ns."""
SETTINGS = {
    "trigger": [1, 1],
    "release": [1, 1],
    "hold": 0.0,
    "stopping_distance": False,
    "use_range_rate": False,
    "speed_topic": "/speed",
    "marker_topic": "",
    # Nothing is said but to a scan.
    "watchdog_period": 3600.0,
    "diagnostics_period": 3600.0,
    "sensor_timeout": 3600.0,
    "motion_timeout": 3600.0,
}


class Echo:
    """Answers each scan by whether its middle beam is near."""

    def __init__(self, dds: DdsSettings) -> None:
        self.participant = Participant(dds)
        brake = self.participant.publisher("/brake_bool", "std_msgs/Bool")

        def answer(scan: Any) -> None:
            brake.publish(TRUE_FALSE[bool(scan.ranges[len(scan.ranges) // 2] < 6.0)])

        self.participant.subscribe("/scan", "sensor_msgs/LaserScan", laser_scan, answer, sensor_data=True)
        self.participant.subscribe("/speed", "std_msgs/Float64", bytes, lambda _: None)
        self.participant.announce()


def main() -> None:
    """Answer until terminated, then print what each answer took, us: reading and deciding, and sending."""
    ended = False

    def end(*_: Any) -> None:
        nonlocal ended
        ended = True

    signal.signal(signal.SIGTERM, end)
    dds = DdsSettings(domain_id=int(sys.argv[1]))
    node = Echo(dds) if sys.argv[2] == "echo" else DdsNode(NodeSettings.of(SETTINGS), dds)
    for each in node.participant.publishers:
        each.publish = partial(timed, each.publish)  # type: ignore[method-assign]
    took: deque[tuple[float, float]] = deque(maxlen=int(sys.argv[3]))
    while not ended:
        if node.participant.wait(0.2):
            SENDING.clear()
            began = time.perf_counter_ns()
            node.participant.take()
            took.append(((time.perf_counter_ns() - began - sum(SENDING)) * 1e-3, sum(SENDING) * 1e-3))
    print(json.dumps(list(took)))


def timed(publish: Callable[[bytes], None], cdr: bytes) -> None:
    """Publish, and note how long that took."""
    began = time.perf_counter_ns()
    publish(cdr)
    SENDING.append(time.perf_counter_ns() - began)


if __name__ == "__main__":
    main()
