"""What the node does, whatever is around its core: every test runs against the core and through each adapter."""

from __future__ import annotations

import itertools
import math
import tracemalloc
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.support.common import CAR
from tests.support.dds_harness import DdsHarness
from tests.support.ros_harness import AT_ONCE, BEAMS, GEOMETRY, RclpyHarness, RospyHarness, Seen
from ttc_fast import Command
from ttc_fast.ros.core import BrakeNode
from ttc_fast.ros.settings import NodeSettings, SettingError, parameters_of_node
from ttc_fast.ros_messages import Commanded

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    Make = Callable[..., Any]

OUTLINE = list(CAR)
PERIOD = 0.025
SCANS = itertools.count()
AHEAD = BEAMS // 2
OK, WARN, ERROR, STALE = range(4)


def hall(distance: float = math.inf, beam: int = AHEAD) -> np.ndarray[Any, np.dtype[np.float32]]:
    """A wide hall, 25 m in each direction, with something in one; no scan is measured like another."""
    ranges = np.full(BEAMS, 25.0, np.float32)
    ranges[BEAMS - 1] -= 1e-3 * next(SCANS)
    ranges[beam] = min(distance, 25.0)
    return ranges


def frame(node: Any, distance: float = math.inf, speed: float | None = 4.0, **more: Any) -> Seen:
    """One more frame: odometry, and a scan with something ahead."""
    node.now += PERIOD
    if speed is not None:
        node.odometry(speed)
    seen = node.scan(hall(distance), **more)
    assert isinstance(seen, Seen)
    return seen


class TestDriving:
    def test_nothing_near_is_no_brake_and_silence(self, make: Make) -> None:
        assert frame(make()) == (False, None, None)

    def test_brakes_with_zero_throttle(self, make: Make) -> None:
        assert frame(make(), 5.0) == (True, 0.0, 6.0)

    def test_brakes_with_the_deceleration_set(self, make: Make) -> None:
        assert frame(make(deceleration=4.5), 5.0) == (True, 0.0, 4.5)

    @pytest.mark.parametrize(("speed", "asked"), [(4.0, 0.5), (0.25, 0.25)])
    def test_brakes_to_a_reduced_speed(self, make: Make, speed: float, asked: float) -> None:
        assert frame(make(brake_speed=0.5), 0.1, speed) == (True, asked, 6.0)

    def test_a_reduced_speed_keeps_its_direction(self, make: Make) -> None:
        node = make(brake_speed=0.5)
        node.odometry(-4.0)
        assert node.scan(hall(3.0), angle_min=GEOMETRY["angle_min"] + math.pi) == (True, -0.5, 6.0)

    def test_blind_it_does_not_go_on_at_a_reduced_speed(self, make: Make) -> None:
        node = make(brake_speed=0.5)
        frame(node)
        assert node.wait(1.0) == (True, 0.0, 6.0)

    def test_drive_always_repeats_the_speed_when_clear(self, make: Make) -> None:
        assert frame(make(drive_always=True)) == (False, 4.0, 0.0)

    def test_drive_always_limits_it_when_near(self, make: Make) -> None:
        """5 m ahead are 1.5 s at 3.33 m/s: no more is allowed while the votes are still out."""
        brake, speed, acceleration = frame(make(drive_always=True, trigger=[2, 2]), 5.0)
        assert (brake, acceleration) == (False, 0.0)
        assert speed == pytest.approx(5.0 / 1.5)

    def test_drive_always_brakes_all_the_same(self, make: Make) -> None:
        assert frame(make(drive_always=True), 5.0) == (True, 0.0, 6.0)


