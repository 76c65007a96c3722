"""What `RangeRate` promises: what comes by itself closes, and edges, noise, turning and bad scans invent nothing."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import ttc_fast
from tests.support.moving_scenes import BEAMS, PERIOD, Disc, World, room, scanner
from ttc_fast import KthSmallest, Status, reference

if TYPE_CHECKING:
    from numpy.typing import NDArray

AHEAD = BEAMS // 2
SLANTED = ((4.0, -8.0), (10.0, 8.0))


def tracker(**settings: Any) -> ttc_fast.RangeRate:
    return ttc_fast.RangeRate(scanner(), **settings)


def answers(world: World, frames: int, rates: ttc_fast.RangeRate | None = None, yaw_rate: float = 0.0) -> list[Any]:
    """What is said of each scan."""
    rates = tracker() if rates is None else rates
    return [rates.update(ranges, stamp, yaw_rate) for ranges, stamp in world.scans(frames)]


def beams_of(world: World, frames: int, yaw_rate: float = 0.0, **settings: Any) -> tuple[NDArray[Any], NDArray[Any]]:
    """Range rate and status of each beam of the last scan."""
    rates, out, status = tracker(**settings), np.empty(BEAMS), np.empty(BEAMS, np.uint8)
    for ranges, stamp in world.scans(frames, np.float64):
        rates.update(ranges, stamp, yaw_rate, range_rate_out=out, status_out=status)
    return out, status


# What closes.


def test_an_obstacle_that_comes_by_itself_closes() -> None:
    """A standing car: its own speed says that nothing closes."""
    world = World(room(9.0), (Disc((6.0, 0.0), 0.4, (-1.5, 0.0)),), noise=0.01)
    for frame, said in enumerate(answers(world, 30)):
        distance = 5.6 - 1.5 * PERIOD * frame
        if frame < 3:
            assert said.status == Status.WARMING_UP
        else:
            assert said.status == Status.CLOSING
            # The fastest of many noisy beams; and those beside the middle of something round slide towards it.
            assert 1.35 < said.closing_speed < 2.0
            assert 0.75 < said.ttc / (distance / 1.5) < 1.1
    assert scanner().min(world.ranges(2.0), 0.0) == math.inf


def test_an_obstacle_that_comes_while_driving_closes_faster_than_odometry_says() -> None:
    world = World(room(20.0), (Disc((12.0, 0.0), 0.4, (-2.0, 0.0)),), speed=2.0, noise=0.01)
    said = answers(world, 11)[-1]
    truth = (12.0 - 0.4 - 4.0) / 4.0
    assert said.ttc == pytest.approx(truth, rel=0.05)
    assert scanner().min(world.ranges(1.0), 2.0) == pytest.approx(2 * truth, rel=0.05)


@pytest.mark.parametrize("dropouts", [0.0, 0.2])
def test_without_odometry_a_wall_ahead_is_as_far_in_time_as_with_it(dropouts: float) -> None:
    world = World((((8.0, -3.0), (8.0, 3.0)),), speed=2.0, noise=0.01, dropouts=dropouts)
    said = answers(world, 20)[-1]
    assert said.status == Status.CLOSING
    assert said.ttc == pytest.approx((8.0 - 2.0 * 1.9) / 2.0, rel=0.06)


def test_a_wall_is_reached_when_its_plane_is_whatever_the_beam() -> None:
    """The crossing of beam and wall moves along the wall: range / closing speed is the time to the plane."""
    world = World((SLANTED,), speed=1.0)
    rate, status = beams_of(world, 6)
    time = 0.5
    seen = status == Status.CLOSING
    assert np.count_nonzero(seen) > 100
    across = (8.0 - -8.0, -(10.0 - 4.0))
    unit = np.array(across) / math.hypot(*across)
    plane = (np.array(SLANTED[0]) - [time, 0.0]) @ unit
    ttc = world.ranges(time)[seen] / -rate[seen]
    np.testing.assert_allclose(ttc, plane / (unit[0] * 1.0), rtol=0.06)
    by_odometry = scanner().per_beam(world.ranges(time), 1.0)[seen]
    assert np.ptp(by_odometry) > 5 * np.ptp(ttc)


def test_a_wall_that_is_driven_along_does_not_close() -> None:
    """`ScanTTC` sees it closing: its own formula is about points, not about planes."""
    world = World((((-20.0, 0.6), (20.0, 0.6)), ((-20.0, -0.6), (20.0, -0.6))), speed=3.0, noise=0.005)
    assert all(said.ttc > 5.0 for said in answers(world, 40))
    assert scanner().min(world.ranges(2.0), 3.0) < 0.5


def test_what_crosses_and_does_not_come_closer_is_no_alarm() -> None:
    world = World(room(9.0), (Disc((3.0, -4.0), 0.5, (0.0, 2.0)),), noise=0.01)
    assert min(said.ttc for said in answers(world, 40)) > 1.5


# What must not close.


def test_noise_alone_never_alarms() -> None:
    world = World(room(2.0), (Disc((0.8, 0.2), 0.3),), noise=0.01)
    said = answers(world, 1000)
    assert min(each.ttc for each in said) > 1.5
    assert min(each.rated for each in said[6:]) > 0.9 * BEAMS
    plain = answers(world, 300, tracker(minimum=KthSmallest(1)))
    assert min(each.ttc for each in plain) > 1.5


@pytest.mark.parametrize("step", [0.02, 0.1, 0.5, 3.0])
@pytest.mark.parametrize("every", [1, 2, 5, 6, 7])
def test_a_beam_that_jumps_from_far_to_near_does_not_close(step: float, every: int) -> None:
    """All beams at once, as when a door opens, at once or on and off: the vote does not help."""
    rates = tracker(minimum=KthSmallest(1))
    rng = np.random.default_rng(3)
    for frame in range(40):
        near = (frame >= 12) if every == 1 else frame // every % 2 == 1
        ranges = np.full(BEAMS, 2.0 - step * near) + rng.normal(0, 0.005, BEAMS)
        assert rates.update(ranges, PERIOD * frame).ttc > 1.5, frame


def test_edges_that_flicker_do_not_close() -> None:
    """At its edge a box is seen in one scan and missed in the next."""
    rng = np.random.default_rng(4)
    rates = tracker()
    for frame in range(300):
        ranges = np.full(BEAMS, 4.0)
        ranges[200 + rng.integers(0, 6) : 300 + rng.integers(0, 6)] = rng.choice([1.0, 1.0, 2.5])
        assert rates.update(ranges + rng.normal(0, 0.01, BEAMS), PERIOD * frame).ttc > 1.5


def test_turning_is_no_motion_when_the_yaw_rate_is_known() -> None:
    world = World(room(2.5), yaw_rate=0.8, noise=0.005)
    known = answers(world, 60, yaw_rate=0.8)
    assert min(said.ttc for said in known) > 4.0
    assert min(said.rated for said in known[6:]) > 0.6 * BEAMS
    assert min(said.ttc for said in answers(world, 60)) < 1.5  # else there was nothing to compensate for


def test_turning_the_other_way_round_on_a_scanner_that_runs_clockwise() -> None:
    world = World(room(2.5), yaw_rate=0.8)
    clockwise = ttc_fast.ScanTTC(-world.angles[0], -(world.angles[1] - world.angles[0]), BEAMS, range_max=30.0)
    rates = ttc_fast.RangeRate(clockwise)
    for ranges, stamp in world.scans(20):
        assert rates.update(ranges[::-1], stamp, 0.8).ttc > 4.0


@pytest.mark.parametrize(("speed", "rated"), [(4.0, True), (6.0, False)])
def test_what_is_faster_than_anything_can_be_has_no_rate(speed: float, rated: bool) -> None:
    world = World((((20.0, -9.0), (20.0, 9.0)),), speed=speed)
    rate, _ = beams_of(world, 6, max_speed=5.0, noise=0.001)
    assert math.isnan(rate[AHEAD]) != rated


@pytest.mark.parametrize(("noise", "rated"), [(0.01, True), (0.1, False)])
def test_readings_that_lie_on_no_line_have_no_rate(noise: float, rated: bool) -> None:
    """However far the gate lets them jump."""
    rate, _ = beams_of(World(room(4.0), noise=noise), 30, window=2.0, max_acceleration=1e3)
    assert (np.count_nonzero(~np.isnan(rate)) > BEAMS / 2) == rated


# How well it is known.


def test_the_standard_error_is_the_spread_of_the_rates() -> None:
    world = World(room(4.0), noise=0.02, seed=9)
    rates, rate, error = tracker(noise=0.02), np.empty(BEAMS), np.empty(BEAMS)
    errors, spread = [], []
    for frame, (ranges, stamp) in enumerate(world.scans(200, np.float64)):
        rates.update(ranges, stamp, range_rate_out=rate, standard_error_out=error)
        if frame > 6:
            errors.append(np.nanmean(error))
            spread.append(np.nanstd(rate))
    assert np.mean(errors) == pytest.approx(np.mean(spread), rel=0.25)
    assert np.mean(errors) >= np.mean(spread)


def test_what_is_not_significant_does_not_close() -> None:
    world = World((((3.0, -5.0), (3.0, 5.0)),), speed=0.2)
    _, status = beams_of(world, 6, noise=0.01)
    assert status[AHEAD] == Status.CLOSING
    _, status = beams_of(world, 6, noise=0.1)
    assert status[AHEAD] == Status.NOT_CLOSING


# What is not known.


def test_a_new_surface_has_no_rate_before_enough_scans() -> None:
    rates, rate, status = tracker(), np.empty(BEAMS), np.empty(BEAMS, np.uint8)
    for frame in range(12):
        ranges = np.full(BEAMS, 5.0 + 1e-6 * frame)  # the same scan again would be no measurement
        if frame >= 6:
            ranges[AHEAD - 20 : AHEAD + 20] = 1.5
        said = rates.update(ranges, PERIOD * frame, range_rate_out=rate, status_out=status)
        expected = Status.WARMING_UP if frame < 3 or 6 <= frame < 9 else Status.NOT_CLOSING
        assert status[AHEAD] == expected, frame
        assert math.isnan(rate[AHEAD]) == (expected is Status.WARMING_UP)
        if 6 <= frame < 9:
            assert (said.status, said.rated, said.unrated) == (Status.NOT_CLOSING, BEAMS - 40, 40)
            assert said.nearest_unrated == 1.5
            each = np.empty(BEAMS, np.uint8)
            ttc = ttc_fast.ittc(ranges, range_rate=rate, status_out=each)
            assert (ttc[AHEAD], each[AHEAD]) == (math.inf, Status.INVALID)
    assert (said.unrated, said.nearest_unrated) == (0, math.inf)


@pytest.mark.parametrize("elapsed", [0.0, -0.1, -1e9])
def test_a_repeated_or_reordered_scan_changes_nothing(elapsed: float) -> None:
    world = World((((8.0, -3.0), (8.0, 3.0)),), speed=2.0)
    disturbed, plain = tracker(), tracker()
    for ranges, stamp in world.scans(8):
        expected = plain.update(ranges, stamp)
        assert disturbed.update(ranges, stamp).ttc == expected.ttc
        rate, status = np.zeros(BEAMS, np.float32), np.zeros(BEAMS, np.uint8)
        said = disturbed.update(ranges * 0.5, stamp + elapsed, range_rate_out=rate, status_out=status)
        assert (said.ttc, said.status, said.beam) == (math.inf, Status.INVALID, -1)
        assert np.isnan(rate).all()
        assert (status == Status.INVALID).all()


def test_after_a_long_gap_everything_starts_anew() -> None:
    rates = tracker()
    stamps = [0.0, 0.1, 0.2, 0.3, 0.4, 0.95, 1.05, 1.15, 1.25]
    said = [rates.update(np.full(BEAMS, 9.0 - stamp), stamp).status for stamp in stamps]
    warming = [Status.WARMING_UP] * 2
    assert said == [*[Status.WARMING_UP] * 3, *[Status.CLOSING] * 2, Status.STALE, *warming, Status.CLOSING]


def test_a_blind_scanner_is_not_free_space() -> None:
    rates = tracker()
    for reading, expected in [(np.nan, Status.NO_DATA), (0.01, Status.NO_DATA), (np.inf, Status.CLEAR)]:
        for frame in range(6):
            said = rates.update(np.full(BEAMS, reading), PERIOD * frame)
            assert (said.ttc, said.status) == (math.inf, expected)
        rates.reset()


def test_what_is_too_close_to_measure_has_no_rate() -> None:
    rates, status = tracker(), np.empty(BEAMS, np.uint8)
    for frame in range(6):
        ranges = np.full(BEAMS, 5.0)
        ranges[AHEAD] = -np.inf
        said = rates.update(ranges, PERIOD * frame, status_out=status)
    assert (said.status, said.unrated, said.nearest_unrated) == (Status.NOT_CLOSING, 1, 0.05)
    assert status[AHEAD] == Status.WARMING_UP


def test_clearance_is_from_the_outline_and_masked_beams_do_not_count() -> None:
    mask = np.zeros(BEAMS, np.bool_)
    mask[: AHEAD - 20] = True
    scan = scanner(outline=(-0.5, 1.0, -0.4, 0.4), mask=mask)
    rates, status = ttc_fast.RangeRate(scan), np.empty(BEAMS, np.uint8)
    for ranges, stamp in World((((6.0, -9.0), (6.0, 9.0)),), speed=2.0).scans(6):
        said = rates.update(ranges, stamp, status_out=status)
    assert said.ttc == pytest.approx((6.0 - 1.0 - 1.0) / 2.0, rel=0.02)
    assert said.beam >= AHEAD - 20
    assert said.counts.masked == AHEAD - 20
    assert (status[mask] == Status.NO_DATA).all()


def test_contact_is_said_beside_what_else_closes() -> None:
    rates = ttc_fast.RangeRate(scanner(outline=(-0.5, 1.0, -0.4, 0.4)))
    status = np.empty(BEAMS, np.uint8)
    for frame in range(6):
        ranges = np.full(BEAMS, 6.0 - 0.2 * frame)
        ranges[5:9] = 0.3
        said = rates.update(ranges, PERIOD * frame, status_out=status)
    assert said.status == Status.CONTACT
    assert 1.5 < said.ttc < 2.6
    assert said.counts.contact == 4
    assert (status[5:9] == Status.CONTACT).all()


def test_large_stamps_lose_nothing() -> None:
    world = World((((8.0, -3.0), (8.0, 3.0)),), speed=2.0, noise=0.01)
    early, late = (
        [said.ttc for said in answers(replace(world, start_stamp=start), 20, tracker(window=0.46))]
        for start in (0.0, 1.7e9)
    )
    np.testing.assert_allclose(late, early, rtol=1e-5)


def test_distances_and_times_in_other_units_scale() -> None:
    """Twice as long and twice as slow, by powers of two: exactly."""
    world = World((((8.0, -3.0), (8.0, 3.0)),), speed=2.0, noise=0.01, start_stamp=0.0)
    plain = tracker(window=0.46)
    scaled = ttc_fast.RangeRate(
        ttc_fast.ScanTTC(0.0, 0.01, BEAMS, range_min=0.1, range_max=60.0, min_closing_speed=0.005),
        window=0.46 * 4,
        noise=0.02,
        max_speed=10.0,
        max_acceleration=0.625,
        minimum=ttc_fast.NeighbourSupport(6, 4, 0.4),
    )
    for ranges, stamp in world.scans(12, np.float64):
        assert scaled.update(2 * ranges, 4 * stamp).ttc == 4 * plain.update(ranges, stamp).ttc


def test_a_saved_state_that_is_none_is_refused() -> None:
    stamps, headings, readings = [0.0, 0.1], [0.0, 0.0], [[1.0] * BEAMS] * 2
    state = tracker().state() | {"stamps": stamps, "headings": headings, "readings": readings}
    tracker().restore(state)
    spoils: list[dict[str, Any]] = [
        {"stamps": stamps[::-1]},
        {"headings": headings[:1]},
        {"readings": [[1.0] * (BEAMS - 1)] * 2},
        {"headings": [0.0, math.nan]},
    ]
    for spoilt in spoils:
        with pytest.raises(ValueError, match="state must be that of a RangeRate"):
            tracker().restore(state | spoilt)


# Bad arguments, of the kernel and the reference.


def pair(**settings: Any) -> list[Any]:
    return [module.RangeRate(module.ScanTTC(0.0, 0.1, 4), **settings) for module in (ttc_fast, reference)]


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("window", 0.0),
        ("window", 61.0),
        ("window", math.nan),
        ("min_scans", 2),
        ("min_scans", -1),
        ("min_scans", 65),
        ("noise", 0.0),
        ("max_speed", math.inf),
        ("max_acceleration", -1.0),
        ("gate", 0.0),
        ("significance", math.nan),
        ("edge", -0.1),
    ],
)
def test_settings_that_make_no_sense(argument: str, value: Any) -> None:
    for module in (ttc_fast, reference):
        with pytest.raises(ValueError, match=argument):
            module.RangeRate(module.ScanTTC(0.0, 0.1, 4), **{argument: value})


@pytest.mark.parametrize(
    ("arguments", "error", "match"),
    [
        ((np.ones(5), 0.0), ValueError, "ranges"),
        ((np.ones((2, 4)), 0.0), ValueError, "ranges must be one scan"),
        ((np.ones(4, np.int32), 0.0), TypeError, "ranges"),
        ((["1", "1", "1", "1"], 0.0), TypeError, "ranges"),
        ((np.ones(4), math.nan), ValueError, "stamp"),
        ((np.ones(4), "now"), TypeError, "stamp"),
        ((np.ones(4), 0.0, math.inf), ValueError, "yaw_rate"),
        ((np.ones(4), 0.0, 1e9), ValueError, "yaw_rate"),
    ],
)
def test_scans_that_make_no_sense(arguments: tuple[Any, ...], error: type[Exception], match: str) -> None:
    for rates in pair():
        with pytest.raises(error, match=match):
            rates.update(*arguments)
        assert rates.update(np.ones(4), -5.0).status == Status.WARMING_UP  # it was not taken


def test_outputs_that_cannot_be_written_to() -> None:
    shared = np.ones(8, np.float32)
    cases: list[tuple[dict[str, Any], type[Exception]]] = [
        ({"range_rate_out": np.empty(4)}, TypeError),
        ({"range_rate_out": np.empty(5, np.float32)}, ValueError),
        ({"range_rate_out": shared[:4]}, ValueError),
        ({"standard_error_out": shared[2:6]}, ValueError),
        ({"range_rate_out": shared[4:], "standard_error_out": shared[4:]}, ValueError),
        ({"status_out": np.empty(4, np.int8)}, TypeError),
    ]
    for rates in pair():
        for arguments, error in cases:
            with pytest.raises(error, match="_out"):
                rates.update(shared[:4], 0.0, **arguments)


def test_the_scanner_must_be_one() -> None:
    for module in (ttc_fast, reference):
        with pytest.raises(TypeError):
            module.RangeRate(BEAMS)
        scan = module.ScanTTC(0.0, 0.1, 4)
        assert module.RangeRate(scan).scan is scan
