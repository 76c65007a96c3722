"""Recorded clouds, each in its own layout, and the distances and times that others published for some of them."""

from __future__ import annotations

import csv
import gzip
import json
import math
import types
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.support.clouds import ESTIMATORS, answers
from ttc_fast import (
    Cluster,
    Detection,
    Gate,
    InterquartileFence,
    KthSmallest,
    MeanOfLowest,
    Minimum,
    Quantile,
    Status,
    Supported,
    from_pointcloud2,
    robust_min_x,
    ttc_from_clouds,
    ttc_from_distances,
)

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

    Array = NDArray[Any]

# --- files ---------------------------------------------------------------------------------------------------------


def read_pcd(path: Path) -> Any:
    """A PCD file as it stores its points: records, one array per column where it is compressed, or text."""
    raw = path.read_bytes()
    head, mark, _ = raw.partition(b"\nDATA ")
    kind, _, body = raw[len(head) + len(mark) :].partition(b"\n")
    header = {line.split()[0]: line.split()[1:] for line in head.decode().splitlines() if not line.startswith("#")}
    kinds = {"F": "f", "U": "u", "I": "i"}
    numbers = zip(header["FIELDS"], header["TYPE"], header["SIZE"], strict=True)
    fields = [(name, f"<{kinds[of]}{size}") for name, of, size in numbers]
    dtype = np.dtype(fields)
    count = int(header["POINTS"][0])
    if kind == b"binary":
        return np.frombuffer(body, dtype, count)
    if kind == b"ascii":
        return np.loadtxt(body.decode().splitlines(), np.float32)
    compressed, size = np.frombuffer(body, "<u4", 2).tolist()
    columns = uncompressed(body[8 : 8 + compressed])
    assert len(columns) == size == count * dtype.itemsize
    assert set(header["TYPE"]) == {"F"}
    return tuple(np.frombuffer(columns, "<f4").reshape(len(fields), count))


def uncompressed(data: bytes) -> bytes:
    """LZF: a byte below 32 announces literals; any other, a piece of what is there already, by length and distance."""
    out, at = bytearray(), 0
    while at < len(data):
        control = data[at]
        at += 1
        if control < 32:
            out += data[at : at + control + 1]
            at += control + 1
            continue
        length = control >> 5
        if length == 7:
            length += data[at]
            at += 1
        start = len(out) - ((control & 31) << 8) - data[at] - 1
        at += 1
        for place in range(start, start + length + 2):
            out.append(out[place])
    return bytes(out)


def message(header: Path) -> types.SimpleNamespace:
    """A PointCloud2 message, stored as its header in JSON and its data beside it."""
    msg: types.SimpleNamespace = json.loads(
        header.read_text(), object_hook=lambda fields: types.SimpleNamespace(**fields)
    )
    msg.data = gzip.decompress(header.with_suffix(".bin.gz").read_bytes())
    return msg


def argoverse(path: Path) -> tuple[Array, ...]:
    """Columns of an Arrow table; the coordinates are float16, which no kernel reads."""
    feather = pytest.importorskip("pyarrow.feather", reason="reading .feather needs pyarrow, of the extra 'test'")
    table = feather.read_table(path)
    x, y, z = (table[name].to_numpy().astype(np.float32) for name in ("x", "y", "z"))
    return x, y, z, table["intensity"].to_numpy()


def kitti(path: Path) -> Array:
    return np.frombuffer(gzip.decompress(path.read_bytes()), np.float32).reshape(-1, 4)


def course(path: Path) -> Array:
    """A count, then float64 rows."""
    raw = path.read_bytes()
    return np.frombuffer(raw, np.float64, offset=8).reshape(int.from_bytes(raw[:8], "little"), 4)


