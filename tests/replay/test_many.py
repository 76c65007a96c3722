"""Many logs: each has one result, whatever replays them; the dataset is whole, and what is done is left out."""

import csv
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Any

import pyarrow.dataset
import pyarrow.parquet
import pytest

from tests.support.bags import drive, write
from tests.support.fleet import contents, logs_of_every_kind
from ttc_fast.cli import main
from ttc_fast.logs import LogError
from ttc_fast.logs.storage import written_whole
from ttc_fast.replay import (
    Files,
    Progress,
    Replay,
    Replayed,
    Row,
    Settings,
    Summary,
    many,
    replay_many,
    sample,
    terminal,
    to_pandas,
)
from ttc_fast.replay.executors import Processes, WorkerLostError
from ttc_fast.replay.row import plain

SCANS, CLOUDS = sample("scans"), sample("clouds")


class Here(Executor):
    """Does what is submitted at once, or what a test lets it do instead."""

    def __init__(self, instead: Callable[[Any], Any] = many.replay_one) -> None:
        self.instead, self.tasks = instead, []  # type: ignore[var-annotated]
        self._threads = ThreadPoolExecutor(1)

    def submit(self, function: Any, /, *arguments: Any, **_: Any) -> Any:
        assert function is many.replay_one
        (task,) = arguments
        self.tasks.append(task)
        return self._threads.submit(self.instead, task)


def test_every_kind_of_log_has_a_part_and_a_line(tmp_path: Path) -> None:
    logs = logs_of_every_kind(tmp_path / "logs")
    results = replay_many(logs, out=tmp_path / "out", jobs=2)
    assert [each.log for each in results] == list(map(str, logs))
    table = pyarrow.parquet.read_table(tmp_path / "out" / "logs.parquet").to_pylist()
    assert [line["log"] for line in table] == sorted(map(str, logs))
    by_log = {line["log"]: line for line in table}
    every = [list(row.values()) for row in pyarrow.dataset.dataset(tmp_path / "out" / "rows").to_table().to_pylist()]
    for log in logs:
        replay = Replay(log)
        rows: list[Row] = []
        with suppress(LogError):
            rows.extend(replay)
        line, summary = by_log[str(log)], replay.summary
        mine = [list(map(repr, values)) for name, *values in every if name == str(log)]
        assert mine == [list(map(repr, plain(row))) for row in rows]
        assert (line["frames"], line["brakes"], line["tet"]) == (summary.frames, summary.brakes, summary.exposed)
        assert (line["reason"], line["exit_code"]) == (summary.lost, 5 if summary.lost else 0)
        assert [each["frame"] for each in line["events"]] == [event.begin.frame for event in summary.events]
        assert line["size"] == Path(log).stat().st_size


def test_columns_are_typed_and_have_units(tmp_path: Path) -> None:
    replay_many([SCANS], out=tmp_path, jobs=1)
    (part,) = (tmp_path / "rows").iterdir()
    schema = pyarrow.parquet.read_schema(part)
    assert schema.names == ["log", *Row._fields]
    units = json.loads(schema.metadata[b"units"])
    assert (units["ttc"], units["closing_speed"], units["distance"], units["angle"]) == ("s", "m/s", "m", "rad")
    assert schema.field("ttc").metadata[b"unit"] == b"s"
    assert (str(schema.field("frame").type), str(schema.field("ttc").type)) == ("int64", "double")
    table = pyarrow.parquet.read_schema(tmp_path / "logs.parquet")
    assert table.field("tit").metadata[b"unit"] == b"s^2"


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_table_of_logs_in_a_file(suffix: str, tmp_path: Path) -> None:
    (tmp_path / "damaged.bag").write_bytes(b"#ROSBAG V2.0\n" + bytes(99))
    paths, file = [str(CLOUDS), str(SCANS), str(tmp_path / "damaged.bag")], tmp_path / f"deep/table{suffix}"
    assert main(["replay", *paths, "--summary", str(file)]) == 5
    if suffix == ".csv":
        with file.open(newline="") as lines:
            read: list[dict[str, Any]] = list(csv.DictReader(lines))
    else:
        read = pyarrow.parquet.read_table(file).to_pylist()
        assert [len(line["events"]) for line in read] == [1, 1, 0]
    assert [line["log"] for line in read] == paths
    assert [int(line["exit_code"]) for line in read] == [0, 0, 3]
    assert [int(line["frames"]) for line in read] == [12, 129, 0]
    assert float(read[1]["tet"]) == replay_many([SCANS], executor=Here())[0].summary.exposed
    assert "damaged.bag" in read[2]["reason"]
    assert not read[2]["least_ttc"]


