"""A fleet of logs on a real cluster and from a real S3 server: each log once, bit for bit what one process gives."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import pyarrow.parquet
import pytest

from tests.support.bucket import bucket
from tests.support.cluster import address_of, cluster_in, free_port
from tests.support.fleet import contents, kill_worker, killing, logs_of_every_kind
from ttc_fast.cli import main
from ttc_fast.logs import LogError, open_log, storage
from ttc_fast.replay import Replay, replay_many, sample

WHY = "needs the extra fleet and moto: pip install '.[fleet]' 'moto[server]', or make fleet"
dask: Any = pytest.importorskip("dask", reason=WHY)
distributed: Any = pytest.importorskip("distributed", reason=WHY)
pytest.importorskip("moto.server", reason=WHY)
s3fs: Any = pytest.importorskip("s3fs", reason=WHY)
pytestmark = pytest.mark.filterwarnings("default")  # those of others


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Some logs, most of them several times."""
    folder = tmp_path_factory.mktemp("logs")
    kinds = logs_of_every_kind(folder / "kinds")
    copies = []
    for number in range(12):
        log = kinds[number % len(kinds)]
        (folder / str(number)).mkdir()
        copies.append(folder / str(number) / log.name)
        copies[-1].write_bytes(log.read_bytes())
    return copies


