"""``fit_road``: simulated clouds with exact truth, clouds without a road, the reference, and recorded clouds."""

from __future__ import annotations

import csv
import gzip
import itertools
import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import ttc_fast
from tests.support.cloud_layouts import LAYOUTS
from tests.support.common import both_dtypes, every_module
from tests.support.strategies import dtypes, seeds
from ttc_fast import Gate, KthSmallest, Road, RoadStatus, reference

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    Doubles = NDArray[np.float64]

# Elevations of the beams of common sensors, degrees.
SENSORS = {
    "64 beams": np.linspace(-24.8, 2.0, 64),
    "32 beams": np.linspace(-30.7, 10.7, 32),
    "16 beams": np.linspace(-15.0, 15.0, 16),
}
FLAT = Road(0.0, 0.0, -1.73)

# Corners (forward, left, above the road) of boxes: cars ahead and parked on both sides, and a wall.
CARS = [
    ((9.0, -0.9, 0.2), (13.0, 0.9, 1.5)),
    ((4.0, 2.2, 0.2), (8.5, 4.0, 1.5)),
    ((11.0, 2.3, 0.2), (15.0, 4.1, 1.6)),
    ((5.0, -4.6, 0.2), (9.5, -2.7, 1.5)),
    ((18.0, -4.4, 0.2), (22.0, -2.6, 1.5)),
]
WALL = ((0.0, 6.0, 0.0), (40.0, 6.5, 4.0))
KERBS = [((0.0, 5.0, 0.0), (40.0, 8.0, 0.12)), ((0.0, -8.0, 0.0), (40.0, -5.0, 0.12))]


