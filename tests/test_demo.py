"""The main job: a log in, TTC of each frame, a table and a picture out."""

import json
import math
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_rgba

from ttc_fast import Status, bench, reference
from ttc_fast.cli import main
from ttc_fast.demo import SAMPLES, name_of
from ttc_fast.demo.picture import ALARM, INK
from ttc_fast.demo.scans.picture import draw
from ttc_fast.demo.scans.replay import TOO_LONG, replay
from ttc_fast.logs import LogError, ScanLog, open_log

SAMPLE = SAMPLES["scans"]
PNG = b"\x89PNG\r\n\x1a\n"


def open_scans(path: Path) -> ScanLog:
    log = open_log(path)
    assert isinstance(log, ScanLog)
    return log


def moving_ttc(result_of: Path, range_min: float | None = None) -> list[float]:
    log = open_scans(result_of)
    scanner = log.scanner if range_min is None else replace(log.scanner, range_min=range_min)
    rows = replay(log, scanner=scanner, support=0).rows
    return [row.nearest.ttc for row in rows if row.speed > 0.05]


def without(arrays: set[str], path: Path, source: Path = SAMPLE) -> Path:
    with np.load(source) as archive:
        np.savez(path, **{name: archive[name] for name in archive if name not in arrays})
    return path


def marks_of(output: str) -> dict[int, str]:
    """Read the mark of each row of the table, by its frame."""
    rows = re.findall(r"^([<!*]*) +(\d+) +\d+\.\d{3} ", output, flags=re.MULTILINE)
    return {int(frame): mark for mark, frame in rows}


def test_the_sample_brakes_late_and_stops_in_front_of_the_box() -> None:
    result = replay(open_scans(SAMPLE))
    first, last = result.under[0], result.rows[-1]
    assert first.speed == pytest.approx(4.0, abs=0.1)
    assert abs(first.nearest.angle) < math.radians(10)
    assert 0.25 < result.least.nearest.ttc < 0.45
    assert first.stamp < result.least.stamp < last.stamp
    assert result.least_frame.stamp == result.least.stamp
    assert (last.speed, last.nearest.status, last.nearest.ttc) == (0.0, Status.NOT_CLOSING, math.inf)


def test_speckles_of_the_sample_are_outvoted_and_only_they() -> None:
    result = replay(open_scans(SAMPLE), support=1)
    plain = replay(open_scans(SAMPLE), support=0)
    assert plain.outvoted == []
    assert 1 <= len(result.outvoted) <= 8
    for row, raw in zip(result.rows, plain.rows, strict=True):
        assert row.lone_ttc == raw.nearest.ttc <= row.nearest.ttc
    assert min(row.lone_ttc for row in result.outvoted) < 0.2 < result.least.nearest.ttc


def test_each_row_is_what_the_reference_says() -> None:
    log = open_scans(SAMPLE)
    specified = reference.ScanTTC(**vars(log.scanner))
    rows = replay(log, support=0).rows
    assert len(rows) == log.frame_count
    for row, frame in zip(rows[::8], list(log)[::8], strict=True):
        expected = specified.nearest(frame.ranges, row.speed, frame.yaw_rate)
        assert (row.nearest.ttc, row.nearest.beam) == (expected.ttc, expected.beam)


def test_recorded_log_with_range_min_honoured(data: Path) -> None:
    ttc = moving_ttc(data / "laserscan" / "breezyslam_exp1.npz")
    assert np.percentile(ttc, 5) == pytest.approx(1.06, abs=0.02)


def test_recorded_log_without_range_min_is_always_about_to_crash(data: Path) -> None:
    ttc = moving_ttc(data / "laserscan" / "breezyslam_exp1.npz", range_min=0.0)
    assert len(ttc) > 600
    assert max(ttc) < 0.1


def test_speed_given_replaces_the_speed_of_the_log() -> None:
    rows = replay(open_scans(SAMPLE), speed=-0.5).rows
    assert {row.speed for row in rows} == {-0.5}
    assert all(abs(row.nearest.angle) > math.pi / 4 for row in rows)  # what is behind


def test_a_log_without_speed_asks_for_one(tmp_path: Path) -> None:
    log = open_scans(without({"v"}, tmp_path / "still.npz"))
    with pytest.raises(LogError, match=r"still\.npz: does not know the speed of the vehicle; say it with --speed"):
        replay(log)
    assert len(replay(log, speed=1.0).rows) == log.frame_count