CLOUDS: dict[str, Callable[[Path], Any]] = {
    "VLP-16, PCD, steps of 32": lambda data: read_pcd(data / "clouds/nebula_vlp16.pcd"),
    "VLP-16, PointCloud2, steps of 22": lambda data: from_pointcloud2(
        message(data / "clouds/vlp16_xyzirt22_pointcloud2.json")
    ),
    "QT64, PCD, steps of 12": lambda data: read_pcd(data / "clouds/nebula_hesai_qt64.pcd"),
    "OS1-32, PointCloud2, organised": lambda data: from_pointcloud2(
        message(data / "clouds/ouster_os1_32_pointcloud2.json")
    ),
    "OS1-32, by reflectivity": lambda data: from_pointcloud2(
        message(data / "clouds/ouster_os1_32_pointcloud2.json"), intensity="reflectivity"
    ),
    "nuScenes, rows of 5": lambda data: np.fromfile(data / "clouds/nuscenes_lidar_top.pcd.bin", np.float32).reshape(
        -1, 5
    ),
    "Argoverse 2, columns": lambda data: argoverse(data / "clouds/av2_adcf7d18_315973157959879000.feather"),
    "PCL, compressed columns": lambda data: read_pcd(data / "clouds/pcl_car6_binary_compressed.pcd"),
    "PCL, text": lambda data: read_pcd(data / "clouds/pcl_bun0_ascii.pcd")[:, :3],
    "PCL, binary": lambda data: read_pcd(data / "clouds/pcl_office1_keypoints_binary.pcd"),
    "KITTI, memory map": lambda data: np.memmap(data / "kitti/velodyne_raw/0000000000.bin", np.float32, "r").reshape(
        -1, 4
    ),
    "course, float64": lambda data: course(data / "kitti/lesson/C22A5_currLidarPts.dat"),
}


def plain_rows(points: Any) -> Array:
    """The same points, copied by NumPy to contiguous rows x, y, z and perhaps intensity."""
    if isinstance(points, tuple):
        rows = np.column_stack(points)
    elif points.dtype.names:
        names = [name for name in ("x", "y", "z", "intensity") if name in points.dtype.names]
        rows = np.column_stack([points[name].ravel() for name in names])
    else:
        rows = points[:, :4]
    dtype = np.float64 if isinstance(points, np.ndarray) and points.dtype == np.float64 else np.float32
    return np.ascontiguousarray(rows, dtype)


def gates_for(rows: Array) -> list[Gate]:
    """Gates that some of these points are in, wherever they are."""
    returns = rows[np.isfinite(rows).all(1) & (rows[:, :3] != 0).any(1)]
    low, high = np.quantile(returns, (0.2, 0.9), axis=0)
    (x, y, z), bright = zip(low[:3], high[:3], strict=True), [*zip(low, high, strict=True)][3:]
    everywhere = (-math.inf, math.inf)
    gates = [Gate(x=everywhere, y=everywhere), Gate(x=x, y=y), Gate(x=x, y=everywhere, z=z)]
    return gates + [Gate(x=everywhere, y=y, intensity=each) for each in bright]


@pytest.fixture(params=list(CLOUDS.values()), ids=list(CLOUDS))
def cloud(request: pytest.FixtureRequest, data: Path) -> Any:
    return request.param(data)


def test_every_file_is_read_in_its_own_layout(cloud: Any) -> None:
    """As its points copied to plain rows, bit for bit, and not for want of points."""
    rows = plain_rows(cloud)
    gates = gates_for(rows)
    assert answers(cloud, gates) == answers(rows, gates)
    assert len(set(answers(cloud, gates))) > len(gates) * len(ESTIMATORS) // 2
    assert robust_min_x(cloud, gate=gates[-1], estimator=Minimum()).candidates > 20


def test_every_file_has_the_answers_of_numpy(cloud: Any) -> None:
    rows = plain_rows(cloud)
    gate = gates_for(rows)[1]
    (x_low, x_high), (y_low, y_high) = (np.array(bounds, rows.dtype) for bounds in (gate.x, gate.y))
    x, y, _ = rows[:, :3].T
    inside = (x_low <= x) & (x <= x_high) & (y_low <= y) & (y <= y_high)
    inside &= np.isfinite(rows[:, :3]).all(1) & (rows[:, :3] != 0).any(1)
    ahead = np.sort(x[inside].astype(np.float64))
    third = robust_min_x(cloud, gate=gate, estimator=KthSmallest(3))
    assert (third.nearest_x, third.x, third.candidates) == (ahead[0], ahead[2], len(ahead))
    assert rows[third.index, 0] == ahead[2]
    assert robust_min_x(cloud, gate=gate, estimator=Quantile(0.5)).x == pytest.approx(np.median(ahead), rel=1e-15)
    assert robust_min_x(cloud, gate=gate, estimator=MeanOfLowest(9)).x == pytest.approx(ahead[:9].mean(), rel=1e-12)


