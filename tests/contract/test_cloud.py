"""Every sentence of the contract about clouds, with numbers worked out by hand; the kernels and the reference alike."""

from __future__ import annotations

import math
import pickle
from typing import Any

import numpy as np
import pytest

import ttc_fast
from tests.support.common import both_dtypes
from ttc_fast import (
    Cluster,
    Detection,
    Gate,
    InterquartileFence,
    KthSmallest,
    MeanOfLowest,
    Minimum,
    Quantile,
    Road,
    Status,
    Supported,
)

INF, NAN = math.inf, math.nan


def ahead(*x: float, dtype: Any = np.float64) -> Any:
    """Points straight ahead at these distances, in this order."""
    return np.column_stack([x, np.zeros(len(x)), np.full(len(x), 0.5)]).astype(dtype)


def at(*points: tuple[float, ...], dtype: Any = np.float64) -> Any:
    return np.array(points, dtype)


BLIND = at((NAN, 0.0, 0.0), (0.0, 0.0, 0.0))
EMPTY = ahead(-5.0)
"""Something was seen, behind."""


def seen(found: Any) -> tuple[Any, ...]:
    return found.x, found.support, found.index, found.detection


# --- which points count --------------------------------------------------------------------------------------------


@both_dtypes
@pytest.mark.parametrize("bad", [NAN, INF, -INF])
@pytest.mark.parametrize("column", range(3))
def test_a_coordinate_that_is_not_finite(ttc: Any, dtype: Any, bad: float, column: int) -> None:
    points = ahead(3.0, 8.0, dtype=dtype)
    points[0, column] = bad
    found = ttc.robust_min_x(points, gate=Gate(x=(-INF, INF), y=(-INF, INF)), estimator=Minimum())
    assert (found.x, found.nearest_x, found.candidates, found.index) == (8.0, 8.0, 1, 1)


@both_dtypes
@pytest.mark.parametrize("zero", [(0.0, 0.0, 0.0), (-0.0, 0.0, -0.0)])
def test_no_return(ttc: Any, dtype: Any, zero: tuple[float, ...]) -> None:
    """A row of zeros is what a driver sends without one. A point with a zero in it is a point."""
    found = ttc.robust_min_x(at(zero, (0.0, 0.0, 0.25), (4.0, 0.0, 0.0), dtype=dtype), estimator=Minimum())
    assert (found.x, found.candidates, found.index) == (0.0, 2, 1)


@both_dtypes
def test_the_default_gate_is_a_lane_4_m_wide_and_whatever_is_ahead(ttc: Any, dtype: Any) -> None:
    sides = at((5.0, 2.0, 0.0), (5.0, -2.0, 9.0), (5.0, 2.01, 0.0), (5.0, -2.01, 0.0), (-0.01, 0.0, 0.0), dtype=dtype)
    assert ttc.robust_min_x(sides, estimator=Minimum()).candidates == 2
    assert ttc.robust_min_x(ahead(0.0, 1e30, dtype=dtype), estimator=Minimum()).candidates == 2
    gate = Gate()
    assert (gate.x, gate.y, gate.z, gate.intensity) == ((0.0, INF), (-2.0, 2.0), None, None)
    assert (gate.axes, gate.curvature, gate.road, gate.height) == (("x", "y", "z"), 0.0, None, None)


def test_the_default_estimator_is_the_tenth(ttc: Any) -> None:
    points = ahead(*range(1, 21))
    assert ttc.robust_min_x(points).x == 10.0
    assert ttc.ttc_from_clouds(points + np.array([1, 0, 0]), points, 0.1).distance == 10.0


