"""Bad clouds, gates and estimators give an exception of the right type that names the argument, never a distance."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.support.common import both_dtypes
from tests.support.refusals import ODD, Targets, every_argument, message, refused, taken_or_refused
from ttc_fast import (
    Cluster,
    Detection,
    Gate,
    InterquartileFence,
    KthSmallest,
    MeanOfLowest,
    Minimum,
    NeighbourSupport,
    Quantile,
    Road,
    Supported,
    robust_min_x,
    ttc_from_clouds,
    ttc_from_distances,
)

if TYPE_CHECKING:
    from collections.abc import Callable

POINTS = np.full((20, 3), 5.0)
COLUMN = np.full(20, 5.0)

CALLS: dict[str, tuple[str, Callable[[Any], Any]]] = {
    "robust_min_x": ("points", robust_min_x),
    "ttc_from_clouds, previous": ("previous", lambda points: ttc_from_clouds(points, POINTS, 0.1)),
    "ttc_from_clouds, current": ("current", lambda points: ttc_from_clouds(POINTS, points, 0.1)),
}
every_call = pytest.mark.parametrize(("argument", "call"), CALLS.values(), ids=CALLS)


# --- points --------------------------------------------------------------------------------------------------------


@every_call
@pytest.mark.parametrize(
    "shape", [(), (3,), (12,), (20, 2), (20, 1), (20, 0), (3, 0), (4, 5, 2), (2, 2, 2, 3), (1, 1, 1, 1, 3)], ids=str
)
def test_points_of_another_shape(argument: str, call: Callable[[Any], Any], shape: tuple[int, ...]) -> None:
    assert "(N, 3)" in refused(ValueError, argument, call, np.ones(shape))


WRONG_DTYPES: dict[str, tuple[Any, str]] = {
    "float16": (np.float16, "astype"),
    "millimetres, int16": (np.int16, "0.001"),
    "millimetres, int64": (np.int64, "0.001"),
    "big-endian float32": (">f4", "'=f4'"),
    "big-endian float64": (">f8", "'=f8'"),
    "longdouble": (np.longdouble, "astype"),
    "object": (object, "astype"),
    "bool": (bool, "float32"),
    "complex": (np.complex64, "float32"),
    "text": ("U3", "float32"),
    "durations": ("m8[s]", "float32"),
}


@every_call
@pytest.mark.parametrize(("dtype", "fix"), WRONG_DTYPES.values(), ids=WRONG_DTYPES)
def test_points_of_another_dtype_are_told_the_fix(
    argument: str, call: Callable[[Any], Any], dtype: Any, fix: str
) -> None:
    for points in (np.ones((20, 3)).astype(dtype), np.ones((4, 5, 3)).astype(dtype), (np.ones(20).astype(dtype),) * 3):
        said = refused(TypeError, argument, call, points)
        assert str(np.dtype(dtype)) in said
        assert fix in said


@every_call
@pytest.mark.parametrize("dtype", ["f2", "i4", ">f4", "O", "?"])
@pytest.mark.parametrize("place", range(3))
def test_records_with_a_coordinate_of_another_dtype(
    argument: str, call: Callable[[Any], Any], dtype: str, place: int
) -> None:
    formats = ["f4", "f4", "f4"]
    formats[place] = dtype
    records = np.ones(20, list(zip("xyz", formats, strict=True)))
    assert str(np.dtype(dtype)) in refused(TypeError, argument, call, records)


@pytest.mark.parametrize("place", range(3))
def test_coordinates_of_two_dtypes(place: int) -> None:
    """Each would do; together they do not, and no byte order is to blame."""
    columns = [COLUMN] * 3
    columns[place] = COLUMN.astype(np.float32)
    for points in (
        tuple(columns),
        np.ones(20, [(name, column.dtype) for name, column in zip("xyz", columns, strict=True)]),
    ):
        said = refused(TypeError, "points", robust_min_x, points)
        assert "byte order" not in said
        assert "same dtype" in said


def test_clouds_of_two_dtypes() -> None:
    said = refused(TypeError, "previous", ttc_from_clouds, POINTS, POINTS.astype(np.float32), 0.1)
    assert "current" in said
    assert "same dtype" in said


@every_call
def test_points_that_are_no_array(argument: str, call: Callable[[Any], Any]) -> None:
    everything: list[Any] = [[["1", "2", "3"]], None, "abc", b"abc" * 8, 3.0, {1.0}, object(), np.ndarray, POINTS.data]
    for points in everything:
        assert "numpy" in refused(TypeError, argument, call, points)
    for column in (["5"] * 20, None, 5.0, "abc", COLUMN.data):
        assert "numpy" in refused(TypeError, argument, call, (COLUMN, COLUMN, column))


@every_call
@pytest.mark.parametrize("count", [0, 1, 2, 5, 6])
def test_tuples_of_another_length(argument: str, call: Callable[[Any], Any], count: int) -> None:
    assert "(x, y, z)" in refused(ValueError, argument, call, (COLUMN,) * count)


@every_call
@pytest.mark.parametrize("place", range(4))
@pytest.mark.parametrize("shape", [(19,), (21,), (0,), (20, 1), (1, 20), (4, 5)], ids=str)
def test_columns_of_unequal_shapes(
    argument: str, call: Callable[[Any], Any], place: int, shape: tuple[int, ...]
) -> None:
    """Also where the number of points is equal: which point is which would be a guess."""
    columns = [COLUMN] * 4
    columns[place] = np.ones(shape)
    assert "shape" in refused(ValueError, argument, call, tuple(columns))


@every_call
@pytest.mark.parametrize("shape", [(), (2, 2, 5), (1, 1, 1, 20)], ids=str)
def test_columns_of_another_rank(argument: str, call: Callable[[Any], Any], shape: tuple[int, ...]) -> None:
    assert "shape" in refused(ValueError, argument, call, (np.ones(shape),) * 3)


@every_call
@pytest.mark.parametrize("names", ["xy", "xz", "yz", "xyw", "XYZ", "a", "xyi"])
def test_records_without_a_coordinate(argument: str, call: Callable[[Any], Any], names: str) -> None:
    said = refused(ValueError, argument, call, np.ones(20, [(name, "f4") for name in names]))
    assert "x, y and z" in said
    assert f'"{names[0]}"' in said.replace("'", '"')


def test_a_coordinate_with_several_numbers() -> None:
    for name in "xyz":
        points = np.ones(20, [(each, "f4", (2,) if each == name else ()) for each in "xyz"])
        refused(ValueError, "points", robust_min_x, points)


@every_call
def test_masked_arrays_are_not_read_through_their_mask(argument: str, call: Callable[[Any], Any]) -> None:
    """Their data under the mask are exactly what is not to be read."""
    mask = np.arange(20) < 10
    masked = np.ma.masked_array(COLUMN, mask)
    rows = np.ma.masked_array(POINTS, np.column_stack([mask] * 3))
    records = np.ma.masked_array(np.ones(20, "f4,f4,f4"), mask)
    for points in (rows, records, (masked, COLUMN, COLUMN), (COLUMN, COLUMN, COLUMN, masked)):
        assert "filled" in refused(TypeError, argument, call, points)


@pytest.mark.parametrize("dtype", ["i8", "u8", "f2", ">f4", ">u2", ">i4", "O", "?", "U1"])
def test_an_intensity_of_another_dtype(dtype: str) -> None:
    records = np.ones(20, [("x", "f4"), ("y", "f4"), ("z", "f4"), ("intensity", dtype)])
    for points in ((COLUMN, COLUMN, COLUMN, np.ones(20).astype(dtype)), records):
        said = refused(TypeError, "intensity", robust_min_x, points)
        assert "an integer dtype of up to 32 bits, float32 or float64" in said


def test_more_points_than_can_be_numbered() -> None:
    """No memory is behind these but that of one point."""
    for shape in ((2**32, 3), (2**20, 2**12, 3), (2**40, 4)):
        refused(ValueError, "points", robust_min_x, np.broadcast_to(np.float32(5.0), shape))
    refused(ValueError, "points", robust_min_x, (np.broadcast_to(np.float32(5.0), 2**32),) * 3)


@both_dtypes
def test_a_million_nans(dtype: Any) -> None:
    for points in (np.full((1_000_000, 3), np.nan, dtype), np.zeros((1_000_000, 3), dtype)):
        assert robust_min_x(points).detection is Detection.NO_DATA


# --- gates ---------------------------------------------------------------------------------------------------------

INTERVALS = ["x", "y", "z", "intensity", "height"]


def gate_with(**settings: Any) -> Gate:
    above: dict[str, Any] = {"road": Road(0.0, 0.0, -1.7), "height": (0.2, 2.0)}
    return Gate(**(above | settings))


@pytest.mark.parametrize("argument", INTERVALS)
@pytest.mark.parametrize(
    "bounds",
    [(20.0, 2.0), (1.0, 0.999), (math.nan, 1.0), (0.0, math.nan), (math.inf, -math.inf), (math.inf, 0)],
    ids=str,
)
def test_bounds_swapped_or_nan(argument: str, bounds: tuple[float, float]) -> None:
    assert "low <= high" in refused(ValueError, argument, gate_with, **{argument: bounds})


@pytest.mark.parametrize("argument", INTERVALS)
def test_bounds_may_be_lists(argument: str) -> None:
    """As parameter files give them."""
    assert getattr(gate_with(**{argument: [1.0, 2.0]}), argument) == (1.0, 2.0)


def test_a_cloud_that_lies_on_its_side() -> None:
    """(4, N) is not four points with N numbers each."""
    for points in (np.ones((4, 1000)), np.ones((3, 65), np.float32), np.ones((4, 32, 1024))):
        assert "transposed" in refused(ValueError, "points", robust_min_x, points)
    assert robust_min_x(np.ones((4, 64))).candidates == 4


@pytest.mark.parametrize("argument", INTERVALS)
@pytest.mark.parametrize("bounds", [3.0, "ab", (), (1.0,), (1.0, 2.0, 3.0), ("a", "b"), (None, 1.0), ...])
def test_bounds_that_are_none(argument: str, bounds: Any) -> None:
    with pytest.raises((TypeError, ValueError)) as caught:
        gate_with(**{argument: bounds})
    assert argument in message(caught.value)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_curvature_that_is_not_finite(value: float) -> None:
    """As speed 0 makes it."""
    refused(ValueError, "curvature", Gate, curvature=value)


@pytest.mark.parametrize("value", ["0", None, 1j, [0.0], (0.0,)], ids=repr)
def test_a_curvature_that_is_no_number(value: Any) -> None:
    refused(TypeError, "curvature", Gate, curvature=value)


@pytest.mark.parametrize(
    "axes",
    [("x", "x", "z"), ("x", "-x", "z"), ("a", "y", "z"), ("X", "y", "z"), ("--x", "y", "z"), ("", "y", "z")],
    ids=str,
)
def test_axes_that_are_none(axes: tuple[str, str, str]) -> None:
    refused(ValueError, "axes", Gate, axes=axes)


@pytest.mark.parametrize("axes", [("x", "y"), ("x", "y", "z", "x"), (), 3, (1, 2, 3), (None, "y", "z")], ids=str)
def test_axes_of_another_length_or_type(axes: Any) -> None:
    with pytest.raises((TypeError, ValueError)) as caught:
        Gate(axes=axes)
    assert "axes" in message(caught.value)


def test_a_road_without_a_height() -> None:
    for settings in ({"road": Road(0.0, 0.0, -1.7)}, {"height": (0.2, 2.0)}):
        assert "height" in refused(ValueError, "road", Gate, **settings)
    refused(TypeError, "road", Gate, road=(0.0, 0.0, -1.7), height=(0.2, 2.0))


@pytest.mark.parametrize("place", ["slope_x", "slope_y", "offset"])
def test_roads_that_are_nowhere(place: str) -> None:
    plane = {"slope_x": 0.0, "slope_y": 0.0, "offset": -1.7}
    for value in (math.nan, math.inf, -math.inf):
        refused(ValueError, place, Road, **(plane | {place: value}))
    for other in ("0", None, [0.0]):
        refused(TypeError, place, Road, **(plane | {place: other}))


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        *[("sensor_height", value) for value in (math.nan, math.inf, -math.inf)],
        *[("clearance", value) for value in (math.nan, math.inf)],
        *[("headroom", value) for value in (math.nan, -math.inf)],
    ],
)
def test_heights_that_are_none(argument: str, value: float) -> None:
    """A sensor infinitely high would be a gate that lets nothing through: always clear."""
    refused(ValueError, argument, Gate.above_road, **{"sensor_height": 1.7, argument: value})


def test_a_band_above_the_road_may_be_open() -> None:
    assert Gate.above_road(1.5, clearance=0.25, headroom=math.inf).z == (-1.25, math.inf)
    assert Gate.above_road(1.5, clearance=-math.inf, headroom=2.0).z == (-math.inf, 0.5)


def test_no_room_above_the_road() -> None:
    said = refused(ValueError, "clearance", Gate.above_road, 1.7, clearance=2.0, headroom=1.0)
    assert "headroom" in said


def test_above_road_sets_z() -> None:
    refused(TypeError, "z", Gate.above_road, 1.7, z=(0.0, 1.0))
    refused(ValueError, "x", Gate.above_road, 1.7, x=(3.0, 1.0))
    refused(TypeError, "colour", Gate.above_road, 1.7, colour=(0.0, 1.0))
    refused(TypeError, "colour", Gate, colour=(0.0, 1.0))


def test_a_gate_on_an_intensity_that_is_not_there() -> None:
    gate = Gate(intensity=(0.0, 1.0))
    for points in (POINTS, (COLUMN,) * 3, np.ones(20, [("x", "f4"), ("y", "f4"), ("z", "f4")]), np.empty((0, 3))):
        assert "intensity" in refused(ValueError, "gate", robust_min_x, points, gate=gate)
        assert "intensity" in refused(ValueError, "gate", ttc_from_clouds, points, points, 0.1, gate=gate)


def test_a_height_is_no_bounds_of_a_gate() -> None:
    with pytest.raises(TypeError, match=r"x must be two numbers, \(low, high\), m, got float: write Gate.*above_road"):
        Gate(1.73, 2.0)  # type: ignore[arg-type]


@pytest.mark.parametrize("gate", [3, (0.0, 20.0), {"x": (0, 20)}, "Gate()", Gate, Minimum()], ids=repr)
def test_what_is_no_gate(gate: Any) -> None:
    refused(TypeError, "gate", robust_min_x, POINTS, gate=gate)
    refused(TypeError, "gate", ttc_from_clouds, POINTS, POINTS, 0.1, gate=gate)


# --- estimators ----------------------------------------------------------------------------------------------------

SETTINGS: dict[Any, dict[str, Any]] = {
    KthSmallest: {"k": 3},
    Quantile: {"q": 0.5},
    MeanOfLowest: {"k": 3},
    InterquartileFence: {"factor": 1.5},
    Supported: {"points": 3, "gap": 0.2},
    Cluster: {"tolerance": 0.2, "min_points": 3},
}


@pytest.mark.parametrize(("estimator", "argument"), [(KthSmallest, "k"), (MeanOfLowest, "k")])
@pytest.mark.parametrize("value", [0, -1, -(2**63)])
def test_k_below_one(estimator: Any, argument: str, value: int) -> None:
    assert "at least 1" in refused(ValueError, argument, estimator, value)


@pytest.mark.parametrize("q", [-1e-9, 1.0000001, -0.5, 50.0, math.nan, math.inf, -math.inf])
def test_quantiles_outside_the_unit_interval(q: float) -> None:
    """A percentage is not a quantile."""
    assert "[0, 1]" in refused(ValueError, "q", Quantile, q)


@pytest.mark.parametrize("factor", [-1.5, -1e-300, math.nan, math.inf])
def test_fences_on_the_wrong_side(factor: float) -> None:
    refused(ValueError, "factor", InterquartileFence, factor)


@pytest.mark.parametrize("gap", [-0.1, math.nan, math.inf, -math.inf])
def test_gaps_that_are_none(gap: float) -> None:
    refused(ValueError, "gap", Supported, 3, gap)


@pytest.mark.parametrize("tolerance", [0.0, -0.1, math.nan, math.inf])
def test_tolerances_that_link_nothing_or_everything(tolerance: float) -> None:
    refused(ValueError, "tolerance", Cluster, tolerance, 3)


@pytest.mark.parametrize("count", [0, -1])
def test_groups_of_nothing(count: int) -> None:
    refused(ValueError, "points", Supported, count, 0.1)
    refused(ValueError, "min_points", Cluster, 0.1, count)


@pytest.mark.parametrize("value", ["1", None, 1j, [1.0], b"1"], ids=repr)
def test_settings_that_are_no_number(value: Any) -> None:
    for estimator, settings in SETTINGS.items():
        for argument in settings:
            refused(TypeError, argument, estimator, **{**settings, argument: value})


@pytest.mark.parametrize(("estimator", "argument"), [(KthSmallest, "k"), (MeanOfLowest, "k"), (Supported, "points")])
def test_counts_that_are_no_integer(estimator: Any, argument: str) -> None:
    refused(TypeError, argument, estimator, **{**SETTINGS[estimator], argument: 2.0})


@pytest.mark.parametrize("estimator", [3, "median", None.__class__, KthSmallest, NeighbourSupport(), Gate(), np.median])
def test_what_is_no_estimator(estimator: Any) -> None:
    """The settings of a scan's vote among them."""
    assert "KthSmallest(10)" in refused(TypeError, "estimator", robust_min_x, POINTS, estimator=estimator)
    refused(TypeError, "estimator", ttc_from_clouds, POINTS, POINTS, 0.1, estimator=estimator)


