"""Recorded scans, with their error codes and no-return codes: kernels against the reference, and known answers."""

from __future__ import annotations

import gzip
import math
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pytest

import ttc_fast
from ttc_fast import KthSmallest, NeighbourSupport, Status, reference

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

pytestmark = pytest.mark.slow

CAR = (-0.25, 0.3, -0.2, 0.2)


class Recording(NamedTuple):
    """Scans of one scanner, and the motion at each."""

    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    ranges: NDArray[Any]
    speed: NDArray[np.float64]
    yaw_rate: NDArray[np.float64]

    def scanner(self, of: Any = ttc_fast, **settings: Any) -> Any:
        """A ``ScanTTC`` for it, by the kernels or the reference."""
        sensor = {"range_min": self.range_min, "range_max": self.range_max}
        return of.ScanTTC(self.angle_min, self.angle_increment, self.ranges.shape[1], **{**sensor, **settings})


def breezyslam(data: Path) -> Recording:
    """A robot with a Hokuyo; 0..15 mm are its error codes, more than half of all readings."""
    log = np.load(data / "laserscan" / "breezyslam_exp1.npz")
    names = ("angle_min", "angle_increment", "range_min", "range_max")
    angle_min, angle_increment, range_min, range_max = (float(log[name]) for name in names)
    speed, yaw_rate = log["v"].astype(float), log["w"].astype(float)
    return Recording(angle_min, angle_increment, range_min, range_max, log["ranges"], speed, yaw_rate)


def carmen(path: Path, range_max: float) -> Recording:
    """The FLASER lines of a CARMEN log: 180 degrees from right to left, and a pose from which speeds are derived."""
    scans, poses = [], []
    with gzip.open(path, "rt") as lines:
        for line in lines:
            if line.startswith("FLASER"):
                fields = line.split()
                beams = int(fields[1])
                scans.append([float(field) for field in fields[2 : 2 + beams]])
                x, y, theta = (float(field) for field in fields[2 + beams : 5 + beams])
                poses.append((float(fields[8 + beams]), x, y, theta))
    stamps, x, y, theta = np.array(poses).T
    elapsed = np.maximum(np.diff(stamps, prepend=stamps[0] - 1.0), 1e-3)
    forward = np.diff(x, prepend=x[0]) * np.cos(theta) + np.diff(y, prepend=y[0]) * np.sin(theta)
    turned = np.angle(np.exp(1j * np.diff(theta, prepend=theta[0])))
    increment = math.pi / beams if beams % 2 == 0 else math.pi / (beams - 1)
    ranges = np.array(scans, np.float32)
    return Recording(-math.pi / 2, increment, 0.05, range_max, ranges, forward / elapsed, turned / elapsed)


def freiburg(data: Path) -> Recording:
    """No return is 81.91 m."""
    return carmen(data / "laserscan" / "freiburg-101-corrected.log.gz", 50.0)


def acapulco(data: Path) -> Recording:
    """No return is 50 m or more."""
    return carmen(data / "laserscan" / "acapulco-corrected.log.gz", 49.9)


def simulated(data: Path, track: str, dtype: Any) -> Recording:
    """Ten scans on a race track, at racing speeds that the test makes up."""
    ranges = np.load(data / "sim" / "legacy_scan.npz")[track].astype(dtype)
    speed, yaw_rate = np.linspace(-2.0, 9.0, len(ranges)), np.linspace(-1.5, 1.5, len(ranges))
    return Recording(-2.35, 4.7 / 1079, 0.0, 60.0, ranges, speed, yaw_rate)


RECORDINGS: dict[str, Callable[[Path], Recording]] = {
    "breezyslam": breezyslam,
    "freiburg": freiburg,
    "acapulco": acapulco,
    **{
        f"{track}, {dtype}": partial(simulated, track=track, dtype=dtype)
        for track in ("vegas", "berlin", "skirk")
        for dtype in ("float32", "float64")
    },
}
SETTINGS: dict[str, dict[str, Any]] = {
    "plain": {},
    "no range_min": {"range_min": 0.0, "range_max": math.inf},
    "car": {"outline": CAR, "mount": (0.2, 0.05, 0.02), "limits": (0.1, 10.0)},
    "clamped": {"limits": (0.5, 8.0), "limits_policy": "clamp", "outline": CAR},
    "backwards": {"outline": CAR, "mount": (-0.2, 0.0, math.pi), "min_closing_speed": 0.1},
    "third smallest": {"minimum": KthSmallest(3), "outline": CAR},
    "supported": {"minimum": NeighbourSupport(2, 3, 0.1)},
}
NEAREST = ("ttc", "status", "beam", "angle", "range", "clearance", "closing_speed")
COUNTS = ("valid", "invalid", "too_close", "no_return", "out_of_range", "beyond_limits", "masked", "contact")


