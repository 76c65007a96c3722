"""Kernels against the NumPy reference: every public name over both, on all that `strategies` can think of."""

from __future__ import annotations

import math
import types
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ttc_fast
from tests.support import strategies
from tests.support.common import CAR, both_dtypes, examples
from tests.support.strategies import Case
from ttc_fast import reference

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

COUNTS = [field.name for field in fields(reference.Counts)]
NEAREST = [field.name for field in fields(reference.Nearest) if field.name != "counts"]

few_examples = examples(60)
many_examples = examples(400)


def both(settings: dict[str, Any]) -> tuple[Any, Any]:
    """The kernel's scanner, and the reference's."""
    return ttc_fast.ScanTTC(**settings), reference.ScanTTC(**settings)


def outcome(call: Callable[[], Any]) -> Any:
    """The result of a call, or the type of exception by which a scan has no result."""
    try:
        return call()
    except ttc_fast.NoDataError as error:
        return type(error)


def facts(nearest: Any) -> dict[str, Any]:
    """Everything a result says, in a form that compares exactly; NaN equals NaN."""
    said = {name: getattr(nearest, name) for name in NEAREST}
    said |= {name: getattr(nearest.counts, name) for name in COUNTS}
    return {name: "nan" if isinstance(value, float) and math.isnan(value) else value for name, value in said.items()}


def assert_same_per_beam(kernel: NDArray[Any], specified: NDArray[Any]) -> None:
    """Equal dtype, shape and values, but for a few units in the last place."""
    assert kernel.dtype == specified.dtype
    assert kernel.shape == specified.shape
    tiny = np.finfo(specified.dtype).smallest_subnormal
    np.testing.assert_allclose(kernel, specified, rtol=4 * np.finfo(specified.dtype).eps, atol=4 * tiny)


def assert_parity(case: Case) -> None:
    """All three methods say the same of one scan."""
    kernel, specified = both(case.settings)
    ranges, motion = case.ranges, case.motion
    before = ranges.copy()

    assert facts(kernel.nearest(ranges, *motion)) == facts(specified.nearest(ranges, *motion))
    assert outcome(lambda: kernel.min(ranges, *motion)) == outcome(lambda: specified.min(ranges, *motion))

    status, specified_status = np.full(ranges.shape, 77, np.uint8), np.full(ranges.shape, 78, np.uint8)
    each = kernel.per_beam(ranges, *motion, status_out=status)
    assert_same_per_beam(each, specified.per_beam(ranges, *motion, status_out=specified_status))
    np.testing.assert_array_equal(status, specified_status)
    np.testing.assert_array_equal(ranges, before, err_msg="the input was written to")


@many_examples
@given(strategies.cases())
def test_one_scan(case: Case) -> None:
    assert_parity(case)


@few_examples
@given(strategies.batches())
def test_a_batch(case: Case) -> None:
    kernel, specified = both(case.settings)
    ranges, motion = case.ranges, case.motion

    batch, specified_batch = kernel.nearest(ranges, *motion), specified.nearest(ranges, *motion)
    assert len(batch) == len(batch.counts) == len(specified_batch) == len(specified_batch.counts) == len(ranges)
    pairs = [(getattr(batch, name), getattr(specified_batch, name)) for name in NEAREST]
    pairs += [(getattr(batch.counts, name), getattr(specified_batch.counts, name)) for name in COUNTS]
    for column, specified_column in pairs:
        np.testing.assert_array_equal(column, specified_column, strict=True)
    for row in range(-len(ranges), len(ranges)):
        assert facts(batch[row]) == facts(specified_batch[row])

    least = outcome(lambda: kernel.min(ranges, *motion))
    np.testing.assert_array_equal(least, outcome(lambda: specified.min(ranges, *motion)), strict=True)

    status, specified_status = np.full(ranges.shape, 77, np.uint8), np.full(ranges.shape, 78, np.uint8)
    each = kernel.per_beam(ranges, *motion, status_out=status)
    assert_same_per_beam(each, specified.per_beam(ranges, *motion, status_out=specified_status))
    np.testing.assert_array_equal(status, specified_status)


