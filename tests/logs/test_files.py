"""Logs that are files of clouds, CARMEN logs, and tables of distances."""

import gzip
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.opened import open_clouds, open_scans
from ttc_fast import Gate, Minimum, ScanTTC, robust_min_x
from ttc_fast.logs import DistanceLog, LogError, forward_left_up, open_log
from ttc_fast.sensors.odometry import Pose, between

NUSCENES = np.array([[1.0, 9.0, -1.0, 50.0, 3.0], [-1.0, 8.0, -1.0, 60.0, 4.0]], "<f4")  # x right, y forward


def distances(path: Path, **options: Any) -> DistanceLog:
    log = open_log(path, **options)
    assert isinstance(log, DistanceLog)
    return log


# nuScenes


def test_nuscenes_looks_along_y(tmp_path: Path) -> None:
    path = tmp_path / "sweep.pcd.bin"
    path.write_bytes(NUSCENES.tobytes())
    log = open_clouds(path)
    (frame,) = log
    np.testing.assert_array_equal(frame.points, NUSCENES)
    assert log.lidar.axes == ("y", "-x", "z")
    assert robust_min_x(frame.points, gate=Gate(axes=log.lidar.axes), estimator=Minimum()).x == 8.0
    np.testing.assert_array_equal(
        forward_left_up(frame.points, log.lidar.axes), [[9.0, -1.0, -1.0, 50.0], [8.0, 1.0, -1.0, 60.0]]
    )


def test_stamps_of_nuscenes_are_in_the_names(tmp_path: Path) -> None:
    for stamp in (1532402927647951, 1532402927697951):
        (tmp_path / f"n015-2018-07-24__LIDAR_TOP__{stamp}.pcd.bin").write_bytes(NUSCENES.tobytes())
    log = open_clouds(tmp_path)
    assert [frame.stamp for frame in log] == pytest.approx([0.0, 0.05], abs=1e-6)
    assert log.clock == "stamps in the names"
    assert [frame.stamp for frame in open_clouds(tmp_path, rate=2.0)] == [0.0, 0.5]


def test_a_frame_of_another_width_is_told(tmp_path: Path) -> None:
    path = tmp_path / "sweep.pcd.bin"
    path.write_bytes(NUSCENES.tobytes()[:-4])
    with pytest.raises(LogError, match=r"36 bytes, not whole rows of 20 bytes \(float32 x, y, z, intensity, ring\)"):
        list(open_clouds(path))


def test_the_recorded_frame_of_nuscenes(data: Path) -> None:
    log = open_clouds(data / "clouds" / "nuscenes_lidar_top.pcd.bin")
    (frame,) = log
    assert frame.points.shape == (34688, 5)
    gate = Gate.above_road(1.84, 0.3, 2.0, x=(log.lidar.own_reach, math.inf), axes=log.lidar.axes)
    assert 10.0 < robust_min_x(frame.points, gate=gate).x < 15.0


# CARMEN


def flaser(stamp: float, x: float = 0.0, yaw: float = 0.0, ranges: str = "1 2 81.91 4 5") -> str:
    return f"FLASER {len(ranges.split())} {ranges} {x} 0 {yaw} 0 0 0 {stamp} host {stamp}\n"


def odom(stamp: float, x: float) -> str:
    return f"ODOM {x} 0 0 0 0 0 {stamp} host {stamp}\n"


@pytest.mark.parametrize("name", ["robot.log", "robot.log.gz"])
def test_carmen_scans_go_from_right_to_left(name: str, tmp_path: Path) -> None:
    text = ("# comment\nPARAM x 1\n" + flaser(100.0) + flaser(101.0, x=0.5, yaw=0.1)).encode()
    (tmp_path / name).write_bytes(gzip.compress(text) if name.endswith(".gz") else text)
    log = open_scans(tmp_path / name)
    assert (log.scanner.angle_min, log.scanner.angle_increment) == (-math.pi / 2, math.pi / 4)
    assert (log.scanner.range_min, log.scanner.range_max) == (0.0, 49.9)
    first, second = log
    assert (first.stamp, first.speed, second.stamp) == (0.0, None, 1.0)
    assert (second.speed, second.yaw_rate) == between(Pose(0.0, 0.0, 0.0), Pose(0.5, 0.0, 0.1), 1.0)[:2]
    np.testing.assert_array_equal(first.ranges, np.array([1, 2, 81.91, 4, 5], np.float32))
    counts = ScanTTC(**vars(log.scanner)).nearest(first.ranges, 1.0).counts
    assert (counts.valid, counts.out_of_range) == (4, 1)


