"""Every sentence of the contract about scans, with numbers worked out by hand; the kernels and the reference alike."""

from __future__ import annotations

import array
import copy
import inspect
import math
import pickle
import types
from typing import Any

import numpy as np
import pytest

import ttc_fast
from tests.support.common import CAR, both_dtypes
from ttc_fast import KthSmallest, NeighbourSupport, NoDataError, ScanTTC, Status

INF, NAN = math.inf, math.nan


def ahead(ttc: Any, **settings: Any) -> Any:
    """A scanner with one beam, straight ahead."""
    return ttc.ScanTTC(0.0, 0.0, 1, **settings)


def four_ways(ttc: Any, **settings: Any) -> Any:
    """A scanner that looks ahead, left, back and right."""
    return ttc.ScanTTC(0.0, math.pi / 2, 4, **settings)


def one(reading: float, dtype: Any = np.float64) -> Any:
    return np.array([reading], dtype)


def counted(nearest: Any) -> dict[str, int]:
    """The counts that are not 0."""
    names = ["valid", "invalid", "too_close", "no_return", "out_of_range", "beyond_limits", "masked", "contact"]
    return {name: value for name in names if (value := int(getattr(nearest.counts, name)))}


def statuses(scan: Any, ranges: Any, *motion: float) -> list[Status]:
    out = np.empty(np.shape(ranges), np.uint8)
    scan.per_beam(ranges, *motion, status_out=out)
    return [Status(value) for value in out]


# --- signs ---------------------------------------------------------------------------------------------------------


def test_a_wall_10_m_ahead_at_5_m_s(ttc: Any) -> None:
    assert ahead(ttc).min(one(10.0), 5.0) == 2.0
    assert ttc.ittc(one(10.0), closing_speed=ttc.closing_speed_from_ego_velocity(5.0, 0.0)) == 2.0


def test_reversing_from_it(ttc: Any) -> None:
    assert ahead(ttc).min(one(10.0), -5.0) == INF
    assert ttc.ittc(one(10.0), closing_speed=ttc.closing_speed_from_ego_velocity(-5.0, 0.0)) == INF


def test_a_target_coming_at_5_m_s(ttc: Any) -> None:
    rate = ttc.range_rate_from_target_velocity(5.0, math.radians(180.0))
    assert rate == -5.0
    assert ttc.ittc(one(10.0), range_rate=rate) == 2.0
    assert ttc.ittc(one(10.0), range_rate=-rate) == INF


def test_range_rate_is_the_negative_of_closing_speed(ttc: Any) -> None:
    ranges, speeds = np.array([1.0, 2.0, 3.0, 4.0]), np.array([2.0, -2.0, 0.0, 8.0])
    assert ttc.ittc(ranges, closing_speed=speeds).tolist() == [0.5, INF, INF, 0.5]
    assert ttc.ittc(ranges, range_rate=-speeds).tolist() == [0.5, INF, INF, 0.5]


def test_angles_are_counter_clockwise_from_ahead(ttc: Any) -> None:
    """Driving forward closes ahead, sliding left closes at the left, and so on round the car."""
    scan, ranges = four_ways(ttc), np.array([2.0, 4.0, 6.0, 8.0])
    for motion, beam, expected in (
        ((2.0,), 0, 1.0),
        ((0.0, 0.0, 2.0), 1, 2.0),
        ((-2.0,), 2, 3.0),
        ((0.0, 0.0, -2.0), 3, 4.0),
    ):
        nearest = scan.nearest(ranges, *motion)
        assert (nearest.beam, nearest.status) == (beam, Status.CLOSING)
        assert nearest.ttc == pytest.approx(expected)
        assert nearest.closing_speed == pytest.approx(2.0)
        assert nearest.angle == pytest.approx(beam * math.pi / 2)


def test_negative_increments_mirror_the_scan(ttc: Any) -> None:
    clockwise = ttc.ScanTTC(1.0, -0.25, 9)
    counter = ttc.ScanTTC(-1.0, 0.25, 9)
    ranges = np.array([9.0, 8.0, 3.0, 9.0, 9.0, 9.0, 9.0, 5.0, 9.0])
    assert clockwise.angles.tolist() == counter.angles.tolist()[::-1]
    assert clockwise.min(ranges, 5.0, 0.4, 0.3) == counter.min(ranges[::-1], 5.0, 0.4, 0.3)
    assert clockwise.nearest(ranges, 5.0).angle == 0.5


# --- motion of the sensor ------------------------------------------------------------------------------------------


def test_the_yaw_rate_moves_a_mounted_sensor(ttc: Any) -> None:
    """0.5 m ahead of the origin, turning left at 2 rad/s, the sensor moves left at 1 m/s."""
    scan = four_ways(ttc, mount=(0.5, 0.0, 0.0))
    nearest = scan.nearest(np.full(4, 3.0), 0.0, 2.0)
    assert (nearest.beam, nearest.closing_speed, nearest.ttc) == (1, pytest.approx(1.0), pytest.approx(3.0))
    assert scan.nearest(np.full(4, 3.0), 0.0, -2.0).beam == 3


def test_the_yaw_rate_moves_a_sensor_at_the_side_forward_or_back(ttc: Any) -> None:
    """0.5 m left of the origin, turning left at 2 rad/s takes 1 m/s from the forward speed."""
    scan = ahead(ttc, mount=(0.0, 0.5, 0.0))
    assert scan.min(one(4.0), 3.0, 2.0) == 2.0
    assert scan.min(one(4.0), 3.0, -2.0) == 1.0
    assert scan.min(one(4.0), 1.0, 2.0) == INF


def test_the_yaw_rate_does_not_move_a_sensor_at_the_origin(ttc: Any) -> None:
    assert four_ways(ttc).min(np.full(4, 3.0), 0.0, 2.0) == INF
    assert ahead(ttc).min(one(10.0), 5.0, 3.0) == 2.0


