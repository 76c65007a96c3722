"""The brake controller: votes, release, standstill, escape, watchdog, latency, state."""

from __future__ import annotations

import math
import pickle
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

from tests.support.common import CAR
from ttc_fast import (
    BrakeController,
    Command,
    Estimate,
    IttcThreshold,
    Motion,
    RangeRate,
    Reason,
    ScanTTC,
    Status,
    StoppingDistance,
    SweptPath,
    SweptPathThreshold,
)
from ttc_fast.brake import Decision, Source

BEAMS = 181
ANGLES = np.linspace(-np.pi / 2, np.pi / 2, BEAMS)
PERIOD = 0.025


def scanner(**settings: Any) -> ScanTTC:
    return ScanTTC(ANGLES[0], ANGLES[1] - ANGLES[0], BEAMS, range_min=0.05, range_max=30.0, **settings)


def wall(distance: float, half_width: float = 0.1, around: float = 20.0) -> np.ndarray[Any, np.dtype[np.float64]]:
    """A board straight ahead, in a wide hall."""
    across = np.abs(distance * np.tan(np.clip(ANGLES, -1.5, 1.5)))
    return np.where(across <= half_width, distance / np.cos(ANGLES), around)


class Drive:
    """A controller and the time."""

    def __init__(self, **settings: Any) -> None:
        settings.setdefault("scan", scanner(outline=CAR))
        self.controller = BrakeController(**settings)
        self.now = 100.0

    def frame(self, distance: float | None, speed: float | None, **more: Any) -> Decision:
        """One more scan: of a board at ``distance``, or of nothing valid."""
        self.now += PERIOD
        ranges = np.full(BEAMS, np.nan) if distance is None else wall(distance)
        ranges[0] += self.now * 1e-6  # no scan is the one before to the bit
        motion = None if speed is None else Motion(speed, stamp=self.now)
        return self.controller.update(self.now, ranges=ranges, stamp=self.now, motion=motion, **more)

    def frames(self, count: int, distance: float | None, speed: float | None, **more: Any) -> Decision:
        for _ in range(count):
            decision = self.frame(distance, speed, **more)
        return decision

    def wait(self, seconds: float) -> Decision:
        """Nothing comes."""
        self.now += seconds
        return self.controller.update(self.now)