class TestThreshold:
    @pytest.mark.parametrize(("threshold", "brakes"), [(1.2, False), (1.3, True)])
    def test_brakes_below_it(self, make: Make, threshold: float, brakes: bool) -> None:
        assert frame(make(ttc_threshold=threshold), 5.0).brake is brakes  # 1.25 s

    def test_reversing_is_the_other_way(self, make: Make) -> None:
        assert frame(make(), 5.0, -4.0).brake is False

    @pytest.mark.parametrize("both", [False, True])
    def test_stopping_distance_brakes_fast_cars_earlier(self, make: Make, both: bool) -> None:
        """At 20 m/s and 6 m/s^2 it takes more than 33 m to stop; 25 m are 1.25 s."""
        assert frame(make(stopping_distance=both, ttc_threshold=0.5), 24.0, 20.0).brake is both

    def test_a_wall_at_the_side_brakes_by_ittc_and_not_along_the_way(self, make: Make) -> None:
        beside = hall(0.9, beam=AHEAD + 40)
        for settings, brakes in (
            ({}, True),
            ({"outline": OUTLINE}, False),
            ({"outline": OUTLINE, "criterion": "ittc"}, True),
        ):
            node = make(**settings)
            node.odometry(4.0)
            assert node.scan(beside).brake is brakes

    def test_the_way_bends_with_the_yaw_rate(self, make: Make) -> None:
        node = make(outline=OUTLINE)
        node.odometry(4.0)
        assert node.scan(hall(3.0, beam=AHEAD + 30)).brake is False
        node.now += PERIOD
        node.odometry(4.0, yaw_rate=8.0 * math.sin(math.radians(30)) / 3.0)  # a circle through it
        assert node.scan(hall(3.0, beam=AHEAD + 30)).brake is True

    def test_mount_turns_the_scanner(self, make: Make) -> None:
        node = make(mount=[0.2, 0.0, math.pi / 2])
        node.odometry(4.0)
        assert node.scan(hall(2.0)).brake is False
        node.now += PERIOD
        assert node.scan(hall(2.0, beam=AHEAD - 90)).brake is True


class TestValidity:
    def test_beyond_max_range_is_beyond_the_horizon(self, make: Make) -> None:
        assert frame(make(max_range=3.0), 5.0).brake is False

    def test_below_min_range_is_nearer_still(self, make: Make) -> None:
        assert frame(make(min_range=2.0), 1.0, 0.75).brake is True

    def test_clamped_literally(self, make: Make) -> None:
        """25 m become 10 m, which at 7 m/s are 1.43 s; 1 m becomes 2 m, which at 0.75 m/s are 2.7 s."""
        assert frame(make(max_range=10.0, limits_policy="clamp"), speed=7.0).brake is True
        assert frame(make(max_range=10.0), speed=7.0).brake is False
        assert frame(make(min_range=2.0, limits_policy="clamp"), 1.0, 0.75).brake is False

    @pytest.mark.parametrize("nothing", [math.nan, 0.01, 31.0])
    def test_what_is_no_reading_is_none(self, make: Make, nothing: float) -> None:
        node = make()
        ranges = hall()
        ranges[AHEAD] = nothing
        node.odometry(4.0)
        assert node.scan(ranges).brake is False

    def test_nearer_than_the_sensor_can_tell_is_a_hit(self, make: Make) -> None:
        assert frame(make(), -math.inf).brake is True

    def test_free_space_is_seen(self, make: Make) -> None:
        node = make()
        for _ in range(40):
            node.now += PERIOD
            node.odometry(4.0)
            assert node.scan(np.full(BEAMS, np.inf)).brake is False

    def test_a_blind_sensor_brakes_in_time(self, make: Make) -> None:
        node = make(sensor_timeout=0.21)  # between two frames
        frame(node)
        brakes = []
        for _ in range(12):
            node.now += PERIOD
            node.odometry(4.0)
            brakes.append(node.scan(np.full(BEAMS, np.nan)).brake)
        assert brakes == [False] * 8 + [True] * 4
        assert "BLIND" in node.diagnostics().message

    def test_min_returns(self, make: Make) -> None:
        node = make(min_returns=BEAMS + 1, sensor_timeout=0.2)
        for _ in range(12):
            seen = frame(node)
        assert seen.brake is True
        assert node.diagnostics().values["reason"] == "BLIND"

    def test_the_geometry_may_change(self, make: Make) -> None:
        node = make()
        assert frame(node, 20.0).brake is False
        node.now += PERIOD
        half = {"angle_increment": 2 * GEOMETRY["angle_increment"]}
        assert node.scan(hall(5.0)[::2], **half).brake is True
        node.now += PERIOD
        assert node.scan(np.full(BEAMS, 20.0)).brake is False

    def test_it_goes_on_braking_when_the_geometry_changes(self, make: Make) -> None:
        node = make(hold=0.5)
        frame(node, 2.0)
        node.now += PERIOD
        assert node.scan(np.full(91, 25.0), angle_increment=2 * GEOMETRY["angle_increment"]).brake is True


