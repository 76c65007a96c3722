"""Results and settings are values: they compare, hash, pickle, copy and show themselves alike."""

from __future__ import annotations

import copy
import math
import pickle
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import ttc_fast
from ttc_fast import Status

if TYPE_CHECKING:
    from collections.abc import Callable

SCAN = ttc_fast.ScanTTC(-0.1, 0.1, 3, range_min=0.1, mask=[False, False, True], minimum=ttc_fast.KthSmallest(1))
RANGES = np.array([[3.0, 2.0, np.nan], [np.nan, 0.01, 5.0], [9.0, np.inf, 1.0]])
PATH = ttc_fast.SweptPath((-1.0, 1.0, -1.0, 1.0), no_data=3.0)
CLOUD = np.column_stack([np.linspace(8.0, 9.0, 12), np.zeros(12), np.ones(12)])
ROAD = np.stack([*np.meshgrid(np.arange(4.0, 30.0), np.arange(-6.0, 6.0)), np.full((12, 26), -1.7)], axis=-1)
SQUARE = np.array([[500.0, 150.0], [700.0, 150.0], [700.0, 300.0], [500.0, 300.0]])


def tracked() -> Any:
    tracker = ttc_fast.DistanceTracker()
    return [tracker.update(20.0 - 0.4 * frame, 0.1 * frame) for frame in range(9)][-1]


RESULTS: dict[str, Callable[[], Any]] = {
    "Nearest": lambda: SCAN.nearest(RANGES[0], 2.0),
    "Nearest without a beam": lambda: SCAN.nearest(RANGES[1], 2.0),
    "Counts": lambda: SCAN.nearest(RANGES[0], 2.0).counts,
    "NearestPoint": lambda: PATH.nearest(np.array([[4.0, 0.5], [2.0, 3.0]]), 2.0),
    "RangeRateNearest": lambda: ttc_fast.RangeRate(SCAN).update(RANGES[0], 0.0),
    "MinX": lambda: ttc_fast.robust_min_x(CLOUD),
    "CloudTTC": lambda: ttc_fast.ttc_from_clouds(CLOUD, CLOUD - [0.5, 0.0, 0.0], 0.1),
    "TrackedTTC": tracked,
    "TrackedTTC without an interval": lambda: ttc_fast.DistanceTracker().update(3.0, 0.0),
    "RoadFit": lambda: ttc_fast.fit_road(ROAD),
    "RoadFit without a road": lambda: ttc_fast.fit_road(np.ones((5, 3))),
    "KeypointTTC": lambda: ttc_fast.ttc_from_keypoints(SQUARE, 1.05 * SQUARE, 0.1),
}
BATCHES: dict[str, Callable[[], Any]] = {
    "NearestBatch": lambda: SCAN.nearest(RANGES, 2.0),
    "CountsBatch": lambda: SCAN.nearest(RANGES, 2.0).counts,
    "NearestPointBatch": lambda: PATH.nearest(np.array([[[4.0, 0.5]], [[np.nan, 3.0]]]), 2.0),
    "an empty batch": lambda: SCAN.nearest(RANGES[:0], 2.0),
}
SETTINGS = [SCAN, PATH, ttc_fast.ScanSweptPath(ttc_fast.ScanTTC(0.0, 0.1, 3, outline=(-1.0, 1.0, -1.0, 1.0)))]
COPIES = [copy.copy, copy.deepcopy, lambda it: pickle.loads(pickle.dumps(it))]
every_copy = pytest.mark.parametrize("again", COPIES, ids=["copy", "deepcopy", "pickle"])


@pytest.mark.parametrize("make", [*RESULTS.values(), *BATCHES.values()], ids=[*RESULTS, *BATCHES])
@every_copy
def test_copies_of_results_are_equal(make: Any, again: Any) -> None:
    result = make()
    other = again(result)
    assert type(other) is type(result)
    assert (other == result) is True
    assert (other != result) is False
    assert repr(other) == repr(result)
    assert list(other._asdict()) == list(result._asdict())
    assert result == type(result)._make(result._asdict().values())


@pytest.mark.parametrize("make", RESULTS.values(), ids=RESULTS)
def test_a_result_has_fields_a_hash_and_a_text(make: Any) -> None:
    result = make()
    fields = result._asdict()
    assert hash(result) == hash(make())
    assert {result} == {make()}
    assert result != 3
    assert result != RESULTS["MinX" if not isinstance(result, ttc_fast.MinX) else "Counts"]()
    assert repr(result).startswith(type(result).__name__ + "(")
    for name, value in fields.items():
        assert getattr(result, name) is value or repr(getattr(result, name)) == repr(value)
        if isinstance(value, Status):
            assert f"{name}={value.name}" in repr(result)
        elif isinstance(value, float):
            assert f"{name}={'NaN' if math.isnan(value) else f'{value:.4f}'}" in repr(result)
        assert f"<th>{name}</th>" in result._repr_html_()


