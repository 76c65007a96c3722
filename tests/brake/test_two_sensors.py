"""A scanner and a sensor of clouds on one controller: neither outvotes the other, and neither has to be the faster."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from ttc_fast import BrakeController, Command, Motion, ScanTTC, SweptPath

if TYPE_CHECKING:
    from ttc_fast.brake import Decision

CAR = (-0.1, 0.4, -0.15, 0.15)
SPEED = 4.0
PERIOD = 0.025
BEHIND = np.array([[-3.0, 0.0], [-3.0, 0.1]])
FREE = math.inf


class Both:
    """A car that drives with a scanner at 40 Hz and a sensor of clouds."""

    def __init__(self, rate: float, latency: float = 0.0) -> None:
        self.controller = BrakeController(scan=ScanTTC(-2.35, 0.01, 471, outline=CAR), path=SweptPath(CAR))
        scans = [(PERIOD * i, PERIOD * i, True) for i in range(160)]
        clouds = [(i / rate + latency + 0.003, i / rate, False) for i in range(int(4.0 * rate))] if rate else []
        self.messages = sorted(scans + clouds)

    def scan(self, now: float, stamp: float, gap: float) -> Decision:
        """A scan of a wall so far ahead of the bumper, or of free space."""
        angles = np.asarray(self.scanner.angles)
        wall = np.where(np.abs(angles) < 0.5, (gap + CAR[1]) / np.cos(angles), 30.0) + stamp * 1e-6
        return self.controller.update(now, ranges=wall, stamp=stamp, motion=Motion(SPEED))

    @property
    def scanner(self) -> ScanTTC:
        assert self.controller.scan is not None
        return self.controller.scan

    def cloud(self, now: float, stamp: float, gap: float) -> Decision:
        """A cloud of what is behind, and of a wall so far ahead."""
        wall = np.array([[gap + CAR[1], y] for y in (-0.1, 0.0, 0.1)]) if gap < FREE else BEHIND
        points = np.concatenate([BEHIND, wall]) + stamp * 1e-6  # no frame is the one before to the bit
        return self.controller.update(now, points=points, stamp=stamp, motion=Motion(SPEED))

    def gap_of_brake(self, seen_by_scanner: bool) -> float:
        """How far ahead a wall that one of the sensors sees is when the car brakes."""
        for now, stamp, is_scan in self.messages:
            gap = 11.0 - SPEED * stamp if is_scan is seen_by_scanner else FREE
            decision = (self.scan if is_scan else self.cloud)(now, stamp, gap)
            if decision.command is Command.BRAKE:
                return 11.0 - SPEED * now
            if 11.0 - SPEED * now < 0.0:
                break
        return -math.inf


@pytest.mark.parametrize("rate", [5.0, 10.0, 25.0, 40.0, 100.0, 200.0])
def test_clouds_do_not_outvote_scans(rate: float) -> None:
    alone = Both(0.0).gap_of_brake(seen_by_scanner=True)
    assert alone > 5.5
    assert Both(rate).gap_of_brake(seen_by_scanner=True) == pytest.approx(alone)


@pytest.mark.parametrize("latency", [0.0, 0.03, 0.1, 0.2])
@pytest.mark.parametrize("rate", [10.0, 20.0, 40.0])
def test_scans_do_not_outvote_clouds_nor_overtake_them(rate: float, latency: float) -> None:
    assert Both(rate, latency).gap_of_brake(seen_by_scanner=False) > 6.0 - SPEED * (2.0 / rate + PERIOD)


@pytest.mark.parametrize("rate", [10.0, 40.0, 200.0])
def test_free_frames_of_one_sensor_let_nothing_go_that_the_other_one_shows(rate: float) -> None:
    """A TTC of 1.7 s is no cause to brake, and none to let go."""
    both = Both(rate)
    for now, stamp, is_scan in both.messages:
        gap = SPEED * (1.2 if now < 0.2 else 1.7) if is_scan else FREE
        decision = (both.scan if is_scan else both.cloud)(now, stamp, gap)
        assert now < 0.1 or decision.command is Command.BRAKE


@pytest.mark.parametrize("rate", [10.0, 40.0])
def test_it_lets_go_when_both_are_free_and_when_the_clouds_end(rate: float) -> None:
    for clouds_end in (False, True):
        both = Both(rate)
        for now, stamp, is_scan in both.messages:
            if is_scan:
                decision = both.scan(now, stamp, SPEED * 1.2 if now < 0.2 else 20.0)
            elif not clouds_end or now < 0.3:
                decision = both.cloud(now, stamp, SPEED * 1.2 if now < 0.3 else FREE)
        assert decision.command is Command.NONE


@pytest.mark.parametrize("rate", [10.0, 40.0, 200.0])
def test_a_driver_who_asks_to_back_out_where_only_the_clouds_look_is_let_go(rate: float) -> None:
    """It stands before a wall. No view says where the clouds look, and they have points behind."""
    both, let_go = Both(rate), math.inf
    for now, stamp, is_scan in both.messages:
        speed, gap, asked = (SPEED, 4.0, None) if now < 0.3 else (0.0, 0.3, -1.0 if now > 1.5 else None)
        if is_scan:
            angles = np.asarray(both.scanner.angles)
            wall = np.where(np.abs(angles) < 0.5, (gap + CAR[1]) / np.cos(angles), 30.0)
            decision = both.controller.update(now, ranges=wall, stamp=stamp, motion=Motion(speed), commanded=asked)
        else:
            decision = both.controller.update(now, points=BEHIND, stamp=stamp, motion=Motion(speed), commanded=asked)
        assert not 0.3 < now < 1.5 or decision.command is Command.BRAKE
        if decision.command is not Command.BRAKE and now > 1.5:
            let_go = min(let_go, now)
    assert let_go < 2.0


def test_a_state_goes_on_where_both_were() -> None:
    both, messages = Both(25.0), Both(25.0).messages
    for now, stamp, is_scan in messages[:80]:
        (both.scan if is_scan else both.cloud)(now, stamp, 9.0 - SPEED * now if is_scan else FREE)
    other = Both(25.0)
    other.controller.restore(both.controller.state())
    for now, stamp, is_scan in messages[80:]:
        gap = max(9.0 - SPEED * now, 0.5) if is_scan else FREE
        decisions = [(each.scan if is_scan else each.cloud)(now, stamp, gap) for each in (both, other)]
        assert repr(decisions[0]) == repr(decisions[1])