class TestTrigger:
    def test_far_away_is_clear(self) -> None:
        decision = Drive().frames(5, 15.0, 4.0)
        assert (decision.command, decision.reason) == (Command.NONE, Reason.CLEAR)
        assert decision.deceleration == 0.0
        assert decision.speed_limit == math.inf

    def test_near_warns_with_the_speed_at_which_it_would_brake(self) -> None:
        decision = Drive(criteria=[SweptPathThreshold(1.5)]).frames(3, 8.4, 4.0)  # 8 m of way: 2 s
        assert (decision.command, decision.reason) == (Command.WARN, Reason.NEAR)
        assert decision.speed_limit == pytest.approx(8.0 / 1.5)

    def test_n_of_m_frames(self) -> None:
        drive = Drive(trigger=(2, 3))
        first, second = drive.frame(2.0, 4.0), drive.frame(1.9, 4.0)
        assert (first.command, first.reason) == (Command.WARN, Reason.VOTING)
        assert (second.command, second.reason) == (Command.BRAKE, Reason.CRITERION)
        assert second.counters.triggered == 2

    def test_one_frame_in_between_does_not_matter(self) -> None:
        drive = Drive(trigger=(2, 3))
        commands = [drive.frame(distance, 4.0).command for distance in (2.0, 15.0, 1.9)]
        assert commands == [Command.WARN, Command.NONE, Command.BRAKE]

    def test_two_frames_in_between_do(self) -> None:
        drive = Drive(trigger=(2, 3))
        commands = [drive.frame(distance, 4.0).command for distance in (2.0, 15.0, 15.0, 1.9)]
        assert commands == [Command.WARN, Command.NONE, Command.NONE, Command.WARN]

    def test_says_why(self) -> None:
        decision = Drive(trigger=(1, 1)).frame(2.4, 4.0)
        assert decision.deceleration == 6.0
        assert decision.speed_limit == 0.0
        assert isinstance(decision.criterion, SweptPathThreshold)
        assert decision.threshold == 1.5
        assert decision.threat is not None
        assert decision.threat.source is Source.PATH
        assert abs(ANGLES[decision.threat.index]) < 0.05
        assert decision.threat.range == pytest.approx(2.4, abs=0.003)
        assert decision.threat.clearance == pytest.approx(2.0)
        assert decision.threat.closing_speed == 4.0
        assert decision.threat.ttc == decision.value == pytest.approx(0.5)
        assert "SweptPathThreshold: 0.50 < 1.5 s" in str(decision)
        assert "at 2.40 m, 2.00 m clear, closing at 4.00 m/s, TTC 0.50 s" in str(decision)

    def test_a_decision_that_rests_on_no_criterion_says_why_in_words(self) -> None:
        drive = Drive(trigger=(1, 1))
        decision = drive.frame(2.4, 4.0)
        later = drive.controller.update(decision.stamp + 5.0)
        assert later.reason is Reason.STALE
        assert str(later).startswith("BRAKE (STALE): the newest sensor data are too old")
        assert "Threshold" not in str(later)

    def test_says_that_a_wall_is_beyond_the_horizon(self) -> None:
        """7.6 m at 1 m/s are 7.6 s, and the path is looked at for 5 s."""
        decision = Drive(trigger=(1, 1)).frame(8.0, 1.0)
        assert decision.status is Status.NOT_CLOSING
        assert str(decision.threat) == "nothing is touched within the horizon"

    def test_stopping_distance_where_a_threshold_is_too_late(self) -> None:
        """At 25 m/s and 5 m/s^2 it takes 64.7 m to stop, and 1.5 s are 37.5 m."""
        fast = [SweptPathThreshold(1.5), StoppingDistance(deceleration=5.0, reaction_time=0.1, margin=0.5)]
        long = ScanTTC(-0.1, 0.001, 201, range_max=100.0, outline=CAR)
        controller = BrakeController(fast, scan=long, trigger=(1, 1))
        ranges = np.full(201, 60.0)
        decision = controller.update(0.0, ranges=ranges, stamp=0.0, motion=Motion(25.0))
        assert decision.command is Command.BRAKE
        assert isinstance(decision.criterion, StoppingDistance)
        assert decision.threshold == pytest.approx(25.0 * 0.1 + 25.0**2 / 10.0 + 0.5)

    def test_walls_beside_do_not_brake_by_path_and_do_by_ittc(self) -> None:
        """Walls at +-1 m beside a car at 5 m/s: the classic rule says 0.36 s."""
        corridor = np.minimum(1.0 / np.maximum(np.abs(np.sin(ANGLES)), 1e-9), 20.0)
        settings: dict[str, Any] = {"ranges": corridor, "stamp": 0.0, "motion": Motion(5.0)}
        by_path = BrakeController(scan=scanner(outline=CAR), trigger=(1, 1))
        assert by_path.update(0.0, **settings).command is Command.NONE
        classic = BrakeController([IttcThreshold(1.5)], scan=scanner(outline=CAR), trigger=(1, 1))
        assert classic.update(0.0, **settings).command is Command.BRAKE


class TestRelease:
    def test_between_the_thresholds_it_goes_on_braking(self) -> None:
        drive = Drive(criteria=[SweptPathThreshold(1.5)], release_at=1.25, hold=0.0)
        drive.frames(3, 2.4, 4.0)
        assert drive.frames(20, 0.4 + 4.0 * 1.7, 4.0).reason is Reason.HOLD
        assert drive.frames(3, 0.4 + 4.0 * 2.0, 4.0).command is not Command.BRAKE

    def test_holds(self) -> None:
        drive = Drive(hold=0.5, release=(1, 1))
        drive.frames(3, 2.4, 4.0)
        assert drive.frames(19, 15.0, 4.0).command is Command.BRAKE
        assert drive.frames(2, 15.0, 4.0).command is Command.NONE

    def test_being_slow_is_not_being_safe(self) -> None:
        """Slowed down to 0.5 m/s, 2 m before the wall, the TTC is 4 s: it would brake at once if it were let go."""
        drive = Drive(hold=0.0)
        drive.frames(3, 2.4, 4.0)
        assert drive.frames(40, 2.4, 0.5).reason is Reason.HOLD

    def test_standstill_is_not_release(self) -> None:
        drive = Drive(hold=0.0)
        drive.frames(3, 2.4, 4.0)
        decision = drive.frames(40, 1.0, 0.0)
        assert (decision.command, decision.reason) == (Command.BRAKE, Reason.STANDSTILL)

    def test_standing_is_standing_whatever_counts_as_such(self) -> None:
        drive = Drive(hold=0.0, standstill_speed=0.0)
        drive.frames(3, 2.4, 4.0)
        assert drive.frames(5, 1.0, 0.0).command is Command.BRAKE

    def test_the_way_was_cleared(self) -> None:
        drive = Drive(hold=0.0)
        drive.frames(3, 2.4, 4.0)
        drive.frames(5, 1.0, 0.0)
        assert drive.frames(5, 15.0, 0.0).command is Command.NONE

    def test_gentler_wishes_are_granted(self) -> None:
        drive = Drive(hold=0.0)
        drive.frames(3, 2.4, 4.0)
        assert drive.frames(5, 2.4, 0.0, commanded=4.0).command is Command.BRAKE
        assert drive.frames(5, 2.4, 0.0, commanded=0.5).command is Command.NONE

    def test_escape_from_contact(self) -> None:
        """Something inside the outline ahead: forward never, back as soon as enough frames agree."""
        drive = Drive(hold=0.0, creep_speed=0.5)  # the scanner does not see the way back
        drive.frames(3, 0.35, 1.0)
        assert drive.frames(10, 0.35, 0.0, commanded=1.0).reason is Reason.STANDSTILL
        decision = drive.frames(5, 0.35, 0.0, commanded=-0.5)
        assert (decision.command, decision.reason) == (Command.NONE, Reason.ESCAPE)
        assert drive.frames(5, 0.35, -0.5).command is Command.NONE

    def test_a_wish_does_not_release_while_the_car_still_slides(self) -> None:
        drive = Drive(hold=0.0)
        drive.frames(3, 2.4, 4.0)
        assert drive.frames(10, 2.0, 3.0, commanded=-1.0).command is Command.BRAKE

    def test_the_driver_takes_over_and_gives_back(self) -> None:
        drive = Drive()
        drive.frames(3, 2.4, 4.0)
        decision = drive.frame(2.4, 4.0, override=True)
        assert (decision.command, decision.reason) == (Command.NONE, Reason.OVERRIDE)
        assert drive.frame(2.4, 4.0).command is Command.BRAKE


