"""NumPy archives of scans, and what is said of a log that cannot be read."""

import gzip
import itertools
import re
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.opened import open_scans
from ttc_fast.logs import LogError, open_log
from ttc_fast.replay import sample

SAMPLE = sample("scans")

Arrays = dict[str, Any]


def good() -> Arrays:
    return {
        "t": np.array([0.0, 0.1, 0.2]),
        "ranges": np.array([[1.0, np.nan], [np.inf, 2.0], [0.01, 3.0]], np.float32),
        "v": np.array([1.0, -1.0, 0.0], np.float32),
        "w": np.array([0.1, 0.0, -0.1], np.float32),
        "angle_min": 0.0,
        "angle_increment": 0.1,
        "range_min": 0.05,
        "range_max": 10.0,
    }


@pytest.fixture
def write(tmp_path: Path) -> Callable[[Arrays], Path]:
    def write(arrays: Arrays) -> Path:
        path = tmp_path / "log.npz"
        np.savez_compressed(path, **arrays)
        return path

    return write


def test_frames_come_as_they_were_recorded(write: Callable[[Arrays], Path]) -> None:
    log = open_scans(write(good()))
    frames = list(log)
    assert log.frame_count == len(frames) == 3
    assert [frame.stamp for frame in frames] == [0.0, 0.1, 0.2]
    assert [frame.speed for frame in frames] == [1.0, -1.0, 0.0]
    assert [frame.yaw_rate for frame in frames] == pytest.approx([0.1, 0.0, -0.1])
    np.testing.assert_array_equal([frame.ranges for frame in frames], good()["ranges"])
    assert frames[0].ranges.dtype == np.float32


def test_a_log_can_be_read_twice(write: Callable[[Arrays], Path]) -> None:
    log = open_scans(write(good()))
    assert [frame.stamp for frame in log] == [frame.stamp for frame in log]


def test_scanner_holds_what_the_log_says(write: Callable[[Arrays], Path]) -> None:
    scanner = open_scans(write(good())).scanner
    assert (scanner.angle_min, scanner.angle_increment, scanner.beams) == (0.0, 0.1, 2)
    assert (scanner.range_min, scanner.range_max) == (0.05, 10.0)
    assert (scanner.mount, scanner.outline) == ((0.0, 0.0, 0.0), None)


def test_mount_and_outline_are_read(write: Callable[[Arrays], Path]) -> None:
    placed = {"mount": np.array([0.2, 0.0, 0.1]), "outline": np.array([-0.1, 0.4, -0.2, 0.2])}
    scanner = open_scans(write(good() | placed)).scanner
    assert (scanner.mount, scanner.outline) == ((0.2, 0.0, 0.1), (-0.1, 0.4, -0.2, 0.2))


def test_a_log_need_not_know_its_motion(write: Callable[[Arrays], Path]) -> None:
    arrays = good()
    del arrays["v"], arrays["w"]
    assert [(frame.speed, frame.yaw_rate) for frame in open_scans(write(arrays))] == [(None, 0.0)] * 3


@pytest.mark.parametrize("name", ["t", "ranges", "angle_min", "angle_increment", "range_min", "range_max"])
def test_a_missing_array_is_named(name: str, write: Callable[[Arrays], Path]) -> None:
    arrays = good()
    del arrays[name]
    path = write(arrays)
    with pytest.raises(LogError, match=f"has no array {name}; a log needs t, ranges") as error:
        open_scans(path)
    assert str(error.value).startswith(str(path))


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"ranges": np.ones(3, np.float32)}, r"'ranges' must have the shape \(frames, beams\), got \(3,\)"),
        ({"ranges": np.ones((0, 2), np.float32)}, r"'ranges' must have the shape .* got \(0, 2\)"),
        ({"ranges": np.ones((3, 2), np.uint16)}, "'ranges' must be float32 or float64 in metres, got uint16"),
        ({"ranges": np.ones((3, 2), ">f4")}, "'ranges' must be float32 or float64 in metres, got >f4"),
        ({"t": np.zeros(2)}, r"'t' must have the shape \(3,\), one for each scan of ranges, got \(2,\)"),
        ({"t": np.array([0.0, 0.2, 0.2])}, "'t' must increase, got 0.2 after 0.2 in frame 2"),
        ({"t": np.array([2, 1, 0], np.uint64)}, "'t' must increase, got 1 after 2 in frame 1"),
        ({"v": np.array([0.0, np.nan, 1.0])}, "'v' must be finite, got nan in frame 1"),
        ({"w": np.array(["a", "b", "c"])}, "'w' must be numbers, got <U1"),
        ({"angle_min": np.zeros(2)}, r"'angle_min' must be one number, got float64 of shape \(2,\)"),
        ({"mount": np.zeros(2)}, r"'mount' must be 3 numbers, got float64 of shape \(2,\)"),
        (
            {"v": np.array([None, 1, 2], object)},
            "is not a NumPy archive, or is damaged: array 'v' cannot be read as numbers; copy it",
        ),
    ],
)
def test_a_wrong_array_is_named(wrong: Arrays, said: str, write: Callable[[Arrays], Path]) -> None:
    path = write(good() | wrong)
    with pytest.raises(LogError, match=said):
        open_scans(path)