@few_examples
@given(strategies.cases())
def test_results_may_be_written_over_the_ranges(case: Case) -> None:
    written = [case.ranges.copy(), case.ranges.copy()]
    for module, ranges in zip((ttc_fast, reference), written, strict=True):
        assert module.ScanTTC(**case.settings).per_beam(ranges, *case.motion, out=ranges) is ranges
    assert_same_per_beam(*written)


@few_examples
@given(strategies.cases())
def test_tables_and_messages(case: Case) -> None:
    chosen = case.settings
    kernel, specified = both(chosen)
    assert kernel.beams == specified.beams == chosen["beams"]
    np.testing.assert_array_equal(kernel.angles, specified.angles, strict=True)

    names = ("angle_min", "angle_increment", "range_min", "range_max")
    message = types.SimpleNamespace(**{name: chosen[name] for name in names}, ranges=case.ranges)
    others = {name: value for name, value in chosen.items() if name not in (*names, "beams")}
    by_message = [module.ScanTTC.from_message(message, **others) for module in (ttc_fast, reference)]
    said = [facts(scan.nearest(case.ranges, *case.motion)) for scan in (*by_message, specified)]
    assert said[0] == said[1] == said[2]


@many_examples
@given(
    dtype=strategies.dtypes,
    shape=st.sampled_from([(0,), (1,), (15,), (16,), (17,), (129,), (3, 5), (2, 33), (0, 4)]),
    seed=strategies.seeds,
    rate=st.sampled_from(["closing_speed", "range_rate"]),
    scalar=st.none() | strategies.speeds | st.just(1e38),
    min_closing_speed=st.sampled_from([0.0, 0.01, 1e-300, 1e300]),
)
def test_ittc(
    dtype: Any, shape: tuple[int, ...], seed: int, rate: str, scalar: float | None, min_closing_speed: float
) -> None:
    rng = np.random.default_rng(seed)
    scanner = {"range_min": 0.1, "range_max": 10.0, "limits": None}
    values = strategies.readings(scanner, dtype)
    ranges = np.where(rng.random(shape) < 0.5, rng.choice(values, shape), rng.uniform(0, 9, shape).astype(dtype))
    speeds = np.where(rng.random(shape) < 0.3, rng.choice(values, shape), rng.normal(0, 9, shape).astype(dtype))
    rates: dict[str, Any] = {rate: speeds if scalar is None else scalar}
    status, specified_status = np.full(shape, 77, np.uint8), np.full(shape, 78, np.uint8)

    ttc = ttc_fast.ittc(ranges, **rates, min_closing_speed=min_closing_speed, status_out=status)
    specified = reference.ittc(ranges, **rates, min_closing_speed=min_closing_speed, status_out=specified_status)
    assert_same_per_beam(ttc, specified)
    np.testing.assert_array_equal(status, specified_status)
    over = ranges.copy()
    assert ttc_fast.ittc(over, **rates, min_closing_speed=min_closing_speed, out=over) is over
    assert_same_per_beam(over, specified)


# One scanner of 1080 beams over 270 degrees, for the worlds that have names.
BEAMS = 1080
SCANNER: dict[str, Any] = {
    "angle_min": -0.75 * math.pi,
    "angle_increment": 1.5 * math.pi / (BEAMS - 1),
    "beams": BEAMS,
}
COS = np.cos(SCANNER["angle_min"] + SCANNER["angle_increment"] * np.arange(BEAMS))
WORLDS = {
    "flat wall": 4 / np.abs(COS),
    "every beam ties": 4 * np.abs(COS),
    "round room": np.full(BEAMS, 4.0),
    "all NaN": np.full(BEAMS, np.nan),
    "all inf": np.full(BEAMS, np.inf),
    "all -inf": np.full(BEAMS, -np.inf),
    "all zero": np.zeros(BEAMS),
    "subnormal": np.full(BEAMS, 1e-42),
    "huge": np.full(BEAMS, 3e38),
}
MOTIONS = {
    "forward": (5.0,),
    "reversing": (-5.0,),
    "standing": (0.0,),
    "creeping": (1e-5,),
    "spinning": (0.0, 3.0),
    "sliding": (4.0, 1.0, 0.5),
}