class TestVotes:
    def test_n_of_m(self, make: Make) -> None:
        node = make(trigger=[2, 3])
        assert [frame(node, distance).brake for distance in (5.0, 25.0, 5.0)] == [False, False, True]

    def test_hold_and_release(self, make: Make) -> None:
        node = make(hold=4.5 * PERIOD, release=[2, 2])
        frame(node, 5.0)
        assert [frame(node).brake for _ in range(6)] == [True] * 4 + [False] * 2

    def test_release_at(self, make: Make) -> None:
        """1.75 s is above 1.5 s, and below 1.25 times that."""
        for factor, brakes in ((1.25, True), (1.0, False)):
            node = make(release_at=factor)
            frame(node, 5.0)
            assert frame(node, 7.0).brake is brakes

    def test_warn_at(self, make: Make) -> None:
        for factor, level in ((1.5, WARN), (1.1, OK)):
            node = make(warn_at=factor)
            frame(node, 7.0)
            assert node.diagnostics().level == level

    def test_a_standing_car_stays_braked(self, make: Make) -> None:
        node = make()
        frame(node, 2.0)
        assert frame(node, 1.0, speed=0.0).brake is True
        assert frame(node, 1.0, speed=0.04).brake is True  # as good as standing
        assert "STANDSTILL" in node.diagnostics().message
        assert frame(node, speed=0.0).brake is False  # the way is free


class TestWatchdog:
    def test_nothing_ever_came(self, make: Make) -> None:
        node = make()
        assert node.wait(0.0) == (True, 0.0, 6.0)
        status = node.diagnostics()
        assert status.level == ERROR
        assert status.values["reason"] == "WAITING"

    def test_scans_that_stop_and_come_again(self, make: Make) -> None:
        node = make(hold=0.09)
        frame(node)
        assert node.wait(0.2).brake is False
        assert node.wait(0.2).brake is True
        status = node.diagnostics()
        assert status.level == ERROR
        assert status.values["reason"] == "STALE"
        assert [frame(node).brake for _ in range(5)] == [True] * 3 + [False] * 2

    def test_sensor_timeout(self, make: Make) -> None:
        node = make(sensor_timeout=1.0)
        frame(node)
        assert node.wait(0.9).brake is False
        assert node.wait(0.2).brake is True

    def test_odometry_that_stops_and_comes_again(self, make: Make) -> None:
        node = make(sensor_timeout=0.1)
        frame(node)
        brakes = [frame(node, speed=None).brake for _ in range(26)]
        assert brakes[:20] == [False] * 20  # 0.5 s
        assert brakes[25] is True
        assert node.diagnostics().values["reason"] == "NO_MOTION"
        assert frame(node).brake is False

    def test_motion_timeout(self, make: Make) -> None:
        node = make(sensor_timeout=0.1, motion_timeout=0.2)
        frame(node)
        assert [frame(node, speed=None).brake for _ in range(14)][-1] is True

    def test_either_odometry_topic_serves(self, make: Make) -> None:
        node = make()
        node.odometry(4.0, topic="/vesc/odom")
        assert node.scan(hall(5.0)).brake is True

    def test_when_blind_warn(self, make: Make) -> None:
        node = make(when_blind="warn")
        assert node.wait(0.0).brake is False
        assert node.diagnostics().level == ERROR

    def test_without_odometry_by_range_rate(self, make: Make) -> None:
        """The whole hall comes nearer, at 4 m/s."""
        node = make(use_range_rate=True)
        brakes = []
        for step in range(60):
            node.now += PERIOD
            brakes.append(node.scan(np.full(BEAMS, 14.0 - 4.0 * PERIOD * step)).brake)
        assert not any(brakes[5:40])
        assert not math.isinf(float(node.diagnostics().values["ttc"].split()[0]))
        assert node.diagnostics().values["source"] == "RANGE_RATE"
        brakes += [node.scan(np.full(BEAMS, 8.0)).brake]
        for step in range(60, 100):
            node.now += PERIOD
            brakes.append(node.scan(np.full(BEAMS, 14.0 - 4.0 * PERIOD * step)).brake)
        assert brakes[-1] is True


