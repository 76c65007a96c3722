"""The demo: the replay over what the package ships, or over a log; tables and pictures out."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pytest

from tests.support.bags import drive, write
from ttc_fast import Reason, Status
from ttc_fast.cli import main
from ttc_fast.logs import ScanLog, open_log
from ttc_fast.replay import Replay, sample
from ttc_fast.replay.picture import draw
from ttc_fast.replay.run import name_of

SCANS = sample("scans")


def rows_of(output: str) -> list[int]:
    """Read which frames are in the tables."""
    return [int(frame) for frame in re.findall(r"^ *(\d+) +\d+\.\d{3} ", output, flags=re.MULTILINE)]


def played(path: Path) -> Replay:
    log = Replay(path)
    assert list(log)
    return log


def test_the_sample_brakes_late_and_stops_in_front_of_the_box() -> None:
    rows = list(Replay(SCANS))
    least = min(
        (row for row in rows if row.status is Status.CLOSING and row.frame not in (8, 14, 42, 71)),
        key=lambda row: row.ttc,
    )
    assert 0.25 < least.ttc < 0.45
    assert rows[60].speed == pytest.approx(4.0, abs=0.1)
    assert (rows[-1].speed, rows[-1].status) == (0.0, Status.NOT_CLOSING)


def test_the_sample_of_clouds_closes_in_as_it_was_made_to() -> None:
    for row in list(Replay(sample("clouds")))[7:]:  # before, nobody knows yet that it brakes
        assert row.closing_low < 4.0 + 5.0 * row.stamp < row.closing_high
        assert row.distance == pytest.approx(14.0 - 4.0 * row.stamp - 2.5 * row.stamp**2, abs=0.06)
        assert row.closing_speed == pytest.approx(4.0 + 5.0 * row.stamp, rel=0.03)


def test_demo_replays_both_samples_and_draws_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "deep" / "er [1]"
    assert main(["demo", "--out", str(folder), "--rows", "5"]) == 0
    output = capsys.readouterr().out
    for name in ("scans", "clouds"):
        assert f"Replay: {name_of(sample(name))}." in output
        assert str(folder / f"{sample(name).stem}.png") in output
        assert matplotlib.image.imread(folder / f"{sample(name).stem}.png").std() > 0.05
    assert "frame 52, 1.734 to 4.267 s, 77 frames: CRITERION by SweptPathThreshold: 1.41 < 1.5" in output
    assert "4 frames that both neighbours contradict, such as 0.100 s in frame 71" in output
    assert "least TTC   0.336 s in frame 94" in output


def test_demo_of_a_log_of_ones_own(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write(tmp_path, "bag", drive(80))
    assert main(["demo", str(path), "--out", str(tmp_path), "--outline", "-0.1", "0.4", "-0.15", "0.15"]) == 0
    output = capsys.readouterr().out
    assert "Replay: log.bag." in output
    assert "speed       odometry of /odom" in output
    assert "from the outline, x -0.1 to 0.4 m" in output
    assert (tmp_path / "log.png").stat().st_size > 10_000


def test_demo_is_the_replay(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(SCANS)]) == 0
    replayed = capsys.readouterr().out
    assert main(["demo", str(SCANS), "--out", str(tmp_path)]) == 0
    assert replayed in capsys.readouterr().out


@pytest.mark.parametrize("rows", [1, 7, 1000])
def test_about_so_many_rows_are_printed(rows: int, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(SCANS), "--rows", str(rows)]) == 0
    frames = rows_of(capsys.readouterr().out)
    assert frames[0] == 0
    assert frames[-1] == 128
    assert len(frames) <= max(rows, 2)
    assert rows < 1000 or frames == list(range(129))


def test_no_rows(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(SCANS), "--rows", "0"]) == 0
    assert rows_of(capsys.readouterr().out) == []


def test_without_an_outline_it_says_where_distances_start(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with np.load(SCANS) as archive:
        np.savez(tmp_path / "bare.npz", **{name: archive[name] for name in archive if name != "outline"})
    assert main(["replay", str(tmp_path / "bare.npz")]) == 0
    output = capsys.readouterr().out
    assert "distance    from the scanner, so TTC is too long by (scanner to edge of the vehicle)" in output
    assert "--outline says where the vehicle ends" in output


# Pictures


def texts(log: Replay) -> str:
    figure = draw(log)
    found = [figure.get_suptitle(), figure.get_supxlabel()]
    for axes in figure.axes:
        found += [
            axes.get_title(loc="left"),
            axes.get_xlabel(),
            axes.get_ylabel(),
            *axes.get_legend_handles_labels()[1],
        ]
    return "\n".join(found)


def test_the_picture_says_when_and_why_it_braked() -> None:
    said = texts(played(SCANS))
    assert "It brakes at 1.73 s, when enough of the last frames agree: SweptPathThreshold, 1.41 < 1.5 s." in said
    for part in ("distance, m", "speed, m/s", "time to collision, s", "y, m", "begins to brake", "its path in 1.5 s"):
        assert part in said
    assert name_of(SCANS) in said


def test_the_picture_of_a_cloud_shows_the_plain_nearest_point_as_well() -> None:
    said = texts(played(sample("clouds")))
    for part in ("plain nearest point", "90 % interval", "gate", "what the tracker follows", "threshold 1.5 s"):
        assert part in said


def test_isolated_readings_are_marked_and_not_joined() -> None:
    figure = draw(played(SCANS))
    distance = figure.axes[1]
    (line,) = (line for line in distance.lines if line.get_label() == "distance")
    (isolated,) = (line for line in distance.lines if line.get_label() == "isolated reading")
    shown = np.asarray(line.get_ydata(), float)
    assert np.isnan(shown[[8, 14, 42, 71]]).all()
    assert len(np.asarray(isolated.get_xdata())) == 4


def odd(name: str, folder: Path) -> Path:
    """Write the sample, changed."""
    with np.load(SCANS) as archive:
        arrays: dict[str, Any] = dict(archive)
    if name == "blind":
        arrays["ranges"][3:] = np.nan
    elif name == "empty":
        arrays["ranges"][:] = np.inf
    elif name == "one frame":
        arrays |= {key: arrays[key][:1] for key in ("t", "ranges", "v", "w")}
    elif name == "reverse":
        arrays["v"] = -arrays["v"]
    np.savez(folder / "odd.npz", **arrays)
    return folder / "odd.npz"


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("blind", "126 frames with nothing valid"),
        ("empty", "none, nothing ever closes"),
        ("one frame", "odd.npz: 1 frame\n"),
        ("reverse", "none, nothing ever closes"),
    ],
)
def test_what_is_odd_is_drawn_and_told(
    name: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["demo", str(odd(name, tmp_path)), "--out", str(tmp_path)]) == 0
    assert said in capsys.readouterr().out
    assert (tmp_path / "odd.png").stat().st_size > 10_000


def test_a_sample_is_called_simulated() -> None:
    assert "simulated" in name_of(SCANS)
    assert name_of(Path("some") / "approach.npz") == "approach.npz"


# The command


def test_a_picture_that_cannot_be_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").touch()
    assert main(["demo", "--out", str(tmp_path / "file")]) == 1
    assert "choose another place" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["demo", "--speed", "nan"], "argument --speed: must be a finite number, got 'nan'"),
        (["replay", str(SCANS), "--rows", "-1"], "argument --rows: must be a whole number from 0, got '-1'"),
        (["replay"], "PATH"),
        (["bench", "--beams", "0"], "argument --beams: must be a whole number from 1, got '0'"),
    ],
)
def test_a_senseless_command_line_is_exit_code_2(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize("command", [[], ["replay"], ["demo"], ["bench"]])
def test_help_lists_the_exit_codes(command: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main([*command, "--help-all"])
    assert ended.value.code == 0
    assert "exit codes:" in capsys.readouterr().out


@pytest.mark.parametrize("package", ["rich", "matplotlib"])
def test_a_missing_extra_is_one_line_that_says_how_to_get_it(package: str) -> None:
    program = f"import sys; sys.modules[{package!r}] = None; from ttc_fast.cli import main; sys.exit(main(['demo']))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 4
    assert done.stdout == ""
    how = "pip install '.[demo]' in the checkout of ttc_fast"
    assert done.stderr == f"ttc-fast: this needs {package}, which is not installed: {how}\n"


def test_importing_the_package_needs_neither_extra() -> None:
    program = (
        "import json, sys, ttc_fast, ttc_fast.logs, ttc_fast.replay, ttc_fast.cli;"
        "print(json.dumps([name in sys.modules for name in ('rich', 'matplotlib')]))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout) == [False, False]


@pytest.mark.skipif(os.name != "posix", reason="needs a POSIX pipe")
def test_a_reader_that_stops_early_sees_no_traceback() -> None:
    program = f"import sys; from ttc_fast.cli import main; sys.exit(main(['replay', {str(SCANS)!r}]))"
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        assert process.stderr.read() == b""
        assert process.wait() == 1


# Recorded


def moving_ttc(path: Path, **options: Any) -> list[float]:
    log = open_log(path)
    assert isinstance(log, ScanLog)
    from ttc_fast import ScanTTC

    scan = ScanTTC(**{**vars(log.scanner), **options})
    return [
        scan.min(frame.ranges, frame.speed, frame.yaw_rate) for frame in log if frame.speed and abs(frame.speed) > 0.05
    ]


def test_error_codes_of_a_recorded_laser_are_no_obstacles(data: Path) -> None:
    path = data / "laserscan" / "breezyslam_exp1.npz"
    assert np.percentile(moving_ttc(path), 5) == pytest.approx(1.06, abs=0.02)
    without = moving_ttc(path, range_min=0.0)
    assert len(without) > 600
    assert max(without) < 0.1


def test_the_brake_of_a_tracker_that_warms_up_hides_no_cause() -> None:
    replay = played(sample("clouds"))
    (caused,) = replay.summary.events
    assert replay.summary.start is not None
    assert (replay.summary.start.begin.reason, caused.begin.reason) == (Reason.NO_MOTION, Reason.CRITERION)
    assert replay.summary.start.end < caused.begin.stamp
    assert replay.key_frame is not None
    assert replay.key_frame[0] == caused.begin
    said = texts(replay)
    assert f"It brakes at {caused.begin.stamp:.2f} s" in said
    assert "brakes at the start" in said
