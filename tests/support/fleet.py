"""Small logs of every kind for many at once, and what a dataset holds."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tests.support.bags import drive, write
from tests.support.log_files import FILES
from ttc_fast.replay import sample

if TYPE_CHECKING:
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


def contents(folder: Path) -> dict[str, bytes]:
    """Return what the files below a folder hold."""
    return {str(file.relative_to(folder)): file.read_bytes() for file in folder.rglob("*") if file.is_file()}
