"""Recordings for Foxglove: read back by MCAP's own reader, and by Rerun's, with the rows and the times of the log."""

import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.bags import BEGIN, Cloud, Scan, Static, drive, write
from ttc_fast.cli import main
from ttc_fast.replay import Files, Replay, Row, Settings, sample
from ttc_fast.replay.output import play
from ttc_fast.replay.row import plain
from ttc_fast.sensors.transforms import turn_of

reader: Any = pytest.importorskip("mcap.reader", reason="needs the extra log: pip install '.[log]'")
protobuf: Any = pytest.importorskip(
    "mcap_protobuf.decoder", reason="needs the extra foxglove: pip install '.[foxglove]', or make fleet"
)
pytest.importorskip("foxglove_schemas_protobuf", reason="needs the extra foxglove: pip install '.[foxglove]'")


def record(path: Path, file: Path, **settings: Any) -> tuple[Replay, list[Row]]:
    replay, rows = Replay(path, Settings(**settings)), []

    def each() -> Any:
        for row in replay:
            rows.append(row)
            yield row

    play(replay, each(), Files(mcap=file))
    return replay, rows


def messages(file: Path) -> dict[str, list[tuple[int, Any]]]:
    """Read when each message was recorded, and what it says, by topic."""
    found: dict[str, list[tuple[int, Any]]] = {}
    with file.open("rb") as opened:
        for _, channel, message, decoded in reader.make_reader(
            opened, decoder_factories=[protobuf.DecoderFactory()]
        ).iter_decoded_messages(log_time_order=False):
            found.setdefault(channel.topic, []).append((message.log_time, decoded))
    return found


def check_rows(said: list[tuple[int, Any]], rows: list[Row]) -> None:
    assert len(said) == len(rows)
    for (_, message), row in zip(said, rows, strict=True):
        for name, value in zip(Row._fields, plain(row), strict=True):
            if value is None:
                assert not message.HasField(name)
            elif isinstance(value, float) and not math.isfinite(value):
                assert math.isnan(getattr(message, name))
            else:
                assert getattr(message, name) == value


@pytest.mark.parametrize("name", ["scans", "clouds"])
def test_a_recording_has_every_row_scene_and_change(name: str, tmp_path: Path) -> None:
    replay, rows = record(sample(name), tmp_path / "drive.mcap")
    found = messages(tmp_path / "drive.mcap")
    check_rows(found["/ttc/decision"], rows)
    for topic in ("/ttc/decision", "/ttc/vehicle", "/ttc/points"):
        assert [time for time, _ in found[topic]] == [round(row.stamp * 1e9) for row in rows]
    changes = [b for a, b in zip([None, *rows], rows, strict=False) if a is None or a[6:8] != b[6:8]]
    assert [said.message.split(",")[0] for _, said in found["/ttc/log"]] == [
        f"{row.command.name}: {row.reason.name}" for row in changes
    ]
    assert "/ttc/tf" not in found  # it is no bag, and has no frames
    assert replay.key_frame is not None
    braked = replay.key_frame[0].frame
    (drawing,) = found["/ttc/vehicle"][braked][1].entities
    assert drawing.frame_id == "base_link"
    assert drawing.spheres[0].color.r > 0.0
    assert len(drawing.lines) == (6 if name == "scans" else 2)  # the outline, and its path or the gate
    cloud = found["/ttc/points"][braked][1]
    points = np.frombuffer(cloud.data, [(each.name, "<f4" if each.type == 7 else "u1") for each in cloud.fields])
    assert cloud.point_stride == points.itemsize
    at = drawing.spheres[0].pose.position
    alarming = points[points["green"] == 0x5E]
    assert 0 < len(alarming) < len(points)
    assert np.abs(alarming["x"] - at.x).min() < 0.5