def test_all_three_motions_add_up(ttc: Any) -> None:
    """At (1, -0.5) with v = 4, omega = 2, sliding 1: velocity (4 + 1, 1 + 2), on the 3-4-5 beam 5 * 0.8 + 3 * 0.6."""
    scan = ttc.ScanTTC(math.atan2(0.6, 0.8), 0.1, 1, mount=(1.0, -0.5, 0.0))
    nearest = scan.nearest(one(5.8), 4.0, 2.0, 1.0)
    assert nearest.closing_speed == pytest.approx(5.8)
    assert nearest.ttc == pytest.approx(1.0)


def test_a_backward_mount(ttc: Any) -> None:
    scan = ahead(ttc, mount=(-0.1, 0.0, math.pi))
    assert scan.min(one(10.0), 5.0) == INF
    assert scan.min(one(10.0), -5.0) == 2.0
    assert scan.nearest(one(10.0), -5.0).angle == 0.0, "angles are the sensor's own"


def test_standing_still_closes_nothing(ttc: Any) -> None:
    nearest = four_ways(ttc).nearest(np.full(4, 1.0), 0.0)
    assert (nearest.ttc, nearest.status, nearest.beam) == (INF, Status.NOT_CLOSING, -1)


# --- epsilon -------------------------------------------------------------------------------------------------------


@both_dtypes
def test_the_cosine_of_a_right_angle_does_not_matter(ttc: Any, dtype: Any) -> None:
    """float64 cos(pi/2) is 6e-17, float32 cos(pi/2) is -4e-8: neither closes, at any speed."""
    scan = ttc.ScanTTC(-math.pi / 2, math.pi, 2)
    for speed in (1.0, 100.0, -100.0):
        assert scan.min(np.full(2, 1e-3, dtype), speed) == INF
        assert statuses(scan, np.full(2, 1e-3, dtype), speed) == [Status.NOT_CLOSING] * 2


@both_dtypes
def test_closing_at_the_epsilon_is_not_closing(ttc: Any, dtype: Any) -> None:
    assert ahead(ttc).min(one(1.0, dtype), 0.01) == INF
    assert ahead(ttc).min(one(1.0, dtype), 0.0101) == pytest.approx(1.0 / 0.0101)
    assert ahead(ttc, min_closing_speed=0.5).min(one(1.0, dtype), 0.5) == INF
    assert ttc.ittc(one(1.0, dtype), closing_speed=0.5, min_closing_speed=0.5) == INF
    assert ttc.ittc(one(1.0, dtype), closing_speed=0.75, min_closing_speed=0.5) == pytest.approx(4 / 3)


def test_the_bare_formula_has_no_epsilon(ttc: Any) -> None:
    assert ttc.ittc(one(1.0), closing_speed=2.0**-40) == 2.0**40
    assert ttc.ittc(one(1.0), closing_speed=0.0) == INF


# --- what a reading means (REP 117) --------------------------------------------------------------------------------

SENSOR = {"range_min": 0.5, "range_max": 30.0}


@both_dtypes
@pytest.mark.parametrize(
    ("reading", "expected", "status", "count"),
    [
        (10.0, 2.0, Status.CLOSING, "valid"),
        (0.5, 0.1, Status.CLOSING, "valid"),
        (30.0, 6.0, Status.CLOSING, "valid"),
        (INF, INF, Status.CLEAR, "no_return"),
        (-INF, 0.1, Status.CLOSING, "too_close"),
        (NAN, INF, Status.NO_DATA, "invalid"),
        (0.25, INF, Status.NO_DATA, "out_of_range"),
        (30.5, INF, Status.NO_DATA, "out_of_range"),
        (0.0, INF, Status.NO_DATA, "out_of_range"),
        (-10.0, INF, Status.NO_DATA, "out_of_range"),
    ],
    ids=str,
)
def test_readings(ttc: Any, dtype: Any, reading: float, expected: float, status: Status, count: str) -> None:
    scan = ahead(ttc, **SENSOR)
    nearest = scan.nearest(one(reading, dtype), 5.0)
    assert (nearest.ttc, nearest.status, counted(nearest)) == (expected, status, {count: 1})
    assert scan.per_beam(one(reading, dtype), 5.0) == np.array(expected, dtype)
    one_beam = Status.INVALID if status is Status.NO_DATA else status
    assert statuses(scan, one(reading, dtype), 5.0) == [one_beam]
    if status is Status.NO_DATA:
        with pytest.raises(NoDataError):
            scan.min(one(reading, dtype), 5.0)
    else:
        assert scan.min(one(reading, dtype), 5.0) == expected


def test_minus_infinity_may_be_ignored(ttc: Any) -> None:
    scan = ahead(ttc, **SENSOR, too_close="ignore")
    nearest = scan.nearest(one(-INF), 5.0)
    assert (nearest.ttc, nearest.status, counted(nearest)) == (INF, Status.NO_DATA, {"too_close": 1})
    with pytest.raises(NoDataError):
        scan.min(one(-INF), 5.0)


def test_a_hit_too_close_is_at_range_min(ttc: Any) -> None:
    nearest = ahead(ttc, **SENSOR, outline=CAR).nearest(one(-INF), 5.0)
    assert nearest.range == 0.5
    assert nearest.clearance == pytest.approx(0.1)


@both_dtypes
def test_the_sensors_bounds_are_rounded_to_the_dtype_of_the_ranges(ttc: Any, dtype: Any) -> None:
    """float32(0.1) lies above 0.1 and float32(0.7) below 0.7: both are on the bound, not outside."""
    scan = ahead(ttc, range_min=0.7, range_max=1.1)
    for bound in (0.7, 1.1):
        assert counted(scan.nearest(one(bound, dtype), 5.0)) == {"valid": 1}