@both_dtypes
def test_bounds_are_inclusive_and_rounded_to_the_dtype(ttc: Any, dtype: Any) -> None:
    """float32(0.7) lies below 0.7 and float32(1.1) above 1.1: both are on the bound, not outside."""
    gate = Gate(x=(0.7, 1.1), y=(-1.1, -0.7), z=(0.7, 1.1))
    corners = at((0.7, -1.1, 0.7), (1.1, -0.7, 1.1), dtype=dtype)
    assert ttc.robust_min_x(corners, gate=gate, estimator=Minimum()).candidates == 2
    beyond = np.nextafter(corners, corners + np.sign(corners - corners.mean(0)), dtype=dtype)
    assert ttc.robust_min_x(beyond, gate=gate, estimator=Minimum()).detection is Detection.CLEAR


def test_above_road_is_a_band_on_z(ttc: Any) -> None:
    """1.73 m above the road, the road is at z = -1.73: from 0.23 m above it to 2 m is -1.5 .. 0.27."""
    gate = Gate.above_road(1.73, clearance=0.23, headroom=2.0, x=(1.0, 30.0))
    assert gate.z == pytest.approx((-1.5, 0.27))
    assert (gate.x, gate.y) == ((1.0, 30.0), (-2.0, 2.0))
    points = at((3.0, 0.0, -1.6), (4.0, 0.0, 0.4), (6.0, 0.0, -1.4))
    assert seen(ttc.robust_min_x(points, gate=gate, estimator=Minimum())) == (6.0, 1, 2, Detection.FOUND)


def test_height_above_a_road_that_rises(ttc: Any) -> None:
    """1 in 10: at 10 m the road is 1 m higher than under the sensor, and a flat band would take it for an obstacle."""
    road = Road(0.1, 0.0, -1.5)
    points = at((10.0, 0.0, -0.4), (12.0, 0.0, 0.2))
    found = ttc.robust_min_x(points, gate=Gate(road=road, height=(0.2, 2.0)), estimator=Minimum())
    assert seen(found) == (12.0, 1, 1, Detection.FOUND)
    flat = Gate.above_road(1.5, clearance=0.2, headroom=2.0)
    assert ttc.robust_min_x(points, gate=flat, estimator=Minimum()).x == 10.0


def test_intensity_is_in_the_units_stored(ttc: Any) -> None:
    """A retroreflector is 255 in one driver's bytes and 1.0 in another's."""
    x, nothing = np.array([4.0, 5.0, 6.0]), np.zeros(3)
    for intensity, bounds in (([20, 26, 255], (26, 255)), ([0.05, 0.1, 0.99], (0.1, 1.0))):
        points = (x, nothing, nothing, np.array(intensity, np.uint8 if bounds[1] > 1 else np.float64))
        found = ttc.robust_min_x(points, gate=Gate(intensity=bounds), estimator=Minimum())
        assert (found.x, found.candidates) == (5.0, 2)


def test_a_gate_on_an_intensity_that_is_not_there(ttc: Any) -> None:
    with pytest.raises(ValueError, match=r"gate.*intensity"):
        ttc.robust_min_x(ahead(5.0), gate=Gate(intensity=(0.0, 1.0)))


@both_dtypes
def test_a_cloud_whose_y_is_forward(ttc: Any, dtype: Any) -> None:
    """nuScenes: x to the right, y forward. Read as it is, the wall at the side would be the one ahead."""
    points = at((1.5, 9.0, 0.5), (-1.0, 7.0, 0.5), (5.0, 0.5, 0.5), dtype=dtype)
    found = ttc.robust_min_x(points, gate=Gate(axes=("y", "-x", "z")), estimator=Minimum())
    assert seen(found) == (7.0, 1, 1, Detection.FOUND)
    left_only = Gate(y=(0.0, 2.0), axes=("y", "-x", "z"))
    assert ttc.robust_min_x(points, gate=left_only, estimator=Minimum()).candidates == 1
    assert ttc.robust_min_x(points, estimator=Minimum()).x == 5.0


def test_a_sensor_that_looks_back(ttc: Any) -> None:
    points = at((-3.0, 0.5, 0.0), (-4.0, -0.5, 0.0), (2.0, 0.0, 0.0))
    found = ttc.robust_min_x(points, gate=Gate(axes=("-x", "-y", "z")), estimator=Minimum())
    assert (found.x, found.nearest_x, found.candidates) == (3.0, 3.0, 2)