@pytest.mark.parametrize("kind", ["bag", "db3", "mcap"])
@pytest.mark.parametrize("clock", ["header", "recorded"])
def test_times_are_those_at_which_the_bag_recorded_its_scans(kind: str, clock: str, tmp_path: Path) -> None:
    late = [replace(item, recorded=item.recorded + 7.25) for item in drive(30)]  # stamped by another clock
    path = write(tmp_path, kind, late)
    file = tmp_path / "out" / "drive.mcap"
    replay, rows = record(path, file, log_options={"clock": clock})
    found = messages(file)
    times = [BEGIN + round(item.recorded * 1e9) for item in late if isinstance(item, Scan)]
    stamps = [BEGIN + round(item.stamp * 1e9) for item in late if isinstance(item, Scan) and item.stamp is not None]
    for topic in ("/ttc/decision", "/ttc/vehicle", "/ttc/points"):
        assert [time for time, _ in found[topic]] == times
    check_rows(found["/ttc/decision"], rows)
    drawn = [said.entities[0].timestamp.ToNanoseconds() for _, said in found["/ttc/vehicle"]]
    np.testing.assert_allclose(np.array(drawn) - np.array(stamps if clock == "header" else times), 0, atol=1000)
    count = [len(said.data) // said.point_stride for _, said in found["/ttc/points"]]
    assert max(count) < 64  # the bag has the others
    assert list(file.parent.iterdir()) == [file]
    assert len(rows) == replay.summary.frames == 30


@pytest.mark.parametrize("upside_down", [False, True])
def test_where_the_sensor_is_is_said_unless_the_bag_says_it(upside_down: bool, tmp_path: Path) -> None:
    path = write(tmp_path, "mcap", drive(5))
    file = tmp_path / "drive.mcap"
    record(path, file, log_options={"mount": (0.5, 0.1, 0.2), "upside_down": upside_down, "base_frame": "car"})
    found = messages(file)
    ((_, placed),) = found["/ttc/tf"]
    assert (placed.parent_frame_id, placed.child_frame_id) == ("car", "laser")
    turn = turn_of(placed.rotation.x, placed.rotation.y, placed.rotation.z, placed.rotation.w)
    assert (placed.translation.x, placed.translation.y, placed.translation.z) == (0.5, 0.1, 0.0)
    np.testing.assert_allclose(turn[:2, 0], [np.cos(0.2), np.sin(0.2)], atol=1e-9)
    assert turn[2, 2] == pytest.approx(-1.0 if upside_down else 1.0)
    assert found["/ttc/vehicle"][0][1].entities[0].frame_id == "car"
    (tmp_path / "placed").mkdir()
    path = write(tmp_path / "placed", "mcap", [Static(0.0, 0.0), *drive(5)])
    record(path, file)
    assert "/ttc/tf" not in messages(file)


def test_clouds_are_drawn_in_the_frame_of_the_vehicle(tmp_path: Path) -> None:
    points = np.array([(6.0, y, z) for y in (-0.5, 0.0, 0.5) for z in (-1.0, -0.8)] * 3, [(n, "<f4") for n in "xyz"])
    path = write(tmp_path, "mcap", [Cloud(i / 10, i / 10, points) for i in range(4)])
    where = {"outline": (-1.0, 3.0, -1.0, 1.0), "mount": (1.0, 0.0, 0.0)}
    record(path, tmp_path / "out.mcap", log_options={"speed": 10.0, "sensor_height": 1.7, **where})
    found = messages(tmp_path / "out.mcap")
    assert found["/ttc/tf"][0][1].translation.x == 1.0
    cloud = found["/ttc/points"][-1][1]
    np.testing.assert_allclose(np.frombuffer(cloud.data, "<f4").reshape(-1, 4)[:, 0], 7.0)


def test_a_table_of_distances_before_zero_has_decisions_only(tmp_path: Path) -> None:
    table = tmp_path / "gaps.csv"
    table.write_text("stamp,distance\n" + "".join(f"{i / 10 - 1},{20 - i / 2}\n" for i in range(20)))
    _, rows = record(table, tmp_path / "of.mcap")
    found = messages(tmp_path / "of.mcap")
    assert set(found) == {"/ttc/decision", "/ttc/log"}
    assert [time for time, _ in found["/ttc/decision"]] == [i * 100_000_000 for i in range(20)]
    check_rows(found["/ttc/decision"], rows)


def test_rows_are_the_same_and_several_logs_have_a_recording_each(tmp_path: Path) -> None:
    logs = [str(sample("scans")), str(sample("clouds"))]
    assert main(["replay", *logs, "--mcap", str(tmp_path / "of.mcap"), "--jobs", "1"]) == 0
    assert {each.name for each in tmp_path.iterdir()} == {"of-approach.npz.mcap", "of-following.npz.mcap"}
    arguments = ["replay", logs[0], "--rows", "0", "--out"]
    assert main([*arguments, str(tmp_path / "rows.csv"), "--mcap", str(tmp_path / "of.mcap")]) == 0
    assert main([*arguments, str(tmp_path / "alone.csv")]) == 0
    assert (tmp_path / "rows.csv").read_bytes() == (tmp_path / "alone.csv").read_bytes()


def test_a_damaged_log_has_a_whole_recording_and_an_interrupted_one_none(tmp_path: Path) -> None:
    path = write(tmp_path, "bag", drive(400))
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    file = tmp_path / "out" / "of.mcap"
    replay, rows = record(path, file)
    assert replay.summary.lost
    check_rows(messages(file)["/ttc/decision"], rows)
    assert 10 < len(rows) < 400
    file.unlink()
    replay = Replay(sample("scans"))

    def interrupted() -> Any:
        for row in replay:
            if row.frame == 50:
                raise KeyboardInterrupt
            yield row

    with pytest.raises(KeyboardInterrupt):
        play(replay, interrupted(), Files(mcap=file))
    assert list(file.parent.iterdir()) == []


def test_a_name_that_is_no_recording_or_the_log_itself_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["replay", str(sample("scans")), "--mcap", str(tmp_path / "drive.bag")]) == 2
    assert "--mcap must end in .mcap" in capsys.readouterr().err
    log = write(tmp_path, "mcap", drive(3))
    before = log.read_bytes()
    assert main(["replay", str(log), "--mcap", str(log)]) == 2
    assert "is a log that is to be replayed; choose another --mcap" in capsys.readouterr().err
    assert log.read_bytes() == before