@pytest.mark.parametrize("motion", MOTIONS.values(), ids=list(MOTIONS))
@pytest.mark.parametrize("world", WORLDS.values(), ids=list(WORLDS))
@both_dtypes
def test_adversarial(dtype: Any, world: NDArray[np.float64], motion: tuple[float, ...]) -> None:
    variants: list[dict[str, Any]] = [
        {},
        {"range_min": 0.1, "range_max": 30.0, "mount": (0.27, 0.0, math.pi), "outline": CAR},
        {"min_closing_speed": 0.0, "minimum": ttc_fast.KthSmallest(7)},
        {"limits": (0.2, 10.0), "limits_policy": "clamp", "minimum": ttc_fast.NeighbourSupport()},
    ]
    for variant in variants:
        assert_parity(Case(SCANNER | variant, world.astype(dtype), motion))


@both_dtypes
def test_a_million_beams(dtype: Any) -> None:
    beams = 2**20
    rng = np.random.default_rng(20)
    scanner = {"angle_min": -math.pi, "angle_increment": 2 * math.pi / beams, "beams": beams, "mount": (0.2, 0, 0.1)}
    chosen = scanner | {"limits": None, "range_min": 0.05, "range_max": 30.0, "outline": CAR}
    noisy = rng.uniform(1, 20, beams).astype(dtype)
    noisy[rng.integers(beams, size=1000)] = rng.choice(strategies.readings(chosen, dtype), 1000)
    assert_parity(Case(chosen, noisy, (7.0, 0.4)))
    assert_parity(Case(chosen, np.full(beams, np.nan, dtype), (7.0,)))


VOTES = [
    ttc_fast.KthSmallest(1),
    ttc_fast.KthSmallest(6),
    ttc_fast.KthSmallest(150),
    ttc_fast.NeighbourSupport(),
    ttc_fast.NeighbourSupport(count=4, window=2, gap=0.1),
    ttc_fast.NeighbourSupport(count=5, window=30, gap=0.02),
    ttc_fast.NeighbourSupport(count=1, window=128, gap=0.0),
]


@pytest.mark.parametrize("minimum", VOTES, ids=repr)
def test_votes_over_walls_with_speckles(minimum: Any) -> None:
    rng = np.random.default_rng(7)
    beams = 300
    for dtype in [np.float32, np.float64] * 10:
        walls = np.repeat(rng.uniform(1, 9, 30), beams // 30)
        ranges = (walls + rng.normal(0, 0.05, beams)).astype(dtype)
        ranges[rng.random(beams) < 0.1] = rng.uniform(0.3, 1)
        scanner = {"angle_min": -2.0, "angle_increment": 4 / beams, "beams": beams, "minimum": minimum}
        assert_parity(Case(scanner | {"mask": rng.random(beams) < 0.4}, ranges, (rng.uniform(1, 9), 0.3)))
        assert_parity(Case(scanner | {"mount": (0.4, 0.0, 1.5), "outline": CAR}, ranges, (-3.0,)))


@pytest.mark.parametrize("speed", [0.01, 0.1, 0.3, 2.0])
@both_dtypes
def test_closing_exactly_at_the_least_is_not_closing(dtype: Any, speed: float) -> None:
    """However `speed` rounds to float32, it is compared with a limit that rounds in the same way."""
    for scan in both({"angle_min": 0.0, "angle_increment": 0.1, "beams": 1, "min_closing_speed": speed}):
        status = np.empty(1, np.uint8)
        ranges = np.array([3.0], dtype)
        assert scan.per_beam(ranges, speed, status_out=status) == math.inf
        assert status == scan.nearest(ranges, speed).status == ttc_fast.Status.NOT_CLOSING


def test_contact_is_not_the_best_of_the_others() -> None:
    """A beam in contact on the side that opens: the nearest is another beam, the status still says CONTACT."""
    for module in (ttc_fast, reference):
        scan = module.ScanTTC(0.0, math.pi, 2, outline=CAR)
        nearest = scan.nearest(np.array([2.4, 0.05]), 1.0)
        assert (nearest.ttc, nearest.status, nearest.beam) == (2.0, ttc_fast.Status.CONTACT, 0)
        assert nearest.counts.contact == 1
