"""The scans or clouds of a bag of ROS, with the motion of the vehicle by its odometry."""

from __future__ import annotations

from collections import deque
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from ttc_fast._settings import option
from ttc_fast.logs.log import CloudFrame, Lidar, LogError, ReadErrors, ScanFrame, Scanner
from ttc_fast.logs.options import LIDAR, MOTION, SCANNER
from ttc_fast.ros_messages import (
    LASER_SCAN,
    ODOMETRY,
    POINT_CLOUD,
    TRANSFORMS,
    MessageError,
    laser_scan,
    odometry,
    point_cloud,
    transforms,
)
from ttc_fast.sensors.clock import Stamps, StampSurvey, other_clock
from ttc_fast.sensors.clouds import CloudReader, Placement
from ttc_fast.sensors.frames import MixedError, SensorChoice, mixed_sensors
from ttc_fast.sensors.oddities import RefusedError, Tally
from ttc_fast.sensors.odometry import Odometer, OdometryReader, Pose
from ttc_fast.sensors.scans import Geometry, ScanReader
from ttc_fast.sensors.transforms import OPTICAL, Transforms, is_level, is_optical, tilted

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from ttc_fast.logs.container import Container, Topic
    from ttc_fast.logs.options import LogOptions
    from ttc_fast.sensors.transforms import Mount

NS = 1e-9
STAMPED = "stamps of the messages"
UNSTAMPED = "times of recording, as the messages have no stamps"
RECORDED = "times of recording, as chosen"
MOST_SURVEYED, MOST_BYTES = 200, 1 << 27
"""The messages, and their bytes, of which the clock and the sensors of a topic are found when a bag is opened."""
OUT_OF_ORDER = 1_000_000_000
"""Messages may be out of order by this, ns; recorders that write in several threads are so by far less."""
VIEWS = {LASER_SCAN: laser_scan, POINT_CLOUD: point_cloud}


def open_bag(bag: Container, options: LogOptions) -> BagScans | BagClouds:
    """Choose the topic of a bag, and open it as the log that its type makes it."""
    topic = _chosen(bag, options.topic, tuple(VIEWS), "topic")
    if topic is None:
        errors = ReadErrors(bag.path)
        if not bag.topics:  # perhaps because all of it is damaged
            deque(bag.messages((), errors), maxlen=0)
        errors.raise_if_any(0)
        has = ", ".join(f"{topic.name} ({topic.type})" for topic in bag.topics) or "no topics that can be read"
        raise LogError(bag.path, f"has no topic of {LASER_SCAN} or {POINT_CLOUD}; it has {has}")
    source = _Source(bag, topic, _odometry(bag, options), options)
    if topic.type == LASER_SCAN:
        options.only(("topic", "frame", "base_frame", "clock", *MOTION, *SCANNER), bag.path, f"a log of {LASER_SCAN}")
        return BagScans(source, options)
    options.only(("topic", "frame", "base_frame", "clock", *MOTION, *LIDAR), bag.path, f"a log of {POINT_CLOUD}")
    return BagClouds(source, options)