class TestTime:
    def test_a_stamp_that_nobody_set_is_now(self, make: Make) -> None:
        node = make()
        node.odometry(4.0, stamp=0.0)
        assert node.scan(hall(5.0), stamp=0.0).brake is True

    def test_old_data_are_nearer_by_now(self, make: Make) -> None:
        node = make()
        assert frame(node, 6.4, stamp=node.now).brake is False  # 1.6 s, and 25 ms old
        node = make()
        assert frame(node, 6.4, stamp=node.now - 0.15).brake is True

    def test_stamps_of_another_clock(self, make: Make) -> None:
        """A bag from last year, or a sensor whose clock was never set."""
        for use, brakes in ((True, [True] * 8), (False, [False] * 8)):
            node = make(use_stamps=use)
            seen = []
            for step in range(8):
                node.now += 0.1
                node.odometry(4.0, stamp=5.0 + 0.1 * step)
                seen.append(node.scan(hall(), stamp=5.0 + 0.1 * step).brake)
            assert seen == brakes

    def test_stamps_of_the_future_are_ignored(self, make: Make) -> None:
        node = make()
        frame(node)
        frame(node, 5.0, stamp=node.now + 1.0)
        assert node.diagnostics().values["ignored"] == "1"

    def test_a_clock_that_is_set_back_starts_anew(self, make: Make) -> None:
        node = make()
        frame(node)
        node.now -= 50.0
        assert frame(node).brake is False
        assert frame(node, 5.0).brake is True

    def test_a_clock_that_is_set_back_a_little_brakes_until_it_has_caught_up(self, make: Make) -> None:
        node = make()
        frame(node)
        before = node.now
        node.now -= 0.8
        while node.now < before - PERIOD:
            assert frame(node).brake is True
            assert node.diagnostics().values["reason"] in ("STALE", "HOLD")
        assert [frame(node).brake for _ in range(80)][-40:] == [False] * 40

    def test_time_increment_ages_the_beams(self, make: Make) -> None:
        """The scan took 0.2 s; the beam ahead was measured in the middle, and 6.4 m is 1.6 s."""
        for increment, stamped, brakes in ((0.0, 0.2, True), (0.2 / BEAMS, 0.2, False)):
            node = make()
            node.odometry(4.0)
            ranges = hall(6.6)
            assert node.scan(ranges, stamp=node.now - stamped, time_increment=increment).brake is brakes


class TestNonsense:
    @pytest.mark.parametrize(
        "nonsense",
        [
            {"angle_increment": math.nan},
            {"angle_min": math.inf},
            {"range_min": 5.0, "range_max": 1.0},
            {"time_increment": math.nan},
        ],
    )
    def test_a_scan_is_counted_and_never_fatal(self, make: Make, nonsense: dict[str, float]) -> None:
        node = make()
        frame(node)
        for _ in range(3):
            frame(node, **nonsense)
        status = node.diagnostics()
        assert status.values["dropped: /scan"].startswith("3; ")
        assert next(iter(nonsense)) in status.values["dropped: /scan"]
        assert frame(node, 5.0).brake is True

    def test_an_empty_scan(self, make: Make) -> None:
        node = make()
        node.scan([])
        assert node.diagnostics().values["dropped: /scan"].startswith("1")

    def test_odometry_is_counted_and_not_used(self, make: Make) -> None:
        node = make()
        frame(node)
        node.odometry(math.nan)
        node.odometry(math.inf)
        assert frame(node, 5.0, speed=None).brake is True
        assert node.diagnostics().values["dropped: odometry"].startswith("2; is not finite")
        node.odometry(1e9)
        assert frame(node, 5.0, speed=None).brake is True
        assert "no motion of a vehicle" in node.diagnostics().values["dropped: odometry"]

    def test_one_line_for_each_topic_however_much_is_lost(self, make: Make) -> None:
        node = make()
        for beams in range(100):
            frame(node, angle_min=math.inf, range_max=1.0 + beams)
        assert len([key for key in node.diagnostics().values if key.startswith("dropped")]) == 1


def test_memory_stays_flat(make: Make) -> None:
    """Good scans, scans that make no sense, and scans of changing geometry."""
    node = make(marker_topic="")  # genpy keeps a little for each length of a text in it

    def drive() -> None:
        for step in range(100):
            frame(node, 5.0 if step % 2 else 20.0)
            frame(node, angle_min=math.inf, range_max=1.0 + step)
            frame(node, range_max=29.0 + step % 7)
            node.diagnostics()

    drive()
    tracemalloc.start()
    try:
        drive()
        before, _ = tracemalloc.get_traced_memory()
        drive()
        after, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert after - before < 60_000  # of 300 scans


