"""The reference is a drop-in replacement: the same names, signatures and attributes."""

from __future__ import annotations

import importlib.metadata
import inspect
import math
import pickle
from typing import Any

import numpy as np
import pytest

import ttc_fast
from tests.support.common import CAR, every_module
from ttc_fast import reference

# Results are only ever received, so what counts is what they offer, not how they are made.
RESULTS = [
    "CloudTTC",
    "Counts",
    "CountsBatch",
    "KeypointTTC",
    "MinX",
    "Nearest",
    "NearestBatch",
    "RangeRateNearest",
    "NearestPoint",
    "NearestPointBatch",
    "RoadFit",
    "TrackedTTC",
]

# The instruction-set level of the kernels, and what serves both.
KERNELS_ONLY = {"SIMD_LEVEL", "__version__", "plot"}

# Attributes that are such results themselves.
NESTED = {"counts", "previous", "current"}

PATH = ["min", "nearest", "horizon"]
METHODS = ["min", "nearest", "per_beam", "from_message"]


def parameters(callable_: Any) -> list[tuple[str, Any, Any]]:
    """Name, kind and default of each parameter; `self` aside, of which only the kind differs."""
    every = inspect.signature(callable_).parameters.values()
    return [(each.name, each.kind, each.default) for each in every if each.name != "self"]


def public(object_: Any) -> set[str]:
    return {name for name in dir(object_) if not name.startswith("_")}


def example(module: Any, name: str) -> Any:
    """A result of each kind."""
    scan = module.ScanTTC(0.0, 0.1, 3)
    batch = scan.nearest(np.ones((2, 3)), 1.0)
    cloud = module.ttc_from_clouds(np.ones((12, 3)), np.ones((12, 3)), 0.1)
    points = module.SweptPath((-1.0, 1.0, -1.0, 1.0)).nearest(np.ones((2, 3, 2)), 1.0)
    return {
        "CloudTTC": cloud,
        "Counts": batch[0].counts,
        "CountsBatch": batch.counts,
        "KeypointTTC": module.ttc_from_keypoints(np.eye(3, 2) * 200, np.eye(3, 2) * 210, 0.1),
        "MinX": cloud.current,
        "Nearest": batch[0],
        "NearestBatch": batch,
        "RangeRateNearest": module.RangeRate(scan).update(np.ones(3), 0.0),
        "NearestPoint": points[0],
        "NearestPointBatch": points,
        "RoadFit": module.fit_road(np.ones((12, 3))),
        "TrackedTTC": module.CloudTracker().update(np.ones((12, 3)), 0.0),
    }[name]


def test_the_version_is_that_of_the_package() -> None:
    assert ttc_fast.__version__ == importlib.metadata.version("ttc-fast")


def test_the_same_names() -> None:
    assert set(ttc_fast.__all__) - KERNELS_ONLY == set(reference.__all__)
    for name in reference.__all__:
        assert hasattr(reference, name)


@pytest.mark.parametrize("name", sorted(set(reference.__all__) - set(RESULTS)))
def test_the_same_signature(name: str) -> None:
    kernel, specified = getattr(ttc_fast, name), getattr(reference, name)
    assert kernel is specified or parameters(kernel) == parameters(specified)


@pytest.mark.parametrize(
    ("name", "method"),
    [
        *(("ScanTTC", method) for method in METHODS),
        *(("SweptPath", method) for method in ("min", "nearest", "per_point")),
        *(("ScanSweptPath", method) for method in ("min", "nearest", "per_beam")),
    ],
)
def test_the_same_methods(name: str, method: str) -> None:
    kernel, specified = (getattr(getattr(module, name), method) for module in (ttc_fast, reference))
    assert parameters(kernel) == parameters(specified)


def test_swept_paths_offer_the_same() -> None:
    assert public(ttc_fast.SweptPath) == public(reference.SweptPath) == {*PATH, "per_point", "outline", "no_data"}
    assert public(ttc_fast.ScanSweptPath) == public(reference.ScanSweptPath) == {*PATH, "per_beam", "scan", "unseen"}


def test_a_scanner_offers_the_same() -> None:
    settings = {name for name, _, _ in parameters(ttc_fast.ScanTTC)}
    assert public(ttc_fast.ScanTTC) == public(reference.ScanTTC) == {*METHODS, "angles"} | settings


@pytest.mark.parametrize("method", ["update", "reset", "state", "restore"])
@pytest.mark.parametrize("name", ["RangeRate", "DistanceTracker", "CloudTracker", "ScaleTracker"])
def test_the_same_of_what_remembers(name: str, method: str) -> None:
    kernel, specified = getattr(ttc_fast, name), getattr(reference, name)
    assert parameters(getattr(kernel, method)) == parameters(getattr(specified, method))
    settings = {name for name, _, _ in parameters(kernel)}
    more = {"own_vehicle"} if name == "CloudTracker" else set()
    assert public(kernel) == public(specified) == {"update", "reset", "state", "restore"} | settings | more


