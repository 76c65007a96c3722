"""Small logs of every kind for many at once, what a dataset holds, and workers that are killed meanwhile."""

from __future__ import annotations

import os
import signal
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from tests.support.bags import drive, write
from tests.support.log_files import FILES
from ttc_fast.replay import sample

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path


def logs_of_every_kind(folder: Path) -> list[Path]:
    """Write a log of every kind and a damaged one, and return them with the samples of the package."""
    logs = [sample("scans"), sample("clouds")]
    for kind in ("bag", "db3", "mcap"):
        (folder / kind).mkdir(parents=True)
        logs.append(write(folder / kind, kind, drive(20, 64)))
    for name in ("log.log", "log.log.gz", "log.csv"):
        logs.append(folder / name)
        logs[-1].write_bytes(FILES[name])
    damaged = folder / "damaged.bag"
    content = write(folder, "bag", drive(60, 256)).read_bytes()
    damaged.write_bytes(content[: len(content) // 2])
    (folder / "log.bag").unlink()
    return [*logs, damaged]


@contextmanager
def killing(every: float, kill: Callable[[int], bool]) -> Iterator[list[int]]:
    """Call ``kill`` with its number every so many seconds; yield a list whose one item counts the kills."""
    over, kills = threading.Event(), [0]

    def repeat() -> None:
        while not over.wait(every):
            kills[0] += kill(kills[0])

    killer = threading.Thread(target=repeat)
    killer.start()
    try:
        yield kills
    finally:
        over.set()
        killer.join()


def kill_worker(client: Any, number: int) -> bool:
    """Kill one of the two workers of a client of Dask; return whether both were there."""
    pids = list(client.run(os.getpid, on_error="ignore").values())
    if len(pids) != 2:
        return False
    os.kill(pids[number % 2], signal.SIGKILL)
    return True


def contents(folder: Path) -> dict[str, bytes]:
    """Return what the files below a folder hold."""
    return {str(file.relative_to(folder)): file.read_bytes() for file in folder.rglob("*") if file.is_file()}
