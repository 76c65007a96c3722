"""The outline along a planned path: the kernels against the NumPy reference, bit for bit."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import ttc_fast
from tests.support import strategies
from tests.support.common import CAR, examples
from tests.support.planned_paths import random_path
from ttc_fast import reference

many_examples = examples(150)


def facts(nearest: Any) -> dict[str, Any]:
    """All numbers of a result; NaN equals NaN."""
    names = [name for name in ("index", "beam", "x", "y", "angle", "range") if hasattr(nearest, name)]
    said = {name: getattr(nearest, name) for name in [*names, "ttc", "status", "clearance", "closing_speed"]}
    return {name: "nan" if value != value else value for name, value in said.items()}


def answers(path: Any, method: str, values: Any, speed: float, points: Any) -> Any:
    """Everything that is said, or that it is refused."""
    status = np.full(len(values), 77, np.uint8)
    try:
        nearest = path.nearest(values, speed, path=points)
        least = path.min(values, speed, path=points)
        return facts(nearest), least, getattr(path, method)(values, speed, path=points, status_out=status), status
    except ValueError as error:
        return type(error)


def assert_same(kernel: Any, specified: Any) -> None:
    if isinstance(kernel, type) or isinstance(specified, type):
        assert kernel is specified
        return
    assert kernel[:2] == specified[:2]
    np.testing.assert_array_equal(kernel[2], specified[2], strict=True)
    np.testing.assert_array_equal(kernel[3], specified[3])


@many_examples
@given(strategies.seeds, st.sampled_from([np.float32, np.float64]), st.sampled_from([5.0, 0.4, 60.0]))
def test_clouds(seed: int, dtype: Any, horizon: float) -> None:
    rng = np.random.default_rng(seed)
    points, speed = random_path(rng)
    cloud = rng.normal(0.0, rng.choice([1.0, 4.0]), (200, 2))
    cloud[:80] = points[rng.integers(0, len(points), 80)] + rng.normal(0.0, 0.3, (80, 2))
    cloud[-5:] = np.nan
    said = [
        answers(module.SweptPath(CAR, horizon=horizon), "per_point", cloud.astype(dtype), speed, points)
        for module in (ttc_fast, reference)
    ]
    assert_same(*said)


@many_examples
@given(strategies.seeds, strategies.cases())
def test_scans(seed: int, case: strategies.Case) -> None:
    """Of every scanner, with votes, masks, limits and readings of any kind."""
    if case.settings["outline"] is None:
        case.settings["outline"] = CAR
    points, speed = random_path(np.random.default_rng(seed))
    said = [
        answers(module.ScanSweptPath(module.ScanTTC(**case.settings)), "per_beam", case.ranges, speed, points)
        for module in (ttc_fast, reference)
    ]
    assert_same(*said)


def test_a_batch_follows_one_path_at_speeds_of_its_own() -> None:
    points = [[0.0, 0.0], [1.0, 0.1], [2.0, 0.5]]
    clouds, speeds = np.array([[[2.4, 0.6]], [[9.0, 4.0]]]), np.array([2.0, 4.0])
    for module in (ttc_fast, reference):
        path = module.SweptPath(CAR)
        each = [path.min(cloud, speed, path=points) for cloud, speed in zip(clouds, speeds, strict=True)]
        np.testing.assert_array_equal(path.min(clouds, speeds, path=points), each)
