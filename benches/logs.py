"""How fast logs are read, and where the time goes: ``python -m benches.logs``.

It writes a drive of LaserScan and Odometry, 1080 beams and one odometry a scan, as each kind of bag. Each stage holds
those before it: the bytes of the file, its records, the frames, the TTC. Beside them stand a replay through the brake,
one whose rows are written as CSV, and one of these with an outline; and the kernels alone, which are ttc_fast's own
share. The stages of all kinds take turns, and the least time of each is given, as CPU time of one core a scan. rosbags
does the same job beside it, with its own deserialisation. The least TTC is compared between all.

``--gigabytes 10`` repeats the ROS 1 bag to that size instead, reads it, and says how the resident memory grew; with
``--replay`` it is replayed into a CSV file instead.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.rosbag1 import Writer as BagWriter
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Bag2Writer
from rosbags.typesys import Stores, get_typestore

from evaluation.report import Report, console
from ttc_fast import ScanSweptPath, ScanTTC
from ttc_fast.logs import LogError, ScanLog, open_log
from ttc_fast.logs.log import ReadErrors
from ttc_fast.logs.mcap import McapFile
from ttc_fast.logs.rosbag1 import MAGIC, Bag
from ttc_fast.logs.rosbag2 import Database
from ttc_fast.replay import Replay, Settings
from ttc_fast.replay.row import CsvWriter

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

OUTLINE = (-0.1, 0.4, -0.15, 0.15)  # m
BEAMS, RATE, BEGIN = 1080, 40, 1_700_000_000 * 10**9
TOPICS = {"/odom": "nav_msgs/msg/Odometry", "/scan": "sensor_msgs/msg/LaserScan"}
CONTAINERS: dict[str, Callable[[Path], Any]] = {".bag": Bag, ".db3": Database, ".mcap": McapFile}
LEGEND = (
    "CPU time of one core a scan, us, least of the rounds; each stage holds those before it. A scan is 4.4 kB, and an "
    "odometry of 0.7 kB comes with each."
)


def drive(scans: int, types: dict[str, Any], *, sequence: bool) -> Iterator[tuple[str, int, Any]]:
    """Make topics, times (ns) and messages: a wall that comes nearer, at 1 to 3 m/s."""

    def make(name: str, **fields: Any) -> Any:
        return types[name](**fields)

    wall = 10.0 + np.random.default_rng(0).uniform(0.0, 5.0, (64, BEAMS)).astype(np.float32)
    zero, covariance = make("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0), np.zeros(36)
    ahead = make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0)
    for i in range(scans):
        now = BEGIN + i * 10**9 // RATE
        stamp = make("builtin_interfaces/msg/Time", sec=now // 10**9, nanosec=now % 10**9)
        header = make("std_msgs/msg/Header", stamp=stamp, frame_id="base_link", **({"seq": i} if sequence else {}))
        place = make("geometry_msgs/msg/Point", x=i * 0.05, y=0.0, z=0.0)
        speed = make("geometry_msgs/msg/Vector3", x=1.0 + 2.0 * i / scans, y=0.0, z=0.0)
        pose = make("geometry_msgs/msg/Pose", position=place, orientation=ahead)
        twist = make("geometry_msgs/msg/Twist", linear=speed, angular=zero)
        odometry = {
            "child_frame_id": "base_link",
            "pose": make("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=covariance),
            "twist": make("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=covariance),
        }
        yield "/odom", now, make(TOPICS["/odom"], header=header, **odometry)
        angles = {"angle_min": -2.35, "angle_max": 2.35, "angle_increment": 4.7 / (BEAMS - 1), "time_increment": 0.0}
        limits = {"scan_time": 0.025, "range_min": 0.06, "range_max": 30.0, "intensities": np.zeros(0, np.float32)}
        scan = angles | limits | {"ranges": wall[i % 64] * (1 - 0.9 * i / scans)}
        yield "/scan", now, make(TOPICS["/scan"], header=header, **scan)


def write_bags(folder: Path, scans: int) -> list[Path]:
    """Write the drive as each kind of bag."""
    paths = [folder / "drive.bag"]
    store = get_typestore(Stores.ROS1_NOETIC)
    with BagWriter(paths[0]) as bag:
        topics = {name: bag.add_connection(name, kind, typestore=store) for name, kind in TOPICS.items()}
        for name, now, message in drive(scans, store.types, sequence=True):
            bag.write(topics[name], now, store.serialize_ros1(message, TOPICS[name]))
    store = get_typestore(Stores.ROS2_HUMBLE)
    for suffix, plugin in ((".db3", StoragePlugin.SQLITE3), (".mcap", StoragePlugin.MCAP)):
        recording = folder / f"drive{suffix[:3].replace('.', '_')}"
        with Bag2Writer(recording, version=9, storage_plugin=plugin) as bag2:
            listed = {name: bag2.add_connection(name, kind, typestore=store) for name, kind in TOPICS.items()}
            for name, now, message in drive(scans, store.types, sequence=False):
                bag2.write(listed[name], now, store.serialize_cdr(message, TOPICS[name]))
        paths.append(recording / f"{recording.name}{suffix}")
    return paths


def read_bytes(path: Path) -> float:
    """Read the file, and no more."""
    with path.open("rb") as file:
        while file.read(1 << 20):
            pass
    return np.nan


def read_records(path: Path) -> float:
    """Read the messages as bytes."""
    container = CONTAINERS[path.suffix](path)
    for _ in container.messages(TOPICS, ReadErrors(path)):
        pass
    return np.nan


def read_frames(path: Path) -> float:
    """Read scans with their speeds."""
    for _ in open_log(path):
        pass
    return np.nan


def read_ttc(path: Path) -> float:
    """Read scans, and take the TTC of each."""
    log = open_log(path)
    assert isinstance(log, ScanLog)
    nearest = ScanTTC(**vars(log.scanner)).nearest
    return float(min(nearest(frame.ranges, frame.speed or 0.0, frame.yaw_rate).ttc for frame in log))


def rosbags_ttc(path: Path) -> float:
    """Read scans with rosbags alone, and take the TTC of each."""
    store = get_typestore(Stores.ROS1_NOETIC if path.suffix == ".bag" else Stores.ROS2_HUMBLE)
    least: float = float("inf")
    speed: float = 0.0
    kernel: ScanTTC | None = None
    with AnyReader([path], default_typestore=store) as reader:
        for connection, _, raw in reader.messages():
            message: Any = reader.deserialize(raw, connection.msgtype)
            if connection.topic == "/odom":
                speed = message.twist.twist.linear.x
                continue
            kernel = kernel or ScanTTC.from_message(message)
            least = min(least, float(kernel.nearest(message.ranges, speed).ttc))
    return least


def replay_rows(path: Path) -> float:
    """Replay it through the brake."""
    return _least(Replay(path), lambda row: None)


def replay_csv(path: Path) -> float:
    """Replay it, and write the rows."""
    with CsvWriter(path.with_suffix(".csv")) as writer:
        return _least(Replay(path), writer.write)


def replay_outline(path: Path) -> float:
    """Replay it with an outline, so that the swept path brakes, whose TTC is another one; write the rows."""
    with CsvWriter(path.with_suffix(".csv")) as writer:
        _least(Replay(path, Settings(log_options={"outline": OUTLINE})), writer.write)
    return np.nan


def _least(replay: Replay, take: Callable[[Any], None]) -> float:
    for row in replay:
        take(row)
    return replay.summary.least.ttc if replay.summary.least else np.nan


def call_kernel(path: Path, make: Callable[..., Any], calls: int) -> float:
    """Call a kernel on the first scan ``calls`` times; return the CPU time of a call, us."""
    log = open_log(path)
    assert isinstance(log, ScanLog)
    nearest, frame = make(vars(log.scanner)).nearest, next(iter(log))
    start = time.process_time()
    for _ in range(calls):
        nearest(frame.ranges, 2.0, 0.1)
    return (time.process_time() - start) / calls * 1e6


KERNELS: dict[str, Callable[[dict[str, Any]], Any]] = {
    "kernel alone": lambda scanner: ScanTTC(**scanner),
    "kernel with an outline": lambda scanner: ScanSweptPath(ScanTTC(**{**scanner, "outline": OUTLINE})),
}
STAGES = {
    "bytes": read_bytes,
    "records": read_records,
    "frames": read_frames,
    "frames and TTC": read_ttc,
    "with rosbags alone": rosbags_ttc,
    "replay": replay_rows,
    "replay, CSV": replay_csv,
    "with an outline, CSV": replay_outline,
}
A_SECOND = ("frames and TTC", "replay, CSV", "with an outline, CSV")
"""The stages whose scans a second are given, too."""


def report(scans: int, rounds: int) -> Report:
    """Time every stage of every kind of bag, in turns."""
    with tempfile.TemporaryDirectory() as folder:
        paths = write_bags(Path(folder), scans)
        times: dict[tuple[Path, str], list[float]] = {(path, stage): [] for path in paths for stage in STAGES}
        answers = set()
        kernels: dict[str, list[float]] = {name: [] for name in KERNELS}
        for _ in range(rounds):
            for name, make in KERNELS.items():
                kernels[name].append(call_kernel(paths[0], make, scans))
            for path, stage in times:
                start = time.process_time()
                answers.add(STAGES[stage](path))
                times[path, stage].append((time.process_time() - start) / scans * 1e6)
    found = {answer for answer in answers if not np.isnan(answer)}
    assert len(found) == 1, found
    rows = []
    for path in paths:
        least = {stage: min(times[path, stage]) for stage in STAGES}
        measured = [f"{us:.1f}" for us in (*least.values(), *map(min, kernels.values()))]
        rows.append([path.suffix, *measured, *(f"{1e6 / least[stage]:,.0f}" for stage in A_SECOND)])
    header = ["bag", *STAGES, *KERNELS, *(f"{stage}, scans/s" for stage in A_SECOND)]
    return Report("Reading logs", LEGEND, header, rows)


def grow(gigabytes: float, *, replayed: bool) -> None:
    """Repeat a bag to a size, read or replay it, and print the resident memory on the way."""
    with tempfile.TemporaryDirectory() as folder:
        path = write_bags(Path(folder), 4000)[0]
        content = path.read_bytes()
        at = content.index(b"index_pos=") + len(b"index_pos=")
        index = int.from_bytes(content[at : at + 8], "little")
        head = len(MAGIC)  # where the first chunk begins: behind the record of the header
        for _ in range(2):
            head += 4 + int.from_bytes(content[head : head + 4], "little")
        repeats = round(gigabytes * 1e9 / (index - head))
        with path.open("wb") as file:
            file.write(content[:at] + bytes(8) + content[at + 8 : head])  # without an index, as after a crash
            for _ in range(repeats):
                file.write(content[head:index])
        writer = CsvWriter(path.with_suffix(".csv")) if replayed else None
        log: Any = Replay(path) if replayed else open_log(path)
        count, start = 0, time.process_time()
        every = 4000 * max(1, repeats // 10)
        try:
            for count, item in enumerate(log, 1):
                if writer is not None:
                    writer.write(item)
                if count % every == 0:
                    resident = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
                    print(f"{count:>9} scans, {resident:.0f} MB resident")
        except LogError as error:  # of repeated stamps, which go back
            print(error)
        if writer is not None:
            writer.close()
        seconds = time.process_time() - start
        size = path.stat().st_size / 1e9
        print(f"{count} scans of {size:.2f} GB in {seconds:.1f} s of CPU time: {count / seconds:,.0f} a second")


def main() -> None:
    """Report, or grow."""
    parser = argparse.ArgumentParser(prog="python -m benches.logs", description=__doc__)
    parser.add_argument("--scans", type=int, default=20_000)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--gigabytes", type=float)
    parser.add_argument("--replay", action="store_true")
    arguments = parser.parse_args()
    if arguments.gigabytes:
        grow(arguments.gigabytes, replayed=arguments.replay)
    else:
        console().print(report(arguments.scans, arguments.rounds).rich())


if __name__ == "__main__":
    main()
