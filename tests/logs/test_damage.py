"""Damaged logs of every format: they give what they can, then say what was lost; nothing else is ever raised."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import CompressionType, Writer

from tests.support.bags import KINDS, Scan, drive, scans_of, serialised, write
from tests.support.common import peak_of
from tests.support.log_files import FILES
from tests.support.opened import read
from ttc_fast.logs import open_log

SCANS, BEAMS = 400, 2048
CHUNK = {"bag": 60e3, "mcap": 1.1e6}  # bytes of one, which a cut loses


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    paths: dict[str, Path] = {}

    def make(kind: str) -> Path:
        if kind not in paths:
            paths[kind] = write(tmp_path_factory.mktemp("whole"), kind, drive(SCANS, BEAMS))
        return paths[kind]

    return make


@pytest.mark.slow
@pytest.mark.parametrize("tenth", range(10))
@pytest.mark.parametrize("kind", KINDS)
def test_a_bag_cut_short_gives_what_is_left(
    kind: str, tenth: int, whole: Callable[[str], Path], tmp_path: Path
) -> None:
    content = whole(kind).read_bytes()
    path = tmp_path / whole(kind).name
    size = len(content) * tenth // 10
    path.write_bytes(content[:size])
    frames, said = read(path)
    assert said.startswith(str(path))
    recorded = scans_of(drive(SCANS, BEAMS))
    for frame, ranges in zip(frames, recorded, strict=False):
        np.testing.assert_array_equal(frame.ranges, ranges)
    assert len(frames) < len(recorded)
    if frames:
        assert f"The {len(frames)} frames that could be read were given" in said
    if tenth >= 5 and not kind.startswith("db3"):  # a database keeps what leads to its pages anywhere
        assert len(frames) > SCANS * (size - CHUNK[kind.partition(".")[0]]) / len(content) - 1


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_flipped_bytes_are_survived(kind: str, tmp_path: Path) -> None:
    items = drive(60, 128)
    path = write(tmp_path, kind, items)
    content = np.frombuffer(path.read_bytes(), np.uint8)
    rng = np.random.default_rng(11)
    told = 0
    for trial in range(150):
        damaged = content.copy()
        # Half of them in the first and last bytes, where the structure is.
        within = len(content) if trial % 2 else 3000
        at = rng.integers(0, within, 4)
        damaged[np.where(rng.random(4) < 0.5, at, len(content) - 1 - at)] = rng.integers(0, 256, 4)
        path.write_bytes(damaged.tobytes())
        frames, said = read(path)
        assert len(frames) <= 60
        told += bool(said)
    assert told > 8  # a byte within a range that no checksum covers is not seen


@pytest.mark.parametrize(("kind", "begin"), [("bag.lz4", b"\x04\x22\x4d\x18"), ("mcap.zstd", b"\x28\xb5\x2f\xfd")])
def test_damage_in_one_chunk_loses_no_other(
    kind: str, begin: bytes, tmp_path: Path, whole: Callable[[str], Path]
) -> None:
    content = bytearray(whole(kind).read_bytes())
    second = content.index(begin, content.index(begin) + 1)
    content[second : second + 8] = bytes(8)
    path = tmp_path / whole(kind).name
    path.write_bytes(content)
    frames, said = read(path)
    assert 0.5 * SCANS < len(frames) < SCANS
    assert frames[-1].stamp == pytest.approx((SCANS - 1) / 40)
    assert "at byte" in said


@pytest.mark.parametrize("kind", ["bag", "bag.bz2", "bag.lz4"])
def test_a_chunk_of_a_bag_that_is_cut_gives_the_messages_before_the_cut(kind: str, tmp_path: Path) -> None:
    path = write(tmp_path, kind, drive(200, BEAMS), chunk=10**9)
    content = path.read_bytes()
    assert content.count(b"compression=") == 1
    path.write_bytes(content[: len(content) * 7 // 10])
    frames, said = read(path)
    assert 10 < len(frames) < 150
    assert "bytes are missing" in said or "are left" in said


def test_damage_between_the_chunks_of_a_bag_loses_one_at_most(tmp_path: Path, whole: Callable[[str], Path]) -> None:
    content = bytearray(whole("bag").read_bytes())
    second = content.index(b"compression=", content.index(b"compression=") + 1)
    content[second - 8 : second] = b"\xff" * 8
    path = tmp_path / "log.bag"
    path.write_bytes(content)
    frames, said = read(path)
    assert SCANS - 8 <= len(frames) < SCANS
    assert "reading went on at the next chunk" in said


def test_a_wrong_bit_in_a_range_is_found_by_the_checksum(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    items = [item for item in drive(10) if isinstance(item, Scan)]
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=1000, compression=CompressionType.NONE)
        writer.start("ros2", "test")
        schema = writer.register_schema("sensor_msgs/msg/LaserScan", "ros2msg", b"")
        channel = writer.register_channel("/scan", "cdr", schema)
        for i, item in enumerate(items):
            writer.add_message(channel, i, serialised(item, "little"), i)
        writer.finish()  # type: ignore[no-untyped-call]
    assert len(read(path)[0]) == 10
    content = bytearray(path.read_bytes())
    content[content.index(items[5].ranges.tobytes()) + 80] ^= 1
    path.write_bytes(content)
    frames, said = read(path)
    assert 5 < len(frames) < 10
    assert "is damaged and left out: crc validation failed" in said


def test_losses_are_counted_not_listed(tmp_path: Path) -> None:
    items = [Scan(i / 10, i / 10, angle_min=-1.5 if i == 0 else -1.0) for i in range(100)]
    path = write(tmp_path, "bag", items)
    frames, said = read(path)
    assert len(frames) == 1
    assert "and 98 more like it. The 1 frames that could be read were given" in said
    assert len(said) - len(str(path)) < 600


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_memory_does_not_grow_with_the_log(kind: str, tmp_path: Path) -> None:
    def peak(scans: int) -> int:
        folder = tmp_path / str(scans)
        folder.mkdir()
        path = write(folder, kind, drive(scans, 4096))
        counted: list[int] = []
        most = peak_of(lambda: counted.append(sum(1 for _ in open_log(path))))
        assert counted == [scans]
        return most

    peak(64)  # imports
    short, long = peak(128), peak(1024)
    assert long < short + 3e5  # 14 MB more were read
    assert long < 12e6


@pytest.mark.parametrize("name", FILES)
def test_the_files_are_sound(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(FILES[name])
    frames, said = read(tmp_path / name)
    assert (len(frames) > 0, said) == (True, "")


@pytest.mark.parametrize("name", FILES)
def test_files_cut_short_give_what_is_left(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(FILES[name])
    complete = len(read(tmp_path / name)[0])
    for tenth in range(10):
        (tmp_path / name).write_bytes(FILES[name][: len(FILES[name]) * tenth // 10])
        frames, said = read(tmp_path / name)
        assert len(frames) <= complete
        assert said or len(frames) > 0
        if name == "log.log" and tenth > 3:
            assert len(frames) >= 5 * tenth - 1


@pytest.mark.parametrize("name", FILES)
def test_flipped_bytes_of_files_are_survived(name: str, tmp_path: Path) -> None:
    content = np.frombuffer(FILES[name], np.uint8)
    rng = np.random.default_rng(5)
    for _ in range(200):
        damaged = content.copy()
        damaged[rng.integers(0, min(len(content), 400), 2)] = rng.integers(0, 256, 2)
        damaged[rng.integers(0, len(content))] = rng.integers(0, 256)
        (tmp_path / name).write_bytes(damaged.tobytes())
        read(tmp_path / name)