# --- what was found ------------------------------------------------------------------------------------------------


@both_dtypes
def test_nothing_seen_and_nothing_there_are_not_the_same(ttc: Any, dtype: Any) -> None:
    for blind in (BLIND.astype(dtype), np.empty((0, 3), dtype), np.full((50, 3), NAN, dtype), np.zeros((50, 4), dtype)):
        found = ttc.robust_min_x(blind)
        assert (found.detection, found.candidates, found.support, found.index) == (Detection.NO_DATA, 0, 0, -1)
        assert math.isnan(found.x)
        assert math.isnan(found.nearest_x)
    found = ttc.robust_min_x(EMPTY.astype(dtype))
    assert (found.x, found.nearest_x, found.candidates, found.index) == (INF, INF, 0, -1)
    assert found.detection is Detection.CLEAR
    mixed = np.concatenate([BLIND, EMPTY, BLIND]).astype(dtype)
    assert ttc.robust_min_x(mixed).detection is Detection.CLEAR


@pytest.mark.parametrize(
    "estimator",
    [KthSmallest(4), MeanOfLowest(4), Supported(4, 9.0), Supported(2, 0.5), Cluster(0.5, 2), Cluster(9.0, 4)],
)
def test_too_few_is_never_a_distance(ttc: Any, estimator: Any) -> None:
    """The plain nearest x stands beside it, for who has to decide."""
    found = ttc.robust_min_x(ahead(8.0, 6.0, 7.0), estimator=estimator)
    assert math.isnan(found.x)
    assert (found.nearest_x, found.candidates, found.support, found.index) == (6.0, 3, 0, -1)
    assert found.detection is Detection.TOO_FEW


def test_a_small_thing_that_a_rank_does_not_see(ttc: Any) -> None:
    """Five points of a child at 6 m, in front of a wall at 20 m: the tenth is the wall. The nearest x tells."""
    found = ttc.robust_min_x(ahead(*[6.0] * 5, *[20.0] * 100), estimator=KthSmallest(10))
    assert (found.x, found.nearest_x, found.candidates) == (20.0, 6.0, 105)


def test_a_dark_car_that_a_reflectivity_gate_does_not_see(ttc: Any) -> None:
    dark = np.column_stack([ahead(6.0, 6.1), [0.02, 0.03]])
    assert ttc.robust_min_x(dark, gate=Gate(intensity=(0.1, 1.0)), estimator=Minimum()).detection is Detection.CLEAR
    assert ttc.robust_min_x(dark, estimator=Minimum()).x == 6.0


# --- estimators ----------------------------------------------------------------------------------------------------

STRAY = ahead(8.0, 3.0, 8.1, 8.2, 8.3, 8.4, 8.5, 8.6)
"""A stray point 5 m in front of a car."""


@pytest.mark.parametrize(
    ("estimator", "expected"),
    [
        (Minimum(), (3.0, 1, 1)),
        (KthSmallest(1), (3.0, 1, 1)),
        (KthSmallest(2), (8.0, 2, 0)),
        (KthSmallest(8), (8.6, 8, 7)),
        (Quantile(0.0), (3.0, 1, -1)),
        (Quantile(1.0), (8.6, 8, -1)),
        (Quantile(0.5), (8.25, 4, -1)),  # between 8.2 and 8.3, the fourth and fifth of eight
        (Quantile(0.1), (6.5, 1, -1)),  # 0.7 of the way from 3 to 8
        (MeanOfLowest(1), (3.0, 1, -1)),
        (MeanOfLowest(3), (19.1 / 3, 3, -1)),
        (InterquartileFence(1.5), (8.0, 7, 0)),  # quartiles 8.075 and 8.425: the fence is at 7.55
        (InterquartileFence(15.0), (3.0, 8, 1)),  # and here at 2.825
        (InterquartileFence(0.0), (8.1, 6, 2)),
        (Supported(1, 0.0), (3.0, 1, 1)),
        (Supported(2, 0.5), (8.0, 6, 0)),  # the six within 8.0 .. 8.5
        (Supported(2, 5.0), (3.0, 2, 1)),  # 8.0 is exactly as far behind as it may be
        (Cluster(0.15, 2), (8.0, 7, 0)),
        (Cluster(0.15, 1), (3.0, 1, 1)),
        (Cluster(5.0, 2), (3.0, 8, 1)),
    ],
    ids=str,
)
def test_estimators(ttc: Any, estimator: Any, expected: tuple[float, int, int]) -> None:
    found = ttc.robust_min_x(STRAY, estimator=estimator)
    assert (found.x, found.support, found.index) == (pytest.approx(expected[0], rel=1e-12), *expected[1:])
    assert (found.nearest_x, found.candidates, found.detection) == (3.0, 8, Detection.FOUND)