@pytest.mark.parametrize(
    ("odd", "said"),
    [
        ({}, ""),
        ({"speed": np.ones(3)}, "not read: speed; what is read has the names t, ranges"),
        ({"t": np.array([0.0, 100.0, 200.0])}, "the stamps t are 100 s apart, read as they are; divide them by 1000"),
        ({"ranges": np.full((3, 2), 6e3)}, "half of the numbers in ranges are 6000 m or more, read as they are"),
        ({"ranges": np.array([[65.5, 65.5], [65.5, 2.0], [np.inf, 3.0]])}, ""),
    ],
    ids=["nothing", "a name", "ms", "mm", "codes for no return"],
)
def test_what_is_odd_is_said(odd: Arrays, said: str, write: Callable[[Arrays], Path]) -> None:
    assumed = open_log(write(good() | odd)).assumed
    assert assumed.startswith(said)
    assert bool(assumed) == bool(said)


def test_an_unknown_format_is_told_what_can_be_read(tmp_path: Path) -> None:
    (tmp_path / "scan.xyz").touch()
    with pytest.raises(LogError, match=r"scan\.xyz: no reader for this kind of file; can read a NumPy archive"):
        open_scans(tmp_path / "scan.xyz")


def test_a_file_that_is_not_there() -> None:
    with pytest.raises(LogError, match=r"nowhere\.npz: cannot be opened: no such file or folder"):
        open_log("nowhere.npz")


def test_a_single_array_is_no_archive(tmp_path: Path) -> None:
    np.save(tmp_path / "one.npy", np.ones(3))
    path = (tmp_path / "one.npy").rename(tmp_path / "one.npz")
    with pytest.raises(LogError, match="a single NumPy array, not an archive"):
        open_scans(path)