@pytest.fixture(scope="module")
def expected(logs: list[Path], tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """What one process writes."""
    out = tmp_path_factory.mktemp("expected")
    results = replay_many(logs, out=out, jobs=1)
    assert sorted({each.exit_code for each in results}) == [0, 5]
    return contents(out)


def test_a_cluster_whose_workers_are_killed_gives_what_one_process_gives(
    logs: list[Path], expected: dict[str, bytes], tmp_path: Path
) -> None:
    with (
        distributed.LocalCluster(2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
        killing(0.3, partial(kill_worker, client)) as kills,
    ):
        for number in range(9):  # until some were killed
            if kills[0] > 2:
                break
            out = tmp_path / str(number)
            replay_many(logs, out=out, executor=client.get_executor())
            assert contents(out) == expected
    assert kills[0]


def test_the_scheduler_of_the_command_line_and_its_restart(
    logs: list[Path], expected: dict[str, bytes], tmp_path: Path
) -> None:
    """One worker is killed, and then the scheduler; a supervisor would start them again, as this does."""
    out, names = tmp_path / "out", list(map(str, logs))
    with cluster_in(tmp_path) as cluster:
        first, _ = cluster.start_worker(), cluster.start_worker()
        command = [sys.executable, "-m", "ttc_fast.cli", "replay", *names, "--out", str(out)]
        run = subprocess.Popen(
            [*command, "--scheduler", cluster.address], stdout=subprocess.PIPE, stderr=subprocess.PIPE
        )
        rows = out / "rows"
        deadline = time.monotonic() + 60.0
        while not rows.exists() or not any(rows.iterdir()):
            assert time.monotonic() < deadline
            assert run.poll() is None, run.communicate()
            time.sleep(0.05)
        first.kill()
        cluster.scheduler.kill()
        cluster.scheduler.wait()
        cluster.start(
            "scheduler", "--host", "127.0.0.1", "--port", cluster.address.rpartition(":")[2], "--no-dashboard"
        )
        cluster.start_worker()
        said, told = run.communicate(timeout=120)
    assert run.returncode == 5, told
    assert b"of 12 logs 1 could not be read whole" in told
    assert said.count(b"lost  ") >= 1
    assert contents(out) == expected


def test_a_scheduler_that_is_not_there_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    with dask.config.set({"distributed.comm.timeouts.connect": "1s"}):
        assert main(["replay", str(sample("scans")), "--scheduler", address_of(free_port())]) == 1
    assert "no Dask scheduler answers at tcp://127.0.0.1" in capsys.readouterr().err


@pytest.fixture
def s3(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """A bucket that refuses every thirteenth request."""
    s3fs.S3FileSystem.clear_instance_cache()
    with bucket(13) as environment:
        for name, value in environment.items():
            monkeypatch.setenv(name, value)
        files = s3fs.S3FileSystem()
        files.mkdir("fleet")
        files.mkdir("results")
        yield files
    s3fs.S3FileSystem.clear_instance_cache()


def test_logs_and_results_in_a_bucket_that_refuses_now_and_then(
    logs: list[Path], expected: dict[str, bytes], s3: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TTC_FAST_SCRATCH", str(tmp_path))
    logs = logs[:10]
    for log in logs:
        s3.put_file(str(log), f"fleet/{log.parent.name}/{log.name}")
    assert main(["replay", "s3://fleet/*/*", "--out", "s3://results/november", "--jobs", "2"]) == 5
    s3.get("results/november", str(tmp_path / "out"), recursive=True)
    table = pyarrow.parquet.read_table(tmp_path / "out" / "logs.parquet").to_pylist()
    folder = str(logs[0].parents[1])
    (tmp_path / "expected.parquet").write_bytes(expected["logs.parquet"])
    of_one_process = pyarrow.parquet.read_table(tmp_path / "expected.parquet").to_pylist()
    of_one_process = [line for line in of_one_process if line["log"] in map(str, logs)]

    def without_places(line: dict[str, Any]) -> dict[str, Any]:
        moved = {name: str(value).replace(folder, "s3://fleet") for name, value in line.items()}
        return {name: value for name, value in moved.items() if name not in ("part", "modified")}

    assert [without_places(line) for line in table] == sorted(
        map(without_places, of_one_process), key=lambda each: each["log"]
    )
    for line in table:
        here = [name for name in expected if name.startswith(f"rows/{line['log'].rpartition('/')[2]}-")]
        rows = pyarrow.parquet.read_table(tmp_path / "out" / "rows" / line["part"]).drop_columns("log")
        assert any(repr(_rows_of(expected[name]).to_pylist()) == repr(rows.to_pylist()) for name in here)
    assert main(["replay", "s3://fleet/*/*", "--out", "s3://results/november", "--jobs", "1"]) == 5
    left = [each.name for each in tmp_path.glob(f"{storage.PREFIX}*.lock")]  # the processes have cleared up
    assert len(left) <= 1


def _rows_of(content: bytes) -> Any:
    return pyarrow.parquet.read_table(pyarrow.BufferReader(content)).drop_columns("log")


def test_a_url_is_taken_wherever_a_path_is(s3: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    s3.put_file(str(sample("scans")), "fleet/approach.npz")
    s3.pipe_file("fleet/car.toml", b"[brake]\nhold = 1.0\n")
    s3.pipe_file("fleet/wrong.toml", b"[brake]\nheld = 1.0\n")
    log = open_log("s3://fleet/approach.npz")
    assert len(list(log)) == 129
    copy = log.path
    assert copy.exists()
    del log
    assert not copy.exists()
    assert repr(list(Replay("s3://fleet/approach.npz"))) == repr(list(Replay(sample("scans"))))
    arguments = ["replay", "s3://fleet/approach.npz", "--rows", "0"]
    assert (
        main(
            [
                *arguments,
                "--config",
                "s3://fleet/car.toml",
                "--out",
                "s3://fleet/rows.csv",
                "--plot",
                "s3://fleet/p.svg",
            ]
        )
        == 0
    )
    assert s3.cat_file("fleet/rows.csv").count(b"\n") == 130
    assert b"<svg" in s3.cat_file("fleet/p.svg")
    assert "log         s3://fleet/approach.npz: 129 frames" in capsys.readouterr().out
    assert main([*arguments, "--config", "s3://fleet/wrong.toml"]) == 2
    assert "s3://fleet/wrong.toml: brake" in capsys.readouterr().err
    assert main(["replay", "s3://fleet/nowhere.bag"]) == 3
    assert "s3://fleet/nowhere.bag: cannot be opened: no such file or folder" in capsys.readouterr().err
    assert main(["replay", "s3://fleet/2026-*/*.bag"]) == 3
    assert "s3://fleet/2026-*/*.bag: nothing matches it" in capsys.readouterr().err


def test_a_folder_of_clouds_with_its_list_of_stamps_comes_from_a_bucket(s3: Any, tmp_path: Path) -> None:
    (tmp_path / "drive" / "data").mkdir(parents=True)
    for number in range(3):
        (tmp_path / "drive" / "data" / f"{number:010}.bin").write_bytes(bytes(16 * 40))
    stamps = "".join(f"2011-09-26 13:02:25.{number}00000000\n" for number in range(3))
    (tmp_path / "drive" / "timestamps.txt").write_text(stamps)
    s3.put(str(tmp_path / "drive"), "fleet/drive", recursive=True)
    there, here = open_log("s3://fleet/drive/data"), open_log(tmp_path / "drive" / "data")
    assert [frame.stamp for frame in there] == [frame.stamp for frame in here]
    assert "timestamps.txt" in there.clock
    assert storage.size_and_time("s3://fleet/drive/data")[0] == storage.size_and_time(tmp_path / "drive" / "data")[0]


def test_a_bucket_that_only_refuses_is_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(storage, "PAUSES", (0.0,))
    monkeypatch.setattr("ttc_fast.replay.many.ATTEMPTS", 2)
    s3fs.S3FileSystem.clear_instance_cache()
    with bucket(1) as environment:
        for name, value in {**environment, "AWS_MAX_ATTEMPTS": "1"}.items():
            monkeypatch.setenv(name, value)
        monkeypatch.setattr(s3fs.S3FileSystem, "retries", 1)
        with ThreadPoolExecutor(1) as executor:
            paths = ["s3://fleet/a.bag", str(sample("scans"))]
            refused, fine = replay_many(paths, executor=executor, out=tmp_path)
    assert (refused.exit_code, fine.exit_code) == (3, 0)
    assert re.search(r"s3://fleet/a.bag: failed 2 times.*does not answer as it should, 2 times", refused.summary.lost)
    lines = pyarrow.parquet.read_table(tmp_path / "logs.parquet").to_pylist()
    assert [line["part"] is None for line in lines] == [False, True]


def test_a_log_that_is_larger_than_the_scratch_space_is_refused(s3: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    s3.put_file(str(sample("scans")), "fleet/approach.npz")
    monkeypatch.setenv("TTC_FAST_SCRATCH_GB", "1e-6")
    with pytest.raises(LogError, match=r"s3://fleet/approach.npz: has .* GB, and TTC_FAST_SCRATCH_GB allows 1e-06"):
        open_log("s3://fleet/approach.npz")


def test_what_a_killed_process_left_in_the_scratch_folder_goes(s3: Any, tmp_path: Path) -> None:
    s3.put_file(str(sample("scans")), "fleet/approach.npz")
    fetch = "import os, signal; from ttc_fast.logs import open_log; log = open_log('s3://fleet/approach.npz')"
    environment = {**os.environ, "TTC_FAST_SCRATCH": str(tmp_path)}
    killed = [sys.executable, "-c", f"{fetch}; os.kill(os.getpid(), signal.SIGKILL)"]
    assert subprocess.run(killed, env=environment, check=False).returncode == -signal.SIGKILL
    assert len(list(tmp_path.glob(f"{storage.PREFIX}*.lock"))) == 1
    time.sleep(1.1)
    subprocess.run([sys.executable, "-c", fetch], env=environment, check=True)
    assert list(tmp_path.iterdir()) == []