class TestWatchdog:
    def test_nothing_has_come_yet(self) -> None:
        decision = Drive().wait(0.0)
        assert (decision.command, decision.reason) == (Command.BRAKE, Reason.WAITING)

    def test_no_more_scans(self) -> None:
        drive = Drive(sensor_timeout=0.3)
        drive.frames(3, 15.0, 4.0)
        assert drive.wait(0.29).command is Command.NONE
        decision = drive.wait(0.02)
        assert (decision.command, decision.reason) == (Command.BRAKE, Reason.STALE)

    def test_it_lets_go_only_after_enough_clear_frames(self) -> None:
        drive = Drive(release=(3, 5), hold=0.0)
        drive.frames(3, 15.0, 4.0)
        drive.wait(1.0)
        assert [drive.frame(15.0, 4.0).command for _ in range(3)] == [Command.BRAKE, Command.BRAKE, Command.NONE]

    @pytest.mark.parametrize("blinded", [None, "few"])
    def test_gone_blind_is_told_within_the_timeout(self, blinded: str | None) -> None:
        drive = Drive(sensor_timeout=0.3, min_returns=20)
        drive.frames(10, 15.0, 4.0)
        went_blind, told = drive.now, None
        for _ in range(20):
            drive.now += PERIOD
            ranges = np.full(BEAMS, np.nan)
            if blinded == "few":
                ranges[:19] = 5.0
            decision = drive.controller.update(
                drive.now, ranges=ranges, stamp=drive.now, motion=Motion(4.0, stamp=drive.now)
            )
            if decision.reason is Reason.BLIND and told is None:
                told = drive.now
        assert told is not None
        assert told - went_blind <= 0.3 + PERIOD
        assert decision.command is Command.BRAKE
        assert decision.counters.blind == 20

    @pytest.mark.parametrize("covered", [0.08, -np.inf])
    @pytest.mark.parametrize("mount", [(-0.05, 0.0, 0.0), (0.3, 0.0, 0.0)])
    def test_a_covered_scanner_is_blind(self, covered: float, mount: tuple[float, float, float]) -> None:
        """Where all that it shows lies inside the outline, in the half that the car leaves, nothing is seen."""
        controller = BrakeController(scan=scanner(outline=CAR, mount=mount))
        for stamp in np.arange(0.0, 1.0, PERIOD).tolist():
            ranges = np.full(BEAMS, covered) + stamp * 1e-6
            decision = controller.update(stamp, ranges=ranges, stamp=stamp, motion=Motion(4.0, stamp=stamp))
        assert (decision.command, decision.reason) == (Command.BRAKE, Reason.BLIND)

    def test_free_space_is_not_blindness(self) -> None:
        drive = Drive()
        for _ in range(40):
            drive.now += PERIOD
            ranges = np.full(BEAMS, np.inf)
            decision = drive.controller.update(drive.now, ranges=ranges, stamp=drive.now, motion=Motion(4.0))
        assert (decision.command, decision.reason) == (Command.NONE, Reason.CLEAR)

    def test_no_odometry(self) -> None:
        drive = Drive(sensor_timeout=0.3)
        assert drive.frame(15.0, None).reason is Reason.NO_MOTION

    def test_odometry_stops(self) -> None:
        drive = Drive(sensor_timeout=0.3, motion_timeout=0.5)
        drive.frames(3, 15.0, 4.0)
        stopped = drive.now
        while (decision := drive.frame(15.0, None)).reason is not Reason.NO_MOTION:
            assert decision.command is Command.NONE
        assert 0.8 - 2 * PERIOD <= drive.now - stopped <= 0.8 + 2 * PERIOD
        assert decision.command is Command.BRAKE

    def test_without_odometry_the_range_rate_serves(self) -> None:
        scan = scanner(outline=CAR)
        drive = Drive(scan=scan, range_rate=RangeRate(scan), hold=0.0)
        distance, brake = 9.0, None
        while distance > 0.5 and brake is None:
            decision = drive.frame(distance, None)
            distance -= 4.0 * PERIOD
            if decision.reason is Reason.CRITERION:
                brake = decision
        assert brake is not None
        assert brake.threat is not None
        assert brake.threat.source is Source.RANGE_RATE
        assert brake.threat.closing_speed == pytest.approx(4.0, rel=0.1)

    def test_warning_instead(self) -> None:
        decision = Drive(when_blind=Command.WARN).wait(0.0)
        assert (decision.command, decision.reason) == (Command.WARN, Reason.WAITING)


