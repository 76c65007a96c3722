"""When the frames of a folder were recorded, in which order they come, and which of them belong together."""

from pathlib import Path

import numpy as np
import pytest

from ttc_fast.logs import CloudLog, LogError, open_log
from ttc_fast.logs.stamps import natural, series_of, stamp_in
from ttc_fast.replay import Replay, Settings
from ttc_fast.replay.terminal import open_console, print_summary, print_used

S = 1_533_151_603  # 2018


def frames_in(folder: Path, names: list[str], ending: str = ".bin") -> CloudLog:
    """Write frames of one point, in any order; x is 1 in the first of the names, 2 in the second, and so on."""
    for x, name in reversed(list(enumerate(names, 1))):
        point = [-0.5, x, -1.0, 20.0, 1.0] if ending == ".pcd.bin" else [x, 0.5, -1.0, 0.3]
        (folder / f"{name}{ending}").write_bytes(np.array([point] * 3, "<f4").tobytes())
    log = open_log(folder)
    assert isinstance(log, CloudLog)
    return log


def seen(log: CloudLog) -> list[float]:
    return [float(frame.points[0][1 if log.lidar.axes[0] == "y" else 0]) for frame in log]


def stamps(log: CloudLog) -> list[float]:
    return [frame.stamp for frame in log]


def named(*names: str) -> list[tuple[str, list[str], bool]]:
    found = series_of([Path(f"{name}.bin") for name in names], lambda path: path.name[:-4])
    return [(each.name, [frame.name[:-4] for frame in each.frames], each.stamps is not None) for each in found]


# Order


@pytest.mark.parametrize("pattern", ["{}", "frame{}", "frame_{}", "Frame ({})", "a-{}-b", "000{}", "scan {} of 25"])
def test_frames_come_as_people_count_them(pattern: str, tmp_path: Path) -> None:
    log = frames_in(tmp_path, [pattern.format(i) for i in range(25)])
    assert seen(log) == list(range(1, 26))
    assert log.clock == "no timestamps.txt, so 10 frames a second are assumed"


def test_natural_order_of_names() -> None:
    names = ["b1", "a10", "a9", "a09b", "2", "10", "A1"]
    assert sorted(names, key=natural) == ["2", "10", "A1", "a09b", "a9", "a10", "b1"]


# Stamps


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        ([f"{S}000000000", f"{S}100000001", f"{S}200000000"], [0.0, 0.100000001, 0.2]),
        ([f"{S}000000", f"{S}100000", f"{S}200001"], [0.0, 0.1, 0.200001]),
        ([f"{S}000", f"{S}100", f"{S}250"], [0.0, 0.1, 0.25]),
        ([f"{S}", f"{S + 1}", f"{S + 3}"], [0.0, 1.0, 3.0]),
        ([f"{S}.25", f"{S}.5", f"{S}.75"], [0.0, 0.25, 0.5]),
        ([f"{S}_000000000", f"{S}_000500000", f"{S}_100000000"], [0.0, 0.0005, 0.1]),
        ([f"lidar_{S}.250000", f"lidar_{S}.350000"], [0.0, 0.1]),
        ([f"000{i}_{S}{i}00000" for i in range(3)], [0.0, 0.1, 0.2]),
        ([f"{S}{i}00000_000{i}" for i in range(3)], [0.0, 0.1, 0.2]),
        (["frame_20121214T142259.9", "frame_20121214T142300.1"], [0.0, 0.2]),
        (["2018-08-01-15-16-36", "2018-08-01-15-16-37", "2018-08-01-15-17-00"], [0.0, 1.0, 24.0]),
        ([f"n015-2018-07-24-11-22-45+0800__LIDAR_TOP__{S}{i}50000" for i in range(3)], [0.0, 0.1, 0.2]),
        (["9.5", "10.25", "11.0"], [0.0, 0.75, 1.5]),
        (["0.1", "0.15", "0.2"], [0.0, 0.05, 0.1]),
        ([f"us_{1_200_000_000 + 50_000 * i}" for i in range(3)], [0.0, 0.05, 0.1]),
        ([f"lidar1-{9_950_000_000 + 50_000_000 * i}ns" for i in range(3)], [0.0, 0.05, 0.1]),
        ([f"cloud_time_ms={S}{i}00" for i in range(3)], [0.0, 0.1, 0.2]),
    ],
)
@pytest.mark.parametrize("ending", [".bin", ".pcd.bin"])
def test_stamps_in_names(names: list[str], expected: list[float], ending: str, tmp_path: Path) -> None:
    log = frames_in(tmp_path, names, ending)
    assert stamps(log) == pytest.approx(expected, abs=1e-12)
    assert seen(log) == list(range(1, len(names) + 1))
    assert (log.clock, log.assumed) == ("stamps in the names", "")


