"""The cloud kernel against the NumPy reference: on all that `cloud_strategies` can think of, bit for bit."""

from __future__ import annotations

import itertools
import math
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import ttc_fast
from tests.support import cloud_strategies, strategies
from tests.support.cloud_layouts import IN_COLUMNS, LAYOUTS
from tests.support.common import both_dtypes, examples
from ttc_fast import Detection, Gate, reference

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from tests.support.cloud_strategies import CloudCase

MIN_X = [field.name for field in fields(reference.MinX)]
CLOUD_TTC = [field.name for field in fields(reference.CloudTTC) if field.name not in ("previous", "current")]

few_examples = examples(100)
many_examples = examples(500)


def said(result: Any, names: list[str]) -> dict[str, Any]:
    """Everything a result says, in a form that compares exactly; NaN equals NaN."""
    values = {name: getattr(result, name) for name in names}
    return {name: "nan" if isinstance(value, float) and math.isnan(value) else value for name, value in values.items()}


def assert_same(kernel: Any, specified: Any, estimator: Any, points: Any, gate: Gate) -> None:
    """Every number equal, but the mean: a sum depends on the order of its terms."""
    one, other = said(kernel, MIN_X), said(specified, MIN_X)
    if isinstance(estimator, ttc_fast.MeanOfLowest) and specified.detection is Detection.FOUND:
        last = reference.robust_min_x(points, gate=gate, estimator=ttc_fast.KthSmallest(estimator.k)).x
        largest = max(abs(specified.nearest_x), abs(last))
        assert math.isclose(one.pop("x"), other.pop("x"), rel_tol=1e-12, abs_tol=1e-12 * largest)
    assert one == other


def assert_parity(points: Any, gate: Gate, estimator: Any) -> None:
    kernel = ttc_fast.robust_min_x(points, gate=gate, estimator=estimator)
    specified = reference.robust_min_x(points, gate=gate, estimator=estimator)
    assert_same(kernel, specified, estimator, points, gate)


@many_examples
@given(cloud_strategies.clouds())
def test_one_cloud(case: CloudCase) -> None:
    before = [column.copy() for column in case.columns]
    assert_parity(case.points, case.gate, case.estimator)
    for column, unchanged in zip(case.columns, before, strict=True):
        np.testing.assert_array_equal(column, unchanged, err_msg="the input was written to")


@few_examples
@given(cloud_strategies.clouds())
def test_every_layout_says_the_same(case: CloudCase) -> None:
    by_columns = said(ttc_fast.robust_min_x(case.columns, **case.settings), MIN_X)
    alike = len({column.dtype for column in case.columns}) == 1
    for name, layout in (LAYOUTS if alike else IN_COLUMNS).items():
        assert said(ttc_fast.robust_min_x(layout(case.columns), **case.settings), MIN_X) == by_columns, name


@few_examples
@given(cloud_strategies.clouds(), strategies.seeds)
def test_the_order_of_points_decides_ties_only(case: CloudCase, seed: int) -> None:
    order = np.random.default_rng(seed).permutation(len(case.columns[0]))
    shuffled: Any = tuple(column[order] for column in case.columns)
    one, other = (ttc_fast.robust_min_x(each, **case.settings) for each in (case.columns, shuffled))
    names = [name for name in MIN_X if name != "index"]
    if isinstance(case.estimator, ttc_fast.Cluster):
        names.remove("support")  # of two clusters that begin equally near, the first in memory is the answer
    assert said(one, names) == said(other, names)


@few_examples
@given(
    case=cloud_strategies.clouds(),
    data=st.data(),
    dt=st.sampled_from([0.1, 1e-3, 7.0]),
    front_offset=st.sampled_from([0.0, 2.5, -1.0]),
)
def test_two_clouds(case: CloudCase, data: st.DataObject, dt: float, front_offset: float) -> None:
    # Of two equal means, rounding would decide whether the gap shrinks.
    assume(not isinstance(case.estimator, ttc_fast.MeanOfLowest))
    later = data.draw(cloud_strategies.points(case.gate, *cloud_strategies.stored_as(case.columns)))
    settings = case.settings | {"front_offset": front_offset}
    kernel, specified = (module.ttc_from_clouds(case.points, later, dt, **settings) for module in (ttc_fast, reference))
    assert said(kernel, CLOUD_TTC) == said(specified, CLOUD_TTC)
    assert said(kernel.previous, MIN_X) == said(specified.previous, MIN_X)
    assert said(kernel.current, MIN_X) == said(specified.current, MIN_X)