@both_dtypes
def test_error_codes_below_range_min_do_not_brake(ttc: Any, dtype: Any) -> None:
    """0..15 mm are how a Hokuyo says "no reading". Without range_min they are an impact."""
    ranges = np.array([0.0, 0.001, 0.015, 4.0], dtype)
    assert ttc.ScanTTC(0.0, 1e-9, 4, range_min=0.06).min(ranges, 2.0) == 2.0
    assert ttc.ScanTTC(0.0, 1e-9, 4).min(ranges, 2.0) == 0.0


def test_every_beam_is_counted_once(ttc: Any) -> None:
    mask = [False] * 7 + [True]
    scan = ttc.ScanTTC(0.0, 1e-3, 8, **SENSOR, limits=(0.0, 20.0), mask=mask, outline=CAR)
    ranges = np.array([10.0, NAN, -INF, INF, 0.1, 25.0, 0.0, 10.0])
    counts = scan.nearest(ranges, 5.0).counts
    assert (counts.valid, counts.invalid, counts.too_close, counts.no_return) == (1, 1, 1, 1)
    assert (counts.out_of_range, counts.beyond_limits, counts.masked, counts.contact) == (2, 1, 1, 0)


@pytest.mark.parametrize("beams", [1, 15, 16, 17, 100, 1080])
def test_counts_add_up_to_the_beams(ttc: Any, beams: int) -> None:
    """``contact`` is apart: those beams are valid as well."""
    random = np.random.default_rng(beams)
    ranges = random.choice([NAN, INF, -INF, 0.1, 0.51, 10.0, 25.0, 99.0, -1.0], beams)
    mask = random.random(beams) < 0.1
    scan = ttc.ScanTTC(
        -3.0, 6.0 / beams, beams, **SENSOR, limits=(0.0, 20.0), mask=mask, outline=(-1.0, 1.0, -0.3, 0.3)
    )
    counts = counted(scan.nearest(ranges, 5.0))
    counts.pop("contact", None)
    assert sum(counts.values()) == beams
    assert counts.get("masked", 0) == mask.sum()


# --- the user's limits ---------------------------------------------------------------------------------------------

LIMITS = {"limits": (0.3, 10.0)}


@both_dtypes
def test_beyond_the_horizon_is_never_the_cause(ttc: Any, dtype: Any) -> None:
    """Clamping 20 m to 10 m at 7 m/s would invent an obstacle 1.43 s away."""
    scan = ahead(ttc, **LIMITS)
    nearest = scan.nearest(one(20.0, dtype), 7.0)
    assert (nearest.ttc, nearest.status, nearest.beam) == (INF, Status.CLEAR, -1)
    assert counted(nearest) == {"beyond_limits": 1}
    assert scan.min(one(20.0, dtype), 7.0) == INF, "far away was seen, so this is not NoDataError"
    assert statuses(scan, one(20.0, dtype), 7.0) == [Status.CLEAR]


@both_dtypes
def test_nearer_than_the_near_limit_is_kept(ttc: Any, dtype: Any) -> None:
    """Raising 0.1 m to 0.3 m would hide an obstacle."""
    nearest = ahead(ttc, **LIMITS).nearest(one(0.1, dtype), 1.0)
    assert nearest.ttc == float(dtype(0.1))
    assert counted(nearest) == {"valid": 1}


def test_the_limits_are_inclusive(ttc: Any) -> None:
    assert ahead(ttc, **LIMITS).min(one(10.0), 5.0) == 2.0
    assert ahead(ttc, **LIMITS).min(one(math.nextafter(10.0, 11.0)), 5.0) == INF


def test_limits_may_clamp_literally(ttc: Any) -> None:
    scan = ahead(ttc, **LIMITS, limits_policy="clamp")
    assert scan.min(one(20.0), 7.0) == pytest.approx(1.43, abs=0.002)
    assert scan.min(one(0.1), 1.0) == 0.3
    assert scan.min(one(5.0), 1.0) == 5.0
    assert counted(scan.nearest(one(20.0), 7.0)) == {"beyond_limits": 1}


def test_clamping_makes_no_reading_of_none(ttc: Any) -> None:
    """Free space stays free, and what the sensor does not vouch for stays discarded."""
    scan = ahead(ttc, **LIMITS, limits_policy="clamp", range_min=0.05, range_max=30.0)
    assert scan.min(one(INF), 7.0) == INF
    for reading in (NAN, 31.0, 0.01):
        with pytest.raises(NoDataError):
            scan.min(one(reading), 7.0)


# --- outline and mount ---------------------------------------------------------------------------------------------


def test_clearance_is_range_less_the_way_to_the_outline(ttc: Any) -> None:
    """From the origin of the car: 0.4 m to the front, 0.15 m to the sides, 0.1 m to the rear."""
    scan = four_ways(ttc, outline=CAR)
    ranges = np.array([2.4, 2.15, 2.1, 2.15])
    for beam, motion in enumerate([(1.0,), (0.0, 0.0, 1.0), (-1.0,), (0.0, 0.0, -1.0)]):
        nearest = scan.nearest(ranges, *motion)
        assert nearest.beam == beam
        assert nearest.range == ranges[beam]
        assert nearest.clearance == pytest.approx(2.0)
        assert nearest.ttc == pytest.approx(2.0)


def test_the_outline_is_seen_from_the_mount(ttc: Any) -> None:
    """0.3 m ahead of the origin, only 0.1 m of the car is ahead of the sensor."""
    nearest = ahead(ttc, outline=CAR, mount=(0.3, 0.0, 0.0)).nearest(one(2.1), 1.0)
    assert nearest.clearance == pytest.approx(2.0)


def test_an_oblique_beam_leaves_by_the_corner_it_meets_first(ttc: Any) -> None:
    """At 45 degrees the side, 0.15 m away, comes before the front: 0.15 * sqrt(2) of the beam is inside."""
    nearest = ttc.ScanTTC(math.pi / 4, 0.1, 1, outline=CAR).nearest(one(1.0), 1.0)
    assert nearest.clearance == pytest.approx(1.0 - 0.15 * math.sqrt(2.0))