@pytest.mark.parametrize("name", RESULTS)
def test_results_offer_the_same(name: str) -> None:
    kernel, specified = example(ttc_fast, name), example(reference, name)
    assert public(kernel) == public(specified)
    for attribute in public(kernel) - NESTED:
        assert type(getattr(kernel, attribute)) is type(getattr(specified, attribute)), attribute


@every_module
def test_defaults_are_the_documented_ones(module: Any) -> None:
    defaults = {name: default for name, _, default in parameters(module.ScanTTC)}
    assert defaults["range_min"] == 0.0
    assert defaults["range_max"] == math.inf
    assert defaults["limits_policy"] == "horizon"
    assert defaults["min_closing_speed"] == 0.01
    assert defaults["too_close"] == "hit"
    assert defaults["mount"] == (0.0, 0.0, 0.0)


@every_module
def test_an_index_past_the_end_of_a_batch(module: Any) -> None:
    batch = example(module, "NearestBatch")
    for index in (2, -3):
        with pytest.raises(IndexError):
            batch[index]


@every_module
def test_a_pickled_scanner_is_the_same_scanner(module: Any) -> None:
    chosen = {"range_min": 0.1, "range_max": 9.0, "limits": (0.2, 8.0), "limits_policy": "clamp", "no_data": 7.0}
    chosen |= {"mount": (0.2, 0.0, 0.1), "outline": CAR, "mask": [False, True, False]}
    chosen |= {"min_closing_speed": 0.5, "too_close": "ignore", "minimum": ttc_fast.KthSmallest(2)}
    scan = module.ScanTTC(-0.1, 0.1, 3, **chosen)
    copy = pickle.loads(pickle.dumps(scan))
    for ranges in ([3.0, 0.0, 2.0], [2.0, 5.0, 8.5], [np.nan, 1.0, -np.inf]):
        for speed in (4.0, 0.4):
            assert copy.min(np.array(ranges), speed) == scan.min(np.array(ranges), speed)


SETTINGS = [
    ttc_fast.Alignment(),
    ttc_fast.Alignment((0.1, 0.3), depth=0.4, window=0.6, range_noise=0.01),
    ttc_fast.Minimum(),
    ttc_fast.KthSmallest(3),
    ttc_fast.Quantile(0.25),
    ttc_fast.MeanOfLowest(4),
    ttc_fast.InterquartileFence(1.5),
    ttc_fast.Supported(3, 0.2),
    ttc_fast.Cluster(0.15, 10),
    ttc_fast.MedianRatio(),
    ttc_fast.TrimmedMeanRatio(0.1),
    ttc_fast.LeastSquares(),
    ttc_fast.Consensus(),
    ttc_fast.Consensus(tolerance=2.0, trials=50, seed=7),
    ttc_fast.Road(0.02, -0.01, -1.7),
    ttc_fast.MotionMixture(1.0, 2.0),
    ttc_fast.SlidingLine(0.4),
    ttc_fast.SlidingParabola(jerk=0.5),
    ttc_fast.TheilSen(0.4),
    ttc_fast.AlphaBeta(0.3),
    ttc_fast.KalmanCV(0.4),
    ttc_fast.KalmanCA(0.4, 1.0),
    ttc_fast.EstimatedNoise(0.4),
    ttc_fast.SweptPath(CAR),
    ttc_fast.SweptPath(CAR, horizon=2.0, no_data=0.0),
    ttc_fast.Gate(),
    ttc_fast.Gate(z=(-1.0, 2.0), intensity=(0.1, 0.9), axes=("y", "-x", "z"), curvature=0.01),
    ttc_fast.Gate.above_road(1.73, road=ttc_fast.Road(0.02, -0.01, -1.7), height=(0.2, 2.0)),
]


@pytest.mark.parametrize("settings", SETTINGS, ids=repr)
def test_pickled_settings_are_equal(settings: Any) -> None:
    copy = pickle.loads(pickle.dumps(settings))
    assert copy == settings
    assert repr(copy) == repr(settings)
    assert not any(copy == other for other in SETTINGS if other is not settings)


def test_threads_are_a_setting_of_an_object_or_an_argument_of_a_function() -> None:
    """They are never an argument of a method."""
    having = {
        name
        for name in ttc_fast.__all__
        if callable(value := getattr(ttc_fast, name)) and "threads" in str(getattr(value, "__text_signature__", ""))
    }
    assert having == {"ScanTTC", "robust_min_x", "ttc_from_keypoints"}
    for each in (getattr(ttc_fast, name) for name in ttc_fast.__all__):
        if isinstance(each, type):
            for method in public(each):
                assert "threads" not in str(getattr(getattr(each, method), "__text_signature__", ""))