class _Source:
    """The messages of one topic, each with its stamp and the odometry until then.

    The first messages of the topic, and what else was recorded meanwhile, are surveyed when the bag is opened: which
    sensors there are, and by which clock they are stamped.
    """

    def __init__(self, bag: Container, topic: Topic, odometry_topic: Topic | None, options: LogOptions) -> None:
        self.bag = bag
        self.topic = topic
        self.odd = Tally()
        """What was odd about the messages that were read."""
        self._odometry = odometry_topic
        self._options = options
        self._view: Callable[[Any, int, int], Any] = partial(VIEWS[topic.type], encoding=topic.encoding)
        self.geometry: Geometry | None = None
        """The geometry of the first scan that makes sense."""
        self.frame_id = ""
        """The frame of the sensor."""
        self.transforms = Transforms()
        """The static transforms that were recorded with the first messages."""
        self._recorded = 0
        self._survey()

    def read(self, errors: ReadErrors) -> Iterator[tuple[float, int, Any, Odometer]]:
        """Read each message: its stamp, s since the first, when it was recorded, ns, and the odometry until then."""
        name, begin, from_header, view = self.topic.name, self.begin, self._from_header, self._view
        self.odd = odd = Tally()
        odometry = "odometry" if self._odometry is None else self._odometry.name
        reader = OdometryReader(odometry, odd)
        odometer = Odometer(self._options.speed, self._options.max_speed_age, reader)
        names = {name} if self._odometry is None else {name, odometry}
        sensor, stamps = self._sensor(odd), Stamps(name, odd, has_stamps=True)
        newest = self._began
        latest, ordered = 0, True
        if self._incomparable:
            errors.add(f"{self._incomparable}, and the odometry is not used")
            names.discard(odometry)
        for source, time, buffer, start, end in self.bag.messages(names, errors):
            if time > latest:
                latest = time
            elif ordered and latest - time > OUT_OF_ORDER:
                ordered = False  # is reported once
                errors.add(_unordered(source, (latest - time) * NS, self.bag.path))
            try:
                if source != name:
                    self._update(odometer, time, newest, buffer, start, end, errors)
                    continue
                message = view(buffer, start, end)
                if not sensor.accepts(message.frame_id, getattr(message, "ranges", None)):
                    continue
                measured = stamps.measured(message.stamp, time) if from_header else time
            except MixedError as error:
                raise LogError(self.bag.path, f"{name} {error}") from None
            except (MessageError, RefusedError) as error:
                errors.add(
                    f"message on {source}, recorded {(time - self._recorded) * NS:.3f} s after the first: {error}"
                )
                continue
            newest = measured, time
            yield (measured - begin) * NS, time, message, odometer

    def _update(
        self,
        odometer: Odometer,
        time: int,
        newest: tuple[int, int],
        buffer: Any,
        start: int,
        end: int,
        errors: ReadErrors,
    ) -> None:
        """Take in odometry. Without a stamp it counts as measured when it came, in the clock of the frames."""
        assert self._odometry is not None
        read = odometry(buffer, start, end, encoding=self._odometry.encoding)
        stamp, came = read.stamp if self._from_header else time, False
        if self._from_header and not stamp:
            measured, recorded = newest
            stamp, came = measured + round((time - recorded) * self._rate), True
        pose = Pose(read.x, read.y, read.yaw)
        at = (stamp - self.begin) * NS
        try:
            odometer.update(at, pose, read.speed, read.yaw_rate, read.lateral_speed, came=came)
        except RefusedError as error:
            errors.add(f"odometry at {at:.3f} s {str(error).partition(':')[0]}")

    def _sensor(self, odd: Tally) -> SensorChoice:
        return SensorChoice(self.topic.name, odd, self._options.frame or "", option("frame"))

    def _survey(self) -> None:
        """Look at the first messages, and decide on sensor and clock."""
        name, moving = self.topic.name, None if self._odometry is None else self._odometry.name
        errors, frames, sizes, read = ReadErrors(self.bag.path), dict[str, None](), 0, 0
        clocks = {name: StampSurvey(), moving: StampSurvey()}
        sensor, reader, chosen = self._sensor(Tally()), ScanReader(name, Tally()), 0
        static = {
            each.name: each.encoding
            for each in self.bag.topics
            if each.type in TRANSFORMS and each.name.strip("/") == "tf_static"
        }
        for source, time, buffer, start, end in self.bag.messages({name, moving or name, *static}, errors):
            try:
                if source in static:
                    self.transforms.add(transforms(buffer, start, end, encoding=static[source]))
                    continue
                if source != name:
                    assert self._odometry is not None
                    clocks[source].add(odometry(buffer, start, end, encoding=self._odometry.encoding).stamp, time)
                    continue
                message = self._view(buffer, start, end)
            except MessageError as error:
                errors.add(f"message on {source}: {error}")
                continue
            self._recorded = self._recorded or time
            read, sizes = read + 1, sizes + end - start
            frames[message.frame_id.lstrip("/")] = None  # the names of ROS 1 may begin with one
            if not self._options.frame or sensor.accepts(message.frame_id):
                clocks[name].add(message.stamp, time)
                chosen, self.frame_id = chosen + 1, message.frame_id
                if self.geometry is None and self.topic.type == LASER_SCAN:
                    self._take_geometry(reader, message, errors)
            if read >= MOST_SURVEYED or sizes >= MOST_BYTES:
                break
        if static and self.mount is None and self.is_elsewhere:  # they may have been recorded later
            for source, _, buffer, start, end in self.bag.messages(set(static), ReadErrors(self.bag.path)):
                with suppress(MessageError):
                    self.transforms.add(transforms(buffer, start, end, encoding=static[source]))
        if not read:
            errors.raise_if_any(0)
            raise LogError(self.bag.path, f"has no messages on {name}, which it lists; was anything recorded?")
        if not chosen:
            has = ", ".join(map(repr, frames))
            raise LogError(
                self.bag.path, f"{name} has no messages with the frame_id {self._options.frame!r}, but {has}"
            )
        if len(frames) > 1 and not self._options.frame:
            raise LogError(self.bag.path, f"{name} {mixed_sensors(frames, option('frame'))}")
        if self.geometry is None and self.topic.type == LASER_SCAN:
            errors.raise_if_any(0)
        self._choose_clock(clocks[name], clocks[moving] if moving else None)

    def _take_geometry(self, reader: ScanReader, message: Any, errors: ReadErrors) -> None:
        try:
            self.geometry = reader.read(message).geometry
        except RefusedError as error:
            errors.add(f"a scan on {self.topic.name} {error}")

    @property
    def is_elsewhere(self) -> bool:
        """Whether the frame of the sensor has a name that is not that of the vehicle."""
        return self.frame_id.lstrip("/") not in ("", self.base_frame.lstrip("/"))

    @property
    def base_frame(self) -> str:
        """The frame of the vehicle."""
        return self._options.base_frame or "base_link"

    @property
    def has_speed(self) -> bool:
        """Whether odometry was recorded, or the user gives the speed."""
        return self._odometry is not None or self._options.speed is not None

    @property
    def mount(self) -> Mount | None:
        """Where the sensor sits on the vehicle, if the static transforms say it."""
        return self.transforms.mount(self.base_frame, self.frame_id)

    def _choose_clock(self, frames: StampSurvey, moving: StampSurvey | None) -> None:
        """Choose the clock of the bag: stamps of messages or times of recording, by what the first messages say."""
        by = self._options.clock
        self._from_header = by == "header" or (by is None and frames.has_stamps)
        self.clock = STAMPED if self._from_header else UNSTAMPED if by is None else RECORDED
        if self._from_header and not frames.stamped:
            raise LogError(
                self.bag.path, f"{self.topic.name} has no stamps; leave out {option('clock')}, or say recorded"
            )
        self._began = frames.first if self._from_header else (self._recorded, self._recorded)
        self.begin, self._rate = self._began[0], frames.rate if self._from_header else 1.0
        known, self._incomparable = "no odometry: the speed is unknown", ""
        if self._odometry is not None:
            known = f"odometry of {self._odometry.name}"
        if self._odometry is not None and moving is not None and self._from_header and moving.stamped:
            ahead = moving.ahead - frames.ahead
            remedy = f"{option('clock', 'recorded')} takes the times of recording"
            self._incomparable = other_clock(self._odometry.name, ahead, self.topic.name, remedy)
            known = f"unknown: {self._incomparable}" if self._incomparable else known
        self.motion = self._options.motion(known)


