"""The command over every file of the recordings: those that are logs give rows, and the others one line of why not."""

import csv
import math
from collections import Counter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from ttc_fast import Command, Status
from ttc_fast.cli import main
from ttc_fast.replay import Replay, Settings

pytestmark = pytest.mark.slow

DONE, USAGE, UNREADABLE = 0, 2, 3


class Told(NamedTuple):
    """What a log gives: rows, how many of each status, brakes."""

    frames: int
    statuses: dict[str, int]
    brakes: int = 0


COLUMN = ["--column", "min", "--rate", "10"]
FIRST = {"WARMING_UP": 1}
# A replay of clouds or distances begins with a brake: until the tracker knows a closing speed, what is ahead may close.
LOGS: dict[str, tuple[list[str], Told]] = {
    "kitti/velodyne": ([], Told(20, {"WARMING_UP": 2, "CLOSING": 18}, 1)),
    "kitti/velodyne_raw": ([], Told(2, {"WARMING_UP": 2}, 1)),
    "kitti/velodyne_raw/0000000000.bin": (["--speed", "8", "--outline", "-2", "2", "-1", "1"], Told(1, {"CLOSING": 1})),
    "kitti/corridor_distances.csv": (COLUMN, Told(20, {"WARMING_UP": 6, "CLOSING": 14}, 1)),
    "laserscan/breezyslam_exp1.npz": (["--outline", "-0.3", "0.2", "-0.2", "0.2"], Told(756, {}, 6)),
    "laserscan/freiburg-101-corrected.log.gz": (["--sensor-timeout", "30"], Told(292, {}, 0)),
    "laserscan/acapulco-corrected.log.gz": (["--sensor-timeout", "30"], Told(861, {}, 3)),
    "laserscan/leg_tracker_positive_2.bag": ([], Told(243, {}, 3)),
    "clouds/nebula_vlp16.pcd": (["--sensor-height", "1.7"], Told(1, FIRST, 1)),
    "clouds/nebula_hesai_qt64.pcd": (["--sensor-height", "1.7"], Told(1, FIRST, 1)),
    "clouds/nuscenes_lidar_top.pcd.bin": ([], Told(1, FIRST, 1)),
    "clouds/pcl_car6_binary_compressed.pcd": (["--sensor-height", "1"], Told(1, {})),
    "clouds/pcl_bun0_ascii.pcd": (["--sensor-height", "1"], Told(1, {}, 1)),
    "clouds/pcl_office1_keypoints_binary.pcd": (["--sensor-height", "1"], Told(1, {}, 1)),
}
PICTURES = [name for name in LOGS if "velodyne_raw/" not in name]
REFUSED = {
    "clouds/ouster_os1_32_pointcloud2.bin.gz": "is no KITTI frame",
    "clouds/vlp16_xyzirt22_pointcloud2.bin.gz": "cut short, or not a KITTI frame",
    "clouds/ouster_os1_32.pcap": "no reader for this kind of file",
    "clouds": "give each kind a folder of its own",
    "sim/legacy_scan.npz": "has no array t, ranges",
    "kitti/calib": "holds no frames that can be read",
    "kitti/published/ttc_lidar.csv": "has no column 'distance'",
}


@pytest.mark.parametrize("name", LOGS)
def test_a_recorded_log(name: str, data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options, expected = LOGS[name]
    out, picture = tmp_path / "rows.csv", tmp_path / "picture.png"
    plot = ["--plot", str(picture)] if name in PICTURES else []
    assert main(["replay", str(data / name), *options, "--out", str(out), *plot]) == DONE
    said = capsys.readouterr()
    assert said.err == ""
    with out.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == expected.frames
    statuses = Counter(row["status"] for row in rows)
    assert dict(statuses) == (expected.statuses or dict(statuses))
    assert set(statuses) <= set(Status.__members__)
    assert all(0.0 <= float(row["ttc"]) <= math.inf for row in rows)
    braked = [row["command"] == "BRAKE" for row in rows]
    assert sum(now and not before for before, now in zip([False, *braked], braked, strict=False)) == expected.brakes
    assert picture.exists() == bool(plot)


def test_every_other_file_is_refused_in_one_line(data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Whatever is there: either a log, or a line that says why it is none."""
    others = [path for path in sorted(data.rglob("*")) if str(path.relative_to(data)) not in LOGS]
    for path in others:
        if path.parent.name.startswith("velodyne"):
            continue  # frames of a folder that is replayed
        code = main(["replay", str(path), "--rows", "0"])
        told = capsys.readouterr()
        assert code in (DONE, USAGE, UNREADABLE), path
        if code != DONE:
            assert told.err.startswith(f"ttc-fast: {path}: "), path
            assert told.err.count("\n") == 1
        else:
            assert "0 frames" not in told.out


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_log_says_why(name: str, data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(data / name)]) == UNREADABLE
    told = capsys.readouterr()
    assert REFUSED[name] in told.err
    assert told.out == ""


def rows_of(path: Path, **settings: Any) -> list[Any]:
    return list(Replay(path, Settings(**settings)))


def test_the_recorded_drive_closes_as_the_reference_says(data: Path) -> None:
    rows = rows_of(data / "kitti" / "velodyne")
    reference = np.genfromtxt(data / "kitti" / "corridor_distances.csv", delimiter=",", names=True)
    ttc = np.array([each.ttc for each in rows])
    late = np.arange(6, 17)
    assert np.median(np.abs(ttc[late] / reference["ttc_ref"][late] - 1.0)) < 0.25
    assert {each.command for each in rows[late[0] :]} == {Command.NONE}


def test_the_plain_nearest_points_are_the_published_ones(data: Path) -> None:
    gate = {"x": (2.0, 20.0), "y": (-2.0, 2.0), "z": (-1.5, -0.9), "intensity": (0.1, math.inf)}
    rows = rows_of(data / "kitti" / "velodyne", gate=gate)
    published = np.genfromtxt(data / "kitti" / "corridor_distances.csv", delimiter=",", names=True)
    np.testing.assert_allclose([row.nearest for row in rows], published["min"], atol=6e-4)
    assert [row.valid for row in rows] == published["n_corridor"].tolist()
    strays = [row.frame for row in rows if row.nearest < row.distance - 0.1]
    assert {11, 16} <= set(strays)
