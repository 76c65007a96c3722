"""Logs of every format that are damaged in a few places: frames, or a LogError and its exit code; never a traceback."""

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest

from tests.support.bags import KINDS, drive, write
from tests.support.log_files import FILES
from tests.support.mutations import mutations
from tests.support.opened import read
from ttc_fast.cli import main
from ttc_fast.replay import sample

TRIALS = 40


@pytest.mark.parametrize("name", [*KINDS, *FILES])
def test_a_damaged_log_is_read_or_refused(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    if name in FILES:
        path.write_bytes(FILES[name])
    else:
        path = write(tmp_path, name, drive(6, 32))
    for trial, content in enumerate(mutations(path.read_bytes(), TRIALS, seed=len(name))):
        path.write_bytes(content)
        read(path)
        if trial % 4 == 0:
            assert main(["replay", str(path), "--rows", "1"]) in (0, 2, 3, 5)


@pytest.mark.parametrize("sensor", ["scans", "clouds"])
def test_an_archive_with_a_damaged_array_is_read_or_refused(sensor: str, tmp_path: Path) -> None:
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
    for name, array in arrays.items():
        file = io.BytesIO()
        np.save(file, array)
        for content in mutations(file.getvalue(), TRIALS // 2, seed=len(name)):
            np.savez(tmp_path / "log.npz", **{other: each for other, each in arrays.items() if other != name})
            with zipfile.ZipFile(tmp_path / "log.npz", "a") as changed:
                changed.writestr(f"{name}.npy", content)
            read(tmp_path / "log.npz")
