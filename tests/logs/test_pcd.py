"""Clouds in PCD files: what any program writes that leaves one reading is read; anything else is refused by name."""

import gzip
import importlib
import io
import math
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.opened import open_clouds
from ttc_fast import Gate, Minimum, robust_min_x
from ttc_fast.logs import LogError, forward_left_up, open_log
from ttc_fast.logs.pcd import unpack_lzf

FIELDS = ("x", "y", "z", "intensity", "label")
SIZES, TYPES = (4, 4, 4, 1, 8), ("F", "F", "F", "U", "U")
POINTS = np.array([(9.0, 1.0, -1.0, 7, 2**60 + 1), (8.0, 0.5, -1.0, 9, 3)], "<f4, <f4, <f4, u1, <u8")
POINTS.dtype.names = FIELDS
KINDS = ("ascii", "binary", "binary_compressed")


def lines(kind: str, points: np.ndarray[Any, Any], sizes: Any, types: Any) -> dict[str, Any]:
    names = points.dtype.names or ()
    return {
        "VERSION": "0.7",
        "FIELDS": " ".join(names),
        "SIZE": " ".join(map(str, sizes)),
        "TYPE": " ".join(types),
        "COUNT": " ".join("1" for _ in names),
        "WIDTH": len(points),
        "HEIGHT": 1,
        "VIEWPOINT": "0 0 0 1 0 0 0",
        "POINTS": len(points),
        "DATA": kind,
    }


def body(kind: str, points: np.ndarray[Any, Any]) -> bytes:
    if kind == "ascii":
        return b"".join(" ".join(map(str, row)).encode() + b"\n" for row in points.tolist())
    if kind == "binary":
        return points.tobytes()
    return compressed(b"".join(points[name].tobytes() for name in points.dtype.names or ()))


def compressed(plain: bytes) -> bytes:
    lzf = importlib.import_module("lzf")  # pypcd4 brings it
    packed = bytes(lzf.compress(plain, 2 * len(plain) + 100) or b"")  # of nothing it makes None
    return np.array([len(packed), len(plain)], "<u4").tobytes() + packed


def header(said: dict[str, Any]) -> bytes:
    return b"# .PCD v0.7\n" + "".join(f"{name} {value}\n" for name, value in said.items()).encode()


def pcd(kind: str, points: np.ndarray[Any, Any] = POINTS, sizes: Any = SIZES, types: Any = TYPES) -> bytes:
    return header(lines(kind, points, sizes, types)) + body(kind, points)


@pytest.fixture
def read(tmp_path: Path) -> Callable[[bytes], np.ndarray[Any, Any]]:
    def read(content: bytes) -> np.ndarray[Any, Any]:
        (tmp_path / "cloud.pcd").write_bytes(content)
        (frame,) = open_clouds(tmp_path / "cloud.pcd")
        return frame.points

    return read


Read = Callable[[bytes], np.ndarray[Any, Any]]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ["cloud.pcd", "cloud.pcd.gz"])
def test_every_kind_of_pcd(kind: str, name: str, tmp_path: Path) -> None:
    points = np.concatenate([POINTS] * 20)  # too few would not compress
    content = pcd(kind, points)
    (tmp_path / name).write_bytes(gzip.compress(content) if name.endswith(".gz") else content)
    (frame,) = open_clouds(tmp_path / name)
    assert frame.points.dtype.itemsize == 21  # unaligned
    for field in FIELDS:
        np.testing.assert_array_equal(frame.points[field], points[field])
    assert robust_min_x(frame.points, gate=Gate(intensity=(8, 10)), estimator=Minimum()).x == 8.0


@pytest.mark.parametrize("count", [0, 1])
@pytest.mark.parametrize("kind", KINDS)
def test_a_pcd_of_no_point_or_one(kind: str, count: int, read: Read) -> None:
    assert read(pcd(kind, POINTS[:count])).shape == (count,)


def test_an_intensity_of_any_type_may_be_gated(read: Read) -> None:
    points = POINTS.astype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<i4"), ("label", "<u8")])
    stored = read(pcd("binary", points, (4, 4, 4, 4, 8), ("F", "F", "F", "I", "U")))
    assert robust_min_x(stored, estimator=Minimum()).x == 8.0
    assert robust_min_x(stored, gate=Gate(intensity=(6, 8)), estimator=Minimum()).x == 9.0