def test_without_an_outline_clearance_is_the_range(ttc: Any) -> None:
    nearest = ahead(ttc, mount=(0.3, 0.1, 0.0)).nearest(one(2.1), 1.0)
    assert nearest.clearance == nearest.range == 2.1


def test_a_reading_inside_the_outline_is_contact(ttc: Any) -> None:
    """0 while closing, infinite while opening: the car can back out."""
    scan = ahead(ttc, outline=CAR)
    for reading in (0.3, 0.4):
        closing, opening, still = (scan.nearest(one(reading), speed) for speed in (5.0, -5.0, 0.0))
        assert (closing.ttc, closing.status, closing.beam) == (0.0, Status.CONTACT, 0)
        assert (opening.ttc, opening.status, opening.beam) == (INF, Status.CONTACT, 0)
        assert (still.ttc, still.status) == (INF, Status.CONTACT)
        assert counted(closing) == {"valid": 1, "contact": 1}
        assert closing.clearance == pytest.approx(reading - 0.4)
        assert statuses(scan, one(reading), 5.0) == statuses(scan, one(reading), -5.0) == [Status.CONTACT]


def test_a_sensor_outside_the_outline(ttc: Any) -> None:
    """Half a metre ahead of the bumper: nothing of the car on the beams ahead, the car itself on the beam back."""
    scan = four_ways(ttc, outline=CAR, mount=(0.9, 0.0, 0.0))
    nearest = scan.nearest(np.array([5.0, 5.0, 0.5, 5.0]), 5.0)
    assert (nearest.ttc, nearest.clearance) == (1.0, 5.0)
    assert counted(nearest) == {"valid": 3, "masked": 1}
    assert scan.min(np.array([5.0, 5.0, 0.5, 5.0]), -5.0) == INF
    assert statuses(scan, np.full(4, 5.0), 5.0)[2] is Status.NO_DATA


def test_a_sensor_on_the_bumper(ttc: Any) -> None:
    """It sees everything ahead without an offset, and behind itself only the car."""
    nearest = ttc.ScanTTC(-1.5, 1.5, 3, outline=CAR, mount=(0.4, 0.0, 0.0)).nearest(np.full(3, 5.0), 5.0)
    assert (nearest.ttc, nearest.clearance, counted(nearest)) == (1.0, 5.0, {"valid": 3})
    nearest = ttc.ScanTTC(-1.5, 1.5, 3, outline=CAR, mount=(0.4, 0.0, math.pi)).nearest(np.full(3, 5.0), 5.0)
    assert counted(nearest) == {"masked": 3}


def test_walls_beside_the_car_give_an_ittc_with_nothing_in_the_path(ttc: Any) -> None:
    """Walls at +-1 m beside a 0.3 m wide car at 5 m/s: 0.36 s at 49 degrees (the sensor 0.1 m behind the bumper).

    Of the beam at angle t, 1/sin t is the range and 0.1/cos t lies inside the car (it leaves by the front); it closes
    with 5 cos t. iTTC = (1/sin t - 0.1/cos t) / (5 cos t) is least near 48.6 degrees.
    """
    scan = ttc.ScanTTC(-math.pi / 2, math.radians(0.25), 721, outline=(-0.4, 0.1, -0.15, 0.15))
    ranges = 1.0 / np.maximum(np.abs(np.sin(scan.angles)), 1e-9)
    nearest = scan.nearest(ranges, 5.0)
    assert nearest.ttc == pytest.approx(0.36, abs=0.005)
    assert abs(math.degrees(nearest.angle)) == pytest.approx(49.0, abs=1.0)


# --- mask ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", [list, tuple, np.array], ids=["list", "tuple", "array"])
def test_masked_beams_are_ignored(ttc: Any, kind: Any) -> None:
    scan = ttc.ScanTTC(0.0, 1e-9, 3, mask=kind([True, False, False]))
    ranges = np.array([0.1, 10.0, 20.0])
    nearest = scan.nearest(ranges, 5.0)
    assert (nearest.ttc, nearest.beam) == (2.0, 1)
    assert counted(nearest) == {"valid": 2, "masked": 1}
    assert scan.per_beam(ranges, 5.0).tolist() == [INF, pytest.approx(2.0), pytest.approx(4.0)]
    assert statuses(scan, ranges, 5.0) == [Status.NO_DATA, Status.CLOSING, Status.CLOSING]


def test_a_mask_hides_every_kind_of_reading(ttc: Any) -> None:
    scan = ttc.ScanTTC(0.0, 1e-9, 4, mask=[True] * 4, outline=CAR)
    nearest = scan.nearest(np.array([INF, -INF, NAN, 0.2]), 5.0)
    assert (nearest.status, counted(nearest)) == (Status.NO_DATA, {"masked": 4})
    with pytest.raises(NoDataError):
        scan.min(np.array([INF, -INF, NAN, 0.2]), 5.0)


def test_the_mask_is_the_scans_own(ttc: Any) -> None:
    """Changing the caller's array later changes nothing."""
    mask = np.array([True, False])
    scan = ttc.ScanTTC(0.0, 1e-9, 2, mask=mask)
    mask[:] = False
    assert scan.min(np.array([1.0, 10.0]), 5.0) == 2.0


# --- statuses ------------------------------------------------------------------------------------------------------


def test_status_values_are_fixed() -> None:
    names = [
        "CLEAR",
        "NOT_CLOSING",
        "CLOSING",
        "CONTACT",
        "TOO_FEW",
        "WARMING_UP",
        "LOST",
        "STALE",
        "NO_DATA",
        "INVALID",
    ]
    assert {status.name: status.value for status in Status} == {name: value for value, name in enumerate(names)}
    assert all(isinstance(status, int) for status in Status)


def test_nothing_seen_and_nothing_there_are_different_answers(ttc: Any) -> None:
    scan = ahead(ttc)
    assert scan.nearest(one(INF), 5.0).status is Status.CLEAR
    assert scan.nearest(one(NAN), 5.0).status is Status.NO_DATA