class TestSpeed:
    @pytest.mark.parametrize("kind", ["Odometry", "Float32", "Float64"])
    def test_a_topic_of_any_type(self, make: Make, kind: str) -> None:
        node = make(speed_topic="/speed")
        node.speed(4.0, kind, "/speed")
        assert node.scan(hall(5.0)).brake is True
        node.now += PERIOD
        node.speed(1.0, kind, "/speed")
        assert node.scan(hall(20.0)).brake is False


class TestClouds:
    SETTINGS: dict[str, Any] = {"points_topic": "/points", "scan_topic": "", "outline": OUTLINE}  # noqa: RUF012 # read only

    def test_brakes_on_the_way(self, make: Make) -> None:
        node = make(**self.SETTINGS, mount=[0.3, 0.0, 0.5])  # of the scanner, which it has not
        node.odometry(4.0)
        assert node.points([[20.0, 0.0, 0.5]]).brake is False
        node.now += PERIOD
        assert node.points([[20.0, 0.0, 0.5], [4.0, 0.0, 0.5]]).brake is True
        assert node.cause() == (4.0, 0.0)

    def test_only_points_of_its_height(self, make: Make) -> None:
        node = make(**self.SETTINGS, height=[0.1, 1.0])
        for _ in range(20):
            node.now += PERIOD
            node.odometry(4.0)
            assert node.points([[4.0, 0.0, 0.0], [4.0, 0.0, 1.5]]).brake is False  # the road, and a bridge
        node.now += PERIOD
        assert node.points([[4.0, 0.0, 0.5]]).brake is True

    def test_what_is_no_point_is_no_free_space(self, make: Make) -> None:
        node = make(**self.SETTINGS)
        for _ in range(20):
            node.now += PERIOD
            node.odometry(4.0)
            seen = node.points([[0.0, 0.0, 0.0], [math.nan, 0.0, 3.0], [math.inf, 0.0, 3.0]])
        assert seen.brake is True
        assert node.diagnostics().values["reason"] == "BLIND"

    def test_scans_and_clouds_each_brake_and_each_have_to_come(self, make: Make) -> None:
        node = make(**{**self.SETTINGS, "scan_topic": "/scan"}, trigger=[2, 2])

        def both(scanned: float, seen: float) -> Seen:
            for i in range(4):  # scans come four times as often
                answer = frame(node, scanned - 1e-3 * i)
            answer = node.points([[seen + 1e-3 * (node.now % 1.0), 0.0, 0.5]])
            assert isinstance(answer, Seen)
            return answer

        both(25.0, 20.0)
        assert both(25.0, 20.0).brake is False
        both(25.0, 4.0)
        assert both(25.0, 4.0).brake is True
        both(25.0, 20.0)
        assert both(25.0, 20.0).brake is False
        assert both(4.0, 20.0).brake is True
        both(25.0, 20.0)
        both(25.0, 20.0)
        brakes = [frame(node, 25.0 - 0.1 * i).brake for i in range(16)]  # no cloud for 0.4 s
        assert brakes[0] is False
        assert brakes[-1] is True

    REAR: dict[str, Any] = {**SETTINGS, "scan_topic": "/scan"}  # noqa: RUF012 # read only

    def back_and_forth(self, node: Any, cloud: Any, speed: float, frames: int = 12) -> str:
        """A scanner that looks ahead and a sensor of clouds that looks back, in a wide hall."""
        for _ in range(frames):
            frame(node, 20.0, speed)
            node.points(np.add(cloud, 1e-3 * (node.now % 1.0)))
        return str(node.diagnostics().values["reason"])

    def test_what_the_clouds_look_at_the_scans_need_not(self, make: Make) -> None:
        behind, ahead = [[-8.0, 0.0, 0.5]], [[8.0, 3.0, 0.5]]
        for cloud, reason in ((behind, "CLEAR"), (ahead, "UNSEEN")):
            node = make(**self.REAR)
            node.points(cloud)
            assert self.back_and_forth(node, cloud, 2.0) == "CLEAR"
            assert self.back_and_forth(node, cloud, -2.0) == reason

    def test_views_say_where_the_clouds_look_and_the_scans_where_they_do_not(self, make: Make) -> None:
        for view, reason in (((-1.5, 1.5, -0.1, 0.0, math.pi), "CLEAR"), ((-1.5, 1.5, 0.3, 0.0, 0.0), "UNSEEN")):
            node = make(**self.REAR, points_views=list(view))
            aside = [[-8.0, 4.0, 0.5]]
            node.points(aside)
            assert self.back_and_forth(node, aside, 2.0) == "CLEAR"
            assert self.back_and_forth(node, aside, -2.0) == reason

    def test_a_driver_who_asks_to_back_out_where_only_the_clouds_look_is_let_go(self) -> None:
        node = BrakeNode(NodeSettings.of(self.REAR))
        for i in range(120):
            now = 100.0 + PERIOD * i
            node.on_odometry(now, now, speed=4.0 if i < 40 else 0.0)
            node.on_commanded(now, Commanded(4.0 if i < 80 else -1.0))
            node.on_scan(now, now, SimpleNamespace(**GEOMETRY, ranges=hall(1.0)))
            decision = node.on_points(now, now, np.array([[-8.0, 1e-3 * i, 0.5]], np.float32)).decision
            assert i < 20 or i >= 80 or decision.command is Command.BRAKE
        assert decision.command is Command.NONE

    def test_views_that_make_no_sense_are_refused(self) -> None:
        for views, words in (
            ([0.0, 1.0], "five|5 numbers"),
            ([1.0, 0.0, 0.0, 0.0, 0.0], "angle_min below angle_max"),
            ([0.0, 9.0, 0.0, 0.0, 0.0], "by a turn at most"),
        ):
            with pytest.raises(SettingError, match=words):
                NodeSettings.of({**self.SETTINGS, "points_views": views})
        with pytest.raises(SettingError, match="points_views needs a points_topic"):
            NodeSettings.of({"points_views": [0.0, 1.0, 0.0, 0.0, 0.0]})

    def test_rows_that_are_no_points(self, make: Make) -> None:
        node = make(**self.SETTINGS)
        node.points(np.zeros((0, 3)))
        node.odometry(4.0)
        node.now += PERIOD
        assert node.points([[4.0, 0.0, 0.5]]).brake is True

    @pytest.mark.parametrize("nearest", [4.0, 20.0])
    def test_an_organised_cloud_is_judged_as_the_same_points_in_a_row(self, make: Make, nearest: float) -> None:
        image = np.full((8, 16, 3), 25.0, np.float32)
        image[:, :, 1:] = 0.0, 0.5
        image[5, 3, 0] = nearest
        image[:, 9] = math.nan
        organised, plain = make(**self.SETTINGS), make(**self.SETTINGS)
        for node, points in ((organised, image), (plain, image.reshape(-1, 3))):
            node.odometry(4.0)
            assert node.points(points).brake is (nearest == 4.0)
        assert organised.cause() == plain.cause() == ((4.0, 0.0) if nearest == 4.0 else plain.cause())
        assert organised.diagnostics().message == plain.diagnostics().message

    def test_empty_clouds_are_a_blind_sensor(self, make: Make) -> None:
        node = make(**self.SETTINGS)
        node.odometry(4.0)
        assert node.points([[20.0, 0.0, 0.5]]).brake is False
        for _ in range(20):
            node.now += PERIOD
            node.odometry(4.0)
            seen = node.points(np.zeros((0, 3)))
        assert seen.brake is True
        values = node.diagnostics().values
        assert values["reason"] == "BLIND"
        assert "dropped: /points" not in values


