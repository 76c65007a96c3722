"""Messages that are sent, packed as CDR: little-endian XCDR1, as ROS 2 does it."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

HEADER = b"\x00\x01\x00\x00"
"""Of all CDR: its kind, and two bytes of options."""
TRUE, FALSE = HEADER + b"\x01", HEADER + b"\x00"
ADD, DELETE, SPHERE = 0, 2, 2
"""Constants of visualization_msgs/Marker."""


class Writer:
    """Packs field after field, each aligned to its own size."""

    def __init__(self) -> None:
        self.bytes = bytearray(HEADER)

    def put(self, form: str, *values: float) -> Writer:
        """Append numbers of one kind, as ``struct`` calls it."""
        self.align(struct.calcsize(form))
        self.bytes += struct.pack(f"<{len(values)}{form}", *values)
        return self

    def string(self, text: str) -> Writer:
        """Append a string. It ends at its first zero, if it has one: CDR can tell no more."""
        encoded = text.encode("utf-8", "replace").partition(b"\0")[0] + b"\0"
        self.put("I", len(encoded))
        self.bytes += encoded
        return self

    def align(self, size: int) -> None:
        """Append zeros up to where a number of this size may begin; CDR counts from behind its first four bytes."""
        self.bytes += bytes((len(HEADER) - len(self.bytes)) % size)

    def header(self, stamp: int, frame: str) -> Writer:
        """Append a std_msgs/Header."""
        seconds, nanoseconds = divmod(stamp, 1_000_000_000)
        return self.put("i", seconds).put("I", nanoseconds).string(frame)


def encoded_bool(value: bool) -> bytes:
    """Pack a std_msgs/Bool."""
    return TRUE if value else FALSE


def encoded_drive(stamp: int, frame: str, *, speed: float, acceleration: float) -> bytes:
    """Pack an ackermann_msgs/AckermannDriveStamped that goes straight on; stamp in ns, m/s, m/s^2."""
    return bytes(Writer().header(stamp, frame).put("f", 0.0, 0.0, speed, acceleration, 0.0).bytes)


def encoded_diagnostics(
    stamp: int, *, level: int, name: str, message: str, hardware_id: str, values: Iterable[tuple[str, str]]
) -> bytes:
    """Pack a diagnostic_msgs/DiagnosticArray of one status."""
    writer = Writer().header(stamp, "").put("I", 1)
    writer.put("B", level).string(name).string(message).string(hardware_id)
    pairs = list(values)
    writer.put("I", len(pairs))
    for key, value in pairs:
        writer.string(key).string(value)
    return bytes(writer.bytes)


def encoded_marker(
    stamp: int,
    frame: str,
    position: tuple[float, float, float],
    *,
    action: int = ADD,
    color: tuple[float, float, float],
    diameter: float = 0.2,
    lifetime: float = 0.5,
    text: str = "",
) -> bytes:
    """Pack a visualization_msgs/Marker: a sphere that fades when it is not renewed; m and s."""
    writer = Writer().header(stamp, frame).string("ttc_fast").put("i", 0, SPHERE, action)
    writer.put("d", *position, 0.0, 0.0, 0.0, 1.0, diameter, diameter, diameter).put("f", *color, 1.0)
    seconds, nanoseconds = divmod(round(lifetime * 1e9), 1_000_000_000)
    writer.put("i", seconds).put("I", nanoseconds).put("B", 0)
    writer.put("I", 0, 0)  # points and colors
    writer.string("").put("i", 0).put("I", 0).string("").string("").put("I", 0)  # texture_resource and texture
    writer.put("I", 0).string(text).string("")  # uv_coordinates, text and mesh_resource
    writer.string("").put("I", 0).put("B", 0)  # mesh_file and mesh_use_embedded_materials
    return bytes(writer.bytes)


def encoded_discovery(
    participant: bytes, namespace: str, node_name: str, *, readers: list[bytes], writers: list[bytes]
) -> bytes:
    """Pack a rmw_dds_common/ParticipantEntitiesInfo of one node; each Gid as many bytes as the release has."""
    writer = Writer()
    writer.bytes += participant
    writer.put("I", 1).string(namespace).string(node_name)
    for gids in (readers, writers):
        writer.put("I", len(gids))
        writer.bytes += b"".join(gids)
    return bytes(writer.bytes)
