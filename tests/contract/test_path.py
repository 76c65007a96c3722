"""What `SweptPath` and `ScanSweptPath` promise, by examples that can be worked out by hand."""

from __future__ import annotations

import math
import pickle
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import ttc_fast
from tests.support import path_oracle
from tests.support.common import CAR, every_module
from ttc_fast import Status

if TYPE_CHECKING:
    from numpy.typing import NDArray

X_REAR, X_FRONT, Y_RIGHT, Y_LEFT = CAR


def one(x: float, y: float) -> NDArray[np.float64]:
    return np.array([[x, y]])


def corridor() -> Any:
    """A scanner on a car 0.3 m wide, and what it sees of walls at 1 m on either side."""
    scan: dict[str, Any] = {
        "angle_min": -math.pi / 2,
        "angle_increment": math.pi / 360,
        "beams": 361,
        "outline": CAR,
        "mount": (0.3, 0, 0),
    }
    angles = ttc_fast.ScanTTC(**scan).angles
    with np.errstate(divide="ignore"):
        return scan, np.minimum(1.0 / np.abs(np.sin(angles)), 30.0)


@every_module
def test_a_corridor_that_one_fits_in(module: Any) -> None:
    settings, ranges = corridor()
    scan = module.ScanTTC(**settings)
    nearest = scan.nearest(ranges, 5.0)
    assert nearest.ttc == pytest.approx(0.36, abs=0.005)
    assert abs(math.degrees(nearest.angle)) == pytest.approx(49, abs=0.5)
    path = module.ScanSweptPath(scan)
    assert path.min(ranges, 5.0) == math.inf
    assert path.nearest(ranges, 5.0).status is Status.NOT_CLOSING


@every_module
def test_a_point_off_the_axis(module: Any) -> None:
    """Beside the car's path, or hit when the outline gets there and not when its range is used up."""
    point = one(1.5, 0.85)
    assert module.SweptPath(CAR).min(point, 5.0) == math.inf
    wide = module.SweptPath((-0.1, 0.4, -0.9, 0.9))
    assert wide.min(point, 5.0) == pytest.approx((1.5 - 0.4) / 5.0, rel=1e-15)


@every_module
@pytest.mark.parametrize(
    ("point", "motion", "ttc"),
    [
        ((2.4, 0.0), (2.0,), 1.0),
        ((-2.1, 0.0), (2.0,), math.inf),
        ((-2.1, 0.0), (-2.0,), 1.0),
        ((0.0, 1.15), (0.0, 0.0, 1.0), 1.0),
        ((0.0, -1.15), (0.0, 0.0, -0.5), 2.0),
        ((0.0, 1.15), (0.0, 0.0, -1.0), math.inf),
        ((2.4, 2.15), (2.0, 0.0, 2.0), 1.0),
        ((2.4, 0.0), (0.0,), math.inf),
        ((10.4, 0.0), (2.0,), 5.0),
        ((10.41, 0.0), (2.0,), math.inf),
    ],
)
def test_driving_straight(module: Any, point: tuple[float, float], motion: tuple[float, ...], ttc: float) -> None:
    """Ahead, behind, sideways, across, standing, and the end of the horizon, which belongs to it."""
    assert module.SweptPath(CAR).min(one(*point), *motion) == pytest.approx(ttc, rel=1e-15)


@every_module
def test_rotation_in_place(module: Any) -> None:
    """A point as far out as the front corners is touched by the one that comes round first."""
    radius, corner = math.hypot(X_FRONT, Y_LEFT), math.atan2(Y_LEFT, X_FRONT)
    point = one(radius * math.cos(corner + 1.0), radius * math.sin(corner + 1.0))
    path = module.SweptPath(CAR)
    assert path.min(point, 0.0, 0.5) == pytest.approx(2.0, rel=1e-9)
    assert path.min(point, 0.0, 0.1) == math.inf  # ten seconds
    assert path.min(point, 0.0, -2.0) == pytest.approx((2 * math.pi - 1.0 - 2 * corner) / 2.0, rel=1e-9)
    assert path.min(1.001 * point, 0.0, 0.5) == math.inf
    assert path.min(0.999 * point, 0.0, 0.5) == pytest.approx(2.0, rel=0.01)


