"""The closed loop: the brake as it comes neither crashes nor stops for nothing, broken ones do. And the simulator."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pytest

pytest.importorskip("numba", reason="needs the extra evaluation")

from evaluation.closed_loop import drive as driving
from evaluation.closed_loop.__main__ import kinds, table
from evaluation.closed_loop.drive import (
    OUTLINE,
    Drive,
    Truth,
    braked_from,
    drives,
    true_ttc,
    truth_of,
    with_brake,
    without_brake,
)
from evaluation.closed_loop.scenarios import KINDS, Scenario, scenario
from evaluation.closed_loop.simulator import (
    ANGLES,
    BEAMS,
    BODY,
    RANGE_MAX,
    Brake,
    Mover,
    Plan,
    Pose,
    Scanner,
    World,
    box,
    chain,
    slowed,
    step,
    touch,
)
from ttc_fast import BrakeController, Command, IttcThreshold, SweptPathThreshold

pytestmark = pytest.mark.slow

SEED, RUNS = 3, 4 * len(KINDS)
SETTINGS: dict[str, dict[str, Any]] = {
    "default": {},
    "late": {"criteria": [SweptPathThreshold(0.1)]},
    "never": {"criteria": [SweptPathThreshold(1e-9)], "when_blind": Command.WARN},
    "nervous": {"criteria": [IttcThreshold(1.5)], "trigger": (1, 1)},
}
WALL = chain([[5.0, -3.0], [5.0, 3.0]])
PERFECT = Scanner(noise=0.0, dropouts=0.0, speckle=0.0, latency=0.0)


@lru_cache
def driven() -> dict[str, list[Drive]]:
    """The same drives with every setting."""
    made = [drives(SEED, run, list(SETTINGS.values())) for run in range(RUNS)]
    return dict(zip(SETTINGS, (list(each) for each in zip(*made, strict=True)), strict=True))


class TestBrake:
    def test_the_default_neither_crashes_nor_stops_for_nothing(self) -> None:
        results = driven()["default"]
        assert [each for each in results if each.crashed or each.false_stop] == []

    def test_there_was_something_to_do_in_every_kind(self) -> None:
        results = driven()["default"]
        assert {each.kind for each in results if each.truth.possible} == {kind.__name__ for kind in KINDS}
        assert sum(each.truth.possible for each in results) > RUNS / 4
        assert sum(each.truth.hits == math.inf for each in results) > RUNS / 4
        assert all(each.braked_at < math.inf for each in results if each.truth.possible)

    def test_one_that_never_brakes_always_crashes(self) -> None:
        results = driven()["never"]
        assert all(each.crashed == each.truth.possible for each in results)
        assert not any(each.needless for each in results)

    def test_one_that_brakes_late_crashes(self) -> None:
        assert sum(each.crashed for each in driven()["late"]) > RUNS / 8

    def test_one_that_counts_walls_at_the_side_stops_for_nothing(self) -> None:
        assert sum(each.false_stop for each in driven()["nervous"]) > RUNS / 8

    def test_the_same_seed_gives_the_same_table(self) -> None:
        def rows(seed: int) -> Any:
            results = [drives(seed, run, [{}])[0] for run in range(len(KINDS))]
            return table("", "kind", kinds(results)).markdown(), repr(results)

        once = rows(SEED)
        assert rows(SEED) == once
        assert rows(SEED + 1) != once


class TestTruth:
    @pytest.mark.parametrize("begin", [0.5, 1.5])
    @pytest.mark.parametrize(("room", "hits"), [(-0.1, True), (0.1, False)])
    def test_a_full_brake_prevents_it_where_the_way_is_long_enough(self, begin: float, room: float, hits: bool) -> None:
        speed = 4.0
        stop = speed * begin + speed**2 / (2.0 * Brake().deceleration)
        wall = WALL + np.array([1.0, 0.0, 1.0, 0.0]) * (BODY[1] + stop + room - 5.0)
        assert braked_from(Scenario("", True, World(wall), Plan(speed), PERFECT), begin) is hits

    def test_hits_when_the_bumper_is_there(self) -> None:
        truth = truth_of(Scenario("", True, World(WALL), Plan(4.0), PERFECT))
        assert truth.hits == pytest.approx((5.0 - BODY[1]) / 4.0, abs=PERFECT.period)
        assert truth.possible
        assert truth.nearest < 0.1

    def test_what_is_too_near_is_not_possible_to_prevent(self) -> None:
        near = WALL - np.array([1.0, 0.0, 1.0, 0.0]) * 3.6
        truth = truth_of(Scenario("", True, World(near), Plan(6.0), PERFECT))
        assert truth.hits < math.inf
        assert not truth.possible

    def test_what_no_beam_meets_is_not_seen(self) -> None:
        """Beams 0.75 degrees apart meet the 6 cm of a wall that are in the way at 10.7 m or more, then at 7.6 m."""
        wall = chain([[0.25 + 10.5, 0.14], [0.25 + 10.5, 3.0]])
        hits, foreseen, seen, _ = without_brake(Scenario("", True, World(wall), Plan(4.0), PERFECT))
        assert hits == pytest.approx((10.75 - BODY[1]) / 4.0, abs=PERFECT.period)
        assert foreseen == 0.0
        assert seen == pytest.approx((10.5 - OUTLINE[3] / math.tan(math.radians(1.5))) / 4.0, abs=PERFECT.period)
        truth = truth_of(scenario(1, 2962)[0])
        assert truth.with_perfect_sight
        assert not truth.possible

    @pytest.mark.parametrize("speed", [0.5, -2.0, 6.0])
    def test_time_to_a_wall(self, speed: float) -> None:
        wall = math.copysign(2.0, speed)
        to_go = 2.0 - abs(OUTLINE[1] if speed > 0 else OUTLINE[0])
        seen = true_ttc(chain([[wall, -1.0], [wall, 1.0]]), speed, 0.0, OUTLINE)
        assert seen == (math.inf if to_go / abs(speed) > 3.0 else pytest.approx(to_go / abs(speed), abs=0.041))

    @pytest.mark.parametrize(("nearest", "false"), [(1.3, True), (1.25, True), (1.2, False)])
    def test_a_stop_without_cause_is_false(self, nearest: float, false: bool) -> None:
        def stop(truth: Truth, blind_from: float = math.inf) -> Drive:
            return Drive(0, "straight", truth, False, 1.0, blind_from, "", 1.0)

        assert stop(Truth(math.inf, nearest, False, False)).false_stop is false
        assert not stop(Truth(2.0, nearest, True, True)).false_stop
        assert not stop(Truth(math.inf, nearest, False, False), blind_from=0.8).needless
        assert stop(Truth(math.inf, nearest, False, False), blind_from=1.2).needless


class TestCar:
    @pytest.mark.parametrize("radius", [0.5, 3.0, -2.0])
    def test_a_bend_is_a_circle(self, radius: float) -> None:
        pose, steps = Pose(0.0, 0.0, 0.0, 2.0), 400
        for _ in range(steps):
            pose = step(pose, 1.0 / radius, 2.0, 2.0 * math.pi * abs(radius) / 2.0 / steps)
            assert math.hypot(pose.x, pose.y - radius) == pytest.approx(abs(radius))
        assert (pose.x, pose.y) == pytest.approx((0.0, 0.0), abs=1e-9)
        assert pose.heading == pytest.approx(math.copysign(2.0 * math.pi, radius))

    def test_it_stops_after_half_the_square_of_its_speed_over_the_deceleration(self) -> None:
        pose, speed = Pose(0.0, 0.0, 0.0, -3.0), -3.0
        while pose.speed:
            speed = slowed(speed, 6.0, 0.01)
            pose = step(pose, 0.0, speed, 0.01)
        assert pose.x == pytest.approx(-(3.0**2) / 12.0)

    def test_what_moves_by_itself_brakes_to_a_stop(self) -> None:
        mover = Mover(box(0.0, 0.0, 1.0, 1.0), (3.0, 0.0), brakes_at=1.0, deceleration=6.0)
        where = [float(mover.at(time)[:, 0].mean()) for time in (1.0, 1.25, 9.0)]
        assert where == pytest.approx([3.0, 3.0 + 0.75 - 0.1875, 3.75])

    @pytest.mark.parametrize(
        ("segment", "hit"),
        [
            ([0.0, 0.0, 0.1, 0.1], True),
            ([-5.0, 0.0, 5.0, 0.0], True),  # right through, both ends outside
            ([-5.0, 0.151, 5.0, 0.151], False),
            ([0.3, 0.26, 0.51, 0.05], False),  # past a corner
            ([0.3, 0.24, 0.49, 0.05], True),
        ],
    )
    def test_touch(self, segment: list[float], hit: bool) -> None:
        assert bool(touch(np.array([segment]), BODY)) is hit


class TestScanner:
    RNG_SEED = 5

    def scan(self, scanner: Scanner, segments: Any, time: float = 0.0) -> Any:
        return scanner.scan(time, segments, np.random.default_rng(self.RNG_SEED))

    def many(self, **faults: Any) -> Any:
        rng = np.random.default_rng(self.RNG_SEED)
        scanner = Scanner(mount=(0.0, 0.0, 0.0), **{"noise": 0.0, "dropouts": 0.0, "speckle": 0.0, **faults})
        hall = chain([[-8.0, -8.0], [8.0, -8.0], [8.0, 8.0], [-8.0, 8.0]], closed=True)
        truth = self.scan(Scanner(mount=(0.0, 0.0, 0.0), noise=0.0, dropouts=0.0, speckle=0.0), hall)
        return np.array([scanner.scan(0.0, hall, rng) for _ in range(400)]), truth

    def test_rays_against_a_wall(self) -> None:
        """A wall across at x = 5, of 6 m, and a scanner at x = 0.25 that looks to the left of the axis."""
        ranges = self.scan(Scanner((0.25, 0.0, 0.2), noise=0.0, dropouts=0.0, speckle=0.0), WALL)
        angles = ANGLES + 0.2
        across = np.abs(4.75 * np.tan(angles))
        ahead = (np.cos(angles) > 0) & (across <= 3.0)
        np.testing.assert_allclose(ranges[ahead], 4.75 / np.cos(angles[ahead]), rtol=1e-12)
        assert np.isinf(ranges[~ahead]).all()
        assert 20 < ahead.sum() < BEAMS / 2

    def test_what_is_near_hides_what_is_far(self) -> None:
        scene = np.concatenate([WALL, chain([[2.0, -0.1], [2.0, 0.1]])])
        middle = self.scan(Scanner((0.0, 0.0, 0.0), noise=0.0, dropouts=0.0, speckle=0.0), scene)[BEAMS // 2]
        assert middle == pytest.approx(2.0)

    def test_nothing_is_seen_beyond_its_range(self) -> None:
        assert np.isinf(self.scan(PERFECT, WALL * 10.0)).all()
        assert RANGE_MAX < 50.0

    def test_noise(self) -> None:
        scans, truth = self.many(noise=0.02)
        assert np.std(scans - truth) == pytest.approx(0.02, rel=0.05)
        assert np.mean(scans - truth) == pytest.approx(0.0, abs=5e-4)

    def test_dropouts(self) -> None:
        scans, _ = self.many(dropouts=0.07)
        assert np.mean(np.isnan(scans)) == pytest.approx(0.07, rel=0.05)

    def test_speckle_is_nearer_than_the_truth(self) -> None:
        scans, truth = self.many(speckle=0.01)
        assert np.mean(scans != truth) == pytest.approx(0.01, rel=0.1)
        assert (scans <= truth).all()
        assert np.quantile((scans / truth)[scans != truth], [0.1, 0.9]) == pytest.approx([0.1, 0.9], abs=0.05)

    def test_gone_blind_it_sees_nothing(self) -> None:
        scanner = Scanner(blind_from=1.0)
        assert np.isfinite(self.scan(scanner, WALL, 0.99)).any()
        assert np.isnan(self.scan(scanner, WALL, 1.0)).all()

    def test_faults_are_really_in_the_scenarios(self) -> None:
        scanners = [scenario(1, run)[0].scanner for run in range(200)]
        assert max(each.latency for each in scanners) > 0.025
        assert max(each.noise for each in scanners) > 0.025
        assert max(each.dropouts for each in scanners) > 0.09
        assert {each.speckle for each in scanners} == {0.0, 1e-5, 1e-4}
        assert len({each.latency for each in scanners}) == 200


class TestLoop:
    @pytest.mark.parametrize("latency", [0.0, 0.03, 0.1])
    def test_latency_lies_between_measuring_and_deciding(self, latency: float, monkeypatch: pytest.MonkeyPatch) -> None:
        ages, stamps = [], []

        class Spy(BrakeController):
            def update(self, now: float, **told: Any) -> Any:
                ages.append(now - told["stamp"])
                stamps.append(told["stamp"])
                assert told["motion"].stamp == told["stamp"]
                return super().update(now, **told)

        monkeypatch.setattr(driving, "BrakeController", Spy)
        made = Scenario("", True, World(WALL), Plan(2.0), Scanner(latency=latency))
        with_brake(made, np.random.default_rng(0), {})
        assert min(ages) >= latency - 1e-9
        assert max(ages) <= latency + driving.PHYSICS + 1e-9
        assert np.diff(stamps) == pytest.approx(PERFECT.period)

    def test_the_brake_bites_after_its_delay(self) -> None:
        """What is left is what there was, less the way of the delay and of braking."""
        speed, brake = 2.0, Brake()
        made = Scenario("", True, World(WALL), Plan(speed), PERFECT)
        collided, braked_at, _, reason, left = with_brake(made, np.random.default_rng(0), {})
        assert not collided
        assert reason.startswith("BRAKE (CRITERION)")
        way = speed * (braked_at + brake.delay) + speed**2 / (2.0 * brake.deceleration)
        assert left == pytest.approx(5.0 - BODY[1] - way, abs=speed * driving.PHYSICS + 0.041)

    def test_it_hits_what_it_does_not_see(self) -> None:
        made = Scenario("", True, World(WALL), Plan(4.0), Scanner(dropouts=1.0))
        blind: dict[str, Any] = {"when_blind": Command.WARN}
        assert with_brake(made, np.random.default_rng(0), blind)[0]
        assert not with_brake(made, np.random.default_rng(0), {})[0]

    def test_a_driver_who_goes_on_is_held_before_a_wall_and_let_go_when_it_leaves(self) -> None:
        """He stands behind what crosses, and is on his way again within half a second of its leaving."""
        walker = Mover(chain([[4.0, -0.8], [4.0, 0.8]]), (0.0, 0.4))
        made = Scenario("", True, World(WALL + 40.0, (walker,)), Plan(2.0), PERFECT, duration=6.0, goes_on=True)
        free_at = (0.8 + OUTLINE[3]) / 0.4
        released = []

        class Spy(BrakeController):
            def update(self, now: float, **told: Any) -> Any:
                decision = super().update(now, **told)
                released.append((now, decision.command))
                return decision

        for says_so in (True, False):
            released.clear()
            with pytest.MonkeyPatch.context() as patch:
                patch.setattr(driving, "BrakeController", Spy)
                collided, braked_at, *_ = with_brake(replace(made, says_so=says_so), np.random.default_rng(0), {})
            assert not collided
            assert braked_at < free_at
            held = [now for now, command in released if command is Command.BRAKE]
            assert free_at - 0.1 < max(held) < free_at + 0.5

    def test_a_controller_that_starts_again_on_the_way_stops_all_the_same(self) -> None:
        for at in (0.2, 0.8, 1.2):
            made = Scenario("", True, World(WALL), Plan(2.0), PERFECT, restarts_at=at, goes_on=True)
            collided, braked_at, *_ = with_brake(made, np.random.default_rng(0), {})
            assert not collided
            assert braked_at < math.inf