def scan(road: Road, things: Any = (), *, beams: str = "64 beams", noise: float = 0.02, seed: int = 1) -> Doubles:
    """What a lidar at the origin sees of a road and boxes on it; a tilt of the road is as good as one of the sensor."""
    rng = np.random.default_rng(seed)
    elevation, azimuth = np.radians(np.meshgrid(SENSORS[beams], np.arange(-90, 90, 0.4))).reshape(2, -1)
    rays = np.stack([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
    # Sheared so that the road is level, a ray is still a line with the same distances along it.
    level = np.stack([rays[0], rays[1], rays[2] - road.slope_x * rays[0] - road.slope_y * rays[1]], axis=1)
    start = np.array([0.0, 0.0, -road.offset])
    with np.errstate(divide="ignore", invalid="ignore"):
        hits = np.where(level[:, 2] < 0, road.offset / level[:, 2], np.inf)
        for low, high in things:
            faces = np.sort([(low - start) / level, (high - start) / level], axis=0)
            enters, leaves = faces[0].max(axis=1), faces[1].min(axis=1)
            hits = np.where((enters > 0) & (enters < leaves), np.minimum(hits, enters), hits)
    seen = hits < 80
    distance = hits[seen] + rng.normal(0, noise, seen.sum())
    points: Doubles = (rays[:, seen] * distance).T
    return points


def surface(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float], count: int = 4000) -> Doubles:
    """Points spread evenly over a box."""
    low, high = np.transpose([x, y, z])
    return np.random.default_rng(2).uniform(low, high, (count, 3))


def error(fit: ttc_fast.RoadFit, truth: Road) -> float:
    """The largest error in height over the lane, up to 25 m ahead, m."""
    assert fit.road is not None, fit
    slope_x, slope_y = fit.road.slope_x - truth.slope_x, fit.road.slope_y - truth.slope_y
    offset = fit.road.offset - truth.offset
    return max(abs(slope_x * x + slope_y * y + offset) for x, y in itertools.product((0, 25), (-2, 2)))


@pytest.mark.parametrize("beams", SENSORS)
@pytest.mark.parametrize(
    "truth",
    [
        FLAT,
        Road(0.1, 0.0, -1.73),
        Road(-0.1, 0.0, -1.73),
        Road(0.15, 0.05, -1.73),  # uphill, pitched and rolled
        Road(0.05, -0.1, -1.43),  # the sensor 0.3 m lower than thought
        Road(-0.05, 0.05, -2.03),  # and higher
    ],
)
@pytest.mark.parametrize("things", [[], [*CARS, WALL], CARS + KERBS], ids=["empty", "cars and wall", "cars and kerbs"])
def test_the_road_is_found_among_what_stands_on_it(beams: str, truth: Road, things: Any) -> None:
    assert error(ttc_fast.fit_road(scan(truth, things, beams=beams)), truth) < 0.03


def test_the_numbers_beside_the_road() -> None:
    fit = ttc_fast.fit_road(scan(FLAT, CARS))
    assert fit.reason == ""
    assert fit.status is RoadStatus.FOUND
    assert 0.6 < fit.share < 1.0
    assert 100 < fit.patches < 12 * 30
    assert 8.0 < fit.width < 12.5
    assert fit.rms < 0.01
    assert fit.inliers > 3000


def test_rms_tells_a_bent_road() -> None:
    flat = scan(FLAT)
    bent = flat + np.stack([0 * flat[:, 0], 0 * flat[:, 0], 5e-4 * flat[:, 0] ** 2], axis=-1)
    assert ttc_fast.fit_road(bent).rms > 5 * ttc_fast.fit_road(flat).rms


@pytest.mark.parametrize("beams", SENSORS)
@pytest.mark.parametrize("height", [(0.2, 3.0), (0.2, 0.6), (0.1, 0.3)])
def test_two_in_five_points_above_the_road(beams: str, height: tuple[float, float]) -> None:
    points = scan(FLAT, beams=beams)
    rng = np.random.default_rng(3)
    points[:, 2] += np.where(rng.random(len(points)) < 0.4, rng.uniform(*height, len(points)), 0)
    assert error(ttc_fast.fit_road(points), FLAT) < 0.03


@pytest.mark.parametrize("beams", SENSORS)
def test_reflections_below_the_road(beams: str) -> None:
    """One in twenty rays seems to come from behind what mirrored it; one in a hundred points is anywhere below."""
    points = scan(FLAT, CARS, beams=beams)
    rng = np.random.default_rng(3)
    mirrored = points[rng.random(len(points)) < 0.05]
    mirrored = mirrored * rng.uniform(1.05, 2.0, (len(mirrored), 1))
    below = surface((0, 30), (-6, 6), (FLAT.offset - 2, FLAT.offset - 0.1), len(points) // 100)
    assert error(ttc_fast.fit_road(np.concatenate([points, mirrored, below])), FLAT) < 0.03


def test_the_bonnet_in_place_of_the_road_nearby() -> None:
    points = scan(FLAT)
    bonnet = surface((0.5, 2.5), (-0.9, 0.9), (-0.95, -0.85), 5000)
    cloud = np.concatenate([points[points[:, 0] > 6], bonnet])
    assert error(ttc_fast.fit_road(cloud), FLAT) < 0.03


def test_of_two_planes_that_a_kerb_parts_the_lower_is_the_road() -> None:
    """Half of what is seen is pavement."""
    pavements = [((0.0, 3.0, 0.0), (40.0, 8.0, 0.12)), ((0.0, -8.0, 0.0), (40.0, -3.0, 0.12))]
    assert error(ttc_fast.fit_road(scan(FLAT, pavements)), FLAT) < 0.04


def at_heights(z: Any) -> Doubles:
    """A cloud that would be a flat road ahead, but for its heights."""
    points = surface((2, 30), (-6, 6), (0, 0))
    points[:, 2] = z
    return points


@pytest.mark.parametrize(
    ("cloud", "reason"),
    [
        (surface((10.0, 10.2), (-6, 6), (-3, 3)), "fewer than min_patches of it are seen"),  # a wall ahead
        (surface((0, 30), (3.0, 3.2), (-3, 3)), "what is seen of it is narrower than min_width"),  # a wall alongside
        (at_heights(1.2), "above the sensor, or farther than height_tolerance from sensor_height"),  # a ceiling
        (at_heights(-4.0), "above the sensor, or farther than height_tolerance from sensor_height"),
        (at_heights(FLAT.offset)[:20], "fewer than min_patches of it are seen"),
        (at_heights(FLAT.offset) * [1, 0, 1], "what is seen of it is narrower than min_width"),  # a line
        (
            np.arange(30)[:, None] * [[1.0, 0.4, 0.0]] + [0, -6, FLAT.offset],
            "what is seen of it is narrower than min_width",
        ),
        (surface((0, 30), (-6, 6), (-9, 9)), "steeper than max_slope"),  # bushes
        (np.array([[-5.0, 0.0, FLAT.offset]]), "no point where a road could be"),
    ],
)
def test_what_is_no_road(cloud: Doubles, reason: str) -> None:
    for module in (ttc_fast, reference):
        fit: Any = module.fit_road(cloud)
        assert fit.status == RoadStatus.NOT_FOUND
        assert fit.road is None
        assert fit.reason == reason


def test_too_steep() -> None:
    x, y, _ = surface((2, 30), (-6, 6), (0, 0)).T
    fit = ttc_fast.fit_road(np.stack([x, y, 0.105 * x - 1.73], axis=-1), max_slope=0.1)
    assert (fit.road, fit.reason) == (None, "steeper than max_slope")


def test_a_room_without_a_floor() -> None:
    walls = [surface((12.0, 12.1), (-4, 4), (-1.5, 1.5)), surface((1, 12), (3.9, 4.0), (-1.5, 1.5))]
    walls += [surface((1, 12), (-4.0, -3.9), (-1.5, 1.5)), surface((1, 12), (-4, 4), (1.4, 1.5))]
    walls += [surface((5, 7), (-1, 1), (-1.0, -0.95))]  # a table
    assert ttc_fast.fit_road(np.concatenate(walls)).status == RoadStatus.NOT_FOUND


@pytest.mark.parametrize(
    "cloud", [np.empty((0, 3)), np.zeros((50, 3)), np.full((50, 4), np.nan), np.full((2, 25, 3), np.inf)]
)
def test_no_data(cloud: Doubles) -> None:
    for module in (ttc_fast, reference):
        fit: Any = module.fit_road(cloud)
        assert (fit.road, fit.status, fit.reason) == (None, RoadStatus.NO_DATA, "no valid point")
        assert (fit.inliers, fit.patches, fit.share, fit.width) == (0, 0, 0.0, 0.0)
        assert math.isnan(fit.rms)


def assert_same(fit: Any, expected: Any) -> None:
    assert (fit.status, fit.reason, fit.inliers, fit.patches, fit.share) == (
        expected.status,
        expected.reason,
        expected.inliers,
        expected.patches,
        expected.share,
    )
    # A residual of 0 is the root of what rounding leaves of a difference of squares.
    np.testing.assert_allclose(numbers(fit), numbers(expected), rtol=1e-9, atol=1e-6)


def numbers(fit: Any) -> list[float]:
    plane = [fit.road.slope_x, fit.road.slope_y, fit.road.offset] if fit.road else []
    assert all(map(math.isfinite, plane))
    return [fit.width, fit.rms, *plane]


@pytest.mark.parametrize("layout", LAYOUTS)
@both_dtypes
def test_every_layout_gives_the_same_road(layout: str, dtype: Any) -> None:
    points = scan(Road(0.03, 0.01, -1.7), CARS, beams="16 beams").astype(dtype)[:7000]
    plain, other = ttc_fast.fit_road(points), ttc_fast.fit_road(LAYOUTS[layout](tuple(points.T)))
    assert plain.road == other.road
    assert_same(plain, other)


def test_axes() -> None:
    points = scan(Road(0.05, 0.02, -1.8), CARS)
    x_right = np.stack([-points[:, 1], points[:, 0], points[:, 2]], axis=-1)  # as in nuScenes
    z_forward = np.stack([-points[:, 1], -points[:, 2], points[:, 0]], axis=-1)  # as a camera has it
    expected = ttc_fast.fit_road(points).road
    assert ttc_fast.fit_road(x_right, axes=("y", "-x", "z")).road == expected
    assert ttc_fast.fit_road(z_forward, axes=("z", "-x", "-y")).road == expected
    assert reference.fit_road(z_forward, axes=("z", "-x", "-y")).status == RoadStatus.FOUND


def test_where_and_what_to_look_for() -> None:
    """Each setting by what it changes."""
    road = scan(FLAT)
    assert ttc_fast.fit_road(road, x=(5.0, 20.0), y=(-3.0, 3.0)).patches <= 15 * 6
    assert ttc_fast.fit_road(road, sensor_height=1.2).status == RoadStatus.NOT_FOUND
    assert ttc_fast.fit_road(road, sensor_height=1.2, height_tolerance=0.6).status == RoadStatus.FOUND
    assert ttc_fast.fit_road(road, min_patches=361).status == RoadStatus.NOT_FOUND
    assert ttc_fast.fit_road(road, min_width=13.0).status == RoadStatus.NOT_FOUND
    assert ttc_fast.fit_road(scan(FLAT, CARS), min_share=0.99).reason == "less than min_share of the patches agree"
    narrow = ttc_fast.fit_road(scan(FLAT, KERBS), tolerance=0.05)
    assert narrow.patches < ttc_fast.fit_road(scan(FLAT, KERBS), tolerance=0.3).patches


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ({"sensor_height": math.nan}, "sensor_height"),
        ({"x": (30.0, 0.0)}, "x"),
        ({"y": (math.nan, 1.0)}, "y"),
        ({"x": (0.0, math.inf)}, "x"),
        ({"x": (0.0, 1e4)}, "x, y"),
        ({"axes": ("x", "x", "z")}, "axes"),
        ({"height_tolerance": 0.0}, "height_tolerance"),
        ({"max_slope": -0.1}, "max_slope"),
        ({"tolerance": math.inf}, "tolerance"),
        ({"min_patches": 0}, "min_patches"),
        ({"min_patches": -1}, "min_patches"),
        ({"min_width": 0.0}, "min_width"),
        ({"min_share": 1.1}, "min_share"),
        ({"min_share": math.nan}, "min_share"),
    ],
)
@every_module
def test_settings_that_make_no_sense(module: Any, wrong: dict[str, Any], named: str) -> None:
    with pytest.raises(ValueError, match=f"^{named} "):
        module.fit_road(np.ones((3, 3)), **wrong)