@pytest.mark.parametrize(("beams", "increment"), [(180, 1.0), (181, 1.0), (360, 0.5), (361, 0.5)])
def test_the_angles_of_carmen(beams: int, increment: float, tmp_path: Path) -> None:
    (tmp_path / "robot.log").write_text(flaser(0.0, ranges=" ".join(["1"] * beams)))
    assert open_scans(tmp_path / "robot.log").scanner.angle_increment == pytest.approx(math.radians(increment))


def test_odometry_of_carmen_goes_before_the_poses_of_its_scans(tmp_path: Path) -> None:
    text = odom(0.0, 0.0) + odom(0.25, 0.5) + flaser(0.375, x=9.0) + odom(0.5, 0.25) + flaser(0.625, x=99.0)
    (tmp_path / "robot.log").write_text(text)
    first, second = open_scans(tmp_path / "robot.log")
    assert first[2:5] == (2.0, 0.0, 0.125)
    assert second[2:5] == (-1.0, 0.0, 0.125)
    assert [frame.speed for frame in open_scans(tmp_path / "robot.log", speed=3.0)] == [3.0, 3.0]


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("FLASER 5 1 2 3\n", "line 2 is damaged: FLASER with 5 beams must have 16 words, got 5"),
        (flaser(1.0).replace("81.91", "far"), "line 2 is damaged: FLASER with a word that is no number"),
        (flaser(1.0, ranges="1 2 3"), r"the scan at 1\.000 s has 3 beams, not 5"),
        (flaser(math.nan), "line 2 is damaged: FLASER with the stamp nan"),
        ("ODOM 1 2\n", "line 2 is damaged"),
    ],
)
def test_a_damaged_line_is_told_and_left_out(line: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "robot.log").write_text(flaser(0.0) + line + flaser(2.0))
    frames = iter(open_scans(tmp_path / "robot.log"))
    assert [next(frames).stamp, next(frames).stamp] == [0.0, 2.0]
    with pytest.raises(LogError, match=rf"robot\.log: {said}"):
        next(frames)


def test_a_text_without_scans(tmp_path: Path) -> None:
    (tmp_path / "build.log").write_text("all went well\n")
    with pytest.raises(
        LogError, match=r"build\.log: has no ROBOTLASER1 or FLASER .*lines: it is no CARMEN log, or one wi"
    ):
        open_log(tmp_path / "build.log")


# CARMEN since 2006


def robot_laser(
    word: str,
    i: int,
    *,
    remissions: str = " 0",
    angles: str = "-1.5 3.0 0.75 30.0",
    beams: int = 5,
    place: float = 0.25,
) -> str:
    """A scan of a robot that drives at 2 m/s along y; the laser sits ahead of its middle, turned by a right angle."""
    y, ranges = 0.5 * i, " ".join(str(float(k)) for k in range(1, beams + 1))
    poses = f" 3 {y + place} 3.1415927 3 {y} 1.5707963 2.0 0 0.2 0.2 0" if word.startswith("ROBOT") else ""
    return f"{word} 0 {angles} 0.01 0 {beams} {ranges}{remissions}{poses} {100 + i / 4} host {i / 4}\n"