# What programs leave out, or write in their own way


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("version", [".5", ".6", "0.7", None])
@pytest.mark.parametrize("missing", ["COUNT", "VIEWPOINT", "POINTS", "HEIGHT", "WIDTH", "VERSION"])
def test_a_line_that_says_what_is_usual_may_be_missing(
    missing: str, version: str | None, kind: str, read: Read
) -> None:
    said = lines(kind, POINTS, SIZES, TYPES) | {"VERSION": version}
    del said[missing]
    points = read(header(said) + body(kind, POINTS))
    np.testing.assert_array_equal(points["label"], POINTS["label"])


@pytest.mark.parametrize("missing", ["SIZE", "TYPE"])
def test_numbers_are_floats_where_nothing_is_said(missing: str, read: Read) -> None:
    points = np.array([(1, 2, 3), (4, 5, 6)], [(name, "<f4") for name in "xyz"])
    said = lines("binary", points, (4, 4, 4), "FFF")
    del said[missing]
    np.testing.assert_array_equal(read(header(said) + points.tobytes()), points)


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace("\n", " \n"),
        lambda text: text.replace(" ", "\t"),
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.replace("\n", "\n\n"),
        lambda text: text.replace(" ", "   ").replace("\n", "\n  "),
        lambda text: text.replace("F F F U U", "f f f u u"),
        lambda text: text.replace("FIELDS x y z", "FIELDS X Y Z"),
        lambda text: text.replace("FIELDS", "COLUMNS"),
        lambda text: text.replace("DATA", "data").replace("ascii", "ASCII"),
        lambda text: "\ufeff" + text,
        lambda text: text.removesuffix("\n"),
    ],
)
def test_blanks_and_capital_letters_are_free(change: Callable[[str], str], read: Read) -> None:
    points = read(change(pcd("ascii").decode()).encode())
    for name in FIELDS:
        np.testing.assert_array_equal(points[name], POINTS[name])


@pytest.mark.parametrize("nan", ["nan", "NaN", "-nan", "-nan(ind)", "1.#QNAN", "-1.#IND"])
def test_not_a_number_is_read_as_any_program_writes_it(nan: str, read: Read) -> None:
    points = read(pcd("ascii").replace(b"8.0 0.5", f"{nan} 0.5".encode()))
    assert math.isnan(points["x"][1])
    assert points["label"][0] == POINTS["label"][0]


def test_integers_may_be_written_as_floats(read: Read) -> None:
    points = read(pcd("ascii").replace(b" 7 ", b" 7.0 ").replace(b" 9 ", b" 9e0 "))
    assert points["intensity"].tolist() == [7, 9]


@pytest.mark.parametrize("stored", [0, 1])
@pytest.mark.parametrize("kind", KINDS)
def test_a_count_of_0_has_the_bytes_that_fit(kind: str, stored: int, read: Read) -> None:
    said = lines(kind, POINTS, SIZES, TYPES) | {"COUNT": "1 1 1 0 1"}
    names = [name for name in FIELDS if stored or name != "intensity"]
    points = np.zeros(len(POINTS), [(name, POINTS.dtype[name]) for name in names])
    for name in names:
        points[name] = POINTS[name]
    got = read(header(said) + body(kind, points))
    np.testing.assert_array_equal(got["x"], POINTS["x"])
    np.testing.assert_array_equal(got["label"], POINTS["label"])
    assert ("intensity" in (got.dtype.names or ())) == bool(stored)


