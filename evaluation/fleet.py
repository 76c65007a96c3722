"""Hundreds of logs of every format: one process, clusters whose workers are killed, a bucket that refuses.

Whatever replays them, the dataset has to be what one process writes: the same files, byte for byte; from a bucket,
where paths and times differ, the same rows. Prints what it costs. ``TTC_FAST_DATA`` names the recordings; the extras
``test`` and ``fleet-test`` are needed.

    python -m evaluation.fleet --logs 400
"""

from __future__ import annotations

import argparse
import os
import pickle
import resource
import shutil
import tempfile
import time
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow.parquet

from evaluation.recorded import DATA
from tests.support.bags import drive, write
from tests.support.bucket import bucket
from tests.support.cluster import Cluster, cluster_in
from tests.support.fleet import contents, kill_worker, killing
from tests.support.log_files import FILES
from ttc_fast.configuration import Configuration
from ttc_fast.replay import Files, Settings, many, replay_many, sample
from ttc_fast.replay.executors import Scheduler

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ttc_fast.replay import Replayed

DAMAGED = 5
KILL_EACH = 3.0
"""s between two kills."""
SETTINGS = Settings(Configuration.of({"gate": {"x": [2.0, 60.0], "y": [-2.0, 2.0], "z": [-1.5, 0.5]}}))
RECORDED = (
    "laserscan/freiburg-101-corrected.log.gz",
    "laserscan/breezyslam_exp1.npz",
    "laserscan/leg_tracker_positive_2.bag",
    "clouds/nebula_vlp16.pcd",
    "clouds/nuscenes_lidar_top.pcd.bin",
    "kitti/velodyne_raw",
)


