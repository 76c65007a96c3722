"""What is inside the outline: a cause to brake, unless the vehicle goes, or is told to go, back out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.support.common import CAR
from ttc_fast import BrakeController, Command, IttcThreshold, KthSmallest, Motion, Reason, ScanTTC, SweptPath

if TYPE_CHECKING:
    from ttc_fast.brake import Decision

PERIOD = 0.025
AHEAD, BACK, LEFT, RIGHT = Motion(1.0), Motion(-1.0), Motion(0.0, 1.0), Motion(0.0, -1.0)
FRONT_LEFT, REAR_RIGHT = (0.3, 0.14), (0.0, -0.14)
"""Points inside whose nearest edge is a side."""


class Parked:
    """A controller that looks all around and sees the same points again and again."""

    def __init__(self, *points: tuple[float, float], **settings: Any) -> None:
        settings = {"hold": 0.0, "views": [ScanTTC(-3.14, 0.1, 63, outline=CAR)], **settings}
        self.controller = BrakeController(path=SweptPath(CAR), **settings)
        self.points = np.array(points)
        self.now = 5.0

    def frames(self, count: int, motion: Motion, **more: Any) -> Decision:
        for _ in range(count):
            self.now += PERIOD
            decision = self.controller.update(self.now, points=self.points, stamp=self.now, motion=motion, **more)
        return decision


@pytest.mark.parametrize(
    ("point", "motion", "brakes"),
    [
        (FRONT_LEFT, AHEAD, True),
        (FRONT_LEFT, BACK, False),
        (REAR_RIGHT, AHEAD, False),
        (REAR_RIGHT, BACK, True),
        ((0.15, 0.0), AHEAD, True),  # in the very middle no way leads out
        ((0.15, 0.0), BACK, True),
        (FRONT_LEFT, LEFT, True),  # in place: the front swings towards it
        (FRONT_LEFT, RIGHT, False),
        (FRONT_LEFT, Motion(1.0, 2.0), True),
        (FRONT_LEFT, Motion(-1.0, -2.0), False),
    ],
)
def test_the_way_back_out_is_free_and_the_other_is_not(
    point: tuple[float, float], motion: Motion, brakes: bool
) -> None:
    decision = Parked(point).frames(4, motion)
    expected = (Command.BRAKE, Reason.CRITERION) if brakes else (Command.NONE, Reason.ESCAPE)
    assert (decision.command, decision.reason) == expected
    assert decision.counters.triggered == (4 if brakes else 0)


@pytest.mark.parametrize(
    ("commanded", "command", "reason"),
    [
        (None, Command.WARN, Reason.CONTACT),
        (0.0, Command.WARN, Reason.CONTACT),
        (1.0, Command.BRAKE, Reason.STANDSTILL),
        (-1.0, Command.NONE, Reason.ESCAPE),
        (LEFT, Command.BRAKE, Reason.STANDSTILL),
        (RIGHT, Command.NONE, Reason.ESCAPE),
    ],
)
def test_standing_in_contact_the_commanded_direction_counts(
    commanded: Motion | float | None, command: Command, reason: Reason
) -> None:
    decision = Parked(FRONT_LEFT).frames(6, Motion(0.0), commanded=commanded)
    assert (decision.command, decision.reason) == (command, reason)


def test_braked_for_a_wish_it_stays_braked_until_the_wish_leads_out() -> None:
    parked = Parked(FRONT_LEFT)
    parked.frames(6, Motion(0.0), commanded=1.0)
    assert parked.frames(10, Motion(0.0)).command is Command.BRAKE
    assert parked.frames(5, Motion(0.0), commanded=-1.0).command is Command.NONE
    assert parked.frames(5, BACK, commanded=-1.0).reason is Reason.ESCAPE


def test_a_wish_to_leave_does_not_count_while_it_still_goes_deeper() -> None:
    assert Parked(FRONT_LEFT).frames(4, AHEAD, commanded=-1.0).command is Command.BRAKE


def test_leaving_one_thing_it_brakes_for_the_next() -> None:
    decision = Parked(FRONT_LEFT, (-0.6, 0.0)).frames(4, BACK)
    assert decision.command is Command.BRAKE
    assert decision.threat is not None
    assert decision.threat.index == 1


def test_something_at_both_ends_leaves_no_way() -> None:
    for motion in (AHEAD, BACK):
        assert Parked(FRONT_LEFT, REAR_RIGHT).frames(4, motion).command is Command.BRAKE


@pytest.mark.parametrize(("speed", "command"), [(1.0, Command.BRAKE), (-1.0, Command.NONE)])
def test_beams_as_well(speed: float, command: Command) -> None:
    """A reading of 0.15 m at the left of a sensor that sits in the front half."""
    scan = ScanTTC(-np.pi / 2, np.pi / 180, 181, mount=(0.25, 0.0, 0.0), outline=(-0.1, 0.4, -0.2, 0.2))
    controller, ranges = BrakeController(scan=scan, creep_speed=1.0), np.full(181, 20.0)  # it does not see the way back
    ranges[180] = 0.15
    for frame in range(4):
        stamp = frame * PERIOD
        decision = controller.update(stamp, ranges=ranges, stamp=stamp, motion=Motion(speed))
    assert decision.command is command


def test_off_the_axis_it_brakes_at_the_right_time() -> None:
    """A post at (1.5, 0.85) m before a wide car at 5 m/s: the bumper is there after 1.1 m, whatever its range."""
    controller = BrakeController(path=SweptPath((-0.1, 0.4, -0.9, 0.9)), trigger=(1, 1))
    decision = controller.update(0.0, points=np.array([[1.5, 0.85]]), stamp=0.0, motion=Motion(5.0))
    assert decision.threat is not None
    assert decision.threat.ttc == pytest.approx(1.1 / 5.0)
    assert decision.threat.clearance == pytest.approx(1.1)


def test_too_few_to_vote_leaves_the_decision_to_the_nearest() -> None:
    """One beam of a pole is outvoted, unless there is nobody else to vote."""
    scan = ScanTTC(-0.5, 0.1, 11, minimum=KthSmallest(3))
    controller = BrakeController([IttcThreshold(1.5)], scan=scan, trigger=(1, 1))
    ranges = np.full(11, np.inf)
    ranges[5] = 2.0
    decision = controller.update(0.0, ranges=ranges, stamp=0.0, motion=Motion(4.0))
    assert decision.command is Command.BRAKE
    assert decision.threat is not None
    assert (decision.threat.status.name, decision.threat.index) == ("TOO_FEW", 5)
    crowd = np.full(11, 20.0)
    crowd[5] = 2.0
    assert controller.update(1.0, ranges=crowd, stamp=1.0, motion=Motion(4.0)).value > 1.5