class TestTime:
    def test_the_age_of_the_data_is_taken_off(self) -> None:
        controller = BrakeController(scan=scanner(outline=CAR))
        decision = controller.update(10.1, ranges=wall(8.4), stamp=10.0, motion=Motion(4.0))
        assert decision.threat is not None
        assert decision.threat.age == pytest.approx(0.1)
        assert decision.threat.ttc == pytest.approx(1.9)
        assert decision.threat.clearance == pytest.approx(7.6)

    def test_each_beam_has_its_own_age(self) -> None:
        controller = BrakeController(scan=scanner(outline=CAR), time_increment=0.0005)
        decision = controller.update(10.1, ranges=wall(8.4), stamp=10.0, motion=Motion(4.0))
        assert decision.threat is not None
        assert decision.threat.age == pytest.approx(0.1 - decision.threat.index * 0.0005)

    @pytest.mark.parametrize("stamp", [9.9, 10.0, 10.5])
    def test_repeated_reordered_and_future_frames_are_ignored(self, stamp: float) -> None:
        controller = BrakeController(scan=scanner(outline=CAR), trigger=(1, 1))
        before = controller.update(10.0, ranges=wall(15.0), stamp=10.0, motion=Motion(4.0))
        after = controller.update(10.02, ranges=wall(1.0), stamp=stamp, motion=Motion(4.0))
        assert after.command is Command.NONE
        assert after.threat == before.threat
        assert (after.counters.frames, after.counters.ignored) == (1, 1)

    def test_large_stamps(self) -> None:
        here, there = Drive(), Drive()
        there.now += 1.7e9
        for distance in (9.0, 6.0, 3.0, 2.0):
            assert here.frame(distance, 4.0).command is there.frame(distance, 4.0).command


class TestSecondOpinion:
    def test_it_may_brake_for_what_moves_by_itself(self) -> None:
        drive = Drive(trigger=(1, 1))
        oncoming = Estimate(drive.now + PERIOD, ttc=0.5, ttc_interval=(0.4, 0.6), distance=4.0, closing_speed=8.0)
        decision = drive.frame(15.0, 2.0, estimate=oncoming)
        assert decision.command is Command.BRAKE
        assert decision.threat is not None
        assert decision.threat.source is Source.ESTIMATE

    def test_one_that_is_not_sure_does_not(self) -> None:
        drive = Drive(trigger=(1, 1))
        unsure = Estimate(drive.now, ttc=0.5, ttc_interval=(0.1, math.inf), distance=4.0, closing_speed=8.0)
        assert drive.frame(15.0, 2.0, estimate=unsure).command is not Command.BRAKE

    def test_it_takes_no_brake_away(self) -> None:
        drive = Drive(trigger=(1, 1))
        calm = Estimate(drive.now, ttc=math.inf, distance=50.0, closing_speed=-1.0)
        assert drive.frame(2.0, 4.0, estimate=calm).command is Command.BRAKE


