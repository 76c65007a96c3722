"""The main job over point clouds: a log in, TTC of each frame, a table and a picture out."""

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ttc_fast import Gate, KthSmallest, Minimum, Status, reference
from ttc_fast.cli import main
from ttc_fast.demo import SAMPLES
from ttc_fast.demo.clouds.estimators import ESTIMATORS, read_estimator
from ttc_fast.demo.clouds.picture import draw
from ttc_fast.demo.clouds.replay import TOO_LONG, CloudReplay, corridor, replay
from ttc_fast.demo.picture import ALARM, INK
from ttc_fast.logs import CloudLog, open_log

PNG = b"\x89PNG\r\n\x1a\n"
STRAYS = [2, 3, 7, 11]  # frames of the sample
PUBLISHED = ["--gate-x", "2", "20", "--min-intensity", "0.1"]


def open_clouds(path: Path = SAMPLES["clouds"]) -> CloudLog:
    log = open_log(path)
    assert isinstance(log, CloudLog)
    return log


def change(path: Path, **changes: Any) -> Path:
    """Write the sample, changed."""
    with np.load(SAMPLES["clouds"]) as archive:
        np.savez(path, **{**archive, **changes})
    return path


def rows_of(output: str) -> list[list[str]]:
    """Split the table into cells, without the marks."""
    rows = [line.lstrip(" <!*").split() for line in output.splitlines()]
    return [row for row in rows if len(row) == 9 and row[0].isdigit()]


# The replay


def test_the_sample_closes_in_as_it_was_made_to() -> None:
    result = replay(open_clouds())
    for row in result.rows:
        truth = 16.0 - 4.0 * row.stamp - 2.5 * row.stamp**2 - 2.0
        assert row.seen.distance == pytest.approx(truth, abs=0.06)
    ttc = [row.ttc for row in result.rows]
    assert result.rows[0].seen.status == Status.WARMING_UP
    assert ttc[0] == math.inf
    assert ttc == sorted(ttc, reverse=True)
    assert result.least is result.rows[-1]
    assert result.least_frame.stamp == result.least.stamp
    assert [row.frame for row in result.under] == list(range(3, 12))


def test_strays_of_the_sample_are_outvoted_and_only_they() -> None:
    result = replay(open_clouds())
    assert [row.frame for row in result.outvoted] == STRAYS
    worst = result.worst_outvoted
    assert worst is not None
    assert worst.plain.ttc < 0.3 < 1.3 < worst.ttc
    assert replay(open_clouds(), estimator=Minimum()).outvoted == []


def test_each_row_is_what_the_reference_says() -> None:
    log, gate = open_clouds(), Gate(x=(2.0, 30.0), y=(-1.5, 1.5), z=(-1.4, 0.0))
    rows = replay(log, gate=gate, estimator=KthSmallest(5), front_offset=1.5, rate=20.0).rows
    clouds = [frame.points for frame in log]
    for row, before, after in zip(rows[1:], clouds[:-1], clouds[1:], strict=True):
        expected = reference.ttc_from_clouds(
            before, after, row.stamp - (row.frame - 1) / 20.0, gate=gate, estimator=KthSmallest(5), front_offset=1.5
        )
        seen = row.seen
        assert (seen.ttc, seen.status, seen.distance) == (expected.ttc, expected.status, expected.distance)
        assert seen.current.index == expected.current.index


def test_the_corridor_follows_the_lidar() -> None:
    lidar = open_clouds().lidar
    assert corridor(lidar) == Gate.above_road(1.73, x=(2.0, math.inf))
    narrow = corridor(lidar, gate_x=(3.0, 9.0), lane_width=3.0, height=(0.5, 1.0), min_intensity=0.2)
    assert narrow == Gate.above_road(1.73, 0.5, 1.0, x=(3.0, 9.0), y=(-1.5, 1.5), intensity=(0.2, math.inf))


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("minimum", "Minimum()"),
        ("kth:3", "KthSmallest(k=3)"),
        ("quantile:0.5", "Quantile(q=0.5)"),
        ("mean:10", "MeanOfLowest(k=10)"),
        ("fence:1.5", "InterquartileFence(factor=1.5)"),
        ("supported:5,0.1", "Supported(points=5, gap=0.1)"),
        ("cluster:0.2,10", "Cluster(tolerance=0.2, min_points=10)"),
    ],
)
def test_every_estimator_has_a_short_name(text: str, shown: str) -> None:
    assert repr(read_estimator(text)) == shown
    assert text.partition(":")[0] in ESTIMATORS


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("median", "must be one of minimum, kth:K, quantile:Q"),
        ("kth", "must be written kth:K, got 'kth'"),
        ("minimum:3", "must be written minimum, got 'minimum:3'"),
        ("kth:0", "must be written kth:K, got 'kth:0': k must be"),
        ("kth:ten", "must be written kth:K, got 'kth:ten'"),
        ("cluster:0.2", "must be written cluster:TOLERANCE,POINTS, got 'cluster:0.2'"),
        ("quantile:2", "must be written quantile:Q, got 'quantile:2': q must be"),
    ],
)
def test_an_estimator_that_makes_no_sense(text: str, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ValueError, match=r"^must be") as error:
        read_estimator(text)
    assert said in str(error.value)
    with pytest.raises(SystemExit) as ended:
        main(["demo", "--sample", "clouds", "--estimator", text])
    assert ended.value.code == 2
    assert "argument --estimator: must be" in capsys.readouterr().err


