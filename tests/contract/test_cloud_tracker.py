"""`CloudTracker`: as the reference says, and through all that happens on a road."""

from __future__ import annotations

import copy
import json
import math
import pickle
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ttc_fast
from evaluation.lidar import CHANGING, GATE, STEADY, Approach, Pose, Scanner, turn
from tests.support.cloud_layouts import LAYOUTS
from tests.support.common import both_dtypes, every_module, examples
from ttc_fast import Alignment, Gate, Status, reference

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Cloud = NDArray[Any]

NAMES = [field.name for field in fields(reference.TrackedTTC)]


def assert_same(kernel: Any, specified: Any) -> None:
    """Status exactly, numbers but for rounding: sums depend on the order of their terms."""
    assert kernel.status is specified.status
    for name in NAMES:
        one, other = getattr(kernel, name), getattr(specified, name)
        if other is None:
            assert one is None
        else:
            np.testing.assert_allclose(one, other, rtol=1e-7, atol=1e-9, err_msg=name)


def assert_parity(clouds: Sequence[Any], stamps: Sequence[float], **settings: Any) -> None:
    kernel, specified = ttc_fast.CloudTracker(**settings), reference.CloudTracker(**settings)
    for cloud, stamp in zip(clouds, stamps, strict=True):
        assert_same(kernel.update(cloud, stamp), specified.update(cloud, stamp))


def wall(x: float, *, points: int = 400, seed: int = 0, half_width: float = 0.8) -> Cloud:
    """A rough wall, each time at other places of it."""
    rng = np.random.default_rng((seed, round(1000 * abs(x))))
    y, z = rng.uniform(-half_width, half_width, points), rng.uniform(-1.2, 0.2, points)
    return np.column_stack([x + 0.3 * (z > -0.6) + rng.normal(0, 0.02, points), y, z]).astype(np.float32)


def follow(tracker: Any, clouds: Sequence[Cloud], first: int = 0) -> list[Any]:
    return [tracker.update(cloud, (first + number) / 10) for number, cloud in enumerate(clouds)]


@pytest.mark.parametrize("approach", [*STEADY, *CHANGING], ids=lambda approach: approach.name)
def test_approaches(approach: Approach) -> None:
    frames = replace(approach, duration=1.5).frames(seed=1)
    assert_parity([frame.points for frame in frames], [frame.stamp for frame in frames], gate=GATE)


def test_a_car_that_nods() -> None:
    frames = Approach("", 12, 2, -3, 0.4, scanner=Scanner(pitch=math.radians(0.1))).frames(seed=3)
    assert_parity([frame.points for frame in frames], [frame.stamp for frame in frames], gate=GATE)


@pytest.mark.parametrize(
    "gate",
    [
        Gate(),
        Gate(axes=("-y", "x", "z")),
        Gate(y=(-9, 9), curvature=0.02),
        Gate(road=ttc_fast.Road(0.0, 0.0, -1.73), height=(0.3, 1.5), intensity=(0.2, 0.9)),
    ],
    ids=str,
)
@both_dtypes
@pytest.mark.parametrize("layout", ["rows", "records, as of Velodyne"])
def test_layouts_dtypes_and_gates(layout: str, dtype: Any, gate: Gate) -> None:
    columns = {"x": 0, "y": 1, "z": 2}
    stored = [frame.points.T.astype(dtype) for frame in Approach("", 9, 2).frames(seed=2)[:8]]
    swapped = []
    for cloud in stored:
        parts = list(cloud)
        for axis, part in zip(gate.axes, cloud[:3], strict=True):
            parts[columns[axis[-1]]] = -part if axis.startswith("-") else part
        swapped.append(LAYOUTS[layout](tuple(parts)))
    assert_parity(swapped, (np.arange(8) / 10).tolist(), gate=gate, method=Alignment((0.3, 0.1), depth=0.5, window=0.4))


def test_a_frame_that_loses_nearly_all_of_its_weight() -> None:
    """Strays in other places each time: at this noise only edges are left, whose weights all but vanish."""
    clouds = [
        np.array([[13.92, -0.08, -0.82]]),
        np.array([[13.72, 0.27, -0.73], [13.92, 0.14, -0.62], [13.47, -0.01, -1.01], [14.38, 0.04, 0.08]]),
        np.array([[13.66, -0.08, -0.85], [14.31, 0.13, 0.15], [13.93, 0.14, 0.19], [14.38, 0.2, -1.1]]),
    ]
    method = Alignment(window=2.0, range_noise=1e-4)
    assert_parity(clouds, [0.1, 0.3, 0.4], estimator=ttc_fast.KthSmallest(4), method=method, max_gap=1.0)