def test_estimates_alone() -> None:
    """A tracker of distances, or a camera, and nothing else."""
    controller = BrakeController(trigger=(2, 3))
    distances = [10.0, 9.0, 8.0, 7.0, 6.0]
    frames = [Estimate(0.1 * index, each / 10.0, None, each, 10.0) for index, each in enumerate(distances)]
    decisions = [controller.update(estimate.stamp, estimate=estimate) for estimate in frames]
    assert [decision.command for decision in decisions[:2]] == [Command.WARN, Command.BRAKE]
    assert decisions[-1].counters.frames == 5
    assert controller.update(1.0).reason is Reason.STALE


def test_points() -> None:
    controller = BrakeController(path=SweptPath(CAR), trigger=(1, 1))
    points = np.array([[2.4, 0.0, 0.1], [1.0, 2.0, 0.1]])
    decision = controller.update(0.0, points=points, stamp=0.0, motion=Motion(4.0))
    assert decision.command is Command.BRAKE
    assert decision.threat is not None
    assert decision.threat.index == 0
    assert decision.threat.ttc == pytest.approx(0.5)


class TestStatusOfTheFrame:
    """What a decision says of the frame that came with the update."""

    def test_a_frame_that_is_evaluated(self) -> None:
        decision = Drive().frame(2.4, 4.0)
        assert decision.status is Status.CLOSING
        assert decision.threats is not None
        assert decision.threats.path == decision.threat
        assert decision.threats.returns == BEAMS
        assert decision.threats.beams is None  # no criterion needs it

    def test_between_frames_there_is_none(self) -> None:
        drive = Drive()
        before = drive.frame(2.4, 4.0)
        decision = drive.wait(0.1)
        assert (decision.status, decision.threats) == (None, None)
        assert decision.threat == before.threat
        assert drive.wait(5.0).status is None

    @pytest.mark.parametrize("min_returns", [0, BEAMS + 1])
    def test_a_blind_frame(self, min_returns: int) -> None:
        drive = Drive(min_returns=min_returns)
        decision = drive.frame(2.4 if min_returns else None, 4.0)
        assert (decision.status, decision.threats) == (Status.NO_DATA, None)
        assert decision.threat is None

    def test_a_frame_that_is_ignored(self) -> None:
        drive = Drive()
        drive.frame(15.0, 4.0)
        decision = drive.controller.update(drive.now, ranges=wall(2.0), stamp=drive.now, motion=Motion(4.0))
        assert (decision.status, decision.threats) == (Status.INVALID, None)

    def test_a_frame_whose_closing_speeds_are_not_known(self) -> None:
        scan = scanner(outline=CAR)
        for drive in (Drive(), Drive(scan=scan, range_rate=RangeRate(scan))):
            decision = drive.frame(2.4, None)
            assert (decision.status, decision.threats) == (Status.WARMING_UP, None)

    def test_contact_by_the_motion_whatever_is_commanded(self) -> None:
        decision = Drive().frame(0.2, -1.0, commanded=1.0)
        assert decision.status is Status.CONTACT
        assert decision.threats is not None
        assert decision.threats.path is not None
        assert decision.threats.path.ttc == math.inf
        assert decision.threat is not None
        assert decision.threat.ttc == 0.0

    def test_an_estimate_that_is_the_frame(self) -> None:
        controller = BrakeController()
        for stamp, status in enumerate((Status.CLOSING, Status.CONTACT, Status.LOST)):
            decision = controller.update(stamp, estimate=Estimate(stamp, 3.0, distance=9.0, status=status))
            assert decision.status is status
        decision = controller.update(9.0, estimate=Estimate(9.0, math.inf, status=Status.NO_DATA))
        assert (decision.status, decision.threats) == (Status.NO_DATA, None)


