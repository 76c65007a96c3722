"""The swept path kernels against the NumPy reference, bit for bit, on random and adversarial input."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ttc_fast
from tests.support import path_oracle, strategies
from tests.support.cloud_layouts import LAYOUTS
from tests.support.common import CAR, examples
from ttc_fast import reference

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

COUNTS = [field.name for field in fields(reference.Counts)]
NEAREST = [field.name for field in fields(reference.Nearest) if field.name != "counts"]
POINT = [field.name for field in fields(reference.NearestPoint) if field.name != "counts"]

few_examples = examples(100)
many_examples = examples(400)

outlines = st.sampled_from([*path_oracle.OUTLINES, (-1e-9, 1e-9, -1e-9, 1e-9), (90, 93, -1, 1)])
horizons = st.sampled_from([5.0, 5.0, 0.3, 60.0, 1e6, 1e-6])
speeds = strategies.speeds | st.floats(-10, 10)
yaw_rates = (
    st.sampled_from([0.0, -0.0, 1e-300, 5e-31, 1e-16, -1e-9, 1e-3, 1e4])
    | st.floats(-10, 10)
    | st.floats(-16, 1).map(lambda exponent: 10.0**exponent)
)
dtypes = st.sampled_from([np.float32, np.float64])


@dataclass
class Case:
    settings: dict[str, Any]
    points: NDArray[Any]
    motion: tuple[float, float, float]


def points(rng: np.random.Generator, count: int, outline: tuple[float, ...], dtype: Any) -> NDArray[Any]:
    """Points near the outline, on its edges, far away, and such as are none."""
    size = max(outline[1] - outline[0], outline[3] - outline[2])
    middle = np.array([outline[0] + outline[1], outline[2] + outline[3]]) / 2
    spread = size * 10.0 ** rng.uniform(-1, 2.5)
    values = middle + rng.uniform(-spread, spread, (count, 2))
    with np.errstate(over="ignore"):
        special = np.array([np.nan, np.inf, -np.inf, 0.0, -0.0, 1e-45, 1e30, -1e38, np.finfo(dtype).max], dtype)
    mode = rng.integers(4)
    for axis, edges in enumerate((outline[:2], outline[2:])):
        on = rng.random(count) < (0.0, 0.1, 0.5, 0.1)[mode]
        values[on, axis] = rng.choice(edges, np.count_nonzero(on))
    found = values.astype(dtype)
    odd = rng.random((count, 2)) < (0.0, 0.02, 0.0, 0.3)[mode]
    found[odd] = rng.choice(special, np.count_nonzero(odd))
    return found


@st.composite
def cases(draw: st.DrawFn) -> Case:
    outline = draw(outlines)
    rng = np.random.default_rng(draw(strategies.seeds))
    count = draw(st.sampled_from([0, 1, 2, 15, 16, 17, 31, 33, 200, 1025]))
    chosen = {"outline": outline, "horizon": draw(horizons), "no_data": draw(st.sampled_from([None, 0.0, math.inf]))}
    motion = (draw(speeds), draw(yaw_rates), draw(strategies.lateral_speeds))
    return Case(chosen, points(rng, count, outline, draw(dtypes)), motion)


def outcome(call: Callable[..., Any], *arguments: Any, **keywords: Any) -> Any:
    """The result of a call, or the type of exception by which it has none."""
    try:
        return call(*arguments, **keywords)
    except ValueError as error:
        return type(error)


def facts(nearest: Any, names: list[str]) -> Any:
    """Everything a result says, in a form that compares exactly; NaN equals NaN."""
    if isinstance(nearest, type):
        return nearest
    said = {name: getattr(nearest, name) for name in names}
    said |= {name: getattr(nearest.counts, name) for name in COUNTS}
    return {name: "nan" if isinstance(value, float) and math.isnan(value) else value for name, value in said.items()}


def every(path: Any, method: str, points: Any, motion: Any, shape: tuple[int, ...]) -> Any:
    """Times and statuses, or why there are none."""
    status = np.full(shape, 77, np.uint8)
    times = outcome(getattr(path, method), points, *motion, status_out=status)
    return times, status


def assert_parity(case: Case) -> None:
    kernel, specified = (module.SweptPath(**case.settings) for module in (ttc_fast, reference))
    before = case.points.copy()
    said = [outcome(path.nearest, case.points, *case.motion) for path in (kernel, specified)]
    assert facts(said[0], POINT) == facts(said[1], POINT)
    least = [outcome(path.min, case.points, *case.motion) for path in (kernel, specified)]
    assert least[0] == least[1]
    (times, status), (specified_times, specified_status) = (
        every(path, "per_point", case.points, case.motion, (len(case.points),)) for path in (kernel, specified)
    )
    np.testing.assert_array_equal(times, specified_times, strict=True)
    np.testing.assert_array_equal(status, specified_status)
    np.testing.assert_array_equal(case.points, before, err_msg="the input was written to")


@many_examples
@given(cases())
def test_one_cloud(case: Case) -> None:
    assert_parity(case)


@few_examples
@given(cases(), st.integers(0, 4), dtypes)
def test_a_batch(case: Case, rows: int, dtype: Any) -> None:
    rng = np.random.default_rng(rows)
    clouds = np.array([points(rng, 40, case.settings["outline"], dtype) for _ in range(rows)], dtype).reshape(
        rows, 40, 2
    )
    motion = (np.linspace(-3, 9, rows), case.motion[1], np.zeros(rows))
    kernel, specified = (module.SweptPath(**case.settings) for module in (ttc_fast, reference))
    batch, specified_batch = (outcome(path.nearest, clouds, *motion) for path in (kernel, specified))
    if isinstance(batch, type):
        assert batch is specified_batch
        return
    assert len(batch) == len(batch.counts) == len(specified_batch) == rows
    for name in POINT:
        np.testing.assert_array_equal(getattr(batch, name), getattr(specified_batch, name), strict=True)
    for name in COUNTS:
        np.testing.assert_array_equal(getattr(batch.counts, name), getattr(specified_batch.counts, name), strict=True)
    for row in range(-rows, rows):
        assert facts(batch[row], POINT) == facts(specified_batch[row], POINT)
        alone = outcome(kernel.nearest, clouds[row], motion[0][row], motion[1])
        assert facts(alone, POINT) == facts(batch[row], POINT)
    least = [outcome(path.min, clouds, *motion) for path in (kernel, specified)]
    np.testing.assert_array_equal(*least)
    (times, status), (specified_times, specified_status) = (
        every(path, "per_point", clouds, motion, (rows, 40)) for path in (kernel, specified)
    )
    np.testing.assert_array_equal(times, specified_times, strict=True)
    np.testing.assert_array_equal(status, specified_status)


@few_examples
@given(cases())
def test_every_layout_says_the_same(case: Case) -> None:
    x, y = case.points.T
    z = np.ones_like(x)
    columns = (x, y, z, z)
    kernel, specified = (module.SweptPath(**case.settings) for module in (ttc_fast, reference))
    expected = facts(outcome(specified.nearest, (x, y, z), *case.motion), POINT)
    assert facts(outcome(kernel.nearest, (x, y, z), *case.motion), POINT) == expected
    for name, layout in LAYOUTS.items():
        laid = layout(columns)
        if not isinstance(laid, tuple) and laid.ndim == (2 if laid.dtype.names is None else 1):
            assert facts(outcome(kernel.nearest, laid, *case.motion), POINT) == expected, name


@many_examples
@given(strategies.cases(), horizons, yaw_rates)
def test_one_scan(case: strategies.Case, horizon: float, yaw_rate: float) -> None:
    if case.settings["outline"] is None:
        case.settings["outline"] = CAR
    motion = (case.motion[0], yaw_rate, case.motion[2])
    kernel, specified = (
        module.ScanSweptPath(module.ScanTTC(**case.settings), horizon=horizon) for module in (ttc_fast, reference)
    )
    before = case.ranges.copy()
    said = [outcome(path.nearest, case.ranges, *motion) for path in (kernel, specified)]
    assert facts(said[0], NEAREST) == facts(said[1], NEAREST)
    least = [outcome(path.min, case.ranges, *motion) for path in (kernel, specified)]
    assert least[0] == least[1]
    (times, status), (specified_times, specified_status) = (
        every(path, "per_beam", case.ranges, motion, case.ranges.shape) for path in (kernel, specified)
    )
    np.testing.assert_array_equal(times, specified_times, strict=True)
    np.testing.assert_array_equal(status, specified_status)
    np.testing.assert_array_equal(case.ranges, before, err_msg="the input was written to")
    if not isinstance(times, type):
        assert kernel.per_beam(case.ranges, *motion, out=case.ranges) is case.ranges
        np.testing.assert_array_equal(case.ranges, times)


@few_examples
@given(strategies.batches(), horizons)
def test_a_batch_of_scans(case: strategies.Case, horizon: float) -> None:
    case.settings["outline"] = CAR
    kernel, specified = (
        module.ScanSweptPath(module.ScanTTC(**case.settings), horizon=horizon) for module in (ttc_fast, reference)
    )
    batch, specified_batch = (outcome(path.nearest, case.ranges, *case.motion) for path in (kernel, specified))
    if isinstance(batch, type):
        assert batch is specified_batch
        return
    for row in range(len(case.ranges)):
        assert facts(batch[row], NEAREST) == facts(specified_batch[row], NEAREST)
    least = [outcome(path.min, case.ranges, *case.motion) for path in (kernel, specified)]
    np.testing.assert_array_equal(*least)


@few_examples
@given(strategies.seeds, outlines)
def test_worlds_that_graze(seed: int, outline: tuple[float, float, float, float]) -> None:
    """Points aimed at edges and corners, each in its own motion."""
    worlds = path_oracle.random_worlds(np.random.default_rng(seed), 200, outline)
    kernel, specified = (worlds.kernel(module.SweptPath(outline)) for module in (ttc_fast, reference))
    np.testing.assert_array_equal(kernel, specified)


@st.composite
def scanners(draw: st.DrawFn, outline: tuple[float, ...]) -> dict[str, Any]:
    """A scanner anywhere on the vehicle or beside it, some beams of which are masked."""
    beams = draw(st.sampled_from([1, 2, 3, 37, 90, 361]))
    view = draw(st.sampled_from([0.3, math.pi / 2, math.pi, 4.71, 2 * math.pi, 9.0]))
    rng = np.random.default_rng(draw(strategies.seeds))
    masked = np.zeros(beams, bool)
    for _ in range(draw(st.integers(0, 3))):
        first = rng.integers(beams)
        masked[first : first + rng.integers(1, 1 + beams // 2 + 1)] = True
    size = outline[1] - outline[0]
    mount = (outline[0] + size * draw(st.floats(-0.2, 1.2)), draw(st.floats(-0.5, 0.5)) * size, draw(st.floats(-4, 4)))
    increment = view / max(beams - 1, 1) * draw(st.sampled_from([1.0, -1.0]))
    return {
        "angle_min": -view / 2 * np.sign(increment),
        "angle_increment": increment,
        "beams": beams,
        "mount": mount,
        "outline": outline,
        "mask": list(masked),
    }


@few_examples
@given(
    st.data(),
    st.sampled_from([*path_oracle.OUTLINES, CAR]),
    speeds,
    yaw_rates,
    strategies.lateral_speeds,
    st.floats(0, 3),
)
def test_what_nothing_looks_at(
    data: st.DataObject, outline: tuple[float, ...], speed: float, yaw_rate: float, lateral_speed: float, ahead: float
) -> None:
    """The last bit of a sine may differ between NumPy and Rust, which may move a gap across the middle of a strip."""
    chosen = [data.draw(scanners(outline)) for _ in range(data.draw(st.integers(1, 3)))]
    one, *others = (ttc_fast.ScanSweptPath(ttc_fast.ScanTTC(**each)) for each in chosen)
    same, *others_same = (reference.ScanSweptPath(reference.ScanTTC(**each)) for each in chosen)
    motion = (speed, yaw_rate, lateral_speed)
    expected = outcome(same.unseen, *motion, ahead=ahead, others=others_same)
    got = outcome(one.unseen, *motion, ahead=ahead, others=others)
    if not isinstance(expected, float):
        assert got is expected
        return
    length = outline[1] - outline[0] if abs(lateral_speed) > abs(speed) else outline[3] - outline[2]
    nudged = [
        same.unseen(speed, yaw_rate, lateral_speed, ahead=ahead * (1 + e), others=others_same) for e in (-1e-9, 1e-9)
    ]
    assert got == expected or got in nudged or abs(got - expected) <= length / 32 + 1e-12


def test_nothing_looks_at_the_path_of_the_slowest_vehicle() -> None:
    """The time in which it drives its own width is more than a float holds."""
    behind = {"mount": (-0.1, 0.0, math.pi), "outline": CAR}
    for module in (ttc_fast, reference):
        path = module.ScanSweptPath(module.ScanTTC(-0.15, 0.3, 2, **behind))
        assert path.unseen(5e-324, ahead=0.0) == path.unseen(1.0, ahead=0.0) == pytest.approx(CAR[3] - CAR[2])
