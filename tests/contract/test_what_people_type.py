"""Numbers, lists, tuples and tensors where an array is taken, and the lines of a course as students type them."""

import json
import pickle
import subprocess
import sys
from array import array
from typing import Any

import numpy as np
import pytest

import ttc_fast
from ttc_fast import reference
from ttc_fast.brake import Source

SCAN = ttc_fast.ScanTTC(0.0, 0.1, 3)
every_module = pytest.mark.parametrize("module", [ttc_fast, reference], ids=["kernels", "reference"])


@every_module
@pytest.mark.parametrize("rate", [-5.0, -5, np.float32(-5), np.array(-5.0)], ids=repr)
@pytest.mark.parametrize("distance", [10.0, 10, np.float64(10), np.array(10.0, np.float32)], ids=repr)
def test_two_numbers_give_a_float(module: Any, distance: Any, rate: Any) -> None:
    ttc = module.ittc(distance, range_rate=rate)
    assert type(ttc) is float
    assert ttc == 2.0
    assert module.ittc(distance, closing_speed=rate) == np.inf


@every_module
def test_outputs_are_for_arrays(module: Any) -> None:
    with pytest.raises(TypeError, match="out and status_out are for arrays"):
        module.ittc(10.0, range_rate=-5.0, out=np.empty(1))


@every_module
def test_one_range_with_the_rate_of_each_beam(module: Any) -> None:
    angles = np.array([0.0, np.pi / 3, np.pi])
    ttc = module.ittc(10.0, range_rate=-5.0 * np.cos(angles))
    np.testing.assert_allclose(ttc, [2.0, 4.0, np.inf])
    assert module.ittc(10.0, range_rate=np.array([-5.0, -2.0], np.float32)).dtype == np.float32


@every_module
def test_the_lines_of_the_course(module: Any) -> None:
    """A driver gives float32, and cos of angles is float64."""
    ranges, angles = np.full(5, 10.0, np.float32), np.linspace(-1.0, 1.0, 5)
    rates = -5.0 * np.cos(angles)
    ttc = module.ittc(ranges, range_rate=rates)
    assert ttc.dtype == np.float64
    np.testing.assert_array_equal(ttc, 10.0 / -rates)
    batch = module.ittc(np.stack([ranges, ranges / 2]), range_rate=rates)
    np.testing.assert_array_equal(batch, [ttc, ttc / 2])


@every_module
@pytest.mark.parametrize("make", [list, tuple, lambda values: array("d", values)], ids=["list", "tuple", "array"])
def test_small_inputs_without_numpy(module: Any, make: Any) -> None:
    np.testing.assert_array_equal(module.ittc(make([10, 5]), range_rate=make([-5, -1])), [2.0, 5.0])
    scan = module.ScanTTC(-1.0, 0.5, 5)
    assert scan.min(make([10, 10, 10, 10, 10]), 5) == 2.0
    np.testing.assert_array_equal(module.ttc_constant_velocity(make([10, 5]), closing_speed=5), [2.0, 1.0])


@every_module
def test_points_and_keypoints_as_lists(module: Any) -> None:
    path = module.SweptPath((-0.1, 0.4, -0.15, 0.15))
    assert path.nearest([[5.4, 0.1], [9.0, 0.0]], 5.0).ttc == 1.0
    assert path.nearest(([5.4, 9.0], [0.1, 0.0]), 5.0).ttc == 1.0
    assert module.robust_min_x([[5, 0, 0], [6, 0, 0]], estimator=module.Minimum()).x == 5.0
    square = [[0.0, 0.0], [0.0, 200.0], [200.0, 0.0], [200.0, 200.0]]
    larger = [[1.1 * x, 1.1 * y] for x, y in square]
    found = module.ttc_from_keypoints(square, larger, 0.1, estimator=module.MedianRatio())
    assert found.ttc == pytest.approx(1.0)


@every_module
def test_what_no_array_can_be_made_of_is_refused_by_name(module: Any) -> None:
    scan = module.ScanTTC(-1.0, 0.5, 2)
    for wrong, message in [
        (None, "ranges must be a numpy array"),
        ([[1.0], [1.0, 2.0]], "ranges of type list cannot be read as a numpy array"),
        (["far", "near"], "ranges must have dtype float32 or float64"),
        ([None, 1.0], "ranges must have dtype float32 or float64"),
        ([True, False], "ranges must have dtype float32 or float64"),
        (np.array([1500, 1600]), "ranges must have dtype float32 or float64"),
        (array("i", [1500, 1600]), "ranges must have dtype float32 or float64"),
    ]:
        with pytest.raises(TypeError, match=message):
            scan.min(wrong, 5.0)


@pytest.mark.parametrize("module", ["compat", "configuration", "logs", "reference", "replay", "ros", "sensors"])
def test_modules_come_with_the_package(module: str) -> None:
    script = f"import ttc_fast; print(ttc_fast.{module}.__name__, {module!r} in dir(ttc_fast))"
    said = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    assert said.split() == [f"ttc_fast.{module}", "True"]


def test_millimetres_are_suspected_of_distances_only() -> None:
    ranges, whole = np.full(2, 10.0), np.array([5, 5])
    with pytest.raises(TypeError, match="integers are often millimetres"):
        ttc_fast.ittc(whole, closing_speed=ranges)
    with pytest.raises(TypeError, match=r"convert with closing_speed\.astype"):
        ttc_fast.ittc(ranges, closing_speed=whole)


def test_a_rate_without_its_name_is_explained() -> None:
    with pytest.raises(TypeError, match="takes the rate by name, because its sign depends on it"):
        ttc_fast.ittc(np.full(2, 10.0), -5.0)  # type: ignore[call-overload]


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (SCAN, r"got a ScanTTC, which goes by its name: BrakeController\(scan=\.\.\.\)"),
        (np.ones(3), r"ranges go to update\(now, ranges=\.\.\.\), and their scanner .*scan=ScanTTC"),
        (ttc_fast.IttcThreshold(1.0), r"such as \[IttcThreshold\(threshold=1\.0\)\]"),
    ],
)
def test_a_first_argument_that_is_no_criteria_says_where_it_goes(given: Any, said: str) -> None:
    with pytest.raises(TypeError, match=said):
        ttc_fast.BrakeController(given)


def test_a_batch_of_batches_says_how_it_becomes_one() -> None:
    with pytest.raises(ValueError, match=r"got shape \[2, 2, 3\]; ranges\.reshape\(-1, 3\) is a batch"):
        SCAN.min(np.ones((2, 2, 3)), 1.0)


def test_enumerations_print_their_names() -> None:
    kinds = (ttc_fast.Status, ttc_fast.Detection, ttc_fast.RoadStatus, ttc_fast.Command, ttc_fast.Reason, Source)
    for each in (member for kind in kinds for member in kind):
        assert str(each) == f"{each}" == each.name
        assert f"{each:d}" == str(int(each)) == json.dumps(each)
        assert pickle.loads(pickle.dumps(each)) is each