@pytest.mark.parametrize("many", [21, 2**31, 2**32, 2**63 - 1])
def test_more_points_wanted_than_there_are(many: int) -> None:
    """Too few, however large the number: no overflow on the way."""
    for estimator in (KthSmallest(many), MeanOfLowest(many), Supported(many, 1e300), Cluster(1e300, many)):
        found = robust_min_x(POINTS, gate=Gate(y=(-9.0, 9.0)), estimator=estimator)
        assert (found.detection, found.nearest_x, found.candidates) == (Detection.TOO_FEW, 5.0, 20)
        assert math.isnan(found.x)


# --- time and distance ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dt", [0.0, -0.0, -0.1, math.nan, math.inf, -math.inf])
def test_no_time_between_them(dt: float) -> None:
    assert "stamps" in refused(ValueError, "dt", ttc_from_clouds, POINTS, POINTS, dt)
    assert "stamps" in refused(ValueError, "dt", ttc_from_distances, 10.0, 9.0, dt)


@pytest.mark.parametrize(
    "dt", ["0.1", b"0.1", None, [0.1], (0.1,), 1j, np.ones(2), np.timedelta64(100, "ms")], ids=repr
)
def test_times_that_are_no_number(dt: Any) -> None:
    refused(TypeError, "dt", ttc_from_clouds, POINTS, POINTS, dt)
    refused(TypeError, "dt", ttc_from_distances, 10.0, 9.0, dt)