# Recorded frames


def recorded(data: Path, **settings: Any) -> CloudReplay:
    return replay(open_clouds(data / "kitti" / "velodyne"), **settings)


def test_kitti_strays_are_outvoted_and_only_they(data: Path) -> None:
    result = recorded(data)
    assert [row.frame for row in result.outvoted] == [11, 16]
    for row, plain, about in zip(result.outvoted, (3.8, 3.2), (11.0, 8.5), strict=True):
        assert row.plain.ttc == pytest.approx(plain, abs=0.05)
        assert row.ttc == pytest.approx(about, abs=1.5)


def test_kitti_plain_minimum_is_the_published_one(data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    frames = str(data / "kitti" / "velodyne")
    assert main(["demo", frames, *PUBLISHED, "--estimator", "minimum", "--no-plot"]) == 0
    rows = rows_of(capsys.readouterr().out)
    with (data / "kitti" / "corridor_distances.csv").open(newline="") as file:
        published = list(csv.DictReader(file))
    assert len(rows) == len(published) == 20
    for row, line in zip(rows[1:], published[1:], strict=True):
        ttc = float(line["ttc_min"])
        assert float(row[3]) == pytest.approx(float(line["min"]), abs=6e-4)
        assert float(row[6]) == pytest.approx(ttc if ttc > 0 else math.inf, abs=0.01)


def test_demo_of_the_recorded_frames(data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", str(data / "kitti" / "velodyne"), "--out", str(tmp_path)]) == 0
    output = capsys.readouterr().out
    assert "20 frames in 1.9 s; no timestamps.txt, so 10 frames a second are assumed" in output
    assert "! outvoted  in 2 frames" in output
    assert (tmp_path / "velodyne.png").read_bytes()[:8] == PNG


# The command


def test_demo_prints_what_was_seen(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", "--sample", "clouds", "--no-plot"]) == 0
    output = capsys.readouterr().out
    result = replay(open_clouds())
    for cells, row in zip(rows_of(output), result.rows, strict=True):
        seen = row.seen
        told = (row.stamp, seen.current.x, seen.current.nearest_x, seen.distance, seen.closing_speed, row.ttc)
        shown = ["-" if math.isnan(number) or math.isinf(number) else f"{number:.3f}" for number in told]
        assert cells == [str(row.frame), *shown, seen.status.name, str(seen.current.candidates)]
    assert f"* least TTC {result.least.ttc:.3f} s in frame 11, 6.58 m from the bumper, closing at 9.22 m/s" in output
    assert "! outvoted  in 4 frames the nearest point strays more than 0.1 m in front of x; frame 7 would" in output
    marked = [line.split()[:2] for line in output.splitlines() if line[0:1] in tuple("<!*")]
    marks = {7: "<!", 11: "<*"}
    expected = [[marks.get(row.frame, "<"), str(row.frame)] for row in result.under]
    assert [cells for cells in marked if cells[1].isdigit()] == expected


@pytest.mark.parametrize(("options", "start"), [([], "bumper"), (["--front-offset", "0"], "sensor")])
def test_demo_says_where_distances_start(options: list[str], start: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", "--sample", "clouds", "--no-plot", *options]) == 0
    output = capsys.readouterr().out
    assert f"from {start}" in output.splitlines()[0]
    assert f" m from the {start}, closing at" in output


@pytest.mark.parametrize("offset", [0.0, 2.0])
def test_the_picture_says_where_distances_start(offset: float) -> None:
    figure = draw(replay(open_clouds(), front_offset=offset), "")
    start = "bumper" if offset else "sensor"
    assert figure.axes[0].get_ylabel() == f"from the {start}, m"
    assert f"m from the {start}, closing" in figure.axes[2].get_title(loc="left")
    footnote = figure.get_supxlabel()
    assert footnote == ("" if offset else f"Distances are from the sensor, so every {TOO_LONG}.")


@pytest.mark.parametrize(("threshold", "colour"), [(0.5, INK), (2.5, ALARM)])
def test_the_least_is_red_only_under_the_threshold(threshold: float, colour: str) -> None:
    figure = draw(replay(open_clouds(), threshold=threshold), "")
    (dot,) = (line for line in figure.axes[1].lines if line.get_label() == "least")
    assert dot.get_color() == colour


@pytest.mark.parametrize(
    "options",
    [
        [],
        ["--estimator", "mean:10"],  # no single point decides
        ["--estimator", "kth:100000"],  # too few points
        ["--gate-x", "200", "inf"],  # nothing there
        ["--min-intensity", "0.3"],
        ["--front-offset", "0"],
        ["--front-offset", "9"],  # contact
        ["--rate", "20", "--threshold", "0.1"],
    ],
)
def test_demo_draws_what_there_is(options: list[str], tmp_path: Path) -> None:
    assert main(["demo", "--sample", "clouds", "--out", str(tmp_path), *options]) == 0
    picture = tmp_path / "following.png"
    assert picture.read_bytes()[:8] == PNG
    assert picture.stat().st_size > 10_000


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--estimator", "kth:100000"], "  too few   too few points to outvote any in 11 frames"),
        (["--gate-x", "200", "inf"], "* least TTC none, nothing ever closes"),
        (["--rate", "20"], "12 frames in 0.6 s; 20 frames a second"),
        (["--front-offset", "9"], "CONTACT"),
        (["--front-offset", "0"], "  distance  from the sensor, so TTC is too long by (sensor to bumper)"),
    ],
)
def test_demo_says_what_is_odd(options: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", "--sample", "clouds", "--no-plot", *options]) == 0
    assert said in capsys.readouterr().out


def test_demo_shows_a_blind_sensor(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with np.load(SAMPLES["clouds"]) as archive:
        points, counts = archive["points"], archive["counts"]
    points[counts[:5].sum() :] = np.nan
    path = change(tmp_path / "blind.npz", points=points)
    assert main(["demo", str(path), "--out", str(tmp_path)]) == 0
    output = capsys.readouterr().out
    assert "nothing valid was seen in 7 frames" in output
    assert [row[2:7] for row in rows_of(output) if row[7] == "NO_DATA"] == [["-"] * 5] * 7
    assert (tmp_path / "blind.png").read_bytes()[:8] == PNG


def test_demo_of_one_cloud(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with np.load(SAMPLES["clouds"]) as archive:
        first = archive["counts"][:1]
        path = change(tmp_path / "one.npz", t=archive["t"][:1], counts=first, points=archive["points"][: first[0]])
    assert main(["demo", str(path), "--out", str(tmp_path)]) == 0
    assert [row[7] for row in rows_of(capsys.readouterr().out)] == ["WARMING_UP"]


@pytest.mark.parametrize(
    ("options", "code", "said"),
    [
        (["--gate-x", "9", "3"], 3, "following.npz: x must be (low, high) with low <= high, got (9, 3)"),
        (["--height", "2", "1"], 3, "following.npz: "),
        (["--speed", "3"], 2, "--speed is for laser scans, and this is a log of point clouds; leave it out"),
        (["--support", "0"], 2, "--support is for laser scans"),
    ],
)
def test_settings_that_make_no_sense(
    options: list[str], code: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["demo", "--sample", "clouds", "--no-plot", *options]) == code
    captured = capsys.readouterr()
    assert captured.err.startswith("ttc-fast: ")
    assert said in captured.err
    assert captured.err.count("\n") == 1
    assert captured.out == ""


def test_an_intensity_that_the_clouds_lack(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with np.load(SAMPLES["clouds"]) as archive:
        path = change(tmp_path / "plain.npz", points=archive["points"][:, :3])
    assert main(["demo", str(path), "--no-plot", "--min-intensity", "0.1"]) == 3
    assert "plain.npz: gate has bounds on intensity" in capsys.readouterr().err
    assert main(["demo", str(path), "--no-plot"]) == 0