@pytest.mark.parametrize("q", [0.0, 0.01, 0.25, 1 / 3, 0.5, 0.75, 0.999, 1.0])
def test_quantiles_follow_numpys_linear_rule(ttc: Any, q: float) -> None:
    x = np.random.default_rng(3).uniform(2.0, 30.0, 57)
    assert ttc.robust_min_x(ahead(*x), estimator=Quantile(q)).x == pytest.approx(np.quantile(x, q), rel=1e-15)


def test_a_cluster_is_linked_in_three_dimensions(ttc: Any) -> None:
    """Two points 0.1 m apart in x, but 1 m apart in y, or in z: alone. A chain of short links: together."""
    for other in ((5.1, 1.0, 0.5), (5.1, 0.0, 1.5)):
        found = ttc.robust_min_x(at((5.0, 0.0, 0.5), other), estimator=Cluster(0.2, 2))
        assert found.detection is Detection.TOO_FEW
    chain = at((5.0, -1.0, 0.5), *[(5.5 + 0.01 * i, -1.0 + 0.2 * i, 0.5 + 0.1 * i) for i in range(8)])
    assert ttc.robust_min_x(chain, estimator=Cluster(0.23, 8)).x == 5.5
    assert ttc.robust_min_x(chain, estimator=Cluster(0.22, 2)).detection is Detection.TOO_FEW


def test_a_link_as_long_as_the_tolerance_holds(ttc: Any) -> None:
    """3-4-5, in whichever direction."""
    for far in ((5.0, 0.75, 1.0), (5.75, 0.0, 1.0), (5.75, 1.0, 0.0), (5.75, -1.0, 0.0)):
        pair = at((5.0, 0.0, 0.0), far)
        assert ttc.robust_min_x(pair, estimator=Cluster(1.25, 2)).x == 5.0
        assert ttc.robust_min_x(pair, estimator=Cluster(1.249, 2)).detection is Detection.TOO_FEW


def test_of_two_clusters_the_nearer_that_is_large_enough(ttc: Any) -> None:
    points = ahead(4.0, 4.1, 6.0, 6.1, 6.2, 9.0, 9.1, 9.2, 9.3)
    assert [ttc.robust_min_x(points, estimator=Cluster(0.15, least)).x for least in (1, 2, 3, 4)] == [
        4.0,
        4.0,
        6.0,
        9.0,
    ]


# --- which point ---------------------------------------------------------------------------------------------------


@both_dtypes
@pytest.mark.parametrize("count", [1, 15, 17, 33, 3000])
def test_ties_go_to_the_lowest_index(ttc: Any, dtype: Any, count: int) -> None:
    points = np.tile(ahead(7.0, dtype=dtype), (count, 1))
    assert ttc.robust_min_x(points, estimator=Minimum()).index == 0
    last = min(count, 12)
    assert ttc.robust_min_x(points, estimator=KthSmallest(last)).index == last - 1
    assert ttc.robust_min_x(points, estimator=Supported(last, 0.0)).index == 0
    assert ttc.robust_min_x(points, estimator=InterquartileFence(1.5)).index == 0