@st.composite
def clouds(draw: st.DrawFn) -> NDArray[Any]:
    """Roads, pieces of roads and anything else, with points that are none."""
    rng = np.random.default_rng(draw(seeds))
    slope_x, slope_y, offset = rng.uniform([-0.25, -0.25, -2.4], [0.25, 0.25, -1.0])
    count = draw(st.sampled_from([0, 1, 40, 300, 3000]))
    area = draw(st.sampled_from([((-5.0, 40.0), (-8.0, 8.0)), ((8.0, 12.0), (-3.0, 3.0)), ((0.0, 30.0), (0.9, 1.1))]))
    low, high = np.transpose(area)
    x, y = rng.uniform(low, high, (count, 2)).T
    z = slope_x * x + slope_y * y + offset + rng.normal(0, draw(st.sampled_from([0.0, 0.02, 0.3])), count)
    z += rng.choice([0.0, 0.12, 1.0, -0.3], count, p=[0.7, 0.1, 0.1, 0.1])
    points = np.stack([x, y, z], axis=-1).astype(draw(dtypes))
    points[rng.random(points.shape) < draw(st.sampled_from([0.0, 0.3]))] = draw(
        st.sampled_from([0.0, math.nan, -math.inf, 1e30, 30.0, -8.0])
    )
    return points