class TestState:
    def drive(self, controller: BrakeController, begin: int, end: int) -> list[Decision]:
        rng = np.random.default_rng(7)
        frames = [(float(rng.uniform(0.5, 12.0)), float(rng.uniform(-1.0, 5.0))) for _ in range(end)]
        decisions = []
        for index in range(begin, end):
            distance, speed = frames[index]
            now = index * PERIOD
            moving = Motion(speed, stamp=now) if index % 7 else None
            decisions.append(controller.update(now, ranges=wall(distance), stamp=now, motion=moving))
        return decisions

    def make(self) -> BrakeController:
        scan = scanner(outline=CAR)
        return BrakeController(scan=scan, range_rate=RangeRate(scan), hold=0.1)

    def test_the_same_inputs_give_the_same_bits(self) -> None:
        assert repr(self.drive(self.make(), 0, 200)) == repr(self.drive(self.make(), 0, 200))

    @pytest.mark.parametrize("how", ["state", "pickle"])
    def test_saved_and_restored_it_goes_on_the_same(self, how: str) -> None:
        original = self.make()
        self.drive(original, 0, 100)
        if how == "pickle":
            copy = pickle.loads(pickle.dumps(original))
        else:
            copy = self.make()
            copy.restore(pickle.loads(pickle.dumps(original.state())))
        assert repr(self.drive(copy, 100, 200)) == repr(self.drive(original, 100, 200))

    def test_a_reset_controller_decides_as_a_new_one(self) -> None:
        controller = self.make()
        self.drive(controller, 0, 50)
        controller.reset()
        assert repr(self.drive(controller, 0, 50)) == repr(self.drive(self.make(), 0, 50))

    def test_a_pickled_controller_has_its_criteria_and_settings(self) -> None:
        controller = BrakeController([SweptPathThreshold(0.7)], scan=scanner(outline=CAR), hold=0.1)
        copied = pickle.loads(pickle.dumps(controller))
        assert (copied.criteria, copied.settings) == (controller.criteria, controller.settings)
        assert (copied.criteria, copied.settings.hold) == ((SweptPathThreshold(0.7),), 0.1)

    @pytest.mark.parametrize("state", [None, 3, []])
    def test_what_is_no_state_is_refused(self, state: Any) -> None:
        with pytest.raises(TypeError, match="state must be a dict"):
            self.make().restore(state)

    @pytest.mark.parametrize(
        ("change", "says"),
        [
            ({"class": "RangeRate"}, "state must be of class BrakeController, got RangeRate"),
            ({"version": 1}, "state must be of version 4, got 1"),
            ({"range_rate": None}, "range_rate"),
        ],
    )
    def test_other_states_are_refused(self, change: dict[str, Any], says: str) -> None:
        controller = self.make()
        self.drive(controller, 0, 20)
        before = repr(controller.state())
        with pytest.raises(ValueError, match=says):
            controller.restore({**controller.state(), **change})
        with pytest.raises(ValueError, match="state has no brake"):
            controller.restore({name: value for name, value in controller.state().items() if name != "brake"})
        assert repr(controller.state()) == before

    def test_several_threads_may_update(self) -> None:
        controller, frames = self.make(), iter(range(400))

        def work(_: int) -> None:
            for _ in range(100):
                now = 0.001 * next(frames)
                controller.update(now, ranges=wall(5.0), stamp=now, motion=Motion(1.0))

        with ThreadPoolExecutor(4) as pool:
            list(pool.map(work, range(4)))
        counters = controller.update(1.0).counters
        assert counters.frames + counters.ignored == 400

    def test_an_update_that_raises_changes_nothing(self) -> None:
        controller = self.make()
        self.drive(controller, 0, 20)
        before = repr(controller.state())
        wrong: list[dict[str, Any]] = [
            {"ranges": wall(5.0)[:-1], "stamp": 1.0},
            {"ranges": wall(5.0)},
            {"ranges": wall(5.0), "stamp": 1.0, "commanded": math.nan},
            {"estimate": "soon"},
        ]
        for arguments in wrong:
            with pytest.raises((TypeError, ValueError)):
                controller.update(1.0, motion=Motion(3.0), **arguments)
            assert repr(controller.state()) == before

    def test_a_state_is_a_copy(self) -> None:
        controller = self.make()
        state = controller.state()
        self.drive(controller, 0, 50)
        controller.restore(state)
        assert repr(self.drive(controller, 0, 50)) == repr(self.drive(self.make(), 0, 50))