@many_examples
@given(*[st.sampled_from([0.0, -0.0, 10.0, 5e-324, 1e-300, -1.0]) | st.floats(-100, 100)] * 2, st.floats(1e-9, 1e9))
def test_two_distances(previous: float, current: float, dt: float) -> None:
    ttc = ttc_fast.ttc_from_distances(previous, current, dt)
    assert ttc == reference.ttc_from_distances(previous, current, dt)
    assert math.copysign(1, ttc) == 1


@pytest.mark.parametrize("dt", [1e-9, 10.0, 1e300])
def test_distances_whose_product_with_the_time_is_no_number(dt: float) -> None:
    ttc = ttc_fast.ttc_from_distances(1.5e308, 1e308, dt)
    assert ttc == reference.ttc_from_distances(1.5e308, 1e308, dt)
    assert ttc == pytest.approx(2 * dt)


# Named worlds, large enough for the nearest of a sample to be known first.
MANY = 30_011
RANDOM = np.random.default_rng(3)
AHEAD = RANDOM.uniform(3, 80, MANY)
ORDERS: dict[str, NDArray[Any]] = {
    "ascending": np.sort(AHEAD),
    "descending": np.sort(AHEAD)[::-1],
    "all equal": np.full(MANY, 7.3),
    "all inside": AHEAD,
    "equal behind farther ones": np.where(np.arange(MANY) < 3000, 9.1, 7.3),
    "none inside": -AHEAD,
    "all NaN": np.full(MANY, np.nan),
    "all zero": np.zeros(MANY),
    "one point": np.where(np.arange(MANY) == MANY - 2, 4.0, np.nan),
    "organ pipe": np.concatenate([np.sort(AHEAD[::2]), np.sort(AHEAD[1::2])[::-1]]),
    "saw": 3.0 + np.arange(MANY) % 100,
    "duplicates": np.round(AHEAD, 0),
    "the nearest last": np.where(np.arange(MANY) > MANY - 40, 3.5, AHEAD + 1),
    "the nearest between samples": np.where(np.arange(MANY) % 1024 == 555, AHEAD / 20, AHEAD + 1),
}
ESTIMATORS = [
    ttc_fast.Minimum(),
    ttc_fast.KthSmallest(20),
    ttc_fast.KthSmallest(400),
    ttc_fast.KthSmallest(500),
    ttc_fast.KthSmallest(MANY),
    ttc_fast.KthSmallest(MANY + 1),
    ttc_fast.MeanOfLowest(20),
    ttc_fast.Quantile(0.05),
    ttc_fast.Quantile(0.5),
    ttc_fast.InterquartileFence(0.5),
    ttc_fast.Supported(20, 0.1),
]


def scene(ahead: NDArray[np.float64], dtype: Any) -> tuple[NDArray[Any], ...]:
    """Columns x, y, z and intensity; all inside the default gate, if ahead."""
    rng = np.random.default_rng(4)
    y = np.where(ahead == 0, 0, rng.uniform(-1.5, 1.5, len(ahead)))
    z = np.where(ahead == 0, 0, rng.uniform(-1.0, 1.0, len(ahead)))
    return tuple(column.astype(dtype) for column in (ahead, y, z, rng.uniform(0, 1, len(ahead))))


@pytest.mark.parametrize("estimator", ESTIMATORS, ids=repr)
@pytest.mark.parametrize("order", ORDERS.values(), ids=list(ORDERS))
@both_dtypes
def test_adversarial_orders(dtype: Any, order: NDArray[np.float64], estimator: Any) -> None:
    columns = scene(order, dtype)
    assert_parity(LAYOUTS["rows"](columns), Gate(), estimator)
    assert_parity(columns, Gate(axes=("-x", "y", "z")), estimator)
    assert_parity(LAYOUTS["rows"](columns), Gate(y=(-1.0, 1.0), intensity=(0.2, 0.9)), estimator)


@pytest.mark.parametrize("estimator", [ESTIMATORS[1], ESTIMATORS[-1]], ids=repr)
@pytest.mark.parametrize("order", ORDERS.values(), ids=list(ORDERS))
def test_adversarial_orders_on_a_curve(order: NDArray[np.float64], estimator: Any) -> None:
    road = ttc_fast.Road(0.01, 0.02, -0.5)
    gate = Gate(y=(-30, 30), curvature=0.01, road=road, height=(0.2, 2.0))
    assert_parity(LAYOUTS["records, as of Velodyne"](scene(order, np.float32)), gate, estimator)


