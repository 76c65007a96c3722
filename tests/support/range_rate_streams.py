"""Streams of scans of all kinds for `RangeRate`, and what must be equal of the kernel and its reference."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from hypothesis import strategies as st

import ttc_fast
from tests.support import strategies
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
    scans = simulated(rng, scanner, draw(strategies.dtypes), stamps - stamps[0])
    return Stream(scanner, chosen, scans, stamps, rng.uniform(-turning, turning, frames))


def simulated(rng: np.random.Generator, scanner: dict[str, Any], dtype: Any, times: NDArray[Any]) -> NDArray[Any]:
    """Simulate surfaces of some beams each, at their own speeds, with noise, jumps, dropouts and special readings."""
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
    """Return whether two numbers are equal bit for bit; NaN equals NaN."""
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