@pytest.mark.parametrize("make", BATCHES.values(), ids=BATCHES)
def test_a_batch_is_its_rows(make: Any) -> None:
    batch = make()
    rows = list(batch)
    assert len(rows) == len(batch)
    assert f"({len(batch)} " in repr(batch)
    for name, column in batch._asdict().items():
        assert len(column) == len(batch)
        values = [getattr(row, name) for row in rows]
        np.testing.assert_array_equal(np.array(column), np.array(values)) if isinstance(column, np.ndarray) else None
        assert f"<th>{name}</th>" in batch._repr_html_()
    with pytest.raises(TypeError):
        hash(batch)


def test_one_field_makes_results_differ() -> None:
    result = SCAN.nearest(RANGES[0], 2.0)
    for name, value in result._asdict().items():
        if isinstance(value, float):
            other = type(result)._make((result._asdict() | {name: value + 1.0}).values())
            assert other != result
            assert getattr(other, name) == value + 1.0
    batch = SCAN.nearest(RANGES, 2.0)
    assert batch != SCAN.nearest(RANGES, 2.5)
    assert batch != SCAN.nearest(RANGES[:2], 2.0)


def test_zeros_are_equal_and_so_are_nans() -> None:
    values = ttc_fast.robust_min_x(CLOUD)._asdict()
    zero, minus = (ttc_fast.MinX._make((values | {"x": x}).values()) for x in (0.0, -0.0))
    assert zero == minus
    assert hash(zero) == hash(minus)
    nan = [ttc_fast.MinX._make((values | {"x": x}).values()) for x in (math.nan, -math.nan)]
    assert nan[0] == nan[1]
    assert hash(nan[0]) == hash(nan[1])


def test_values_that_make_no_result_are_refused() -> None:
    values = [*SCAN.nearest(RANGES[0], 2.0)._asdict().values()]
    for wrong in ([], values[:-1], [*values, 1]):
        with pytest.raises(ValueError, match="values must be 8, one for each field"):
            ttc_fast.Nearest._make(wrong)
    with pytest.raises(TypeError):
        ttc_fast.Nearest._make(["soon", *values[1:]])
    with pytest.raises(ValueError, match="10 is no Status"):
        ttc_fast.Nearest._make([values[0], 10, *values[2:]])
    columns = [*SCAN.nearest(RANGES, 2.0)._asdict().values()]
    with pytest.raises(ValueError, match="one length"):
        ttc_fast.NearestBatch._make([columns[0][:1], *columns[1:]])


@pytest.mark.parametrize("settings", SETTINGS, ids=lambda it: type(it).__name__)
@every_copy
def test_scanners_and_paths_are_values(settings: Any, again: Any) -> None:
    other = again(settings)
    assert other == settings
    assert hash(other) == hash(settings)
    assert repr(other) == repr(settings)
    assert all(other != different for different in SETTINGS if different is not settings)
    assert settings != type(settings)(**(settings.__getnewargs_ex__()[1] | changed(settings)))


def changed(settings: Any) -> dict[str, Any]:
    return {"range_min": 0.2} if isinstance(settings, ttc_fast.ScanTTC) else {"horizon": 1.5}


def test_settings_are_read_by_their_names() -> None:
    assert (SCAN.angle_min, SCAN.beams, SCAN.range_min, SCAN.range_max) == (-0.1, 3, 0.1, math.inf)
    assert (SCAN.mask, SCAN.minimum, SCAN.limits) == ((False, False, True), ttc_fast.KthSmallest(1), None)
    assert (PATH.outline, PATH.horizon, PATH.no_data) == ((-1.0, 1.0, -1.0, 1.0), 5.0, 3.0)
    rates = ttc_fast.RangeRate(SCAN, window=0.4)
    assert (rates.scan, rates.window, rates.minimum) == (SCAN, 0.4, ttc_fast.NeighbourSupport(6, 4))
    tracker = ttc_fast.DistanceTracker(noise=0.1)
    assert (tracker.method, tracker.noise, tracker.confirm) == (ttc_fast.MotionMixture(), 0.1, 3)
    cloud = ttc_fast.CloudTracker(ttc_fast.Gate(x=(1.0, 9.0)))
    assert (cloud.gate, cloud.estimator) == (ttc_fast.Gate(x=(1.0, 9.0)), ttc_fast.KthSmallest(10))
    assert cloud.method == ttc_fast.Alignment()


def test_a_long_mask_and_a_long_batch_are_cut() -> None:
    assert "mask=(True, ...)" in repr(ttc_fast.ScanTTC(0.0, 1e-3, 1081, mask=[True] * 1081))
    batch = SCAN.nearest(np.ones((1000, 3)) * np.arange(1.0, 1001.0)[:, None], 1.0)
    assert "(1000 scans, ttc=[" in repr(batch)
    assert ", ..., " in repr(batch)
    assert len(repr(batch)) < 1000