@pytest.mark.parametrize("remissions", [" 0", " 2 7.5 8.5", ""])
@pytest.mark.parametrize("word", ["ROBOTLASER1", "RAWLASER1"])
def test_carmen_lines_that_say_their_angles(word: str, remissions: str, tmp_path: Path) -> None:
    text = "# CARMEN Logfile\n" + "".join(robot_laser(word, i, remissions=remissions) for i in range(8))
    (tmp_path / "robot.log").write_text(text)
    log = open_scans(tmp_path / "robot.log")
    assert (log.scanner.angle_min, log.scanner.angle_increment, log.scanner.beams) == (-1.5, 0.75, 5)
    assert [log.scanner.range_min, log.scanner.range_max] == pytest.approx([0.0, 30.0])
    assert log.scanner.range_max < 30.0  # at which nothing came back
    assert log.assumed == ""
    read = list(log)
    assert [frame.stamp for frame in read] == [i / 4 for i in range(8)]
    np.testing.assert_array_equal(read[7].ranges, np.arange(1, 6, dtype=np.float32))
    robot = word == "ROBOTLASER1"
    assert log.scanner.mount == (pytest.approx((0.25, 0.0, math.pi / 2), abs=1e-6) if robot else (0.0, 0.0, 0.0))
    assert [frame.speed for frame in read[1:]] == ([pytest.approx(2.0)] * 7 if robot else [None] * 7)


def test_odometry_goes_with_lasers_that_say_no_pose(tmp_path: Path) -> None:
    lines = [odom(100 + i / 4, i / 4) + robot_laser("RAWLASER1", i) for i in range(8)]
    (tmp_path / "robot.clf").write_text("".join(lines))
    assert [frame.speed for frame in open_scans(tmp_path / "robot.clf")][1:] == [1.0] * 7


def test_a_log_that_has_each_scan_twice_gives_it_once(tmp_path: Path) -> None:
    lines = [robot_laser("RAWLASER1", i) + robot_laser("ROBOTLASER1", i) for i in range(8)]
    (tmp_path / "robot.log").write_text("".join(lines))
    log = open_scans(tmp_path / "robot.log")
    assert (len(list(log)), log.assumed) == (8, "")
    assert log.scanner.mount[0] == pytest.approx(0.25)


@pytest.mark.parametrize(("front", "rear"), [("ROBOTLASER1", "ROBOTLASER2"), ("FLASER", "RLASER")])
def test_one_of_two_lasers_is_read(front: str, rear: str, tmp_path: Path) -> None:
    def line(word: str, i: int) -> str:
        if word.startswith("ROBOT"):
            return robot_laser(word, i, place=0.25 if word == front else -0.5)
        return flaser(i / 4, ranges="1 2 3 4 5" if word == front else "5 6 7").replace("FLASER", word)

    (tmp_path / "robot.log").write_text("".join(line(rear, i) + line(front, i) for i in range(8)))
    log = open_scans(tmp_path / "robot.log")
    assert (len(list(log)), log.scanner.beams) == (8, 5)
    assert f"the front laser, {front}; the log has {rear} too, choose with the option topic" in log.assumed
    chosen = open_scans(tmp_path / "robot.log", topic=rear)
    assert len(list(chosen)) == 8
    x, _, yaw = chosen.scanner.mount
    assert [x, yaw] == pytest.approx([-0.5, math.pi / 2] if front == "ROBOTLASER1" else [0.0, math.pi])
    with pytest.raises(LogError, match=rf"has no laser LASER9; it has {front}, {rear}: choose with the option topic"):
        open_log(tmp_path / "robot.log", topic="LASER9")


def test_old_lines_do_not_say_their_angles_and_the_log_does(tmp_path: Path) -> None:
    (tmp_path / "robot.log").write_text(flaser(0.0) + flaser(1.0))
    assert open_scans(tmp_path / "robot.log").assumed == "beams over half a turn, up to 49.9 m"