def test_a_missing_time() -> None:
    """There is no default rate."""
    refused(TypeError, "dt", ttc_from_clouds, POINTS, POINTS)
    refused(TypeError, "dt", ttc_from_distances, 10.0, 9.0)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_distances_that_are_not_finite(value: float) -> None:
    """The x of an empty cloud is inf or NaN: that is no distance, and ``ttc_from_clouds`` knows what to do with it."""
    refused(ValueError, "previous", ttc_from_distances, value, 9.0, 0.1)
    refused(ValueError, "current", ttc_from_distances, 10.0, value, 0.1)
    refused(ValueError, "front_offset", ttc_from_clouds, POINTS, POINTS, 0.1, front_offset=value)


@pytest.mark.parametrize("value", ["9", None, [9.0], 1j], ids=repr)
def test_distances_that_are_no_number(value: Any) -> None:
    refused(TypeError, "previous", ttc_from_distances, value, 9.0, 0.1)
    refused(TypeError, "current", ttc_from_distances, 10.0, value, 0.1)
    refused(TypeError, "front_offset", ttc_from_clouds, POINTS, POINTS, 0.1, front_offset=value)


def test_settings_are_given_by_name() -> None:
    for call in (lambda: robust_min_x(POINTS, Gate()), lambda: ttc_from_clouds(POINTS, POINTS, 0.1, Gate())):  # type: ignore[call-arg]
        with pytest.raises(TypeError, match="positional"):
            call()


