"""Bad input gives an exception of the right type that names the argument: never a panic, never a number."""

from __future__ import annotations

import math
import subprocess
import sys
import types
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import ttc_fast
from tests.support.refusals import Targets, every_argument, message, refused, taken_or_refused
from ttc_fast import KthSmallest, NeighbourSupport, NoDataError, ScanTTC, Status, ittc

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

BEAMS = 3
SCAN = ScanTTC(-0.1, 0.1, BEAMS)
RANGES = np.full(BEAMS, 10.0)
BATCH = np.full((2, BEAMS), 10.0)

METHODS: dict[str, Callable[..., Any]] = {"min": SCAN.min, "nearest": SCAN.nearest, "per_beam": SCAN.per_beam}
every_method = pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)


def scan_refused(kind: type[Exception], argument: str, value: Any, **others: Any) -> str:
    settings: dict[str, Any] = {"angle_min": -1.0, "angle_increment": 0.1, "beams": BEAMS, **others}
    settings[argument] = value
    return refused(kind, argument, ScanTTC, **settings)


# --- ranges --------------------------------------------------------------------------------------------------------


@every_method
@pytest.mark.parametrize("shape", [(), (1, 1, BEAMS), (1, 1, 1, BEAMS)], ids=str)
def test_ranges_of_another_rank(method: Callable[..., Any], shape: tuple[int, ...]) -> None:
    refused(ValueError, "ranges", method, np.ones(shape), 5.0)
    if shape:
        refused(ValueError, "ranges", ittc, np.ones(shape), closing_speed=5.0)


@every_method
@pytest.mark.parametrize("shape", [(0,), (2,), (4,), (2, 0), (2, 4), (BEAMS, 2), (0, 4)], ids=str)
def test_ranges_of_another_length(method: Callable[..., Any], shape: tuple[int, ...]) -> None:
    assert "3" in refused(ValueError, "ranges", method, np.ones(shape), 5.0)


WRONG_DTYPES: dict[str, tuple[NDArray[Any], str]] = {
    "float16": (np.ones(BEAMS, np.float16), "astype"),
    "millimetres, uint16": (np.ones(BEAMS, np.uint16), "0.001"),
    "millimetres, int32": (np.ones(BEAMS, np.int32), "0.001"),
    "big-endian float32": (np.ones(BEAMS, ">f4"), "'=f4'"),
    "big-endian float64": (np.ones(BEAMS, ">f8"), "'=f8'"),
    "longdouble": (np.ones(BEAMS, np.longdouble), "astype"),
    "object": (np.ones(BEAMS, object), "astype"),
    "bool": (np.ones(BEAMS, bool), "float32"),
    "complex": (np.ones(BEAMS, np.complex64), "float32"),
    "records": (np.ones(BEAMS, [("range", "f4"), ("t", "f4")]), "field"),
    "text": (np.full(BEAMS, "1.0"), "float32"),
    "durations": (np.ones(BEAMS, "m8[s]"), "float32"),
}


@every_method
@pytest.mark.parametrize(("ranges", "fix"), WRONG_DTYPES.values(), ids=WRONG_DTYPES)
def test_ranges_of_another_dtype_are_told_the_fix(method: Callable[..., Any], ranges: NDArray[Any], fix: str) -> None:
    assert fix in refused(TypeError, "ranges", method, ranges, 5.0)
    assert fix in refused(TypeError, "ranges", ittc, ranges, closing_speed=5.0)


NOT_ARRAYS: dict[str, Any] = {
    "list": ["1.0", "2.0", "3.0"],
    "tuple": (1.0, None, 3.0),
    "ragged": [[1.0], [2.0, 3.0]],
    "None": None,
    "str": "abc",
    "bytes": b"abc",
    "float": 3.0,
    "set": {1.0, 2.0, 3.0},
    "object": object(),
    "type": np.ndarray,
}


@every_method
@pytest.mark.parametrize("ranges", NOT_ARRAYS.values(), ids=NOT_ARRAYS)
def test_ranges_that_are_no_array(method: Callable[..., Any], ranges: Any) -> None:
    assert "numpy" in refused(TypeError, "ranges", method, ranges, 5.0)
    if not isinstance(ranges, float):
        assert "numpy" in refused(TypeError, "ranges", ittc, ranges, closing_speed=5.0)


