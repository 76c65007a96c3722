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
from ttc_fast.logs.motion import Pose, between

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
    assert (second.speed, second.yaw_rate) == between(Pose(0.0, 0.0, 0.0), Pose(0.5, 0.0, 0.1), 1.0)
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
    assert first[2:] == (2.0, 0.0, 0.125)
    assert second[2:] == (-1.0, 0.0, 0.125)
    assert [frame.speed for frame in open_scans(tmp_path / "robot.log", speed=3.0)] == [3.0, 3.0]


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("FLASER 5 1 2 3\n", "line 2 is damaged: FLASER with 5 beams must have 16 words, got 5"),
        (flaser(1.0).replace("81.91", "far"), "line 2 is damaged: could not convert string"),
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
    with pytest.raises(LogError, match=r"build\.log: has no FLASER lines: it is no CARMEN log, or one without scans"):
        open_log(tmp_path / "build.log")


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
    assert (log.column, log.clock, log.frame_count) == ("distance", "column stamp", None)


def test_columns_and_rate_are_chosen(tmp_path: Path) -> None:
    (tmp_path / "gap.csv").write_text("t,gap,other\n5,10,1\n6,9,2\n")
    chosen = {"column": "gap", "speed": 3.0}
    assert list(distances(tmp_path / "gap.csv", stamp_column="t", **chosen)) == [(5.0, 10.0, 3.0), (6.0, 9.0, 3.0)]
    assert list(distances(tmp_path / "gap.csv", rate=10.0, **chosen)) == [(0.0, 10.0, 3.0), (0.1, 9.0, 3.0)]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "has no column 'distance'; its first line has no names: choose with the option column"),
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


def test_the_recorded_distances(data: Path) -> None:
    read = list(distances(data / "kitti" / "corridor_distances.csv", column="min", rate=10.0))
    assert (len(read), read[0].distance, read[1].distance) == (20, 7.974, 7.913)
