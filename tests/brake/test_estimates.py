"""What trackers and cameras tell a brake controller: their TTC, and the status beside it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.support.common import CAR
from ttc_fast import (
    BrakeController,
    CloudTracker,
    Command,
    DistanceTracker,
    Estimate,
    EstimateThreshold,
    IttcThreshold,
    Minimum,
    Motion,
    RangeRate,
    Reason,
    RssDistance,
    ScanTTC,
    Status,
    StoppingDistance,
    SweptPathThreshold,
)
from ttc_fast.brake import Source

if TYPE_CHECKING:
    from ttc_fast.brake import Criterion, Decision

PERIOD = 0.1
CRITERIA = [EstimateThreshold(), StoppingDistance(), RssDistance()]
UNKNOWN, STANDING, OPENING = (math.nan, None), (-0.01, (-0.1, 0.08)), (-0.5, (-0.6, -0.4))
"""Closing speed and its interval."""


class Told:
    """A controller that is told estimates only."""

    def __init__(self, *criteria: Criterion, **settings: Any) -> None:
        self.controller = BrakeController(list(criteria) or None, **{"hold": 0.0, **settings})
        self.now = 50.0

    def frames(self, count: int, speed: float | None = 1.0, /, **told: Any) -> Decision:
        for _ in range(count):
            self.now += PERIOD
            motion = None if speed is None else Motion(speed)
            varied = {**told, "ttc": told["ttc"] + 1e-9 * self.now}  # no tracker repeats itself to the bit
            decision = self.controller.update(self.now, estimate=Estimate(self.now, **varied), motion=motion)
        return decision

    def touching(self, count: int, how: tuple[float, Any], **more: Any) -> Decision:
        speed, interval = how
        told = {"distance": -0.2, "closing_speed": speed, "closing_speed_interval": interval}
        return self.frames(count, ttc=math.inf, status=Status.CONTACT, **{**told, **more})


@pytest.mark.parametrize("criterion", CRITERIA, ids=lambda criterion: criterion.name)
@pytest.mark.parametrize("how", [UNKNOWN, STANDING, (0.3, (-0.1, 0.7)), (0.3, None), (0.0, None)])
def test_contact_is_a_cause_to_brake_whatever_its_ttc(criterion: Criterion, how: tuple[float, Any]) -> None:
    told = Told(criterion)
    decision = told.touching(3, how)
    assert (decision.command, decision.reason) == (Command.BRAKE, Reason.CRITERION)
    assert decision.threat is not None
    assert (decision.threat.source, decision.threat.status) == (Source.ESTIMATE, Status.CONTACT)
    assert decision.threat.ttc == math.inf  # as it was told: what brakes is the contact
    assert "in contact" in str(decision)
    assert told.touching(50, how).command is Command.BRAKE


@pytest.mark.parametrize("criterion", CRITERIA, ids=lambda criterion: criterion.name)
@pytest.mark.parametrize("distance", [math.nan, 0.05])
def test_contact_that_only_the_status_tells_counts(criterion: Criterion, distance: float) -> None:
    assert Told(criterion).touching(3, UNKNOWN, distance=distance).command is Command.BRAKE


@pytest.mark.parametrize("how", [OPENING, (-0.5, None)])
def test_what_surely_moves_away_does_not_brake(how: tuple[float, Any]) -> None:
    decision = Told().touching(9, how)
    assert (decision.command, decision.reason) == (Command.NONE, Reason.ESCAPE)


def test_a_brake_is_held_in_contact_and_let_go_when_it_moves_away() -> None:
    told = Told()
    told.frames(3, ttc=0.2, distance=0.4, closing_speed=2.0, status=Status.CLOSING)
    assert told.touching(40, STANDING).command is Command.BRAKE
    assert told.touching(1, OPENING).command is Command.BRAKE
    assert told.touching(1, OPENING).command is Command.NONE  # the second frame: at 10 Hz two of two have to be clear


@pytest.mark.parametrize("status", [None, Status.LOST, Status.WARMING_UP])
def test_a_distance_of_0_or_below_is_contact_whatever_the_status(status: Status | None) -> None:
    assert Told().frames(3, ttc=math.inf, distance=0.0, status=status).command is Command.BRAKE


@pytest.mark.parametrize("status", [Status.CLEAR, Status.NOT_CLOSING, Status.CLOSING, Status.TOO_FEW])
def test_no_ttc_makes_a_contact(status: Status) -> None:
    decision = Told().frames(3, ttc=0.0, ttc_interval=(0.0, math.inf), distance=3.0, status=status)
    assert decision.command is Command.WARN
    assert decision.threat is not None
    assert decision.threat.status is status


def test_a_second_opinion_in_contact_brakes_beside_a_scan_that_is_free() -> None:
    scan = ScanTTC(-0.5, 0.1, 11, outline=CAR)
    controller = BrakeController([*CRITERIA], scan=scan, hold=0.0)
    for frame in range(30):
        now = frame * PERIOD
        estimate = Estimate(now, math.inf, None, -0.1, math.nan, None, Status.CONTACT) if frame < 20 else None
        free = np.full(11, np.inf)
        decision = controller.update(now, ranges=free, stamp=now, motion=Motion(0.0), estimate=estimate)
        if frame == 15:
            assert decision.command is Command.BRAKE
            assert decision.threat is not None
            assert decision.threat.status is Status.CONTACT
    assert decision.command is Command.NONE  # an opinion that has become too old is none


def drive_into(gap: float = 2.0, frames: int = 40) -> list[float]:
    """Distances: at 2 m/s until 0.1 m inside, and there they stay; with a scatter of 1 cm."""
    rng = np.random.default_rng(4)
    times = np.arange(frames) * PERIOD
    return list(np.maximum(gap - 2.0 * times, -0.1) + rng.normal(0.0, 0.01, frames))


def test_a_distance_tracker_in_contact_keeps_braking() -> None:
    tracker, controller = DistanceTracker(noise=0.01), BrakeController()
    for frame, distance in enumerate(drive_into()):
        now = frame * PERIOD
        seen = tracker.update(distance, now)
        decision = controller.update(now, estimate=Estimate.of(seen, now))
        if frame >= 12:
            assert seen.status is Status.CONTACT
            assert decision.command is Command.BRAKE


def test_a_cloud_tracker_in_contact_keeps_braking() -> None:
    tracker, controller = CloudTracker(estimator=Minimum(), front_offset=1.0), BrakeController()
    y, z = np.random.default_rng(3).uniform((-0.8, -0.5), (0.8, 0.5), (300, 2)).T
    for frame, distance in enumerate(drive_into()):
        now = frame * PERIOD
        seen = tracker.update(np.column_stack([np.full(300, distance + 1.0), y, z]), now)
        decision = controller.update(now, estimate=Estimate.of(seen, now))
        assert frame < 25 or seen.status is Status.CONTACT  # its line through several frames is late
        assert frame < 12 or decision.command is Command.BRAKE


def test_a_target_that_appears_in_contact_brakes() -> None:
    tracker, controller = DistanceTracker(), BrakeController()
    for frame in range(8):
        now = frame * PERIOD
        seen = tracker.update(20.0 if frame < 5 else -0.05, now)
        decision = controller.update(now, estimate=Estimate.of(seen, now))
    assert (decision.command, seen.status) == (Command.BRAKE, Status.CONTACT)


def test_an_estimate_of_a_tracker_is_all_that_it_said() -> None:
    tracker = DistanceTracker(noise=0.02)
    for frame in range(9):
        seen = tracker.update(9.0 - 0.4 * frame, PERIOD * frame)
    assert tuple(Estimate.of(seen, 3.0)) == (
        3.0,
        seen.ttc,
        seen.ttc_interval,
        seen.distance,
        seen.closing_speed,
        seen.closing_speed_interval,
        Status.CLOSING,
        seen.age,
    )


def test_an_estimate_of_something_else_is_refused() -> None:
    with pytest.raises(TypeError, match=r"tracked must be what a tracker.s update\(\) returned, got 1\.2"):
        Estimate.of(1.2, 0.0)  # type: ignore[arg-type]


@pytest.mark.parametrize("status", [Status.NO_DATA, Status.INVALID])
def test_an_estimate_that_saw_nothing_is_a_blind_frame(status: Status) -> None:
    told = Told()
    assert told.frames(5, ttc=9.0, distance=20.0, closing_speed=2.2).command is Command.NONE
    assert told.frames(2, ttc=math.inf, status=status).command is Command.NONE
    decision = told.frames(2, ttc=math.inf, status=status)
    assert (decision.command, decision.reason) == (Command.BRAKE, Reason.BLIND)
    assert decision.counters.blind == 4


def test_a_second_opinion_that_saw_nothing_takes_none_away() -> None:
    controller = BrakeController([EstimateThreshold()], scan=ScanTTC(-0.5, 0.1, 11), trigger=(1, 1))
    frame: dict[str, Any] = {"ranges": np.full(11, np.inf), "motion": Motion(0.0)}
    assert controller.update(1.0, stamp=1.0, estimate=Estimate(1.0, 0.5), **frame).command is Command.BRAKE
    unseen = Estimate(1.1, math.inf, status=Status.NO_DATA)
    assert controller.update(1.1, stamp=1.1, estimate=unseen, **frame).value < 0.5


@pytest.mark.parametrize("speed", [None, 0.0, 3.0])
def test_estimates_alone_let_go_with_and_without_odometry(speed: float | None) -> None:
    told = Told()
    assert told.frames(3, speed, ttc=0.2, distance=0.4, closing_speed=2.0).command is Command.BRAKE
    assert told.frames(5, speed, ttc=math.inf, distance=9.0, closing_speed=0.0).command is Command.NONE


def test_rss_judges_estimates_alone_by_the_speed_of_the_vehicle() -> None:
    ahead = {"ttc": math.inf, "distance": 3.0, "closing_speed": 0.0}
    assert Told(RssDistance()).frames(3, 20.0, **ahead).command is Command.BRAKE
    assert Told(RssDistance()).frames(3, 0.5, **ahead).command is Command.NONE


@pytest.mark.parametrize(
    ("wrong", "error", "says"),
    [
        ({"stamp": math.nan}, ValueError, "estimate.stamp must be finite"),
        ({"stamp": "now"}, TypeError, "estimate.stamp must be a number"),
        ({"ttc": math.nan}, ValueError, r"estimate.ttc must be from 0 to inf, got nan"),
        ({"ttc": -0.1}, ValueError, "estimate.ttc must be from 0 to inf"),
        ({"ttc": None}, TypeError, "estimate.ttc must be a number"),
        ({"ttc_interval": (2.0, 1.0)}, ValueError, "estimate.ttc_interval"),
        ({"ttc_interval": (math.nan, 1.0)}, ValueError, "estimate.ttc_interval"),
        ({"ttc_interval": 1.0}, TypeError, "estimate.ttc_interval must be None or two numbers"),
        ({"distance": "far"}, TypeError, "estimate.distance must be a number"),
        ({"closing_speed": "fast"}, TypeError, "estimate.closing_speed must be a number"),
        ({"closing_speed_interval": (1.0,)}, TypeError, "estimate.closing_speed_interval must be None or two"),
        ({"status": "CLOSING"}, TypeError, "estimate.status must be None or a Status"),
    ],
)
def test_estimates_are_refused_with_the_reason(wrong: dict[str, Any], error: type[Exception], says: str) -> None:
    estimate = Estimate(1.0, 5.0)._replace(**wrong)
    with pytest.raises(error, match=says):
        BrakeController().update(1.0, estimate=estimate)
    with pytest.raises(error, match=says):
        BrakeController(scan=ScanTTC(-0.5, 0.1, 11)).update(1.0, estimate=estimate)


EACH_CRITERION = [IttcThreshold(), SweptPathThreshold(), EstimateThreshold(), StoppingDistance(), RssDistance()]


@pytest.mark.parametrize("criterion", EACH_CRITERION, ids=lambda criterion: criterion.name)
@pytest.mark.parametrize("outline", [None, CAR], ids=["no outline", "outline"])
@pytest.mark.parametrize("rated", [False, True], ids=["no rate", "rate"])
@pytest.mark.parametrize("motion", [None, Motion(5.0)], ids=["no motion", "motion"])
def test_whatever_judges_a_scan_is_looked_at(
    criterion: Criterion, outline: tuple[float, float, float, float] | None, rated: bool, motion: Motion | None
) -> None:
    scan = ScanTTC(-1.5, 0.1, 31, range_min=0.06, outline=outline)
    if isinstance(criterion, SweptPathThreshold) and outline is None:
        return  # refused when it is made
    controller = BrakeController([criterion], scan=scan, range_rate=RangeRate(scan) if rated else None)
    blind = np.full(31, np.nan, np.float32)
    near = Estimate(ttc=0.3, stamp=0.5, distance=0.9, closing_speed=3.0)
    clear, warned, unseen = (
        [controller.update(now, ranges=ranges, stamp=now, motion=motion, estimate=estimate) for now in times]
        for times, ranges, estimate in (
            ((0.0, 0.1, 0.2, 0.3), np.full(31, 30.0, np.float32), None),
            ((0.5, 0.6, 0.7, 0.8), np.full(31, 30.0, np.float32), near),
            ((1.0, 1.1, 1.2, 1.3), blind, None),
        )
    )
    if motion is not None:
        assert clear[-1].command is Command.NONE
    if isinstance(criterion, EstimateThreshold):
        assert warned[-1].command is Command.BRAKE
    assert unseen[-1].command is Command.BRAKE, "a blind scanner is noticed by whatever judges"
