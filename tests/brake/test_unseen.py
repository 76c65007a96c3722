"""The path that no sensor looks at is not clear: from mount, angles and mask, and from what other sensors see."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.support.common import every_module
from ttc_fast import BrakeController, Command, IttcThreshold, Motion, Reason, ScanTTC, StoppingDistance, SweptPath

if TYPE_CHECKING:
    from ttc_fast.brake import Decision

CAR = (-0.29, 0.29, -0.155, 0.155)
LARGE = (-1.0, 3.7, -0.9, 0.9)
FRONT, REAR, BEHIND = (0.275, 0.0, 0.0), (-0.275, 0.0, math.pi), Motion(-2.0)
PERIOD = 0.025


def settings(view: float, mount: tuple[float, float, float] = FRONT, **more: Any) -> dict[str, Any]:
    """A scanner with a view of so many degrees, one beam for every half of one."""
    beams = int(2 * view)
    angles = {"angle_min": -math.radians(view) / 2, "angle_increment": math.radians(view) / beams, "beams": beams}
    return {**angles, "mount": mount, "outline": CAR, "range_max": 30.0, **more}


class Drive:
    """A controller that sees free space all around."""

    def __init__(self, scan: ScanTTC | None = None, **more: Any) -> None:
        self.controller = BrakeController(scan=scan, **more)
        self.now = 10.0

    def scans(self, count: int, motion: Motion | None, **more: Any) -> Decision:
        assert self.controller.scan is not None
        for _ in range(count):
            self.now += PERIOD
            ranges = np.full(self.controller.scan.beams, 30.0)
            decision = self.controller.update(self.now, ranges=ranges, stamp=self.now, motion=motion, **more)
        return decision

    def cloud(self, motion: Motion, *points: tuple[float, float]) -> Decision:
        self.now += PERIOD
        return self.controller.update(self.now, points=np.array(points), stamp=self.now, motion=motion)


@pytest.mark.parametrize("view", [180.0, 240.0, 270.0, 360.0])
@pytest.mark.parametrize("outline", [CAR, LARGE], ids=["small", "large"])
@every_module
def test_driving_forward_a_scanner_at_the_front_sees_enough(
    module: Any, outline: tuple[float, float, float, float], view: float
) -> None:
    """At every speed, and in every bend that a car can drive: 0.9 m for the small one and 5 m for the large one."""
    for behind_bumper in (0.0, 0.015, 0.1, 0.5):
        mount = (outline[1] - behind_bumper, 0.0, 0.0)
        path = module.ScanSweptPath(module.ScanTTC(**settings(view, mount, outline=outline)))
        for speed in (0.06, 0.3, 1.0, 3.0, 7.0):
            for curvature in np.linspace(-1.0, 1.0, 9) / (0.9 if outline is CAR else 5.0):
                if speed * speed * abs(curvature) < 10.0:
                    ahead = 0.1 + speed / 12.0
                    assert path.unseen(speed, curvature * speed, ahead=ahead) < 0.1, (behind_bumper, speed, curvature)


@pytest.mark.parametrize("view", [60.0, 180.0, 240.0, 270.0])
@every_module
def test_reversing_it_does_not(module: Any, view: float) -> None:
    path = module.ScanSweptPath(module.ScanTTC(**settings(view)))
    for speed in (-0.06, -0.5, -2.0, -4.0):
        for curvature in np.linspace(-1.0, 1.0, 9):
            assert path.unseen(speed, curvature * speed, ahead=0.1 - speed / 12.0) > 0.1, (speed, curvature)


@every_module
def test_the_other_way_round_at_the_rear(module: Any) -> None:
    path = module.ScanSweptPath(module.ScanTTC(**settings(270.0, REAR)))
    assert path.unseen(-2.0, 0.5, ahead=0.3) == 0.0
    assert path.unseen(2.0, 0.5, ahead=0.3) == pytest.approx(0.31)


@every_module
def test_standing_turning_on_the_spot_and_sideways(module: Any) -> None:
    path = module.ScanSweptPath(module.ScanTTC(**settings(270.0)))
    assert path.unseen(0.0, ahead=0.3) == path.unseen(0.0, 3.0, ahead=0.3) == 0.0
    assert path.unseen(0.06, 2.0, ahead=0.1) < 0.1, "the corner that swings back enters nothing"
    half = module.ScanSweptPath(module.ScanTTC(**settings(180.0)))
    assert half.unseen(0.0, 0.0, 1.0, ahead=0.3) > 0.4, "the side leads, and behind the scanner it is not seen"
    assert path.unseen(1.0, 0.0, 0.2, ahead=0.2) == 0.0, "the front leads of a car that slips"


@every_module
def test_a_mask_hides_what_is_wide_enough(module: Any) -> None:
    """Half a degree for each beam: 1 m before the scanner, 20 beams are 17 cm wide, and a post does not hide more."""
    for beams, width in ((1, 0.0), (4, 0.03), (20, 0.17)):
        mask = np.zeros(540, bool)
        mask[270 - beams // 2 : 270 + (beams + 1) // 2] = True
        path = module.ScanSweptPath(module.ScanTTC(**settings(270.0, mask=mask)))
        assert path.unseen(3.0, ahead=1.0 / 3.0) == pytest.approx(width, abs=0.02)


@every_module
def test_the_spacing_of_beams_is_no_gap(module: Any) -> None:
    path = module.ScanSweptPath(module.ScanTTC(-1.5, 0.1, 31, mount=FRONT, outline=CAR))
    assert path.unseen(4.0, ahead=0.45) == 0.0


@every_module
def test_beams_that_look_at_the_vehicle_see_nothing_behind_it(module: Any) -> None:
    ahead_of_it = module.ScanSweptPath(module.ScanTTC(**settings(360.0, (0.31, 0.0, 0.0))))
    over_it = module.ScanSweptPath(module.ScanTTC(**settings(360.0)))
    assert ahead_of_it.unseen(-1.0, ahead=0.2) == pytest.approx(0.31)
    assert over_it.unseen(-1.0, ahead=0.2) == 0.0


@every_module
def test_scanners_cover_for_one_another(module: Any) -> None:
    front, rear = (module.ScanSweptPath(module.ScanTTC(**settings(*each))) for each in ((270.0, FRONT), (60.0, REAR)))
    narrow = module.ScanSweptPath(module.ScanTTC(**settings(6.0, REAR)))
    assert front.unseen(-2.0, ahead=0.3, others=[rear]) == 0.0
    assert front.unseen(-2.0, ahead=0.3, others=[narrow]) > 0.1, "a strip at either side stays unseen"
    assert rear.unseen(2.0, ahead=0.3, others=[narrow, front]) == 0.0


@every_module
@pytest.mark.parametrize("wrong", [{"ahead": -0.1}, {"ahead": math.nan}, {"ahead": 0.1, "speed": math.inf}])
def test_senseless_numbers_are_refused(module: Any, wrong: dict[str, float]) -> None:
    path = module.ScanSweptPath(module.ScanTTC(**settings(270.0)))
    with pytest.raises(ValueError, match=next(iter({**wrong}.keys() - {"ahead"} or {"ahead"}))):
        path.unseen(**{"speed": 1.0, **wrong})


def test_reversing_where_nothing_looks_brakes_and_is_held() -> None:
    drive = Drive(ScanTTC(**settings(270.0)), hold=0.0)
    first, decision = drive.scans(1, BEHIND), drive.scans(2, BEHIND)
    assert (first.command, first.reason) == (Command.WARN, Reason.UNSEEN)
    assert (decision.command, decision.reason) == (Command.BRAKE, Reason.UNSEEN)
    assert drive.scans(20, Motion(0.0)).reason is Reason.UNSEEN, "it would go on where nothing looks"
    assert drive.scans(20, Motion(0.0), commanded=-0.3).command is Command.BRAKE
    assert drive.scans(5, Motion(0.0), commanded=1.0).command is Command.NONE


def test_forward_in_bends_nothing_is_unseen() -> None:
    drive = Drive(ScanTTC(**settings(270.0)))
    for yaw_rate in (0.0, 1.0, -2.0):
        assert drive.scans(3, Motion(2.0, yaw_rate)).reason is Reason.CLEAR
    assert drive.scans(3, Motion(0.0, 2.0)).reason is Reason.CLEAR
    assert drive.scans(3, Motion(-0.04)).reason is Reason.CLEAR, "odometry at a standstill is not quite 0"


def test_one_odd_speed_brakes_nothing() -> None:
    drive = Drive(ScanTTC(**settings(270.0)))
    commands = [drive.scans(1, Motion(speed)).command for speed in (1.0, 1.0, -1.0, 1.0, 1.0, 1.0)]
    assert commands == [Command.NONE, Command.NONE, Command.WARN, Command.NONE, Command.NONE, Command.NONE]


def test_creeping_is_allowed_as_far_as_the_user_says() -> None:
    drive = Drive(ScanTTC(**settings(270.0)), creep_speed=0.5)
    assert drive.scans(5, Motion(-0.5)).command is Command.NONE
    assert drive.scans(5, Motion(-0.6)).command is Command.BRAKE


def test_warning_instead() -> None:
    drive = Drive(ScanTTC(**settings(270.0)), when_blind=Command.WARN, creep_speed=0.3)
    decision = drive.scans(9, BEHIND)
    assert (decision.command, decision.reason, decision.speed_limit) == (Command.WARN, Reason.UNSEEN, 0.3)


def test_in_warning_mode_a_brake_is_let_go_for_the_way_back() -> None:
    drive = Drive(ScanTTC(**settings(270.0)), when_blind=Command.WARN, hold=0.0)
    wall = np.full(540, 0.5)
    for _ in range(3):
        drive.now += PERIOD
        drive.controller.update(drive.now, ranges=wall, stamp=drive.now, motion=Motion(2.0))
    drive.now += PERIOD
    assert drive.controller.update(drive.now, ranges=wall, stamp=drive.now, motion=Motion(0.0)).command is Command.BRAKE
    assert drive.scans(5, Motion(0.0), commanded=-1.0).command is Command.NONE
    assert drive.scans(5, Motion(-1.0), commanded=-1.0).reason is Reason.UNSEEN


def test_without_an_outline_or_odometry_nothing_is_judged() -> None:
    bare = ScanTTC(**{**settings(270.0), "outline": None})
    assert Drive(bare, criteria=[IttcThreshold(), StoppingDistance()]).scans(5, BEHIND).reason is Reason.CLEAR
    assert Drive(ScanTTC(**settings(270.0))).scans(5, None).reason is Reason.NO_MOTION


def both(**more: Any) -> Drive:
    return Drive(ScanTTC(**settings(270.0)), path=SweptPath(CAR), **more)


def test_a_range_finder_at_the_rear_covers() -> None:
    """Its one return lies behind the vehicle. When it falls silent, nothing looks there any more."""
    drive = both()
    for _ in range(8):
        drive.cloud(BEHIND, (-8.0, 0.0))
        assert drive.scans(1, BEHIND).reason is Reason.CLEAR
    assert drive.scans(10, BEHIND).reason is Reason.CLEAR
    assert drive.scans(4, BEHIND).command is Command.BRAKE


def test_a_camera_at_the_front_does_not_cover_the_rear() -> None:
    drive = both()
    for _ in range(8):
        decisions = drive.cloud(BEHIND, (3.0, 0.0), (8.0, 2.0)), drive.scans(1, BEHIND)
    assert {decision.reason for decision in decisions} == {Reason.UNSEEN}


def test_a_range_finder_brakes_for_what_it_sees() -> None:
    drive = both()
    for _ in range(4):
        drive.scans(1, BEHIND)
        decision = drive.cloud(BEHIND, (-1.0, 0.0))
    assert (decision.command, decision.reason) == (Command.BRAKE, Reason.CRITERION)


def test_a_second_scanner_covers_by_its_view_even_where_it_sees_nothing() -> None:
    drive = both(views=[ScanTTC(**settings(180.0, REAR))])
    drive.cloud(BEHIND, (-3.0, 5.0))
    assert drive.scans(8, BEHIND).reason is Reason.CLEAR
    assert drive.scans(9, BEHIND).reason is Reason.UNSEEN, "its newest points are too old"


def test_a_view_that_does_not_look_there_does_not_cover() -> None:
    drive = both(views=[ScanTTC(**settings(60.0))])
    for _ in range(5):
        drive.cloud(BEHIND, (-8.0, 0.0))
        decision = drive.scans(1, BEHIND)
    assert decision.reason is Reason.UNSEEN


def test_a_scanner_that_fell_silent_does_not_look() -> None:
    """The clouds go on, and look back only."""
    drive = both(views=[ScanTTC(**settings(180.0, REAR))])
    drive.scans(3, Motion(2.0))
    for _ in range(16):
        decision = drive.cloud(Motion(2.0), (-3.0, 0.0))
    assert decision.reason is Reason.UNSEEN


def test_points_alone_are_judged_by_their_views() -> None:
    drive = Drive(path=SweptPath(CAR), views=[ScanTTC(**settings(60.0))])
    assert [drive.cloud(BEHIND, (3.0, 0.0)) for _ in range(3)][-1].command is Command.BRAKE
    drive = Drive(path=SweptPath(CAR), views=[ScanTTC(**settings(360.0))])
    assert [drive.cloud(BEHIND, (3.0, 0.0)) for _ in range(3)][-1].command is Command.NONE


@pytest.mark.parametrize("motion", [BEHIND, Motion(0.0, 0.0, 1.0), Motion(-0.5, 1.0)])
def test_points_alone_without_views_are_taken_to_look_ahead_and_where_they_are(motion: Motion) -> None:
    """A camera at the front has no point behind; a lidar that looks all around has."""
    drive = Drive(path=SweptPath(CAR))
    assert [drive.cloud(Motion(2.0), (3.0, 2.0)).reason for _ in range(3)] == [Reason.CLEAR] * 3
    camera = [drive.cloud(motion, (3.0, 2.0)) for _ in range(3)]
    assert [each.reason for each in camera] == [Reason.UNSEEN] * 3
    assert camera[-1].command is Command.BRAKE
    lidar = Drive(path=SweptPath(CAR))
    around = [(9.0, 0.0), (-9.0, 0.0), (0.0, 9.0), (0.0, -9.0)]
    assert [lidar.cloud(motion, *around).reason for _ in range(3)] == [Reason.CLEAR] * 3
