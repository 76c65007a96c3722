"""Bags of ROS 1 and 2: what they give, and what they say of one that leaves something open."""

import gzip
import json
import sqlite3
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.writer import Writer

from tests.support.bags import DATATYPES, KINDS, POINTS, Cloud, Odom, Recorded, Scan, drive, scans_of, write
from tests.support.opened import open_clouds, open_scans
from ttc_fast import Gate, Minimum, ScanTTC, robust_min_x
from ttc_fast.logs import CloudLog, LogError, ScanFrame, open_log


def frames(folder: Path, items: Sequence[Recorded], **options: Any) -> list[ScanFrame]:
    return list(open_scans(write(folder, "bag", items), **options))


def motions(read: Sequence[ScanFrame]) -> list[tuple[float | None, float, float]]:
    """Speed, yaw rate and age of the speed."""
    return [(frame.speed, frame.yaw_rate, frame.speed_age) for frame in read]


@pytest.mark.parametrize("kind", KINDS)
def test_scans_come_as_they_were_recorded(kind: str, tmp_path: Path) -> None:
    items = drive(50)
    log = open_scans(write(tmp_path, kind, items))
    read = list(log)
    assert [frame.stamp for frame in read] == pytest.approx([i / 40 for i in range(50)])
    assert [frame.speed for frame in read] == pytest.approx([1 + i / 100 for i in range(50)])
    assert [frame.yaw_rate for frame in read] == [0.1] * 50
    assert [frame.speed_age for frame in read] == pytest.approx([0.005] * 50, abs=1e-9)
    np.testing.assert_array_equal([frame.ranges for frame in read], scans_of(items))
    assert log.frame_count in (50, None)
    assert (log.clock, log.motion) == ("stamps of the messages", "odometry of /odom")
    assert len(list(log)) == 50  # once more


@pytest.mark.parametrize("kind", KINDS)
def test_the_scanner_is_that_of_the_messages(kind: str, tmp_path: Path) -> None:
    scanner = open_scans(write(tmp_path, kind, drive(2))).scanner
    assert (scanner.angle_min, scanner.angle_increment, scanner.beams) == (-1.5, float(np.float32(3 / 63)), 64)
    assert (scanner.range_min, scanner.range_max) == (0.0625, 30.0)
    assert (scanner.mount, scanner.outline) == ((0.0, 0.0, 0.0), None)


@pytest.mark.parametrize("kind", ["bag", "bag.lz4", "mcap", "mcap.zstd"])
def test_indexed_bags_count_their_frames(kind: str, tmp_path: Path) -> None:
    assert open_scans(write(tmp_path, kind, drive(30))).frame_count == 30


