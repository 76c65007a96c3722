"""What other people's software says of messages and of RTPS: the other side of the DDS tests."""

from __future__ import annotations

import random
import socket
import struct
from typing import Any

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from ttc_fast.ros.dds.types import DEFINITIONS

LOOPBACK = (
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces>'
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    '<MaxAutoParticipantIndex>9</MaxAutoParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers>'
    "<SPDPInterval>100ms</SPDPInterval></Discovery></Domain></CycloneDDS>"
)
UPSTREAM = {"humble": get_typestore(Stores.ROS2_HUMBLE), "jazzy": get_typestore(Stores.ROS2_JAZZY)}


def ros2_name(name: str) -> str:
    return name.replace("/", "/msg/")


def store_of(definitions: dict[str, str]) -> Typestore:
    """Return the types that rosbags makes of definitions."""
    store = Typestore()
    every: dict[str, Any] = {}
    for name, fields in definitions.items():
        every |= get_types_from_msg(fields.replace("; ", "\n"), ros2_name(name))
    store.register(every)
    return store


STORE = store_of(DEFINITIONS)


def make(kind: str, /, **fields: Any) -> Any:
    """Return a message of rosbags."""
    return STORE.types[ros2_name(kind)](**fields)


def serialised(name: str, message: Any, *, little: bool = True) -> bytes:
    return bytes(STORE.serialize_cdr(message, ros2_name(name), little_endian=little))


def deserialised(name: str, cdr: bytes) -> Any:
    return STORE.deserialize_cdr(cdr, ros2_name(name))


def header(stamp: int, frame: str) -> Any:
    seconds, nanoseconds = divmod(stamp, 10**9)
    return make(
        "std_msgs/Header", stamp=make("builtin_interfaces/Time", sec=seconds, nanosec=nanoseconds), frame_id=frame
    )


def port(domain: int, participant: int = 0) -> int:
    """Return the port at which a participant takes user data [RTPS 2.5, 9.6.2.3]."""
    return 7400 + 250 * domain + 11 + 2 * participant


DOMAINS = range(1, 101)
"""The highest domain: Linux may give the ports of higher ones to any socket."""
PARTICIPANTS = range(10)
"""The number of participants that a domain may have, by ``LOOPBACK``."""


def free_domain() -> int:
    """Return a random domain without a participant on this machine: other runs of these tests look for one, too."""
    for domain in random.SystemRandom().sample(DOMAINS, len(DOMAINS)):
        if all(is_free(port(domain, participant)) for participant in PARTICIPANTS):
            return domain
    raise RuntimeError("all DDS domains are in use")


def is_free(number: int) -> bool:
    """Return whether a UDP port is free."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as tried:
        try:
            tried.bind(("", number))
        except OSError:
            return False
    return True


class Forger:
    """Sends samples in the name of a writer that is in the graph: whatever bytes, with the next sequence numbers."""

    def __init__(self, domain: int, writer: bytes, *, first: int, participant: int = 0) -> None:
        self.next = first
        self._writer = writer
        self._to = ("127.0.0.1", port(domain, participant))
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    def send(self, payload: bytes) -> None:
        prefix, entity = self._writer[:12], self._writer[12:]
        head = struct.pack("<4sBBBB12s", b"RTPS", 2, 1, 1, 16, prefix)
        numbers = struct.pack("<HH4s4siI", 0, 16, bytes(4), entity, self.next >> 32, self.next & 0xFFFFFFFF)
        self._socket.sendto(
            head + struct.pack("<BBH", 0x15, 0x05, len(numbers + payload)) + numbers + payload, self._to
        )
        self.next += 1

    def close(self) -> None:
        self._socket.close()