@pytest.mark.parametrize("place", [0, 1, 16, 99, 2049, 2999])
def test_the_index_is_that_of_the_point(ttc: Any, place: int) -> None:
    points = ahead(*[20.0] * 3000)
    points[place, 0] = 5.0
    for estimator in (Minimum(), Supported(1, 0.0), Cluster(0.1, 1)):
        assert ttc.robust_min_x(points, estimator=estimator).index == place
    backwards = points[::-1]
    assert ttc.robust_min_x(backwards, estimator=Minimum()).index == 2999 - place
    assert ttc.robust_min_x(points.reshape(30, 100, 3), estimator=Minimum()).index == place


def test_points_that_do_not_count_are_counted_by_the_index(ttc: Any) -> None:
    points = np.concatenate([BLIND, EMPTY, ahead(6.0, 5.0)])
    assert ttc.robust_min_x(points, estimator=Minimum()).index == 4


def test_where_it_is_no_single_point(ttc: Any) -> None:
    for estimator in (Quantile(0.5), MeanOfLowest(2)):
        assert ttc.robust_min_x(ahead(4.0, 5.0, 6.0), estimator=estimator).index == -1


# --- curved paths --------------------------------------------------------------------------------------------------


@both_dtypes
@pytest.mark.parametrize("side", [1, -1], ids=["left", "right"])
def test_a_car_ahead_is_beside_the_curve(ttc: Any, dtype: Any, side: int) -> None:
    """Radius 20 m. A car at (15, 0) is 25 m from the centre, 5 m off the path; one at (12, +-4) is on it."""
    curve = Gate(curvature=side / 20.0)
    points = at((15.0, 0.0, 0.5), (12.0, 4.0 * side, 0.5), dtype=dtype)
    found = ttc.robust_min_x(points, gate=curve, estimator=Minimum())
    assert (found.x, found.index) == (pytest.approx(20.0 * math.atan2(12.0, 16.0), rel=1e-6), 1)
    assert found.candidates == 1
    straight = ttc.robust_min_x(points, estimator=Minimum())
    assert (straight.x, straight.candidates) == (15.0, 1)
    other_way = ttc.robust_min_x(points, gate=Gate(curvature=-side / 20.0), estimator=Minimum())
    assert other_way.detection is Detection.CLEAR


@pytest.mark.parametrize("offset", [-2.5, -1.9, 0.0, 1.9, 2.5])
@pytest.mark.parametrize("turned", [0.1, 0.5, 1.5, 3.0])
@pytest.mark.parametrize("curvature", [0.1, -0.05])
def test_distance_is_along_the_path_and_the_lane_beside_it(
    ttc: Any, offset: float, turned: float, curvature: float
) -> None:
    """``offset`` to the left of the path, ``turned`` rad round its centre."""
    radius = 1.0 / curvature
    angle = math.copysign(turned, curvature)
    point = ((radius - offset) * math.sin(angle), radius - (radius - offset) * math.cos(angle), 0.5)
    found = ttc.robust_min_x(at(point), gate=Gate(curvature=curvature), estimator=Minimum())
    if abs(offset) < 2.0:
        assert found.x == pytest.approx(turned * abs(radius), rel=1e-9)
    else:
        assert found.detection is Detection.CLEAR


def test_behind_is_behind_on_a_curve_too(ttc: Any) -> None:
    for curvature in (0.05, -0.05):
        found = ttc.robust_min_x(at((-3.0, 0.0, 0.5)), gate=Gate(curvature=curvature), estimator=Minimum())
        assert found.detection is Detection.CLEAR


CURVATURES = [sign * 10.0**-exponent for exponent in (2, 4, 6, 9, 12, 15, 18, 100, 300) for sign in (1, -1)]


