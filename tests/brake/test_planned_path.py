"""`update(..., path=)`: a frame is assessed along the way that the vehicle will go."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.support.common import CAR
from ttc_fast import BrakeController, Command, Motion, PresentArc, Reason, ScanSweptPath, ScanTTC, SweptPath

BEAMS = 181
WALL = np.full(BEAMS, np.inf)
ANGLES = np.linspace(-1.57, 1.57, BEAMS)
WALL[np.abs(ANGLES) < 0.8] = 3.0 / np.cos(ANGLES[np.abs(ANGLES) < 0.8])
"""A wall across at x = 3 m, open to the left and to the right."""


def bend(angle: float = 1.5, radius: float = 1.5) -> Any:
    """A path that turns left before the wall."""
    turned = np.linspace(0.0, angle, 20)
    return np.column_stack([radius * np.sin(turned), radius * (1.0 - np.cos(turned))])


def scanner() -> ScanTTC:
    return ScanTTC(ANGLES[0], ANGLES[1] - ANGLES[0], BEAMS, outline=CAR)


def controller(**more: Any) -> BrakeController:
    return BrakeController(scan=scanner(), trigger=(1, 1), **more)


def frame(controller: BrakeController, at: float, speed: float = 4.0, **more: Any) -> Any:
    return controller.update(at, ranges=WALL, stamp=at, motion=Motion(speed, stamp=at), **more)


def test_what_is_beside_the_path_is_no_cause() -> None:
    assert frame(controller(), 1.0).command is Command.BRAKE
    decision = frame(controller(), 1.0, path=bend())
    assert (decision.command, decision.reason) == (Command.NONE, Reason.CLEAR)


def test_a_speed_may_be_a_scalar_of_numpy() -> None:
    decision = frame(controller(), 1.0, speed=np.float64(4.0), path=bend())
    assert (decision.command, decision.reason) == (Command.NONE, Reason.CLEAR)


def test_what_is_on_it_is_one_although_the_present_arc_is_free() -> None:
    control = controller()
    turning = Motion(4.0, 4.0 / 1.5, stamp=1.0)
    assert control.update(1.0, ranges=WALL, stamp=1.0, motion=turning).command is Command.NONE
    straight = [[0.0, 0.0], [5.0, 0.0]]
    decision = control.update(1.1, ranges=WALL, stamp=1.1, motion=turning._replace(stamp=1.1), path=straight)
    assert decision.command is Command.BRAKE
    assert decision.threat is not None
    assert decision.threat.clearance == pytest.approx(2.6, abs=1e-3)


@pytest.mark.parametrize(
    "path",
    [
        [[0.0, 0.0], [0.0, 0.0], [-1.0, 0.0], [-5.0, 0.0]],
        [[0.0, 0.0], [1e-6, 0.0], [-1.0, 0.0], [-5.0, 0.0]],
        [[0.1, 0.0], [0.1, 0.0], [-1.0, 0.0], [-5.0, 0.0]],
    ],
)
@pytest.mark.parametrize("speed", [4.0, -4.0])
def test_which_way_a_path_leads_is_seen_by_its_first_points_apart(path: Any, speed: float) -> None:
    """A path that leads back does not count for a car that drives forward, however its first points lie."""
    ways = [path, (-np.array(path)).tolist()]
    back, forward = (frame(controller(creep_speed=9.0), 1.0, speed, path=way) for way in ways)
    arc = frame(controller(creep_speed=9.0), 1.0, speed)
    assert back.command is forward.command is arc.command is (Command.BRAKE if speed > 0.0 else Command.NONE)


def test_a_function_of_the_way() -> None:
    asked = []

    def path(way: Any) -> Any:
        asked.append(way)
        return np.column_stack([1.5 * np.sin(way / 1.5), 1.5 * (1.0 - np.cos(way / 1.5))])[way < 2.3]

    assert frame(controller(), 1.0, path=path).command is Command.NONE
    assert (asked[0][0], asked[0][-1], asked[0].shape) == (0.0, 20.0, (50,))


def test_it_is_that_of_its_frame_alone() -> None:
    control = controller()
    assert frame(control, 1.0, path=bend()).command is Command.NONE
    assert frame(control, 1.025).command is Command.BRAKE


def test_one_that_leads_the_other_way_does_not_count() -> None:
    assert frame(controller(), 1.0, path=-bend()).command is Command.BRAKE
    assert frame(controller(), 1.0, speed=-0.001, path=bend()).command is Command.NONE


@pytest.mark.parametrize("place", [(0.0, 0.0), (0.2, 0.1)])
def test_the_path_of_a_planner_that_has_arrived_leads_nowhere(place: Any) -> None:
    """All its points are in one place: no error, whether the vehicle stands, still rolls, or is asked to go on."""
    there = [place] * 5
    control = controller(hold=0.0, release=(1, 1))
    assert frame(control, 1.0, speed=0.0, path=there).command is Command.NONE
    rolls, along_arc = frame(control, 1.1, speed=0.3, path=there), frame(controller(), 1.1, speed=0.3)
    assert repr(rolls.threats) == repr(along_arc.threats)
    assert frame(control, 1.2, path=there).command is Command.BRAKE
    assert frame(control, 1.3, speed=0.0, path=there).command is Command.BRAKE
    assert frame(control, 1.4, speed=0.0, path=there, commanded=1.0).command is Command.NONE
    assert frame(control, 1.5, speed=0.0, path=there, commanded=4.0).command is Command.NONE


def test_a_braked_vehicle_is_let_go_along_its_path() -> None:
    """It stands before the wall. What it would go on with is the path."""
    control = controller(hold=0.0, release=(1, 1))
    assert frame(control, 1.0).command is Command.BRAKE
    assert frame(control, 1.1, speed=0.0).command is Command.BRAKE
    assert frame(control, 1.2, speed=0.0, path=bend()).command is Command.NONE


def test_points_of_a_cloud() -> None:
    control = BrakeController(path=SweptPath(CAR), trigger=(1, 1))
    cloud, motion = np.array([[3.0, 0.0], [-2.0, 1.0]]), Motion(4.0)
    assert control.update(1.0, points=cloud, stamp=1.0, motion=motion, path=bend()).command is Command.NONE
    assert control.update(1.1, points=cloud, stamp=1.1, motion=motion).command is Command.BRAKE


@pytest.mark.parametrize(
    ("path", "kind", "words"),
    [
        ([[0.0, 0.0]], ValueError, "path must have shape"),
        ([[0.0, 0.0], [np.nan, 0.0]], ValueError, "path must be finite"),
        ([[5.0, 0.0], [6.0, 0.0]], ValueError, "path must start at the vehicle"),
        ("left", TypeError, "path must be points"),
        (lambda way: way, ValueError, "path must have shape"),
    ],
)
def test_a_path_that_is_none_changes_nothing(path: Any, kind: type[Exception], words: str) -> None:
    control = controller()
    frame(control, 1.0, path=bend())
    before = control.state()
    with pytest.raises(kind, match=words):
        frame(control, 1.1, path=path)
    assert control.state() == before


def test_it_needs_an_outline() -> None:
    control = BrakeController(scan=ScanTTC(-1.0, 0.1, 21))
    with pytest.raises(ValueError, match="path needs an outline"):
        control.update(1.0, ranges=np.full(21, 5.0), stamp=1.0, motion=Motion(1.0), path=bend())


class TestNamedSettings:
    def test_racing_is_let_go_by_a_path_and_careful_is_not(self) -> None:
        scan = controller().scan
        assert scan is not None
        racing, careful = BrakeController.racing(scan), BrakeController.careful(scan)
        for at in (1.0, 1.025, 1.05):
            assert frame(racing, at, path=bend()).command is Command.NONE
            last = frame(careful, at)
        assert last.command is Command.BRAKE
        assert [frame(racing, at).command for at in (1.075, 1.1)] == [Command.WARN, Command.BRAKE]

    def test_racing_brakes_for_its_present_arc_at_the_last_moment(self) -> None:
        """It is 0.6 m before the wall at 4 m/s, and its plan leads away: it cannot leave its arc in 0.15 s."""
        control = BrakeController.racing(ScanTTC(ANGLES[0], ANGLES[1] - ANGLES[0], BEAMS, outline=CAR), trigger=(1, 1))
        near = WALL / 3.0
        beside = np.array([[0.0, 0.0], [0.1, 0.0], [0.15, 0.1], [0.1 + 0.1, 0.3], [0.2, 3.0]])
        decision = control.update(1.0, ranges=near, stamp=1.0, motion=Motion(4.0), path=beside)
        assert decision.command is Command.BRAKE
        assert decision.threats is not None
        assert decision.threats.arc is not None
        assert decision.threats.arc.ttc == pytest.approx(0.6 / 4.0, abs=1e-3)
        assert control.update(1.1, ranges=near, stamp=1.1, motion=Motion(4.0)).threats.arc is None  # type: ignore[union-attr]

    def test_what_is_given_replaces_the_set(self) -> None:
        scan = controller().scan
        assert scan is not None
        assert BrakeController.careful(scan, warn_at=3.0, hold=1.0).settings.warn_at == 3.0
        with pytest.raises(ValueError, match="needs an outline"):
            BrakeController.racing(ScanTTC(-1.0, 0.1, 21))


class TestTurns:
    """A car between two walls, 0.6 m to its left and 3 m to its right, that drives along them."""

    SCAN = ScanTTC(ANGLES[0], ANGLES[1] - ANGLES[0], BEAMS, outline=CAR)
    SHARPEST = 1.25

    def aside(self) -> Any:
        sine = np.sin(ANGLES)
        with np.errstate(divide="ignore"):
            return np.where(sine > 0.0, 0.6, 3.0) / np.abs(sine)

    def decide(self, speed: float, criteria: Any, **more: Any) -> Any:
        control = BrakeController(criteria, scan=self.SCAN, trigger=(1, 1))
        return control.update(1.0, ranges=self.aside(), stamp=1.0, motion=Motion(speed, stamp=1.0), **more)

    def test_a_wall_beside_the_car_is_a_cause_where_it_may_turn_into_it(self) -> None:
        assert self.decide(2.0, [PresentArc()]).command is Command.NONE
        decision = self.decide(2.0, [PresentArc(sharpest=self.SHARPEST)])
        assert decision.command is Command.BRAKE
        path = ScanSweptPath(self.SCAN)
        arcs = [path.nearest(self.aside(), 2.0, share * self.SHARPEST * 2.0) for share in (-1.0, -0.5, 0.5, 1.0)]
        assert decision.threats.turn.ttc == min(each.ttc for each in arcs)
        assert decision.threat.angle > 0.0

    def test_no_farther_than_tires_hold(self) -> None:
        """At 6 m/s an arc of 10 m/s^2 is 0.28 1/m."""
        turn = self.decide(6.0, [PresentArc(sharpest=self.SHARPEST)]).threats.turn
        assert turn.ttc == ScanSweptPath(self.SCAN).nearest(self.aside(), 6.0, 10.0 / 6.0).ttc

    @pytest.mark.parametrize("speed", [2.0, 5.0])
    def test_along_a_plan_it_does_not_turn(self, speed: float) -> None:
        assert self.decide(speed, [PresentArc(sharpest=self.SHARPEST)]).command is Command.BRAKE
        decision = self.decide(speed, [PresentArc(sharpest=self.SHARPEST)], path=[[0.0, 0.0], [9.0, 0.0]])
        assert (decision.command, decision.threats.turn) == (Command.NONE, None)

    def test_nor_does_it_where_it_stands(self) -> None:
        assert self.decide(0.0, [PresentArc(sharpest=self.SHARPEST)]).threats.turn is None

    def test_a_cloud(self) -> None:
        path = SweptPath(CAR)
        points = np.array([[1.0, 0.5]])
        control = BrakeController([PresentArc(sharpest=self.SHARPEST)], path=path, trigger=(1, 1))
        decision = control.update(1.0, points=points, stamp=1.0, motion=Motion(2.0, stamp=1.0))
        assert decision.command is Command.BRAKE
        assert decision.threats is not None
        assert decision.threats.turn is not None
        arcs = [path.nearest(points, 2.0, share * self.SHARPEST * 2.0).ttc for share in (0.5, 1.0)]
        assert decision.threats.turn.ttc == min(arcs)

    def test_racing_takes_the_bend_of_its_length(self) -> None:
        *_, arc = BrakeController.racing(self.SCAN).criteria
        assert arc == PresentArc(sharpest=0.8 / (CAR[1] - CAR[0]))


class TestAPathThatIsNotFollowed:
    """A car drives straight at a wall, and its plan turns away from it in every frame."""

    def gap_of_brake(
        self, speed: float, made: Any = BrakeController, yaw_rate: float = 0.0, radius: float = 1.5
    ) -> float:
        """How far the bumper is from the wall when it begins to brake."""
        control, wall = made(scan=scanner()), 8.0
        for at in np.arange(0.0, 9.0, 0.025):
            ahead = wall - speed * at
            if ahead < CAR[1]:
                break
            ranges = np.full(BEAMS, np.inf)
            ranges[np.abs(ANGLES) < 0.8] = ahead / np.cos(ANGLES[np.abs(ANGLES) < 0.8])
            plan = bend(radius=radius)
            motion = Motion(speed, yaw_rate, stamp=at)
            if control.update(at, ranges=ranges, stamp=at, motion=motion, path=plan).command is Command.BRAKE:
                return float(ahead - CAR[1])
        return 0.0

    @pytest.mark.parametrize("made", [BrakeController, BrakeController.racing])
    @pytest.mark.parametrize("speed", [1.0, 2.0, 4.0, 6.0])
    def test_it_brakes_while_it_can_stop(self, made: Any, speed: float) -> None:
        assert self.gap_of_brake(speed, made) > 0.05 * speed + speed**2 / 12.0

    @pytest.mark.parametrize("yaw_rate", [4.0 / 1.5, 4.0 / 2.0, 4.0 / 1.3])
    def test_a_car_that_turns_as_planned_is_not_disturbed(self, yaw_rate: float) -> None:
        control = BrakeController.racing(scanner(), trigger=(1, 1))
        motion = Motion(4.0, yaw_rate)
        assert control.update(1.0, ranges=WALL, stamp=1.0, motion=motion, path=bend()).command is Command.NONE

    def test_one_that_is_a_little_late_is_not_either(self) -> None:
        """At 2 m/s it turns on 2 m instead of 1.5 m."""
        assert self.gap_of_brake(2.0, yaw_rate=2.0 / 2.0) == self.gap_of_brake(2.0, yaw_rate=2.0 / 1.5)

    def test_points_of_a_cloud(self) -> None:
        control = BrakeController(path=SweptPath(CAR), trigger=(1, 1))
        cloud = np.array([[2.0, 0.0], [2.0, 0.1]])
        for turns, command in ((4.0 / 1.5, Command.NONE), (0.0, Command.BRAKE)):
            at = 1.0 + (command is Command.BRAKE)
            motion = Motion(4.0, turns)
            assert control.update(at, points=cloud, stamp=at, motion=motion, path=bend()).command is command