@pytest.mark.parametrize(
    ("ranges", "speed", "expected"),
    [
        ([INF, NAN], 5.0, Status.CLEAR),
        ([INF, 10.0], -5.0, Status.NOT_CLOSING),
        ([10.0, 10.0], 5.0, Status.CLOSING),
        ([10.0, INF], 5.0, Status.CLOSING),
        ([0.2, 10.0], 5.0, Status.CONTACT),
        ([0.2, INF], -5.0, Status.CONTACT),
        ([NAN, 0.2], 0.0, Status.CONTACT),
        ([NAN, NAN], 5.0, Status.NO_DATA),
    ],
    ids=str,
)
def test_the_largest_status_wins(ttc: Any, ranges: list[float], speed: float, expected: Status) -> None:
    """But one blind beam does not blind a scan: NO_DATA is the status of a scan without any valid reading."""
    nearest = ttc.ScanTTC(0.0, 1e-9, 2, outline=CAR).nearest(np.array(ranges), speed)
    assert nearest.status is expected


def test_contact_behind_does_not_hide_what_closes_ahead(ttc: Any) -> None:
    """The status warns of the contact, the number is of the wall."""
    nearest = four_ways(ttc, outline=CAR).nearest(np.array([10.4, INF, 0.05, INF]), 5.0)
    assert (nearest.ttc, nearest.status, nearest.beam) == (2.0, Status.CONTACT, 0)


def test_contact_outranks_too_few(ttc: Any) -> None:
    scan = ttc.ScanTTC(0.0, 1e-9, 3, outline=CAR, minimum=KthSmallest(3))
    assert scan.nearest(np.array([10.4, INF, INF]), 5.0).status is Status.TOO_FEW
    assert scan.nearest(np.array([0.2, INF, INF]), 5.0).status is Status.CONTACT


@both_dtypes
def test_ties_go_to_the_lowest_index(ttc: Any, dtype: Any) -> None:
    scan = ttc.ScanTTC(-0.5, 1e-12, 1000)
    flat = (10.0 / np.cos(scan.angles)).astype(dtype)
    ttcs = flat.astype(np.float64) / (5.0 * np.cos(scan.angles))
    assert scan.nearest(flat, 5.0).beam == int(np.argmin(ttcs))
    symmetric = ttc.ScanTTC(-0.5, 0.5, 3)
    assert symmetric.nearest(np.array([5.0, 90.0, 5.0], dtype), 5.0).beam == 0
    repeated = np.full(1000, 7.0, dtype)
    repeated[[37, 500, 999]] = 0.0
    assert scan.nearest(repeated, 5.0).beam == 37


def test_without_a_deciding_beam_there_is_none(ttc: Any) -> None:
    nearest = ahead(ttc).nearest(one(INF), 5.0)
    assert nearest.beam == -1
    assert all(math.isnan(value) for value in (nearest.angle, nearest.range, nearest.clearance, nearest.closing_speed))


def test_a_ttc_is_never_negative_nan_or_a_sentinel(ttc: Any) -> None:
    random = np.random.default_rng(3)
    values = np.array([NAN, INF, -INF, 0.0, -0.0, -1.0, 1e-320, 1e-45, 1e308, 0.3, 5.0])
    scan = ttc.ScanTTC(-3.1, 0.01, 620, outline=CAR, no_data=INF)
    for _ in range(20):
        ranges = random.choice(values, 620)
        for speed in (5.0, -5.0, 0.0, 1e-300, 1e8):
            assert scan.min(ranges, speed, 0.1, -0.2) >= 0.0
            for found in (
                scan.per_beam(ranges, speed),
                scan.per_beam(ranges, speed, 0.5, 0.5),
                ttc.ittc(ranges, closing_speed=speed),
            ):
                assert (found >= 0.0).all()
                assert not np.signbit(found).any()


# --- one number ----------------------------------------------------------------------------------------------------


def test_a_blind_sensor_is_not_free_space(ttc: Any) -> None:
    assert issubclass(NoDataError, ValueError)
    with pytest.raises(NoDataError):
        ahead(ttc).min(one(NAN), 5.0)
    assert ahead(ttc).min(one(INF), 5.0) == INF


@pytest.mark.parametrize("value", [0.0, 3.5, INF])
def test_the_caller_may_choose_what_blind_means(ttc: Any, value: float) -> None:
    scan = ahead(ttc, no_data=value)
    assert scan.min(one(NAN), 5.0) == value
    assert scan.min(np.array([[NAN], [10.0]]), 5.0).tolist() == [value, 2.0]
    nearest = scan.nearest(one(NAN), 5.0)
    assert (nearest.ttc, nearest.status) == (INF, Status.NO_DATA), "no_data is for the bare number only"


def test_min_is_the_float64_value_of_the_winning_beam(ttc: Any) -> None:
    """Of float32 ranges too: the division is not done in float32."""
    angle, reading = 0.3, np.float32(9.1)
    scan = ttc.ScanTTC(angle, 0.1, 1)
    least = scan.min(np.array([reading]), 4.7)
    assert type(least) is float
    assert least == float(reading) / (4.7 * math.cos(angle))
    assert least != float(np.float32(least))


@both_dtypes
def test_per_beam_has_the_dtype_of_the_ranges(ttc: Any, dtype: Any) -> None:
    ranges = np.full((2, 4), 10.0, dtype)
    for result in (four_ways(ttc).per_beam(ranges, 5.0), ttc.ittc(ranges, closing_speed=5.0)):
        assert (result.dtype, result.shape) == (dtype, (2, 4))


def test_invalid_beams_are_infinite_so_that_the_valid_ones_decide(ttc: Any) -> None:
    scan = ttc.ScanTTC(0.0, 1e-9, 4, range_min=0.1)
    assert scan.per_beam(np.array([NAN, 0.01, 10.0, INF]), 5.0).tolist() == [INF, INF, pytest.approx(2.0), INF]