class _BagLog:
    """What scans and clouds of a bag have in common."""

    assumed = ""

    def __init__(self, source: _Source) -> None:
        self.path = source.bag.path
        self.frame_count = source.topic.messages
        self.clock = source.clock
        self.motion = source.motion
        self.sensor = source.topic.name + (f", frame {source.frame_id}" if source.frame_id else "")
        """The topic of the sensor and its frame, for people."""
        self.begin = source.begin
        """What the stamps of the frames count from, ns by the clock of the log."""
        self.base_frame = source.base_frame
        """The frame of the vehicle."""
        self.unplaced_frame = source.frame_id if source.is_elsewhere and source.mount is None else ""
        """The frame of the sensor where no static transform says where on the vehicle it is; else empty."""
        self._source = source

    @property
    def odd(self) -> Tally:
        """What was odd about the messages that were read."""
        return self._source.odd


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
        self.upside_down = bool(options.upside_down)
        """Whether the user says that the scanner hangs upside down."""
        self.mounted = ""
        """Where the mount comes from, for people; empty where the log does not say it."""
        mount = source.mount if options.mount is None else None
        self._mount = mount if mount is not None and is_level(mount) else None
        self._tilted = tilted(mount, option("mount")) if mount is not None and self._mount is None else ""
        if self._mount is not None:
            self.mounted = self._mount.text
        elif source.is_elsewhere and options.mount is None:
            self.mounted = f"as no static transform places {source.frame_id}"
        assert source.geometry is not None
        self.scanner = self._scanner(source.geometry)
        self.always_has_speed = options.speed is not None

    def __iter__(self) -> Iterator[ScanFrame]:
        if self._tilted:
            raise LogError(self.path, f"{self._source.topic.name} {self._tilted}")
        errors, frames = ReadErrors(self.path), 0
        reader: ScanReader | None = None
        raw: Geometry | None = None
        for stamp, recorded, message, odometer in self._source.read(errors):
            reader = reader or ScanReader(self._source.topic.name, self.odd)
            try:
                scan = reader.read(message)
            except RefusedError as error:
                errors.add(f"the scan at {stamp:.3f} s {error}")
                continue
            frames += 1
            if scan.geometry is not raw:
                raw = scan.geometry
                geometry = Geometry(*(getattr(self._scanner(raw), name) for name in Geometry._fields))
            yield ScanFrame(stamp, scan.ranges, *odometer.at(stamp), scan.time_increment, geometry, recorded)
        errors.raise_if_any(frames)

    def without_mount(self) -> None:
        """Leave out what the static transforms say, as the user gives a mount."""
        self._tilted = self.mounted = ""
        if self._mount is not None:
            self._mount = None
            assert self._source.geometry is not None
            self.scanner = self._scanner(self._source.geometry)

    def _scanner(self, geometry: Geometry) -> Scanner:
        """Return the scanner of a geometry, with what the transforms and the user say of it."""
        options, scanner = self._options, Scanner(**geometry._asdict())
        if self._mount is not None:
            scanner = replace(scanner, mount=self._mount.place)
            if self._mount.upside_down and options.upside_down is None:
                options = replace(options, upside_down=True)
        return options.applied(scanner, SCANNER)


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
        lidar, mount = Lidar(sensor_height=None), source.mount
        self.mounted = "" if mount is None else mount.text
        """Where the mount comes from, for people; empty where the log does not say it."""
        self.mount = None if mount is None else mount.place
        """Where the lidar sits in the vehicle's frame, if the log says it: x, y (m) and yaw (rad)."""
        self.placement = None if mount is None else Placement.of(mount, source.frame_id)
        """Where its points are in the vehicle's frame, if the log says it."""
        self.has_speed = source.has_speed
        if is_optical(source.frame_id):
            lidar = replace(lidar, axes=OPTICAL)
        elif mount is not None and mount.upside_down:
            lidar = replace(lidar, axes=("x", "-y", "-z"))
        self.lidar = options.applied(lidar, LIDAR)

    def __iter__(self) -> Iterator[CloudFrame]:
        errors, frames = ReadErrors(self.path), 0
        reader: CloudReader | None = None
        for stamp, recorded, message, odometer in self._source.read(errors):
            if is_optical(message.frame_id) and self.lidar.axes == OPTICAL:
                self.odd.count(
                    f"{self._source.topic.name}, frame", f"{message.frame_id} has z forward, x right, y down"
                )
            reader = reader or CloudReader(self._source.topic.name, self.odd)
            try:
                points = reader.read(message)
            except (ValueError, TypeError) as error:
                errors.add(f"the cloud at {stamp:.3f} s: {error}")
                continue
            frames += 1
            yield CloudFrame(stamp, points, *odometer.at(stamp), recorded)
        errors.raise_if_any(frames)