def test_a_table_of_one_log(tmp_path: Path) -> None:
    file = tmp_path / "table.csv"
    assert main(["replay", str(SCANS), "--rows", "0", "--summary", str(file)]) == 0
    with file.open(newline="") as lines:
        (line,) = csv.DictReader(lines)
    assert (line["log"], line["frames"], line["brakes"], line["exit_code"]) == (str(SCANS), "129", "1", "0")


def test_a_table_is_csv_or_parquet_and_no_log(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(SCANS), "--summary", str(tmp_path / "table.xlsx")]) == 2
    assert "--summary must end in .csv or .parquet, got " in capsys.readouterr().err
    log = tmp_path / "distances.csv"
    log.write_text("stamp,distance\n0.0,9.0\n0.1,8.9\n")
    assert main(["replay", str(log), "--summary", str(log)]) == 2
    assert "is a log that is to be replayed; choose another --summary" in capsys.readouterr().err


class TestPandas:
    @pytest.fixture(autouse=True)
    def _has_pandas(self) -> None:
        pytest.importorskip("pandas", reason="needs the extra pandas: pip install '.[pandas]'")

    def test_rows(self) -> None:
        table, rows = to_pandas(Replay(CLOUDS)), list(Replay(CLOUDS))
        assert list(table.columns) == list(Row._fields)
        assert table["status"].tolist() == [row.status.name for row in rows]
        assert table["command"].tolist() == [row.command.name for row in rows]
        assert table["distance"].to_numpy() == pytest.approx([row.distance for row in rows], nan_ok=True)
        assert table["frame"].dtype.name == "Int64"
        assert [list(map(repr, line)) for line in to_pandas(rows).to_numpy()] == [
            list(map(repr, line)) for line in table.to_numpy()
        ]

    def test_logs(self) -> None:
        results = replay_many([SCANS, CLOUDS], executor=Here())
        table = to_pandas(results)
        assert table["log"].tolist() == list(map(str, (SCANS, CLOUDS)))
        assert table["exit_code"].tolist() == [0, 0]
        assert to_pandas([each.summary for each in results])["tet"].tolist() == table["tet"].tolist()

    def test_nothing_and_something_else(self) -> None:
        assert list(to_pandas([]).columns) == list(Row._fields)
        with pytest.raises(TypeError, match="items must be rows, summaries or results of replay_many, got int"):
            to_pandas([1, 2])  # type: ignore[arg-type]


def test_a_second_run_leaves_out_what_is_done(tmp_path: Path) -> None:
    log = write(tmp_path, "mcap", drive(20, 64))
    logs, out = [log, SCANS], tmp_path / "out"

    def skipped(**said: Any) -> list[bool]:
        before = contents(out) if out.exists() else {}
        results = replay_many(logs, **{"out": out, "executor": Here(), **said})
        if all(each.skipped for each in results):
            assert contents(out) == before
        return [each.skipped for each in results]

    assert skipped() == [False, False]
    assert skipped() == [True, True]
    assert skipped(again=True) == [False, False]
    assert skipped(settings=Settings(log_options={"speed": 2.0})) == [False, False]
    assert skipped() == [False, False]
    os.utime(log, (1.0, 1.0))
    assert skipped() == [False, True]
    assert [each.name for each in (out / "rows").iterdir() if each.suffix != ".parquet"] == []
    assert sorted(each.name for each in out.iterdir()) == ["logs.parquet", "rows"]