def test_one_scan_in_two_layouts(data: Path) -> None:
    """The VLP-16 file was stored with steps of 32 and of 22, the intensity once as a byte and once as a float."""
    one, other = (CLOUDS[name](data) for name in ("VLP-16, PCD, steps of 32", "VLP-16, PointCloud2, steps of 22"))
    assert (one.strides, other.strides) == ((32,), (22,))
    assert (one["intensity"].dtype, other["intensity"].dtype) == (np.uint8, np.float32)
    gates = gates_for(plain_rows(one))
    assert answers(one, gates) == answers(other, gates)


def test_an_organised_scan_whose_beams_without_return_are_zero(data: Path) -> None:
    """``is_dense`` says that there are none."""
    msg = message(data / "clouds/ouster_os1_32_pointcloud2.json")
    points = from_pointcloud2(msg)
    assert msg.is_dense
    assert (points.shape, points.strides) == ((32, 1024), (49152, 48))
    everything = Gate(x=(-math.inf, math.inf), y=(-math.inf, math.inf))
    returns = np.count_nonzero(points["range"])
    assert robust_min_x(points, gate=everything).candidates == returns < points.size
    found = robust_min_x(points, gate=Gate(x=(2.0, 50.0)), estimator=KthSmallest(5))
    assert points["x"].ravel()[found.index] == found.x


def test_nuscenes_looks_along_y(data: Path) -> None:
    """Forward is its y and left its -x; the same as turning the points, and not the same as leaving it out."""
    points = CLOUDS["nuScenes, rows of 5"](data)
    x, y, z, intensity, _ = points.T
    turned = np.column_stack([y, -x, z, intensity])
    axes = ("y", "-x", "z")
    for settings in (
        {"x": (3.0, 40.0)},
        {"y": (-1.0, 3.0), "z": (-1.2, 1.0)},
        {"x": (3.0, 90.0), "intensity": (5.0, 90.0)},
    ):
        gates = [Gate(**settings, axes=axes)], [Gate(**settings)]  # type: ignore[arg-type]
        assert answers(points, gates[0]) == answers(turned, gates[1])
        assert answers(points, gates[0]) != answers(points, gates[1])


# --- KITTI, published ----------------------------------------------------------------------------------------------

CROP = Gate(x=(2.0, 20.0), y=(-2.0, 2.0), z=(-1.5, -0.9), intensity=(0.1, 1.0))
"""Of the course's final project."""


@pytest.fixture(scope="module")
def frames(data: Path) -> list[Array]:
    return [kitti(path) for path in sorted((data / "kitti/velodyne").glob("*.bin.gz"))]


def published(data: Path, estimator: str) -> list[dict[str, str]]:
    with open(data / "kitti/published/ttc_lidar.csv") as table:
        return [row for row in csv.DictReader(table) if row["estimator"] == estimator]


def pair(frames: list[Array], row: dict[str, str]) -> tuple[Array, Array]:
    return frames[int(row["frame_prev"])], frames[int(row["frame_curr"])]


def test_published_plain_minima(data: Path, frames: list[Array]) -> None:
    """Times to 0.01 s. Where one was published as negative, nothing closes here, and never is a time negative."""
    rows = [row for row in published(data, "min") if row["ttc_s"]]
    assert len(rows) == 55
    assert len({row["source_repo"] for row in rows}) == 2
    for row in rows:
        found = ttc_from_clouds(*pair(frames, row), 0.1, gate=CROP, estimator=Minimum())
        expected = float(row["ttc_s"])
        assert found.distance / found.closing_speed == pytest.approx(expected, abs=0.01)
        if expected > 0:
            assert found.ttc == pytest.approx(expected, abs=0.01)
            assert found.status is Status.CLOSING
        else:
            assert found.ttc == math.inf
            assert found.status is Status.NOT_CLOSING


def test_published_plain_distances(data: Path, frames: list[Array]) -> None:
    rows = [row for row in published(data, "min") if row["d_curr_m"]]
    assert len(rows) == 35
    for row in rows:
        found = robust_min_x(frames[int(row["frame_curr"])], gate=CROP, estimator=Minimum())
        assert found.x == pytest.approx(float(row["d_curr_m"]), abs=1e-5)