@examples(60)
@given(
    seed=st.integers(0, 1000),
    points=st.lists(st.integers(0, 60), min_size=1, max_size=20),
    gaps=st.lists(st.sampled_from([0.1, 0.1, 0.1, 0.0, -0.1, 0.3, 0.9, math.nan]), min_size=20, max_size=20),
    speeds=st.lists(st.sampled_from([0.0, 1.0, 5.0, -2.0, 60.0]), min_size=20, max_size=20),
    estimator=st.sampled_from([ttc_fast.Minimum(), ttc_fast.KthSmallest(4), ttc_fast.Quantile(0.1)]),
)
def test_whatever_happens(seed: int, points: list[int], gaps: list[float], speeds: list[float], estimator: Any) -> None:
    """Few points, none, strays, other cars, and stamps in any order: the same answers, and never a senseless one."""
    rng = np.random.default_rng(seed)
    kernel, specified = (
        module.CloudTracker(estimator=estimator, front_offset=1.0, jump=0.4) for module in (ttc_fast, reference)
    )
    x, stamp = 10.0, 100.0
    for count, gap, speed in zip(points, gaps, speeds, strict=False):
        stamp += 0.0 if math.isnan(gap) else gap
        x -= speed * 0.1
        cloud = np.column_stack([rng.normal(x, 0.05, count), rng.uniform(-0.5, 0.5, (count, 2))])
        cloud[rng.random(count) < 0.05, 0] -= 3
        cloud[rng.random(count) < 0.05] = np.nan
        now = math.nan if math.isnan(gap) else stamp
        seen, said = kernel.update(cloud, now), specified.update(cloud, now)
        assert_same(seen, said)
        assert 0 <= seen.ttc <= math.inf
        if seen.ttc_interval is not None:
            low, high = seen.ttc_interval
            assert 0 <= low <= seen.ttc <= high


def test_a_nearer_car_is_never_mixed_with_the_one_before() -> None:
    scanner, rng = Scanner(), np.random.default_rng(5)
    tracker = ttc_fast.CloudTracker(GATE)
    far, near = 25.0, 14.0
    for number in range(30):
        far, near = far - 0.2, near - 0.1
        rears = [Pose(far, 0.0)] + ([Pose(near, 2.6 - 0.15 * (number - 10))] if number >= 10 else [])
        seen = tracker.update(turn(scanner, rears, rng), number / 10)
        assert min(abs(seen.distance - far), abs(seen.distance - near)) < 0.5
        if seen.status is not Status.WARMING_UP:
            assert min(abs(seen.closing_speed - 2.0), abs(seen.closing_speed - 1.0)) < 0.35
    assert abs(seen.distance - near) < 0.1
    assert abs(seen.closing_speed - 1.0) < 0.1


def test_a_flicker_costs_one_frame() -> None:
    tracker = ttc_fast.CloudTracker()
    follow(tracker, [wall(20.0 - 0.3 * number) for number in range(8)])
    assert tracker.update(wall(6.0, points=30), 0.8).status is Status.WARMING_UP
    seen = tracker.update(wall(20.0 - 0.3 * 9), 0.9)
    assert seen.status is Status.CLOSING
    assert abs(seen.closing_speed - 3.0) < 0.1


def test_a_stray_point_changes_nothing() -> None:
    clouds = [wall(12.0 - 0.1 * number) for number in range(12)]
    strays = [np.vstack([cloud, [[cloud[:, 0].min() - 0.14, 0.1, -0.5]]]).astype(np.float32) for cloud in clouds]
    for number in (5, 11):
        mixed = [
            stray if place == number else cloud for place, (cloud, stray) in enumerate(zip(clouds, strays, strict=True))
        ]
        with_it = follow(ttc_fast.CloudTracker(estimator=ttc_fast.Minimum()), mixed)[-1]
        without = follow(ttc_fast.CloudTracker(estimator=ttc_fast.Minimum()), clouds)[-1]
        assert abs(with_it.closing_speed - without.closing_speed) < 0.02
        assert abs(with_it.distance - without.distance) < 0.02