def test_the_three_methods_agree(ttc: Any) -> None:
    random = np.random.default_rng(5)
    scan = ttc.ScanTTC(-2.0, 0.004, 1000, outline=CAR, mount=(0.2, 0.05, 0.1))
    for _ in range(10):
        ranges = random.uniform(0.5, 30.0, 1000)
        motion = tuple(random.normal(0.0, 3.0, 3))
        nearest = scan.nearest(ranges, *motion)
        each = scan.per_beam(ranges, *motion)
        assert scan.min(ranges, *motion) == nearest.ttc == each.min()
        assert nearest.beam == each.argmin()


# --- speckles ------------------------------------------------------------------------------------------------------

SPECKLED = np.array([10.0, 10.0, 0.5, 10.0, 10.0, 10.0, 10.0, 10.0])


def speckled(ttc: Any, minimum: Any) -> Any:
    return ttc.ScanTTC(0.0, 1e-9, 8, minimum=minimum)


def test_a_speckle_decides_by_default(ttc: Any) -> None:
    assert speckled(ttc, None).min(SPECKLED, 5.0) == pytest.approx(0.1)


@pytest.mark.parametrize(
    "minimum", [KthSmallest(2), KthSmallest(8), NeighbourSupport(), NeighbourSupport(2, 1, 0.0)], ids=repr
)
def test_a_speckle_can_be_outvoted(ttc: Any, minimum: Any) -> None:
    scan = speckled(ttc, minimum)
    nearest = scan.nearest(SPECKLED, 5.0)
    assert (nearest.ttc, nearest.status) == (pytest.approx(2.0), Status.CLOSING)
    assert scan.min(SPECKLED, 5.0) == nearest.ttc


def test_the_kth_smallest_counts_from_one(ttc: Any) -> None:
    ranges = np.array([4.0, 1.0, 3.0, 2.0, 2.0, 9.0, 9.0, 9.0])
    found = [speckled(ttc, KthSmallest(k)).nearest(ranges, 1.0) for k in range(1, 9)]
    assert [nearest.range for nearest in found] == [1.0, 2.0, 2.0, 3.0, 4.0, 9.0, 9.0, 9.0]
    assert [nearest.beam for nearest in found] == [1, 3, 4, 2, 0, 5, 6, 7], "ties in the order of the beams"


@pytest.mark.parametrize("beams", [360, 361])
@pytest.mark.parametrize("window", [1, 2, 3, 200])
def test_neighbours_across_the_seam_of_a_scanner_that_looks_all_around(ttc: Any, beams: int, window: int) -> None:
    """A post straight ahead is as well supported with the seam through it as with the seam behind."""
    increment = math.radians(1.0)
    vote = NeighbourSupport(1, min(window, 128), 0.2)
    for start in (0.5 * increment, 0.5 * increment - math.pi):
        scan = ttc.ScanTTC(start, increment, beams, minimum=vote)
        aside = np.remainder(scan.angles + math.pi, 2 * math.pi) - math.pi
        nearest = scan.nearest(np.where(np.abs(aside) < increment, 2.0, 8.0), 4.0)
        assert (nearest.range, nearest.status) == (2.0, Status.CLOSING)
    half = ttc.ScanTTC(0.5 * increment, increment, 180, minimum=vote)  # its ends are no neighbours
    assert half.nearest(np.where(np.isin(np.arange(180), [0, 179]), 2.0, 8.0), 4.0).range == 8.0


def test_a_thin_pole_is_kept_by_its_own_neighbours(ttc: Any) -> None:
    ranges = SPECKLED.copy()
    ranges[3] = 0.6
    nearest = speckled(ttc, NeighbourSupport(count=1, window=1, gap=0.15)).nearest(ranges, 5.0)
    assert (nearest.beam, nearest.range) == (2, 0.5)
    assert speckled(ttc, NeighbourSupport(count=1, window=1, gap=0.05)).nearest(ranges, 5.0).range == 10.0
    assert speckled(ttc, NeighbourSupport(count=2, window=2, gap=0.15)).nearest(ranges, 5.0).range == 10.0


def test_masked_and_invalid_neighbours_support_nothing(ttc: Any) -> None:
    ranges = np.array([0.5, 0.5, NAN, INF, 10.0, 10.0, 10.0, 10.0])
    mask = [False, True] + [False] * 6
    scan = ttc.ScanTTC(0.0, 1e-9, 8, mask=mask, minimum=NeighbourSupport(1, 3, 0.2))
    assert scan.nearest(ranges, 5.0).beam == 4


def test_too_few_for_a_vote_gives_the_plain_nearest(ttc: Any) -> None:
    """Outvoting is for speckles among many; what stands alone is not thrown away."""
    ranges = np.array([INF, INF, 5.0, INF, INF, INF, INF, INF])
    for minimum in (KthSmallest(2), NeighbourSupport()):
        scan = speckled(ttc, minimum)
        nearest = scan.nearest(ranges, 5.0)
        assert (nearest.ttc, nearest.status, nearest.beam) == (pytest.approx(1.0), Status.TOO_FEW, 2)
        assert scan.min(ranges, 5.0) == nearest.ttc


@pytest.mark.parametrize("minimum", [KthSmallest(2), NeighbourSupport()], ids=repr)
def test_a_vote_on_nothing(ttc: Any, minimum: Any) -> None:
    scan = speckled(ttc, minimum)
    assert scan.nearest(np.full(8, INF), 5.0).status is Status.CLEAR
    assert scan.nearest(np.full(8, 10.0), -5.0).status is Status.NOT_CLOSING
    assert scan.nearest(np.full(8, NAN), 5.0).status is Status.NO_DATA
    with pytest.raises(NoDataError):
        scan.min(np.full(8, NAN), 5.0)


# --- batches -------------------------------------------------------------------------------------------------------