@pytest.mark.parametrize(
    ("settings", "error", "says"),
    [
        ({"trigger": (3, 2)}, ValueError, "trigger"),
        ({"trigger": 2}, TypeError, "trigger"),
        ({"trigger": (1.5, 2.5)}, ValueError, "trigger"),
        ({"trigger": (0.75, 61.0)}, ValueError, "trigger"),
        ({"trigger": (0.0, 0.1)}, ValueError, "trigger"),
        ({"creep_speed": -1.0}, ValueError, "creep_speed"),
        ({"views": [3]}, TypeError, "views must be ScanTTC objects, got int"),
        ({"views": [scanner(outline=CAR)]}, ValueError, "views need a path"),
        ({"min_returns": 2.5}, TypeError, "min_returns must be a whole number"),
        ({"min_returns": -1}, ValueError, "min_returns must be at least 0"),
        ({"release": (0, 1)}, ValueError, "release"),
        ({"warn_at": 0.9}, ValueError, "warn_at"),
        ({"release_at": 0.5}, ValueError, "release_at"),
        ({"hold": -1.0}, ValueError, "hold"),
        ({"deceleration": 0.0}, ValueError, "deceleration"),
        ({"sensor_timeout": math.nan}, ValueError, "sensor_timeout"),
        ({"motion_timeout": "1 s"}, TypeError, "motion_timeout"),
        ({"when_blind": Command.NONE}, ValueError, "blind is not safe"),
        ({"criteria": []}, ValueError, "criteria"),
        ({"criteria": 1.5}, TypeError, "criteria"),
        ({"criteria": [1.5]}, TypeError, "criteria"),
        ({"criteria": [IttcThreshold]}, TypeError, r"criteria must be objects, such as IttcThreshold\(\)"),
        ({"scan": None, "criteria": [IttcThreshold()]}, ValueError, "needs a scan"),
        ({"scan": scanner(), "criteria": [SweptPathThreshold()]}, ValueError, "outline"),
        ({"scan": "scan"}, TypeError, "scan"),
        ({"time_increment": math.inf}, ValueError, "time_increment"),
        ({"time_increment": -1e-5}, ValueError, "time_increment must be from 0 to 1 s"),
        ({"time_increment": 27_777.0}, ValueError, "time_increment must be from 0 to 1 s"),
        ({"horizon": -1.0}, ValueError, "horizon"),
    ],
)
def test_settings_are_refused_with_the_reason(settings: dict[str, Any], error: type[Exception], says: str) -> None:
    with pytest.raises(error, match=says):
        BrakeController(**{"scan": scanner(outline=CAR), **settings})


@pytest.mark.parametrize(
    ("arguments", "error", "says"),
    [
        ({"now": math.nan}, ValueError, "now"),
        ({"now": None}, TypeError, "now"),
        ({"now": 0.0, "ranges": wall(5.0)}, TypeError, "stamp"),
        ({"now": 0.0, "ranges": wall(5.0), "stamp": math.nan}, ValueError, "stamp"),
        ({"now": 0.0, "motion": Motion(math.nan)}, ValueError, "motion.speed"),
        ({"now": 0.0, "ranges": wall(5.0)[:9], "stamp": 0.0, "motion": Motion(1.0)}, ValueError, "ranges"),
        ({"now": 0.0, "points": np.ones((3, 3)), "stamp": 0.0, "motion": Motion(1.0)}, ValueError, "points"),
        (
            {"now": 0.0, "ranges": wall(5.0)[None].repeat(2, 0), "stamp": 0.0},
            ValueError,
            r"ranges must be one scan, .*\(2, 181\)",
        ),
        (
            {"now": 0.0, "ranges": wall(5.0)[None], "stamp": 0.0, "motion": Motion(1.0)},
            ValueError,
            "ranges must be one scan",
        ),
        (
            {"now": 0.0, "ranges": [wall(5.0).tolist()], "stamp": 0.0, "motion": Motion(1.0)},
            ValueError,
            r"ranges must be one scan, .*\(1, 181\)",
        ),
        (
            {"now": 0.0, "ranges": wall(5.0), "points": np.ones((3, 3)), "stamp": 0.0},
            ValueError,
            "ranges or points, not both",
        ),
        ({"now": 0.0, "motion": 4.0}, TypeError, r"motion must be a Motion, such as Motion\(4\.0\), got 4\.0"),
        ({"now": 0.0, "motion": Motion("4")}, TypeError, "motion.speed must be a number"),  # type: ignore[arg-type]
        ({"now": 0.0, "motion": Motion(1.0, stamp=math.nan)}, ValueError, "motion.stamp must be finite"),
        ({"now": 0.0, "motion": Motion(1e300)}, ValueError, "motion.speed must be below that of light, .*, got 1e.300"),
        ({"now": 0.0, "motion": Motion(1.0, -1e300)}, ValueError, "motion.yaw_rate must be below that of light"),
        ({"now": 0.0, "commanded": 1e300}, ValueError, "commanded.speed must be below that of light"),
        ({"now": 0.0, "commanded": math.nan}, ValueError, "commanded must be finite"),
        ({"now": 0.0, "commanded": Motion(1.0, math.nan)}, ValueError, "commanded.yaw_rate must be finite"),
        ({"now": 0.0, "override": "no"}, TypeError, "override must be True or False, got 'no'"),
    ],
)
def test_inputs_are_refused_with_the_reason(arguments: dict[str, Any], error: type[Exception], says: str) -> None:
    with pytest.raises(error, match=says):
        BrakeController(scan=scanner(outline=CAR)).update(**arguments)