def test_a_log_that_is_done_has_the_summary_that_it_had(tmp_path: Path) -> None:
    first = replay_many([SCANS, CLOUDS], out=tmp_path, executor=Here())
    second = replay_many([SCANS, CLOUDS], out=tmp_path, executor=Here())
    for one, other in zip(first, second, strict=True):
        assert one.summary.to_json() == other.summary.to_json() == Summary.of_json(one.summary.to_json()).to_json()
        assert repr(one.summary.least) == repr(other.summary.least)
        assert repr(one.summary.events) == repr(other.summary.events)


def test_the_table_keeps_the_lines_of_earlier_runs_and_a_log_twice_is_one(tmp_path: Path) -> None:
    replay_many([SCANS], out=tmp_path, executor=Here())
    replay_many([CLOUDS, CLOUDS], out=tmp_path, executor=Here())
    table = pyarrow.parquet.read_table(tmp_path / "logs.parquet")
    assert table["log"].to_pylist() == sorted(map(str, (SCANS, CLOUDS)))
    assert len(list((tmp_path / "rows").iterdir())) == 2


def test_a_log_that_is_missing_or_damaged_is_in_the_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "damaged.bag").write_bytes(b"#ROSBAG V2.0\n" + bytes(99))
    paths = [str(tmp_path / "nowhere.bag"), str(tmp_path / "damaged.bag"), str(SCANS)]
    assert main(["replay", *paths, "--out", str(tmp_path / "out")]) == 5
    assert "of 3 logs 2 could not be read whole" in capsys.readouterr().err
    table = pyarrow.parquet.read_table(tmp_path / "out" / "logs.parquet").to_pylist()
    lines = {Path(line["log"]).name: line for line in table}
    assert lines["nowhere.bag"]["reason"].endswith("no such file or folder")
    assert [lines[name]["exit_code"] for name in ("nowhere.bag", "damaged.bag", "approach.npz")] == [3, 3, 0]
    assert [lines[name]["part"] is None for name in ("nowhere.bag", "damaged.bag")] == [True, False]