@both_dtypes
@pytest.mark.parametrize("minimum", [None, KthSmallest(3), NeighbourSupport()], ids=repr)
def test_a_batch_is_its_scans_one_by_one(ttc: Any, dtype: Any, minimum: Any) -> None:
    random = np.random.default_rng(11)
    scan = ttc.ScanTTC(-2.0, 0.1, 40, outline=CAR, mount=(0.2, 0.0, 0.0), minimum=minimum, limits=(0.0, 15.0))
    ranges = random.uniform(0.1, 20.0, (6, 40)).astype(dtype)
    ranges[3] = INF
    speed, yaw_rate, lateral_speed = random.normal(0.0, 3.0, (3, 6))
    least = scan.min(ranges, speed, yaw_rate, lateral_speed)
    nearest = scan.nearest(ranges, speed, yaw_rate, lateral_speed)
    status = np.empty(ranges.shape, np.uint8)
    each = scan.per_beam(ranges, speed, yaw_rate, lateral_speed, status_out=status)
    assert (least.dtype, least.shape, len(nearest)) == (np.float64, (6,), 6)
    for row in range(6):
        motion = (speed[row], yaw_rate[row], lateral_speed[row])
        single = scan.nearest(ranges[row], *motion)
        assert least[row] == scan.min(ranges[row], *motion)
        for name in ("ttc", "status", "beam", "angle", "range", "clearance", "closing_speed"):
            np.testing.assert_equal(getattr(nearest, name)[row], getattr(single, name))
            np.testing.assert_equal(getattr(nearest[row], name), getattr(single, name))
        for name in ("valid", "no_return", "beyond_limits", "contact"):
            assert getattr(nearest.counts, name)[row] == getattr(single.counts, name)
        assert each[row].tobytes() == scan.per_beam(ranges[row], *motion).tobytes()
        assert [Status(value) for value in status[row]] == statuses(scan, ranges[row], *motion)


def test_motions_of_a_batch_are_numbers_or_one_each(ttc: Any) -> None:
    scan, ranges = ahead(ttc), np.array([[10.0], [10.0], [10.0]])
    assert scan.min(ranges, 5.0).tolist() == [2.0, 2.0, 2.0]
    assert scan.min(ranges, np.array([5.0, -5.0, 10.0])).tolist() == [2.0, INF, 1.0]
    assert scan.min(ranges, [5.0, -5.0, 10.0]).tolist() == [2.0, INF, 1.0]
    assert scan.min(ranges, np.float32(5.0)).tolist() == [2.0, 2.0, 2.0]
    assert scan.min(ranges, np.array([5, -5, 10])).tolist() == [2.0, INF, 1.0]


def test_a_batch_of_one_is_a_batch_and_of_none_is_empty(ttc: Any) -> None:
    assert ahead(ttc).min(np.array([[10.0]]), 5.0).tolist() == [2.0]
    assert ahead(ttc).min(np.empty((0, 1)), 5.0).shape == (0,)
    assert len(ahead(ttc).nearest(np.empty((0, 1)), 5.0)) == 0
    assert ahead(ttc).per_beam(np.empty((0, 1)), 5.0).shape == (0, 1)


def test_the_types_of_a_batch(ttc: Any) -> None:
    batch = ahead(ttc).nearest(np.array([[10.0], [INF]]), 5.0)
    assert (batch.status.dtype, batch.status.tolist()) == (np.uint8, [Status.CLOSING, Status.CLEAR])
    assert (batch.beam.dtype, batch.beam.tolist()) == (np.int64, [0, -1])
    assert (batch.ttc.dtype, batch.ttc.tolist()) == (np.float64, [2.0, INF])
    assert (batch.counts.valid.dtype, batch.counts.valid.tolist()) == (np.uint32, [1, 0])
    assert batch[-1].status is Status.CLEAR
    with pytest.raises(IndexError):
        batch[2]


def test_one_blind_scan_of_a_batch(ttc: Any) -> None:
    scan, ranges = ahead(ttc), np.array([[10.0], [NAN], [INF]])
    with pytest.raises(NoDataError, match=r"\b1\b"):
        scan.min(ranges, 5.0)
    assert scan.nearest(ranges, 5.0).status.tolist() == [Status.CLOSING, Status.NO_DATA, Status.CLEAR]


# --- messages ------------------------------------------------------------------------------------------------------


def laser_scan(ranges: Any) -> Any:
    """A sensor_msgs/LaserScan, with all its fields."""
    return types.SimpleNamespace(
        header=None,
        angle_min=-math.pi / 2,
        angle_max=math.pi / 2,
        angle_increment=math.pi / 2,
        time_increment=0.0,
        scan_time=0.1,
        range_min=0.5,
        range_max=30.0,
        ranges=ranges,
        intensities=[],
    )


def test_from_a_ros_1_message(ttc: Any) -> None:
    """rospy hands out tuples of floats."""
    msg = laser_scan((4.0, 10.0, 0.1))
    scan = ttc.ScanTTC.from_message(msg)
    assert (scan.beams, scan.angles.tolist()) == (3, [-math.pi / 2, 0.0, math.pi / 2])
    ranges = np.asarray(msg.ranges, np.float32)
    assert scan.min(ranges, 5.0) == 2.0
    assert counted(scan.nearest(ranges, 5.0)) == {"valid": 2, "out_of_range": 1}
    assert scan.min(msg.ranges, 5.0) == 2.0