@pytest.mark.parametrize("content", [b"PK", b"hello, world", b"PK\x03\x04" + bytes(64)])
def test_what_is_no_archive_at_all(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "log.npz"
    path.write_bytes(content)
    with pytest.raises(LogError, match=r"log\.npz: is not a NumPy archive, or is damaged"):
        open_scans(path)


@pytest.mark.parametrize("tenth", range(10))
def test_a_truncated_archive_is_an_error_that_names_the_file(tenth: int, tmp_path: Path) -> None:
    whole = SAMPLE.read_bytes()
    path = tmp_path / "cut.npz"
    path.write_bytes(whole[: len(whole) * tenth // 10])
    with pytest.raises(LogError, match=r"cut\.npz: is (empty|not a NumPy archive, or is damaged)"):
        open_scans(path)


def test_a_damaged_archive_is_read_or_refused_but_never_crashes(write: Callable[[Arrays], Path]) -> None:
    rng = np.random.default_rng(0)
    path = write(good())
    whole = np.frombuffer(path.read_bytes(), np.uint8)
    refused = 0
    for _ in range(500):
        damaged = whole.copy()
        damaged[rng.integers(0, len(whole), 3)] = rng.integers(0, 256, 3)
        path.write_bytes(damaged.tobytes())
        try:
            list(open_scans(path))
        except LogError:
            refused += 1
    assert refused > 400


def test_the_sample_is_small_and_complete() -> None:
    log = open_scans(SAMPLE)
    assert SAMPLE.stat().st_size <= 250_000
    assert log.scanner.outline == (-0.10, 0.40, -0.15, 0.15)
    assert log.scanner.mount == (0.27, 0.0, 0.0)
    frames = list(log)
    assert 4.0 <= frames[-1].stamp - frames[0].stamp <= 6.0
    for before, after in itertools.pairwise(frames):
        assert 0.02 < after.stamp - before.stamp < 0.05
    assert frames[-1].speed == 0.0


def test_the_sample_has_every_flaw_of_a_real_scanner() -> None:
    log = open_scans(SAMPLE)
    ranges = np.array([frame.ranges for frame in log])
    assert ranges.dtype == np.float32
    assert np.isnan(ranges).any()
    assert np.isposinf(ranges).any()
    assert (ranges < log.scanner.range_min).any()
    finite = ranges[np.isfinite(ranges)].astype(np.float64) * 1e3
    np.testing.assert_allclose(finite, np.round(finite), atol=1e-3)


def test_the_sample_is_what_its_tool_makes() -> None:
    tool = Path(__file__).parents[2] / "tools" / "make_scan_sample.py"
    if not tool.is_file():
        pytest.skip("needs tools/make_scan_sample.py, which is only in the source tree")
    namespace: dict[str, Any] = {"__name__": "make_sample", "__file__": str(tool)}
    exec(compile(tool.read_text(encoding="utf-8"), tool, "exec"), namespace)
    with np.load(SAMPLE) as shipped:
        made = namespace["make_sample"]()
        assert set(made) == set(shipped)
        for name, array in made.items():
            # Other processors round a cosine otherwise: a reading may come out one millimetre away.
            np.testing.assert_allclose(shipped[name], array, rtol=0, atol=1.001e-3, err_msg=name)


def test_the_recorded_log_opens(data: Path) -> None:
    log = open_scans(data / "laserscan" / "breezyslam_exp1.npz")
    assert (log.frame_count, log.scanner.beams, log.scanner.range_min) == (756, 682, 0.06)
    assert log.scanner.outline is None


def test_a_folder_of_logs_says_how_to_name_them(tmp_path: Path) -> None:
    for name in ("two.npz", "one.npz"):
        (tmp_path / name).write_bytes(SAMPLE.read_bytes())
    with pytest.raises(LogError, match=r"is a folder of logs, one\.npz and others; give them by their names: .*/\*"):
        open_log(tmp_path)


# Archives that are damaged within, and what they unpack to


def rewritten(path: Path, change: Callable[[str, bytes], bytes]) -> Path:
    """Write an archive anew, each member changed."""
    out = path.with_name("changed.npz")
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            new.writestr(name, change(name, old.read(name)))
    return out


@pytest.mark.parametrize("sensor", ["scans", "clouds"])
@pytest.mark.parametrize(
    "change",
    [
        lambda content: b"x" + content,
        lambda content: content.replace(b"(", b"((((", 1),
        lambda content: content.replace(b"'descr'", b"'other'"),
        lambda content: re.sub(rb"(?<='fortran_order': )\w+", b"10000", content),
        lambda content: content[:64],
        lambda content: b"",
        lambda content: content[:6] + b"\x09" + content[7:],
    ],
)
def test_every_member_that_is_no_array_is_refused_by_name(
    change: Callable[[bytes], bytes], sensor: str, tmp_path: Path
) -> None:
    path = Path(shutil.copy(sample(sensor), tmp_path / "log.npz"))
    with zipfile.ZipFile(path) as archive:
        members = archive.namelist()
    for member in members:

        def one(name: str, content: bytes, changed: str = member) -> bytes:
            return change(content) if name == changed else content

        with pytest.raises(
            LogError, match=r"changed\.npz: is not a NumPy archive, or is damaged: array '.*' cannot be"
        ):
            open_log(rewritten(path, one))


@pytest.mark.parametrize("name", ["angle_min", "angle_increment", "range_min", "range_max", "mount", "outline"])
@pytest.mark.parametrize("number", [np.nan, np.inf, -np.inf])
def test_settings_of_an_archive_are_finite(name: str, number: float, write: Callable[[Arrays], Path]) -> None:
    size = {"mount": 3, "outline": 4}.get(name)
    path = write(good() | {name: number if size is None else np.full(size, number)})
    if (name, number) == ("range_max", np.inf):
        assert open_scans(path).scanner.range_max == np.inf
        return
    with pytest.raises(LogError, match=f"array '{name}' must be finite, got {number}"):
        open_scans(path)


def test_an_archive_that_unpacks_to_no_recording_is_refused(tmp_path: Path) -> None:
    arrays = good() | {"ranges": np.zeros((3, 100_000), np.float32)}
    np.savez(tmp_path / "plain.npz", **arrays)
    assert open_scans(tmp_path / "plain.npz", max_unpacked=0.1).frame_count == 3
    np.savez_compressed(tmp_path / "packed.npz", **arrays)
    with pytest.raises(LogError, match=r"packed\.npz: is too large: \d+ bytes unpack to more than 0\.4 MB; if"):
        open_scans(tmp_path / "packed.npz", max_unpacked=0.1)
    assert open_scans(tmp_path / "packed.npz").frame_count == 3


@pytest.mark.parametrize("name", ["a.bin.gz", "a.pcd.gz"])
def test_a_frame_that_unpacks_to_no_cloud_is_refused(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(gzip.compress(bytes(1 << 21)))
    with pytest.raises(LogError, match=r"gz: is too large: \d+ bytes unpack to more than 1 MB"):
        list(open_log(tmp_path / name, max_unpacked=1.0))