@pytest.mark.parametrize("curvature", CURVATURES)
def test_a_straight_path_is_the_limit_of_curved_ones(ttc: Any, curvature: float) -> None:
    """To first order the distance along is x (1 + k y), and the offset y - k x^2 / 2."""
    points = at((12.0, 1.0, 0.5), (10.0, 1.2, 0.5))
    found = ttc.robust_min_x(points, gate=Gate(curvature=curvature), estimator=Minimum())
    assert (found.candidates, found.index) == (2, 1)
    assert found.x == pytest.approx(10.0 + 12.0 * curvature, abs=400.0 * curvature**2 + 1e-13)

    edge = 2.0 + 50.0 * curvature
    slack = 600.0 * curvature**2 + 1e-12
    for y, inside in ((edge - slack, 1), (edge + slack, 0)):
        found = ttc.robust_min_x(at((10.0, y, 0.5)), gate=Gate(curvature=curvature), estimator=Minimum())
        assert found.candidates == inside


@pytest.mark.parametrize("curvature", [5e-324, -5e-324, 2.3e-308, 0.0, -0.0])
def test_the_least_curvature_is_straight(ttc: Any, curvature: float) -> None:
    """A yaw rate of next to nothing."""
    found = ttc.robust_min_x(ahead(10.4), gate=Gate(curvature=curvature), estimator=Minimum())
    assert found.x == pytest.approx(10.4, rel=1e-12)


def test_a_box_along_the_path(ttc: Any) -> None:
    """The gate's x is along the path: 12 m round a curve of radius 20 m is less than 13 m, though x is only 11.3."""
    point = at((20.0 * math.sin(0.6), 20.0 * (1.0 - math.cos(0.6)), 0.5))
    for bounds, found in (((11.9, 12.1), 1), ((12.1, 13.0), 0), ((11.0, 11.9), 0)):
        assert ttc.robust_min_x(point, gate=Gate(x=bounds, curvature=0.05), estimator=Minimum()).candidates == found


# --- two distances -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("previous", "current", "expected"),
    [
        (10.0, 9.5, 1.9),
        (9.5, 9.5, INF),
        (9.5, 10.0, INF),
        (0.1, 0.0, 0.0),
        (0.1, -0.1, 0.0),
        (-0.1, -0.2, 0.0),
        (-0.2, -0.1, INF),
        (0.0, 0.0, INF),
        (-1.0, 5.0, INF),
    ],
)
def test_two_distances(ttc: Any, previous: float, current: float, expected: float) -> None:
    """TTC = d1 dt / (d0 - d1); in contact 0 while closing, infinite while opening."""
    found = ttc.ttc_from_distances(previous, current, 0.1)
    assert found == pytest.approx(expected)
    assert type(found) is float


def test_a_ttc_is_never_negative_nor_nan(ttc: Any) -> None:
    values = [0.0, -0.0, 5e-324, 1e-9, 0.1, 3.0, 1e9, 1e300, -1e-9, -3.0, -1e300]
    for previous in values:
        for current in values:
            for dt in (1e-9, 0.1, 1e9):
                assert ttc.ttc_from_distances(previous, current, dt) >= 0.0


# --- two clouds ----------------------------------------------------------------------------------------------------

THIRD = KthSmallest(3)
FAR, NEAR = ahead(10.0, 10.0, 10.0), ahead(9.0, 9.0, 9.0)
TWO = ahead(9.0, 9.5)
TOUCHING = ahead(1.5, 1.5, 1.5)


