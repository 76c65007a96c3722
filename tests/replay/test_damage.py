"""Damaged logs through the command: the rows that can be had, one line of what was lost, and its exit code."""

from pathlib import Path

import numpy as np
import pytest

from tests.support.bags import KINDS, drive, write
from tests.support.log_files import FILES
from ttc_fast.cli import main

DONE, USAGE, UNREADABLE, PARTIAL = 0, 2, 3, 5
SCANS = 60
OPTIONS = {
    "a.pcd": ["--sensor-height", "1.0"],
    "b.pcd": ["--sensor-height", "1.0"],
    "b.pcd.gz": ["--sensor-height", "1"],
}


def replayed(path: Path, out: Path, capsys: pytest.CaptureFixture[str], *options: str) -> tuple[int, list[str], str]:
    """Replay into a table; return the exit code, the lines of the table, and what was complained of."""
    out.unlink(missing_ok=True)
    code = main(["replay", str(path), "--out", str(out), "--rows", "0", *options])
    told = capsys.readouterr()
    assert "Traceback" not in told.out + told.err
    lines = out.read_text().splitlines()[1:] if out.exists() else []
    if code == DONE:
        assert told.err == ""
    else:
        assert told.err.startswith(f"ttc-fast: {path}: ")
        assert told.err.count("\n") == 1
        assert code == (PARTIAL if lines else UNREADABLE) or (code == USAGE and not lines)
    return code, lines, told.err


def flipped(content: bytes, rng: np.random.Generator, within: int) -> bytes:
    """Overwrite a few bytes, of the first or the last of them or anywhere."""
    damaged = np.frombuffer(content, np.uint8).copy()
    at = rng.integers(0, min(within, len(content)), 4)
    damaged[np.where(rng.random(4) < 0.5, at, len(content) - 1 - at)] = rng.integers(0, 256, 4)
    return damaged.tobytes()


@pytest.mark.parametrize("kind", KINDS)
def test_a_bag_cut_at_every_tenth(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = write(tmp_path, kind, drive(SCANS, 256)), tmp_path / "rows.csv"
    content = path.read_bytes()
    code, whole, _ = replayed(path, out, capsys)
    assert (code, len(whole)) == (DONE, SCANS)
    most = 0
    for tenth in range(10):
        path.write_bytes(content[: len(content) * tenth // 10])
        code, rows, said = replayed(path, out, capsys)
        assert code in (UNREADABLE, PARTIAL), tenth
        assert len(rows) < SCANS
        assert rows == whole[: len(rows)]
        if rows:
            assert f"The {len(rows)} frames that could be read were given" in said
        most = max(most, len(rows))
    assert most > SCANS / 3 or kind.startswith(("db3", "mcap"))  # those have one chunk, or the index first


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_bag_with_flipped_bytes(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = write(tmp_path, kind, drive(SCANS, 64)), tmp_path / "rows.csv"
    content, rng = path.read_bytes(), np.random.default_rng(7)
    codes = set()
    for trial in range(60):
        path.write_bytes(flipped(content, rng, len(content) if trial % 2 else 3000))
        code, rows, _ = replayed(path, out, capsys)
        assert len(rows) <= SCANS
        codes.add(code)
    assert codes & {UNREADABLE, PARTIAL}


@pytest.mark.slow
@pytest.mark.parametrize("name", FILES)
def test_other_files_cut_and_flipped(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out, options = tmp_path / name, tmp_path / "rows.csv", OPTIONS.get(name, [])
    content, rng = FILES[name], np.random.default_rng(3)
    path.write_bytes(content)
    code, whole, _ = replayed(path, out, capsys, *options)
    assert (code, bool(whole)) == (DONE, True)
    codes = set()
    for tenth in range(10):
        path.write_bytes(content[: len(content) * tenth // 10])
        code, rows, _ = replayed(path, out, capsys, *options)
        assert len(rows) <= len(whole) + 1
        codes.add(code)
    for _ in range(40):
        path.write_bytes(flipped(content, rng, 400))
        codes.add(replayed(path, out, capsys, *options)[0])
    assert codes & {UNREADABLE, PARTIAL}


def test_one_damaged_log_of_many_is_no_reason_to_leave_the_others(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
    whole, cut = (write(tmp_path / name, "bag", drive(SCANS, 256)) for name in ("one", "two"))
    cut.write_bytes(cut.read_bytes()[: cut.stat().st_size // 2])
    assert main(["replay", str(whole), str(cut), "--out", str(tmp_path / "rows.csv")]) == PARTIAL
    told = capsys.readouterr()
    assert f"lost        {cut}: " in told.out
    assert told.err == "ttc-fast: of 2 logs 1 could not be read whole\n"
    lengths = [len((tmp_path / f"rows-log.bag{number}.csv").read_text().splitlines()) - 1 for number in ("", "-2")]
    assert lengths[0] == SCANS
    assert 0 < lengths[1] < SCANS


def test_an_output_that_cannot_be_written_of_many_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write(tmp_path, "bag", drive(5))
    (tmp_path / "file").touch()
    assert main(["replay", str(path), str(path), "--out", str(tmp_path / "file" / "rows.csv")]) == 1
    told = capsys.readouterr().err
    assert "choose another --out" in told
    assert told.count("\n") == 1
