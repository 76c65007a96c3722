"""Recorded keypoints: the lesson's matches, those of three detectors over twenty frames, and published times."""

from __future__ import annotations

import csv
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import ttc_fast
from evaluation import recorded
from evaluation.camera import (
    SIMULATED,
    Answer,
    drive,
    estimated,
    estimators,
    inside,
    recorded_answers,
    simulated_answers,
)
from tests.support.common import both_dtypes
from ttc_fast import (
    Consensus,
    LeastSquares,
    MedianRatio,
    Status,
    TrimmedMeanRatio,
    reference,
    ttc_from_keypoints,
    ttc_from_scale,
)
from ttc_fast.compat.udacity_camera import compute_ttc_camera, ordered_ratios

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

pytestmark = pytest.mark.slow

ESTIMATORS: list[Any] = [MedianRatio(), TrimmedMeanRatio(0.25), LeastSquares(), Consensus()]


def lesson(data: Path, name: str) -> tuple[NDArray[Any], NDArray[Any]]:
    table = np.loadtxt(data / f"kitti/lesson/matches_0000_0001_{name}.csv", delimiter=",", skiprows=1)
    return table[:, :2], table[:, 2:4]


def test_the_lesson_with_good_matches(data: Path) -> None:
    previous, current = lesson(data, "AKAZE")
    seen = ttc_from_keypoints(previous, current, 0.1, estimator=MedianRatio())
    assert (seen.matches, seen.status) == (95, Status.CLOSING)
    assert seen.ttc == pytest.approx(12.45, abs=0.01)
    assert compute_ttc_camera(previous, current, 10.0) == pytest.approx(12.4576, abs=1e-4)
    for estimator in ESTIMATORS:
        assert 11.5 < ttc_from_keypoints(previous, current, 0.1, estimator=estimator).ttc < 13.5


def test_the_lesson_with_gross_mismatches(data: Path) -> None:
    """The mean of all ratios gives 0.63 s, where 13 to 15 s are true; nothing that outvotes them is fooled."""
    previous, current = lesson(data, "SHI-BRISK")
    mean = ttc_from_keypoints(previous, current, 0.1, estimator=TrimmedMeanRatio(0.0))
    assert mean.ttc == pytest.approx(0.63, abs=0.005)
    assert compute_ttc_camera(previous, current, 10.0) == pytest.approx(14.9113, abs=1e-4)
    assert 0.1 / (ordered_ratios(previous, current).mean() - 1) == pytest.approx(0.642, abs=1e-3)
    assert ttc_from_keypoints(previous, current, 0.1, estimator=MedianRatio()).ttc == pytest.approx(15.0, abs=0.05)
    seen = ttc_from_keypoints(previous, current, 0.1)
    assert 12.0 < seen.ttc < 16.0
    assert seen.support < seen.matches == 88


@pytest.mark.parametrize("name", ["AKAZE", "SHI-BRISK"])
@both_dtypes
@pytest.mark.parametrize("estimator", ESTIMATORS, ids=repr)
def test_the_lesson_by_the_reference(data: Path, name: str, dtype: Any, estimator: Any) -> None:
    previous, current = (array.astype(dtype) for array in lesson(data, name))
    found, specified = (
        module.ttc_from_keypoints(previous, current, 0.1, estimator=estimator) for module in (ttc_fast, reference)
    )
    assert (found.pairs, found.support, found.status) == (specified.pairs, specified.support, specified.status)
    rel = 0.0 if isinstance(estimator, MedianRatio) else 1e-12
    assert found.scale == pytest.approx(specified.scale, rel=rel, abs=0.0)


@pytest.fixture(scope="module")
def errors(data: Path) -> dict[str, dict[str, list[float]]]:
    """What the table in the documentation is made of: relative errors, by estimator and detector."""
    return {name: estimated(data, estimator).errors for name, estimator in estimators().items()}


@pytest.mark.parametrize("name", ["Consensus()", *(f"Consensus(seed={seed})" for seed in range(1, 6))])
def test_the_default_beside_the_plain_median(errors: dict[str, dict[str, list[float]]], name: str) -> None:
    """With background and mismatches left in: no worse where positions are fine, much better where they are rounded."""
    limits = {"AKAZE": 1.0, "SIFT": 1.0, "ORB": 0.6}
    for detector, limit in limits.items():
        found, plain = errors[name][detector], errors["MedianRatio()"][detector]
        assert len(found) == len(plain) == 19
        assert np.median(found) <= limit * np.median(plain), detector
    assert [round(float(np.median(errors["MedianRatio()"][each])), 3) for each in limits] == [0.090, 0.089, 0.441]


@pytest.mark.parametrize(("detector", "half"), [("SIFT", 0.22), ("AKAZE", 0.22), ("ORB", 0.8)])
def test_the_truth_is_in_the_interval(data: Path, detector: str, half: float) -> None:
    """What the documentation says: at least 13 of 14 pairs, by an interval that is not so wide as to say nothing."""
    answers = recorded_answers(data, detector)
    assert len(answers) == 14
    assert sum(inside(answers)) >= 13
    assert np.median([1.645 * each.seen.spread * each.ttc / 0.1 for each in answers]) < half


@pytest.mark.parametrize("detector", ["SIFT", "AKAZE"])
def test_a_tracker_of_scales_on_the_recorded_drive(data: Path, detector: str) -> None:
    """What the documentation says: half of the times are right to 4.5 %, and nearly all truths are in the interval."""
    error, held = recorded_errors(drive(data, detector))
    assert error < 0.045
    assert held >= 12
    both, alone = (recorded_errors(drive(data, each, lidar=True)) for each in (detector, None))
    assert both[0] < alone[0]


def recorded_errors(seen: list[ttc_fast.TrackedTTC]) -> tuple[float, int]:
    """Return the median error of the TTC, and the number of frames with the truth inside."""
    answers = [Answer(each, truth.ttc) for each, truth in zip(seen, recorded.truths(), strict=True)]
    answers = [each for each in answers if not math.isnan(each.ttc)]
    return float(np.median([abs(each.seen.ttc / each.ttc - 1.0) for each in answers])), sum(inside(answers))


@pytest.mark.parametrize("kind", SIMULATED)
def test_the_truth_is_in_the_interval_of_simulated_cars(kind: str) -> None:
    assert 0.80 <= np.mean(inside(simulated_answers(kind))) <= 0.97


def test_published_times(data: Path) -> None:
    """Of 3,309 published times hundreds are negative or infinite; ours of the same scale is none or the same."""
    with open(data / "kitti/published/ttc_camera.csv") as table:
        times = [float(row["ttc_s"]) for row in csv.DictReader(table) if row["ttc_s"] not in ("", "nan")]
    assert sum(time < 0 for time in times) > 300
    for time in times:
        if math.isinf(time) or abs(time) < 1e-9 or 1 + 0.1 / time <= 0:
            continue
        ttc = ttc_from_scale(1 + 0.1 / time, 0.1)
        assert ttc == (pytest.approx(time, rel=1e-6) if time > 0 else math.inf)
