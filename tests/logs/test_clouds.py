"""Logs of point clouds: what they give, and what they say of a log that cannot be read."""

import gzip
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.opened import open_clouds
from ttc_fast.logs import LogError, open_log
from ttc_fast.replay import sample

SAMPLE = sample("clouds")
FRAMES = {
    "0000000000.bin": np.array([[9.0, 0.0, -1.0, 0.5], [8.0, 1.0, -1.0, 0.25]], "<f4"),
    "0000000001.bin": np.array([[7.0, 0.0, -1.0, 0.5]], "<f4"),
    "0000000002.bin": np.empty((0, 4), "<f4"),
}
LINES = [f"2011-09-26 13:02:{second}" for second in ("25.900000001", "26.000000002", "26.25", "26.5")]


def stamps(path: Path) -> list[float]:
    return [frame.stamp for frame in open_clouds(path)]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    path = tmp_path / "drive" / "data"
    path.mkdir(parents=True)
    for name, points in FRAMES.items():
        (path / name).write_bytes(points.tobytes())
    (path / "readme.txt").write_text("not a frame")
    return path


def good() -> dict[str, Any]:
    return {
        "t": np.array([0.0, 0.1]),
        "points": np.arange(12, dtype=np.float32).reshape(4, 3),
        "counts": np.array([1, 3]),
        "sensor_height": 1.5,
    }


@pytest.fixture
def write(tmp_path: Path) -> Callable[[dict[str, Any]], Path]:
    def write(arrays: dict[str, Any]) -> Path:
        path = tmp_path / "log.npz"
        np.savez(path, **arrays)
        return path

    return write


# A folder of KITTI frames


def test_frames_come_in_the_order_of_their_names(folder: Path) -> None:
    log = open_clouds(folder)
    assert log.frame_count == 3
    for frame, points in zip(log, FRAMES.values(), strict=True):
        np.testing.assert_array_equal(frame.points, points)
        assert frame.points.dtype == np.float32


def test_compressed_frames_are_the_same(folder: Path) -> None:
    for name, points in FRAMES.items():
        (folder / name).unlink()
        (folder / f"{name}.gz").write_bytes(gzip.compress(points.tobytes()))
    for frame, points in zip(open_clouds(folder), FRAMES.values(), strict=True):
        np.testing.assert_array_equal(frame.points, points)


def test_without_stamps_the_rate_is_assumed_and_said(folder: Path) -> None:
    assert stamps(folder) == pytest.approx([0.0, 0.1, 0.2])
    assert open_clouds(folder).clock == "no timestamps.txt, so 10 frames a second are assumed"


@pytest.mark.parametrize("above", [False, True])
def test_stamps_lie_in_the_folder_or_above(above: bool, folder: Path) -> None:
    file = (folder.parent if above else folder) / "timestamps.txt"
    file.write_text("\n".join(LINES[:3]) + "\n")
    assert stamps(folder) == pytest.approx([0.0, 0.100000001, 0.349999999], abs=1e-12)
    assert open_clouds(folder).clock == f"stamps of {file}"


def test_stamps_of_a_whole_drive_are_found_by_the_names_of_its_frames(folder: Path) -> None:
    (folder / "0000000000.bin").rename(folder / "0000000003.bin")
    (folder / "timestamps.txt").write_text("\n".join(LINES))
    assert stamps(folder) == pytest.approx([0.0, 0.249999998, 0.499999998], abs=1e-12)


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (LINES[:2], r"has 2 stamps for 3 frames, and the names do not say which is whose; take it away, or"),
        (
            [LINES[0], LINES[2], LINES[1]],
            r"but that of 0000000002\.bin does not follow that of 0000000001\.bin",
        ),
        ([LINES[0], "", LINES[1]], r"but that of 0000000001\.bin does not follow that of 0000000000\.bin"),
        (["1", "noon", "2"], r"must have lines like 2011-09-26 13:02:25\.951199337, one a frame: .*noon"),
        (["é"] * 3, "must have lines like"),
    ],
)
def test_stamps_that_do_not_fit(lines: list[str], said: str, folder: Path) -> None:
    file = folder / "timestamps.txt"
    file.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(LogError, match=said) as error:
        open_log(folder)
    assert str(error.value).startswith(str(file))


def test_stamps_for_frames_that_are_not_numbered(folder: Path) -> None:
    (folder / "0000000001.bin").rename(folder / "left.bin")
    (folder / "timestamps.txt").write_text("\n".join(LINES))
    with pytest.raises(LogError, match="has 4 stamps for 3 frames, and the names do not say which is whose"):
        open_log(folder)