@pytest.mark.parametrize(
    ("previous", "current", "status", "expected", "distance", "closing_speed"),
    [
        (FAR, NEAR, Status.CLOSING, 0.7, 7.0, 10.0),
        (FAR, FAR, Status.NOT_CLOSING, INF, 8.0, 0.0),
        (NEAR, FAR, Status.NOT_CLOSING, INF, 8.0, -10.0),
        (FAR, EMPTY, Status.CLEAR, INF, INF, NAN),
        (EMPTY, EMPTY, Status.CLEAR, INF, INF, NAN),
        (BLIND, EMPTY, Status.CLEAR, INF, INF, NAN),
        (FAR, BLIND, Status.NO_DATA, INF, NAN, NAN),
        (BLIND, BLIND, Status.NO_DATA, INF, NAN, NAN),
        (TWO, BLIND, Status.NO_DATA, INF, NAN, NAN),
        (EMPTY, NEAR, Status.WARMING_UP, INF, 7.0, NAN),
        (BLIND, NEAR, Status.WARMING_UP, INF, 7.0, NAN),
        (EMPTY, TWO, Status.WARMING_UP, INF, 7.0, NAN),
        (EMPTY, TOUCHING, Status.CONTACT, INF, -0.5, NAN),
        (BLIND, TOUCHING, Status.CONTACT, INF, -0.5, NAN),
        (EMPTY, ahead(2.0), Status.CONTACT, INF, 0.0, NAN),
        (FAR, TWO, Status.TOO_FEW, 0.7, 7.0, 10.0),
        (TWO, FAR, Status.TOO_FEW, INF, 8.0, -10.0),
        (TWO, ahead(8.0), Status.TOO_FEW, 0.6, 6.0, 10.0),
        (TWO, EMPTY, Status.CLEAR, INF, INF, NAN),
        (ahead(2.5, 2.5, 2.5), TOUCHING, Status.CONTACT, 0.0, -0.5, 10.0),
        (ahead(1.25, 1.25, 1.25), TOUCHING, Status.CONTACT, INF, -0.5, -2.5),
        (FAR, ahead(2.0, 2.0, 2.0), Status.CONTACT, 0.0, 0.0, 80.0),
        (FAR, ahead(1.5), Status.CONTACT, 0.0, -0.5, 85.0),
    ],
)
def test_statuses_of_two_clouds(
    ttc: Any, previous: Any, current: Any, status: Status, expected: float, distance: float, closing_speed: float
) -> None:
    """The bumper is 2 m ahead of the sensor; three points are needed for an estimate."""
    found = ttc.ttc_from_clouds(previous, current, 0.1, estimator=THIRD, front_offset=2.0)
    assert found.status is status
    numbers = [found.ttc, found.distance, found.closing_speed]
    assert numbers == pytest.approx([expected, distance, closing_speed], nan_ok=True)


def test_too_few_in_one_cloud_takes_both_at_their_nearest(ttc: Any) -> None:
    """An estimate and a plain minimum do not make a difference: 8 to 7.5 m, not 10 to 7.5 m."""
    found = ttc.ttc_from_clouds(ahead(8.0, 10.0, 10.0), ahead(7.5, 9.0), 0.1, estimator=THIRD)
    assert (found.status, found.ttc) == (Status.TOO_FEW, pytest.approx(1.5))
    assert (found.previous.x, found.previous.detection) == (10.0, Detection.FOUND)
    assert (found.current.nearest_x, found.current.detection) == (7.5, Detection.TOO_FEW)
    assert math.isnan(found.current.x)


def test_an_empty_cloud_before_is_no_imminent_collision(ttc: Any) -> None:
    """A course's code takes a distance of 1e9 m for it, and brakes: 9 m at nearly 1e10 m/s."""
    assert ttc.ttc_from_distances(1e9, 9.0, 0.1) < 1e-8
    assert ttc.ttc_from_clouds(np.empty((0, 3)), NEAR, 0.1, estimator=THIRD).ttc == INF


def test_one_stray_point_does_not_decide(ttc: Any) -> None:
    """14 cm in front of a car that closes at 0.5 m/s from 7.5 m: 3.9 s by the minimum, 14.9 s by the third."""
    before, now = ahead(7.5, 7.5, 7.5, 7.5), ahead(7.45, 7.45, 7.31, 7.45)
    assert ttc.ttc_from_clouds(before, now, 0.1, estimator=Minimum()).ttc == pytest.approx(7.31 * 0.1 / 0.19)
    assert ttc.ttc_from_clouds(before, now, 0.1, estimator=THIRD).ttc == pytest.approx(14.9)


