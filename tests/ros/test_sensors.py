"""What drivers really send, through the core and each adapter: odd scans, odd odometry, two sensors, odd clocks."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.common import CAR
from tests.support.ros_harness import AT_ONCE, BEAMS, GEOMETRY, CoreHarness
from ttc_fast.sensors.odometry import OdometryReader, Pose

if TYPE_CHECKING:
    from collections.abc import Callable

    Make = Callable[..., Any]

PERIOD = 0.1
CLOUDS: dict[str, Any] = {"points_topic": "/points", "scan_topic": "", "outline": list(CAR)}
VOTES = {"trigger": [3, 4]}


def reason(node: Any) -> str:
    text: str = node.diagnostics().values["reason"]
    return text


def said(node: Any) -> str:
    return " | ".join(f"{key}: {value}" for key, value in node.diagnostics().values.items())


def counted(node: Any, key: str) -> int:
    """How often something odd was counted, or a message dropped."""
    found = [value for name, value in node.diagnostics().values.items() if name.startswith(key)]
    return sum(int(value.partition(";")[0]) for value in found)


def approach(node: Any, frames: int, beams: Callable[[int], int] = lambda i: BEAMS, **fields: Any) -> list[str]:
    """A wall comes from 8 m at 1 m/s, without odometry; the reason of each decision."""
    reasons = []
    for i in range(frames):
        node.now += PERIOD
        count = beams(i)
        step = 2.0 * math.pi / 2 / (count - 1)
        geometry = {"angle_increment": step, "angle_max": math.pi / 2, **{k: f(i) for k, f in fields.items()}}
        node.scan(np.full(count, 8.0 - 0.1 * i), **geometry)
        reasons.append(reason(node))
    return reasons


# Scans


def test_a_time_between_beams_that_is_measured_anew_changes_nothing(make: Make) -> None:
    rng = np.random.default_rng(0)
    steady = approach(make(use_range_rate=True), 40)
    jitters = approach(make(use_range_rate=True), 40, time_increment=lambda i: (0.1 + rng.normal(0.0, 1e-4)) / BEAMS)
    assert steady == jitters
    assert steady[-1] != "NO_MOTION"


def test_a_first_scan_of_one_reading_does_not_keep_the_others_out(make: Make) -> None:
    """The range rate goes on by angle, from one beam to many."""
    node = make(use_range_rate=True)
    node.odometry(1.0)
    node.scan([9.0], angle_max=GEOMETRY["angle_min"])
    for _ in range(8):
        node.now += PERIOD
        node.odometry(1.0)
        seen = node.scan(np.full(BEAMS, 10.0))
    assert "dropped" not in said(node)
    assert (seen.brake, reason(node)) == (False, "CLEAR")


@pytest.mark.parametrize("increment", [-1e-4, math.inf, 153333.3, 0.1])
def test_a_senseless_time_between_beams_is_taken_for_0_and_said_once(
    make: Make, increment: float, capfd: pytest.CaptureFixture[str]
) -> None:
    node = make()
    for _ in range(5):
        node.now += PERIOD
        node.odometry(1.0)
        assert node.scan(np.full(BEAMS, 10.0), time_increment=increment).brake is False
    assert counted(node, "odd: /scan, time_increment") == 5
    assert capfd.readouterr().err.count("time_increment") == 1


def test_scans_of_a_few_readings_more_or_less_go_on(make: Make) -> None:
    """The range rate goes on by angle: the decisions are those of a scanner that always has as many."""
    rng = np.random.default_rng(1)
    steady = approach(make(use_range_rate=True), 70, lambda i: BEAMS)
    varying = approach(make(use_range_rate=True), 70, lambda i: BEAMS + int(rng.integers(-2, 3)))
    assert varying[6:] == steady[6:]
    assert "CRITERION" in steady


def test_votes_go_on_over_a_change_of_geometry(make: Make) -> None:
    node = make(**VOTES)
    brakes = []
    for beams in (181, 180, 182):
        node.now += PERIOD
        node.odometry(4.0)
        step = math.pi / (beams - 1)
        brakes.append(node.scan(np.full(beams, 4.0), angle_increment=step, angle_max=math.pi / 2).brake)
    assert brakes == [False, False, True]


@pytest.mark.parametrize(
    ("ranges", "geometry"), [([], {}), ([3.0], {"angle_increment": math.inf, "time_increment": math.inf})]
)
def test_an_odd_first_scan_is_lost_and_the_others_are_judged(
    make: Make, ranges: list[float], geometry: dict[str, float]
) -> None:
    node = make()
    assert node.scan(ranges, **geometry).brake is True  # nothing was seen yet
    node.now += PERIOD
    node.odometry(1.0)
    assert node.scan(np.full(BEAMS, 10.0)).brake is False or reason(node) == "HOLD"
    assert counted(node, "dropped: /scan") == 1


def test_a_scanner_whose_scans_are_all_refused_says_so_at_once_and_brakes(
    make: Make, capfd: pytest.CaptureFixture[str]
) -> None:
    """Half of the readings were taken out, and the angles still tell of all."""
    node = make()
    node.odometry(1.0)
    assert node.scan(np.full(BEAMS, 10.0), angle_min=-math.pi, angle_max=math.pi).brake is True
    assert "nobody knows where its beams point" in capfd.readouterr().err
    assert "nobody knows where its beams point" in node.diagnostics().values["dropped: /scan"]
    assert node.diagnostics().level == 2


def test_readings_that_go_round_twice_do_not_end_where_one_turn_ends(make: Make) -> None:
    """720 readings, and an increment of one degree: a wall ahead would be read as one behind."""
    node = make()
    node.odometry(1.0)
    turn = {"angle_min": -math.pi, "angle_max": math.pi, "angle_increment": math.pi / 180}
    assert node.scan(np.full(720, 10.0), **turn).brake is True
    assert counted(node, "dropped: /scan") == 1


@pytest.mark.parametrize(("beams", "odd"), [(BEAMS, 0), (BEAMS - 1, 1), (BEAMS + 1, 1)])
def test_a_count_off_by_one_is_tolerated_and_counted(make: Make, beams: int, odd: int) -> None:
    node = make()
    node.odometry(1.0)
    assert node.scan(np.full(beams, 10.0), angle_max=math.pi / 2).brake is False
    assert counted(node, "odd: /scan, angle_max") == odd


def test_a_count_that_was_rounded_down_is_tolerated_and_two_beams_are_not(make: Make) -> None:
    """A turn in steps of 0.007 rad: 897 readings where 897.6 fit, and one of them is counted as a step."""
    node = make()
    node.odometry(1.0)
    turn = {"angle_min": -math.pi, "angle_max": math.pi, "angle_increment": 0.007}
    assert node.scan(np.full(897, 10.0), **turn).brake is False
    assert counted(node, "odd: /scan, angle_max") == 1
    node.now += PERIOD
    node.scan(np.full(896, 10.0), **turn)
    assert counted(node, "dropped: /scan") == 1


def test_kernels_are_made_once_for_each_geometry(monkeypatch: pytest.MonkeyPatch) -> None:
    from ttc_fast.configuration import Configuration

    made: list[dict[str, Any]] = []
    scanner = Configuration.scanner

    def counted(self: Configuration, **more: Any) -> Any:
        made.append(more)
        return scanner(self, **more)

    monkeypatch.setattr(Configuration, "scanner", counted)
    node = CoreHarness()
    approach(node, 60, lambda i: BEAMS + i % 5)
    assert len(made) <= 8
    made.clear()
    jitter = np.random.default_rng(0).normal(0.0, 1e-7, 60)
    approach(node, 60, angle_increment=lambda i: float(np.float32(math.pi / (BEAMS - 1) + jitter[i])))
    assert len(made) <= 1


def test_limits_that_differ_from_scan_to_scan_make_no_new_kernels(monkeypatch: pytest.MonkeyPatch) -> None:
    """A driver says the least and the greatest reading of each scan as its limits."""
    from ttc_fast.configuration import Configuration

    made: list[dict[str, Any]] = []
    scanner = Configuration.scanner

    def counted(self: Configuration, **more: Any) -> Any:
        made.append(more)
        return scanner(self, **more)

    monkeypatch.setattr(Configuration, "scanner", counted)
    rng = np.random.default_rng(2)
    node, steady = CoreHarness(**AT_ONCE), CoreHarness(**AT_ONCE)
    for i in range(60):
        ranges = rng.uniform(8.0 - 0.1 * i, 20.0, BEAMS).astype(np.float32)
        ranges[:2] = 0.01, 60.0  # outside of the limits
        limits: dict[str, Any] = {"range_min": min(ranges[2:]) - 0.01, "range_max": max(ranges[2:]) + 0.01}
        answers = []
        for each, header in ((node, limits), (steady, {})):
            each.now += PERIOD
            each.odometry(2.0)
            answers.append(each.scan(ranges, **header).brake)
        assert answers[0] is answers[1]
        assert node.node._latest.value == steady.node._latest.value  # type: ignore[union-attr]
    assert answers == [True, True]
    assert len(made) < 20


def test_many_geometries_take_no_more_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    node = CoreHarness()
    approach(node, 300, lambda i: 20 + i)
    assert len(node.node._kernels._made) <= 64


def test_scans_in_millimetres_are_said(make: Make) -> None:
    node = make()
    for distance in (20_000.0, 30.0):
        node.now += PERIOD
        node.scan(np.full(BEAMS, distance), range_max=40_000.0)
    assert counted(node, "odd: /scan, ranges") == 1
    assert "half of them are 20000 m or more, read as they are; if they are in millimetres, divide" in said(node)


# Odometry


def drive(
    node: Any, twist: Callable[[float], tuple[float, float]], yaw: float, frames: int = 40, speed: float = 1.0
) -> Any:
    """The vehicle drives along its heading, and something is 6 m ahead in the beginning."""
    seen = []
    for i in range(frames):
        node.now += PERIOD
        way = speed * PERIOD * i
        vx, vy = twist(speed)
        pose = Pose(way * math.cos(yaw), way * math.sin(yaw), yaw)
        node.odometry(vx, lateral_speed=vy, pose=pose)
        seen.append(node.scan(np.full(BEAMS, max(6.0 - way, 0.3)), angle_max=math.pi / 2).brake)
    return seen


def along(yaw: float, speed: float) -> tuple[float, float]:
    return speed * math.cos(yaw), speed * math.sin(yaw)


def test_a_twist_in_the_frame_of_the_world_is_turned(make: Make) -> None:
    for yaw in (math.pi, 2.0):
        node = make()
        of_world = drive(node, partial(along, yaw), yaw, 60)
        of_vehicle = drive(make(), lambda speed: (speed, 0.0), yaw, 60)
        assert of_world[20:] == of_vehicle[20:]
        assert any(of_world[20:])
        assert "frame of the world" in said(node)


@pytest.mark.parametrize("factor", [-1.0, 3.6])
def test_a_twist_that_contradicts_its_poses_is_not_used_and_brakes(make: Make, factor: float) -> None:
    node = make(sensor_timeout=0.35)
    seen = drive(node, lambda speed: (factor * speed, 0.0), 1.0, 40)
    assert seen[-1] is True
    assert reason(node) == "NO_MOTION"
    assert "poses of the same odometry" in said(node)


def test_a_twist_that_agrees_with_its_poses_is_used_as_it_is(make: Make) -> None:
    node = make()
    assert not any(drive(node, lambda speed: (speed, 0.0), 1.0, 30))
    assert "odd" not in said(node)


def test_a_jump_of_the_pose_changes_nothing(make: Make) -> None:
    node = make()
    for i in range(60):
        node.now += PERIOD
        jump = 5.0 if i >= 30 else 0.0
        node.odometry(1.0, pose=Pose(0.1 * i + jump, 0.0, 0.0))
        assert node.scan(np.full(BEAMS, 10.0 + 1e-3 * i)).brake is False
    assert "odd" not in said(node)


def test_where_nobody_filled_in_the_twist_the_poses_tell(make: Make) -> None:
    derived = drive(make(), lambda speed: (0.0, 0.0), 1.0, 60)
    assert sum(derived) == pytest.approx(sum(drive(make(), lambda speed: (speed, 0.0), 1.0, 60)), abs=2)
    assert 5 < sum(derived) < 20


@pytest.mark.parametrize(("speed", "yaw_rate"), [(-2.2e-12, 7e-13), (2e-5, 0.0), (0.0, 0.003), (0.0, -1e-9)])
def test_a_velocity_of_nearly_0_was_not_filled_in_whatever_the_yaw_rate(speed: float, yaw_rate: float) -> None:
    reader = OdometryReader()
    read = [reader.read(0.1 * i, Pose(0.3 * i, 0.0, 0.0), speed, yaw_rate, speed / 2.0) for i in range(20)]
    for twist in read[1:]:
        assert twist == pytest.approx((3.0, yaw_rate, 0.0), abs=1e-6)


def test_a_vehicle_that_turns_on_the_spot_keeps_its_yaw_rate() -> None:
    reader = OdometryReader()
    for i in range(20):
        assert reader.read(0.1 * i, Pose(1.0, 2.0, 0.0), 0.0, 0.5) == (0.0, 0.5, 0.0)


def test_two_topics_of_odometry_are_not_compared_with_each_other(make: Make) -> None:
    node = make()
    for i in range(60):
        node.now += PERIOD
        node.odometry(1.0, pose=Pose(0.1 * i, 0.0, 0.0))
        node.odometry(1.0, pose=Pose(0.0, 0.1 * i + 7.0, math.pi / 2), topic="/vesc/odom")
        assert node.scan(np.full(BEAMS, 10.0 + 1e-3 * i)).brake is False
    assert "twist" not in said(node)
    assert counted(node, "odd: /vesc/odom, odometry") == 60


def test_of_two_topics_of_odometry_the_first_named_holds_while_it_comes(make: Make) -> None:
    """The other one says a speed at which the node would brake."""
    node = make(**VOTES)
    brakes = []
    for i in range(40):
        node.now += PERIOD
        if i < 20:
            node.odometry(1.0)
        node.odometry(9.0, topic="/vesc/odom")
        brakes.append(node.scan(np.full(BEAMS, 10.0 + 1e-3 * i)).brake)
    assert brakes[0] is False
    assert not any(brakes[:20])
    assert all(brakes[30:])


def test_poses_before_and_after_a_gap_say_no_speed(make: Make) -> None:
    """The vehicle drives at 4 m/s, stands for long, and drives on: the mean would be a harmless speed."""
    node = make(sensor_timeout=0.35)
    reasons, x = [], 0.0
    for i in range(16):
        node.now += 5.0 if i == 8 else PERIOD
        x += 4.0 * PERIOD
        node.odometry(0.0, pose=Pose(x, 0.0, 0.0))
        node.scan(np.full(BEAMS, 9.0 + 1e-3 * i))
        reasons.append((reason(node), node.diagnostics().values.get("speed", "none")))
    assert all(said.startswith("4.000") for _, said in reasons[1:8] + reasons[9:])
    assert reasons[8][1].startswith("4.000")  # that before the gap, which is too old to be used
    assert reasons[8][0] == "NO_MOTION"


def test_odometry_that_is_not_used_moves_no_drive_message(make: Make) -> None:
    node = make(drive_always=True)
    node.odometry(3.0)
    assert node.scan(np.full(BEAMS, 20.0)).speed == pytest.approx(3.0)
    node.now += PERIOD
    node.odometry(7.0, stamp=node.now - 4.0)
    assert node.scan(np.full(BEAMS, 20.1)).speed == pytest.approx(3.0)
    for _ in range(8):
        node.now += PERIOD
        seen = node.scan(np.full(BEAMS, 20.2))
    assert seen.speed in (0.0, None)


# Repeats


def test_readings_that_are_repeated_cast_no_vote(make: Make) -> None:
    """A speckle in one scan, which comes five times within 20 ms; then in three scans."""
    node = make(**VOTES)
    speckle = np.full(BEAMS, 20.0)
    speckle[BEAMS // 2] = 1.0
    node.odometry(4.0)
    for i in range(12):
        node.now += 0.004 if i % 6 else 0.05
        ranges = speckle if i < 6 else np.full(BEAMS, 20.0)
        assert node.scan(ranges).brake is False
    assert counted(node, "odd: /scan, readings") == 10
    for i in range(3):
        node.now += 0.05
        node.odometry(4.0)
        speckle[0] = 20.0 + 0.01 * i
        seen = node.scan(speckle)
    assert seen.brake is True


def test_a_scene_that_stands_is_measured_anew(make: Make) -> None:
    """A simulation without noise repeats its readings to the bit: they are no loss."""
    for period in (0.004, 0.02, 0.1, 0.2):
        node = make(**VOTES)
        for _ in range(200):
            node.now += period
            node.odometry(0.0)
            assert node.scan(np.full(BEAMS, 10.0)).brake is False


# Two sources


def test_of_two_sources_that_both_brake_both_are_said(make: Make) -> None:
    """Scans brake by a criterion, and no cloud comes: nothing is seen there, so the vehicle is to stand."""
    node = make(outline=list(CAR), points_topic="/points", brake_speed=1.0)
    for i in range(3):
        node.now += PERIOD
        node.odometry(4.0)
        seen = node.scan(np.full(BEAMS, 2.0 + 0.01 * i))
    assert seen.brake is True
    assert seen.speed == 0.0
    assert "WAITING" in node.diagnostics().message
    assert "scan: BRAKE (CRITERION)" in node.diagnostics().message


# Frames


def in_turns(node: Any, frames: int, names: tuple[str, str] = ("front", "rear")) -> list[bool]:
    """Two scanners on one topic: a wall comes closer before the one, and the other sees free space."""
    brakes = []
    for i in range(frames):
        node.now += PERIOD / 2
        node.odometry(1.0)
        front = i % 2 == 0
        ranges = np.full(BEAMS, max(6.0 - 0.05 * i, 0.05) if front else 9.0 + 1e-3 * i)
        brakes.append(node.scan(ranges, frame=names[0] if front else names[1]).brake)
    return brakes


def test_two_scanners_on_one_topic_are_refused_and_brake(make: Make, capfd: pytest.CaptureFixture[str]) -> None:
    node = make(**VOTES)
    assert in_turns(node, 20) == [False] + [True] * 19
    status = node.diagnostics()
    assert status.level == 2
    assert "'front' and 'rear'" in status.message
    assert "choose one with frame_id" in capfd.readouterr().err


def test_the_chosen_scanner_is_judged_and_the_other_counted(make: Make) -> None:
    node = make(**VOTES, frame_id="front")
    brakes = in_turns(node, 110)
    assert not any(brakes[:80])
    assert brakes[-1] is True
    assert counted(node, "odd: /scan, frame_id") == 55


def test_the_other_scanner_may_be_chosen(make: Make) -> None:
    assert not any(in_turns(make(**VOTES, frame_id="/rear"), 110)[1:])


def test_two_scanners_without_names_are_found_by_what_they_see(make: Make) -> None:
    node = make(**VOTES)
    brakes = in_turns(node, 40, ("", ""))
    assert brakes[-1] is True
    assert "two scenes in turns" in node.diagnostics().message


def test_two_scanners_without_names_that_have_other_numbers_of_readings_are_found(make: Make) -> None:
    node = make(**VOTES)
    for i in range(40):
        node.now += PERIOD / 2
        node.odometry(1.0)
        ranges = np.full(BEAMS, 6.0 - 0.01 * i) if i % 2 else np.full(BEAMS - 60, 9.5)
        step = math.pi / (len(ranges) - 1)
        seen = node.scan(ranges, angle_increment=step, angle_max=math.pi / 2)
    assert seen.brake is True
    assert "two scenes in turns" in node.diagnostics().message


def test_two_lidars_on_one_topic_are_refused_and_brake(make: Make) -> None:
    for chosen, brakes in (("", True), ("left", False)):
        node = make(**CLOUDS, frame_id=chosen)
        for i in range(6):
            node.now += PERIOD
            node.odometry(1.0)
            seen = node.points([[20.0, 0.0, 0.5]], frame="right" if i % 2 else "left")
        assert seen.brake is brakes
    assert counted(node, "odd: /points, frame_id") == 3


# Clocks


def test_a_zero_stamp_among_others_is_a_lost_frame(make: Make) -> None:
    node = make()
    for i in range(6):
        node.now += PERIOD
        node.odometry(1.0)
        assert node.scan(np.full(BEAMS, 10.0), stamp=0.0 if i == 3 else node.now - 0.01).brake is False
    assert counted(node, "dropped: /scan") == 1
    assert "has no stamp" in said(node)


def test_stamps_that_stand_still_are_said_and_brake(make: Make) -> None:
    node = make()
    stamp = node.now
    for _ in range(8):
        node.odometry(1.0)
        seen = node.scan(np.full(BEAMS, 10.0), stamp=stamp)
        node.now += PERIOD
    assert seen.brake is True
    assert counted(node, "odd: /scan, stamp") == 7


@pytest.mark.parametrize("ahead", [3600.0, -90.0])
def test_odometry_of_another_clock_is_named_and_not_used(make: Make, ahead: float) -> None:
    node = make(sensor_timeout=0.35)
    for _ in range(8):
        node.now += PERIOD
        node.odometry(1.0, stamp=node.now + ahead)
        seen = node.scan(np.full(BEAMS, 10.0))
    assert seen.brake is True
    assert counted(node, "odd: /odom, clock") == 8
    assert "use_stamps" in said(node)


def test_odometry_that_comes_late_does_not_replace_newer_one(make: Make) -> None:
    """What came late says that the vehicle stood."""
    node = make(**VOTES)
    for _ in range(8):
        node.now += PERIOD
        node.odometry(9.0)
        node.odometry(0.0, stamp=node.now - 0.05)
        seen = node.scan(np.full(BEAMS, 10.0))
    assert seen.brake is True
    assert counted(node, "odd: /odom, order") == 8


def test_one_stamp_of_odometry_in_the_future_holds_up_none_after_it(make: Make) -> None:
    node = make(**VOTES)
    for i in range(8):
        node.now += PERIOD
        node.odometry(1.0, stamp=node.now + 0.9 * (i == 2))
        assert node.scan(np.full(BEAMS, 10.0 + 1e-3 * i)).brake is False
    assert counted(node, "odd: /odom, clock") == 1
    assert "odd: /odom, order" not in said(node)


# Static transforms

UPSIDE_DOWN = (1.0, 0.0, 0.0, 0.0)
LEFT = (0.0, 0.0, math.sin(math.pi / 4), math.cos(math.pi / 4))


def seen_at(node: Any, beam: int, frame: str = "laser") -> bool:
    """Whether the node brakes for something near in the direction of one beam."""
    node.now += PERIOD
    node.odometry(4.0)
    ranges = np.full(BEAMS, 25.0)
    ranges[beam] = 2.0
    brake: bool = node.scan(ranges, frame=frame, angle_max=math.pi / 2).brake
    return brake


def test_the_mount_comes_from_the_static_transforms(make: Make, capfd: pytest.CaptureFixture[str]) -> None:
    """The scanner looks to the left, so that its rightmost beam looks ahead."""
    node = make()
    node.transform("base_link", "mast", (0.2, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0))
    node.transform("mast", "laser", (0.1, 0.0, 0.0), LEFT)
    assert not seen_at(node, BEAMS // 2)
    node.wait(0.0)
    assert seen_at(node, 0)
    assert node.cause() == pytest.approx((2.3, 0.0), abs=1e-5)
    assert "by the static transforms from base_link to laser" in capfd.readouterr().err


def test_a_scanner_that_hangs_upside_down(make: Make) -> None:
    """Its beams run the other way round: what it sees left is right."""
    for rotation, seen in (((0.0, 0.0, 0.0, 1.0), False), (UPSIDE_DOWN, True)):
        node = make(outline=list(CAR))
        node.transform("base_link", "laser", (0.0, 0.0, 0.3), rotation)
        node.now += PERIOD
        node.odometry(4.0, yaw_rate=8.0 * math.sin(math.radians(30)) / 3.0)  # a circle to the left
        ranges = np.full(BEAMS, 25.0)
        ranges[BEAMS // 2 - 30] = 3.0
        assert node.scan(ranges, frame="laser", angle_max=math.pi / 2).brake is seen


def test_a_mount_that_the_user_gives_wins_and_other_base_frames_are_looked_for(make: Make) -> None:
    for parameters, seen in (({"mount": [0.01, 0.0, 0.0]}, True), ({"base_frame": "car"}, True), ({}, False)):
        node = make(**parameters)
        node.transform("base_link", "laser", (0.2, 0.0, 1.0), LEFT)
        assert seen_at(node, BEAMS // 2) is seen


def test_a_scanner_that_no_transform_places_is_said(make: Make, capfd: pytest.CaptureFixture[str]) -> None:
    for parameters, odd in (({}, 2), ({"mount": [0.2, 0.0, 0.0]}, 0), ({"base_frame": "laser"}, 0)):
        node = make(**parameters)
        node.transform("base_link", "imu", (0.2, 0.0, 1.0), LEFT)
        assert seen_at(node, BEAMS // 2)
        node.transform("base_link", "gps", (0.2, 0.0, 1.0), LEFT)
        seen_at(node, BEAMS // 2)
        assert counted(node, "odd: /scan, frame") == odd
    assert "laser is placed by no static transform, and taken for base_link" in capfd.readouterr().err


def test_a_scanner_that_is_tilted_brakes_until_the_user_places_it(make: Make) -> None:
    down = (0.0, math.sin(math.radians(15)), 0.0, math.cos(math.radians(15)))
    for parameters, brakes in (({}, True), ({"mount": [0.2, 0.0, 0.0]}, False)):
        node = make(**parameters)
        node.transform("base_link", "laser", (0.2, 0.0, 1.0), down)
        node.odometry(1.0)
        assert node.scan(np.full(BEAMS, 20.0), frame="laser").brake is brakes
        assert ("is tilted by 30 degrees" in said(node)) is brakes


def test_a_message_of_transforms_that_raises_changes_nothing() -> None:
    from ttc_fast.ros_messages import Transform

    node = CoreHarness(**AT_ONCE)
    node.transform("base_link", "laser", (0.2, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    still = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)
    moved: Any = [Transform("base_link", "laser", (5.0, 0.0, 0.0), LEFT), Transform("base_link", None, *still)]  # type: ignore[arg-type]
    node.node.on_transforms(moved)
    seen_at(node, BEAMS // 2)
    assert node.cause() == pytest.approx((2.2, 0.0), abs=1e-5)
    assert counted(node, "dropped: /tf_static") == 1


def test_clouds_of_optical_frames_are_read_with_their_axes(make: Make) -> None:
    """4 m ahead, and 0.5 m high, in the axes of a camera; and the same from a mast of 1 m."""
    node = make(**CLOUDS)
    node.odometry(4.0)
    assert node.points([[0.0, -0.5, 4.0]], frame="camera_optical_frame").brake is True
    node = make(**CLOUDS)
    node.transform("base_link", "camera_optical_frame", (0.5, 0.0, 1.0), (-0.5, 0.5, -0.5, 0.5))
    node.odometry(4.0)
    assert node.points([[0.0, 0.5, 4.0], [0.0, 0.0, 0.0]], frame="camera_optical_frame").brake is True
    assert node.cause() == pytest.approx((4.5, 0.0), abs=1e-5)
    assert counted(node, "odd: /points, frame") == 1


# Anything at all

NUMBERS = st.sampled_from([0.0, -0.0, 1.0, -1.0, 0.02, 1e-9, 1e9, -1e300, math.inf, -math.inf, math.nan])
READINGS = st.sampled_from([0.0, 2.0, -1.0, 9.0, math.inf, -math.inf, math.nan])
FRAMES = st.sampled_from(["laser", "rear", "", "/laser", "camera_optical_frame"])
HEADERS = dict.fromkeys((*GEOMETRY, "angle_max"), NUMBERS)


@settings(max_examples=60, deadline=None)
@given(
    scans=st.lists(
        st.tuples(st.fixed_dictionaries({}, optional=HEADERS), st.integers(0, 40), READINGS, NUMBERS, FRAMES),
        max_size=8,
    ),
    twists=st.lists(st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS, NUMBERS, NUMBERS), min_size=8, max_size=8),
)
def test_whatever_a_driver_sends_nothing_raises_and_nothing_unseen_is_safe(scans: Any, twists: Any) -> None:
    node = CoreHarness()
    frames = set()
    for (header, beams, reading, stamp, frame), (speed, yaw_rate, lateral, x, y, yaw) in zip(
        scans, twists, strict=False
    ):
        node.now += PERIOD
        node.odometry(speed, yaw_rate, stamp=stamp, lateral_speed=lateral, pose=Pose(x, y, yaw))
        seen = node.scan(np.full(beams, reading), stamp=node.now, frame=frame, **header)
        decision = node.node._latest
        assert decision is not None
        frames.add(frame.lstrip("/"))
        judged = decision.status is not None and decision.reason.name not in ("WAITING", "STALE", "BLIND", "NO_MOTION")
        assert seen.brake or judged or counted(node, "dropped: /scan")
        assert len(frames) < 2 or seen.brake
    node.diagnostics()
