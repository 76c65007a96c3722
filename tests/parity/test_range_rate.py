"""`RangeRate` against its reference: every answer and every output bit for bit, over streams of scans of all kinds."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given

import ttc_fast
from tests.support.common import both_dtypes, examples
from tests.support.range_rate_streams import Stream, assert_parity, assert_same_answer, simulated, streams, trackers
from ttc_fast import KthSmallest


@examples(300)
@given(streams())
def test_streams(stream: Stream) -> None:
    assert_parity(stream)


def test_the_streams_have_rates() -> None:
    """What is compared above is not all unknown."""
    rng = np.random.default_rng(5)
    scanner = {"angle_min": -1.0, "angle_increment": 0.01, "beams": 130, "range_min": 0.1, "range_max": 30.0}
    times = 0.1 * np.arange(8, dtype=np.float64)
    scans = simulated(rng, scanner | {"limits": None}, np.float32, times)
    stream = Stream(scanner, {"minimum": KthSmallest(1)}, scans, times, np.full(8, 0.1))
    assert_parity(stream)
    kernel, _ = trackers(stream)
    assert max(kernel.update(*each).rated for each in zip(scans, times, stream.yaw_rates, strict=True)) > 20


@both_dtypes
@pytest.mark.parametrize("yaw_rate", [0.0, 0.7])
def test_a_long_stream_of_a_fast_scanner(dtype: Any, yaw_rate: float) -> None:
    """More scans in a window than are remembered."""
    rng = np.random.default_rng(6)
    scanner = {"angle_min": -2.0, "angle_increment": 4.0 / 1080, "beams": 1080, "range_min": 0.06, "range_max": 30.0}
    times = 1.7e9 + 0.005 * np.arange(120, dtype=np.float64)
    scans = (4.0 + 0.5 * np.sin(np.arange(1080) / 50) - (times - times[0])[:, None]).astype(dtype)
    scans += rng.normal(0, 0.01, scans.shape).astype(dtype)
    assert_parity(Stream(scanner, {}, scans, times, np.full(120, yaw_rate)))


@examples(40)
@given(streams())
def test_a_saved_state_goes_on_as_if_never_saved(stream: Stream) -> None:
    kernel, specified = trackers(stream)
    half = len(stream.scans) // 2
    each = list(zip(stream.scans, stream.stamps, stream.yaw_rates, strict=True))
    for scan in each[:half]:
        kernel.update(*scan)
        specified.update(*scan)
    copies = [pickle.loads(pickle.dumps(kernel)), copy.deepcopy(kernel), pickle.loads(pickle.dumps(specified))]
    for scan in each[half:]:
        said = kernel.update(*scan)
        for other in copies:
            assert_same_answer(other.update(*scan), said)


@pytest.mark.parametrize("stride", [2, -1])
def test_strided_and_unaligned_scans(stride: int) -> None:
    scanner: dict[str, Any] = {"angle_min": -1.0, "angle_increment": 0.01, "beams": 100}
    packed = np.zeros(100, np.dtype([("flag", "u1"), ("range", "<f4")]))
    wide = np.zeros(200 if stride == 2 else 100, np.float32)
    by_stride, by_record, plain = (ttc_fast.RangeRate(ttc_fast.ScanTTC(**scanner)) for _ in range(3))
    for frame in range(6):
        ranges = (6 - 0.15 * frame + np.arange(100) / 1000).astype(np.float32)
        wide[::stride], packed["range"] = ranges, ranges
        out = np.full(200, 7.0, np.float32)
        said = plain.update(ranges, 0.1 * frame)
        assert_same_answer(by_stride.update(wide[::stride], 0.1 * frame, range_rate_out=out[::2]), said)
        assert_same_answer(by_record.update(packed["range"], 0.1 * frame), said)
    assert np.all(out[1::2] == 7)
    assert np.all(out[::2] < -1.4)
    assert said.status == ttc_fast.Status.CLOSING
