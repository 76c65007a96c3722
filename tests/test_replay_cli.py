"""``ttc-fast replay``: what it writes and says, and how it ends."""

import csv
import json
import math
import subprocess
import sys
from pathlib import Path

import matplotlib.image
import pyarrow.parquet
import pytest

from bags import drive, write
from ttc_fast.cli import main
from ttc_fast.replay import Row, replay, sample

SCANS = str(sample("scans"))
ROWS = list(replay(SCANS))


def test_csv_has_every_row(tmp_path: Path) -> None:
    file = tmp_path / "rows.csv"
    assert main(["replay", SCANS, "--out", str(file)]) == 0
    with file.open(newline="") as lines:
        read = list(csv.DictReader(lines))
    assert list(read[0]) == list(Row._fields)
    assert len(read) == len(ROWS)
    for line, row in zip(read, ROWS, strict=True):
        assert float(line["ttc"]) == pytest.approx(row.ttc, rel=1e-5)
        assert (line["status"], line["command"], line["reason"]) == (row.status.name, row.command.name, row.reason.name)
        assert line["valid"] == str(row.valid)


def test_json_lines_are_json(tmp_path: Path) -> None:
    file = tmp_path / "rows.jsonl"
    assert main(["replay", str(sample("clouds")), "--out", str(file)]) == 0
    read = [json.loads(line, parse_constant=pytest.fail) for line in file.read_text().splitlines()]
    assert [row["ttc"] for row in read] == [
        row.ttc if math.isfinite(row.ttc) else None for row in replay(sample("clouds"))
    ]


def test_parquet_has_every_row(tmp_path: Path) -> None:
    file = tmp_path / "rows.parquet"
    assert main(["replay", SCANS, "--out", str(file)]) == 0
    table = pyarrow.parquet.read_table(file)
    assert table.column_names == list(Row._fields)
    assert table["ttc"].to_pylist() == [row.ttc for row in ROWS]
    assert table["command"].to_pylist() == [row.command.name for row in ROWS]


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
        ([SCANS, "--out", "/nowhere/rows.csv"], 1, "choose another --out"),
        ([SCANS, "--plot", "/nowhere/p.png"], 1, "choose another --plot"),
        ([SCANS, "--criterion", "Guess"], 2, "kind must be one of IttcThreshold"),
        ([SCANS, "--criterion", "IttcThreshold:threshold"], 2, "must be NAME=VALUE with a number"),
        ([SCANS, "--criterion", "IttcThreshold:limit=1"], 2, "no setting 'limit'"),
        ([SCANS, "--config", "nowhere.toml"], 2, "nowhere.toml: cannot be read"),
        ([SCANS, "--sensor-height", "1"], 3, "no use for the option sensor_height"),
        ([SCANS, "--outline", "1", "0", "0", "1"], 2, "outline"),
        ([str(sample("clouds")), "--gate-x", "5", "2"], 2, "gate"),
        ([str(sample("clouds")), "--criterion", "IttcThreshold"], 2, "needs a scan"),
        ([str(sample("clouds")), "--axes", "x", "x", "z"], 2, "axes"),
    ],
)
def test_mistakes_are_one_line_and_a_code(
    arguments: list[str], code: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["replay", *arguments]) == code
    told = capsys.readouterr().err
    assert said in told
    assert told.count("\n") == 1


@pytest.mark.parametrize(
    ("package", "arguments"),
    [("rich", []), ("matplotlib", ["--plot", "p.png"]), ("pyarrow", ["--out", "r.parquet"])],
)
def test_a_missing_extra_is_one_line(package: str, arguments: list[str], tmp_path: Path) -> None:
    program = (
        f"import sys; sys.modules[{package!r}] = None; from ttc_fast.cli import main; sys.exit(main(sys.argv[1:]))"
    )
    command = [sys.executable, "-c", program, "replay", SCANS, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 4
    assert done.stderr.startswith(f"ttc-fast: this needs {package}, which is not installed: pip install 'ttc-fast[")


def test_help_explains(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["replay", "--help"])
    said = capsys.readouterr().out
    assert all(word in said for word in ("exit codes:", "--outline", "--criterion", "--config", "--sensor-height"))