@every_module
def test_cells_that_contradict_each_other_widen_the_interval(module: Any) -> None:
    """Two rings of a sparse lidar on a car: the upper one slides from the rear on to the boot, half of all cells."""
    tracker = module.CloudTracker(Gate(z=None))
    y = np.arange(-0.75, 0.8, 0.1)
    rows = len(y)
    for frame in range(6):
        x = 15.0 - 0.5 * frame
        upper = x + (0.27 if frame >= 3 else 0.0)
        ahead = np.concatenate([np.full(rows, x), np.full(rows, upper), np.full(rows, upper)])
        cloud = np.column_stack([ahead, np.tile(y, 3), np.repeat([-0.9, -0.78, -0.72], rows)])
        seen = tracker.update(cloud, stamp=0.1 * frame)
        if frame >= 2:
            low, high = seen.closing_speed_interval
            assert low <= 5.0 <= high


def test_a_lost_car_goes_on_as_it_did_and_then_is_forgotten() -> None:
    tracker = ttc_fast.CloudTracker()
    before = follow(tracker, [wall(9.0 - 0.2 * number) for number in range(6)])[-1]
    behind = np.array([[-5.0, 0.0, 0.0]])
    lost = tracker.update(behind, 0.7)
    assert lost.status is Status.LOST
    assert math.isclose(lost.ttc, before.ttc - 0.2, rel_tol=1e-9)
    assert lost.closing_speed_interval is None
    seen = tracker.update(wall(9.0 - 0.2 * 8), 0.8)
    assert seen.status is Status.CLOSING
    assert tracker.update(behind, 1.4).status is Status.CLEAR
    assert tracker.update(wall(7.0), 1.5).status is Status.WARMING_UP


def test_a_blind_sensor() -> None:
    tracker = ttc_fast.CloudTracker()
    follow(tracker, [wall(9.0 - 0.2 * number) for number in range(6)])
    assert tracker.update(np.full((9, 3), np.nan), 0.6).status is Status.NO_DATA
    assert tracker.update(wall(9.0 - 0.2 * 7), 0.7).status is Status.CLOSING


def test_repeated_late_and_senseless_stamps() -> None:
    tracker = ttc_fast.CloudTracker()
    before = follow(tracker, [wall(9.0 - 0.2 * number) for number in range(6)])[-1]
    remembered = tracker.state()
    for stamp in (0.5, 0.2, math.nan, math.inf):
        seen = tracker.update(wall(3.0), stamp)
        assert seen.status is Status.INVALID
        assert seen.ttc == before.ttc
        assert tracker.state() == remembered


def test_few_points_fall_back_on_the_nearest() -> None:
    tracker = ttc_fast.CloudTracker()
    seen = follow(tracker, [wall(9.0 - 0.2 * number, points=3) for number in range(8)])[-1]
    assert seen.status is Status.TOO_FEW
    assert seen.ttc_interval is not None
    low, high = seen.ttc_interval
    assert low < 7.6 / 2 < high


def test_one_point_is_followed() -> None:
    tracker = ttc_fast.CloudTracker(estimator=ttc_fast.Minimum())
    seen = follow(tracker, [np.array([[9.0 - 0.2 * number, 0.0, 0.0]]) for number in range(8)])[-1]
    assert seen.status is Status.CLOSING
    assert math.isclose(seen.closing_speed, 2.0, rel_tol=1e-6)


def test_contact() -> None:
    tracker = ttc_fast.CloudTracker(front_offset=4.0)
    seen = follow(tracker, [wall(6.0 - 0.3 * number) for number in range(8)])[-1]
    assert (seen.status, seen.ttc) == (Status.CONTACT, 0.0)


@every_module
@pytest.mark.parametrize("points", [3, 400])  # too few for the estimator, and enough
def test_contact_with_something_new_is_contact_at_once(module: Any, points: int) -> None:
    tracker = module.CloudTracker(front_offset=4.0)
    follow(tracker, [wall(30.0)] * 4)
    seen = tracker.update(wall(3.5, points=points), 0.4)
    assert (seen.status, seen.ttc, seen.ttc_interval) == (Status.CONTACT, math.inf, None)
    assert math.isclose(seen.distance, -0.5, abs_tol=0.2)
    assert math.isnan(seen.closing_speed)


def test_irregular_stamps_and_long_runs() -> None:
    rng = np.random.default_rng(3)
    stamps = 1.7e9 + np.cumsum(rng.uniform(0.02, 0.2, 60))
    tracker = ttc_fast.CloudTracker()
    for stamp in stamps:
        seen = tracker.update(wall(30.0 - 2.0 * (stamp - stamps[0])), stamp)
    assert abs(seen.closing_speed - 2.0) < 0.05
    assert len(tracker.state()["present"]["sightings"]) <= 16


