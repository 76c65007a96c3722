"""The scans or clouds of a bag of ROS, with the motion of the vehicle by its odometry."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from ttc_fast.logs.log import CloudFrame, Lidar, LogError, ReadErrors, ScanFrame, Scanner
from ttc_fast.logs.motion import Odometer, Pose
from ttc_fast.logs.options import LIDAR, MOTION, SCANNER
from ttc_fast.pointcloud2 import read_pointcloud2
from ttc_fast.ros_messages import (
    LASER_SCAN,
    ODOMETRY,
    POINT_CLOUD,
    MessageError,
    laser_scan,
    odometry,
    point_cloud,
)
from ttc_fast.sensors.oddities import RefusedError, Tally
from ttc_fast.sensors.scans import Geometry, ScanReader

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from ttc_fast.logs.container import Container, Topic
    from ttc_fast.logs.options import LogOptions
    from ttc_fast.sensors.scans import Scan

NS = 1e-9
STAMPED = "stamps of the messages"
UNSTAMPED = "times of recording, as the messages have no stamps"
OUT_OF_ORDER = 1_000_000_000
"""Messages may be out of order by this, ns; recorders that write in several threads are so by far less."""
VIEWS = {LASER_SCAN: laser_scan, POINT_CLOUD: point_cloud}


def open_bag(bag: Container, options: LogOptions) -> BagScans | BagClouds:
    """Choose the topic of a bag, and open it as the log that its type makes it."""
    topic = _chosen(bag, options.topic, tuple(VIEWS), "topic")
    if topic is None:
        has = ", ".join(f"{topic.name} ({topic.type})" for topic in bag.topics) or "no topics that can be read"
        raise LogError(bag.path, f"has no topic of {LASER_SCAN} or {POINT_CLOUD}; it has {has}")
    source = _Source(bag, topic, _odometry(bag, options), options)
    if topic.type == LASER_SCAN:
        options.only(("topic", *MOTION, *SCANNER), bag.path, f"a log of {LASER_SCAN}")
        return BagScans(source, options)
    options.only(("topic", *MOTION, *LIDAR), bag.path, f"a log of {POINT_CLOUD}")
    return BagClouds(source, options)


class _Source:
    """The messages of one topic, each with its stamp and the odometry until then."""

    def __init__(self, bag: Container, topic: Topic, odometry_topic: Topic | None, options: LogOptions) -> None:
        self.bag = bag
        self.topic = topic
        self._odometry = odometry_topic
        self._options = options
        self._view: Callable[[Any, int, int], Any] = partial(VIEWS[topic.type], encoding=topic.encoding)
        first, self._recorded = self._find_first()
        self._from_header = first.stamp != 0
        self._begin = first.stamp if self._from_header else self._recorded
        self.clock = STAMPED if self._from_header else UNSTAMPED
        known = "no odometry: the speed is unknown" if odometry_topic is None else f"odometry of {odometry_topic.name}"
        self.motion = options.motion(known)

    def read(self, errors: ReadErrors) -> Iterator[tuple[float, Any, Odometer]]:
        """Read each message with its stamp, s since the first, and the odometry until then."""
        name, begin, from_header, view = self.topic.name, self._begin, self._from_header, self._view
        odometer = Odometer(self._options.speed, self._options.max_speed_age)
        names = {name} if self._odometry is None else {name, self._odometry.name}
        latest, ordered = 0, True
        for source, time, buffer, start, end in self.bag.messages(names, errors):
            if time > latest:
                latest = time
            elif ordered and latest - time > OUT_OF_ORDER:
                ordered = False  # is reported once
                errors.add(_unordered(source, (latest - time) * NS, self.bag.path))
            try:
                if source != name:
                    self._update(odometer, time, buffer, start, end, errors)
                    continue
                message = view(buffer, start, end)
            except MessageError as error:
                errors.add(
                    f"message on {source}, recorded {(time - self._recorded) * NS:.3f} s after the first: {error}"
                )
                continue
            yield ((message.stamp if from_header else time) - begin) * NS, message, odometer

    def _update(self, odometer: Odometer, time: int, buffer: Any, start: int, end: int, errors: ReadErrors) -> None:
        assert self._odometry is not None
        read = odometry(buffer, start, end, encoding=self._odometry.encoding)
        stamp = ((read.stamp if self._from_header else time) - self._begin) * NS
        if not odometer.update(stamp, Pose(read.x, read.y, read.yaw), read.speed, read.yaw_rate):
            errors.add(f"odometry at {stamp:.3f} s is not finite")

    def first_sound(self, reader: ScanReader) -> Scan:
        """Return the first scan that makes sense."""
        errors = ReadErrors(self.bag.path)
        for _, _, buffer, start, end in self.bag.messages({self.topic.name}, errors):
            try:
                return reader.read(self._view(buffer, start, end))
            except (MessageError, RefusedError) as error:
                errors.add(f"message on {self.topic.name} {error}")
        errors.raise_if_any(0)
        raise LogError(self.bag.path, f"has no scan on {self.topic.name}")

    def _find_first(self) -> tuple[Any, int]:
        """Return the first message, and when it was recorded."""
        errors = ReadErrors(self.bag.path)
        for _, time, buffer, start, end in self.bag.messages({self.topic.name}, errors):
            try:
                return self._view(buffer, start, end), time
            except MessageError as error:
                errors.add(f"message on {self.topic.name}: {error}")
        errors.raise_if_any(0)
        raise LogError(self.bag.path, f"has no messages on {self.topic.name}, which it lists; was anything recorded?")


class _BagLog:
    """What scans and clouds of a bag have in common."""

    assumed = ""

    def __init__(self, source: _Source) -> None:
        self.odd = Tally()
        """What was odd about the messages that were read."""
        self.path = source.bag.path
        self.frame_count = source.topic.messages
        self.clock = source.clock
        self.motion = source.motion
        self._source = source


class BagScans(_BagLog):
    """The scans of a bag.

    Each scan says where its own beams are. It has the motion of the latest odometry that was recorded before it and is
    not stamped later. Ranges are views of the bag's own bytes, of whatever alignment; big-endian ones are copies.

    Parameters
    ----------
    source : _Source
        The messages, sensor_msgs/LaserScan.
    options : LogOptions
        What the user says of it.

    Raises
    ------
    LogError
        While iterating, after the last frame, if something was damaged, or scans made no sense.
    """

    def __init__(self, source: _Source, options: LogOptions) -> None:
        super().__init__(source)
        self._options = options
        self.scanner = self._scanner(source.first_sound(ScanReader(source.topic.name, Tally())).geometry)

    def __iter__(self) -> Iterator[ScanFrame]:
        errors, frames = ReadErrors(self.path), 0
        self.odd = Tally()
        reader = ScanReader(self._source.topic.name, self.odd)
        raw: Geometry | None = None
        for stamp, message, odometer in self._source.read(errors):
            try:
                scan = reader.read(message)
            except RefusedError as error:
                errors.add(f"the scan at {stamp:.3f} s {error}")
                continue
            frames += 1
            if scan.geometry is not raw:
                raw = scan.geometry
                geometry = Geometry(*(getattr(self._scanner(raw), name) for name in Geometry._fields))
            motion = odometer.at(stamp)
            yield ScanFrame(stamp, scan.ranges, *motion, 0.0, scan.time_increment, geometry)
        errors.raise_if_any(frames)

    def _scanner(self, geometry: Geometry) -> Scanner:
        """Return the scanner of a geometry, with what the user says of it."""
        return self._options.applied(Scanner(**geometry._asdict()), SCANNER)


class BagClouds(_BagLog):
    """The clouds of a bag: records over the bag's own bytes, of whatever layout; big-endian ones are copies.

    Parameters
    ----------
    source : _Source
        The messages, sensor_msgs/PointCloud2.
    options : LogOptions
        What the user says of it.

    Raises
    ------
    LogError
        While iterating, after the last frame, if something was damaged.
    """

    def __init__(self, source: _Source, options: LogOptions) -> None:
        super().__init__(source)
        self.lidar = options.applied(Lidar(sensor_height=None), LIDAR)

    def __iter__(self) -> Iterator[CloudFrame]:
        errors, frames = ReadErrors(self.path), 0
        self.odd = Tally()
        for stamp, message, odometer in self._source.read(errors):
            try:
                points, oddities = read_pointcloud2(message)
            except (ValueError, TypeError) as error:
                errors.add(f"the cloud at {stamp:.3f} s: {error}")
                continue
            for part, text in oddities.items():
                self.odd.count(f"{self._source.topic.name}, {part}", text)
            frames += 1
            yield CloudFrame(stamp, points, *odometer.at(stamp))
        errors.raise_if_any(frames)


def _unordered(topic: str, seconds: float, path: Path) -> str:
    fix = f"rosbags-convert --src {path.name} --dst sorted, of the package rosbags, puts it in order"
    back = f"a message on {topic} was recorded {seconds:.1f} s before one that it follows"
    return f"it is not in the order of time, and the odometry that belongs to a frame may be missed: {back}; {fix}"


def _chosen(bag: Container, name: str | None, kinds: tuple[str, ...], option: str) -> Topic | None:
    """Choose the one topic of these types, or the named one; None if there is none."""
    found = [topic for topic in bag.topics if topic.type in kinds]
    if name is not None:
        named = [topic for topic in found if topic.name.strip("/") == name.strip("/")]
        if not named:
            has = ", ".join(topic.name for topic in found) or "none"
            of = " or ".join(kinds)
            raise LogError(bag.path, f"has no topic {name} of {of}; it has {has}: choose with the option {option}")
        return named[0]
    if len(found) > 1:
        has = ", ".join(f"{topic.name} ({topic.type})" for topic in found)
        raise LogError(bag.path, f"has several topics to choose from, {has}; choose one with the option {option}")
    return found[0] if found else None


def _odometry(bag: Container, options: LogOptions) -> Topic | None:
    """Choose the odometry. Which of several it is matters only while the speed is not given."""
    if options.speed is not None and options.odometry_topic is None:
        found = [topic for topic in bag.topics if topic.type == ODOMETRY]
        return found[0] if len(found) == 1 else None
    return _chosen(bag, options.odometry_topic, (ODOMETRY,), "odometry_topic")
