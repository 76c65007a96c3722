"""Another process in a DDS graph, which its arguments and its standard input control.

``DOMAIN TOPIC TYPE`` publishes each line of hexadecimal digits, once the topic has a reader; ``DOMAIN --discovery
SIZE`` prints the first sample about another node.
"""

from __future__ import annotations

import sys
import time
from typing import Any

from ttc_fast.ros.dds.participant import Participant
from ttc_fast.ros.dds.settings import DdsSettings

PATIENCE = 20.0


def publish(domain: int, topic: str, name: str) -> None:
    node = Participant(DdsSettings(domain_id=domain, node_name="peer"))
    publisher = node.publisher(topic, name)
    print(publisher.writer.guid.bytes.hex(), flush=True)
    for line in sys.stdin:
        end = time.monotonic() + PATIENCE
        while not publisher.writer.get_matched_subscriptions() and time.monotonic() < end:
            time.sleep(0.005)
        publisher.publish(bytes.fromhex(line))
        print("sent", flush=True)


def discover(domain: int, size: int) -> None:
    from cyclonedds.sub import DataReader
    from cyclonedds.topic import Topic

    from ttc_fast.ros.dds import qos
    from ttc_fast.ros.dds.types import topic_type

    node = Participant(DdsSettings(domain_id=domain, node_name="peer", gid_size=size))
    kind = topic_type("rmw_dds_common/ParticipantEntitiesInfo", gid_size=size)
    reader: Any = DataReader(node._participant, Topic(node._participant, "ros_discovery_info", kind), qos.DISCOVERY)
    sample = next(reader.take_iter(timeout=int(PATIENCE * 1e9)))
    print(sample.cdr.hex())


if __name__ == "__main__":
    if sys.argv[2] == "--discovery":
        discover(int(sys.argv[1]), int(sys.argv[3]))
    else:
        publish(int(sys.argv[1]), sys.argv[2], sys.argv[3])
