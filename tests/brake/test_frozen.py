"""A sensor that sends the same readings to the bit while the vehicle drives is as bad as one that has fallen silent."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.support.common import CAR
from ttc_fast import (
    BrakeController,
    Command,
    Estimate,
    EstimateThreshold,
    Motion,
    Reason,
    ScanTTC,
    Status,
    StoppingDistance,
    SweptPath,
    SweptPathThreshold,
)
from ttc_fast.ros.core import BrakeNode
from ttc_fast.ros.settings import NodeSettings

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from ttc_fast.brake import Decision

CRITERIA = [SweptPathThreshold(), StoppingDistance(), EstimateThreshold()]
BEAMS = 181
ANGLES = np.linspace(-2.2, 2.2, BEAMS)
PERIOD = 0.025
HALL = np.full(BEAMS, 15.0)
"""Walls all around, out of reach of every criterion at 4 m/s but one: there is nothing on the path for 3.6 s."""


def scanner(**more: Any) -> ScanTTC:
    return ScanTTC(ANGLES[0], ANGLES[1] - ANGLES[0], BEAMS, outline=CAR, **more)


def corridor(end: float = math.inf) -> NDArray[np.float64]:
    """A corridor 2 m wide, by a simulator without noise."""
    with np.errstate(divide="ignore"):
        walls = 1.0 / np.abs(np.sin(ANGLES))
        walls[walls > 20.0] = math.inf
        return np.minimum(walls, np.where(np.abs(ANGLES) < 1.5, end / np.cos(ANGLES), math.inf))


def drive(seconds: float, speed: float, scan_of: Callable[[int], Any], **more: Any) -> list[Decision]:
    """Decisions on scans at 40 Hz, each with a stamp of its own."""
    controller = BrakeController(scan=more.pop("scan", None) or scanner(), **more)
    motion, stamps = Motion(speed), [10.0 + PERIOD * i for i in range(round(seconds / PERIOD))]
    return [controller.update(stamp, ranges=scan_of(i), stamp=stamp, motion=motion) for i, stamp in enumerate(stamps)]


def first(decisions: list[Decision], reason: Reason) -> float:
    """Return when a reason comes first, s from the start."""
    return next((PERIOD * i for i, each in enumerate(decisions) if each.reason is reason), math.inf)


@pytest.mark.parametrize("speed", [1.0, 2.0, 4.0, 8.0])
def test_a_frozen_scanner_is_noticed_by_the_way_that_is_driven(speed: float) -> None:
    """After 0.75 m and 0.3 s: as soon as a silent one, but for the slow."""
    decisions = drive(1.0, speed, lambda _: HALL + 9.0 * speed)
    assert first(decisions, Reason.STALE) == pytest.approx(max(0.75 / speed, 0.3), abs=2 * PERIOD)
    assert decisions[-1].command is Command.BRAKE
    assert decisions[-1].status is Status.STALE
    assert decisions[-1].threats is None


@pytest.mark.parametrize("kind", [np.float32, list, tuple])
def test_readings_of_any_kind(kind: Any) -> None:
    ranges = HALL.astype(kind) if kind is np.float32 else kind(HALL.tolist())
    assert drive(0.5, 4.0, lambda _: ranges)[-1].reason is Reason.STALE


def test_a_reading_that_changes_is_enough() -> None:
    def scan(i: int) -> Any:
        ranges = HALL.copy()
        ranges[0] += 1e-9 * i
        return ranges

    assert {each.reason for each in drive(2.0, 4.0, scan)} == {Reason.CLEAR}


def test_it_votes_again_when_readings_are_new() -> None:
    decisions = drive(2.0, 4.0, lambda i: HALL + 9.0 + (max(i - 20, 0) * 1e-6), hold=0.0)
    assert first(decisions, Reason.STALE) < 0.4
    assert decisions[20].command is Command.BRAKE
    assert decisions[-1].reason is Reason.CLEAR


@pytest.mark.parametrize(
    ("speed", "ranges"),
    [
        (0.0, HALL),
        (0.04, HALL),
        (1.0, HALL[:]),
        (4.0, np.full(BEAMS, math.inf)),
        (4.0, np.full(BEAMS, 30.0)),
        (4.0, corridor()),
    ],
    ids=["it stands", "odometry at a standstill", "slow for 0.5 s", "open field", "greatest range", "corridor"],
)
def test_scans_that_are_rightly_the_same(speed: float, ranges: Any) -> None:
    seconds = 0.5 if speed == 1.0 else 3.0
    assert {each.reason for each in drive(seconds, speed, lambda _: ranges, scan=scanner(range_max=30.0))} == {
        Reason.CLEAR
    }


def test_the_end_of_a_corridor_would_have_come_nearer() -> None:
    assert drive(0.5, 4.0, lambda _: corridor(19.0))[-1].reason is Reason.STALE


def test_a_simulator_that_publishes_faster_than_it_measures() -> None:
    """A new scan every 0.2 s, at 8 m/s: each is repeated over 1.6 m."""
    assert {each.reason for each in drive(2.0, 8.0, lambda i: HALL + 60.0 - i // 8)} == {Reason.CLEAR}


def test_a_car_that_starts_while_a_simulator_repeats_scans() -> None:
    """After half a second without scans it drives: it has not driven all that time."""
    controller = BrakeController(scan=scanner())
    stamps = [*(10.0 + PERIOD * i for i in range(20)), 11.0, 11.025]
    for stamp in stamps:
        motion = Motion(4.0 if stamp >= 11.0 else 0.0)
        decision = controller.update(stamp, ranges=HALL, stamp=stamp, motion=motion)
    assert decision.status is not Status.STALE


def test_two_frozen_scans_that_take_turns() -> None:
    """A driver that has stopped between two buffers."""
    decisions = drive(1.0, 4.0, lambda i: HALL + 40.0 + 1e-3 * (i % 2))
    assert first(decisions, Reason.STALE) == pytest.approx(0.3, abs=3 * PERIOD)
    assert decisions[-1].command is Command.BRAKE


@pytest.mark.parametrize("large", [False, True])
def test_a_frozen_cloud(large: bool) -> None:
    controller = BrakeController(path=SweptPath(CAR))
    turned = np.linspace(-3.0, 3.0, 20_000 if large else 50)
    cloud = np.column_stack([15.0 * np.cos(turned), 15.0 * np.sin(turned), np.zeros(len(turned))])
    for i in range(20):
        stamp = 10.0 + PERIOD * i
        decision = controller.update(stamp, points=cloud, stamp=stamp, motion=Motion(4.0))
    assert (decision.command, decision.reason) == (Command.BRAKE, Reason.STALE)


def test_a_scanner_that_froze_does_not_look_while_clouds_go_on() -> None:
    """The clouds look back only: as with a scanner that fell silent, nothing looks ahead."""
    rear = ScanTTC(-1.5, 0.1, 31, mount=(-0.1, 0.0, math.pi), outline=CAR)
    controller = BrakeController(scan=scanner(), path=SweptPath(CAR), views=[rear])
    for i in range(40):
        stamp = 10.0 + PERIOD * i
        controller.update(stamp, ranges=HALL, stamp=stamp, motion=Motion(4.0))
        cloud = np.array([[-5.0, 1.0 + 1e-6 * i]])
        decision = controller.update(stamp, points=cloud, stamp=stamp, motion=Motion(4.0))
    assert (decision.command, decision.reason) == (Command.BRAKE, Reason.UNSEEN)


def test_a_state_keeps_it_in_mind() -> None:
    one, other = (BrakeController(scan=scanner()) for _ in range(2))
    for i in range(16):
        stamp = 10.0 + PERIOD * i
        other.restore(one.state())
        decisions = [each.update(stamp, ranges=HALL, stamp=stamp, motion=Motion(4.0)) for each in (one, other)]
        assert repr(decisions[0]) == repr(decisions[1])
    assert decisions[1].reason is Reason.STALE


def test_in_a_node() -> None:
    from types import SimpleNamespace

    node = BrakeNode(NodeSettings.of({"outline": CAR}))
    scan = SimpleNamespace(
        angle_min=ANGLES[0],
        angle_increment=ANGLES[1] - ANGLES[0],
        range_min=0.1,
        range_max=30.0,
        time_increment=0.0,
        ranges=HALL.astype(np.float32),
    )
    for i in range(40):
        stamp = 100.0 + PERIOD * i
        node.on_odometry(stamp, stamp, speed=4.0)
        decision = node.on_scan(stamp, stamp, scan).decision
    assert (decision.command, decision.reason) == (Command.BRAKE, Reason.STALE)


class TestEstimatesBesideAScan:
    """A stale or empty estimate holds no brake that the scan says is over."""

    def told(
        self, estimate_of: Callable[[float], Estimate], seconds: float = 3.0, speed: float = 2.0
    ) -> list[Decision]:
        controller, decisions = BrakeController(CRITERIA, scan=scanner()), []
        for i in range(round(seconds / PERIOD)):
            stamp = 10.0 + PERIOD * i
            near = HALL.copy() + 1e-6 * i
            if i < 8:
                near[80:101] = 2.0
            told: dict[str, Any] = {"estimate": estimate_of(stamp), "motion": Motion(speed)}
            decisions.append(controller.update(stamp, ranges=near, stamp=stamp, **told))
        assert decisions[6].command is Command.BRAKE
        return decisions

    @pytest.mark.parametrize("status", [Status.TOO_FEW, Status.WARMING_UP, Status.LOST, Status.STALE])
    def test_one_that_says_nothing(self, status: Status) -> None:
        decisions = self.told(lambda stamp: Estimate(stamp, math.inf, status=status))
        assert decisions[-1].reason is Reason.CLEAR

    @pytest.mark.parametrize("repeated", [Estimate(0.0, 0.8), Estimate(0.0, 1.2, (0.9, 1.5), 2.4, 2.0)])
    def test_one_that_is_repeated_to_the_bit(self, repeated: Estimate) -> None:
        decisions = self.told(lambda stamp: repeated._replace(stamp=stamp))
        assert decisions[-1].reason is Reason.CLEAR

    def test_one_that_rests_on_an_old_measurement(self) -> None:
        decisions = self.told(lambda stamp: Estimate(stamp, 0.5, age=max(stamp - 10.2, 0.0)))
        assert decisions[-1].reason is Reason.CLEAR

    def test_one_that_goes_on_does(self) -> None:
        decisions = self.told(lambda stamp: Estimate(stamp, 0.5 + 1e-6 * stamp))
        assert decisions[-1].reason is Reason.CRITERION

    def test_it_lets_nothing_go_that_the_scan_shows(self) -> None:
        controller = BrakeController(scan=scanner(), hold=0.0)
        for i in range(80):
            stamp, near = 10.0 + PERIOD * i, HALL.copy() + 1e-6 * i
            near[80:101] = 2.0
            empty = Estimate(stamp, math.inf, status=Status.TOO_FEW)
            decision = controller.update(
                stamp, ranges=near, stamp=stamp, motion=Motion(2.0 if i < 20 else 0.0), estimate=empty
            )
        assert (decision.command, decision.reason) == (Command.BRAKE, Reason.STANDSTILL)


def test_few_coarse_readings_that_flicker_are_not_frozen() -> None:
    """A range finder in steps of 1 cm: it reads one of two values again and again, and a wall comes nearer."""
    controller = BrakeController(scan=ScanTTC(0.0, 0.02, 1, range_max=40.0), when_blind=Command.WARN)
    rng = np.random.default_rng(0)
    reasons = []
    for i in range(200):
        stamp, ranges = 0.05 * i, np.array([12.0 + 0.01 * (rng.random() < 0.5)])
        reasons.append(controller.update(stamp, ranges=ranges, stamp=stamp, motion=Motion(5.0 + 0.05 * i)).reason)
    assert Reason.STALE not in reasons
    assert reasons[-1] is Reason.CRITERION


def test_odometry_that_flickers_does_not_hide_a_frozen_scanner() -> None:
    controller, frozen = BrakeController(scan=scanner()), np.full(BEAMS, 60.0)
    frozen[::7] = 25.0
    for i in range(40):
        stamp = 0.025 * i
        decision = controller.update(stamp, ranges=frozen, stamp=stamp, motion=Motion(4.0 * (i % 2)))
    assert decision.reason is Reason.STALE


class TestEstimatesAlone:
    """A tracker that repeats itself to the bit under new stamps, and does not say the age of its measurement."""

    CLOSING = Estimate(0.0, 9.0, (8.0, 10.0), 20.0, 20.0 / 9.0, (2.0, 2.5), Status.CLOSING)

    def told(self, estimates: list[Estimate], **settings: Any) -> list[Decision]:
        """Decisions on estimates at 20 Hz, each with a stamp of its own."""
        controller = BrakeController(**{"hold": 0.0, **settings})
        stamps = [10.0 + 0.05 * i for i in range(len(estimates))]
        return [
            controller.update(stamp, estimate=each._replace(stamp=stamp), motion=Motion(4.0))
            for stamp, each in zip(stamps, estimates, strict=True)
        ]

    @pytest.mark.parametrize(
        "frozen", [CLOSING, Estimate(0.0, 9.0), CLOSING._replace(status=None), CLOSING._replace(status=Status.LOST)]
    )
    def test_is_stale_as_a_silent_one(self, frozen: Estimate) -> None:
        decisions = self.told([frozen] * 30)
        assert {each.reason for each in decisions[:6]} == {Reason.CLEAR}
        assert {(each.command, each.reason) for each in decisions[8:]} == {(Command.BRAKE, Reason.STALE)}
        assert (decisions[-1].status, decisions[-1].threats) == (Status.STALE, None)

    def test_lets_no_brake_go_after_that(self) -> None:
        near = [Estimate(0.0, 0.5 - 0.01 * i) for i in range(6)]
        for settings in ({}, {"when_blind": Command.WARN}):
            decisions = self.told([*near, *[self.CLOSING] * 40], hold=1.0, **settings)
            assert {each.command for each in decisions[3:]} == {Command.BRAKE}

    def test_one_that_comes_again_after_others_is_new(self) -> None:
        far = self.CLOSING._replace(ttc=200.0, closing_speed=0.1, closing_speed_interval=None)
        still = far._replace(ttc=math.inf, closing_speed=0.0)
        decisions = self.told([far if i % 60 == 2 else still for i in range(200)])
        assert {each.reason for each in decisions} == {Reason.CLEAR}

    def test_votes_again_when_it_goes_on(self) -> None:
        going_on = [self.CLOSING._replace(ttc=9.0 - 0.05 * i, distance=20.0 - 0.1 * i) for i in range(20)]
        assert self.told([*[self.CLOSING] * 20, *going_on])[-1].reason is Reason.CLEAR

    @pytest.mark.parametrize(
        "rightly",
        [
            Estimate(0.0, math.inf, None, math.inf, math.nan, None, Status.CLEAR),
            Estimate(0.0, math.inf, None, 3.0, 0.0, (-0.1, 0.1), Status.NOT_CLOSING),
            Estimate(0.0, math.inf),
            Estimate(0.0, math.inf, None, 0.0, -0.5, (-0.6, -0.4), Status.CONTACT),
        ],
        ids=["nothing ahead", "both stand", "a camera that sees nothing", "in contact, and backing out"],
    )
    def test_that_are_rightly_the_same(self, rightly: Estimate) -> None:
        assert {each.command for each in self.told([rightly] * 60)} == {Command.NONE}

    def test_a_radar_that_gives_distances_in_steps(self) -> None:
        """At 0.25 m/s a step of 0.2 m takes 0.8 s."""
        distances = [20.0 - 0.2 * (i // 16) for i in range(60)]
        estimates = [Estimate(0.0, each / 0.25, None, each, 0.25, None, Status.CLOSING) for each in distances]
        assert {each.reason for each in self.told(estimates)} == {Reason.CLEAR}