# --- anything ------------------------------------------------------------------------------------------------------

TARGETS: Targets = {
    "robust_min_x": (robust_min_x, {"points": POINTS, "gate": Gate(), "estimator": Minimum()}),
    "ttc_from_clouds": (
        ttc_from_clouds,
        {"previous": POINTS, "current": POINTS, "dt": 0.1, "gate": Gate(), "estimator": Minimum(), "front_offset": 0.0},
    ),
    "ttc_from_distances": (ttc_from_distances, {"previous": 10.0, "current": 9.0, "dt": 0.1}),
    "Gate": (
        Gate,
        {
            "x": (0.0, 9.0),
            "y": (-1.0, 1.0),
            "z": None,
            "intensity": None,
            "axes": ("x", "y", "z"),
            "curvature": 0.0,
            "road": Road(0.0, 0.0, 0.0),
            "height": (0.0, 1.0),
        },
    ),
    "Gate.above_road": (Gate.above_road, {"sensor_height": 1.7, "clearance": 0.2, "headroom": 2.0, "x": (0.0, 9.0)}),
    "Gate.above_road, front": (Gate.above_road, {"sensor_height": 1.7, "front": 2.5}),
    "Road": (Road, {"slope_x": 0.0, "slope_y": 0.0, "offset": 0.0}),
    **{estimator.__name__: (estimator, settings) for estimator, settings in SETTINGS.items()},
}


@every_argument(TARGETS)
def test_any_object_is_taken_or_refused_by_name(call: Callable[..., Any], arguments: dict[str, Any], odd: str) -> None:
    taken_or_refused(call, arguments, odd, *(["road"] if odd == "height" else []))


@pytest.mark.parametrize("value", ODD.values(), ids=ODD)
def test_any_object_among_the_columns(value: Any) -> None:
    for place in range(4):
        columns: list[Any] = [COLUMN] * 4
        columns[place] = value
        everything: list[Any] = [tuple(columns), columns]
        for points in everything:
            with pytest.raises((TypeError, ValueError)) as caught:
                robust_min_x(points)
            assert "points" in message(caught.value)