def test_one_frame_is_a_log_of_one(folder: Path) -> None:
    (frame,) = open_clouds(folder / "0000000001.bin")
    assert frame.stamp == 0.0
    np.testing.assert_array_equal(frame.points, FRAMES["0000000001.bin"])


def test_a_folder_without_frames(folder: Path) -> None:
    for name in FRAMES:
        (folder / name).unlink()
    with pytest.raises(LogError, match="data: holds no frames that can be read; can read a NumPy archive"):
        open_log(folder)


def test_a_folder_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="nowhere: cannot be opened: no such file or folder"):
        open_log(tmp_path / "nowhere")


@pytest.mark.parametrize("cut", [1, 8, 15])
def test_a_frame_cut_short_is_an_error_after_those_before_it(cut: int, folder: Path) -> None:
    frame = folder / "0000000001.bin"
    frame.write_bytes(frame.read_bytes()[:-cut])
    frames = iter(open_clouds(folder))
    assert len(next(frames).points) == 2
    with pytest.raises(LogError, match=rf"0000000001\.bin: has {16 - cut} bytes, not whole rows of 16 bytes"):
        next(frames)


@pytest.mark.parametrize(
    "content",
    [b"hello", gzip.compress(bytes(64))[:-4], gzip.compress(bytes(64))[:14], b"\x1f\x8b\x08" + bytes(99)],
    ids=["no gzip", "no length", "no content", "no header"],
)
def test_a_damaged_compressed_frame_is_named(content: bytes, folder: Path) -> None:
    (folder / "0000000000.bin").unlink()
    (folder / "0000000000.bin.gz").write_bytes(content)
    with pytest.raises(LogError, match=r"0000000000\.bin\.gz: is not gzip, or is damaged"):
        next(iter(open_clouds(folder)))


def test_the_recorded_frames_open(data: Path) -> None:
    log = open_clouds(data / "kitti" / "velodyne")
    assert log.frame_count == 20
    raw = open_clouds(data / "kitti" / "velodyne_raw")
    for compressed, plain in zip(log, raw, strict=False):
        assert compressed.points.shape[0] > 100_000
        np.testing.assert_array_equal(compressed.points, plain.points)


# Archives


def test_clouds_come_as_they_were_recorded(write: Callable[[dict[str, Any]], Path]) -> None:
    log = open_clouds(write(good()))
    first, second = log
    assert (first.stamp, second.stamp) == (0.0, 0.1)
    np.testing.assert_array_equal(first.points, good()["points"][:1])
    np.testing.assert_array_equal(second.points, good()["points"][1:])
    assert [frame.stamp for frame in log] == [0.0, 0.1]
    assert (log.frame_count, log.lidar.sensor_height, log.lidar.front_offset) == (2, 1.5, 0.0)


def test_the_bumper_is_read(write: Callable[[dict[str, Any]], Path]) -> None:
    lidar = open_clouds(write(good() | {"front_offset": 2.25})).lidar
    assert (lidar.front_offset, lidar.own_reach) == (2.25, 2.25)


def test_where_the_vehicle_ends_is_one_rule(write: Callable[[dict[str, Any]], Path], folder: Path) -> None:
    path = write(good())
    assert (open_clouds(path).lidar.vehicle_reach, open_clouds(path).lidar.own_reach) == (None, 1.5 * 1.5)
    said = open_clouds(path, front_offset=0.0).lidar
    assert (said.front_offset, said.vehicle_reach, said.own_reach) == (0.0, 0.0, 0.0)
    kitti = [open_clouds(folder, **said).lidar.own_reach for said in ({}, {"front_offset": 2.0}, {"front_offset": 3.0})]
    assert kitti == [2.6, 2.6, 3.0]


@pytest.mark.parametrize("name", ["t", "counts", "sensor_height"])
def test_a_missing_array_is_named(name: str, write: Callable[[dict[str, Any]], Path]) -> None:
    arrays = good()
    del arrays[name]
    with pytest.raises(LogError, match=f"has no array {name}; a log needs t, points, counts, sensor_height"):
        open_log(write(arrays))


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"points": np.ones((4, 2), np.float32)}, r"'points' must have the shape \(points, 3\) or wider, got \(4, 2\)"),
        ({"points": np.ones((4, 3), np.int16)}, "'points' must be float32 or float64 in metres, got int16"),
        ({"counts": np.array([1, 2])}, "'counts' must be from 0 and add up to the 4 rows of 'points'"),
        ({"counts": np.array([-1, 5])}, "'counts' must be from 0 and add up to the 4 rows of 'points'"),
        ({"counts": np.array([2**63, 2**63, 4], np.uint64)}, "'counts' must be from 0 and add up to the 4 rows"),
        ({"counts": np.array([1.0, 3.0])}, r"'counts' must be integers, one per cloud, got float64 of shape \(2,\)"),
        ({"counts": np.empty(0, int)}, r"'counts' must be integers, one per cloud, got int64 of shape \(0,\)"),
        ({"t": np.array([0.0])}, r"'t' must have the shape \(2,\), one for each cloud of counts, got \(1,\)"),
        ({"t": np.array([0.1, 0.1])}, "'t' must increase, got 0.1 after 0.1 in frame 1"),
        ({"sensor_height": np.array(-1.0)}, r"'sensor_height' must be at least 0, got -1\.0"),
        ({"sensor_height": np.zeros(2)}, r"'sensor_height' must be one number, got float64 of shape \(2,\)"),
    ],
)
def test_a_wrong_array_is_named(wrong: dict[str, Any], said: str, write: Callable[[dict[str, Any]], Path]) -> None:
    with pytest.raises(LogError, match=said):
        open_log(write(good() | wrong))


