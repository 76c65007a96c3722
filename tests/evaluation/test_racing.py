"""The racing loop: its rays and its car against what can be worked out by hand, and one lap with the named settings."""

from __future__ import annotations

import math

import numpy as np
import pytest

for needed in ("numba", "scipy", "contourpy", "PIL"):
    pytest.importorskip(needed, reason="needs the extra evaluation")

from evaluation.racing.__main__ import default, never  # noqa: E402
from evaluation.racing.car import GRIP, OUTLINE, Pose, SingleTrack  # noqa: E402
from evaluation.racing.course import RACING_LATERAL, Course, course, evenly, names, turned_round  # noqa: E402
from evaluation.racing.drives import lap_drive, random_drive  # noqa: E402
from ttc_fast import BrakeController, PresentArc, ScanTTC, StoppingDistance  # noqa: E402

pytestmark = pytest.mark.slow

COURSES = names()
AT_RANDOM = "random 50"
with_maps = pytest.mark.skipif(not COURSES, reason="the maps are not here: TTC_FAST_DATA says where they are")


def hall() -> Course:
    """A hall from 1 m to 9 m in x and y, in cells of 5 cm."""
    from scipy import ndimage

    free = np.zeros((200, 200), np.bool_)
    free[20:180, 20:180] = True
    circle = np.linspace(0.0, 2.0 * math.pi, 100, endpoint=False)
    line = evenly(np.column_stack([5.0 + 2.0 * np.cos(circle), 5.0 + 2.0 * np.sin(circle)]))
    return Course("hall", 0.05 * ndimage.distance_transform_edt(free), 0.05, np.zeros(2), line)


def test_rays_against_the_walls_of_a_hall() -> None:
    angles = np.linspace(-math.pi, math.pi, 721)
    ranges = hall().rays(4.0, 6.0, angles)
    cos, sin = np.cos(angles), np.sin(angles)
    with np.errstate(divide="ignore"):
        to_x = np.where(cos > 0, 5.0, 3.0) / np.abs(cos)
        to_y = np.where(sin > 0, 3.0, 5.0) / np.abs(sin)
    np.testing.assert_allclose(ranges, np.minimum(to_x, to_y), atol=0.05)


@pytest.mark.parametrize(
    ("x", "heading", "hits"), [(8.5, 0.0, False), (8.6, 0.0, True), (8.7, 1.57, False), (8.9, 1.57, True)]
)
def test_the_body_touches_a_wall(x: float, heading: float, hits: bool) -> None:
    assert hall().hits(x, 5.0, heading, OUTLINE) is hits


def test_a_line_is_as_long_and_as_bent_as_its_circle() -> None:
    line = hall().line
    assert line.length == pytest.approx(4.0 * math.pi, rel=1e-3)
    np.testing.assert_allclose(line.curvature, 0.5, atol=0.02)
    assert np.hypot(line.x - 5.0, line.y - 5.0) == pytest.approx(2.0, abs=0.01)


@pytest.mark.parametrize("speed", [1.0, 6.0])
def test_the_car_turns_on_a_circle_as_its_tires_allow(speed: float) -> None:
    car = SingleTrack(hall(), Pose(0.0, 0.0, 0.0), speed, np.random.default_rng(0))
    for _ in range(400):
        car.drive(0.2, speed)
    expected = min(math.tan(0.2) / 0.33, GRIP / speed**2)
    assert car.curvature == pytest.approx(expected)
    assert car.motion().yaw_rate == pytest.approx(speed * expected, abs=0.05)


@pytest.mark.parametrize("name", [*COURSES, *(f"random {seed}" for seed in (50, 51))])
def test_a_line_can_be_driven(name: str) -> None:
    where = course(name)
    touching = [
        where.hits(where.line.x[at], where.line.y[at], where.line.heading(at), OUTLINE)
        for at in range(0, len(where.line.x), 3)
    ]
    assert not any(touching)
    assert (where.line.speed**2 * np.abs(where.line.curvature)).max() < RACING_LATERAL + 1e-6


def test_a_course_at_random_is_the_same_each_time() -> None:
    course.cache_clear()
    once = course(AT_RANDOM).line.points
    course.cache_clear()
    np.testing.assert_array_equal(course(AT_RANDOM).line.points, once)
    assert len(course("random 51").line.x) != len(once)


def test_a_course_is_turned_round() -> None:
    where = course(AT_RANDOM)
    mirrored, back = turned_round(where, "mirrored"), turned_round(where, "reversed")
    assert mirrored.line.length == pytest.approx(where.line.length, rel=1e-3)
    at = len(where.line.x) // 3
    there = int(np.argmin(np.hypot(mirrored.line.x + where.line.x[at], mirrored.line.y - where.line.y[at])))
    assert mirrored.line.curvature[there] == pytest.approx(-where.line.curvature[at], abs=0.05)
    ranges = where.rays(where.line.x[at], where.line.y[at], np.array([0.3, 2.0]))
    turned = mirrored.rays(-where.line.x[at], where.line.y[at], math.pi - np.array([0.3, 2.0]))
    np.testing.assert_allclose(turned, ranges, atol=2.0 * where.resolution)
    np.testing.assert_allclose(back.line.points[::-1], where.line.points, atol=0.05)
    with pytest.raises(ValueError, match="mirrored or reversed"):
        turned_round(where, "upside down")


@pytest.mark.parametrize("speed", [4.0, 8.0])
def test_racing_drives_a_course_that_nothing_was_chosen_on(speed: float) -> None:
    raced = lap_drive(AT_RANDOM, speed, 1.0, BrakeController.racing, True)
    assert (raced.laps >= 1.0, raced.onsets, raced.hits) == (True, 0, 0)


@with_maps
def test_who_may_turn_into_a_wall_has_to_be_slow_enough() -> None:
    """It turns to a wall 0.5 m away, which its arc passed 75 ms before."""

    def on_its_arc(scan: ScanTTC) -> BrakeController:
        return BrakeController.racing(scan, criteria=[StoppingDistance(reaction_time=0.15), PresentArc()])

    assert random_drive("berlin", 5, on_its_arc).hits == 1
    assert random_drive("berlin", 5, BrakeController.racing).hits == 0


@with_maps
def test_racing_drives_where_the_default_stands() -> None:
    name = COURSES[-1]
    raced = lap_drive(name, 5.0, 1.0, BrakeController.racing, True)
    assert (raced.laps >= 1.0, raced.onsets, raced.hits) == (True, 0, 0)
    stood = lap_drive(name, 5.0, 1.0, default, False)
    assert stood.laps < 0.5
    assert stood.onsets > 0


@with_maps
def test_steering_at_random_hits_without_a_brake() -> None:
    name = COURSES[-1]
    assert sum(random_drive(name, run, never).hits for run in range(4)) == 4
    careful = [random_drive(name, run, BrakeController.careful) for run in range(4)]
    assert sum(each.hits for each in careful) <= 1
    assert all(each.onsets > 0 for each in careful)