@every_method
def test_a_masked_array_is_not_read_through_its_mask(method: Callable[..., Any]) -> None:
    """Its data under the mask are exactly what is not to be read."""
    ranges = np.ma.masked_array([0.1, 10.0, 10.0], mask=[True, False, False])
    assert "filled" in refused(TypeError, "ranges", method, ranges, 5.0)
    assert "filled" in refused(TypeError, "ranges", ittc, ranges, closing_speed=5.0)


# --- motions -------------------------------------------------------------------------------------------------------

MOTIONS = ["speed", "yaw_rate", "lateral_speed"]
each_motion = pytest.mark.parametrize("motion", MOTIONS)


@every_method
@each_motion
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, np.float32(np.nan)], ids=repr)
def test_motions_that_are_not_finite(method: Callable[..., Any], motion: str, value: float) -> None:
    refused(ValueError, motion, method, RANGES, **{"speed": 1.0, motion: value})
    refused(ValueError, motion, method, BATCH, **{"speed": 1.0, motion: value})
    assert "row 1" in refused(ValueError, motion, method, BATCH, **{"speed": 1.0, motion: np.array([1.0, value])})


@every_method
@each_motion
@pytest.mark.parametrize("value", ["5", b"5", 1j, [1.0], (1.0, 2.0), {}, ..., np.ones(1), np.ones(BEAMS)], ids=repr)
def test_motions_of_one_scan_that_are_no_number(method: Callable[..., Any], motion: str, value: Any) -> None:
    refused(TypeError, motion, method, RANGES, **{"speed": 1.0, motion: value})


@every_method
@each_motion
@pytest.mark.parametrize("shape", [(1,), (3,), (2, 1), (1, 2), (2, BEAMS), (0,)], ids=str)
def test_motions_of_a_batch_in_another_shape(method: Callable[..., Any], motion: str, shape: tuple[int, ...]) -> None:
    assert "(2,)" in refused(ValueError, motion, method, BATCH, **{"speed": 1.0, motion: np.ones(shape)})


@every_method
@each_motion
@pytest.mark.parametrize(
    "value",
    [["1", "2"], np.array([1.0, 2.0 + 1j]), np.array([1, 2], "m8[s]"), [None, 1.0], {1: 2}, ..., "ab"],
    ids=repr,
)
@pytest.mark.filterwarnings("ignore::numpy.exceptions.ComplexWarning")
def test_motions_of_a_batch_that_are_no_numbers(method: Callable[..., Any], motion: str, value: Any) -> None:
    with pytest.raises((TypeError, ValueError)) as caught:
        method(BATCH, **{"speed": 1.0, motion: value})
    assert motion in message(caught.value)


@every_method
def test_a_missing_speed(method: Callable[..., Any]) -> None:
    refused(TypeError, "speed", method, RANGES)
    refused(TypeError, "speed", method, RANGES, None)


@every_method
def test_faster_than_light(method: Callable[..., Any]) -> None:
    refused(ValueError, "speed", method, RANGES, 3e8)
    refused(ValueError, "speed", method, RANGES, -1e300)


def test_a_bad_motion_in_a_late_row_leaves_the_earlier_rows_alone() -> None:
    """In place, the ranges would otherwise be half overwritten when the exception comes."""
    ranges = np.full((3, BEAMS), 10.0)
    refused(ValueError, "speed", SCAN.per_beam, ranges, np.array([1.0, 2.0, np.nan]), out=ranges)
    assert (ranges == 10.0).all()


# --- blind scans ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_a_million_nans(dtype: str) -> None:
    beams = 1_000_000
    scan, ranges = ScanTTC(-2.0, 4e-6, beams), np.full(beams, np.nan, dtype)
    with pytest.raises(NoDataError, match="nothing valid was observed"):
        scan.min(ranges, 5.0)
    nearest = scan.nearest(ranges, 5.0)
    assert (nearest.status, nearest.ttc, nearest.beam) == (Status.NO_DATA, math.inf, -1)
    assert (nearest.counts.invalid, nearest.counts.valid) == (beams, 0)
    status = np.empty(beams, np.uint8)
    assert np.isposinf(scan.per_beam(ranges, 5.0, status_out=status)).all()
    assert (status == Status.INVALID).all()


@pytest.mark.parametrize(
    "blind", [np.nan, 0.01, 99.0, -1.0], ids=["NaN", "below range_min", "above range_max", "negative"]
)
def test_nothing_valid_is_not_free_space(blind: float) -> None:
    scan = ScanTTC(-0.1, 0.1, BEAMS, range_min=0.06, range_max=30.0)
    for speed in (5.0, 0.0, -5.0):
        with pytest.raises(NoDataError):
            scan.min(np.full(BEAMS, blind), speed)