def test_error_codes_of_sick_are_no_readings(tmp_path: Path) -> None:
    (tmp_path / "robot.log").write_text(robot_laser("ROBOTLASER1", 0, angles="-1.5 3.0 0.75 81.92"))
    assert open_scans(tmp_path / "robot.log").scanner.range_max < 81.83


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("ROBOTLASER1 0 -1.5 3\n", "line 2 is damaged: ROBOTLASER1 with 4 words"),
        (robot_laser("ROBOTLASER1", 1)[:40] + "\n", "line 2 is damaged: ROBOTLASER1 with"),
        (robot_laser("ROBOTLASER1", 1, remissions=" 3 1"), "line 2 is damaged: ROBOTLASER1 with 5 beams must have"),
        (
            robot_laser("ROBOTLASER1", 1, angles="nan 3.0 0.75 30"),
            "line 2 is damaged: ROBOTLASER1 with angles or poses",
        ),
        (robot_laser("ROBOTLASER1", 1, angles="-1.5 3.0 far 30"), "line 2 is damaged: ROBOTLASER1 with a word that is"),
        (robot_laser("ROBOTLASER1", 1, beams=9), r"the scan at 0\.250 s has 9 beams, not 5"),
        (
            robot_laser("ROBOTLASER1", 1, angles="-1.4 3.0 0.75 30"),
            r"the scan at 0\.250 s has other angles than the fi",
        ),
    ],
)
def test_a_damaged_line_of_a_robot_is_reported_and_left_out(line: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "robot.log").write_text(robot_laser("ROBOTLASER1", 0) + line + robot_laser("ROBOTLASER1", 2))
    frames = iter(open_scans(tmp_path / "robot.log"))
    assert [next(frames).stamp, next(frames).stamp] == [0.0, 0.5]
    with pytest.raises(LogError, match=rf"robot\.log: {said}"):
        next(frames)


def test_a_carmen_log_without_scans_says_which_lines_it_has(tmp_path: Path) -> None:
    (tmp_path / "robot.log").write_text("PARAM robot_width 0.5\nSYNC a\n" + odom(0.0, 0.0))
    said = r"has no ROBOTLASER1 or FLASER or RAWLASER1 lines: .*; its lines begin with PARAM, SYNC, ODOM"
    with pytest.raises(LogError, match=said):
        open_log(tmp_path / "robot.log")


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-8-sig", "cp1252"])
def test_a_carmen_log_in_any_encoding(encoding: str, tmp_path: Path) -> None:
    text = "PARAM who J\u00fcrgen\n" + robot_laser("ROBOTLASER1", 0) + robot_laser("ROBOTLASER1", 1)
    (tmp_path / "robot.log").write_bytes(text.encode(encoding))
    assert len(list(open_scans(tmp_path / "robot.log"))) == 2


@pytest.mark.parametrize(("name", "count", "beams"), [("freiburg-101", 292, 360), ("acapulco", 861, 181)])
def test_the_recorded_carmen_logs(name: str, count: int, beams: int, data: Path) -> None:
    log = open_scans(data / "laserscan" / f"{name}-corrected.log.gz")
    read = list(log)
    assert (len(read), log.scanner.beams) == (count, beams)
    assert (np.diff([frame.stamp for frame in read]) > 0).all()
    speeds = np.array([frame.speed for frame in read[1:] if frame.speed is not None])
    assert len(speeds) > 0.9 * count
    assert 0.1 < np.median(speeds) < 1.0
    assert np.abs(speeds).max() < 3.0
    kernel = ScanTTC(**vars(log.scanner))
    assert all(kernel.nearest(frame.ranges, 1.0).counts.valid > 0 for frame in read)


# Distances


def test_a_table_of_distances(tmp_path: Path) -> None:
    (tmp_path / "gap.csv").write_text("stamp, distance\n0.0, 10\n0.1,\n\n0.2,9.5\n")
    log = distances(tmp_path / "gap.csv")
    first, empty, last = log
    assert first == (0.0, 10.0, None)
    assert math.isnan(empty.distance)
    assert last == (0.2, 9.5, None)
    assert (log.column, log.clock, log.frame_count) == ("distance", "column stamp, in s", None)