@given(clouds(), st.sampled_from([{}, {"x": (2.5, 20.1)}, {"tolerance": 0.3}, {"min_width": 0.01, "min_patches": 1}]))
@settings(max_examples=150, deadline=None)
def test_the_reference_agrees(points: NDArray[Any], chosen: Any) -> None:
    assert_same(ttc_fast.fit_road(points, **chosen), reference.fit_road(points, **chosen))


def velodyne(data: Path) -> list[NDArray[np.float32]]:
    """KITTI frames 0..19, 10 a second, behind a car that brakes."""
    files = sorted((data / "kitti" / "velodyne").glob("*.bin.gz"))
    return [np.frombuffer(gzip.decompress(file.read_bytes()), "<f4").reshape(-1, 4) for file in files]


def test_kitti_roads_are_steady(data: Path) -> None:
    fits = [ttc_fast.fit_road(frame) for frame in velodyne(data)]
    planes = np.array([(fit.road.slope_x, fit.road.slope_y, fit.road.offset) for fit in fits if fit.road])
    assert len(planes) == 20
    assert np.abs(planes[:, :2]).max() < 0.015
    assert np.abs(planes[:, 2] + 1.73).max() < 0.03
    assert np.abs(np.diff(planes, axis=0)).max(axis=0) == pytest.approx([0, 0, 0], abs=0.01)
    assert np.abs(np.diff(planes[:, :2], axis=0)).max() < 0.002
    assert max(fit.rms for fit in fits) < 0.03


