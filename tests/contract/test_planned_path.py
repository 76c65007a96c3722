"""What `path=` promises: examples that can be worked out by hand, and a drive in fine steps."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from tests.support.common import CAR, every_module
from tests.support.planned_paths import driven_until_touched
from ttc_fast import Status

STRAIGHT = [[0.0, 0.0], [4.0, 0.0]]
"""A path straight ahead."""


def arc(radius: float, angle: float, count: int, begin: float = 0.0) -> Any:
    """Points of a circle to the left that begins at the origin."""
    angles = np.linspace(begin, angle, count)
    return np.column_stack([radius * np.sin(angles), radius * (1.0 - np.cos(angles))])


def one(x: float, y: float) -> Any:
    return np.array([[x, y]])


@every_module
def test_straight_ahead_and_beyond_the_end(module: Any) -> None:
    path = module.SweptPath(CAR)
    for x in (2.4, 4.4, 8.4):
        assert path.min(one(x, 0.1), 4.0, path=STRAIGHT) == pytest.approx((x - 0.4) / 4.0, rel=1e-12)
    assert path.min(one(24.0, 0.1), 4.0, path=STRAIGHT) == math.inf  # beyond the horizon
    assert path.min(one(2.4, 0.16), 4.0, path=STRAIGHT) == math.inf
    assert path.min(one(2.4, 0.1), 0.0, path=STRAIGHT) == math.inf


@every_module
@pytest.mark.parametrize("count", [5, 15, 50])
def test_points_of_a_circle_are_that_circle(module: Any, count: int) -> None:
    """The twist from point to point is that of the circle, and the way is that along the chords."""
    radius, speed = 3.0, 2.0
    points = arc(radius, 1.2, count)
    chords = 2.0 * radius * math.sin(0.6 / (count - 1)) * (count - 1) / (1.2 * radius)
    path = module.SweptPath(CAR)
    seen = [one(2.2, 0.8), one(2.5, 1.3), one(1.5, 0.4), one(1.5, 0.8)]
    for point in seen:
        turning = path.min(point, speed, yaw_rate=speed / radius)
        planned = path.min(point, speed, path=points)
        assert planned == (math.inf if turning == math.inf else pytest.approx(turning * chords, rel=1e-9))
    assert [path.min(point, speed, path=points) < math.inf for point in seen] == [True, True, True, False]


@every_module
def test_in_reverse(module: Any) -> None:
    path = module.SweptPath(CAR)
    back = -np.array(STRAIGHT)
    assert path.min(one(-2.1, 0.1), -2.0, path=back) == pytest.approx(1.0, rel=1e-12)
    assert path.min(one(2.1, 0.1), -2.0, path=back) == math.inf
    with pytest.raises(ValueError, match="path leads backwards"):
        path.min(one(2.1, 0.1), 2.0, path=back)


@every_module
def test_contact_is_that_of_the_way_it_begins(module: Any) -> None:
    path = module.SweptPath(CAR)
    front, rear = one(0.35, 0.0), one(-0.05, 0.0)
    nearest = path.nearest(front, 2.0, path=STRAIGHT)
    assert (nearest.ttc, nearest.status) == (0.0, Status.CONTACT)
    assert path.min(rear, 2.0, path=STRAIGHT) == math.inf
    assert path.nearest(rear, 2.0, path=STRAIGHT).status is Status.CONTACT


@every_module
def test_a_line_beside_the_vehicle_is_joined(module: Any) -> None:
    """What the first point is off fades over two lengths of the vehicle, which are 1 m."""
    beside = [[x, 0.3] for x in np.arange(0.0, 4.0, 0.1)]
    path = module.SweptPath(CAR)
    assert path.min(one(3.0, 0.4), 1.0, path=beside) < math.inf
    assert path.min(one(3.0, 0.1), 1.0, path=beside) == math.inf
    assert path.min(one(0.5, 0.1), 1.0, path=beside) == pytest.approx(0.1, abs=0.02)
    assert path.min(one(0.5, 0.4), 1.0, path=beside) == math.inf


@every_module
def test_a_path_that_leads_on_from_before_the_vehicle(module: Any) -> None:
    path = module.SweptPath(CAR)
    ahead = [[0.2, 0.0], [2.0, 0.0]]
    assert path.min(one(2.4, 0.1), 2.0, path=ahead) == pytest.approx(1.0, rel=1e-9)


@every_module
def test_points_that_come_twice_do_not_matter(module: Any) -> None:
    path = module.SweptPath(CAR)
    points = arc(3.0, 1.2, 20)
    twice = np.repeat(points, 2, axis=0)
    for point in (one(2.2, 0.7), one(1.5, 0.2)):
        assert path.min(point, 2.0, path=twice) == path.min(point, 2.0, path=points)


@every_module
def test_a_scan_is_read_along_it(module: Any) -> None:
    """A corridor that bends: a motion that stays runs into its outer wall, and the path does not."""
    scan = module.ScanTTC(-2.0, 0.01, 401, outline=CAR)
    bearing = np.asarray(scan.angles)
    ranges = np.full(401, 20.0)
    # The wall ahead stands at x = 3, from the left side to the right.
    ahead = np.abs(bearing) < 0.8
    ranges[ahead] = 3.0 / np.cos(bearing[ahead])
    path = module.ScanSweptPath(scan)
    assert path.min(ranges, 4.0) == pytest.approx(2.6 / 4.0, rel=1e-6)
    assert path.min(ranges, 4.0, path=arc(1.5, 1.5, 30)) == math.inf
    nearest = path.nearest(ranges, 4.0, path=arc(6.0, 0.6, 30))
    assert nearest.status is Status.CLOSING
    assert 0.0 < nearest.angle < 0.8


@every_module
@pytest.mark.parametrize("seed", range(12))
def test_against_a_drive_in_fine_steps(module: Any, seed: int) -> None:
    """The path is a smooth curve that is given coarsely, and is driven finely."""
    rng = np.random.default_rng(seed)
    way = np.linspace(0.0, 6.0, 6001)
    bend, phase = rng.uniform(-0.8, 0.8), rng.uniform(0.0, 6.0)
    curvature = bend * (np.sin(1.5 * way + phase) - 0.3)
    heading = np.concatenate([[0.0], np.cumsum(curvature[1:] * np.diff(way))])
    fine = np.cumsum(np.column_stack([np.cos(heading), np.sin(heading)]) * 1e-3, axis=0)
    coarse = np.vstack([[0.0, 0.0], fine[199::200]])
    path, hits = module.SweptPath(CAR, horizon=5.8), 0
    for _ in range(40):
        point = fine[rng.integers(0, 5000)] + rng.normal(0.0, 0.25, 2)
        expected = driven_until_touched(point, fine, CAR)
        if expected in (0.0, math.inf):
            wide = (CAR[0] - 0.02, CAR[1] + 0.02, CAR[2] - 0.02, CAR[3] + 0.02)
            if expected == math.inf and driven_until_touched(point, fine, wide) == math.inf:
                assert path.min(point[np.newaxis], 1.0, path=coarse) == math.inf
            continue
        narrow = (CAR[0] + 0.02, CAR[1] - 0.02, CAR[2] + 0.02, CAR[3] - 0.02)
        if driven_until_touched(point, fine, narrow) < math.inf:
            hits += 1
            assert path.min(point[np.newaxis], 1.0, path=coarse) == pytest.approx(expected, abs=0.06)
    assert hits > 3


@every_module
@pytest.mark.parametrize(
    ("points", "words"),
    [
        ([[0.0, 0.0]], "two points or more"),
        (np.empty((0, 2)), "two points or more"),
        ([[0.0, 0.0], [0.0, 0.0]], "lead somewhere"),
        ([[0.0, 0.0], [math.nan, 0.0]], "finite"),
        ([[0.0, 0.0], [math.inf, 0.0]], "finite"),
        ([[3.0, 0.0], [4.0, 0.0]], "start at the vehicle"),
        ([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], "turns by 90 degrees"),
        ([[0.0, 0.0], [0.0, 1.0]], "turns by 90 degrees"),
        ([0.0, 1.0, 2.0], "shape"),
        ([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], "shape"),
    ],
)
def test_paths_that_are_none(module: Any, points: Any, words: str) -> None:
    scan = module.ScanTTC(-1.0, 0.1, 21, outline=CAR)
    with pytest.raises(ValueError, match=f"path .*{words}"):
        module.SweptPath(CAR).min(one(2.0, 0.0), 1.0, path=points)
    with pytest.raises(ValueError, match=f"path .*{words}"):
        module.ScanSweptPath(scan).nearest(np.full(21, 3.0), 1.0, path=points)


@every_module
def test_arguments_that_contradict_it(module: Any) -> None:
    path = module.SweptPath(CAR)
    for more in ({"yaw_rate": 0.1}, {"lateral_speed": 0.1}):
        with pytest.raises(ValueError, match="path says where the vehicle goes"):
            path.min(one(2.0, 0.0), 1.0, path=STRAIGHT, **more)
    with pytest.raises(TypeError, match="path"):
        path.min(one(2.0, 0.0), 1.0, path="straight on")
    with pytest.raises(TypeError, match="path"):
        path.min(one(2.0, 0.0), 1.0, path=[[0, 0], [1]])
