"""Logs of every format that are damaged in a few places: frames, or a LogError and its exit code; never a traceback."""

import io
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.support.bags import KINDS, drive, write
from tests.support.log_files import FILES
from tests.support.mutations import CORPUS, kept, mutations
from tests.support.opened import read
from ttc_fast.cli import main
from ttc_fast.replay import sample

Record = Callable[[str, object], None]
TRIALS = 40
pytestmark = pytest.mark.fuzz


@pytest.mark.parametrize("name", [*KINDS, *FILES])
def test_a_damaged_log_is_read_or_refused(name: str, tmp_path: Path, record_property: Record) -> None:
    record_property("inputs", TRIALS)
    path = tmp_path / name
    if name in FILES:
        path.write_bytes(FILES[name])
    else:
        path = write(tmp_path, name, drive(6, 32))
    for trial, content in enumerate(mutations(path.read_bytes(), TRIALS, seed=len(name))):
        path.write_bytes(content)
        with kept(path):
            read(path)
            if trial % 4 == 0:
                assert main(["replay", str(path), "--rows", "1"]) in (0, 2, 3, 5)


@pytest.mark.parametrize("name", [path.name for path in CORPUS.iterdir() if path.suffix != ".md"])
def test_what_once_failed(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes((CORPUS / name).read_bytes())
    read(path)
    assert main(["replay", str(path), "--rows", "1"]) in (0, 2, 3, 5)


@pytest.mark.parametrize("sensor", ["scans", "clouds"])
def test_an_archive_with_a_damaged_array_is_read_or_refused(
    sensor: str, tmp_path: Path, record_property: Record
) -> None:
    """The checksums of the archive are sound."""
    with np.load(sample(sensor)) as archive:
        arrays = dict(archive)
    if sensor == "scans":
        arrays = {
            name: array[:4] if len(array.shape) and len(array) == 129 else array for name, array in arrays.items()
        }
    else:
        counts = arrays["counts"][:2]
        arrays |= {"counts": counts, "t": arrays["t"][:2], "points": arrays["points"][: counts.sum()]}
    record_property("inputs", len(arrays) * (TRIALS // 2))
    for name, array in arrays.items():
        file = io.BytesIO()
        np.save(file, array)
        for content in mutations(file.getvalue(), TRIALS // 2, seed=len(name)):
            np.savez(tmp_path / "log.npz", **{other: each for other, each in arrays.items() if other != name})
            with zipfile.ZipFile(tmp_path / "log.npz", "a") as changed:
                changed.writestr(f"{name}.npy", content)
            with kept(tmp_path / "log.npz"):
                read(tmp_path / "log.npz")
