"""The vehicle itself in the cloud: a gate that begins beyond it, and a tracker that looks past it."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import ttc_fast
from tests.support.common import every_module
from ttc_fast import Gate, Status, reference

if TYPE_CHECKING:
    from numpy.typing import NDArray

HEIGHT = 1.73
FRONT = 2.5
FROM_THE_SENSOR = Gate.above_road(HEIGHT, x=(0.0, 60.0))
"""A gate that holds the bonnet."""


def bonnet(
    frame: int, *, begin: float = 1.0, end: float = FRONT, points: int = 60, noise: float = 0.02
) -> NDArray[Any]:
    """The bonnet of the vehicle: each time other points of it, all between ``begin`` and ``end``."""
    rng = np.random.default_rng((1, frame))
    x, y = rng.uniform(begin, end, points), rng.uniform(-0.8, 0.8, points)
    x[:12] = begin
    return np.column_stack([x, y, np.full(points, -0.9)]) + rng.normal(0, noise, (points, 3))


def tailgate(x: float, frame: int, points: int = 300) -> NDArray[Any]:
    """The rear of the car ahead."""
    rng = np.random.default_rng((2, frame))
    return np.column_stack(
        [x + rng.normal(0, 0.02, points), rng.uniform(-0.8, 0.8, points), rng.uniform(-1.4, -0.4, points)]
    )


def drive(
    tracker: Any, ahead: Any, *, frames: int = 30, near: Any = bonnet, begin: int = 0
) -> list[tuple[Any, float | None]]:
    """Give each answer with where the vehicle itself is seen; ``ahead`` and ``near`` are functions of the frame."""
    seen = []
    for frame in range(begin, begin + frames):
        cloud = np.vstack([near(frame), tailgate(ahead(frame), frame)]).astype(np.float32)
        seen.append((tracker.update(cloud, frame / 10), tracker.own_vehicle))
    return seen


def closing(speed: float, start: float = 20.0) -> Any:
    return lambda frame: start - speed * frame / 10


# The gate


def test_a_gate_begins_at_the_front_of_the_vehicle() -> None:
    gate = Gate.above_road(HEIGHT, clearance=0.2, headroom=2.0, front=FRONT)
    assert gate.x == (FRONT, math.inf)
    assert gate.z == pytest.approx((-1.53, 0.27))


def test_a_gate_with_bounds_ahead_begins_at_the_farther_of_both() -> None:
    assert Gate.above_road(HEIGHT, front=2.5, x=(0.0, 40.0)).x == (2.5, 40.0)
    assert Gate.above_road(HEIGHT, front=2.5, x=(4.0, 40.0)).x == (4.0, 40.0)
    assert Gate.above_road(HEIGHT, x=(0.0, 40.0)).x == (0.0, 40.0)


def test_without_a_front_the_gate_begins_beyond_the_bonnet_of_a_car() -> None:
    low, high = Gate.above_road(HEIGHT).x
    assert low == pytest.approx(1.5 * HEIGHT)
    assert high == math.inf
    assert low > 2.54  # as far as the car of KITTI sees its bonnet


def test_the_plain_gate_begins_at_the_sensor() -> None:
    assert Gate().x == (0.0, math.inf)


@pytest.mark.parametrize("front", [math.nan, math.inf, -math.inf, 41.0])
def test_a_front_that_makes_no_sense(front: float) -> None:
    with pytest.raises(ValueError, match="front"):
        Gate.above_road(HEIGHT, front=front, x=(0.0, 40.0))


def test_a_front_is_a_number() -> None:
    with pytest.raises(TypeError, match="front"):
        Gate.above_road(HEIGHT, front="bumper")  # type: ignore[arg-type]


@every_module
def test_two_clouds_in_a_gate_beyond_the_bonnet(module: Any) -> None:
    before, now = (np.vstack([bonnet(frame), tailgate(8.0 - 0.5 * frame, frame)]) for frame in range(2))
    held = module.ttc_from_clouds(before, now, 0.1, gate=FROM_THE_SENSOR)
    assert held.distance < 1.1
    seen = module.ttc_from_clouds(before, now, 0.1, gate=Gate.above_road(HEIGHT, front=2.6))
    assert (seen.status, seen.distance) == (Status.CLOSING, pytest.approx(7.5, abs=0.1))
    assert seen.ttc == pytest.approx(1.5, rel=0.1)


# The tracker


@every_module
@pytest.mark.parametrize("gate", [FROM_THE_SENSOR, Gate()], ids=["above the road", "plain"])
def test_what_keeps_its_distance_while_the_world_moves_is_no_target(module: Any, gate: Gate) -> None:
    *_, (seen, own) = drive(module.CloudTracker(gate), closing(3.0))
    assert own == pytest.approx(1.0, abs=0.1)
    assert seen.status is Status.CLOSING
    assert seen.distance == pytest.approx(20.0 - 3.0 * 2.9, abs=0.1)
    assert seen.closing_speed == pytest.approx(3.0, abs=0.1)


@every_module
def test_the_vehicle_is_known_within_a_second(module: Any) -> None:
    known = [own is not None for _, own in drive(module.CloudTracker(FROM_THE_SENSOR), closing(3.0))]
    assert known == sorted(known)
    assert known.index(True) <= 10


@every_module
def test_a_car_that_pulls_away_shows_the_vehicle_as_well(module: Any) -> None:
    *_, (seen, own) = drive(module.CloudTracker(FROM_THE_SENSOR), closing(-2.0))
    assert own is not None
    assert seen.status is Status.NOT_CLOSING
    assert seen.closing_speed == pytest.approx(-2.0, abs=0.1)


@every_module
def test_a_simulated_bonnet_without_noise(module: Any) -> None:
    same = bonnet(0, noise=0.0)
    answers = drive(module.CloudTracker(FROM_THE_SENSOR), closing(3.0), near=lambda _: same)
    seen, own = answers[-1]
    assert own == pytest.approx(1.0, abs=0.01)
    assert seen.closing_speed == pytest.approx(3.0, abs=0.1)


@every_module
def test_nothing_else_in_the_gate_is_clear_once_the_vehicle_is_known(module: Any) -> None:
    tracker = module.CloudTracker(FROM_THE_SENSOR)
    drive(tracker, closing(3.0))
    for frame in range(30, 36):
        seen = tracker.update(bonnet(frame), frame / 10)
    assert (seen.status, tracker.own_vehicle is None) == (Status.CLEAR, False)


@every_module
def test_what_came_as_near_as_the_bonnet_reaches_is_never_clear_afterwards(module: Any) -> None:
    """A car ahead stops 2 m away, which is less than the tracker looks past; then it drives off."""
    tracker = module.CloudTracker(FROM_THE_SENSOR)
    stopping = lambda frame: max(12.0 - 0.4 * frame, 2.0)  # noqa: E731
    assert {seen.status for seen, _ in drive(tracker, stopping, frames=23)[8:]} == {Status.CLOSING}
    hidden = drive(tracker, stopping, frames=40, begin=23)
    assert tracker.own_vehicle is not None
    assert {seen.status for seen, _ in hidden[2:]} == {Status.LOST}
    drives_off = lambda frame: 2.0 + 0.2 * (frame - 63)  # noqa: E731
    statuses = [seen.status for seen, _ in drive(tracker, drives_off, frames=20, begin=63)]
    assert statuses[-1] is Status.NOT_CLOSING


@every_module
def test_where_nothing_moves_nothing_is_the_vehicle(module: Any) -> None:
    for seen, own in drive(module.CloudTracker(FROM_THE_SENSOR), closing(0.0)):
        assert own is None
        assert seen.distance == pytest.approx(1.0, abs=0.1)


@every_module
def test_a_car_close_ahead_that_comes_closer_is_the_target(module: Any) -> None:
    """At 2.8 m, and 0.2 m/s only, while what is beyond comes closer at 5 m/s."""
    near = lambda frame: tailgate(2.8 - 0.02 * frame, frame + 100)  # noqa: E731
    for seen, own in drive(module.CloudTracker(FROM_THE_SENSOR), closing(5.0, 40.0), near=near)[3:]:
        assert own is None
        assert seen.distance < 2.9
    assert seen.closing_speed == pytest.approx(0.2, abs=0.05)


@every_module
def test_a_car_that_stopped_close_ahead_is_the_target_as_soon_as_it_moves(module: Any) -> None:
    """It keeps its distance while others pass beyond it, as the vehicle itself does; then the gap closes at 1 m/s."""
    near = lambda frame: tailgate(2.5 - max(frame - 30, 0) * 0.1, frame + 100)  # noqa: E731
    answers = drive(module.CloudTracker(FROM_THE_SENSOR), closing(3.0, 30.0), frames=36, near=near)
    as_if_alone = drive(
        module.CloudTracker(Gate.above_road(HEIGHT, x=(0.0, 3.0))), closing(3.0, 30.0), frames=36, near=near
    )
    assert answers[30][1] is not None
    for (seen, own), (alone, _) in zip(answers[33:], as_if_alone[33:], strict=True):
        assert own is None
        assert seen == alone
        assert seen.status is Status.CLOSING


@every_module
def test_something_that_is_suddenly_nearer_than_the_bonnet_is_the_target_at_once(module: Any) -> None:
    tracker = module.CloudTracker(FROM_THE_SENSOR)
    drive(tracker, closing(3.0))
    seen = tracker.update(np.vstack([bonnet(30), tailgate(0.3, 30), tailgate(11.0, 30)]), 3.0)
    assert tracker.own_vehicle is None
    assert (seen.status, seen.distance) == (Status.WARMING_UP, pytest.approx(0.3, abs=0.1))


@every_module
def test_a_car_far_ahead_at_the_same_speed_is_no_vehicle_of_ones_own(module: Any) -> None:
    nothing = lambda frame: np.empty((0, 3))  # noqa: E731
    for seen, own in drive(module.CloudTracker(FROM_THE_SENSOR), closing(0.0, 8.0), near=nothing)[2:]:
        assert own is None
        assert seen.distance == pytest.approx(8.0, abs=0.1)


@every_module
def test_with_the_distance_to_the_bumper_only_what_is_behind_it_is_the_vehicle(module: Any) -> None:
    """A car that stands 0.3 m ahead of the bumper stays the target, whatever moves beyond."""
    tracker = module.CloudTracker(FROM_THE_SENSOR, front_offset=1.5)
    near = lambda frame: tailgate(1.8, frame + 100)  # noqa: E731
    assert all(own is None for _, own in drive(tracker, closing(3.0), near=near))
    *_, (seen, own) = drive(module.CloudTracker(FROM_THE_SENSOR, front_offset=FRONT), closing(3.0))
    assert own == pytest.approx(1.0, abs=0.1)
    assert seen.distance == pytest.approx(20.0 - 3.0 * 2.9 - FRONT, abs=0.1)


@every_module
def test_what_is_known_of_the_vehicle_is_forgotten_and_restored(module: Any) -> None:
    tracker, other = module.CloudTracker(FROM_THE_SENSOR), module.CloudTracker(FROM_THE_SENSOR)
    drive(tracker, closing(3.0))
    other.restore(json.loads(json.dumps(tracker.state())))
    assert other.own_vehicle == tracker.own_vehicle
    assert other.state() == tracker.state()
    assert drive(other, closing(3.0), frames=5, begin=30) == drive(tracker, closing(3.0), frames=5, begin=30)
    tracker.reset()
    assert tracker.own_vehicle is None
    assert tracker.state() == module.CloudTracker(FROM_THE_SENSOR).state()


@every_module
def test_a_frame_that_cannot_be_used_changes_nothing(module: Any) -> None:
    tracker = module.CloudTracker(FROM_THE_SENSOR)
    drive(tracker, closing(3.0))
    before = tracker.state()
    for stamp in (2.9, 1.0, math.nan):
        seen = tracker.update(np.vstack([bonnet(9), tailgate(3.0, 9)]), stamp)
        assert seen.status is Status.INVALID
        assert seen.distance == pytest.approx(20.0 - 3.0 * 2.9, abs=0.1)
    assert tracker.state() == before


@pytest.mark.parametrize(
    "spoil",
    [
        lambda state: state.pop("still"),
        lambda state: state["still"].update(distance=math.nan),
        lambda state: state["still"].update(world_moved=-1.0),
        lambda state: state["still"].update(seen=99.0),
        lambda state: state["beyond"].pop("present"),
    ],
)
def test_no_such_state(spoil: Any) -> None:
    tracker = ttc_fast.CloudTracker(FROM_THE_SENSOR)
    drive(tracker, closing(3.0))
    state = tracker.state()
    spoil(state)
    with pytest.raises(ValueError, match="state"):
        ttc_fast.CloudTracker(FROM_THE_SENSOR).restore(state)


def test_kernel_and_reference_find_the_same_vehicle() -> None:
    speeds = np.random.default_rng(4).uniform(-3, 3, 60)
    ahead = lambda frame: 15.0 + speeds[:frame].sum() / 10  # noqa: E731
    near = lambda frame: bonnet(frame) if frame % 11 else tailgate(0.8, frame)  # noqa: E731
    answers = [
        drive(module.CloudTracker(FROM_THE_SENSOR), ahead, frames=60, near=near) for module in (ttc_fast, reference)
    ]
    assert {own is None for _, own in answers[0]} == {True, False}
    for (kernel, own), (specified, said) in zip(*answers, strict=True):
        assert kernel.status is specified.status
        assert (own is None) == (said is None)
        np.testing.assert_allclose(kernel.distance, specified.distance, rtol=1e-7)
        np.testing.assert_allclose(kernel.closing_speed, specified.closing_speed, rtol=1e-6, atol=1e-9)