def test_columns_and_rate_are_chosen(tmp_path: Path) -> None:
    (tmp_path / "gap.csv").write_text("t,gap,other\n5,10,1\n6,9,2\n")
    chosen = {"column": "gap", "speed": 3.0}
    assert list(distances(tmp_path / "gap.csv", stamp_column="t", **chosen)) == [(5.0, 10.0, 3.0), (6.0, 9.0, 3.0)]
    assert list(distances(tmp_path / "gap.csv", rate=10.0, **chosen)) == [(0.0, 10.0, 3.0), (0.1, 9.0, 3.0)]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is empty: nothing was recorded, or copied"),
        (
            "t,distance\n1,2\n",
            "has no column 'stamp'; its first line has t, distance: choose with the option stamp_column, or say",
        ),
    ],
)
def test_a_table_without_the_column(text: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "gap.csv").write_text(text)
    with pytest.raises(LogError, match=said):
        open_log(tmp_path / "gap.csv")


@pytest.mark.parametrize("line", ["1,far", "1", "0,3", "nan,3", "inf,3", ",3"])
def test_a_damaged_line_of_a_table_is_told_and_left_out(line: str, tmp_path: Path) -> None:
    (tmp_path / "gap.csv").write_text(f"stamp,distance\n0,5\n{line}\n2,4\n")
    frames = iter(distances(tmp_path / "gap.csv"))
    assert [next(frames).stamp, next(frames).stamp] == [0.0, 2.0]
    with pytest.raises(LogError, match=r"gap\.csv: line 3: .*The 2 frames that could be read were given"):
        next(frames)


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-8", "utf-8-sig", "cp1252"])
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_a_table_in_any_encoding(encoding: str, newline: str, tmp_path: Path) -> None:
    text = newline.join(["stamp,L\u00fccke", "0.0,10", "0.1,9.5"])
    (tmp_path / "gap.csv").write_bytes(text.encode(encoding))
    assert list(distances(tmp_path / "gap.csv", column="L\u00fccke")) == [(0.0, 10.0, None), (0.1, 9.5, None)]


@pytest.mark.parametrize(
    "text",
    [
        "stamp;distance\n0,0;10,5\n0,1;9,5\n",
        "stamp\tdistance\n0.0\t10.5\n0.1\t9.5\n",
        "stamp\tdistance\n0,0\t10,5\n0,1\t9,5\n",
        "sep=;\nstamp;distance\n0,0;10,5\n0,1;9,5\n",
        'stamp,"distance"\n"0.0","10.5"\n"0.1","9.5"\n,,\n',
        "stamp, distance\r\n\r\n0.0, 10.5\r\n0.1, 9.5",
    ],
)
@pytest.mark.parametrize("name", ["gap.csv", "gap.tsv"])
def test_tables_as_spreadsheets_write_them(text: str, name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text)
    assert list(distances(tmp_path / name)) == [(0.0, 10.5, None), (0.1, 9.5, None)]


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("1533151603000000000", "1533151603100000000"),
        ("1533151603000", "1533151603100"),
        ("1533151603.0", "1533151603.1"),
        ("2018-08-01 19:26:43.0", "2018-08-01 19:26:43.1"),
        ("2018-08-01T19:26:43", "2018-08-01T19:26:43.100"),
    ],
)
def test_stamps_of_a_table_are_seconds_whatever_they_are_written_as(first: str, second: str, tmp_path: Path) -> None:
    (tmp_path / "gap.csv").write_text(f"stamp,distance\n{first},5\n{second},4\n")
    before, after = distances(tmp_path / "gap.csv")
    assert after.stamp - before.stamp == pytest.approx(0.1, abs=1e-6)


def test_what_is_no_table_is_reported(tmp_path: Path) -> None:
    (tmp_path / "gap.csv").write_bytes(b'stamp,distance\n0,5\n1,"' + bytes(1 << 18))
    frames = iter(distances(tmp_path / "gap.csv"))
    assert next(frames).distance == 5.0
    with pytest.raises(LogError, match=r"gap\.csv: (line|damaged after line) "):
        list(frames)


def test_the_recorded_distances(data: Path) -> None:
    read = list(distances(data / "kitti" / "corridor_distances.csv", column="min", rate=10.0))
    assert (len(read), read[0].distance, read[1].distance) == (20, 7.974, 7.913)