@every_module
def test_half_a_turn_and_more(module: Any) -> None:
    """Turning about its origin, its outline far to the left: tau is infinite after half a turn, then negative."""
    path = module.SweptPath((-1.0, 1.0, 4.0, 5.0), horizon=20.0)
    assert path.min(one(0.0, -4.0), 0.0, 1.0) == pytest.approx(math.pi, abs=1e-4)  # touched only
    assert path.min(one(0.0, -4.0 + 1e-6), 0.0, 1.0) == math.inf
    for angle in (2.0, 3.0, 3.3, 5.0, 5.7):
        for yaw_rate in (1.0, -1.0):
            # So far from where the end of the outline passes that comes first.
            start = math.pi / 2 + math.copysign(angle + math.atan2(1.0, 4.5), yaw_rate)
            point = one(math.hypot(1.0, 4.5) * math.cos(start), math.hypot(1.0, 4.5) * math.sin(start))
            assert path.min(point, 0.0, yaw_rate) == pytest.approx(angle, rel=1e-12)


@every_module
def test_smooth_as_the_yaw_rate_goes_to_zero(module: Any) -> None:
    path = module.SweptPath(CAR)
    for point, motion in (((4.4, 0.1), (2.0, 0.0)), ((-3.1, -0.1), (-1.0, 0.0)), ((1.4, 1.0), (1.0, 1.0))):
        straight = path.min(one(*point), motion[0], 0.0, motion[1])
        assert straight < 5.0
        for yaw_rate in 10.0 ** np.arange(-320.0, -5.0):
            for signed in (yaw_rate, -yaw_rate):
                ttc = path.min(one(*point), motion[0], signed, motion[1])
                assert ttc == pytest.approx(straight, rel=1e-15 + 20 * yaw_rate), signed


@every_module
def test_continuous_in_the_yaw_rate(module: Any) -> None:
    """From 1e-16 to 10: as long as the point is hit at all, a little more yaw rate is a little more or less time."""
    rates = 10.0 ** np.linspace(-16, 1, 4001)
    points = np.broadcast_to([1.0, 0.0], (len(rates), 1, 2)).copy()
    ttc = module.SweptPath(CAR).min(points, 2.0, rates)
    hit = np.flatnonzero(np.isinf(ttc))[0]
    assert rates[hit] > 0.5
    assert (np.abs(np.diff(ttc[:hit])) < 0.02).all()


@every_module
@pytest.mark.parametrize("y", [Y_LEFT, Y_RIGHT])
def test_touching_is_entering(module: Any, y: float) -> None:
    """Straight at a corner, along a side; a micrometre beside it is a miss."""
    path = module.SweptPath(CAR)
    assert path.min(one(2.4, y), 2.0) == 1.0
    assert path.min(one(2.4, y + math.copysign(1e-6, y)), 2.0) == math.inf


@every_module
@pytest.mark.parametrize("yaw_rate", [0.7, 0.01, -3.0])
def test_a_circle_that_touches_an_edge(module: Any, yaw_rate: float) -> None:
    """About a centre at its left, a point on the circle through the middle of the left edge touches it there."""
    path = module.SweptPath((-0.25, 0.25, -0.25, 0.25), horizon=2.5 / abs(yaw_rate))
    centre, radius = 1.0, 0.75
    for angle in np.linspace(0.5, 2.4, 50):
        behind = math.copysign(angle, yaw_rate)
        point = one(radius * math.sin(behind), centre - radius * math.cos(behind))
        assert path.min(point, centre * yaw_rate, yaw_rate) == pytest.approx(angle / abs(yaw_rate), rel=1e-4)
        inner = one((radius - 1e-6) * math.sin(behind), centre - (radius - 1e-6) * math.cos(behind))
        assert path.min(inner, centre * yaw_rate, yaw_rate) == math.inf


