"""Recordings for Rerun: whole by Rerun's own tool, with every frame, and rows as they are without one."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.bags import drive, write
from ttc_fast.cli import main
from ttc_fast.replay import Replay, sample

rerun: Any = pytest.importorskip("rerun", reason="needs the extra rerun: pip install '.[rerun]', or make fleet")
pytestmark = pytest.mark.filterwarnings("default")  # those of Rerun


def checked(recording: Path) -> str:
    """Return what Rerun's own tool prints of a recording that it has verified."""
    tool = [sys.executable, "-m", "rerun_cli", "rrd"]
    verified = subprocess.run([*tool, "verify", str(recording)], capture_output=True, text=True, check=True)
    assert "1 file verified without error" in verified.stderr + verified.stdout
    return subprocess.run([*tool, "print", "-v", str(recording)], capture_output=True, text=True, check=True).stdout


@pytest.mark.parametrize("name", ["scans", "clouds"])
def test_a_recording_has_view_curves_and_decisions(name: str, tmp_path: Path) -> None:
    file = tmp_path / "drive.rrd"
    arguments = ["replay", str(sample(name)), "--rows", "0"]
    assert main([*arguments, "--rerun", str(file), "--out", str(tmp_path / "rows.csv")]) == 0
    said = checked(file)
    for entity in ("/vehicle/seen", "/vehicle/threats", "/vehicle/outline", "/ttc/ttc", "/speed/speed", "/decisions"):
        assert entity in said
    assert main([*arguments, "--out", str(tmp_path / "alone.csv")]) == 0
    assert (tmp_path / "rows.csv").read_bytes() == (tmp_path / "alone.csv").read_bytes()


def test_a_table_of_distances_and_a_bag_with_times_since_1970_can_be_recorded(tmp_path: Path) -> None:
    table = tmp_path / "gaps.csv"
    table.write_text("stamp,distance\n" + "".join(f"{i / 10},{20 - i / 2}\n" for i in range(20)))
    bag = write(tmp_path, "bag", drive(20, 64))
    assert main(["replay", str(table), str(bag), "--rerun", str(tmp_path / "of.rrd"), "--jobs", "1"]) == 0
    assert "/vehicle/seen" not in checked(tmp_path / "of-gaps.csv.rrd")
    assert "/vehicle/seen" in checked(tmp_path / f"of-{bag.name}.rrd")


def test_no_frames_and_stamps_that_no_recording_can_have(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table, file = tmp_path / "gaps.csv", tmp_path / "gaps.rrd"
    table.write_text("stamp,distance\n")
    assert main(["replay", str(table), "--rerun", str(file)]) == 3
    assert not file.exists()
    table.write_text("stamp,distance\n0,20\n1e15,19\n")
    assert main(["replay", str(table), "--rerun", str(file)]) == 2
    assert "frame 1 is at 1e+15 s, and a recording has times of at most 9.2e+09 s" in capsys.readouterr().err


def test_the_ways_of_the_corners_end_where_the_motion_leads() -> None:
    from ttc_fast.replay.drawing import swept

    *corners, end = swept((-1.0, 3.0, -0.5, 0.5), 2.0, np.pi / 2, 1.0)  # a quarter of a turn of radius 4 / pi
    radius = 4.0 / np.pi
    np.testing.assert_allclose(end[0, :2], [radius + 0.5, radius - 1.0], atol=1e-9)
    assert len(corners) == 4
    assert swept((-1.0, 3.0, -0.5, 0.5), 0.0, 0.0, 1.0) == []


def test_a_name_that_is_no_recording_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(sample("scans")), "--rerun", str(tmp_path / "drive.bag")]) == 2
    assert "--rerun must end in .rrd" in capsys.readouterr().err
    assert list(Replay(sample("scans")))