def test_published_medians(data: Path, frames: list[Array]) -> None:
    """They are of the points inside an object detector's box, which lacks up to a few per cent of the corridor's.

    That moves a distance by 3 mm at most. Where it moves neither, which is in seven of the pairs, the times are equal.
    """
    for row in published(data, "median"):
        for frame, distance in zip(pair(frames, row), (row["d_prev_m"], row["d_curr_m"]), strict=True):
            if distance:
                found = robust_min_x(frame, gate=CROP, estimator=Quantile(0.5))
                assert found.x == pytest.approx(float(distance), abs=0.0035)
        if row["d_prev_m"]:
            ttc = ttc_from_distances(float(row["d_prev_m"]), float(row["d_curr_m"]), 0.1)
            assert ttc == pytest.approx(float(row["ttc_s"]), abs=0.01)

    rows = [row for row in published(data, "median") if row["source_repo"].startswith(("AndiA76", "fierval"))]
    unmoved = [row for row in rows if int(row["frame_curr"]) in (2, 3, 4, 6, 10, 13, 18)]
    assert len(unmoved) == 14
    for row in unmoved:
        found_ttc = ttc_from_clouds(*pair(frames, row), 0.1, gate=CROP, estimator=Quantile(0.5)).ttc
        assert found_ttc == pytest.approx(float(row["ttc_s"]), abs=0.01)


def test_the_published_median_of_the_stored_box(data: Path, frames: list[Array]) -> None:
    """Box 5 of the course's frame 0, shrunk by a tenth as its code does: the median is the published one."""
    x, y, width, height = np.frombuffer(
        (data / "kitti/lesson/C53A3_currBoundingBoxes.dat").read_bytes(), "<i4", 5, 8 + 5 * 112 + 8
    )[:4]
    left, top = (x + 0.05 * width).astype(int), (y + 0.05 * height).astype(int)
    u, v = in_image(data, frames[0])
    inside = (u >= left) & (u < left + int(0.9 * width)) & (v >= top) & (v < top + int(0.9 * height))
    before = robust_min_x(frames[0][inside], gate=CROP, estimator=Quantile(0.5)).x
    now = robust_min_x(frames[1], gate=CROP, estimator=Quantile(0.5)).x
    expected = {row["ttc_s"] for row in published(data, "median") if row["frame_prev"] == "0" and not row["d_prev_m"]}
    assert expected == {"12.5156"}
    assert ttc_from_distances(before, now, 0.1) == pytest.approx(12.5156, abs=1e-4)


def in_image(data: Path, points: Array) -> tuple[Array, Array]:
    """Where the points appear in the image of camera 0, px."""
    calibration = {}
    for name in ("calib_velo_to_cam.txt", "calib_cam_to_cam.txt"):
        for line in (data / "kitti/calib" / name).read_text().splitlines()[1:]:
            key, _, values = line.partition(":")
            calibration[key] = np.array(values.split(), float)
    camera = calibration["R"].reshape(3, 3) @ points[:, :3].T.astype(float) + calibration["T"][:, None]
    image = calibration["P_rect_00"].reshape(3, 4)[:, :3] @ calibration["R_rect_00"].reshape(3, 3) @ camera
    ahead = image[2] > 0
    u, v = np.where(ahead, image[:2] / np.where(ahead, image[2], 1.0), -1.0).astype(int)
    return u, v


def test_the_lesson(data: Path) -> None:
    before, now = (course(data / f"kitti/lesson/C22A5_{which}LidarPts.dat") for which in ("prev", "curr"))
    found = ttc_from_clouds(before, now, 0.1, estimator=Minimum())
    assert found.ttc == pytest.approx(12.972158904, abs=5e-10)
    assert ttc_from_distances(found.previous.x, found.current.x, 0.1) == found.ttc


# --- KITTI, every estimator ----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def corridor(data: Path) -> list[dict[str, float]]:
    with open(data / "kitti/corridor_distances.csv") as table:
        return [{name: float(value or "nan") for name, value in row.items() if name} for row in csv.DictReader(table)]


LISTED: dict[str, Any] = {
    "min": Minimum(),
    "k2": KthSmallest(2),
    "k5": KthSmallest(5),
    "k10": KthSmallest(10),
    "k20": KthSmallest(20),
    "mean10": MeanOfLowest(10),
    "q01": Quantile(0.01),
    "q05": Quantile(0.05),
    "q10": Quantile(0.10),
    "q20": Quantile(0.20),
    "median": Quantile(0.5),
}
ROUNDED = 0.5001e-4
"""Half of the last digit that the table gives, m."""