def test_points_are_one_cloud() -> None:
    controller = BrakeController(path=SweptPath(CAR))
    for points in (np.ones((2, 5, 3)), (np.ones((2, 5)), np.ones((2, 5)))):
        with pytest.raises(ValueError, match="points must be one cloud"):
            controller.update(0.0, points=points, stamp=0.0, motion=Motion(1.0))


def test_a_frame_that_is_refused_does_not_count() -> None:
    """The same one, put right, is judged."""
    controller = BrakeController(scan=scanner(outline=CAR), trigger=(1, 1))
    with pytest.raises(ValueError, match="ranges"):
        controller.update(0.0, ranges=wall(2.0)[:-1], stamp=0.0, motion=Motion(4.0))
    decision = controller.update(0.0, ranges=wall(2.0), stamp=0.0, motion=Motion(4.0))
    assert (decision.reason, decision.counters.frames) == (Reason.CRITERION, 1)


def test_numbers_of_numpy_serve_as_well() -> None:
    """As they come out of arrays of settings and of odometry."""
    settings: dict[str, Any] = {"trigger": np.array([1, 1]), "min_returns": np.int64(3), "hold": np.float32(0.0)}
    motion: list[Any] = [np.float32(4.0), np.float64(0.0)]
    frame: dict[str, Any] = {"ranges": wall(2.0), "stamp": np.float32(0.0), "override": np.bool_(False)}
    controller = BrakeController(scan=scanner(), **settings)
    decision = controller.update(np.float64(0.0), motion=Motion(*motion), **frame)
    assert decision.command is Command.BRAKE


def test_what_is_measured_later_than_handed_over_is_not_further_away() -> None:
    """A stamp a little ahead of this clock, and beams that would be measured only after the scan came."""
    for time_increment, ahead in ((0.0, 0.09), (0.005, 0.0)):
        controller = BrakeController([IttcThreshold(1.5)], scan=scanner(), time_increment=time_increment)
        decision = controller.update(1.0, ranges=wall(8.0), stamp=1.0 + ahead, motion=Motion(4.0))
        assert decision.value == pytest.approx(2.0, abs=1e-3)


def test_a_clock_that_is_set_back_is_never_safe() -> None:
    scan = ScanTTC(-1.5, 0.01, 301, range_max=30.0, outline=CAR)
    controller = BrakeController(scan=scan)
    clear, wall = np.full(301, 20.0, np.float32), np.full(301, 0.9, np.float32)
    for frame in range(10):
        stamp = 100.0 + 0.025 * frame
        assert controller.update(stamp, ranges=clear, stamp=stamp, motion=Motion(4.0)).reason is Reason.CLEAR
    for frame in range(10):
        stamp = 99.0 + 0.025 * frame
        decision = controller.update(stamp, ranges=wall, stamp=stamp, motion=Motion(4.0))
        assert (decision.command, decision.reason) == (Command.BRAKE, Reason.STALE)


class TestReleaseLooksAtNow:
    """A brake is let go in a frame that is itself clear, and for the fastest motion that it was braked from."""

    def test_votes_of_older_frames_let_nothing_go_that_the_newest_shows(self) -> None:
        drive = Drive()
        drive.frames(4, 1.1, 4.0)
        drive.frames(18, 9.0, 0.0, commanded=3.0)  # it stands, the way is free, and the hold time passes
        for _ in range(4):
            decision = drive.frame(1.1, 0.0, commanded=3.0)  # something steps in again
            assert decision.command is Command.BRAKE

    def test_a_start_in_motion_is_held_before_the_wall(self) -> None:
        for waits_first in (False, True):
            drive, distance, speed = Drive(), 3.4, 4.0
            if waits_first:
                drive.controller.update(drive.now)  # the watchdog looks before anything has come
            for _ in range(120):
                distance -= speed * PERIOD
                decision = drive.frame(max(distance, 0.45), speed)
                speed = max(speed - 6.0 * PERIOD, 0.0) if decision.command is Command.BRAKE else speed
            assert (decision.command, decision.reason) == (Command.BRAKE, Reason.STANDSTILL)

    def test_an_estimate_takes_no_brake_away_over_time(self) -> None:
        for estimate in (None, Estimate(100.0, 0.5, distance=0.1, closing_speed=0.3)):
            drive = Drive(trigger=(1, 1))
            drive.frame(9.0, 0.3, estimate=estimate)
            for frame in range(80):  # the driver overrides at first; then it stands before the wall
                decision = drive.frame(1.4, 4.0 if frame < 10 else 0.0, override=frame < 5)
            assert decision.command is Command.BRAKE