@pytest.mark.slow
@pytest.mark.parametrize("min_points", [1, 3, 40, 3000])
@pytest.mark.parametrize("tolerance", [0.05, 0.4, 5.0])
@pytest.mark.parametrize("order", ORDERS.values(), ids=list(ORDERS))
def test_adversarial_orders_of_clusters(order: NDArray[np.float64], tolerance: float, min_points: int) -> None:
    assert_parity(scene(order[::17], np.float32), Gate(), ttc_fast.Cluster(tolerance, min_points))


@pytest.mark.slow
@both_dtypes
@pytest.mark.parametrize("spacing", [0.05, 0.1, 0.15, 1.0])
def test_links_exactly_as_long_as_the_tolerance(spacing: float, dtype: Any) -> None:
    """A lattice: its links differ from the tolerance by rounding only, in x, y, z and across."""
    lattice = np.stack(np.meshgrid(*[np.arange(-6, 9)] * 3), axis=-1).reshape(-1, 3)
    points = (lattice * spacing + [spacing * 8, 0, 0]).astype(dtype)
    for tolerance in (spacing, math.sqrt(2) * spacing, math.sqrt(3) * spacing):
        for min_points in (1, 30, 1000):
            assert_parity(points, Gate(), ttc_fast.Cluster(tolerance, min_points))


@pytest.mark.parametrize("direction", list(itertools.product([-1, 0, 1], repeat=3)), ids=str)
def test_links_in_every_direction(direction: tuple[int, int, int]) -> None:
    """Two points a little less apart than the tolerance, and a little more, anywhere in a grid of cells."""
    apart = np.array(direction) / max(math.hypot(*direction), 1)
    for place in np.random.default_rng(6).uniform(-1, 1, (40, 3)):
        for length in (0.99, 1.01):
            points = np.array([place, place + length * apart]) + np.array([9, 0, 0])
            assert_parity(points, Gate(), ttc_fast.Cluster(1.0, 2))


@pytest.mark.parametrize("strays", [30, 31, 32, 33, 100])
def test_a_cluster_behind_many_strays(strays: int) -> None:
    """However many points lie nearer, each alone: and with the cluster among them in memory."""
    rng = np.random.default_rng(strays)
    alone = np.array([[3.0 + i, 0.0, 0.0] for i in range(strays)])
    clusters = [np.array([[at + 0.1 * i, 0.0, 0.0] for i in range(6)]) for at in (3.5 + strays, 6.5 + strays)]
    points = rng.permutation(np.concatenate([alone, *clusters]))
    for min_points in (1, 2, 6, 7):
        assert_parity(points, Gate(), ttc_fast.Cluster(0.2, min_points))


@pytest.mark.parametrize("seed", range(6))
def test_links_of_a_random_walk(seed: int) -> None:
    """Clusters that are grown forwards, backwards and sideways, and fall apart as the tolerance shrinks."""
    steps = np.random.default_rng(seed).normal(0, 1, (500, 3))
    walk = np.cumsum(steps / np.linalg.norm(steps, axis=1, keepdims=True), axis=0)
    for tolerance in (1.001, 0.95, 0.8, 0.6):
        for min_points in (2, 20, 200, 500):
            assert_parity(walk + np.array([60, 0, 0]), Gate(y=(-99, 99)), ttc_fast.Cluster(tolerance, min_points))


@both_dtypes
@pytest.mark.parametrize("gap", [0.5, 1.0, 0.1])
def test_a_gap_exactly_as_wide(gap: float, dtype: Any) -> None:
    """Support ends with the gap, its end included."""
    points = np.zeros((40, 3), dtype)
    points[:, 0] = np.arange(1, 41) * gap
    for count in (1, 2, 3):
        assert_parity(points, Gate(), ttc_fast.Supported(count, gap))
    assert_parity(points, Gate(), ttc_fast.Supported(3, 2 * gap))


def chain(size: int) -> NDArray[np.float64]:
    """A spiral of points, each linked to the next only."""
    turn = np.arange(size) * 0.1
    return np.stack([10 + turn / 10 * np.cos(turn), turn / 10 * np.sin(turn) / 10, turn], axis=-1)


