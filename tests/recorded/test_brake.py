"""The brake over recorded scans: a laser more than half of whose readings are error codes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from ttc_fast import BrakeController, Command, Motion, Reason, ScanTTC

if TYPE_CHECKING:
    from pathlib import Path

OUTLINE = (-0.2, 0.2, -0.2, 0.2)


@pytest.fixture
def drive(data: Path) -> dict[str, Any]:
    with np.load(data / "laserscan" / "breezyslam_exp1.npz") as log:
        return {name: log[name] for name in log.files}


def controller(drive: dict[str, Any], **settings: Any) -> BrakeController:
    scan = ScanTTC(
        float(drive["angle_min"]),
        float(drive["angle_increment"]),
        drive["ranges"].shape[1],
        range_min=float(drive["range_min"]),
        range_max=float(drive["range_max"]),
        outline=OUTLINE,
    )
    return BrakeController(scan=scan, **settings)


def test_error_codes_cause_no_brake(drive: dict[str, Any]) -> None:
    """It went on driving for a minute, and touched nothing: what brakes is something within the stopping distance."""
    brake = controller(drive, sensor_timeout=1.0)
    assert np.mean(drive["ranges"] < drive["range_min"]) > 0.5
    decisions = []
    for index, stamp in enumerate(drive["t"]):
        motion = Motion(float(drive["v"][index]), float(drive["w"][index]), stamp=float(stamp))
        decisions.append(brake.update(float(stamp), ranges=drive["ranges"][index], stamp=float(stamp), motion=motion))
    assert decisions[-1].counters.blind == 0
    causes = 0
    for ranges, decision in zip(drive["ranges"], decisions, strict=True):
        assert decision.reason not in (Reason.BLIND, Reason.STALE, Reason.NO_MOTION)
        if decision.command is Command.BRAKE and decision.reason is Reason.CRITERION:
            assert decision.threat is not None
            assert decision.threat.range >= drive["range_min"]  # never an error code
            around = ranges[decision.threat.index - 3 : decision.threat.index + 4]
            assert np.sum(np.abs(around - decision.threat.range) < 0.3) >= 3  # and no speckle: a wall
            causes += 1
    assert causes < len(decisions) / 20


def test_a_sensor_gone_blind_is_flagged_within_its_timeout(drive: dict[str, Any]) -> None:
    brake = controller(drive, sensor_timeout=0.5)
    went_blind = float(drive["t"][100])
    for index in range(130):
        stamp = float(drive["t"][index])
        ranges = drive["ranges"][index] if stamp < went_blind else np.full_like(drive["ranges"][index], 0.003)
        motion = Motion(float(drive["v"][index]), float(drive["w"][index]), stamp=stamp)
        decision = brake.update(stamp, ranges=ranges, stamp=stamp, motion=motion)
        if stamp - went_blind > 0.5:
            assert (decision.command, decision.reason) == (Command.BRAKE, Reason.BLIND)