@pytest.mark.parametrize(
    "names",
    [
        ["0000000000", "0000000001", "0000000002"],
        ["0001000000000", "0001000000001"],
        [f"{S}000000", f"{S}000001", f"{S}000002"],  # us, one after another
        ["4102444800000", "4102444900000"],
        ["20180801151636", "20180801151637"],
        ["1.9", "1.10", "1.11"],
        ["10.0", "20.0", "30.0"],
        [f"{1_200_000_000 + 50_000 * i}" for i in range(12)],  # us since power-on
        [f"{1_000_000_000_000 + 50_000_000 * i}" for i in range(12)],  # ns since power-on
        [f"ms_{i}" for i in range(12)],
        [f"2014-11-10-11-32-17_Velodyne-VLP-16 (Frame {i})" for i in range(12)],
        [f"20141110_113217_{i}" for i in range(12)],
    ],
)
def test_names_that_cannot_be_stamps_are_none(names: list[str], tmp_path: Path) -> None:
    log = frames_in(tmp_path, names)
    assert stamps(log) == pytest.approx([i / 10 for i in range(len(names))])
    assert seen(log) == list(range(1, len(names) + 1))
    assert log.assumed.startswith("10 frames a second, as neither the names nor a timestamps.txt say when")


def test_a_time_in_a_name() -> None:
    assert stamp_in(f"x_{S}123456789") == S * 10**9 + 123456789
    assert [stamp_in(name) for name in ("", "42", "9" * 19, "20181301T151636", "99999999999999999999")] == [None] * 5


@pytest.mark.parametrize("name", ["timestamps.txt", "times.txt"])
@pytest.mark.parametrize(
    "lines",
    [
        ["0.000000e+00", "1.036e-01", "2.072e-01"],
        ["1317012345.5", "1317012345.6036", "1317012345.7072"],
        ["1317012345500000000", "1317012345603600000", "1317012345707200000"],
        ["2011-09-26 13:02:25.0", "2011-09-26T13:02:25.103600000", "2011-09-26 13:02:25.2072"],
    ],
)
def test_a_list_of_stamps_has_seconds_or_dates(name: str, lines: list[str], tmp_path: Path) -> None:
    (tmp_path / name).write_text("\n".join(lines) + "\n")
    log = frames_in(tmp_path, ["000000", "000001", "000002"])
    assert stamps(log) == pytest.approx([0.0, 0.1036, 0.2072], abs=1e-9)
    assert (log.clock, log.assumed) == (f"stamps of {tmp_path / name}", "")


def test_a_list_of_stamps_that_are_hardly_seconds_says_so(tmp_path: Path) -> None:
    (tmp_path / "times.txt").write_text("1200000000\n1200100000\n1200200000\n")
    assumed = frames_in(tmp_path, ["000000", "000001", "000002"]).assumed
    assert "the stamps of times.txt are 100000 s apart or more, read as they are: a line is a number of s" in assumed


def test_a_gap_in_the_numbers_is_a_gap_in_time(tmp_path: Path) -> None:
    log = frames_in(tmp_path, ["000003", "000004", "000005", "000009", "000010"])
    assert stamps(log) == pytest.approx([0.0, 0.1, 0.2, 0.6, 0.7])
    faster = open_log(tmp_path, rate=20.0)
    assert [frame.stamp for frame in faster] == pytest.approx([0.0, 0.05, 0.1, 0.3, 0.35])


# Several sensors