def test_the_blind_row_of_a_batch_is_named() -> None:
    with pytest.raises(NoDataError, match=r"\b1\b"):
        SCAN.min(np.array([[10.0] * 3, [np.nan] * 3]), 5.0)


# --- settings ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("argument", ["angle_min", "angle_increment", "range_min", "min_closing_speed"])
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_settings_that_are_not_finite(argument: str, value: float) -> None:
    scan_refused(ValueError, argument, value)


@pytest.mark.parametrize(
    "argument", ["angle_min", "angle_increment", "range_min", "range_max", "min_closing_speed", "no_data"]
)
@pytest.mark.parametrize("value", ["1", 1j, [1.0], ...], ids=repr)
def test_settings_that_are_no_number(argument: str, value: Any) -> None:
    scan_refused(TypeError, argument, value)


@pytest.mark.parametrize("beams", [0, -1, -(2**62)])
def test_no_beams(beams: int) -> None:
    assert "at least 1" in scan_refused(ValueError, "beams", beams)


@pytest.mark.parametrize("beams", [3.0, "3", None, 2.5], ids=repr)
def test_beams_that_are_no_integer(beams: Any) -> None:
    scan_refused(TypeError, "beams", beams)


@pytest.mark.skipif(sys.platform == "win32", reason="needs the resource module")
@pytest.mark.parametrize("beams", ["2**32", "2**40", "2**62", "2**62 + 1", "2**63 - 1", "2**70"])
def test_more_beams_than_memory(beams: str) -> None:
    """In a process of its own: what is being tested for is that it survives."""
    program = f"""
import resource, ttc_fast
resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
for increment in (0.1, 1e-300):
    try:
        ttc_fast.ScanTTC(0.0, increment, {beams})
    except (ValueError, OverflowError) as error:
        assert increment == 0.1 or "beams" in "".join([str(error), *getattr(error, "__notes__", [])]), error
    else:
        raise AssertionError("accepted")
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr[-500:]


def test_angles_that_stand_still() -> None:
    scan_refused(ValueError, "angle_increment", 0.0)
    assert ScanTTC(0.0, 0.0, 1).min(np.array([10.0]), 5.0) == 2.0


def test_degrees_instead_of_radians() -> None:
    assert "radians" in refused(ValueError, "angle", ScanTTC, -135.0, 0.25, 1081)
    assert "radians" in refused(ValueError, "angle", ScanTTC, -90.0, 1.0, 181)
    assert "radians" in refused(ValueError, "angle", ScanTTC, 0.0, 1.0, 360)
    assert "radians" in refused(ValueError, "angle", ScanTTC, -135.0, math.radians(0.25), 1081)


def test_directions_that_overflow() -> None:
    """Each angle alone is finite; their sum is not, and has no direction."""
    with pytest.raises(ValueError, match=r"angle|mount"):
        ScanTTC(1e308, 0.1, BEAMS, mount=(0.0, 0.0, 1e308))


@pytest.mark.parametrize(("low", "high"), [(30.0, 0.1), (1.0, 1.0), (0.0, -1.0), (0.0, math.nan), (0.0, 0.0)])
def test_sensor_ranges_swapped_or_empty(low: float, high: float) -> None:
    scan_refused(ValueError, "range_max", high, range_min=low)


def test_a_negative_range_min() -> None:
    scan_refused(ValueError, "range_min", -0.1)


@pytest.mark.parametrize(
    "limits", [(10.0, 0.3), (1.0, 1.0), (math.nan, 1.0), (0.0, math.nan), (-1.0, 1.0), (math.inf, math.inf)], ids=str
)
@pytest.mark.parametrize("policy", ["horizon", "clamp"])
def test_limits_swapped_empty_or_nan(limits: tuple[float, float], policy: str) -> None:
    assert "near" in scan_refused(ValueError, "limits", limits, limits_policy=policy)


@pytest.mark.parametrize("argument", ["limits", "mount", "outline"])
@pytest.mark.parametrize("value", [1.0, "ab", (), (1.0,), (1.0, 2.0, 3.0, 4.0, 5.0), ("a", "b", "c"), ...], ids=repr)
def test_tuples_of_another_length_or_content(argument: str, value: Any) -> None:
    with pytest.raises((TypeError, ValueError)) as caught:
        ScanTTC(-1.0, 0.1, BEAMS, **{argument: value})
    assert argument in message(caught.value)


@pytest.mark.parametrize("argument", ["limits_policy", "too_close"])
def test_unknown_policies_are_told_the_known_ones(argument: str) -> None:
    known = {"limits_policy": ("horizon", "clamp"), "too_close": ("hit", "ignore")}[argument]
    for unknown in ("", "Horizon", "HIT", "hit ", "\N{PILE OF POO}", "x" * 1000):
        said = scan_refused(ValueError, argument, unknown)
        assert all(name in said for name in known)
    for value in (None, 1, b"hit", ["hit"]):
        scan_refused(TypeError, argument, value)


@pytest.mark.parametrize("place", range(3))
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_mounts_that_are_nowhere(place: int, value: float) -> None:
    mount = [0.0, 0.0, 0.0]
    mount[place] = value
    scan_refused(ValueError, "mount", tuple(mount))


OUTLINES = {
    "front and rear swapped": (0.4, -0.1, -0.15, 0.15),
    "left and right swapped": (-0.1, 0.4, 0.15, -0.15),
    "no length": (0.4, 0.4, -0.15, 0.15),
    "no width": (-0.1, 0.4, 0.0, 0.0),
    "NaN": (-0.1, math.nan, -0.15, 0.15),
    "infinite": (-math.inf, 0.4, -0.15, 0.15),
    "in millimetres": (-100.0, 400.0, -150.0, 150.0),
}


@pytest.mark.parametrize("outline", OUTLINES.values(), ids=OUTLINES)
def test_outlines_that_are_none(outline: tuple[float, ...]) -> None:
    scan_refused(ValueError, "outline", outline)


@pytest.mark.parametrize("length", [0, 2, 4])
def test_masks_of_another_length(length: int) -> None:
    assert "3" in scan_refused(ValueError, "mask", np.zeros(length, bool))
    assert "3" in scan_refused(ValueError, "mask", [False] * length)


@pytest.mark.parametrize(
    "mask",
    [np.zeros(BEAMS), np.zeros(BEAMS, np.uint8), [0, 1, 0], np.zeros((BEAMS, 1), bool), "abc", True, [None] * BEAMS],
    ids=repr,
)
def test_masks_that_are_not_of_bools(mask: Any) -> None:
    """Integers could be indices: [0, 2] is no mask."""
    scan_refused(TypeError, "mask", mask)


@pytest.mark.parametrize("value", [-1.0, math.nan, -math.inf])
def test_a_no_data_that_is_no_time(value: float) -> None:
    scan_refused(ValueError, "no_data", value)


@pytest.mark.parametrize("minimum", [3, "median", KthSmallest, ..., (2,)], ids=repr)
def test_minima_that_are_none(minimum: Any) -> None:
    assert "KthSmallest" in scan_refused(TypeError, "minimum", minimum)


def test_a_setting_that_does_not_exist() -> None:
    refused(TypeError, "rangemin", ScanTTC, 0.0, 0.1, 3, rangemin=0.1)


# --- how a speckle is outvoted --------------------------------------------------------------------------------------


@pytest.mark.parametrize("k", [0, -1, -(2**63)])
def test_k_below_one(k: int) -> None:
    refused(ValueError, "k", KthSmallest, k)


@pytest.mark.parametrize("k", [1.0, "1", None], ids=repr)
def test_k_that_is_no_integer(k: Any) -> None:
    refused(TypeError, "k", KthSmallest, k)


@pytest.mark.parametrize(
    ("argument", "settings"),
    [
        ("count", {"count": 0}),
        ("count", {"count": -1}),
        ("count", {"count": 5, "window": 2}),
        ("count", {"window": 0}),
        ("window", {"window": -1}),
        ("window", {"window": 129}),
        ("window", {"window": 2**63 - 1}),
        ("gap", {"gap": -0.1}),
        ("gap", {"gap": math.nan}),
        ("gap", {"gap": math.inf}),
    ],
    ids=str,
)
def test_a_support_that_nothing_could_have(argument: str, settings: dict[str, Any]) -> None:
    refused(ValueError, argument, NeighbourSupport, **settings)


def test_more_votes_or_neighbours_than_beams() -> None:
    """A vote that cannot be held is TOO_FEW, however large its numbers."""
    for k in (BEAMS + 1, 2**31, 2**63 - 1):
        nearest = ScanTTC(-0.1, 0.1, BEAMS, minimum=KthSmallest(k)).nearest(RANGES, 5.0)
        assert (nearest.status, nearest.beam) == (Status.TOO_FEW, 1)
    wide = NeighbourSupport(count=2, window=128)
    assert ScanTTC(-0.1, 0.1, BEAMS, minimum=wide).nearest(RANGES, 5.0).status is Status.CLOSING


# --- ittc ----------------------------------------------------------------------------------------------------------


def test_not_exactly_one_rate() -> None:
    for rates in ({}, {"closing_speed": 1.0, "range_rate": -1.0}, {"closing_speed": None}):
        said = refused(TypeError, "closing_speed", ittc, RANGES, **rates)
        assert "range_rate" in said


def test_rates_are_given_by_name() -> None:
    """A bare number would not say which sign it has."""
    with pytest.raises(TypeError, match="by name"):
        ittc(RANGES, 5.0)  # type: ignore[call-overload]


@pytest.mark.parametrize("rate", ["closing_speed", "range_rate"])
def test_bad_rates(rate: str) -> None:
    value: Any
    for value in (math.nan, math.inf, -math.inf):
        refused(ValueError, rate, ittc, RANGES, **{rate: value})
    for value in ("1", 1j, ["1.0"] * BEAMS, object(), np.ones(BEAMS, int)):
        refused(TypeError, rate, ittc, RANGES, **{rate: value})
    for value in (np.ones(BEAMS + 1), np.ones((BEAMS, 1)), np.ones((1, BEAMS)), np.ones((1, 1, 1))):
        refused(ValueError, rate, ittc, RANGES, **{rate: value})


@pytest.mark.parametrize("value", [-0.1, math.nan, math.inf])
def test_a_bad_epsilon(value: float) -> None:
    refused(ValueError, "min_closing_speed", ittc, RANGES, closing_speed=1.0, min_closing_speed=value)


def test_a_speed_that_float32_cannot_hold_is_not_an_infinite_ttc() -> None:
    """Closing at 1e300 m/s is not "invalid, so never": refused, or 0, but not inf."""
    try:
        ttc = ittc(RANGES.astype(np.float32), closing_speed=1e300)
    except ValueError as error:
        assert "closing_speed" in str(error)  # noqa: PT017 - either answer is right
    else:
        assert (ttc < 1e-30).all()


def test_elements_that_make_no_sense_are_invalid_one_by_one() -> None:
    ranges = np.array([np.nan, -1.0, 10.0, 10.0, 10.0, 10.0])
    speeds = np.array([1.0, 1.0, np.nan, np.inf, -np.inf, 2.0])
    status = np.empty(6, np.uint8)
    ttc = ittc(ranges, closing_speed=speeds, status_out=status)
    assert ttc.tolist() == [math.inf] * 5 + [5.0]
    assert status.tolist() == [Status.INVALID] * 5 + [Status.CLOSING]


# --- out and status_out --------------------------------------------------------------------------------------------


def read_only(shape: Any, dtype: Any) -> NDArray[Any]:
    out: NDArray[Any] = np.zeros(shape, dtype)
    out.flags.writeable = False
    return out


def writers() -> dict[str, Callable[..., Any]]:
    return {
        "per_beam": lambda **outputs: SCAN.per_beam(RANGES, 5.0, **outputs),
        "ittc": lambda **outputs: ittc(RANGES, closing_speed=5.0, **outputs),
    }


@pytest.mark.parametrize("write", writers().values(), ids=writers())
@pytest.mark.parametrize(("argument", "dtype"), [("out", np.float64), ("status_out", np.uint8)])
class TestOutputs:
    def test_another_dtype(self, write: Callable[..., Any], argument: str, dtype: Any) -> None:
        wrong: list[Any] = [np.float32, np.int8, np.int64, bool, object, ">f8", "f4,f4"]
        for other in wrong:
            said = refused(TypeError, argument, write, **{argument: np.zeros(BEAMS, other)})
            assert np.dtype(dtype).name in said

    def test_another_shape(self, write: Callable[..., Any], argument: str, dtype: Any) -> None:
        for shape in [(), (BEAMS - 1,), (BEAMS + 1,), (1, BEAMS), (BEAMS, 1), (0,)]:
            refused(ValueError, argument, write, **{argument: np.zeros(shape, dtype)})

    def test_read_only(self, write: Callable[..., Any], argument: str, dtype: Any) -> None:
        assert "read-only" in refused(ValueError, argument, write, **{argument: read_only(BEAMS, dtype)})
        assert "read-only" in refused(
            ValueError, argument, write, **{argument: np.broadcast_to(np.zeros(1, dtype), BEAMS)}
        )

    def test_no_array(self, write: Callable[..., Any], argument: str, dtype: Any) -> None:
        for value in ([0.0] * BEAMS, "abc", 0.0, object(), np.zeros(BEAMS, dtype).data):
            refused(TypeError, argument, write, **{argument: value})


def test_a_refused_output_leaves_the_other_untouched() -> None:
    out, status = np.full(BEAMS, 7.0), np.full(BEAMS + 1, 7, np.uint8)
    for write in writers().values():
        refused(ValueError, "status_out", write, out=out, status_out=status)
        assert (out == 7.0).all()


# --- messages ------------------------------------------------------------------------------------------------------

FIELDS = ["angle_min", "angle_increment", "range_min", "range_max", "ranges"]


def laser_scan(**changes: Any) -> types.SimpleNamespace:
    fields: dict[str, Any] = dict(zip(FIELDS, [-0.1, 0.1, 0.1, 30.0, RANGES], strict=True))
    return types.SimpleNamespace(**{**fields, **changes})


@pytest.mark.parametrize("field", FIELDS)
def test_a_message_without_a_field(field: str) -> None:
    msg = laser_scan()
    delattr(msg, field)
    assert "LaserScan" in refused(TypeError, field, ScanTTC.from_message, msg)


@pytest.mark.parametrize("msg", [None, "LaserScan", {}, 3, RANGES], ids=repr)
def test_what_is_no_message(msg: Any) -> None:
    assert "LaserScan" in refused(TypeError, "msg", ScanTTC.from_message, msg)


@pytest.mark.parametrize("field", FIELDS)
def test_a_message_with_a_field_of_another_type(field: str) -> None:
    refused(TypeError, field, ScanTTC.from_message, laser_scan(**{field: object()}))


def test_an_empty_message() -> None:
    refused(ValueError, "beams", ScanTTC.from_message, laser_scan(ranges=()))


# --- signs ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("helper", "first"),
    [
        (ttc_fast.closing_speed_from_ego_velocity, "speed"),
        (ttc_fast.range_rate_from_target_velocity, "velocity"),
    ],
)
@pytest.mark.parametrize("value", [None, "5", ..., 1j, [None]], ids=repr)
def test_speeds_that_are_no_numbers(helper: Callable[..., Any], first: str, value: Any) -> None:
    refused(TypeError, first, helper, value, 0.0)
    refused(TypeError, "angle", helper, 1.0, value)


# --- anything ------------------------------------------------------------------------------------------------------


TARGETS: Targets = {
    "ScanTTC": (
        ScanTTC,
        {
            "angle_min": -0.1,
            "angle_increment": 0.1,
            "beams": BEAMS,
            "range_min": 0.0,
            "range_max": 30.0,
            "limits": (0.0, 20.0),
            "limits_policy": "horizon",
            "mount": (0.0, 0.0, 0.0),
            "outline": (-1.0, 1.0, -1.0, 1.0),
            "mask": [False] * BEAMS,
            "min_closing_speed": 0.01,
            "too_close": "hit",
            "no_data": 1.0,
            "minimum": KthSmallest(2),
        },
    ),
    "min": (SCAN.min, {"ranges": RANGES, "speed": 1.0, "yaw_rate": 0.0, "lateral_speed": 0.0}),
    "min of a batch": (SCAN.min, {"ranges": BATCH, "speed": 1.0, "yaw_rate": 0.0, "lateral_speed": 0.0}),
    "nearest": (SCAN.nearest, {"ranges": RANGES, "speed": 1.0, "yaw_rate": 0.0, "lateral_speed": 0.0}),
    "per_beam": (
        SCAN.per_beam,
        {"ranges": RANGES, "speed": 1.0, "out": np.empty(BEAMS), "status_out": np.empty(BEAMS, np.uint8)},
    ),
    "ittc": (
        ittc,
        {"ranges": RANGES, "closing_speed": 1.0, "min_closing_speed": 0.0, "out": None, "status_out": None},
    ),
    "KthSmallest": (KthSmallest, {"k": 1}),
    "NeighbourSupport": (NeighbourSupport, {"count": 1, "window": 2, "gap": 0.2}),
}


@every_argument(TARGETS)
def test_any_object_is_taken_or_refused_by_name(call: Callable[..., Any], arguments: dict[str, Any], odd: str) -> None:
    taken_or_refused(call, arguments, odd, passes=NoDataError)