@pytest.mark.parametrize("kind", KINDS)
def test_fields_of_several_numbers_and_padding(kind: str, read: Read) -> None:
    padded = np.zeros(30, [("x", "<f4"), ("a", "u1", 3), ("y", "<f4"), ("z", "<f4"), ("h", "<f4", 2), ("b", "u1")])
    padded["x"], padded["h"] = np.arange(30), np.arange(60).reshape(30, 2)
    said = {"FIELDS": "x _ y z h _", "SIZE": "4 1 4 4 4 1", "TYPE": "F U F F F U", "COUNT": "1 3 1 1 2 1"}
    said |= {"WIDTH": "6", "HEIGHT": "5", "POINTS": "30", "DATA": kind}
    flat = [" ".join(str(number) for field in row for number in np.atleast_1d(field)) for row in padded.tolist()]
    content = {"ascii": "\n".join(flat).encode()}.get(kind) or body(kind, padded)
    points = read(header(said) + content)
    assert points.dtype.names == ("x", "y", "z", "h")
    np.testing.assert_array_equal(points["x"], padded["x"])
    np.testing.assert_array_equal(points["h"], padded["h"])
    gate = Gate(x=(2.5, 9.0))
    assert robust_min_x(points, gate=gate, estimator=Minimum()).x == 3.0


def test_padding_may_be_left_out_of_a_compressed_file(read: Read) -> None:
    points = np.array([(i, 0, 0) for i in range(30)], [(name, "<f4") for name in "xyz"])
    said = {"FIELDS": "x y z _", "SIZE": "4 4 4 1", "TYPE": "F F F U", "COUNT": "1 1 1 4", "POINTS": "30"}
    got = read(header(said | {"DATA": "binary_compressed"}) + body("binary_compressed", points))
    np.testing.assert_array_equal(got["x"], np.arange(30))


def test_bytes_behind_the_last_point_are_no_points(read: Read) -> None:
    assert len(read(pcd("binary") + b"\n")) == 2


# What is wrong


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "is empty: nothing was recorded, or copied"),
        (b"hello\n", "is not a PCD file, or is damaged: its first lines have no FIELDS or no DATA"),
        (pcd("binary")[:-1], "is not a PCD file, or is damaged|is cut short"),
        (pcd("binary")[:-21], "is cut short: it says 2 points and has 1"),
        (pcd("ascii").rsplit(b"\n", 2)[0], "is cut short: it says 2 points and has 1"),
        (pcd("ascii") + b"1 2 3 4 5\n", "is damaged: it says 2 points and has 3"),
        (pcd("ascii").replace(b" 7 ", b" "), "is damaged: it must have 5 numbers a line, and has 4 in point 0"),
        (
            pcd("ascii").replace(b" 0.5 ", b" far "),
            "it must have 5 numbers a line, and has something that is no number",
        ),
        (pcd("binary_compressed")[:-3], r"is damaged or cut short: its compressed points come to \d+ bytes, not 42"),
        (pcd("binary").replace(b"POINTS 2", b"POINTS 2000000000000"), "is cut short|is damaged"),
        (pcd("binary").replace(b"POINTS 2", b"POINTS -2"), "is damaged: POINTS must be a whole number, got -2"),
        (pcd("binary").replace(b"POINTS 2", b"POINTS"), "is damaged: POINTS must be a whole number, got nothing"),
        (pcd("binary").replace(b"SIZE 4", b"SIZE four"), "is damaged: SIZE must be a whole number, got four"),
        (
            pcd("binary").replace(b"COUNT 1", b"COUNT 9999999"),
            "is damaged: SIZE and COUNT come to 40000013 bytes a point",
        ),
        (
            pcd("binary").replace(b"COUNT 1", b"COUNT"),
            "FIELDS names 5 fields, and SIZE, TYPE and COUNT must say as many",
        ),
        (
            pcd("binary").replace(b"DATA binary", b"DATA zipped"),
            "has DATA zipped, but PCD is ascii, binary, binary_comp",
        ),
        (pcd("binary").replace(b"FIELDS x", b"FIELDS u"), "has no field x; it has u, y, z, intensity, label"),
        (pcd("binary").replace(b"TYPE F F F", b"TYPE F F U"), "must have x, y and z of one type"),
        (
            pcd("binary").replace(b"WIDTH 2\n", b"").replace(b"POINTS 2\n", b""),
            "neither POINTS nor WIDTH says how many",
        ),
    ],
)
def test_a_wrong_pcd_is_refused_by_name(content: bytes, said: str, tmp_path: Path) -> None:
    (tmp_path / "cloud.pcd").write_bytes(content)
    with pytest.raises(LogError, match=said) as error:
        list(open_clouds(tmp_path / "cloud.pcd"))
    assert "cloud.pcd" in str(error.value)