def test_demo_prints_the_frames_that_matter(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", "--no-plot", "--rows", "5"]) == 0
    output = capsys.readouterr().out
    rows = marks_of(output)
    result = replay(open_scans(SAMPLE))
    assert result.worst_outvoted is not None
    assert rows[result.worst_outvoted.frame] == "!"
    assert rows[result.under[0].frame] == "<"
    assert rows[result.least.frame] == "<*"
    assert [min(rows), max(rows)] == [0, len(result.rows) - 1]
    assert len(rows) <= 5
    assert f"{result.least.nearest.ttc:.3f} s in frame {result.least.frame}" in output


def test_demo_prints_every_row_when_asked(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", "--no-plot", "--rows", "0"]) == 0
    output = capsys.readouterr().out
    result = replay(open_scans(SAMPLE))
    marks = marks_of(output)
    assert list(marks) == [row.frame for row in result.rows]
    assert [frame for frame, mark in marks.items() if "<" in mark] == [row.frame for row in result.under]


def test_demo_names_the_settings(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", "--no-plot"]) == 0
    output = capsys.readouterr().out
    assert "  distance  from the outline, x -0.1 to 0.4 m, y -0.15 to 0.15 m" in output
    assert "  mount     x 0.27 m, y 0 m, yaw 0 rad" in output
    assert "  vote      NeighbourSupport(count=1, window=2, gap=0.2)" in output
    assert "  discarded" not in output
    assert main(["demo", "--no-plot", "--support", "0"]) == 0
    assert "  vote      none, a lone reading decides" in capsys.readouterr().out


def test_demo_says_that_many_readings_are_discarded(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", "--no-plot", "--range-min", "3"]) == 0
    output = capsys.readouterr().out
    share = re.search(r"([\d.]+%) out of range", output)
    assert share is not None
    assert f"  discarded {share[1]} of the readings are outside the scanner's 3 to 10 m" in output


def test_demo_without_outline_says_where_distances_start(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = without({"outline"}, tmp_path / "bare.npz")
    assert main(["demo", str(path), "--no-plot"]) == 0
    output = capsys.readouterr().out
    assert f"  distance  from the scanner, so {TOO_LONG}; say where the vehicle ends with --outline" in output
    assert " m from the scanner, closing at" in output
    assert f"Distances are from the scanner, so every {TOO_LONG}." in draw(replay(open_scans(path)), "").get_supxlabel()


def test_the_picture_explains_what_is_beside_the_way() -> None:
    result = replay(open_scans(SAMPLE))
    figure = draw(result, "")
    (pale,) = (line for line in figure.axes[0].lines if line.get_label() == "beam over 30\N{DEGREE SIGN} aside")
    shown = np.isfinite(np.asarray(pale.get_ydata(), float))
    aside = [abs(row.nearest.angle) > math.radians(30) and math.isfinite(row.ttc) for row in result.rows]
    assert shown.tolist() == aside
    assert 40 < sum(aside) < 80
    assert "in the median by 47\N{DEGREE SIGN}" in figure.get_supxlabel()
    assert draw(replay(open_scans(SAMPLE), threshold=100.0), "").get_supxlabel() == ""


@pytest.mark.parametrize(("threshold", "colour"), [(0.2, INK), (0.7, ALARM)])
def test_red_is_only_under_the_threshold(threshold: float, colour: str) -> None:
    figure = draw(replay(open_scans(SAMPLE), threshold=threshold), "")
    (dot,) = (line for line in figure.axes[0].lines if line.get_label() == "least")
    assert dot.get_color() == colour
    dots = figure.axes[2].collections[0]
    ttc = np.asarray(dots.get_array())
    red = np.all(np.isclose(dots.to_rgba(ttc), to_rgba(ALARM)), axis=1)
    assert red.tolist() == (ttc < threshold).tolist()
    assert red.any() == (colour == ALARM)


def test_a_sample_is_called_simulated() -> None:
    assert name_of(SAMPLE) == "simulated approach"
    assert name_of(Path("some") / "drive.npz") == "drive.npz"
    assert replay(open_scans(SAMPLE)).pace == "30 Hz"


def test_demo_draws_a_picture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "deep" / "er [1]"
    assert main(["demo", "--out", str(folder), "--rows", "2"]) == 0
    picture = folder / "approach.png"
    assert picture.read_bytes()[:8] == PNG
    assert str(picture) in capsys.readouterr().out


@pytest.mark.parametrize(
    "options", [["--speed", "0"], ["--speed", "-1"], ["--threshold", "100"], ["--range-min", "9.9"]]
)
def test_demo_draws_what_is_odd(options: list[str], tmp_path: Path) -> None:
    assert main(["demo", "--out", str(tmp_path), *options]) == 0
    assert (tmp_path / "approach.png").stat().st_size > 10_000


def test_demo_shows_a_blind_sensor(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "blind.npz"
    with np.load(SAMPLE) as archive:
        arrays = dict(archive)
    arrays["ranges"][3:] = np.nan
    np.savez(path, **arrays)
    assert main(["demo", str(path), "--out", str(tmp_path)]) == 0
    output = capsys.readouterr().out
    assert f"nothing valid was seen in {len(arrays['t']) - 3} frames" in output
    blind = next(line for line in output.splitlines() if "NO_DATA" in line)
    assert "inf" not in blind


def test_demo_of_one_frame_without_outline(tmp_path: Path) -> None:
    path = tmp_path / "one.npz"
    with np.load(SAMPLE) as archive:
        arrays = {name: archive[name][:1] if name in ("t", "ranges", "v", "w") else archive[name] for name in archive}
    del arrays["mount"], arrays["outline"]
    np.savez(path, **arrays)
    assert main(["demo", str(path), "--out", str(tmp_path)]) == 0
    assert (tmp_path / "one.png").read_bytes()[:8] == PNG


def test_demo_of_the_recorded_log(data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = data / "laserscan" / "breezyslam_exp1.npz"
    assert main(["demo", str(log), "--out", str(tmp_path)]) == 0
    assert "55.3% out of range" in capsys.readouterr().out
    assert (tmp_path / "breezyslam_exp1.png").read_bytes()[:8] == PNG


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["demo", "nowhere.npz"], 3, "nowhere.npz: cannot be opened: no such file or folder"),
        (["demo", __file__], 3, "test_demo.py: no reader for this kind of file; can read a NumPy archive (.npz) of"),
        (["demo", "--outline", "1", "0", "-1", "1"], 3, "outline must be"),
        (["demo", "--range-min", "99"], 3, "range_m"),
        (["demo", "--lane-width", "3"], 2, "--lane-width is for point clouds, and this is a log of laser scans"),
    ],
)
def test_errors_name_the_file_and_the_fix(
    arguments: list[str], code: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*arguments, "--no-plot"]) == code
    captured = capsys.readouterr()
    assert captured.err.startswith("ttc-fast: ")
    assert said in captured.err
    assert captured.err.count("\n") == 1
    assert captured.out == ""


def test_a_picture_that_cannot_be_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").touch()
    assert main(["demo", "--out", str(tmp_path / "file")]) == 1
    assert "choose another folder with --out" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "COMMAND"),
        (["demo", "--threshold", "0"], "argument --threshold: must be a finite number above 0, got '0'"),
        (["demo", "--speed", "nan"], "argument --speed: must be a finite number, got 'nan'"),
        (["demo", "--rows", "-1"], "argument --rows: must be a whole number from 0, got '-1'"),
        (["demo", "log.npz", "--sample", "clouds"], "argument --sample: not allowed with argument PATH"),
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


@pytest.mark.parametrize("command", [[], ["demo"], ["bench"]])
def test_help_lists_the_exit_codes(command: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main([*command, "--help"])
    assert ended.value.code == 0
    assert "exit codes:" in capsys.readouterr().out


@pytest.mark.parametrize("package", ["rich", "matplotlib"])
def test_a_missing_extra_is_one_line_that_says_how_to_get_it(package: str) -> None:
    program = f"import sys; sys.modules[{package!r}] = None; from ttc_fast.cli import main; sys.exit(main(['demo']))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 4
    assert done.stdout == ""
    how = "pip install 'ttc-fast[demo]', in a checkout: pip install '.[demo]'"
    assert done.stderr == f"ttc-fast: this needs {package}, which is not installed: {how}\n"


def test_importing_the_package_needs_neither_extra() -> None:
    program = (
        "import json, sys, ttc_fast, ttc_fast.logs, ttc_fast.cli;"
        "print(json.dumps([name in sys.modules for name in ('rich', 'matplotlib')]))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout) == [False, False]


@pytest.mark.skipif(os.name != "posix", reason="needs a POSIX pipe")
def test_a_reader_that_stops_early_sees_no_traceback() -> None:
    program = "import sys; from ttc_fast.cli import main; sys.exit(main(['demo', '--no-plot', '--rows', '0']))"
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        assert process.stderr.read() == b""
        assert process.wait() == 1


def test_bench_compares_and_prints(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "--beams", "64", "--points", "999", "--rounds", "3"]) == 0
    output = capsys.readouterr().out
    for call in (*(f"ScanTTC.{method} " for method in bench.METHODS), "robust_min_x "):
        assert call in output
    assert "the answers were compared and agree" in output


def test_bench_refuses_to_time_wrong_answers(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    class Wrong(reference.ScanTTC):
        def min(self, *arguments: Any, **keywords: Any) -> Any:
            return 1.01 * super().min(*arguments, **keywords)

    def wrong(points: Any, **settings: Any) -> Any:
        return right(points - 0.5, **settings)

    right = reference.robust_min_x
    monkeypatch.setattr(reference, "ScanTTC", Wrong)
    monkeypatch.setattr(reference, "robust_min_x", wrong)
    assert main(["bench", "--beams", "64", "--points", "20000", "--rounds", "3"]) == 1
    said = capsys.readouterr().err
    assert "ttc-fast: ScanTTC.min, robust_min_x and the reference give different answers" in said