def _unordered(topic: str, seconds: float, path: Path) -> str:
    fix = f"rosbags-convert --src {path.name} --dst sorted, of the package rosbags, puts it in order"
    back = f"a message on {topic} was recorded {seconds:.1f} s before one that it follows"
    return f"it is not in the order of time, and the odometry that belongs to a frame may be missed: {back}; {fix}"


def _chosen(bag: Container, name: str | None, kinds: tuple[str, ...], how: str) -> Topic | None:
    """Choose the one topic of these types, or the named one; None if there is none."""
    found = [topic for topic in bag.topics if topic.type in kinds]
    if name is not None:
        named = [topic for topic in found if topic.name.strip("/") == name.strip("/")]
        if not named:
            others = ", ".join(f"{topic.name} ({topic.type})" for topic in bag.topics) or "none"
            has = ", ".join(topic.name for topic in found) or others
            of = " or ".join(kinds)
            raise LogError(bag.path, f"has no topic {name} of {of}; it has {has}: choose with {option(how)}")
        return named[0]
    if len(found) > 1:
        has = ", ".join(f"{topic.name} ({topic.type})" for topic in found)
        raise LogError(bag.path, f"has several topics to choose from, {has}; choose one with {option(how)}")
    return found[0] if found else None


def _odometry(bag: Container, options: LogOptions) -> Topic | None:
    """Choose the odometry. Which of several it is matters only while the speed is not given."""
    if options.speed is not None and options.odometry_topic is None:
        found = [topic for topic in bag.topics if topic.type == ODOMETRY]
        return found[0] if len(found) == 1 else None
    return _chosen(bag, options.odometry_topic, (ODOMETRY,), "odometry_topic")