@pytest.mark.parametrize("kind", KINDS)
def test_damage_anywhere_is_read_or_refused(kind: str, tmp_path: Path) -> None:
    content = np.frombuffer(pcd(kind, np.concatenate([POINTS] * 20)), np.uint8)
    rng = np.random.default_rng(3)
    for _ in range(300):
        damaged = content.copy()
        damaged[rng.integers(0, len(content), 3)] = rng.integers(0, 256, 3)
        (tmp_path / "cloud.pcd").write_bytes(damaged[: rng.integers(1, 2 * len(content))].tobytes())
        try:
            (frame,) = open_clouds(tmp_path / "cloud.pcd")
        except LogError:
            continue
        robust_min_x(frame.points, estimator=Minimum())


# LZF


def test_lzf_unpacks_what_another_program_packed() -> None:
    lzf = importlib.import_module("lzf")
    rng = np.random.default_rng(0)
    for _ in range(200):
        plain = rng.integers(0, rng.integers(1, 256), rng.integers(10, 3000)).astype(np.uint8).tobytes()
        plain = plain * int(rng.integers(1, 4)) + b"a" * int(rng.integers(0, 700))
        packed = bytes(lzf.compress(plain, 2 * len(plain) + 100) or b"")  # of nothing it makes None
        assert unpack_lzf(packed, len(plain)) == plain


@pytest.mark.parametrize("packed", [b"", b"\x05abc", b"\xe0", b"\xe0\x01", b"\x20", b"\x01ab\x20\x09", b"\x00a" * 9])
def test_lzf_that_is_damaged(packed: bytes) -> None:
    with pytest.raises(ValueError, match="its compressed points"):
        unpack_lzf(packed, 7)


# Folders, and recorded clouds


def test_a_folder_of_pcd_named_by_their_stamps(tmp_path: Path) -> None:
    for stamp in ("1305031102.175304", "1305031102.275326"):
        (tmp_path / f"{stamp}.pcd").write_bytes(pcd("binary"))
    assert [frame.stamp for frame in open_clouds(tmp_path)] == pytest.approx([0.0, 0.100022], abs=1e-6)


def test_a_folder_of_several_formats_is_ambiguous(tmp_path: Path) -> None:
    (tmp_path / "a.pcd").write_bytes(pcd("binary"))
    (tmp_path / "a.bin").write_bytes(bytes(16))
    with pytest.raises(LogError, match="holds KITTI frames and PCD clouds; give each kind a folder of its own"):
        open_log(tmp_path)


def test_pcd_needs_no_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("pypcd4", "lzf"):
        monkeypatch.setitem(sys.modules, name, None)
    (tmp_path / "cloud.pcd").write_bytes(pcd("binary"))
    assert len(list(open_log(tmp_path / "cloud.pcd"))) == 1


@pytest.mark.parametrize(
    ("name", "count"),
    [
        ("nebula_vlp16", 14831),
        ("nebula_hesai_qt64", 34158),
        ("pcl_bun0_ascii", 397),
        ("pcl_car6_binary_compressed", 10031),
        ("pcl_office1_keypoints_binary", 1318),
    ],
)
def test_the_recorded_pcd(name: str, count: int, data: Path) -> None:
    path = data / "clouds" / f"{name}.pcd"
    (frame,) = open_clouds(path, sensor_height=1.5)
    assert frame.points.shape == (count,)
    rows = forward_left_up(frame.points)
    everywhere = Gate(x=(-math.inf, math.inf), y=(-math.inf, math.inf))
    in_place = robust_min_x(frame.points, gate=everywhere)
    assert in_place.candidates == np.isfinite(rows[:, :3]).all(axis=1).sum() - (rows[:, :3] == 0).all(axis=1).sum()
    assert in_place.x == robust_min_x(np.ascontiguousarray(rows[:, :3]), gate=everywhere).x
    pypcd4 = importlib.import_module("pypcd4")
    expected = pypcd4.PointCloud.from_fileobj(io.BytesIO(path.read_bytes())).pc_data
    assert frame.points.dtype.names == tuple(re.sub(r"#\$%&~~.*", "_", field) for field in expected.dtype.names)
    for field in expected.dtype.names:
        np.testing.assert_array_equal(frame.points[field], expected[field])