@pytest.mark.parametrize("missing", [None, 0, 700, 1500])
def test_one_long_chain(missing: int | None) -> None:
    points = chain(1500)
    if missing is not None:
        points = np.delete(points, slice(missing, missing + 30), axis=0)
    for min_points in (2, 600, 800, 1500):
        assert_parity(points, Gate(), ttc_fast.Cluster(0.2, min_points))


@pytest.mark.parametrize("q", [0.0, 0.05, 0.1, 0.25, 1 / 3, 0.5, 0.7, 0.9, 1.0])
def test_quantiles_are_numpys(q: float) -> None:
    rng = np.random.default_rng(5)
    for size in range(1, 130):
        x = rng.uniform(0, 50, size)
        points = np.stack([x, np.zeros(size), np.ones(size)], axis=-1)
        assert ttc_fast.robust_min_x(points, estimator=ttc_fast.Quantile(q)).x == np.quantile(x, q)


@pytest.mark.parametrize(
    ("estimator", "x"),
    [
        (ttc_fast.Quantile(0.5), 0.0),
        (ttc_fast.Quantile(0.0), -1.5e308),
        (ttc_fast.Quantile(0.6), 3e307),
        (ttc_fast.Quantile(1.0), 1.5e308),
        (ttc_fast.InterquartileFence(0.0), 1.5e308),
        (ttc_fast.InterquartileFence(1.5), -1.5e308),
        (ttc_fast.MeanOfLowest(2), 0.0),
    ],
    ids=repr,
)
def test_sums_and_differences_beyond_the_largest_number(estimator: Any, x: float) -> None:
    points = np.array([[-1.5e308, 0.0, 0.5], [1.5e308, 0.0, 0.5]])
    gate = Gate(x=(-np.inf, np.inf))
    assert_parity(points, gate, estimator)
    assert ttc_fast.robust_min_x(points, gate=gate, estimator=estimator).x == pytest.approx(x, rel=1e-12)
    far = np.array([[1.5e308, 0.0, 0.5], [1.5e308, 0.1, 0.5]])
    assert ttc_fast.robust_min_x(far, estimator=estimator).x == pytest.approx(1.5e308, rel=1e-12)
    assert_parity(far, Gate(), estimator)


def test_many_points_on_one_spot_and_as_many_just_out_of_reach() -> None:
    spots = np.repeat([[5.0, 0.0, 0.0], [5.0, 0.21, 0.0], [9.0, 0.0, 0.0]], [700, 700, 1500], axis=0)
    for min_points in (700, 701, 1501):
        assert_parity(spots, Gate(), ttc_fast.Cluster(0.2, min_points))


GATES: dict[str, Callable[[float], Gate]] = {
    "low x": lambda bound: Gate(x=(bound, math.inf)),
    "high x": lambda bound: Gate(x=(0, bound)),
    "high y": lambda bound: Gate(y=(-2, bound)),
    "high z": lambda bound: Gate(z=(-2, bound)),
    "low intensity": lambda bound: Gate(intensity=(bound, 9)),
    "flipped": lambda bound: Gate(
        x=(-math.inf, math.inf), axes=("-z", "x", "-y"), y=(-bound, math.inf), z=(-5, -bound)
    ),
    "low height": lambda bound: Gate(road=ttc_fast.Road(0, 0, 0), height=(bound, math.inf)),
    "curved": lambda bound: Gate(x=(bound, math.inf), curvature=1e-12),
}


@pytest.mark.parametrize("gate", GATES.values(), ids=list(GATES))
@both_dtypes
@pytest.mark.parametrize("bound", [0.1, 0.7, 1.9])
def test_points_exactly_on_the_bounds(bound: float, dtype: Any, gate: Callable[[float], Gate]) -> None:
    """Bounds that float32 has to round, and the numbers next to them on either side."""
    on = dtype(bound)
    values = np.array([on, np.nextafter(on, dtype(9)), np.nextafter(on, dtype(0))] * 12, dtype)
    columns = (values, values[::-1].copy(), np.roll(values, 1), values)
    for layout in LAYOUTS.values():
        assert_parity(layout(columns), gate(bound), ttc_fast.KthSmallest(3))


def test_a_fence_beyond_every_number() -> None:
    """A factor so large that its product overflows is no fence at all."""
    points = np.array([[1.0, 0.0, 1.0], [3e38, 0.0, 1.0]], np.float32)
    assert_parity(points, Gate(), ttc_fast.InterquartileFence(1e300))
    assert ttc_fast.robust_min_x(points, estimator=ttc_fast.InterquartileFence(1e300)).x == 1.0