@both_dtypes
def test_the_offset_of_the_bumper(ttc: Any, dtype: Any) -> None:
    """It shortens the distance and leaves the speed: (9 - 2) m at 10 m/s."""
    clouds = FAR.astype(dtype), NEAR.astype(dtype)
    for offset, expected in ((0.0, 0.9), (2.0, 0.7), (8.5, 0.05), (9.0, 0.0), (-1.0, 1.0)):
        found = ttc.ttc_from_clouds(*clouds, 0.1, estimator=THIRD, front_offset=offset)
        assert (found.ttc, found.distance) == (pytest.approx(expected), pytest.approx(9.0 - offset))
        assert found.closing_speed == pytest.approx(10.0)
        assert found.current.x == 9.0, "distances from the sensor"


def test_time_comes_from_stamps(ttc: Any) -> None:
    for dt in (0.05, 0.1, 1.0):
        found = ttc.ttc_from_clouds(FAR, NEAR, dt, estimator=THIRD)
        assert (found.ttc, found.closing_speed) == (pytest.approx(9.0 * dt), pytest.approx(1.0 / dt))


def test_the_gate_holds_for_both_clouds(ttc: Any) -> None:
    """Brake lights in the next lane do not matter before, and not after."""
    beside = at((5.0, 3.0, 0.5))
    before, now = np.concatenate([FAR, beside]), np.concatenate([NEAR, beside - [1, 0, 0]])
    assert ttc.ttc_from_clouds(before, now, 0.1, estimator=Minimum()).distance == 9.0
    wide = Gate(y=(-4.0, 4.0))
    assert ttc.ttc_from_clouds(before, now, 0.1, gate=wide, estimator=Minimum()).distance == 4.0


def test_a_curve_may_be_followed_from_cloud_to_cloud(ttc: Any) -> None:
    """Along a path of radius 20 m, from 12 m to 11 m."""
    before, now = (at((20.0 * math.sin(s / 20), 20.0 * (1 - math.cos(s / 20)), 0.5)) for s in (12.0, 11.0))
    found = ttc.ttc_from_clouds(before, now, 0.1, gate=Gate(curvature=0.05), estimator=Minimum())
    assert (found.ttc, found.closing_speed) == (pytest.approx(1.1), pytest.approx(10.0))


# --- objects -------------------------------------------------------------------------------------------------------


def test_results_are_of_plain_types(ttc: Any) -> None:
    found = ttc.ttc_from_clouds(FAR, NEAR, 0.1, estimator=THIRD)
    assert {type(found.ttc), type(found.distance), type(found.closing_speed), type(found.current.x)} == {float}
    assert {type(found.current.index), type(found.current.support), type(found.current.candidates)} == {int}
    assert type(found.status) is Status
    assert type(found.current.detection) is Detection


@pytest.mark.parametrize(
    "settings",
    [
        Gate(x=(1.0, 9.0), z=(-1.0, 2.0), intensity=(0.1, INF), axes=("y", "-x", "z"), curvature=0.02),
        Gate(road=Road(0.01, -0.02, -1.7), height=(0.2, 2.0)),
        Gate(),
        Minimum(),
        KthSmallest(7),
        Quantile(0.25),
        MeanOfLowest(3),
        InterquartileFence(1.5),
        Supported(3, 0.2),
        Cluster(0.15, 10),
    ],
    ids=repr,
)
def test_settings_are_values(settings: Any) -> None:
    """Equal when alike, unchanged by pickling, and shown as they are written."""
    assert pickle.loads(pickle.dumps(settings)) == settings
    names = {name: getattr(ttc_fast, name) for name in ttc_fast.__all__}
    assert eval(repr(settings), {**names, "inf": INF}) == settings
    assert settings != Gate(x=(3.0, 4.0))
    with pytest.raises(AttributeError):
        settings.x = 3