@pytest.mark.parametrize("options", [{}, {"topic": "/scan"}])
def test_messages_of_another_encoding_are_named(options: dict[str, Any], tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start("", "test")
        schema = writer.register_schema("sensor_msgs/msg/LaserScan", "jsonschema", b"{}")
        writer.add_message(writer.register_channel("/scan", "json", schema), 1, b"{}", 1)
        writer.finish()  # type: ignore[no-untyped-call]
    with pytest.raises(LogError, match=r"it has /scan \(sensor_msgs/LaserScan in json, which is not read\)"):
        open_log(path, **options)


@pytest.mark.parametrize("kind", ["bag", "mcap", "db3"])
def test_ranges_are_read_in_place(kind: str, tmp_path: Path) -> None:
    log = open_scans(write(tmp_path, kind, drive(8)))
    kernel = ScanTTC(**vars(log.scanner))
    for frame in log:
        assert not frame.ranges.flags.owndata
        assert kernel.min(frame.ranges, 1.0) == kernel.min(frame.ranges.copy(), 1.0)


def test_bags_of_ros_1_hold_unaligned_ranges(tmp_path: Path) -> None:
    assert not all(frame.ranges.flags.aligned for frame in frames(tmp_path, drive(8)))


@pytest.mark.parametrize("kind", ["db3", "mcap"])
def test_big_endian_messages(kind: str, tmp_path: Path) -> None:
    items = drive(5)
    read = list(open_scans(write(tmp_path, kind, items, wire="big")))
    np.testing.assert_array_equal([frame.ranges for frame in read], scans_of(items))
    assert read[0].ranges.dtype == np.float32
    assert read[4].speed == 1.04


# Motion


def test_odometry_from_after_a_scan_is_never_used(tmp_path: Path) -> None:
    # The second one was recorded before the scan but stamped after it; the third was recorded after it.
    items: list[Recorded] = [
        Odom(0.0, 0.0, speed=1.0),
        Odom(0.2, 0.01, speed=2.0),
        Scan(0.1, 0.11),
        Odom(0.05, 0.12, speed=3.0),
    ]
    (frame,) = frames(tmp_path, items)
    assert frame.speed == 1.0
    assert frame.speed_age == pytest.approx(0.1)


def test_before_any_odometry_the_speed_is_unknown(tmp_path: Path) -> None:
    first, second = frames(tmp_path, [Scan(0.0, 0.0), Odom(0.01, 0.01, speed=1.0), Scan(0.1, 0.1)])
    assert (first.speed, first.speed_age) == (None, np.inf)
    assert second.speed == 1.0


def test_stale_odometry_does_not_know_the_speed_any_more(tmp_path: Path) -> None:
    items: list[Recorded] = [Odom(0.0, 0.0, speed=1.0, yaw_rate=0.5), Scan(0.5, 0.5), Scan(0.625, 0.625)]
    fresh, stale = frames(tmp_path, items)
    assert motions([fresh, stale]) == [(1.0, 0.5, 0.5), (None, 0.0, 0.625)]
    assert [frame.speed for frame in open_log(tmp_path / "log.bag", max_speed_age=1.0)] == [1.0, 1.0]


def test_a_given_speed_holds_whatever_the_odometry_says(tmp_path: Path) -> None:
    (frame,) = frames(tmp_path, [Odom(0.0, 0.0, speed=1.0, yaw_rate=0.5), Scan(0.1, 0.1)], speed=-2.0)
    assert (frame.speed, frame.yaw_rate, frame.speed_age) == (-2.0, 0.5, 0.0)
    assert open_scans(tmp_path / "log.bag", speed=-2.0).motion == "speed as given"


def test_without_odometry_the_speed_is_unknown(tmp_path: Path) -> None:
    (frame,) = frames(tmp_path, [Scan(0.0, 0.0)])
    assert (frame.speed, frame.yaw_rate, frame.speed_age) == (None, 0.0, np.inf)
    assert open_scans(tmp_path / "log.bag").motion == "no odometry: the speed is unknown"


def test_where_nobody_filled_in_the_twist_the_poses_tell(tmp_path: Path) -> None:
    poses = [(0.0, 0.0), (0.2, 0.1), (0.1, 0.1), (0.1, 0.1)]  # forward while turning, back, at rest; heading left
    items: list[Recorded] = []
    for i, (way, turn) in enumerate(poses):
        items += [Odom(i / 4, i / 4, y=way, yaw=np.pi / 2 + turn), Scan(i / 4, i / 4)]
    read = frames(tmp_path, items)
    assert [frame.speed for frame in read] == pytest.approx([0.0, 0.8 * np.cos(0.05), -0.4 * np.cos(0.1), 0.0])
    assert [frame.yaw_rate for frame in read] == pytest.approx([0.0, 0.4, 0.0, 0.0])


@pytest.mark.parametrize(("speed", "why"), [(np.nan, "is not finite"), (1e9, "is too fast, no motion of a vehicle")])
def test_odometry_of_no_vehicle_is_told_and_left_out(speed: float, why: str, tmp_path: Path) -> None:
    path = write(tmp_path, "bag", [Odom(0.0, 0.0, speed=1.0), Odom(0.05, 0.05, speed=speed), Scan(0.1, 0.1)])
    read = iter(open_scans(path))
    assert next(read).speed == 1.0
    with pytest.raises(LogError, match=rf"odometry at -0\.050 s {why}\. The 1 frames that could be read"):
        next(read)


# Stamps


@pytest.mark.parametrize("kind", ["bag", "db3", "mcap"])
def test_without_stamps_the_times_of_recording_hold(kind: str, tmp_path: Path) -> None:
    items: list[Recorded] = [Odom(None, 3.0, speed=1.0), Scan(None, 3.125), Scan(None, 3.25)]
    log = open_scans(write(tmp_path, kind, items))
    assert log.clock == "times of recording, as the messages have no stamps"
    assert [frame.stamp for frame in log] == [0.0, 0.125]
    assert motions(list(log)) == [(1.0, 0.0, 0.125), (1.0, 0.0, 0.25)]


@pytest.mark.parametrize("kind", KINDS)
def test_frames_come_in_the_order_in_which_they_were_recorded(kind: str, tmp_path: Path) -> None:
    log = open_scans(write(tmp_path, kind, [Scan(0.0, 0.0), Scan(0.2, 0.2), Scan(0.1, 0.1)]))
    assert [frame.stamp for frame in log] == pytest.approx([0.0, 0.2, 0.1])


def test_stamps_are_told_as_they_are_even_backwards(tmp_path: Path) -> None:
    read = frames(tmp_path, [Scan(1.0, 1.0), Scan(0.5, 1.1), Scan(1.2, 1.2)])
    assert [frame.stamp for frame in read] == pytest.approx([0.0, -0.5, 0.2])


def test_a_bag_that_was_not_written_in_order_is_told(tmp_path: Path) -> None:
    odometry: list[Recorded] = [Odom(i / 10, i / 10, speed=1.0) for i in range(100)]
    read = iter(open_scans(write(tmp_path, "bag", [*odometry, *(Scan(i / 10, i / 10) for i in range(100))])))
    stamps = [next(read).stamp for _ in range(100)]
    assert stamps == pytest.approx([i / 10 for i in range(100)])
    with pytest.raises(LogError, match=r"not in the order of time, .*recorded 9\.9 s before .*; rosbags-convert --src"):
        next(read)


# Topics


def two_scanners() -> list[Recorded]:
    return [Scan(0.0, 0.0, topic="/front"), Scan(0.1, 0.1, np.ones(5, np.float32), topic="/rear"), Cloud(0.2, 0.2)]


def test_several_topics_are_listed_and_one_is_chosen_by_name(tmp_path: Path) -> None:
    path = write(tmp_path, "bag", two_scanners())
    said = r"log\.bag: has several topics to choose from, /front .*/rear .*/points .*; choose one with the option topic"
    with pytest.raises(LogError, match=said):
        open_log(path)
    assert open_scans(path, topic="/rear").scanner.beams == 5
    assert open_scans(path, topic="front").scanner.beams == 19
    assert isinstance(open_log(path, topic="/points"), CloudLog)


def test_a_topic_that_is_not_there(tmp_path: Path) -> None:
    path = write(tmp_path, "mcap", two_scanners())
    with pytest.raises(
        LogError, match=r"has no topic /left of .*; it has /front, /rear, /points: choose with the option topic"
    ):
        open_log(path, topic="/left")


def test_several_odometries_matter_only_without_a_speed(tmp_path: Path) -> None:
    items: list[Recorded] = [Odom(0.0, 0.0, speed=1.0), Odom(0.0, 0.0, speed=2.0, topic="/other"), Scan(0.1, 0.1)]
    path = write(tmp_path, "db3", items)
    with pytest.raises(
        LogError, match=r"several topics to choose from, /odom .*/other .*choose one with the option odometry_topic"
    ):
        open_log(path)
    assert [frame.speed for frame in open_scans(path, odometry_topic="/other")] == [2.0]
    assert [frame.speed for frame in open_scans(path, speed=3.0)] == [3.0]


@pytest.mark.parametrize("kind", ["bag", "db3", "mcap"])
def test_a_bag_without_scans_or_clouds(kind: str, tmp_path: Path) -> None:
    path = write(tmp_path, kind, [Odom(0.0, 0.0)])
    with pytest.raises(LogError, match=r"has no topic of .*; it has /odom \(nav_msgs/Odometry\)"):
        open_log(path)


@pytest.mark.parametrize("kind", ["bag", "db3", "mcap"])
def test_an_empty_bag(kind: str, tmp_path: Path) -> None:
    path = write(tmp_path, kind, [])
    with pytest.raises(LogError, match=r"has no topic of .*; it has no topics that can be read"):
        open_log(path)


def test_a_scan_whose_angles_contradict_each_other_is_told_and_left_out(tmp_path: Path) -> None:
    path = write(tmp_path, "bag", [Scan(0.0, 0.0), Scan(0.1, 0.1, angle_min=-1.0), Scan(0.2, 0.2)])
    read = iter(open_scans(path))
    assert [next(read).stamp, next(read).stamp] == pytest.approx([0.0, 0.2])
    with pytest.raises(
        LogError, match=r"scan at 0\.100 s has 19 readings that end at 2 rad, and angle_max 1\.5 rad: nobody knows"
    ):
        next(read)


# Options


def test_what_the_user_says_of_the_scanner(tmp_path: Path) -> None:
    said: dict[str, Any] = {"range_min": 0.5, "mount": (0.2, 0.0, 0.1), "outline": (-0.1, 0.4, -0.2, 0.2)}
    scanner = open_scans(write(tmp_path, "bag", drive(1)), **said).scanner
    assert (scanner.range_min, scanner.range_max) == (0.5, 30.0)
    assert (scanner.mount, scanner.outline) == (said["mount"], said["outline"])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (
            {"sensor_height": 1.0},
            "a log of sensor_msgs/LaserScan has no use for the option sensor_height; leave it out",
        ),
        ({"rate": 10.0}, "has no use for the option rate; leave it out .it knows topic, "),
    ],
)
def test_an_option_for_another_kind_is_refused(options: dict[str, float], said: str, tmp_path: Path) -> None:
    path = write(tmp_path, "bag", drive(1))
    with pytest.raises(LogError, match=said):
        open_log(path, **options)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"speed": np.nan}, "speed must be finite"),
        ({"rate": 0.0}, "rate must be finite and at least 0.001 Hz"),
        ({"max_speed_age": -1.0}, "max_speed_age must be a number of at least 0 s, inf included, got -1.0"),
    ],
)
def test_an_option_that_makes_no_sense(options: dict[str, float], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        open_log("nowhere.bag", **options)


def test_an_unknown_option() -> None:
    with pytest.raises(TypeError, match="topics"):
        open_log("nowhere.bag", topics="/scan")


# Clouds


@pytest.mark.parametrize("kind", KINDS)
def test_clouds_come_as_they_were_recorded(kind: str, tmp_path: Path) -> None:
    odom = Odom(0.0, 0.0, speed=2.0)
    items: list[Recorded] = [odom, Cloud(0.1, 0.1, POINTS), Cloud(0.2, 0.2, POINTS[:0]), Cloud(0.3, 0.3, POINTS)]
    log = open_clouds(write(tmp_path, kind, items), sensor_height=1.5)
    first, empty, last = log
    assert [first.stamp, first.speed, last.stamp] == pytest.approx([0.0, 2.0, 0.2])
    assert len(empty.points) == 0
    for name in POINTS.dtype.names or ():
        np.testing.assert_array_equal(first.points[name], POINTS[name])
    assert robust_min_x(last.points, estimator=Minimum()).x == 8.0
    assert log.lidar.sensor_height == 1.5


def test_clouds_of_either_byte_order(tmp_path: Path) -> None:
    big = POINTS.astype(POINTS.dtype.newbyteorder(">"))
    (frame,) = open_clouds(write(tmp_path, "db3", [Cloud(0.0, 0.0, big)]))
    assert robust_min_x(frame.points, estimator=Minimum()).x == 8.0
    np.testing.assert_array_equal(frame.points["time"], POINTS["time"])


@pytest.mark.parametrize("kind", ["bag", "mcap"])
@pytest.mark.parametrize(
    ("odd", "said"),
    [
        (
            {"header": {"row_step": 0}},
            "row_step, 2 times: msg.row_step is 0; rows are read as width x point_step, 44 bytes",
        ),
        ({"counts": {"x": 0}}, "count, 2 times: msg.fields 'x' has count 0; it is read as 1"),
        ({"names": {"ring": ""}}, "fields, 2 times: msg.fields '' has no name; it is ignored"),
        ({"names": {"ring": "_", "time": "_"}}, "fields, 2 times: msg.fields '_' is declared twice, in two places;"),
        (
            {"names": {"ring": "intensity"}, "counts": {"ring": 2}},
            "intensity, 2 times: msg.fields 'intensity' has 2 numbers",
        ),
    ],
)
def test_odd_clouds_are_read_and_said(kind: str, odd: dict[str, Any], said: str, tmp_path: Path) -> None:
    items = [Cloud(0.0, 0.0, POINTS), Cloud(0.1, 0.1, POINTS, **odd), Cloud(0.2, 0.2, POINTS, **odd)]
    log: Any = open_clouds(write(tmp_path, kind, items))
    for _ in range(2):
        assert [robust_min_x(frame.points, estimator=Minimum()).x for frame in log] == [8.0] * 3
        (sentence,) = log.odd.sentences()
        assert sentence.startswith(f"/points, {said}")


@pytest.mark.parametrize("dtype", DATATYPES)
def test_intensities_of_every_type_in_a_bag(dtype: str, tmp_path: Path) -> None:
    described = [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", f"<{dtype}")]
    points = np.array([(9.0, 1.0, -1.0, 100), (8.0, 0.5, -1.0, 3)], described)
    log: Any = open_clouds(write(tmp_path, "bag", [Cloud(0.0, 0.0, points)]))
    (frame,) = log
    assert robust_min_x(frame.points, gate=Gate(intensity=(50, 200)), estimator=Minimum()).x == 9.0
    assert log.odd.sentences() == []


def test_a_cloud_without_coordinates_is_told_and_left_out(tmp_path: Path) -> None:
    items = [Cloud(0.0, 0.0, POINTS), Cloud(0.1, 0.1, POINTS[["ring"]]), Cloud(0.2, 0.2, POINTS)]
    read = iter(open_clouds(write(tmp_path, "bag", items)))
    assert [next(read).stamp, next(read).stamp] == pytest.approx([0.0, 0.2])
    with pytest.raises(LogError, match=r"the cloud at 0\.100 s: msg\.fields must have x, y and z"):
        next(read)


@pytest.mark.parametrize("name", ["vlp16_xyzirt22_pointcloud2", "ouster_os1_32_pointcloud2"])
@pytest.mark.parametrize("kind", KINDS)
def test_recorded_clouds_through_a_bag(name: str, kind: str, data: Path, tmp_path: Path) -> None:
    described = json.loads((data / "clouds" / f"{name}.json").read_text())
    content = gzip.decompress((data / "clouds" / f"{name}.bin.gz").read_bytes())
    formats = {7: "<f4", 8: "<f8", 2: "<u1", 4: "<u2", 6: "<u4", 5: "<i4"}
    fields = described["fields"]
    dtype = np.dtype(
        {
            "names": [field["name"] for field in fields],
            "formats": [formats[field["datatype"]] for field in fields],
            "offsets": [field["offset"] for field in fields],
            "itemsize": described["point_step"],
        }
    )
    points = np.frombuffer(content, dtype).reshape(described["height"], -1)
    points = points[0] if len(points) == 1 else points
    (frame,) = open_clouds(write(tmp_path, kind, [Cloud(0.0, 0.0, points)]))
    gate = Gate(z=(-1.0, 2.0))
    through, direct = robust_min_x(frame.points, gate=gate), robust_min_x(points, gate=gate)
    assert (through.x, through.index, through.candidates) == (direct.x, direct.index, direct.candidates)
    assert direct.candidates > 10
    assert frame.points.dtype.itemsize == described["point_step"]


# Folders, and bags that nobody closed


def test_a_folder_needs_no_metadata(tmp_path: Path) -> None:
    folder = write(tmp_path, "mcap", drive(10)).parent
    assert len(list(open_scans(folder))) == 10
    (folder / "metadata.yaml").unlink()
    assert open_scans(folder).frame_count == 10


def test_the_files_of_a_folder_come_in_order(tmp_path: Path) -> None:
    items = drive(24)
    folder = tmp_path / "split"
    folder.mkdir()
    for part in range(12):  # part 10 after part 9
        (tmp_path / str(part)).mkdir()
        path = write(tmp_path / str(part), "db3", items[4 * part : 4 * part + 4])
        path.rename(folder / f"split_{part}.db3")
    np.testing.assert_array_equal([frame.ranges for frame in open_scans(folder)], scans_of(items))


def test_a_folder_of_compressed_files_says_how_to_unpack_them(tmp_path: Path) -> None:
    (tmp_path / "log_0.db3.zstd").touch()
    with pytest.raises(LogError, match=r"unpack its files first: zstd -d log_0\.db3\.zstd"):
        open_log(tmp_path)


def test_damage_names_the_file_of_a_folder(tmp_path: Path) -> None:
    path = write(tmp_path, "mcap", drive(10))
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(LogError, match=r"log: log\.mcap: damaged or cut short at byte"):
        list(open_scans(path.parent))


def test_a_bag_that_nobody_closed_is_read_all_the_same(tmp_path: Path) -> None:
    items = drive(40)
    path = write(tmp_path, "bag", items)
    content = bytearray(path.read_bytes())
    at = content.index(b"index_pos=") + len(b"index_pos=")
    index = int.from_bytes(content[at : at + 8], "little")
    content[at : at + 8] = bytes(8)
    path.unlink()
    path = tmp_path / "log.bag.active"
    path.write_bytes(content[:index])
    log = open_scans(path)
    assert log.frame_count is None
    np.testing.assert_array_equal([frame.ranges for frame in log], scans_of(items))


def test_a_bag_without_the_package_says_how_to_get_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path, "mcap", drive(1))
    monkeypatch.setitem(sys.modules, "mcap.records", None)
    with pytest.raises(LogError, match=r"needs mcap to be read, which is not installed: pip install '\.\[log\]'"):
        open_log(path)


@pytest.mark.parametrize("compression", ["bag.lz4", "db3.zstd"])
def test_a_decompressor_that_is_missing(compression: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path, compression, drive(1))
    for name in ("lz4.frame", "zstandard"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(LogError, match=r"needs \w+ to be read, which is not installed"):
        list(open_scans(path))


@pytest.mark.parametrize("name", ["log.bag", "log.mcap", "log.db3"])
@pytest.mark.parametrize("content", [b"", b"#ROSBAG V1.2\n", bytes(4096)])
def test_what_is_no_bag_at_all(name: str, content: bytes, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(LogError, match=rf"{name}: is (no |empty)"):
        open_log(tmp_path / name)


def test_a_database_of_something_else(tmp_path: Path) -> None:
    with sqlite3.connect(tmp_path / "log.db3") as database:
        database.execute("CREATE TABLE cooks (id INTEGER)")
    database.close()
    with pytest.raises(
        LogError, match="is no rosbag2 database, or is damaged: its topics cannot be read; copy it again"
    ):
        open_log(tmp_path / "log.db3")


def test_the_recorded_bag(data: Path) -> None:
    log = open_scans(data / "laserscan" / "leg_tracker_positive_2.bag")
    assert (log.frame_count, log.scanner.beams, log.scanner.range_max) == (243, 768, 11.0)
    read = list(log)
    assert len(read) == 243
    assert 1 / 7.6 < np.diff([frame.stamp for frame in read]).mean() < 1 / 7.4
    kernel = ScanTTC(**vars(log.scanner))
    nearest = kernel.nearest(read[0].ranges, 1.0)
    assert nearest.counts.valid > 500