@pytest.mark.parametrize("damage", [b"", b"\xff" * 1000, None], ids=["empty", "no Parquet", "a folder"])
@pytest.mark.parametrize("name", ["logs.parquet", "rows/*.parquet"])
def test_a_damaged_result_of_an_earlier_run_is_made_again_or_named(
    name: str, damage: bytes | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["replay", str(SCANS), str(CLOUDS), "--jobs", "1", "--rows", "0", "--out", str(tmp_path)]
    assert main(arguments) == 0
    whole = contents(tmp_path)
    for path in tmp_path.glob(name):
        path.unlink()
        if damage is None:
            path.mkdir()
        else:
            path.write_bytes(damage)
    is_in_the_way = damage is None and name == "logs.parquet"
    assert main(arguments) == is_in_the_way
    if is_in_the_way:
        assert "logs.parquet: Is a directory; choose another --out" in capsys.readouterr().err
    else:
        assert contents(tmp_path) == whole


def test_an_outdated_part_is_gone_when_its_log_cannot_be_read_any_more(tmp_path: Path) -> None:
    log, out = write(tmp_path, "mcap", drive(20, 64)), tmp_path / "out"
    replay_many([log], out=out, executor=Here())
    log.unlink()
    (result,) = replay_many([log], out=out, executor=Here())
    assert result.exit_code == 3
    assert list((out / "rows").iterdir()) == []


def lost_once(task: many.Task) -> Replayed:
    if not task.attempt:
        raise WorkerLostError("its process was killed by signal 9")
    return many.replay_one(task)


def lost_always(task: many.Task) -> Replayed:
    if task.log.endswith("following.npz") if isinstance(task.log, str) else task.log.name == "following.npz":
        raise WorkerLostError("its process was killed by signal 9")
    return many.replay_one(task)


def test_a_lost_task_is_tried_again_and_at_last_named(tmp_path: Path) -> None:
    results = replay_many([SCANS, CLOUDS], out=tmp_path / "once", executor=Here(lost_once))
    assert [each.exit_code for each in results] == [0, 0]
    results = replay_many([SCANS, CLOUDS], out=tmp_path / "always", executor=Here(lost_always))
    assert [each.exit_code for each in results] == [0, 1]
    table = pyarrow.parquet.read_table(tmp_path / "always" / "logs.parquet").to_pylist()
    assert (
        table[1]["reason"]
        == f"{CLOUDS}: failed 4 times, at last by WorkerLostError: its process was killed by signal 9"
    )
    assert (table[1]["exit_code"], table[1]["part"]) == (1, None)


def test_an_executor_that_is_gone_ends_in_a_table_that_names_every_log(tmp_path: Path) -> None:
    executor = ThreadPoolExecutor(1)
    executor.shutdown()
    results = replay_many([SCANS, CLOUDS], out=tmp_path, executor=executor)
    assert [each.exit_code for each in results] == [1, 1]
    assert all("cannot schedule new futures" in each.summary.lost for each in results)
    assert len(pyarrow.parquet.read_table(tmp_path / "logs.parquet")) == 2


def test_an_interrupt_leaves_a_table_that_names_what_was_not_done(tmp_path: Path) -> None:
    def interrupted(_: Progress) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        replay_many([SCANS, CLOUDS], out=tmp_path, executor=Here(), progress=interrupted)
    table = pyarrow.parquet.read_table(tmp_path / "logs.parquet").to_pylist()
    assert len(table) == 2
    assert {line["exit_code"] for line in table} <= {0, 130}
    assert any(line["exit_code"] == 130 for line in table)


@pytest.mark.skipif(sys.platform == "win32", reason="needs signals of POSIX")
def test_a_process_that_is_killed_takes_no_other_task_with_it(tmp_path: Path) -> None:
    executor = Processes(2)
    try:
        beside = executor.submit(time.sleep, 1.0)
        killed = executor.submit(signal.raise_signal, signal.SIGKILL)
        with pytest.raises(WorkerLostError, match="killed by signal 9, perhaps because memory ran out"):
            killed.result(30)
        assert executor.submit(abs, -1).result(30) == 1
        assert beside.result(30) is None
        with pytest.raises(FileNotFoundError):
            executor.submit(os.stat, str(tmp_path / "nowhere")).result(30)
    finally:
        executor.shutdown()


def test_what_is_written_is_whole_or_absent(tmp_path: Path) -> None:
    place, aside = tmp_path / "part.parquet", tmp_path / ".unfinished"

    def write_half() -> None:
        with written_whole(place, aside) as file:
            file.write_text("half")
            assert not place.exists()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_half()
    assert not place.exists()
    assert list(aside.iterdir()) == []
    with written_whole(place, aside) as file:
        file.write_text("whole")
    assert place.read_text() == "whole"


def test_jobs_are_for_this_machine(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(SCANS), "--scheduler", "tcp://127.0.0.1:1", "--jobs", "2"]) == 2
    assert "--jobs cannot be combined with --scheduler" in capsys.readouterr().err


def test_each_log_has_files_of_its_own(tmp_path: Path) -> None:
    replay_many([SCANS, CLOUDS], files=Files(rows=str(tmp_path / "rows.csv"), plot=tmp_path / "picture.png"), jobs=1)
    written = [
        f"{stem}-{log.name}{end}" for stem, end in (("picture", ".png"), ("rows", ".csv")) for log in (SCANS, CLOUDS)
    ]
    assert sorted(path.name for path in tmp_path.iterdir()) == written
    with pytest.raises(TypeError, match=r"files must be Files, such as Files\(plot='drive.png'\), got 'rows.csv'"):
        replay_many([SCANS], files="rows.csv")  # type: ignore[arg-type]


def test_a_worker_of_another_version_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def old(task: many.Task) -> Replayed:
        with monkeypatch.context() as patch:
            patch.setattr(many, "__version__", "0.0.1")
            return many.replay_one(task)

    (result,) = replay_many([SCANS], out=tmp_path, executor=Here(old))
    assert result.exit_code == 1
    assert "the worker has ttc_fast 0.0.1" in result.summary.lost