class TestDiagnostics:
    def test_nothing_yet(self, make: Make) -> None:
        assert make().diagnostics()[:2] == (STALE, "nothing has come yet")

    def test_what_it_says(self, make: Make) -> None:
        node = make()
        frame(node, 5.0)
        status = node.diagnostics()
        assert status.level == WARN
        assert "IttcThreshold: 1.25 < 1.5 s" in status.message
        expected = {"command": "BRAKE", "reason": "CRITERION", "frames": "1", "source": "BEAMS", "ttc": "1.250 s"}
        assert expected.items() <= status.values.items()
        assert float(status.values["latency"].removesuffix(" us")) > 0.0
        assert status.values["speed"] == "4.000 m/s"
        frame(node)
        assert node.diagnostics().level == OK

    def test_where_the_cause_is(self, make: Make) -> None:
        node = make(mount=[0.2, 0.1, 0.0])
        node.odometry(4.0)
        node.scan(hall(2.0, beam=AHEAD + 30))
        x, y = node.cause()
        assert x == pytest.approx(0.2 + 2.0 * math.cos(math.radians(30)), abs=1e-5)
        assert y == pytest.approx(0.1 + 2.0 * math.sin(math.radians(30)), abs=1e-5)

    def test_no_cause(self, make: Make) -> None:
        node = make()
        node.wait(0.0)
        assert node.cause() is None