@pytest.mark.parametrize(
    ("names", "series"),
    [
        (["front_1", "front_2", "rear_1", "rear_2"], ["front", "rear"]),
        (["1_front", "2_front", "1_rear", "2_rear"], ["front", "rear"]),
        ([f"lidar{k}_{i}" for k in (1, 2) for i in range(5)], ["lidar1", "lidar2"]),
        ([f"{k}-2018-07-24__TOP__{S}{i}00000" for k in ("n008", "n015") for i in range(3)],
         ["n008-2018-07-24__TOP", "n015-2018-07-24__TOP"]),
        ([f"{S}{i}00000_{k}" for k in ("left", "right") for i in range(3)], ["left", "right"]),
    ],
)  # fmt: skip
def test_frames_of_several_sensors_are_several_series(names: list[str], series: list[str]) -> None:
    assert [name for name, *_ in named(*names)] == series


@pytest.mark.parametrize(
    "names",
    [
        [f"15-16-{s}-{ms}" for s in range(30, 40) for ms in (125, 250, 975)],
        ["left", "right", "top"],
        ["0", "1", "2", "map"],
        [f"frame{i}_gain{i % 2}_t{i * 7}" for i in range(9)],
    ],
)
def test_frames_of_one_sensor_are_one_series(names: list[str]) -> None:
    assert len(named(*names)) == 1


def test_one_sensor_is_read_and_the_others_are_named(tmp_path: Path) -> None:
    names = [f"{sensor}_{i}" for sensor in ("front", "rear") for i in range(12)]
    log = frames_in(tmp_path, [*names, "rear_12"])
    frames = iter(log)
    assert [float(next(frames).points[0][0]) for _ in range(13)] == list(range(13, 26))
    said = (
        r"it holds the frames of 2 sensors or vehicles, front \(12 frames\), rear \(13 frames\), and only rear was read"
    )
    with pytest.raises(LogError, match=said + "; choose one with the option topic, or give each a folder of its own"):
        next(frames)
    chosen = open_log(tmp_path, topic="front")
    assert isinstance(chosen, CloudLog)
    assert seen(chosen) == list(range(1, 13))
    with pytest.raises(LogError, match=r"has no frames of left; it has front .*: choose with the option topic"):
        open_log(tmp_path, topic="left")


def test_a_name_without_a_stamp_among_stamps_is_no_frame_of_them(tmp_path: Path) -> None:
    log = frames_in(tmp_path, [f"{S}000000", f"{S}100000", f"{S}200000", "map"])
    frames = iter(log)
    assert [next(frames).stamp for _ in range(3)] == pytest.approx([0.0, 0.1, 0.2])
    with pytest.raises(LogError, match=r"map\.bin \(1 frames\), and only names of stamps alone was read"):
        next(frames)


def test_a_frame_that_is_there_twice(tmp_path: Path) -> None:
    frames_in(tmp_path, ["000000", "000001"])
    (tmp_path / "000001.bin.gz").touch()
    with pytest.raises(LogError, match=r"000001\.bin and 000001\.bin\.gz, the same frame twice; take one of them away"):
        open_log(tmp_path)


# Hidden files


@pytest.mark.parametrize("ending", [".bin", ".pcd.bin"])
def test_hidden_files_are_no_frames(ending: str, tmp_path: Path) -> None:
    for name in ("._000000", "._000001", ".000002"):
        (tmp_path / f"{name}{ending}").write_bytes(b"\0\5\x16\7" + bytes(4092))
    assert seen(frames_in(tmp_path, ["000000", "000001"], ending)) == [1.0, 2.0]
    with pytest.raises(LogError, match=r"is what macOS keeps beside 000000.*, and no log; leave it out"):
        open_log(tmp_path / f"._000000{ending}")


# The summary


@pytest.mark.parametrize(("options", "expected"), [({}, True), ({"rate": 10.0}, False)])
def test_an_assumed_rate_is_said_in_the_summary(
    options: dict[str, float], expected: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    frames_in(tmp_path, ["000000", "000001"])
    replay = Replay(tmp_path, Settings(log_options=options))
    assert len(list(replay)) == 2
    print_used(replay, open_console())
    print_summary(replay, open_console())
    assert ("ASSUMED     10 frames a second, as neither the names" in capsys.readouterr().out) == expected
