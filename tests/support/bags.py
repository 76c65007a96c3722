"""Bags of every kind, written by rosbags: an implementation that the readers share nothing with."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from rosbags.rosbag1 import Writer as BagWriter
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Bag2Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from numpy.typing import NDArray

ROS1_STORE = get_typestore(Stores.ROS1_NOETIC)
ROS1_STORE.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage"))
ROS2_STORE = get_typestore(Stores.ROS2_HUMBLE)
KINDS = ("bag", "bag.bz2", "bag.lz4", "db3", "db3.zstd", "mcap", "mcap.zstd")
BEGIN = 1_700_000_000_000_000_000  # ns
DATATYPES = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "f4": 7, "f8": 8}
POINTS = np.array([(9.0, 1.0, -1.0, 3, 7.5), (8.0, 0.5, -1.0, 4, 8.5)], "<f4, <f4, <f4, <u2, <f8")
POINTS.dtype.names = ("x", "y", "z", "ring", "time")


@dataclass(frozen=True)
class Item:
    """Something recorded: its stamp and when it was recorded, s since ``BEGIN``; no stamp is zero in the message."""

    stamp: float | None
    recorded: float


@dataclass(frozen=True)
class Scan(Item):
    ranges: NDArray[np.float32] = field(default_factory=lambda: np.arange(1.0, 20.0, dtype=np.float32))
    topic: str = "/scan"
    angle_min: float = -1.5
    frame: str = "laser"  # five letters: what follows is unaligned in ROS 1
    angle_max: float = 1.5
    increment: float | None = None
    time_increment: float = 0.0
    range_max: float = 30.0
    type = "sensor_msgs/msg/LaserScan"

    @property
    def step(self) -> float:
        return 3.0 / max(len(self.ranges) - 1, 1) if self.increment is None else self.increment

    def fields(self, types: dict[str, Any]) -> dict[str, Any]:
        del types
        angles = {"angle_min": self.angle_min, "angle_max": self.angle_max, "angle_increment": self.step}
        times = {
            "time_increment": self.time_increment,
            "scan_time": 0.1,
            "range_min": 0.0625,
            "range_max": self.range_max,
        }
        return angles | times | {"ranges": self.ranges, "intensities": np.zeros(0, np.float32)}


@dataclass(frozen=True)
class Odom(Item):
    speed: float = 0.0
    yaw_rate: float = 0.0
    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0
    topic: str = "/odom"
    frame: str = "odom"
    lateral_speed: float = 0.0
    type = "nav_msgs/msg/Odometry"

    def fields(self, types: dict[str, Any]) -> dict[str, Any]:
        def make(name: str, **fields: Any) -> Any:
            return types[f"geometry_msgs/msg/{name}"](**fields)

        turned = make("Quaternion", x=0.0, y=0.0, z=math.sin(self.yaw / 2), w=math.cos(self.yaw / 2))
        pose = make("Pose", position=make("Point", x=self.x, y=self.y, z=0.5), orientation=turned)
        turning = make("Vector3", x=0.0, y=0.0, z=self.yaw_rate)
        twist = make("Twist", linear=make("Vector3", x=self.speed, y=self.lateral_speed, z=0.0), angular=turning)
        covariance = np.zeros(36)
        return {
            "child_frame_id": "base_link",
            "pose": make("PoseWithCovariance", pose=pose, covariance=covariance),
            "twist": make("TwistWithCovariance", twist=twist, covariance=covariance),
        }


@dataclass(frozen=True)
class Cloud(Item):
    points: NDArray[Any] = field(default_factory=lambda: np.zeros(1, [(name, "<f4") for name in "xyz"]))
    topic: str = "/points"
    frame: str = "lidar"
    names: dict[str, str] = field(default_factory=dict)  # other names for fields
    counts: dict[str, int] = field(default_factory=dict)
    header: dict[str, int] = field(default_factory=dict)  # what it says instead of the truth
    type = "sensor_msgs/msg/PointCloud2"

    def fields(self, types: dict[str, Any]) -> dict[str, Any]:
        described: Any = self.points.dtype.fields or {}
        height, width = self.points.shape if self.points.ndim == 2 else (1, len(self.points))
        step = self.points.dtype.itemsize
        point_field = types["sensor_msgs/msg/PointField"]
        fields = [
            point_field(
                name=self.names.get(name, name),
                offset=offset,
                datatype=DATATYPES[kind.str[1:]],
                count=self.counts.get(name, 1),
            )
            for name, (kind, offset, *_) in described.items()
        ]
        big = any(kind.str.startswith(">") for kind, *_ in described.values())
        shape = {"height": height, "width": width, "fields": fields, "is_bigendian": big, "point_step": step}
        data = np.frombuffer(self.points.tobytes(), np.uint8)
        return shape | {"row_step": width * step, "data": data, "is_dense": True} | self.header


@dataclass(frozen=True)
class Static(Item):
    """A static transform."""

    parent: str = "base_link"
    child: str = "laser"
    at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    topic: str = "/tf_static"
    frame: str = ""
    type = "tf2_msgs/msg/TFMessage"

    def fields(self, types: dict[str, Any]) -> dict[str, Any]:
        def make(name: str, **fields: Any) -> Any:
            return types[f"geometry_msgs/msg/{name}"](**fields)

        placed = make(
            "Transform",
            translation=make("Vector3", **dict(zip("xyz", self.at, strict=True))),
            rotation=make("Quaternion", **dict(zip("xyzw", self.rotation, strict=True))),
        )
        sequence = {"seq": 7} if "seq" in types["std_msgs/msg/Header"].__dataclass_fields__ else {}
        time = types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
        header = types["std_msgs/msg/Header"](stamp=time, frame_id=self.parent, **sequence)
        return {"transforms": [make("TransformStamped", header=header, child_frame_id=self.child, transform=placed)]}


Recorded = Scan | Odom | Cloud | Static


def serialised(item: Recorded, wire: str) -> bytes:
    """Serialise for ROS 1 ("ros1"), or as CDR of either order of bytes ("little", "big")."""
    store = ROS1_STORE if wire == "ros1" else ROS2_STORE
    nanoseconds = 0 if item.stamp is None else BEGIN + round(item.stamp * 1e9)
    stamp = store.types["builtin_interfaces/msg/Time"](sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)
    sequence = {"seq": 7} if wire == "ros1" else {}
    header = store.types["std_msgs/msg/Header"](stamp=stamp, frame_id=item.frame, **sequence)
    headed = {} if isinstance(item, Static) else {"header": header}
    message = store.types[item.type](**headed, **item.fields(store.types))
    if wire == "ros1":
        return bytes(store.serialize_ros1(message, item.type))
    return bytes(store.serialize_cdr(message, item.type, little_endian=wire == "little"))


def write(folder: Path, kind: str, items: Iterable[Recorded], *, wire: str = "little", chunk: int = 4096) -> Path:
    """Write a bag of a kind into the folder; a bag of ROS 1 has chunks of ``chunk`` bytes."""
    if kind.startswith("bag"):
        return _write_bag(folder / "log.bag", kind.removeprefix("bag").removeprefix("."), items, chunk)
    plugin = StoragePlugin.SQLITE3 if kind.startswith("db3") else StoragePlugin.MCAP
    writer = Bag2Writer(folder / "log", version=9, storage_plugin=plugin)
    if kind.endswith("zstd"):
        # What databases can compress is each message; MCAP compresses its chunks.
        mode = CompressionMode.MESSAGE if plugin is StoragePlugin.SQLITE3 else CompressionMode.STORAGE
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        topics: dict[str, Any] = {}
        for item in items:
            if item.topic not in topics:
                topics[item.topic] = writer.add_connection(item.topic, item.type, typestore=ROS2_STORE)
            writer.write(topics[item.topic], BEGIN + round(item.recorded * 1e9), serialised(item, wire))
    return folder / "log" / f"log.{kind.partition('.')[0]}"


def _write_bag(path: Path, compression: str, items: Iterable[Recorded], chunk: int) -> Path:
    writer = BagWriter(path)
    if compression:
        writer.set_compression(writer.CompressionFormat[compression.upper()])
    writer.chunk_threshold = chunk
    with writer:
        topics: dict[str, Any] = {}
        for item in items:
            if item.topic not in topics:
                topics[item.topic] = writer.add_connection(item.topic, item.type, typestore=ROS1_STORE)
            writer.write(topics[item.topic], BEGIN + round(item.recorded * 1e9), serialised(item, "ros1"))
    return path


def drive(scans: int, beams: int = 64) -> list[Recorded]:
    """Make a drive: odometry, and 5 ms after it a scan, 40 times a second."""
    rng = np.random.default_rng(scans)
    items: list[Recorded] = []
    for i in range(scans):
        now = i / 40
        items.append(Odom(now, now + 0.001, speed=1.0 + i / 100, yaw_rate=0.1))
        items.append(Scan(now + 0.005, now + 0.006, rng.uniform(0.1, 20.0, beams).astype(np.float32)))
    return items


def scans_of(items: Iterable[Recorded]) -> list[NDArray[np.float32]]:
    return [item.ranges for item in items if isinstance(item, Scan)]
