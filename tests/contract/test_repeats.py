"""A measurement that is handed over again is not a new one: trackers predict through it, and say how old it is."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import ttc_fast
from ttc_fast import CloudTracker, DistanceTracker, Gate, Status, reference

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    Row = tuple[float, float, float]  # stamp, distance as reported, true distance


def radar(
    seed: int, *, measured: float, reported: float, speed: float, start: float, quantum: float, noise: float
) -> Iterator[Row]:
    """Rows at ``reported`` a second, each with the newest of ``measured`` distances a second."""
    errors = np.random.default_rng(seed).normal(0.0, noise, 1000)
    start += 0.13 * seed
    for row in range(int((start - 4.0) / speed * reported)):
        stamp = row / reported
        newest = int(stamp * measured + 1e-9)
        distance = start - speed * newest / measured + errors[newest]
        yield stamp, round(distance / quantum) * quantum if quantum else distance, start - speed * stamp


RATES = [(5.0, 20.0), (10.0, 20.0), (10.0, 50.0), (10.0, 100.0)]
APPROACHES = [(20.0, 80.0), (10.0, 60.0), (3.0, 30.0)]


def held(tracker: Any, rows: Iterator[Row], speed: float) -> NDArray[np.float64]:
    """Count rows from the second second on, those with the truth in both intervals, and those called NOT_CLOSING.

    The last number is the sum of the widths of the intervals of the closing speed, m/s.
    """
    count = inside = standing = 0
    width = 0.0
    for stamp, distance, true in rows:
        seen = tracker.update(distance, stamp)
        assert seen.ttc <= 1e6 or math.isinf(seen.ttc)
        if stamp <= 1.0 or seen.closing_speed_interval is None:
            continue
        low, high = seen.closing_speed_interval
        soonest, latest = seen.ttc_interval
        count += 1
        inside += (low <= speed <= high) and (soonest <= true / speed <= latest)
        standing += seen.status is Status.NOT_CLOSING
        width += high - low
    return np.array([count, inside, standing, width])


@pytest.mark.parametrize(("measured", "reported"), RATES)
def test_a_held_distance_is_predicted_through(measured: float, reported: float) -> None:
    def follow(method: Any) -> NDArray[np.float64]:
        total = np.zeros(4)
        for seed in range(8):
            for speed, start in APPROACHES:
                rates = {"measured": measured, "reported": reported}
                rows = radar(seed, **rates, speed=speed, start=start, quantum=0.0, noise=0.05)
                total += held(DistanceTracker(method), rows, speed)
        return total

    count, inside, standing, width = follow(None)
    # More often than nine of ten, because the speed is constant, which the tracker does not know beforehand.
    assert inside / count >= 0.85
    assert standing == 0
    assert width < 0.75 * follow(ttc_fast.KalmanCA())[3]


@pytest.mark.parametrize("quantum", [0.01, 0.1, 0.5, 1.0])
def test_a_rounded_distance_is_a_measurement_with_the_variance_of_its_rounding(quantum: float) -> None:
    total = np.zeros(4)
    for seed in range(8):
        for speed, start in [(8.3, 60.0), (5.2, 40.0), (2.1, 20.0)]:
            rows = radar(seed, measured=20.0, reported=20.0, speed=speed, start=start, quantum=quantum, noise=0.02)
            total += held(DistanceTracker(), rows, speed)
    count, inside, standing, _ = total
    assert inside / count >= 0.85
    assert standing <= 0.1 * count


@pytest.mark.parametrize("kind", [DistanceTracker, reference.DistanceTracker])
def test_the_interval_grows_with_the_age(kind: Any) -> None:
    tracker = kind()
    for frame in range(10):
        tracker.update(30.0 - 0.5 * frame + 0.01 * (frame % 3), 0.1 * frame)
    answers = [tracker.update(25.5, 0.9 + 0.05 * row) for row in (1, 2)]
    widths = [high - low for low, high in (answer.closing_speed_interval for answer in answers)]
    assert [round(answer.age, 9) for answer in answers] == [0.05, 0.1]
    assert widths[0] < widths[1]
    assert all(answer.status is Status.CLOSING for answer in answers)


@pytest.mark.parametrize("rate", [10.0, 20.0, 50.0])
@pytest.mark.parametrize(("quantum", "noise"), [(0.0, 0.0), (0.1, 0.02), (0.5, 0.02), (1.0, 0.05)])
def test_a_target_that_stands_reads_not_closing_within_a_second(rate: float, quantum: float, noise: float) -> None:
    errors = np.random.default_rng(4).normal(0.0, noise, 1000)
    standing, stopping = DistanceTracker(), DistanceTracker()
    for row in range(int(6.0 * rate)):
        stamp = row / rate
        distances = [12.2 + errors[row], 22.2 - 5.0 * min(stamp, 2.0) + errors[row]]
        if quantum:
            distances = [round(distance / quantum) * quantum for distance in distances]
        still, stopped = standing.update(distances[0], stamp), stopping.update(distances[1], stamp)
        if stamp > 1.0:
            assert still.status is Status.NOT_CLOSING, stamp
        if stamp > 3.0:
            assert stopped.status is Status.NOT_CLOSING, stamp


def test_a_noisy_sensor_that_freezes_is_lost_and_then_stale() -> None:
    errors = np.random.default_rng(5).normal(0.0, 0.05, 40)
    tracker = DistanceTracker()
    for row in range(40):
        tracker.update(40.0 - 0.5 * row + errors[row], 0.05 * row)
    frozen = 40.0 - 0.5 * 39 + errors[39]
    statuses = [tracker.update(frozen, 1.95 + 0.05 * row).status for row in range(1, 40)]
    assert statuses[11] is Status.LOST
    assert statuses[25:] == [Status.STALE] * 14


def tailgate(x: float, seed: int) -> NDArray[np.float64]:
    """The flat rear of a car, 300 points with 2 cm of noise."""
    rng = np.random.default_rng(seed)
    return np.column_stack([x + rng.normal(0.0, 0.02, 300), rng.uniform(-0.8, 0.8, 300), rng.uniform(-1.4, -0.95, 300)])


GATE = Gate(x=(2, 60), y=(-2, 2), z=(-1.5, -0.9))


@pytest.mark.parametrize("kind", [CloudTracker, reference.CloudTracker])
@pytest.mark.parametrize(("published", "speed"), [(20, 5.0), (50, 15.0)])
def test_clouds_that_are_published_again_give_the_answers_of_the_new_ones(
    kind: Any, published: int, speed: float
) -> None:
    every, once = kind(GATE), kind(GATE)
    for row in range(2 * published):
        newest = row * 10 // published
        points, stamp = tailgate(45.0 - speed * newest / 10.0, newest), row / published
        seen = every.update(points, stamp)
        if row * 10 % published == 0:
            assert seen == once.update(points, stamp)
            new = seen
        elif new.closing_speed_interval is not None:
            assert seen.closing_speed == new.closing_speed
            assert seen.distance == pytest.approx(new.distance - speed * seen.age, abs=0.02)
            assert np.ptp(seen.closing_speed_interval) > np.ptp(new.closing_speed_interval)


@pytest.mark.parametrize("kind", [CloudTracker, reference.CloudTracker])
def test_a_simulated_cloud_that_stands_is_not_closing(kind: Any) -> None:
    tracker, points = kind(GATE), tailgate(12.0, 0)
    answers = [tracker.update(points, 0.1 * frame) for frame in range(30)]
    assert {answer.status for answer in answers} == {Status.WARMING_UP, Status.NOT_CLOSING}
    assert all(answer.status is Status.NOT_CLOSING and answer.ttc == math.inf for answer in answers[10:])
    assert answers[20].age == pytest.approx(1.0, abs=1e-6)  # as far back as the tracker remembers


def wall(distance: float, seed: int, beams: int = 181) -> NDArray[np.float64]:
    """A scan of a wall ahead, with 1 cm of noise."""
    angles = np.linspace(-0.6, 0.6, beams)
    return distance / np.cos(angles) + np.random.default_rng(seed).normal(0.0, 0.01, beams)


@pytest.mark.parametrize("module", [ttc_fast, reference])
def test_scans_that_are_published_again_are_predicted_through(module: Any) -> None:
    scan = module.ScanTTC(-0.6, 1.2 / 180, 181)
    every, once = module.RangeRate(scan), module.RangeRate(scan)
    for row in range(60):
        newest, stamp = row // 3, row / 30.0
        ranges = wall(8.0 - 0.2 * newest, newest)
        seen = every.update(ranges, stamp)
        if row % 3 == 0:
            new = once.update(ranges, stamp)
            assert repr(seen) == repr(new)
        elif newest >= 5:
            assert seen.status is Status.CLOSING
            assert (seen.beam, seen.closing_speed) == (new.beam, new.closing_speed)
            assert seen.age == pytest.approx(stamp - newest / 10.0, abs=1e-9)
            assert seen.ttc == pytest.approx(new.ttc - seen.age, abs=1e-9)
            assert seen.standard_error > new.standard_error


@pytest.mark.parametrize("module", [ttc_fast, reference])
def test_a_simulated_scan_that_stands_is_not_closing(module: Any) -> None:
    rates = module.RangeRate(module.ScanTTC(-0.6, 1.2 / 180, 181))
    answers = [rates.update(wall(8.0, 0), 0.1 * frame) for frame in range(20)]
    assert all(answer.status is Status.NOT_CLOSING for answer in answers[8:])


def test_states_are_taken_up_in_the_middle_of_a_repeat() -> None:
    whole = DistanceTracker()
    rows = list(radar(3, measured=10.0, reported=50.0, speed=10.0, start=30.0, quantum=0.1, noise=0.02))
    for stamp, distance, _ in rows[:43]:
        whole.update(distance, stamp)
    copy = DistanceTracker()
    copy.restore(whole.state())
    for stamp, distance, _ in rows[43:]:
        assert repr(copy.update(distance, stamp)) == repr(whole.update(distance, stamp))
