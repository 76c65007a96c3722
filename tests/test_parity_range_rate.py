"""`RangeRate` against its reference: every answer and every output bit for bit, over streams of scans of all kinds."""

from __future__ import annotations

import copy
import math
import pickle
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

import strategies
import ttc_fast
from ttc_fast import KthSmallest, NeighbourSupport, reference

if TYPE_CHECKING:
    from numpy.typing import NDArray

ANSWER = [field.name for field in fields(reference.RangeRateNearest) if field.name != "counts"]
COUNTS = [field.name for field in fields(reference.Counts)]
# Groups are of 64 beams.
SIZES = (1, 2, 7, 16, 63, 64, 65, 128, 130, 300)


@dataclass
class Stream:
    """A scanner, how its rates are found, and its scans."""

    scanner: dict[str, Any]
    settings: dict[str, Any]
    scans: NDArray[Any]
    stamps: NDArray[Any]
    yaw_rates: NDArray[Any]


@st.composite
def streams(draw: st.DrawFn) -> Stream:
    beams = draw(st.sampled_from(SIZES))
    scanner = draw(strategies.settings(beams)) | {"minimum": None}
    chosen = {
        "window": draw(st.sampled_from([0.5, 0.5, 0.25, 3.0])),
        "min_scans": draw(st.sampled_from([3, 4, 6])),
        "noise": draw(st.sampled_from([0.01, 0.03, 1e-6])),
        "max_speed": draw(st.sampled_from([20.0, 2.0])),
        "max_acceleration": draw(st.sampled_from([5.0, 0.5])),
        "gate": draw(st.sampled_from([3.0, 10.0])),
        "significance": draw(st.sampled_from([3.0, 0.1])),
        "edge": draw(st.sampled_from([0.2, 5.0])),
        "minimum": draw(st.sampled_from([None, KthSmallest(1), KthSmallest(5), NeighbourSupport()])),
    }
    rng = np.random.default_rng(draw(strategies.seeds))
    frames = draw(st.integers(1, 14))
    elapsed = rng.choice([0.1, 0.1, 0.05, 0.02, 0.13], frames) * rng.choice([1, 1, 1, 1, 1, 1, 6, 0, -1], frames)
    stamps = draw(st.sampled_from([0.0, 1.7e9])) + np.cumsum(elapsed)
    turning = draw(st.sampled_from([0.0, 0.0, 0.4, 3.0]))
    scans = _scans(rng, scanner, draw(strategies.dtypes), stamps - stamps[0])
    return Stream(scanner, chosen, scans, stamps, rng.uniform(-turning, turning, frames))


def _scans(rng: np.random.Generator, scanner: dict[str, Any], dtype: Any, times: NDArray[Any]) -> NDArray[Any]:
    """Surfaces of some beams each, at speeds of their own, with noise, jumps, dropouts and special readings."""
    beams = scanner["beams"]
    surfaces = np.sort(rng.integers(0, 6, beams))
    distance, speed = rng.uniform(0.2, 9, 6)[surfaces], rng.uniform(-3, 3, 6)[surfaces]
    ranges = distance + speed * times[:, None] + rng.normal(0, rng.choice([0, 0.01]), (len(times), beams))
    jumps = rng.random(ranges.shape) < rng.choice([0, 0.05])
    ranges += np.cumsum(jumps * rng.normal(0, 1, ranges.shape), axis=0)
    result: NDArray[Any] = ranges.astype(dtype)
    special = rng.random(ranges.shape) < rng.choice([0, 0.1, 0.4])
    result[special] = rng.choice(strategies.readings(scanner, dtype), np.count_nonzero(special))
    return result


def same(a: Any, b: Any) -> bool:
    """Equal, bit for bit; NaN equals NaN."""
    return bool(a == b or (isinstance(a, float) and math.isnan(a) and math.isnan(b)))


def assert_same_answer(kernel: Any, specified: Any) -> None:
    for name in ANSWER:
        assert same(getattr(kernel, name), getattr(specified, name)), name
    for name in COUNTS:
        assert getattr(kernel.counts, name) == getattr(specified.counts, name), name


def outputs(ranges: NDArray[Any]) -> dict[str, Any]:
    arrays = {name: np.full(ranges.shape, 7.0, ranges.dtype) for name in ("range_rate_out", "standard_error_out")}
    return {**arrays, "status_out": np.full(ranges.shape, 77, np.uint8)}


def trackers(stream: Stream) -> list[Any]:
    return [module.RangeRate(module.ScanTTC(**stream.scanner), **stream.settings) for module in (ttc_fast, reference)]


def assert_parity(stream: Stream) -> None:
    kernel, specified = trackers(stream)
    for ranges, stamp, yaw_rate in zip(stream.scans, stream.stamps, stream.yaw_rates, strict=True):
        before = ranges.copy()
        written, expected = outputs(ranges), outputs(ranges)
        said = kernel.update(ranges, stamp, yaw_rate, **written)
        assert_same_answer(said, specified.update(ranges, stamp, yaw_rate, **expected))
        for name in written:
            np.testing.assert_array_equal(written[name], expected[name], err_msg=name)
        np.testing.assert_array_equal(ranges, before, err_msg="the input was written to")


@hypothesis_settings(max_examples=300, deadline=None)
@given(streams())
def test_streams(stream: Stream) -> None:
    assert_parity(stream)


def test_the_streams_have_rates() -> None:
    """What is compared above is not all unknown."""
    rng = np.random.default_rng(5)
    scanner = {"angle_min": -1.0, "angle_increment": 0.01, "beams": 130, "range_min": 0.1, "range_max": 30.0}
    times = 0.1 * np.arange(8, dtype=np.float64)
    scans = _scans(rng, scanner | {"limits": None}, np.float32, times)
    stream = Stream(scanner, {"minimum": KthSmallest(1)}, scans, times, np.full(8, 0.1))
    assert_parity(stream)
    kernel, _ = trackers(stream)
    assert max(kernel.update(*each).rated for each in zip(scans, times, stream.yaw_rates, strict=True)) > 20


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("yaw_rate", [0.0, 0.7])
def test_a_long_stream_of_a_fast_scanner(dtype: Any, yaw_rate: float) -> None:
    """More scans in a window than are remembered."""
    rng = np.random.default_rng(6)
    scanner = {"angle_min": -2.0, "angle_increment": 4.0 / 1080, "beams": 1080, "range_min": 0.06, "range_max": 30.0}
    times = 1.7e9 + 0.005 * np.arange(120, dtype=np.float64)
    scans = (4.0 + 0.5 * np.sin(np.arange(1080) / 50) - (times - times[0])[:, None]).astype(dtype)
    scans += rng.normal(0, 0.01, scans.shape).astype(dtype)
    assert_parity(Stream(scanner, {}, scans, times, np.full(120, yaw_rate)))


@hypothesis_settings(max_examples=40, deadline=None)
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