@pytest.mark.parametrize(("column", "estimator"), LISTED.items(), ids=LISTED)
def test_listed_distances(frames: list[Array], corridor: list[dict[str, float]], column: str, estimator: Any) -> None:
    for frame, row in zip(frames, corridor, strict=True):
        found = robust_min_x(frame, gate=CROP, estimator=estimator)
        assert found.x == pytest.approx(row[column], abs=ROUNDED)
        assert found.candidates == row["n_corridor"]


def test_listed_mean_and_median_of_twenty(frames: list[Array], corridor: list[dict[str, float]]) -> None:
    """The mean of all is the mean of the nearest n; the median of twenty lies between the tenth and the eleventh."""
    for frame, row in zip(frames, corridor, strict=True):
        mean = robust_min_x(frame, gate=CROP, estimator=MeanOfLowest(int(row["n_corridor"])))
        assert mean.x == pytest.approx(row["mean"], abs=ROUNDED)
        tenth, eleventh = (robust_min_x(frame, gate=CROP, estimator=KthSmallest(k)).x for k in (10, 11))
        assert (tenth + eleventh) / 2 == pytest.approx(row["med20"], abs=ROUNDED)


def test_listed_distances_at_any_reflectivity(frames: list[Array], corridor: list[dict[str, float]]) -> None:
    """Without the limit nearly every frame shows the own bonnet."""
    anything = Gate(x=CROP.x, y=CROP.y, z=CROP.z)
    found = [robust_min_x(frame, gate=anything, estimator=Minimum()) for frame in frames]
    assert [each.candidates for each in found] == [row["n_corridor_any_reflectivity"] for row in corridor]
    assert [each.x for each in found] == pytest.approx([row["min_any_reflectivity"] for row in corridor], abs=ROUNDED)
    assert sum(each.x == pytest.approx(2.5, abs=0.05) for each in found) == 18


def test_listed_times(frames: list[Array], corridor: list[dict[str, float]]) -> None:
    for previous, current, row in zip(frames, frames[1:], corridor[1:], strict=False):
        found = ttc_from_clouds(previous, current, 0.1, gate=CROP, estimator=Minimum())
        assert found.distance / found.closing_speed == pytest.approx(row["ttc_min"], abs=2e-3)
        assert found.ttc == (pytest.approx(row["ttc_min"], abs=2e-3) if row["ttc_min"] > 0 else math.inf)


@pytest.mark.parametrize(("stray", "ahead"), [(11, 0.139), (16, 0.136)])
def test_one_stray_point(frames: list[Array], corridor: list[dict[str, float]], stray: int, ahead: float) -> None:
    """In front of the car by so much. It makes the plain minimum brake; every other estimator outvotes it."""
    reference = corridor[stray]["ttc_ref"]
    nearest = robust_min_x(frames[stray], gate=CROP, estimator=Minimum())
    second = robust_min_x(frames[stray], gate=CROP, estimator=KthSmallest(2))
    assert second.x - nearest.x == pytest.approx(ahead, abs=5e-4)
    assert second.nearest_x == nearest.x == frames[stray][nearest.index, 0]
    for estimator, error in ((Minimum(), 5.0), (KthSmallest(10), 0.0)):
        before_and_after = frames[stray - 1], frames[stray]
        found = ttc_from_clouds(*before_and_after, 0.1, gate=CROP, estimator=estimator)
        assert error < abs(found.ttc - reference) < error + 3.0
    for robust in (Quantile(0.05), InterquartileFence(1.5), Supported(3, 0.05), Cluster(0.1, 10)):
        assert second.x <= robust_min_x(frames[stray], gate=CROP, estimator=robust).x < second.x + 0.03


@pytest.mark.parametrize("after", [12, 17])
def test_the_frame_after_a_stray_point(frames: list[Array], after: int) -> None:
    """The plain minimum seems to move away, and a naive quotient is negative; the tenth goes on closing."""
    clouds = frames[after - 1], frames[after]
    assert ttc_from_clouds(*clouds, 0.1, gate=CROP, estimator=Minimum()).status is Status.NOT_CLOSING
    assert ttc_from_clouds(*clouds, 0.1, gate=CROP, estimator=KthSmallest(10)).status is Status.CLOSING


def test_a_corridor_without_anything_in_it_is_clear(frames: list[Array]) -> None:
    for frame in frames:
        assert robust_min_x(frame, gate=Gate(x=(2.8, 6.5), y=(-1.0, 1.0), z=(-1.2, 0.0))).detection is Detection.CLEAR
