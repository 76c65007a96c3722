"""Bad pictures give an exception of the right type that names the argument, never a time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.support.refusals import Targets, every_argument, refused, taken_or_refused
from ttc_fast import (
    Consensus,
    KthSmallest,
    MedianRatio,
    TrimmedMeanRatio,
    ttc_from_heights,
    ttc_from_keypoints,
    ttc_from_scale,
)

if TYPE_CHECKING:
    from collections.abc import Callable

POINTS = np.arange(40.0).reshape(20, 2)
CALLS: dict[str, tuple[str, Callable[[Any], Any]]] = {
    "previous": ("previous", lambda points: ttc_from_keypoints(points, POINTS, 0.1)),
    "current": ("current", lambda points: ttc_from_keypoints(POINTS, points, 0.1)),
}
every_array = pytest.mark.parametrize(("argument", "call"), CALLS.values(), ids=CALLS)


@every_array
@pytest.mark.parametrize(
    "shape", [(), (20,), (2, 20), (20, 3), (20, 1), (20, 0), (20, 2, 2), (1, 20, 2), (20, 2, 1), (1, 1, 1, 2)], ids=str
)
def test_positions_of_another_shape(argument: str, call: Callable[[Any], Any], shape: tuple[int, ...]) -> None:
    assert "(N, 2)" in refused(ValueError, argument, call, np.ones(shape))


@every_array
@pytest.mark.parametrize("dtype", [np.float16, np.int32, np.uint8, ">f4", ">f8", np.longdouble, object, bool, "U3"])
def test_positions_of_another_dtype(argument: str, call: Callable[[Any], Any], dtype: Any) -> None:
    said = refused(TypeError, argument, call, POINTS.astype(dtype))
    assert str(np.dtype(dtype)) in said
    assert "astype(numpy.float32)" in said


@every_array
@pytest.mark.parametrize("odd", [None, 5.0, [["1", "2"]] * 20, "text", object()], ids=lambda odd: type(odd).__name__)
def test_what_is_no_array(argument: str, call: Callable[[Any], Any], odd: Any) -> None:
    refused(TypeError, argument, call, odd)


@every_array
def test_masked_arrays(argument: str, call: Callable[[Any], Any]) -> None:
    refused(TypeError, argument, call, np.ma.masked_array(POINTS, POINTS > 5))


def test_arrays_that_do_not_go_together() -> None:
    assert "20, got 19" in refused(ValueError, "current", ttc_from_keypoints, POINTS, POINTS[1:], 0.1)
    said = refused(TypeError, "same dtype", ttc_from_keypoints, POINTS, POINTS.astype(np.float32), 0.1)
    assert "float64 and float32" in said


@pytest.mark.parametrize("dt", [0.0, -0.1, math.nan, math.inf, -math.inf])
def test_times_that_are_none(dt: float) -> None:
    refused(ValueError, "dt", ttc_from_keypoints, POINTS, POINTS, dt)
    refused(ValueError, "dt", ttc_from_scale, 1.1, dt)
    refused(ValueError, "dt", ttc_from_heights, 1.0, 1.1, dt)


@pytest.mark.parametrize("size", [0.0, -0.0, -5.0, math.nan, math.inf, -math.inf])
def test_sizes_that_are_none(size: float) -> None:
    refused(ValueError, "scale", ttc_from_scale, size, 0.1)
    refused(ValueError, "previous", ttc_from_heights, size, 10.0, 0.1)
    refused(ValueError, "current", ttc_from_heights, 10.0, size, 0.1)


@pytest.mark.parametrize("distance", [-1.0, math.nan, math.inf])
def test_distances_that_are_none(distance: float) -> None:
    refused(ValueError, "min_distance", ttc_from_keypoints, POINTS, POINTS, 0.1, min_distance=distance)


@pytest.mark.parametrize("threads", [0, -1, 100_000])
def test_threads_out_of_range(threads: int) -> None:
    refused(ValueError, "threads", ttc_from_keypoints, POINTS, POINTS, 0.1, threads=threads)


@pytest.mark.parametrize("estimator", ["median", KthSmallest(3), MedianRatio, 5], ids=repr)
def test_what_is_no_estimator(estimator: Any) -> None:
    refused(TypeError, "estimator", ttc_from_keypoints, POINTS, POINTS, 0.1, estimator=estimator)


@pytest.mark.parametrize(
    ("kind", "argument", "values"),
    [
        (TrimmedMeanRatio, "share", [-0.1, 0.5, 1.0, math.nan, math.inf]),
        (Consensus, "tolerance", [0.0, -1.0, math.nan, math.inf]),
        (Consensus, "trials", [0, -3, 1_000_001]),
        (Consensus, "seed", [-1]),
    ],
)
def test_settings_out_of_range(kind: Any, argument: str, values: list[Any]) -> None:
    for value in values:
        assert "must be" in refused(ValueError, argument, kind, **{argument: value})


TARGETS: Targets = {
    "ttc_from_scale": (ttc_from_scale, {"scale": 1.1, "dt": 0.1}),
    "ttc_from_heights": (ttc_from_heights, {"previous": 100.0, "current": 101.0, "dt": 0.1}),
    "ttc_from_keypoints": (
        ttc_from_keypoints,
        {
            "previous": POINTS,
            "current": POINTS,
            "dt": 0.1,
            "min_distance": 100.0,
            "estimator": MedianRatio(),
            "threads": 1,
        },
    ),
    "TrimmedMeanRatio": (TrimmedMeanRatio, {"share": 0.2}),
    "Consensus": (Consensus, {"tolerance": 5.0, "trials": 200, "seed": 0}),
}


@every_argument(TARGETS)
def test_any_object_is_taken_or_refused_by_name(call: Callable[..., Any], arguments: dict[str, Any], odd: str) -> None:
    taken_or_refused(call, arguments, odd)
