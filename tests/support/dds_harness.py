"""The adapter of DDS by the interface of the others: messages as rosbags packs and reads them, no other process."""

from __future__ import annotations

from functools import partial
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from tests.support.dds_wire import LOOPBACK, deserialised, free_domain, make, serialised
from tests.support.ros_harness import MessageHarness
from ttc_fast.ros.dds.participant import Participant, Publisher
from ttc_fast.ros.dds.settings import DdsSettings
from ttc_fast.ros.dds.types import DEFINITIONS, fields_of
from ttc_fast.ros.dds_node import DdsNode
from ttc_fast.ros.settings import NodeSettings

if TYPE_CHECKING:
    import re
    from collections.abc import Iterator

    import pytest

BASIC = {"string": "", "bool": False, "float32": 0.0, "float64": 0.0}


class DdsHarness(MessageHarness):
    """The node in this process; what it publishes is read again, and heard by nobody else."""

    def __init__(self, patch: pytest.MonkeyPatch, **parameters: Any) -> None:
        super().__init__()
        patch.setenv("CYCLONEDDS_URI", LOOPBACK)
        patch.setattr(Publisher, "has_listeners", True)
        self.settings = DdsSettings(domain_id=free_domain())
        self.node = DdsNode(NodeSettings.of(parameters), self.settings, clock=lambda: round(self.now * 1e9))
        for each in self.node.participant.publishers:
            name = each.writer.topic.typename.replace("::msg::dds_::", "/").removesuffix("_")
            patch.setattr(each, "publish", partial(self._hear, each.topic, name))
        self._peers: dict[str, Participant] = {}

    def close(self) -> None:
        for each in [self.node, *self._peers.values()]:
            each.close()

    def message(self, package: str, name: str) -> Any:
        return empty(f"{package}/{name}")

    def stamp(self, seconds: float) -> Any:
        sec, nanosec = divmod(round(seconds * 1e9), 10**9)
        return SimpleNamespace(name="builtin_interfaces/Time", sec=sec, nanosec=nanosec)

    def deliver(self, topic: str, message: Any) -> None:
        (subscription,) = [each for each in self.node.participant.subscriptions if each.topic == topic]
        subscription.deliver(serialised(message.name, packed(message)))

    def speed(self, speed: float, kind: str, topic: str) -> None:
        self.announce(topic, "nav_msgs" if kind == "Odometry" else "std_msgs", kind)
        super().speed(speed, kind, topic)

    def announce(self, topic: str, package: str, kind: str) -> None:
        if topic not in self._peers:
            peer = self._peers[topic] = Participant(self.settings)
            peer.publisher(topic, f"{package}/{kind}")
            self.node.participant.take()  # it finds the type of the topic

    def _hear(self, topic: str, name: str, cdr: bytes) -> None:
        self.published.setdefault(topic, []).append(deserialised(name, cdr))


def parts(name: str) -> Iterator[tuple[str, str, re.Match[str]]]:
    """Return name and type of each field of a message."""
    package = name.partition("/")[0]
    for field in fields_of(name):
        kind = field["type"]
        whole = kind if "/" in kind or f"{package}/{kind}" not in DEFINITIONS else f"{package}/{kind}"
        yield field["name"], whole, field


def empty(name: str) -> SimpleNamespace:
    """Return an empty message that can be filled."""
    made = SimpleNamespace(name=name)
    for own, kind, field in parts(name):
        value: Any = empty(kind) if kind in DEFINITIONS else BASIC.get(kind, 0)
        if field["many"] is not None:
            value = np.zeros(int(field["many"][1:-1] or 0)) if kind not in DEFINITIONS else []
        setattr(made, own, value)
    if name == "sensor_msgs/PointField":
        made.type = name  # of which ``name`` is a field
    return made


def packed(message: Any) -> Any:
    """Return the message as rosbags has it."""
    name = getattr(message, "type", message.name)
    values: dict[str, Any] = {}
    for own, kind, field in parts(name):
        value = getattr(message, own)
        if kind in DEFINITIONS:
            values[own] = packed(value) if field["many"] is None else [packed(each) for each in value]
        elif field["many"] is not None:
            values[own] = np.frombuffer(value, kind) if isinstance(value, bytes) else np.asarray(value, kind)
        else:
            values[own] = value
    return make(name, **values)