@every_module
@pytest.mark.parametrize(
    ("point", "motion", "ttc", "clearance", "closing_speed"),
    [
        ((0.39, 0.0), (2.0,), 0.0, -0.01, 2.0),
        ((0.39, 0.0), (-2.0,), math.inf, -0.01, -2.0),
        ((0.39, 0.0), (0.0,), math.inf, -0.01, 0.0),
        ((-0.1, 0.0), (2.0,), math.inf, 0.0, -2.0),
        ((-0.1, 0.0), (-2.0,), 0.0, 0.0, 2.0),
        ((0.2, 0.15), (2.0,), 0.0, 0.0, 0.0),
        ((0.1, 0.15), (2.0,), math.inf, 0.0, 0.0),
        ((0.3, 0.14), (2.0,), 0.0, -0.01, 0.0),
        ((0.3, 0.14), (-2.0,), math.inf, -0.01, 0.0),
        ((0.0, -0.14), (2.0,), math.inf, -0.01, 0.0),
        ((0.0, -0.14), (-2.0,), 0.0, -0.01, 0.0),
        ((0.3, 0.0), (2.0,), 0.0, -0.1, 2.0),
        ((0.3, 0.0), (0.0, 1.0), 0.0, -0.1, 0.0),
        ((0.3, 0.05), (0.0, 1.0), 0.0, -0.1, 0.3),
        ((0.3, 0.05), (0.0, -1.0), math.inf, -0.1, -0.3),
        ((0.2, 0.14), (2.0, 0.0, 0.5), 0.0, -0.01, 0.5),
        ((0.4, 0.15), (2.0,), 0.0, 0.0, 2.0),
        ((0.4, 0.15), (-2.0,), math.inf, 0.0, 0.0),
    ],
)
def test_contact(
    module: Any,
    point: tuple[float, float],
    motion: tuple[float, ...],
    ttc: float,
    clearance: float,
    closing_speed: float,
) -> None:
    """0, unless it stands or leaves by the nearer end of its chord; whatever edge is nearest to it."""
    nearest = module.SweptPath(CAR).nearest(one(*point), *motion)
    assert (nearest.ttc, nearest.status, nearest.index) == (ttc, Status.CONTACT, 0)
    assert nearest.clearance == pytest.approx(clearance, abs=1e-15)
    assert nearest.closing_speed == pytest.approx(closing_speed, abs=1e-15)
    assert nearest.counts.contact == 1


@every_module
def test_contact_stands_beside_what_else_decides(module: Any) -> None:
    nearest = module.SweptPath(CAR).nearest(np.array([[-0.1, 0.0], [2.4, 0.0], [1.4, 0.1]]), 2.0)
    assert (nearest.status, nearest.index) == (Status.CONTACT, 2)
    assert nearest.ttc == pytest.approx(0.5, rel=1e-15)


@every_module
def test_where_the_outline_is_beside_its_origin(module: Any) -> None:
    """A point at the instantaneous centre never moves."""
    path = module.SweptPath((1.0, 2.0, -0.5, 0.5), horizon=100.0)
    assert path.min(one(0.0, 2.0), 2.0, 1.0) == math.inf
    assert path.min(one(0.0, 2.0 - math.hypot(1.5, 2.0)), 2.0, 1.0) < 2 * math.pi


@every_module
def test_what_counts_as_a_point(module: Any) -> None:
    points = np.array([[0, 0], [np.nan, 1], [1, np.inf], [-np.inf, 0], [2.4, 0], [0, 3]])
    path = module.SweptPath(CAR)
    nearest = path.nearest(points, 2.0)
    assert (nearest.counts.valid, nearest.counts.invalid, nearest.counts.contact) == (2, 4, 0)
    assert nearest.index == 4
    with_z = np.array([[2.4, 0, np.nan], [4.4, 0, 0], [0, 0, 0], [0, 0, 1.0]])
    nearest = path.nearest(with_z, 2.0)
    assert (nearest.counts.valid, nearest.counts.invalid, nearest.counts.contact) == (2, 2, 1)
    assert nearest.index == 1
    status = np.empty(6, np.uint8)
    path.per_point(points, 2.0, status_out=status)
    assert status.tolist() == [Status.INVALID] * 4 + [Status.CLOSING, Status.NOT_CLOSING]