@pytest.fixture(params=list(RECORDINGS.values()), ids=list(RECORDINGS))
def recording(request: pytest.FixtureRequest, data: Path) -> Recording:
    read: Callable[[Path], Recording] = request.param
    return read(data)


@pytest.mark.parametrize("settings", SETTINGS.values(), ids=SETTINGS)
def test_the_kernels_equal_the_reference(recording: Recording, settings: dict[str, Any]) -> None:
    kernel = recording.scanner(**settings, no_data=1e9)
    specified = recording.scanner(reference, **settings, no_data=1e9)
    arguments = (recording.ranges, recording.speed, recording.yaw_rate)

    nearest, expected = kernel.nearest(*arguments), specified.nearest(*arguments)
    for name in NEAREST:
        np.testing.assert_array_equal(getattr(nearest, name), getattr(expected, name), err_msg=name)
    for name in COUNTS:
        np.testing.assert_array_equal(getattr(nearest.counts, name), getattr(expected.counts, name), err_msg=name)
    np.testing.assert_array_equal(kernel.min(*arguments), specified.min(*arguments))

    status, expected_status = (np.empty(recording.ranges.shape, np.uint8) for _ in range(2))
    each = kernel.per_beam(*arguments, status_out=status)
    expected_each = specified.per_beam(*arguments, status_out=expected_status)
    np.testing.assert_allclose(each, expected_each, rtol=4 * np.finfo(each.dtype).eps)
    np.testing.assert_array_equal(status, expected_status)


def test_the_recordings_have_something_to_say(recording: Recording) -> None:
    """Scans that close, of many beams each, or the comparison proves nothing."""
    nearest = recording.scanner().nearest(recording.ranges, recording.speed, recording.yaw_rate)
    assert (nearest.status == Status.CLOSING).mean() > 0.5
    assert len(set(nearest.beam.tolist())) > 3
    assert (nearest.counts.valid.mean() / recording.ranges.shape[1]) > 0.2


def test_range_min_tells_error_codes_from_an_impact(data: Path) -> None:
    """With it, the scans of the first log with the robot driving ahead have their 5th percentile near 1.06 s."""
    log = breezyslam(data)
    drives = log.speed > 0.1
    honoured = log.scanner().min(log.ranges[drives], log.speed[drives])
    assert np.percentile(honoured, 5.0) == pytest.approx(1.06, abs=0.01)
    assert honoured.min() > 0.5

    literal = log.scanner(range_min=0.0).min(log.ranges[drives], log.speed[drives])
    assert drives.sum() > 600
    assert (literal < 0.1).all()


def test_more_than_half_of_the_first_log_is_error_codes(data: Path) -> None:
    log = breezyslam(data)
    counts = log.scanner().nearest(log.ranges, log.speed).counts
    assert counts.out_of_range.sum() / log.ranges.size == pytest.approx(0.55, abs=0.01)
    assert (counts.out_of_range + counts.valid == log.ranges.shape[1]).all()
    assert counts.out_of_range.sum() == (log.ranges < 0.06).sum() + (log.ranges > 5.6).sum()


@pytest.mark.parametrize(("log", "code"), [(freiburg, 81.9), (acapulco, 49.95)], ids=["freiburg", "acapulco"])
def test_no_return_codes_are_out_of_range_not_walls(data: Path, log: Any, code: float) -> None:
    """A driver that says "nothing" by a large number says it beyond range_max: not free space, and not an obstacle."""
    recorded: Recording = log(data)
    codes = recorded.ranges > code
    assert codes.sum() > 100
    assert recorded.scanner().nearest(recorded.ranges, recorded.speed).counts.out_of_range.sum() >= codes.sum()
    each = recorded.scanner().per_beam(recorded.ranges, np.full(len(recorded.ranges), 5.0))
    assert np.isposinf(each[codes]).all()