# The sample


def test_the_sample_is_small_and_complete() -> None:
    log = open_clouds(SAMPLE)
    assert SAMPLE.stat().st_size <= 200_000
    assert log.frame_count == 12
    assert (log.lidar.sensor_height, log.lidar.front_offset) == (1.73, 2.0)
    assert all(2500 < len(frame.points) < 5000 for frame in log)


def test_the_sample_has_every_flaw_of_a_real_lidar() -> None:
    points = np.concatenate([frame.points for frame in open_clouds(SAMPLE)])
    assert points.dtype == np.float32
    lost = ~points[:, :3].any(axis=1)
    assert 0.01 < lost.mean() < 0.05
    road = points[:, 2] < -1.6
    bonnet = ~lost & (points[:, 0] < 2.0) & (np.abs(points[:, 1]) < 0.8)
    assert road.mean() > 0.2
    assert bonnet.any()
    np.testing.assert_array_equal(points[:, :3] * 512, np.round(points[:, :3] * 512))


def test_the_sample_is_what_its_tool_makes() -> None:
    tool = Path(__file__).parents[2] / "tools" / "make_cloud_sample.py"
    if not tool.is_file():
        pytest.skip("needs tools/make_cloud_sample.py, which is only in the source tree")
    namespace: dict[str, Any] = {"__name__": "make_cloud_sample", "__file__": str(tool)}
    exec(compile(tool.read_text(encoding="utf-8"), tool, "exec"), namespace)
    with np.load(SAMPLE) as shipped:
        made = namespace["make_sample"]()
        assert set(made) == set(shipped)
        for name, array in made.items():
            # Other processors round a cosine otherwise: a value may come out one step away.
            atol = [1 / 512, 1 / 512, 1 / 512, 1 / 64] if name == "points" else 1e-9
            assert np.all(np.abs(shipped[name] - array) <= atol), name


def dump(step: int) -> bytes:
    """Make the data of a PointCloud2 with so many bytes a point: what is beside x, y and z are integers."""
    points = np.zeros(2000, {"names": ["x", "y", "z", "t"], "formats": ["<f4"] * 3 + ["<u4"], "itemsize": step})
    rng = np.random.default_rng(5)
    for name in "xyz":
        points[name] = rng.normal(0.0, 20.0, 2000)
    points["t"] = rng.integers(0, 10**8, 2000)
    return points.tobytes()


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.bin", dump(48)),
        ("a.bin", dump(32)),
        ("a.bin", np.random.default_rng(1).integers(0, 2**16, 64_000).astype("<u2").tobytes()),
        ("a.bin", np.random.default_rng(1).normal(0.0, 20.0, (2000, 5)).astype("<f4").tobytes()[:39_984]),
        ("a.pcd.bin", dump(20)),
        ("a.pcd.bin", b"# .PCD v0.7 - Point Cloud Data file format " * 100),
    ],
)
def test_bytes_of_something_else_are_no_points(name: str, content: bytes, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(LogError, match=r"is no (KITTI|nuScenes) frame: read as rows of .* no places that a lidar sees"):
        list(open_clouds(tmp_path / name))


@pytest.mark.parametrize("brightest", [1.0, 255.0, 4000.0])
def test_points_of_any_reflectance_are_points(brightest: float, tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    points = rng.normal(0.0, 30.0, (5000, 4)).astype("<f4")
    points[:, 3] = rng.uniform(0.0, brightest, 5000)
    points[::7, :3] = 0.0  # no return
    points[::11, :3] = np.nan
    (tmp_path / "a.bin").write_bytes(points.tobytes())
    (frame,) = open_clouds(tmp_path / "a.bin")
    np.testing.assert_array_equal(frame.points, points)