def test_a_message_that_contradicts_itself(ttc: Any) -> None:
    """Half of its readings are missing, or its increment is in degrees: nobody knows where its beams point."""
    msg = laser_scan(np.full(11, 4.0))
    msg.angle_increment = 0.5
    with pytest.raises(ValueError, match="msg contradicts itself: its 11 readings end at"):
        ttc.ScanTTC.from_message(msg)
    assert ttc.ScanTTC.from_message(msg, angle_increment=math.pi / 10).beams == 11
    twice = laser_scan(np.full(720, 4.0))
    twice.angle_min, twice.angle_max, twice.angle_increment = -math.pi, math.pi, math.pi / 180
    with pytest.raises(ValueError, match="msg contradicts itself: its 720 readings end at"):
        ttc.ScanTTC.from_message(twice)
    twice.angle_max = 3 * math.pi
    assert ttc.ScanTTC.from_message(twice).beams == 720
    for angle_max in (0.0, math.nan, math.pi / 2 - 2 * math.pi):
        msg = laser_scan(np.full(3, 4.0))
        msg.angle_max = angle_max
        assert ttc.ScanTTC.from_message(msg).beams == 3
    msg = laser_scan(np.full(4, 4.0))
    assert ttc.ScanTTC.from_message(msg).beams == 4  # one too many


def test_from_a_ros_2_message(ttc: Any) -> None:
    """rclpy hands out array.array, which is read in place as it is."""
    msg = laser_scan(array.array("f", [4.0, 10.0, 0.1]))
    assert ttc.ScanTTC.from_message(msg).min(msg.ranges, 5.0) == 2.0


def test_settings_beside_a_message(ttc: Any) -> None:
    msg = laser_scan(np.array([4.0, 10.0, 0.1]))
    scan = ttc.ScanTTC.from_message(msg, outline=CAR, range_min=0.05, mask=[False, True, False])
    nearest = scan.nearest(msg.ranges, 0.0, 0.0, 1.0)
    assert (nearest.beam, nearest.status, counted(nearest)) == (
        2,
        Status.CONTACT,
        {"valid": 2, "masked": 1, "contact": 1},
    )
    assert type(scan) is ttc.ScanTTC


# --- the object ----------------------------------------------------------------------------------------------------

FULL = ScanTTC(
    -1.0,
    0.01,
    200,
    range_min=0.06,
    range_max=30.0,
    limits=(0.1, 20.0),
    limits_policy="clamp",
    mount=(0.2, 0.1, 0.3),
    outline=CAR,
    mask=[True, *[False] * 199],
    min_closing_speed=0.05,
    too_close="ignore",
    no_data=7.0,
    minimum=NeighbourSupport(2, 3, 0.4),
)


@pytest.mark.parametrize("again", [copy.copy, copy.deepcopy, lambda scan: pickle.loads(pickle.dumps(scan))])
@pytest.mark.parametrize("scan", [FULL, ScanTTC(0.5, -0.01, 200)], ids=["full", "plain"])
def test_copies_and_pickles_give_the_same_answers(scan: ScanTTC, again: Any) -> None:
    other = again(scan)
    assert repr(other) == repr(scan)
    ranges = np.random.default_rng(1).uniform(0.05, 30.0, 200)
    ranges[:20] = -INF
    for motion in ((5.0,), (-2.0, 0.5, 0.3)):
        assert other.per_beam(ranges, *motion).tobytes() == scan.per_beam(ranges, *motion).tobytes()
        assert repr(other.nearest(ranges, *motion)) == repr(scan.nearest(ranges, *motion))
    if scan is FULL:
        assert other.min(np.full(200, NAN), 5.0) == 7.0


@pytest.mark.parametrize("setting", [KthSmallest(3), NeighbourSupport(2, 3, 0.5)], ids=repr)
def test_minima_are_values(setting: Any) -> None:
    for again in (copy.copy(setting), copy.deepcopy(setting), pickle.loads(pickle.dumps(setting)), eval(repr(setting))):
        assert again == setting
        assert type(again) is type(setting)
    assert setting != KthSmallest(4)
    assert setting != 3


def test_repr_is_the_call_that_makes_one() -> None:
    names = {"ScanTTC": ScanTTC, "NeighbourSupport": NeighbourSupport, "inf": INF}
    scan = ScanTTC(-1.0, 0.01, 200, limits=(0.1, 20.0), outline=CAR, no_data=7.0, minimum=NeighbourSupport(2, 3, 0.4))
    assert repr(eval(repr(scan), names)) == repr(scan)
    assert "outline=(-0.1, 0.4, -0.15, 0.15)" in repr(scan)


def test_repr_of_results_names_every_field() -> None:
    nearest = ahead(ttc_fast).nearest(one(10.0), 5.0)
    for part in ("ttc=2.0", "status=CLOSING", "beam=0", "clearance=10.0", "closing_speed=5.0", "valid=1"):
        assert part in repr(nearest)
    assert "2 scans" in repr(ahead(ttc_fast).nearest(np.full((2, 1), 10.0), 5.0))


def test_nothing_of_it_can_be_changed() -> None:
    nearest = FULL.nearest(np.full(200, 10.0), 5.0)
    for target, name in ((FULL, "beams"), (FULL, "other"), (nearest, "ttc"), (KthSmallest(2), "k")):
        with pytest.raises(AttributeError):
            setattr(target, name, 1)
    angles = FULL.angles
    angles[:] = 0.0
    assert FULL.angles[0] == -1.0


def test_the_signatures_of_the_contract() -> None:
    expected: dict[Any, str] = {
        ttc_fast.ittc: "(ranges, *, closing_speed=None, range_rate=None, min_closing_speed=0.0, "
        "out=None, status_out=None)",
        ScanTTC: "(angle_min, angle_increment, beams, *, range_min=0.0, range_max=inf, limits=None, "
        "limits_policy='horizon', mount=(0.0, 0.0, 0.0), outline=None, mask=None, min_closing_speed=0.01, "
        "too_close='hit', no_data=None, minimum=None, threads=1)",
        FULL.min: "(ranges, speed, yaw_rate=0.0, lateral_speed=0.0)",
        FULL.nearest: "(ranges, speed, yaw_rate=0.0, lateral_speed=0.0)",
        FULL.per_beam: "(ranges, speed, yaw_rate=0.0, lateral_speed=0.0, *, out=None, status_out=None)",
        ScanTTC.from_message: "(msg, **settings)",
    }
    assert {call: str(inspect.signature(call)) for call in expected} == expected
