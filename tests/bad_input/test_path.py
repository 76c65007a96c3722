"""Bad points, outlines and motions give an exception of the right type that names the argument, never a time."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import ttc_fast
from tests.support.common import CAR, every_module
from tests.support.refusals import refused

POINTS = np.full((20, 2), 5.0)
METHODS = pytest.mark.parametrize("method", ["min", "nearest", "per_point"])


@every_module
@pytest.mark.parametrize(
    "outline",
    [
        (0.4, -0.1, -0.15, 0.15),
        (-0.1, 0.4, 0.15, -0.15),
        (0.0, 0.0, -1.0, 1.0),
        (-0.1, math.nan, -0.15, 0.15),
        (-math.inf, 0.4, -0.15, 0.15),
        (-100.0, 400.0, -150.0, 150.0),
    ],
)
def test_an_outline_that_is_none(module: Any, outline: Any) -> None:
    refused(ValueError, "outline", lambda: module.SweptPath(outline))


@every_module
@pytest.mark.parametrize("horizon", [0.0, -1.0, math.nan, math.inf, 1e7])
def test_a_horizon_that_is_none(module: Any, horizon: float) -> None:
    scan = module.ScanTTC(-0.5, 0.5, 3, outline=CAR)
    refused(ValueError, "horizon", lambda: module.SweptPath(CAR, horizon=horizon))
    refused(ValueError, "horizon", lambda: module.ScanSweptPath(scan, horizon=horizon))


@every_module
def test_settings_that_make_no_sense(module: Any) -> None:
    refused(ValueError, "no_data", lambda: module.SweptPath(CAR, no_data=-1.0))
    refused(ValueError, "no_data", lambda: module.SweptPath(CAR, no_data=math.nan))
    refused(ValueError, "scan must have an outline", lambda: module.ScanSweptPath(module.ScanTTC(-0.5, 0.5, 3)))


def test_a_scanner_that_is_none() -> None:
    nothing: Any = None
    refused(TypeError, "scan", lambda: ttc_fast.ScanSweptPath(nothing))


@every_module
@METHODS
@pytest.mark.parametrize("shape", [(), (3,), (20, 1), (20, 0), (2, 2, 1), (2, 2, 2, 3), (2, 100)], ids=str)
def test_points_of_another_shape(module: Any, method: str, shape: tuple[int, ...]) -> None:
    refused(ValueError, "points", lambda: getattr(module.SweptPath(CAR), method)(np.ones(shape), 1.0))


@every_module
@METHODS
@pytest.mark.parametrize("dtype", [np.float16, np.int16, np.int64, ">f4", ">f8", np.longdouble, object, bool, "U3"])
def test_points_of_another_dtype(module: Any, method: str, dtype: Any) -> None:
    path = module.SweptPath(CAR)
    refused(TypeError, "points", lambda: getattr(path, method)(np.ones((20, 2)).astype(dtype), 1.0))
    refused(TypeError, "points", lambda: getattr(path, method)((np.ones(20).astype(dtype),) * 2, 1.0))


@every_module
@METHODS
def test_points_that_are_none(module: Any, method: str) -> None:
    call = getattr(module.SweptPath(CAR), method)
    column, other = np.ones(4), np.ones(5)
    for kind, points in (
        (TypeError, None),
        (TypeError, [["1", "2"]]),
        (ValueError, ()),
        (ValueError, (column,)),
        (ValueError, (column,) * 5),
        (ValueError, (column, other)),
        (ValueError, (np.ones((2, 2, 2)),) * 2),
        (TypeError, (column, np.ones(4, np.float32))),
        (ValueError, np.zeros(4, [("x", "f4"), ("z", "f4")])),
        (ValueError, np.zeros(4, [("a", "f4")])),
    ):
        refused(kind, "points", call, points, 1.0)


@every_module
@METHODS
@pytest.mark.parametrize("argument", ["speed", "yaw_rate", "lateral_speed"])
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e9, -4e8, 1e300])
def test_motions_that_are_none(module: Any, method: str, argument: str, value: float) -> None:
    motion = {"speed": 1.0} | {argument: value}
    refused(ValueError, argument, lambda: getattr(module.SweptPath(CAR), method)(POINTS, **motion))
    scan = module.ScanSweptPath(module.ScanTTC(-0.5, 0.5, 3, outline=CAR))
    beams = {"per_point": "per_beam"}.get(method, method)
    refused(ValueError, argument, lambda: getattr(scan, beams)(np.ones(3), **motion))


@every_module
@METHODS
def test_motions_of_another_type_or_shape(module: Any, method: str) -> None:
    call = getattr(module.SweptPath(CAR), method)
    refused(TypeError, "speed", lambda: call(POINTS, None))
    refused(TypeError, "yaw_rate", lambda: call(POINTS, 1.0, "fast"))
    batch = np.ones((3, 4, 2))
    refused(ValueError, "speed", lambda: call(batch, np.ones(4)))
    refused(ValueError, "yaw_rate", lambda: call(batch, 1.0, np.ones((3, 1))))
    refused(ValueError, "speed", lambda: call(batch, np.array([1.0, np.nan, 1.0])))


def test_the_row_of_a_bad_motion_is_told() -> None:
    path = ttc_fast.SweptPath(CAR)
    for method in (path.min, path.nearest, path.per_point):
        said = refused(ValueError, "speed", method, np.ones((3, 4, 2)), np.array([1, np.nan, 1]))
        assert "row 1" in said


@every_module
def test_outputs_that_cannot_be_written(module: Any) -> None:
    path = module.SweptPath(CAR)
    frozen = np.ones(20)
    frozen.flags.writeable = False
    for kind, out in (
        (ValueError, np.ones(19)),
        (ValueError, np.ones((20, 2))),
        (TypeError, np.ones(20, np.float32)),
        (TypeError, [0.0] * 20),
        (ValueError, frozen),
    ):
        refused(kind, "out", path.per_point, POINTS, 1.0, out=out)
    for kind, status in ((TypeError, np.ones(20)), (ValueError, np.ones(19, np.uint8))):
        refused(kind, "status_out", path.per_point, POINTS, 1.0, status_out=status)


def test_outputs_that_overlap() -> None:
    path, points = ttc_fast.SweptPath(CAR), POINTS.copy()
    before = points.copy()
    refused(ValueError, "out", lambda: path.per_point(points, 1.0, out=points[:, 0]))
    refused(ValueError, "out", lambda: path.per_point((points[:, 0], points[:, 1]), 1.0, out=points[:, 1]))
    refused(ValueError, "status_out", lambda: path.per_point(points, 1.0, status_out=points.view(np.uint8)[:, 3]))
    refused(
        ValueError,
        "out",
        lambda: path.per_point(points, 1.0, out=np.lib.stride_tricks.as_strided(np.ones(1), (20,), (0,))),
    )
    np.testing.assert_array_equal(points, before)


@METHODS
def test_masked_arrays(method: str) -> None:
    masked = np.ma.masked_array(POINTS, mask=False)
    refused(TypeError, "points", lambda: getattr(ttc_fast.SweptPath(CAR), method)(masked, 1.0))


class Resizes:
    """A number that, when it is converted, takes the memory of an array away."""

    def __init__(self, victim: Any) -> None:
        self.victim = victim

    def __float__(self) -> float:
        self.victim.resize((1, 2), refcheck=False)
        return 5.0


@METHODS
def test_points_are_looked_at_after_all_numbers_are_converted(method: str) -> None:
    points = np.full((1 << 18, 2), 10.0)
    speed: Any = Resizes(points)
    getattr(ttc_fast.SweptPath(CAR), method)(points, speed)
    assert len(points) == 1