def test_without_a_terminal_there_is_a_line_a_minute(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(terminal, "LINE_EACH", 0.0)
    assert main(["replay", str(SCANS), str(CLOUDS), "--jobs", "1"]) == 0
    lines = capsys.readouterr().err.splitlines()
    assert re.fullmatch(r"\d\d:\d\d:\d\d 2 of 2 logs, 141 frames, [\d.e+-]+ logs/s, 0:00:00 left", lines[-1])


def test_no_more_than_a_window_is_submitted_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(many, "WINDOW", 3)
    executor, seen = Here(), []

    def show(progress: Progress) -> None:
        seen.append(len(executor.tasks) - progress.logs)

    assert len(replay_many([SCANS] * 10, executor=executor, progress=show)) == 10
    assert max(seen) <= 3


UNGUARDED = f"""
from ttc_fast.replay import replay_many
print([each.summary.frames for each in replay_many([{str(SCANS)!r}, {str(CLOUDS)!r}], **HOW)])
"""


@pytest.mark.parametrize("by", ["file", "standard input"])
def test_a_script_without_the_guard_is_told_so_once_and_ends(by: str, tmp_path: Path) -> None:
    def ended(how: str) -> "subprocess.CompletedProcess[str]":
        script = tmp_path / "script.py"
        script.write_text(UNGUARDED.replace("HOW", how))
        with script.open() as source:
            command = [sys.executable, *([str(script)] if by == "file" else ["-"])]
            return subprocess.run(command, stdin=source, capture_output=True, text=True, check=False, timeout=60)

    told = ended("{'jobs': 2}")
    assert (told.returncode, told.stdout) == (1, "")
    assert 'if __name__ == "__main__":\n\nin a file, or give jobs=1' in told.stderr
    assert told.stderr.count("Traceback") == 2  # that of the first process, and that of the script
    assert ended("{'jobs': 1}").stdout == "[129, 12]\n"


def test_one_log_is_replayed_in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(many, "Processes", pytest.fail)
    seen: list[int] = []
    for paths, jobs, shown in ((SCANS, None, [1]), (str(SCANS), None, [1]), ([SCANS, CLOUDS], 1, [1, 2])):
        seen.clear()
        replay_many(paths, jobs=jobs, progress=lambda progress: seen.append(progress.logs))
        assert seen == shown


def test_a_pattern_is_looked_up_whatever_quotes_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("b.csv", "a.csv", "deep/c.csv", "[odd].csv"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("stamp,distance\n0.0,9.0\n0.1,8.9\n")

    def logs(*names: str) -> list[str]:
        return [str(Path(each.log).relative_to(tmp_path)) for each in replay_many([tmp_path / name for name in names])]

    assert logs("?.csv") == ["a.csv", "b.csv"]
    assert logs("**/[bc].csv") == ["b.csv", "deep/c.csv"]
    assert logs("[odd].csv") == ["[odd].csv"]
    assert main(["replay", str(tmp_path / "*.bag")]) == 3
    assert capsys.readouterr().err == f"ttc-fast: {tmp_path}/*.bag: nothing matches it\n"


def test_several_logs_ignore_the_options_that_they_have_no_use_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "gaps.csv").write_text("stamp,distance\n" + "".join(f"{i / 10},{9 - i / 10}\n" for i in range(9)))
    table, nowhere = str(tmp_path / "gaps.csv"), str(tmp_path / "nope.bag")
    said = ["--outline", "-0.1", "0.4", "-0.15", "0.15", "--gate-y", "-1", "1", "--sensor-height", "1.73"]
    said += ["--criterion", "SweptPathThreshold:threshold=1.2"]
    out = ["--out", str(tmp_path / "out"), "--jobs", "1"]
    assert main(["replay", table, *said[:5], *out]) == 3
    assert "a table of distances has no use for --outline" in capsys.readouterr().out
    assert main(["replay", table, str(SCANS), str(CLOUDS), nowhere, *said, *out]) == 5
    told = capsys.readouterr()
    assert "of 4 logs 1 could not be read whole" in told.err
    assert f"failed      {nowhere}: cannot be opened" in told.out
    assert f"ASSUMED     {table}: SweptPathThreshold(threshold=1.2) needs a scan" in told.out
    lines = {line["log"]: line for line in pyarrow.parquet.read_table(tmp_path / "out" / "logs.parquet").to_pylist()}
    assert [(lines[log]["frames"], lines[log]["exit_code"]) for log in (table, str(SCANS), str(CLOUDS))] == [
        (9, 0),
        (129, 0),
        (12, 0),
    ]