class TestMessages:
    """What only the adapters have."""

    @pytest.fixture(params=[RospyHarness, RclpyHarness, DdsHarness])
    def adapter(self, request: pytest.FixtureRequest) -> Iterator[Make]:
        made: list[Any] = []

        def make_one(**parameters: Any) -> Any:
            made.append(request.param(patch, **{**AT_ONCE, **parameters}))
            return made[-1]

        with pytest.MonkeyPatch.context() as patch:
            yield make_one
            for each in made:
                each.close()

    @pytest.mark.parametrize("topic", ["brake_topic", "drive_topic", "diagnostics_topic", "marker_topic"])
    def test_an_empty_topic_is_not_published(self, adapter: Make, topic: str) -> None:
        names = {"brake_topic": "/brake_bool", "drive_topic": "/drive", "diagnostics_topic": "/diagnostics"}
        silent, spoken = adapter(**{topic: ""}), adapter()
        for node in (silent, spoken):
            frame(node, 5.0)
            node.node.diagnose()
        name = names.get(topic, "/ttc_fast/cause")
        assert name not in silent.published
        assert name in spoken.published

    def test_topics_by_other_names(self, adapter: Make) -> None:
        node = adapter(scan_topic="/front", odom_topics=["/wheels"], brake_topic="/stop")
        node.odometry(4.0, topic="/wheels")
        message = node.message("sensor_msgs", "LaserScan")
        message.angle_increment, message.range_max, message.ranges = 0.1, 30.0, [2.0, 2.0]
        node.sent("/front", message)
        assert node.published["/stop"][-1].data is True

    def test_the_marker_goes_out_by_itself(self, adapter: Make) -> None:
        node = adapter(base_frame="car")
        frame(node, 5.0)
        marker = node.published["/ttc_fast/cause"][-1]
        assert marker.header.frame_id == "car"
        assert (marker.type, marker.action) == (2, 0)
        assert marker.color.r == 1.0
        assert marker.pose.orientation.w == 1.0
        assert 0 < (getattr(marker.lifetime, "nsecs", 0) or marker.lifetime.nanosec) < 1e9

    def test_a_cloud_that_is_odd_is_judged_and_counted(self, adapter: Make) -> None:
        """Its rows are as long as those of a wider one, and its padding is declared as fields."""
        node = adapter(**TestClouds.SETTINGS)
        node.odometry(4.0)
        rows = np.array([[[20.0, 0.0, 0.5]] * 3] * 2)
        assert node.points(rows, row_step=99).brake is False
        node.now += PERIOD
        rows[1, 1, 0] = 4.0
        assert node.points(rows, row_step=0).brake is True
        values = node.diagnostics().values
        assert values["odd: /points, row_step"] == "2; msg.row_step is 0; rows are read as width x point_step, 36 bytes"
        assert "dropped: /points" not in values

    def test_a_cloud_that_makes_no_sense(self, adapter: Make) -> None:
        node = adapter(**TestClouds.SETTINGS)
        message = node.message("sensor_msgs", "PointCloud2")
        message.height, message.width, message.point_step, message.row_step = 1, 1000, 12, 12000
        node.sent("/points", message)
        assert node.diagnostics().values["dropped: /points"].startswith("1; ")


class TestRospy:
    """Damaged messages, and the type of a speed that is none."""

    @pytest.fixture
    def node(self, monkeypatch: pytest.MonkeyPatch) -> RospyHarness:
        return RospyHarness(monkeypatch, **AT_ONCE, speed_topic="/speed")

    def test_scans_cut_anywhere(self, node: RospyHarness) -> None:
        from tests.support.ros_harness import written

        message = node.message("sensor_msgs", "LaserScan")
        message.header.frame_id, message.ranges = "laser", [1.0] * 8
        whole = written(message)
        for end in range(len(whole)):
            node.deliver_bytes("/scan", whole[:end], message._type)
        assert node.diagnostics().values["dropped: /scan"].startswith(f"{len(whole)}; ")

    def test_a_length_that_lies(self, node: RospyHarness) -> None:
        from tests.support.ros_harness import written

        message = node.message("sensor_msgs", "LaserScan")
        whole = bytearray(written(message))
        whole[-8:-4] = b"\xff\xff\xff\x7f"  # the number of ranges
        node.deliver_bytes("/scan", bytes(whole), message._type)
        assert node.diagnostics().values["dropped: /scan"].startswith("1; ")

    def test_a_speed_of_another_type(self, node: RospyHarness) -> None:
        node.deliver_bytes("/speed", b"\0\0\0\0", "std_msgs/String")
        assert "std_msgs/String" in node.diagnostics().values["dropped: /speed"]

    def test_a_speed_cut_short(self, node: RospyHarness) -> None:
        node.deliver_bytes("/speed", b"\0\0", "std_msgs/Float32")
        assert node.diagnostics().values["dropped: /speed"].startswith("1; ")

    def test_the_type_of_the_drive_is_that_of_ackermann_msgs(self, node: RospyHarness) -> None:
        from ttc_fast.ros.rospy_node import AckermannDriveStamped

        assert AckermannDriveStamped._md5sum == "1fd5d7f58889cefd44d29f6653240d0c"