def test_time_may_begin_anywhere_and_lengths_may_be_scaled() -> None:
    clouds = [wall(12.0 - 0.2 * number).astype(np.float64) for number in range(9)]
    plain = follow(ttc_fast.CloudTracker(), clouds)[-1]
    later = follow(ttc_fast.CloudTracker(), clouds, first=10_000)[-1]
    assert math.isclose(later.ttc, plain.ttc, rel_tol=1e-9)
    # Halves of all lengths, with cells half as large and half the noise; how cars accelerate stays as it is.
    half = Alignment((0.1, 0.025), depth=0.4, range_noise=0.01)
    smaller = follow(ttc_fast.CloudTracker(method=half, jump=0.25), [cloud / 2 for cloud in clouds])[-1]
    assert math.isclose(smaller.distance, plain.distance / 2, rel_tol=1e-3)
    assert math.isclose(smaller.ttc, plain.ttc, rel_tol=1e-2)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda tracker: pickle.loads(pickle.dumps(tracker))])
@every_module
def test_a_copy_goes_on_alike(module: Any, copied: Any) -> None:
    tracker = module.CloudTracker(Gate(x=(1.0, 50.0)), estimator=ttc_fast.KthSmallest(3), front_offset=1.0, jump=0.4)
    follow(tracker, [wall(20.0 - 0.3 * number) for number in range(8)])
    tracker.update(wall(6.0), 0.8)  # the car before is shelved
    other = copied(tracker)
    for number in (9, 10, 11):
        assert_same(
            other.update(wall(20.0 - 0.3 * number), number / 10), tracker.update(wall(20.0 - 0.3 * number), number / 10)
        )
    assert other.state() == tracker.state()


def test_states_pass_between_kernel_and_reference_through_json() -> None:
    trackers = [module.CloudTracker() for module in (ttc_fast, reference)]
    for tracker in trackers:
        follow(tracker, [wall(20.0 - 0.3 * number) for number in range(8)])
    swapped = [module.CloudTracker() for module in (ttc_fast, reference)]
    for tracker, other in zip(swapped, reversed(trackers), strict=True):
        tracker.restore(json.loads(json.dumps(other.state())))
    assert_same(*(tracker.update(wall(17.6), 0.8) for tracker in swapped))


@pytest.mark.parametrize(
    "spoil",
    [
        lambda state: state.pop("present"),
        lambda state: state.update(stamp=math.nan),
        lambda state: state["present"]["sightings"].reverse(),
        lambda state: state["present"]["sightings"][0]["cells"].reverse(),
        lambda state: state["present"]["sightings"][0].update(edge=math.inf),
        lambda state: state["present"].update(trend=[1.0, 2.0, -1.0]),
        lambda state: state["present"]["sightings"][0]["cells"].append([2.0**40, 0.0, 1.0, 1.0, 1.0]),
        lambda state: state["present"]["sightings"][0]["cells"].append([31_000.0, 0.0, 0.0, 1.0, 1.0]),
    ],
)
def test_no_such_state(spoil: Any) -> None:
    tracker = ttc_fast.CloudTracker()
    follow(tracker, [wall(20.0 - 0.3 * number) for number in range(4)])
    state = tracker.state()
    spoil(state)
    with pytest.raises(ValueError, match="state"):
        ttc_fast.CloudTracker().restore(state)


@every_module
@pytest.mark.parametrize(
    ("settings", "error", "named"),
    [
        ({"jump": 0.0}, ValueError, "jump"),
        ({"max_gap": math.nan}, ValueError, "max_gap"),
        ({"front_offset": math.inf}, ValueError, "front_offset"),
        ({"method": "alignment"}, TypeError, "method"),
        ({"gate": 3}, TypeError, "gate"),
    ],
)
def test_settings_that_make_no_sense(module: Any, settings: dict[str, Any], error: type[Exception], named: str) -> None:
    with pytest.raises(error, match=named):
        module.CloudTracker(**settings)


@pytest.mark.parametrize("name", ["cell", "depth", "window", "range_noise"])
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_an_alignment_that_makes_no_sense(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=name):
        Alignment(**{name: (0.2, value) if name == "cell" else value})  # type: ignore[arg-type]