def make_logs(folder: Path, count: int) -> list[Path]:
    """Write copies of the recorded and simulated logs, a few of them damaged."""
    originals = [sample("scans"), sample("clouds"), *(DATA / each for each in RECORDED)]
    for kind in ("bag", "bag.lz4", "db3", "mcap", "mcap.zstd"):
        place = folder / "originals" / kind
        place.mkdir(parents=True)
        originals.append(write(place, kind, drive(300, 270)))
    for name in ("log.log", "log.csv"):
        originals.append(folder / "originals" / name)
        originals[-1].write_bytes(FILES[name])
    logs = []
    for number in range(count):
        original = originals[number % len(originals)]
        log = folder / "logs" / f"{number:04}" / original.name
        log.parent.mkdir(parents=True)
        (shutil.copytree if original.is_dir() else shutil.copyfile)(original, log)
        logs.append(log)
    files = [log for log in logs if log.suffix in (".bag", ".gz", ".npz", ".mcap", ".pcd")]
    for log in files[:: len(files) // DAMAGED][:DAMAGED]:
        log.write_bytes(log.read_bytes()[: log.stat().st_size // 2])
    return logs


@contextmanager
def two_workers(cluster: Cluster, *, killed: bool) -> Iterator[list[int]]:
    """Run two workers, and kill one every few seconds, which a supervisor starts again; yield how many were killed."""
    workers = [cluster.start_worker(), cluster.start_worker()]

    def kill(number: int) -> bool:
        workers[number % 2].kill()
        workers[number % 2].wait()
        workers[number % 2] = cluster.start_worker()
        return True

    with killing(KILL_EACH, kill) if killed else nullcontext([0]) as kills:
        yield kills


def cpu() -> float:
    """Return the CPU time of this process and of those that it has waited for, s."""
    return sum(sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def timed(paths: list[Any], out: Any, **how: Any) -> tuple[float, list[Replayed]]:
    begin = time.perf_counter()
    results = replay_many(paths, SETTINGS, out=out, **how)
    return time.perf_counter() - begin, results


def same(what: str, out: Path, expected: dict[str, bytes], seconds: float, count: int, more: str = "") -> None:
    """Print what a run took, and whether it wrote the expected files."""
    found = contents(out)
    equal = "every file equal" if found == expected else "FILES DIFFER"
    print(f"{what:34} {seconds:8.1f} s {seconds / count:8.3f} s/log  {equal}{more}", flush=True)
    if found != expected:
        raise SystemExit(f"{what}: {[name for name in expected | found if expected.get(name) != found.get(name)]}")


def on_local_cluster(logs: list[Path], out: Path, expected: dict[str, bytes]) -> None:
    """Replay on a LocalCluster of processes, of which one is killed every few seconds."""
    from distributed import Client, LocalCluster

    how = {"threads_per_worker": 1, "processes": True, "dashboard_address": None}
    with (
        LocalCluster(n_workers=2, **how) as cluster,
        Client(cluster) as client,
        killing(KILL_EACH, partial(kill_worker, client)) as kills,
    ):
        seconds, _ = timed(logs, out, executor=client.get_executor())
    same("LocalCluster, workers killed", out, expected, seconds, len(logs), f", {kills[0]} kills")


def parts_of(dataset: Path) -> dict[str, str]:
    """Return the part of each log."""
    return {line["log"]: line["part"] for line in pyarrow.parquet.read_table(dataset / "logs.parquet").to_pylist()}


def in_bucket(logs: list[Path], folder: Path, one: list[Replayed]) -> None:
    """Replay from and into a bucket that refuses every 29th request, on two processes of this machine."""
    import s3fs

    with bucket(29) as environment:
        os.environ.update(environment)
        s3fs.S3FileSystem.clear_instance_cache()
        files = s3fs.S3FileSystem()
        files.mkdir("fleet")
        files.mkdir("results")
        for log in logs:
            files.put(str(log), f"fleet/{log.parent.name}/{log.name}", recursive=log.is_dir())
        urls = [f"s3://fleet/{log.parent.name}/{log.name}" for log in logs]
        seconds, results = timed(urls, "s3://results/rows", jobs=2)
        files.get("results/rows", str(folder / "bucket"), recursive=True)
    differ = 0
    for there, here in zip(results, one, strict=True):
        moved = here.summary.to_json().replace(here.log, there.log)
        differ += (there.exit_code, there.summary.to_json()) != (here.exit_code, moved)
    of_bucket, of_one = (parts_of(folder / name) for name in ("bucket", "one"))
    for there, here in zip(results, one, strict=True):
        rows = [
            pyarrow.parquet.read_table(folder / name / "rows" / part).drop_columns("log").to_pylist()
            for name, part in (("bucket", of_bucket[there.log]), ("one", of_one[here.log]))
        ]
        differ += repr(rows[0]) != repr(rows[1])
    equal = "every row equal" if not differ else f"{differ} DIFFER"
    print(
        f"{'bucket, every 29th request 503':34} {seconds:8.1f} s {seconds / len(logs):8.3f} s/log  {equal}", flush=True
    )


def main() -> None:
    """Run everything."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--logs", type=int, default=400)
    count = parser.parse_args().logs
    folder = Path(tempfile.mkdtemp(prefix="ttc-fast-fleet-"))
    try:
        logs = make_logs(folder, count)
        size = sum(file.stat().st_size for file in (folder / "logs").rglob("*") if file.is_file())
        print(f"{count} logs, {size / 1e6:.0f} MB; load of the machine {os.getloadavg()[0]:.1f}", flush=True)
        before = cpu()
        seconds, one = timed(logs, folder / "one", jobs=1)
        of_one = cpu() - before
        expected = contents(folder / "one")
        same("one process", folder / "one", expected, seconds, count, f", CPU {of_one:.1f} s")
        codes = {code: sum(each.exit_code == code for each in one) for code in sorted({each.exit_code for each in one})}
        task = many.Task(0, logs[0], Files(), SETTINGS, None, False, False)
        sent, back = len(pickle.dumps(task)), sum(len(pickle.dumps(each)) for each in one) / count
        written = sum(map(len, expected.values())) / count
        what = f"task {sent} bytes, result {back:.0f}, part and line {written:.0f}"
        print(f"exit codes {codes}; a log: {what}", flush=True)
        before = cpu()
        two, _ = timed(logs, folder / "two", jobs=2)
        more = f", {two / seconds:.2f} of one; CPU {(cpu() - before) / of_one:.2f} of one"
        same("two processes", folder / "two", expected, two, count, more)
        before = cpu()
        with (
            cluster_in(folder) as cluster,
            two_workers(cluster, killed=False),
            Scheduler.at(cluster.address) as executor,
        ):
            dask, _ = timed(logs, folder / "dask", executor=executor)
        more = f", {dask / seconds:.2f} of one; CPU with all that starts {(cpu() - before) / of_one:.2f} of one"
        same("dask scheduler, two workers", folder / "dask", expected, dask, count, more)
        with cluster_in(folder) as cluster:
            cluster.start_worker()
            with Scheduler.at(cluster.address) as executor:
                alone, _ = timed(logs, folder / "again", executor=executor)
                skips, _ = timed(logs, folder / "again", executor=executor)
        same("dask scheduler, one worker", folder / "again", expected, alone, count, f", {alone / seconds:.2f} of one")
        here, _ = timed(logs, folder / "two", jobs=1)
        left_out, on_dask = here / count * 1e3, skips / count * 1e3
        print(f"what is done left out: {left_out:.1f} ms a log; {on_dask:.1f} ms on one worker of Dask", flush=True)
        with (
            cluster_in(folder) as cluster,
            two_workers(cluster, killed=True) as kills,
            Scheduler.at(cluster.address) as executor,
        ):
            killed, _ = timed(logs, folder / "killed", executor=executor)
        same("the same, workers killed", folder / "killed", expected, killed, count, f", {kills[0]} kills")
        on_local_cluster(logs, folder / "local", expected)
        in_bucket(logs, folder, one)
    finally:
        shutil.rmtree(folder)


if __name__ == "__main__":
    main()
