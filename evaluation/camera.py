"""How near the truth each camera estimator comes on recorded matches: ``python -m evaluation.camera``."""

from __future__ import annotations

import argparse
import csv
import gzip
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from evaluation.recorded import DATA
from evaluation.report import Report, console, write_into
from ttc_fast import Consensus, LeastSquares, MedianRatio, TrimmedMeanRatio, ttc_from_keypoints

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Matches = tuple[NDArray[np.float64], NDArray[np.float64]]

DT = 0.1
"""The time between two frames of the recordings, s."""
DETECTORS = ("AKAZE", "SIFT", "ORB")
LESSONS = ("AKAZE", "SHI-BRISK")
SEEDS = range(1, 6)
PLAIN = "MedianRatio()"
DEFAULT = "Consensus()"
LEGEND = (
    "Frames 0 to 19 of KITTI drive 2011_09_26_0011: OpenCV's matches of each pair in the region of the car ahead, "
    "background and mismatches left in. Error: |TTC - reference| / reference, the reference being a smooth fit to the "
    "lidar's distances; median and 90 % quantile over the 19 pairs, in brackets how many times the plain median's. The "
    "time is infinite where nothing seems to come closer. Last: TTC, s, of the course's own matches of frames 0 and 1, "
    "where the references nearby are 13.5 to 15."
)


class Estimate(NamedTuple):
    """The answers of one estimator to the recordings."""

    errors: dict[str, list[float]]
    """The relative errors of the TTC, by detector."""
    lesson: dict[str, float]
    """The TTC of the lesson, s, by the name of the matches."""


def main(argv: Sequence[str] | None = None) -> None:
    """Ask every estimator about every pair, and print the table."""
    arguments = _parser().parse_args(argv)
    found = {name: estimated(arguments.data, estimator) for name, estimator in estimators().items()}
    table = report(found)
    console().print(table.rich())
    if arguments.markdown:
        write_into(arguments.markdown, "python -m evaluation.camera", table.markdown())


def estimators() -> dict[str, Any]:
    """Return every estimator by name; the default is there once as users have it, and once for each seed."""
    every = [MedianRatio(), TrimmedMeanRatio(0.0), TrimmedMeanRatio(0.1), TrimmedMeanRatio(0.25), LeastSquares()]
    seeded = {f"Consensus(seed={seed})": Consensus(seed=seed) for seed in SEEDS}
    return {str(estimator): estimator for estimator in every} | {DEFAULT: None} | seeded


def estimated(data: Path, estimator: Any) -> Estimate:
    """Ask an estimator about all recordings; None is the default."""
    truth = _references(data)
    errors: dict[str, list[float]] = {detector: [] for detector in DETECTORS}
    for (detector, frame), (previous, current) in _recorded(data).items():
        ttc = ttc_from_keypoints(previous, current, DT, estimator=estimator).ttc
        errors[detector].append(abs(ttc - truth[frame]) / truth[frame])
    lesson = {name: ttc_from_keypoints(*_lesson(data, name), DT, estimator=estimator).ttc for name in LESSONS}
    return Estimate(errors, lesson)


def report(found: dict[str, Estimate]) -> Report:
    """Make the table, with one row for the other seeds: the worst of them for each number."""
    plain = {detector: float(np.median(errors)) for detector, errors in found[PLAIN].errors.items()}
    rows = []
    for name, each in found.items():
        if name.startswith("Consensus(seed="):
            continue
        rows.append([name, *_cells(each, plain), *(f"{ttc:.2f}" for ttc in each.lesson.values())])
    others = [found[f"Consensus(seed={seed})"] for seed in SEEDS]
    cells = []
    for detector in DETECTORS:
        worst = max(float(np.median(other.errors[detector])) for other in others)
        cells += [f"{worst:.3f} ({worst / plain[detector]:.2f})", ""]
    rows.append([f"worst of seeds {SEEDS[0]} to {SEEDS[-1]}", *cells, "", ""])
    columns = [text for detector in DETECTORS for text in (f"{detector}, median", "90 %")]
    return Report("Camera estimators", LEGEND, ["estimator", *columns, *(f"lesson, {name}" for name in LESSONS)], rows)


def _cells(each: Estimate, plain: dict[str, float]) -> list[str]:
    cells = []
    for detector, errors in each.errors.items():
        median = float(np.median(errors))
        cells += [f"{median:.3f} ({median / plain[detector]:.2f})", f"{np.sort(errors)[int(0.9 * len(errors))]:.2f}"]
    return cells


def _references(data: Path) -> dict[int, float]:
    with open(data / "kitti/corridor_distances.csv") as table:
        return {int(row["frame"]): float(row["ttc_ref"]) for row in csv.DictReader(table)}


def _recorded(data: Path) -> dict[tuple[str, int], Matches]:
    """Return the positions before and now, by detector and later frame."""
    pairs: dict[tuple[str, int], list[list[float]]] = {}
    with gzip.open(data / "kitti/keypoints/matches_opencv.csv.gz", "rt") as table:
        for row in csv.DictReader(table):
            numbers = [float(row[name]) for name in ("x_prev", "y_prev", "x_curr", "y_curr")]
            pairs.setdefault((row["detector"], int(row["frame_curr"])), []).append(numbers)
    return {key: (np.array(rows)[:, :2], np.array(rows)[:, 2:]) for key, rows in pairs.items()}


def _lesson(data: Path, name: str) -> Matches:
    table = np.loadtxt(data / f"kitti/lesson/matches_0000_0001_{name}.csv", delimiter=",", skiprows=1)
    return table[:, :2], table[:, 2:4]


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m evaluation.camera", description=__doc__)
    parser.add_argument("--data", type=Path, default=DATA, help="the recordings (TTC_FAST_DATA, or %(default)s)")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="put the table between the marks there")
    return parser


if __name__ == "__main__":
    main()
