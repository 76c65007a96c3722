"""The F1TENTH gym's collision check: bit for bit what the simulator says, and beside it what is right."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import ttc_fast
from ttc_fast.compat.f1tenth_gym import BeamTables, beam_tables, check_ttc_jit

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    Scan = NDArray[np.floating[Any]]

FOV = 4.7
WIDTH, LENGTH, WHEELBASE = 0.31, 0.58, 0.15875 + 0.17145
EVER = math.inf
"""A threshold that any finite time is below."""


def naive_side(angle: float) -> float:
    """From the centre to a box of half the wheelbase and half the width, one beam at a time."""
    turn = angle if angle > 0.0 else -angle
    if turn < np.pi / 2:
        across, along = np.sin(turn), np.cos(turn)
    else:
        across, along = np.cos(turn - np.pi / 2), np.sin(turn - np.pi / 2)
    with np.errstate(divide="ignore"):
        return float(min(WIDTH / 2 / across, WHEELBASE / 2 / along))


def naive_check(scan: Scan, vel: float, tables: BeamTables, threshold: float) -> bool:
    """The rule, one beam at a time."""
    if vel == 0.0:
        return False
    beams = zip(scan.tolist(), tables.cosines.tolist(), tables.side_distances.tolist(), strict=True)
    for reading, cosine, side in beams:
        ttc = (reading - side) / (vel * cosine)
        if 0.0 <= ttc < threshold:
            return True
    return False


def scan_ttc(beams: int, **settings: Any) -> ttc_fast.ScanTTC:
    """The same car and sensor, for the right answer."""
    outline = (-LENGTH / 2, LENGTH / 2, -WIDTH / 2, WIDTH / 2)
    return ttc_fast.ScanTTC(-FOV / 2, FOV / (beams - 1), beams, outline=outline, **settings)


def only(beams: int, beam: int, reading: float) -> Scan:
    """One reading, and free space around it."""
    scan = np.full(beams, np.inf)
    scan[beam] = reading
    return scan


def ahead(beams: int) -> int:
    """Index of the beam that looks ahead, or just right of it."""
    return (beams - 1) // 2


@pytest.mark.parametrize("beams", [2, 3, 271, 360, 1080, 1081])
@pytest.mark.parametrize("fov", [1.0, np.pi, FOV, 2 * np.pi])
def test_tables_are_the_simulators_to_the_bit(beams: int, fov: float) -> None:
    tables = beam_tables(beams, fov)
    angles = [-fov / 2.0 + beam * (fov / (beams - 1)) for beam in range(beams)]
    assert tables.scan_angles.tobytes() == np.array(angles).tobytes()
    assert tables.cosines.tobytes() == np.array([np.cos(angle) for angle in angles]).tobytes()
    assert tables.side_distances.tobytes() == np.array([naive_side(angle) for angle in angles]).tobytes()


@pytest.mark.parametrize("track", ["vegas", "berlin", "skirk"])
@pytest.mark.parametrize("vel", [0.3, 5.0, -5.0, 20.0])
def test_simulated_scans_around_the_deciding_threshold(data: Path, track: str, vel: float) -> None:
    tables = beam_tables()
    with np.load(data / "sim" / "legacy_scan.npz") as scans:
        for scan in scans[track]:
            ttc = (scan - tables.side_distances) / (vel * tables.cosines)
            least = ttc[ttc >= 0.0].min()
            for threshold in (0.005, least, np.nextafter(least, np.inf), 1.0, EVER):
                expected = naive_check(scan, vel, tables, threshold)
                assert check_ttc_jit(scan, vel, *tables, threshold) is expected
            assert not check_ttc_jit(scan, vel, *tables, least)
            assert check_ttc_jit(scan, vel, *tables, np.nextafter(least, np.inf))


@pytest.mark.parametrize("threshold", [0.3, 0.5, 1.0])
def test_every_scan_of_a_recorded_drive(data: Path, threshold: float) -> None:
    with np.load(data / "laserscan" / "breezyslam_exp1.npz") as log:
        scans, speeds, increment = log["ranges"], log["v"].astype(np.float64), float(log["angle_increment"])
    beams = scans.shape[1]
    tables = beam_tables(beams, increment * (beams - 1))
    answers = [check_ttc_jit(scan, speed, *tables, threshold) for scan, speed in zip(scans, speeds, strict=True)]
    expected = [naive_check(scan, speed, tables, threshold) for scan, speed in zip(scans, speeds, strict=True)]
    assert answers == expected
    assert set(answers) == {True, False}


def test_error_codes_of_a_recorded_drive_brake_the_simulator_only(data: Path) -> None:
    with np.load(data / "laserscan" / "breezyslam_exp1.npz") as log:
        moving = log["v"] > 0.1
        scans, speeds, increment = log["ranges"][moving], log["v"][moving], float(log["angle_increment"])
    beams = scans.shape[1]
    tables = beam_tables(beams, increment * (beams - 1))
    right = ttc_fast.ScanTTC(float(tables.scan_angles[0]), increment, beams, range_min=0.06, range_max=5.6)
    simulator = [check_ttc_jit(scan, speed, *tables, 0.5) for scan, speed in zip(scans, speeds, strict=True)]
    assert np.mean(simulator) > 0.4
    assert not np.any(right.min(scans, speeds) < 0.5)


def test_quirk_half_the_wheelbase_hides_the_bumper() -> None:
    tables = beam_tables(1080)
    from_bumper = 0.05
    with np.errstate(divide="ignore"):
        wall = np.where(tables.cosines > 0, (LENGTH / 2 + from_bumper) / tables.cosines, np.inf)
    seen = from_bumper + (LENGTH - WHEELBASE) / 2
    assert not check_ttc_jit(wall, 1.0, *tables, 0.99 * seen)
    assert check_ttc_jit(wall, 1.0, *tables, 1.01 * seen)
    assert scan_ttc(1080).min(wall, 1.0) == pytest.approx(from_bumper, rel=1e-3)


def test_quirk_straight_ahead_never_hits() -> None:
    beams = 1081
    tables = beam_tables(beams)
    assert tables.scan_angles[ahead(beams)] == 0.0
    assert tables.side_distances[ahead(beams)] == -np.inf
    post = only(beams, ahead(beams), 1.0)
    assert not check_ttc_jit(post, 5.0, *tables, EVER)
    assert scan_ttc(beams).min(post, 5.0) == pytest.approx((1.0 - LENGTH / 2) / 5.0)


def test_quirk_inside_the_body_and_closing_is_no_hit() -> None:
    touching = only(1080, ahead(1080), 0.1)
    assert not check_ttc_jit(touching, 5.0, *beam_tables(), EVER)
    nearest = scan_ttc(1080).nearest(touching, 5.0)
    assert (nearest.ttc, nearest.status) == (0.0, ttc_fast.Status.CONTACT)


@pytest.mark.parametrize("inside", [0.02, 0.0])
def test_quirk_inside_or_on_the_body_and_opening_hits(inside: float) -> None:
    tables = beam_tables()
    touching = only(1080, ahead(1080), tables.side_distances[ahead(1080)] - inside)
    assert check_ttc_jit(touching, -5.0, *tables, 0.005)
    nearest = scan_ttc(1080).nearest(touching, -5.0)
    assert (nearest.ttc, nearest.status) == (np.inf, ttc_fast.Status.CONTACT)


def test_quirk_a_blind_sensor_reads_as_safe() -> None:
    blind = np.full(1080, np.nan)
    assert not check_ttc_jit(blind, 5.0, *beam_tables(), EVER)
    with pytest.raises(ttc_fast.NoDataError):
        scan_ttc(1080).min(blind, 5.0)


@pytest.mark.parametrize("vel", [5.0, -5.0])
def test_quirk_an_object_too_near_to_measure_is_no_hit(vel: float) -> None:
    too_near = np.full(1080, -np.inf)
    assert not check_ttc_jit(too_near, vel, *beam_tables(), EVER)
    assert scan_ttc(1080, range_min=0.06).min(too_near, vel) == 0.0


def test_infinity_is_no_hit_here_as_there() -> None:
    free = np.full(1080, np.inf)
    assert not check_ttc_jit(free, 5.0, *beam_tables(), EVER)
    assert scan_ttc(1080).min(free, 5.0) == np.inf


def test_quirk_only_a_speed_of_exactly_zero_is_rest() -> None:
    tables = beam_tables()
    on_the_body = only(1080, ahead(1080), tables.side_distances[ahead(1080)])
    assert not check_ttc_jit(on_the_body, 0.0, *tables, EVER)
    assert not check_ttc_jit(on_the_body, -0.0, *tables, EVER)
    assert check_ttc_jit(on_the_body, 1e-300, *tables, 0.005)
    assert scan_ttc(1080).min(on_the_body, 1e-300) == np.inf


@pytest.mark.parametrize(("vel", "hit"), [(np.nan, False), (5e-324, False), (np.inf, True), (-np.inf, True)])
def test_speeds_without_sense_are_quiet(vel: float, hit: bool) -> None:
    # The smallest speed times a cosine is 0 for most beams, and so is a distance over an infinite speed.
    scan = only(1080, ahead(1080) // 2, 1.0)
    assert check_ttc_jit(scan, vel, *beam_tables(), 0.005) is hit


def test_lists_are_welcome_and_lengths_must_agree() -> None:
    tables = beam_tables(3)
    assert check_ttc_jit([9.0, 9.0, 9.0], -5.0, *tables, 100.0) is True
    with pytest.raises(ValueError, match=r"one length, got shapes \(2,\), \(3,\) and \(3,\)"):
        check_ttc_jit([9.0, 9.0], 5.0, *tables, 1.0)
    with pytest.raises(ValueError, match="at least 2, got 1"):
        beam_tables(1)
