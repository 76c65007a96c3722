"""What ``ScaleTracker`` says of a target that grows, with and without another sensor beside the camera."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import ttc_fast
from ttc_fast import Status

SPREAD = 8e-4


def ends(seen: ttc_fast.TrackedTTC) -> tuple[float, float]:
    assert seen.ttc_interval is not None
    return seen.ttc_interval


def drive(seed: int = 0, pictures: int = 40, speed: float = 1.0, start: float = 12.0) -> Any:
    """Distances of a car whose closing speed drifts as on roads, its scales with noise and a shared error."""
    random = np.random.default_rng(seed)
    acceleration = np.convolve(random.normal(0.0, 0.5, pictures + 6), np.ones(7) / 7, "valid")
    speeds = speed + 0.1 * np.cumsum(acceleration)
    distances = start - 0.1 * np.cumsum(speeds)
    growth = (distances[:-1] / distances[1:] - 1.0) * random.normal(1.0, 0.05)
    scales = 1.0 + growth + random.normal(0.0, SPREAD, pictures - 1)
    return distances, speeds, scales


def test_a_camera_alone_knows_the_time_and_neither_distance_nor_speed() -> None:
    inside, errors = [], []
    for seed in range(30):
        distances, speeds, scales = drive(seed)
        tracker = ttc_fast.ScaleTracker()
        assert tracker.update(None, 0.0).status is Status.NO_DATA
        for picture in range(1, len(distances)):
            seen = tracker.update(scales[picture - 1], 0.1 * picture, SPREAD)
            assert math.isnan(seen.distance)
            assert math.isnan(seen.closing_speed)
            assert seen.closing_speed_interval is None
            assert seen.age == 0.0
            if picture > 5 and speeds[picture] > 0.5:
                truth = distances[picture] / speeds[picture]
                inside.append(ends(seen)[0] <= truth <= ends(seen)[1])
                errors.append(abs(seen.ttc / truth - 1.0))
    assert 0.88 < np.mean(inside) <= 1.0
    assert np.median(errors) < 0.06


def test_the_guess_at_the_distance_hardly_matters() -> None:
    distances, _, scales = drive(3)
    trackers = [ttc_fast.ScaleTracker(distance) for distance in (5.0, 10.0, 20.0)]
    for picture in range(len(distances)):
        scale = scales[picture - 1] if picture else None
        times = [tracker.update(scale, 0.1 * picture, SPREAD).ttc for tracker in trackers]
    assert max(times) / min(times) < 1.1


def test_distances_beside_the_camera_make_it_more_certain() -> None:
    errors: dict[str, list[float]] = {"both": [], "lidar": [], "camera": []}
    for seed in range(30):
        distances, speeds, scales = drive(seed)
        random = np.random.default_rng([seed, 1])
        trackers = {name: ttc_fast.ScaleTracker() for name in errors}
        for picture in range(len(distances)):
            camera = (scales[picture - 1], 0.1 * picture, SPREAD) if picture else (None, 0.0)
            lidar: dict[str, float] = {
                "distance": distances[picture] + random.normal(0.0, 0.03),
                "distance_noise": 0.03,
            }
            both = trackers["both"].update(*camera, **lidar)
            alone = trackers["lidar"].update(None, 0.1 * picture, **lidar)
            seen = {"both": both, "lidar": alone, "camera": trackers["camera"].update(*camera)}
            if picture > 5 and speeds[picture] > 0.5:
                truth = distances[picture] / speeds[picture]
                for name, each in seen.items():
                    errors[name].append(min(abs(each.ttc / truth - 1.0), 1.0))
                assert both.closing_speed == pytest.approx(speeds[picture], abs=0.5)
                assert both.distance == pytest.approx(distances[picture], abs=0.2)
    means = {name: np.mean(each) for name, each in errors.items()}
    assert means["both"] < 0.95 * min(means["lidar"], means["camera"])


def test_displacements_count_from_the_first_distance_on() -> None:
    tracker = ttc_fast.ScaleTracker()
    tracker.update(None, 0.0, displacement=0.3, displacement_noise=0.01)
    assert tracker.update(None, 0.1, displacement=0.3, displacement_noise=0.01).status is Status.NO_DATA
    for picture in range(2, 10):
        seen = tracker.update(
            None,
            0.1 * picture,
            distance=9.0 if picture == 2 else None,
            distance_noise=0.01,
            displacement=0.3,
            displacement_noise=0.01,
        )
    assert seen.status is Status.CLOSING
    assert seen.distance == pytest.approx(6.9, abs=0.1)
    assert seen.closing_speed == pytest.approx(3.0, abs=0.1)


def test_gaps_and_stamps() -> None:
    tracker = ttc_fast.ScaleTracker(max_gap=0.5)
    tracker.update(None, 0.0)
    for picture in range(1, 6):
        seen = tracker.update(1.02, 0.1 * picture, SPREAD)
    before = tracker.state()
    for stamp in (0.5, 0.2, math.nan, math.inf):
        refused = tracker.update(1.02, stamp, SPREAD)
        assert (refused.status, refused.ttc) == (Status.INVALID, seen.ttc)
    assert repr(tracker.state()) == repr(before)
    lost = tracker.update(None, 0.7)
    assert lost.status is Status.LOST
    assert lost.age == pytest.approx(0.2)
    assert lost.ttc == pytest.approx(seen.ttc - 0.2, rel=0.05)
    assert ends(lost)[1] - ends(lost)[0] > ends(seen)[1] - ends(seen)[0]
    assert tracker.update(math.nan, 0.9, math.nan).status is Status.LOST
    assert tracker.update(None, 1.1).status is Status.NO_DATA
    assert tracker.update(1.02, 1.2, SPREAD).status is Status.CLOSING


@pytest.mark.parametrize(("jump", "frames"), [(-4.0, 1), (4.0, 3)])
def test_another_target(jump: float, frames: int) -> None:
    """A nearer one leads at once; one that is farther away when it was seen three times."""
    tracker = ttc_fast.ScaleTracker()
    for picture in range(10):
        seen = tracker.update(None, 0.1 * picture, distance=10.0 - 0.2 * picture, distance_noise=0.02)
    assert seen.closing_speed == pytest.approx(2.0, abs=0.1)
    for picture in range(10, 10 + frames):
        assert abs(seen.distance - (10.0 - 0.2 * (picture - 1))) < 0.3
        seen = tracker.update(None, 0.1 * picture, distance=8.0 + jump, distance_noise=0.02)
    assert seen.status is Status.WARMING_UP
    assert seen.distance == pytest.approx(8.0 + jump)


def test_contact_and_what_stands() -> None:
    tracker = ttc_fast.ScaleTracker()
    assert tracker.update(None, 0.0, distance=-0.1, distance_noise=0.02).status is Status.CONTACT
    tracker.reset()
    tracker.update(None, 0.0)
    random = np.random.default_rng(0)
    for picture in range(1, 60):
        seen = tracker.update(1.0 + random.normal(0.0, 2e-4), 0.1 * picture, 2e-4)
        if picture > 10:
            assert seen.ttc > 100.0
            assert ends(seen)[1] > 500.0


def test_an_outlier_pulls_little() -> None:
    tracker = ttc_fast.ScaleTracker()
    tracker.update(None, 0.0)
    for picture in range(1, 20):
        seen = tracker.update(1.3 if picture == 15 else 1.01, 0.1 * picture, SPREAD)
        if picture >= 10:
            assert 5.0 < seen.ttc < 12.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"scale": 0.0, "spread": 1e-3}, "scale must be finite and above 0"),
        ({"scale": math.inf, "spread": 1e-3}, "scale must be finite and above 0"),
        ({"scale": 1.0}, "spread must be given with scale"),
        ({"scale": 1.0, "spread": -1.0}, "spread must be finite and at least 0"),
        ({"scale": None, "distance": 3.0}, "distance_noise must be given with distance"),
        ({"scale": None, "distance": 3.0, "distance_noise": 0.0}, "distance_noise must be finite and above 0"),
        ({"scale": None, "distance": math.inf, "distance_noise": 1.0}, "distance must be finite"),
        ({"scale": None, "displacement": 3.0}, "displacement_noise must be given with displacement"),
    ],
)
def test_what_is_refused_changes_nothing(arguments: dict[str, Any], message: str) -> None:
    tracker = ttc_fast.ScaleTracker()
    tracker.update(None, 0.0)
    tracker.update(1.02, 0.1, SPREAD)
    before = repr(tracker.state())
    with pytest.raises(ValueError, match=message):
        tracker.update(stamp=0.2, **arguments)
    assert repr(tracker.state()) == before