def test_a_log_without_frames_leaves_no_recording(tmp_path: Path) -> None:
    table, file = tmp_path / "none.csv", tmp_path / "none.mcap"
    table.write_text("stamp,distance\n")
    assert main(["replay", str(table), "--mcap", str(file)]) == 3
    assert main(["replay", str(table), str(sample("scans")), "--jobs", "1", "--mcap", str(file)]) == 5
    assert sorted(each.name for each in tmp_path.iterdir()) == ["none-approach.npz.mcap", "none.csv"]


@pytest.mark.parametrize("begin", ["1e10", "1e16", "-1e300"])
def test_stamps_beyond_the_times_of_a_recording_are_named(
    begin: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table, file = tmp_path / "late.csv", tmp_path / "late.mcap"
    table.write_text(
        f"stamp,distance\n0,20\n{begin},19\n" if begin[0] != "-" else f"stamp,distance\n{begin},20\n0,19\n"
    )
    assert main(["replay", str(table), "--mcap", str(file)]) == 2
    said = "s, and a recording has times of at most 9.2e+09 s; leave the recording out"
    assert f"is at {float(begin):g} {said}" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [table]


@pytest.mark.parametrize("name", ["scans", "clouds"])
def test_rerun_which_has_a_reader_of_its_own_finds_nothing_wrong(name: str, tmp_path: Path) -> None:
    pytest.importorskip("rerun_cli", reason="needs the extra rerun: pip install '.[rerun]', or make fleet")
    file, converted = tmp_path / "drive.mcap", tmp_path / "drive.rrd"
    _, rows = record(sample(name), file)

    def rerun(*arguments: str) -> str:
        command = [sys.executable, "-m", "rerun_cli", *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout

    checked = rerun("mcap", "check", "--full", str(file))
    for topic in ("/ttc/decision", "/ttc/vehicle", "/ttc/points", "/ttc/log"):
        (line,) = (line for line in checked.splitlines() if topic in line)
        assert line.split()[0] == "ok"
    listed = rerun("mcap", "info", str(file))
    assert f"/ttc/decision {len(rows):>14}".split() == next(x.split()[1:3] for x in listed.splitlines() if "Row" in x)
    rerun("mcap", "convert", str(file), "-o", str(converted))
    said = rerun("rrd", "print", "-vvv", str(converted))
    for part in ("Points3D:positions", "Points3D:colors", "TextLog:text", "BRAKE: CRITERION"):
        assert part in said