class TestRclpy:
    """Parameters that are declared, and changed while it runs."""

    @pytest.fixture
    def start(self, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., RclpyHarness]]:
        made: list[RclpyHarness] = []

        def start(**parameters: Any) -> RclpyHarness:
            made.append(RclpyHarness(monkeypatch, **{**AT_ONCE, **parameters}))
            return made[-1]

        yield start
        for each in made:
            each.close()

    @pytest.fixture
    def node(self, start: Callable[..., RclpyHarness]) -> RclpyHarness:
        return start()

    def change(self, node: RclpyHarness, name: str, value: Any) -> Any:
        [answer] = node.node.set_parameters([node.rclpy.Parameter(name, value=value)])
        return answer

    def test_a_threshold_changes_while_it_drives(self, node: RclpyHarness) -> None:
        assert frame(node, 7.0).brake is False
        assert self.change(node, "ttc_threshold", 2.0).successful
        assert frame(node, 7.0).brake is True

    def test_it_goes_on_braking_when_a_parameter_changes(self, node: RclpyHarness) -> None:
        frame(node, 5.0)
        assert self.change(node, "hold", 1.0).successful
        assert frame(node).brake is True

    @pytest.mark.parametrize(
        ("name", "value", "says"),
        [
            ("ttc_threshold", -1.0, "threshold"),
            ("limits_policy", "cut", "limits_policy"),
            ("scan_topic", "/other", "scan_topic is read when the node starts: restart it"),
            ("trigger", [3, 2], "trigger"),
        ],
    )
    def test_a_value_that_is_refused_changes_nothing(
        self, node: RclpyHarness, name: str, value: Any, says: str
    ) -> None:
        answer = self.change(node, name, value)
        assert not answer.successful
        assert says in answer.reason
        assert frame(node, 5.0).brake is True

    def test_parameters_of_others_are_not_ours(self, node: RclpyHarness) -> None:
        assert self.change(node, "use_sim_time", True).successful

    def test_every_parameter_is_declared_and_described(self, node: RclpyHarness) -> None:
        for each in parameters_of_node():
            assert node.node.describe_parameter(each.name).description == each.description
        [limits] = node.node.describe_parameter("ttc_threshold").floating_point_range
        assert limits.from_value == 0.0 < 1.5 < limits.to_value

    def test_watches_in_steady_time(self, node: RclpyHarness) -> None:
        assert [each.timer_period_ns for each in node.node.timers] == [50_000_000, 1_000_000_000]
        assert {each.clock.clock_type.name for each in node.node.timers} == {"STEADY_TIME"}

    def test_a_speed_of_another_type(self, start: Callable[..., RclpyHarness]) -> None:
        node = start(speed_topic="/speed")
        node.announce("/speed", "std_msgs", "String")
        assert "std_msgs/msg/String" in node.diagnostics().values["dropped: /speed"]


def test_odometry_that_overflows_is_dropped_and_the_node_goes_on() -> None:
    from ttc_fast.ros import core
    from ttc_fast.ros.settings import NodeSettings
    from ttc_fast.sensors.odometry import Pose

    node = core.BrakeNode(NodeSettings.of({"outline": [-0.1, 0.4, -0.15, 0.15]}))
    for i, far in enumerate((-1.5e308, 1.5e308)):
        node.on_odometry(100.0 + 0.5 * i, 100.0 + 0.5 * i, 0.0, pose=Pose(far, 0.0, 0.0))
    assert node.tick(100.6).brake
    assert any(name.startswith("dropped: odometry") for name, _ in node.diagnostics(100.6).values)