def test_kitti_agrees_with_the_reference(data: Path) -> None:
    for frame in velodyne(data)[::7]:
        assert_same(ttc_fast.fit_road(frame), reference.fit_road(frame))


def test_the_car_ahead_is_as_far_above_the_fitted_road_as_in_a_height_band(data: Path) -> None:
    with (data / "kitti" / "corridor_distances.csv").open() as table:
        rows = list(csv.DictReader(table))
    for frame, row in zip(velodyne(data), rows, strict=True):
        # The band of the table, -1.5 to -0.9 m, as heights above a road 1.73 m below the sensor.
        road = ttc_fast.fit_road(frame).road
        gate = Gate(x=(2.0, 20.0), y=(-2.0, 2.0), intensity=(0.1, 1.0), road=road, height=(0.23, 0.83))
        for estimator, column in ((KthSmallest(20), "k20"), (ttc_fast.Quantile(0.05), "q05")):
            x = ttc_fast.robust_min_x(frame, gate=gate, estimator=estimator).x
            assert x == pytest.approx(float(row[column]), abs=0.05)


def pcd(path: Path) -> NDArray[Any]:
    """Coordinates of a binary PCD file."""
    head, _, body = path.read_bytes().partition(b"DATA binary\n")
    header = dict(line.split(" ", 1) for line in head.decode().splitlines())
    step = sum(map(int, header["SIZE"].split()))
    return np.ndarray((int(header["POINTS"]), 3), "<f4", body, 0, (step, 4))


def test_nuscenes_and_ouster_have_a_road(data: Path) -> None:
    forward_is_y = np.fromfile(data / "clouds" / "nuscenes_lidar_top.pcd.bin", "<f4").reshape(-1, 5)
    nuscenes = ttc_fast.fit_road(forward_is_y, axes=("y", "-x", "z"), sensor_height=1.84)
    header = json.loads((data / "clouds" / "ouster_os1_32_pointcloud2.json").read_text())
    message = gzip.decompress((data / "clouds" / "ouster_os1_32_pointcloud2.bin.gz").read_bytes())
    shape, strides = (header["height"], header["width"], 3), (header["row_step"], header["point_step"], 4)
    ouster = ttc_fast.fit_road(np.ndarray(shape, "<f4", message, 0, strides))
    for fit, offset in ((nuscenes, -1.83), (ouster, -1.77)):
        assert fit.road is not None
        assert fit.road.offset == pytest.approx(offset, abs=0.03)
        assert abs(fit.road.slope_x) < 0.03
        assert abs(fit.road.slope_y) < 0.01


@pytest.mark.parametrize("sensor_height", [0.3, 1.0, 1.73, 2.2])
@pytest.mark.parametrize("name", ["nebula_vlp16.pcd", "nebula_hesai_qt64.pcd"])
def test_laboratories_have_no_road(data: Path, name: str, sensor_height: float) -> None:
    """Both were recorded indoors, with little floor in front."""
    assert ttc_fast.fit_road(pcd(data / "clouds" / name), sensor_height=sensor_height).status == RoadStatus.NOT_FOUND
