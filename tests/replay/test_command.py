"""``ttc-fast replay``: what it writes and says, and how it ends."""

import csv
import io
import json
import math
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from enum import IntEnum
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import matplotlib.image
import numpy as np
import pyarrow.parquet
import pytest
from packaging.requirements import Requirement
from rich.console import Console

from tests.support.bags import POINTS, Cloud, Odom, Scan, drive, write
from ttc_fast import Command
from ttc_fast._extras import DISTRIBUTIONS, EXTRAS
from ttc_fast.cli import bench, demo, doctor, main, node
from ttc_fast.cli import replay as replay_command
from ttc_fast.logs import ScanLog, open_log
from ttc_fast.replay import Replay, Row, Settings, sample, terminal
from ttc_fast.replay.row import BATCH, CsvWriter
from ttc_fast.ros.core import BrakeNode
from ttc_fast.ros.files import read_configuration, read_parameters
from ttc_fast.ros.settings import NodeSettings

SCANS, CLOUDS, TABLE = str(sample("scans")), str(sample("clouds")), "gaps.csv"
ROWS = list(Replay(SCANS))


@pytest.mark.parametrize("encoding", ["ascii", "cp1251", "gbk"])
@pytest.mark.parametrize("command", ["replay", "demo", "bench", "node", "doctor"])
def test_a_console_without_a_character_shows_another(
    command: str, encoding: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    written_to = io.BytesIO()
    console = io.TextIOWrapper(written_to, encoding=encoding)
    monkeypatch.setattr(sys, "stdout", console)
    for module in (replay_command, demo, bench, node, doctor):
        monkeypatch.setattr(module, "run", lambda _: print("TIT 1.0 s\N{SUPERSCRIPT TWO}\N{SNOWMAN}"))
    assert main([command, *{"replay": [SCANS], "node": ["--dds"]}.get(command, [])]) == 0
    console.flush()
    assert re.fullmatch(rb"TIT 1.0 s\?\?\s+", written_to.getvalue())
    assert console.errors == "strict"


def test_a_summary_is_printed_where_its_characters_are_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    written_to = io.BytesIO()
    console = io.TextIOWrapper(written_to, encoding="ascii")
    monkeypatch.setattr(sys, "stdout", console)
    assert main(["replay", SCANS, "--rows", "0"]) == 0
    console.flush()
    assert b" s?" in written_to.getvalue()


def written(name: str, suffix: str, folder: Path) -> Path:
    file = folder / "deep" / f"rows{suffix}"
    assert main(["replay", str(sample(name)), "--out", str(file), "--rows", "0"]) == 0
    return file


def values(row: Row) -> list[Any]:
    """Return what a row holds, with names for enumerations."""
    return [each.name if isinstance(each, IntEnum) else each for each in row]


@pytest.mark.parametrize("name", ["scans", "clouds"])
def test_csv_has_every_row(name: str, tmp_path: Path) -> None:
    with written(name, ".csv", tmp_path).open(newline="") as lines:
        head, *read = csv.reader(lines)
    assert tuple(head) == Row._fields
    for line, row in zip(read, Replay(sample(name)), strict=True):
        for text, value in zip(line, values(row), strict=True):
            if isinstance(value, float):
                assert float(text) == pytest.approx(value, rel=1e-5, abs=1e-6, nan_ok=True)
            else:
                assert text == ("" if value is None else str(value))


@pytest.mark.parametrize("name", ["scans", "clouds"])
def test_json_lines_are_json(name: str, tmp_path: Path) -> None:
    lines = written(name, ".jsonl", tmp_path).read_text().splitlines()
    read = [json.loads(line, parse_constant=pytest.fail) for line in lines]
    for line, row in zip(read, Replay(sample(name)), strict=True):
        finite = [None if isinstance(each, float) and not math.isfinite(each) else each for each in values(row)]
        assert line == dict(zip(Row._fields, finite, strict=True))


@pytest.mark.parametrize("name", ["scans", "clouds"])
def test_parquet_has_every_row(name: str, tmp_path: Path) -> None:
    table = pyarrow.parquet.read_table(written(name, ".parquet", tmp_path))
    assert tuple(table.column_names) == Row._fields
    expected = [values(row) for row in Replay(sample(name))]
    read = [list(row.values()) for row in table.to_pylist()]
    assert [list(map(repr, row)) for row in read] == [list(map(repr, row)) for row in expected]  # NaN as well


def test_a_writer_holds_some_thousand_rows_and_loses_none(tmp_path: Path) -> None:
    with CsvWriter(tmp_path / "rows.csv") as writer:
        for _ in range(2 * BATCH + 1):
            writer.write(ROWS[0])
    assert len((tmp_path / "rows.csv").read_text().splitlines()) == 2 * BATCH + 2


@pytest.mark.parametrize("name", ["scans", "clouds"])
def test_pictures_are_drawn(name: str, tmp_path: Path) -> None:
    for picture in (tmp_path / "picture.png", tmp_path / "picture.svg"):
        assert main(["replay", str(sample(name)), "--plot", str(picture), "--rows", "0"]) == 0
    assert matplotlib.image.imread(tmp_path / "picture.png").std() > 0.05
    assert "<svg" in (tmp_path / "picture.svg").read_text()


def test_the_summary_says_when_and_why(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", SCANS]) == 0
    said = capsys.readouterr().out
    assert "129 frames in 4.3 s, 30 Hz" in said
    assert "frame 52, 1.734 to 4.267 s, 77 frames: CRITERION by SweptPathThreshold: 1.41 < 1.5" in said


def test_many_logs_have_a_line_and_a_file_each(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    paths = [SCANS, str(sample("clouds")), str(tmp_path / "nowhere.bag")]
    assert main(["replay", *paths, "--out", str(tmp_path / "rows.csv"), "--jobs", "2"]) == 5
    told = capsys.readouterr()
    assert "no such file or folder" in told.out
    assert "of 3 logs 1 could not be read whole" in told.err
    written = {file.name: len(file.read_text().splitlines()) for file in tmp_path.iterdir()}
    assert written == {"rows-approach.npz.csv": 130, "rows-following.npz.csv": 13}


def test_no_log_is_written_over(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = "stamp,distance\n0.0,9.0\n0.1,8.9\n"
    for name in ("a.csv", "b.csv", "rows-a.csv.csv"):
        (tmp_path / name).write_text(table)
    (tmp_path / "link.csv").symlink_to(tmp_path / "a.csv")
    a, b, named = (str(tmp_path / name) for name in ("a.csv", "b.csv", "rows-a.csv.csv"))
    for arguments in ([a, "--out", a], [a, "--out", str(tmp_path / "link.csv")]):
        assert main(["replay", *arguments]) == 2
        assert "is a log that is to be replayed; choose another --out" in capsys.readouterr().err
    assert main(["replay", a, b, named, "--out", str(tmp_path / "rows.csv")]) == 2
    assert f"{named}: is a log" in capsys.readouterr().err
    assert {Path(each).read_text() for each in (a, b, named)} == {table}


def test_a_name_that_nothing_can_be_written_under(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(sample("scans")), "--rows", "0", "--summary", str(tmp_path / f"{'n' * 300}.csv")]) == 1
    assert capsys.readouterr().err.endswith("n.csv: File name too long\n")


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere names are text")
def test_a_log_whose_name_is_no_text_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    name = os.fsdecode(bytes(tmp_path) + b"/drive\xff.npz")
    shutil.copy(sample("scans"), name)
    assert main(["replay", name, "--out", str(tmp_path / "rows.csv")]) == 3
    assert capsys.readouterr().err.endswith("drive\\udcff.npz: has a name that is not UTF-8; rename it\n")


def test_a_damaged_log_ends_partial(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write(tmp_path, "bag", drive(100, 256))
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    out = tmp_path / "rows.csv"
    assert main(["replay", str(path), "--out", str(out)]) == 5
    assert "frames that could be read were given" in capsys.readouterr().err
    assert 20 < len(out.read_text().splitlines()) < 100


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["nowhere.bag"], 3, "no such file or folder"),
        ([SCANS, "--out", "rows.txt"], 2, "--out must end in .csv, .jsonl, .parquet"),
        ([SCANS, "--plot", "picture.gif"], 2, "--plot must end in .png or .svg"),
        ([SCANS, "--out", "/proc/nowhere/rows.csv"], 1, "choose another --out"),
        ([SCANS, "--plot", "/proc/nowhere/p.png"], 1, "choose another place"),
        ([SCANS, "--out", f"{SCANS}/rows.csv"], 1, "approach.npz is not a folder; choose another --out"),
        ([SCANS, "--plot", f"{SCANS}/p.png"], 1, "approach.npz is not a folder; choose another place"),
        ([SCANS, "--plot", f"{SCANS}/a/p.png"], 1, "approach.npz is not a folder; choose another place"),
        ([SCANS, "--gate-x", "1", "9"], 3, "a log of scans has no use for --gate-x; leave it out"),
        ([CLOUDS, "--range-max", "9"], 3, "a log of clouds has no use for --range-max; leave it out"),
        ([TABLE, "--outline", "-1", "0", "-1", "1"], 3, "a table of distances has no use for --outline"),
        ([TABLE, "--mount", "1", "0", "0"], 3, "a table of distances has no use for --mount"),
        ([TABLE, "--gate-z", "0", "1"], 3, "a table of distances has no use for --gate-z"),
        ([SCANS, "--criterion", "Guess"], 2, "kind must be one of IttcThreshold"),
        ([SCANS, "--criterion", "IttcThreshold:threshold"], 2, "must be NAME=VALUE with a number"),
        ([SCANS, "--criterion", "IttcThreshold=0.7"], 2, "write IttcThreshold:threshold=0.7"),
        ([SCANS, "--criterion", "IttcThreshold:limit=1"], 2, "no setting 'limit'"),
        ([SCANS, "--config", "nowhere.toml"], 2, "nowhere.toml: cannot be read"),
        ([SCANS, "--sensor-height", "1"], 3, "no use for --sensor-height"),
        ([SCANS, "--outline", "1", "0", "0", "1"], 2, "--outline must be (x_rear, x_front, y_right, y_left)"),
        ([str(sample("clouds")), "--gate-x", "5", "2"], 2, "--gate-x must be (low, high)"),
        ([str(sample("clouds")), "--criterion", "IttcThreshold"], 2, "needs a scan"),
        ([str(sample("clouds")), "--axes", "x,x,z"], 2, "axes"),
    ],
)
def test_mistakes_are_one_line_and_a_code(
    arguments: list[str],
    code: int,
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / TABLE).write_text("stamp,distance\n0.0,9.0\n0.1,8.9\n")
    monkeypatch.chdir(tmp_path)
    assert main(["replay", *arguments]) == code
    told = capsys.readouterr().err
    assert said in told
    assert told.count("\n") == 1


def test_a_gate_on_an_intensity_that_is_missing_says_what_is_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    dark = POINTS[["x", "y", "z"]]
    bright = np.array(
        [(9.0, 1.0, -1.0, 9), (8.0, 0.5, -1.0, 9)], [*((name, "<f4") for name in "xyz"), ("intensity", "<i4")]
    )
    no_intensity = "gate has bounds on intensity, but the points have no intensity; its fields are x, y, z"
    gate = ["--gate-intensity", "1", "20", "--sensor-height", "2"]
    for name, clouds, code, said in (
        ("first", [dark], 3, f"frame 0: {no_intensity}\n"),
        ("empty", [bright[:0], dark], 5, f"frame 1: {no_intensity}\n"),
        ("later", [bright, bright, dark, bright], 5, f"frame 2: {no_intensity}\n"),
        ("sound", [bright, bright[:0], bright], 0, ""),
    ):
        (tmp_path / name).mkdir()
        items = [Cloud(i / 10, i / 10, points) for i, points in enumerate(clouds)]
        assert main(["replay", str(write(tmp_path / name, "bag", items)), *gate]) == code
        assert said in capsys.readouterr().err
    (tmp_path / "odd").mkdir()
    odd = Cloud(0.0, 0.0, POINTS, names={"ring": "intensity"}, counts={"ring": 2})
    assert main(["replay", str(write(tmp_path / "odd", "bag", [odd])), *gate]) == 3
    assert "msg.fields 'intensity' has 2 numbers a point; it is ignored" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("package", "extra", "arguments"),
    [("rich", "log", []), ("matplotlib", "plot", ["--plot", "p.png"]), ("pyarrow", "parquet", ["--out", "r.parquet"])],
)
def test_a_missing_extra_is_one_line(package: str, extra: str, arguments: list[str], tmp_path: Path) -> None:
    program = (
        f"import sys; sys.modules[{package!r}] = None; from ttc_fast.cli import main; sys.exit(main(sys.argv[1:]))"
    )
    command = [sys.executable, "-c", program, "replay", SCANS, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 4
    assert done.stderr.startswith(f"ttc-fast: this needs {package}, which is not installed: pip install '.[{extra}]'")


def brought_by(extra: str) -> set[str]:
    """The packages that an extra installs; it may ask for other extras."""
    every = [Requirement(each) for each in metadata.requires("ttc-fast") or []]
    asked = [each for each in every if each.marker and each.marker.evaluate({"extra": extra})]
    return {each.name for each in asked}.union(*(brought_by(more) for each in asked for more in each.extras))


def test_a_missing_package_is_in_the_extra_that_is_named() -> None:
    assert all(DISTRIBUTIONS.get(package, package) in brought_by(extra) for package, extra in EXTRAS.items())
    assert {"rich", "matplotlib"} <= brought_by("demo")


@pytest.mark.parametrize("command", ["replay", "demo", "bench", "node", "doctor"])
def test_help_fits_a_screen_and_begins_with_examples(
    command: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    with pytest.raises(SystemExit):
        main([command, "--help"])
    said = capsys.readouterr().out
    assert len(said.splitlines()) <= 40
    assert said.partition("\n\n")[2].startswith(f"  ttc-fast {command}")
    assert "--help-all has every option" in said


def test_without_a_command_it_shows_what_one_can_do(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["ttc-fast"])
    assert main() == main([]) == 0
    said = capsys.readouterr().out
    assert said.count("  ttc-fast replay drive.bag") == 2
    assert len(said.splitlines()) <= 80


def test_help_explains(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["replay", "--help-all"])
    said = capsys.readouterr().out
    assert all(word in said for word in ("exit codes:", "--outline", "--criterion", "--config", "--sensor-height"))


def test_help_fits_a_terminal_but_for_the_list_of_formats(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["replay", "--help-all"])
    assert max(map(len, capsys.readouterr().out.splitlines())) <= 120


def test_axes_may_be_negative(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What is seen by a lidar that hangs upside down is put upright."""
    with np.load(sample("clouds")) as archive:
        np.savez(tmp_path / "hung.npz", **{**archive, "points": archive["points"] * np.array([1, -1, -1, 1], "f4")})
    assert main(["replay", str(tmp_path / "hung.npz"), "--axes", "x,-y,-z"]) == 0
    assert "least TTC   0.697 s in frame 11" in capsys.readouterr().out


def test_a_log_without_odometry_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    still = [Scan(i / 40, i / 40, np.full(64, 4.0, np.float32)) for i in range(40)]
    assert main(["replay", str(write(tmp_path, "bag", still))]) == 0
    said = capsys.readouterr().out
    assert "speed       no odometry: the speed is unknown; how the ranges change tells what closes" in said


@pytest.mark.parametrize("many", [False, True])
def test_an_interrupt_ends_cleanly(many: bool, tmp_path: Path) -> None:
    """A long log, a Ctrl-C as the terminal sends it: one line, exit code 130, rows so far."""
    path = write(tmp_path, "bag", drive(3000, 1080))
    out = tmp_path / "rows.csv"
    slow = (
        "import signal, sys, time; import ttc_fast.logs.ros as ros; from ttc_fast.cli import main;"
        "signal.signal(signal.SIGINT, signal.default_int_handler);"  # which jobs of a script ignore
        "look = ros.BagScans.__iter__;"
        "ros.BagScans.__iter__ = lambda self: (time.sleep(0.005) or frame for frame in look(self));"
        "sys.exit(main(sys.argv[1:]))"
    )
    paths = [str(path)] * (40 if many else 1)  # the processes of many know nothing of the slowness, and there are many
    command = [sys.executable, "-c", slow, "replay", *paths, "--out", str(out), "--jobs", "2"]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    deadline = time.monotonic() + 60.0
    while not list(tmp_path.glob("rows*.csv")):
        assert time.monotonic() < deadline
        assert process.poll() is None
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGINT)
    said, told = process.communicate(timeout=30)
    assert (process.returncode, told, said) == (130, "ttc-fast: interrupted\n", "")
    assert list(tmp_path.glob("rows*.csv"))


CAR = """
ttc_threshold = 0.9
outline = [-0.1, 0.4, -0.15, 0.15]
max_range = 8.0
trigger = [1, 2]
hold = 0.2
[dds]
domain_id = 3
"""
TABLES = """
[scan]
outline = [-0.1, 0.4, -0.15, 0.15]
limits = [0.0, 8.0]
[[criteria]]
kind = "SweptPathThreshold"
threshold = 0.9
[[criteria]]
kind = "StoppingDistance"
[brake]
trigger = [1, 2]
hold = 0.2
"""


@pytest.mark.parametrize("text", [CAR, TABLES])
def test_one_file_serves_the_node_and_the_replay(text: str, tmp_path: Path) -> None:
    """The node, fed with the messages of a log, decides as the replay of that log does."""
    file = tmp_path / "car.toml"
    file.write_text(text)
    log = open_log(SCANS, mount=(0.0, 0.0, 0.0))
    assert isinstance(log, ScanLog)
    parameters = read_parameters(file)
    parameters.pop("dds", None)
    settings = NodeSettings.of(parameters)
    assert settings.outline == (-0.1, 0.4, -0.15, 0.15)
    node = BrakeNode(settings)
    rows = list(Replay(SCANS, Settings(read_configuration(file), {"mount": (0.0, 0.0, 0.0)})))
    assert {row.criterion for row in rows} == {"StoppingDistance", "SweptPathThreshold"}
    scanner = SimpleNamespace(**vars(log.scanner), time_increment=0.0)
    braked = []
    for row, frame in zip(rows, log, strict=True):
        node.on_odometry(frame.stamp, frame.stamp, frame.speed or 0.0, frame.yaw_rate)
        scanner.ranges = frame.ranges
        braked.append(node.on_scan(frame.stamp, frame.stamp, scanner).brake)
        assert braked[-1] == (row.command is Command.BRAKE)
    assert 10 < sum(braked) < 120
    assert main(["replay", SCANS, "--config", str(file), "--rows", "0"]) == 0
    assert main(["node", "--dds", "--config", str(tmp_path / "nowhere.toml")]) == 2


def test_a_config_with_a_mistake_names_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "car.toml").write_text("ttc_treshold = 1.0")
    assert main(["replay", SCANS, "--config", str(tmp_path / "car.toml")]) == 2
    assert "car.toml: there is no parameter 'ttc_treshold': did you mean ttc_threshold?" in capsys.readouterr().err


def test_a_terminal_sees_the_last_rows_and_a_bar_meanwhile(monkeypatch: pytest.MonkeyPatch) -> None:
    shown = io.StringIO()
    console = Console(file=shown, force_terminal=True, width=100, highlight=False)
    monkeypatch.setattr(terminal, "TICK", 0.0)
    assert len(list(terminal.show_live(Replay(SCANS), console))) == len(ROWS)
    said = re.sub(r"\x1b\[[^a-zA-Z]*[a-zA-Z]", "", shown.getvalue())
    assert "approach.npz" in said
    assert f"129/{len(ROWS)}" in said
    assert "CRITERION" in said


def test_an_upside_down_scanner_from_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A wall to the right that the path turns into, seen the right way round and the other."""
    ranges = np.full(181, 9.0, np.float32)
    ranges[40:60] = 1.5
    items = [
        item
        for i in range(20)
        for item in (Odom(i / 40, i / 40, speed=2.0, yaw_rate=-1.5), Scan(i / 40, i / 40, ranges - 0.001 * i))
    ]
    path = str(write(tmp_path, "bag", items))
    outline = ["--outline", "-0.1", "0.4", "-0.15", "0.15", "--rows", "0"]
    assert main(["replay", path, *outline]) == 0
    assert "brakes      once" in capsys.readouterr().out
    assert main(["replay", path, *outline, "--upside-down"]) == 0
    assert "brakes      never" in capsys.readouterr().out
