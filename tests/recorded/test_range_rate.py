"""`RangeRate` over recorded scans: the reference bit for bit, and odometry where the two must agree."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import ttc_fast
from tests.support.range_rate_streams import Stream, assert_parity

if TYPE_CHECKING:
    from pathlib import Path

DELAY = 2  # by so many scans the odometry of the recording is ahead of them


@pytest.fixture(scope="module")
def recording(data: Path) -> dict[str, Any]:
    """A robot in a lab where nothing else moves; more than half of its readings are error codes."""
    with np.load(data / "laserscan" / "breezyslam_exp1.npz") as log:
        return dict(log)


def scanner(recording: dict[str, Any]) -> dict[str, Any]:
    names = ("angle_min", "angle_increment", "range_min", "range_max")
    return {name: float(recording[name]) for name in names} | {"beams": recording["ranges"].shape[1]}


def test_the_reference_says_the_same(recording: dict[str, Any]) -> None:
    part = slice(200, 350)
    yaw_rates = recording["w"].astype(float)[part]
    assert_parity(Stream(scanner(recording), {}, recording["ranges"][part], recording["t"][part], yaw_rates))


def test_straight_ahead_it_is_what_odometry_says(recording: dict[str, Any]) -> None:
    ranges, stamps = recording["ranges"], recording["t"]
    speeds, yaw_rates = (np.pad(recording[name].astype(float), (DELAY, 0))[: len(stamps)] for name in ("v", "w"))
    scan = ttc_fast.ScanTTC(**scanner(recording))
    rates, each = ttc_fast.RangeRate(scan), np.empty(ranges.shape, np.float32)
    for i, (reading, stamp, yaw_rate) in enumerate(zip(ranges, stamps, yaw_rates, strict=True)):
        rates.update(reading, stamp, yaw_rate, range_rate_out=each[i])
    expected = -speeds[:, None] * np.cos(scan.angles)
    chosen = (np.abs(yaw_rates) < 0.1)[:, None] & (np.abs(scan.angles) < 0.2) & ~np.isnan(each)
    assert np.count_nonzero(chosen) > 4000
    assert np.corrcoef(each[chosen], expected[chosen])[0, 1] > 0.9
    assert np.median(np.abs(each[chosen] - expected[chosen])) < 0.1
    assert np.sum(each[chosen] * expected[chosen]) / np.sum(expected[chosen] ** 2) == pytest.approx(1.0, abs=0.1)