@every_module
def test_nothing_seen_is_not_nothing_there(module: Any) -> None:
    blind = [np.zeros((0, 2)), np.zeros((3, 2)), np.full((3, 3), np.nan)]
    for points in blind:
        with pytest.raises(ttc_fast.NoDataError):
            module.SweptPath(CAR).min(points, 2.0)
        assert module.SweptPath(CAR, no_data=0.25).min(points, 2.0) == 0.25
        nearest = module.SweptPath(CAR).nearest(points, 2.0)
        assert (nearest.status, nearest.ttc, nearest.index) == (Status.NO_DATA, math.inf, -1)
        assert math.isnan(nearest.x)
        assert math.isnan(nearest.clearance)
    assert module.SweptPath(CAR).nearest(one(5.0, 5.0), 2.0).status is Status.NOT_CLOSING
    with pytest.raises(ttc_fast.NoDataError, match="1"):
        module.SweptPath(CAR).min(np.array([[[1.0, 1.0]], [[0.0, 0.0]]]), 2.0)


@every_module
def test_a_scanners_settings_are_its_swept_paths(module: Any) -> None:
    """Mask, limits, minimum, no_data and the meaning of readings."""
    settings = {"angle_min": -0.02, "angle_increment": 0.01, "beams": 5, "outline": CAR, "range_min": 0.05}
    ranges = np.array([9.0, 1.4, 2.4, np.inf, 0.01])

    def path(**more: Any) -> Any:
        return module.ScanSweptPath(module.ScanTTC(**settings, **more))

    assert path().nearest(ranges, 2.0).beam == 1
    assert path(mask=[False, True, False, False, False]).nearest(ranges, 2.0).beam == 2
    assert path(minimum=ttc_fast.KthSmallest(2)).min(ranges, 2.0) == 1.0
    assert path(minimum=ttc_fast.KthSmallest(4)).nearest(ranges, 2.0).status is Status.TOO_FEW
    assert path(limits=(0.0, 1.0)).nearest(ranges, 2.0).status is Status.CLEAR
    too_close = np.array([9.0, 9.0, -np.inf, 9.0, 9.0])
    assert path().nearest(too_close, 2.0).status is Status.CONTACT
    assert path(too_close="ignore").nearest(too_close, 2.0).status is Status.CLOSING
    assert path(no_data=0.5).min(np.full(5, np.nan), 2.0) == 0.5
    with pytest.raises(ttc_fast.NoDataError):
        path().min(np.full(5, np.nan), 2.0)
    status = np.empty(5, np.uint8)
    path(mask=[True, False, False, False, False]).per_beam(ranges, 2.0, status_out=status)
    assert status.tolist() == [Status.NO_DATA, Status.CLOSING, Status.CLOSING, Status.CLEAR, Status.INVALID]


@every_module
def test_what_a_scanner_sees_is_where_its_points_are(module: Any) -> None:
    """Beams of a mounted scanner, and the same points worked out by hand, are hit at the same times."""
    mount = (0.27, 0.05, 0.3)
    scan = module.ScanTTC(-2.0, 0.01, 400, outline=CAR, mount=mount)
    ranges = np.random.default_rng(0).uniform(0.3, 6.0, 400)
    angles = scan.angles + mount[2]
    points = np.column_stack([mount[0] + ranges * np.cos(angles), mount[1] + ranges * np.sin(angles)])
    for motion in ((3.0, 0.0, 0.0), (3.0, 1.0, 0.1), (-1.0, -2.0, 0.0), (0.3, 1.5, 0.0)):
        beams = module.ScanSweptPath(scan).per_beam(ranges, *motion)
        np.testing.assert_allclose(beams, module.SweptPath(CAR).per_point(points, *motion), rtol=1e-9)
        assert np.isfinite(beams).any(), motion


def test_pickled_paths() -> None:
    scan = ttc_fast.ScanTTC(-0.5, 0.5, 3, outline=CAR, no_data=7.0)
    path = pickle.loads(pickle.dumps(ttc_fast.ScanSweptPath(scan, horizon=2.0)))
    assert path.horizon == 2.0
    assert path.min(np.full(3, np.nan), 1.0) == 7.0
    assert path.min(np.array([1.0, 2.4, 1.0]), 2.0) == 1.0


@pytest.mark.parametrize("seed", range(len(path_oracle.OUTLINES)))
def test_a_fine_stepped_simulation_says_the_same(seed: int) -> None:
    """``python -m tests.support.path_oracle`` does this for a million worlds."""
    rng, outline = np.random.default_rng(seed), path_oracle.OUTLINES[seed]
    worlds = path_oracle.random_worlds(rng, 12_000, outline)
    assert path_oracle.check(worlds, outline, 5.0, 500, rng) > 4000
