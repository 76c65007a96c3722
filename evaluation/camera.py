"""How near the truth each camera estimator comes, and whether the truth is in the interval.

``python -m evaluation.camera`` measures both on recorded matches, and the intervals on simulated ones as well. The
truth of the intervals is that of ``evaluation.recorded``, which many image pairs together gave.
"""

from __future__ import annotations

import argparse
import csv
import gzip
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from evaluation import recorded
from evaluation.lidar import RoadDrive
from evaluation.recorded import DATA
from evaluation.report import Report, console, write_into
from ttc_fast import (
    Consensus,
    LeastSquares,
    MedianRatio,
    Quantile,
    ScaleTracker,
    TrackedTTC,
    TrimmedMeanRatio,
    robust_min_x,
    ttc_from_keypoints,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    Matches = tuple[NDArray[np.float64], NDArray[np.float64]]

QUANTILE = 1.645
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


INTERVALS = (
    "Consensus() and its 90 % interval. Recorded: pairs of successive frames 5 to 19, of one drive, so that errors of "
    "neighbouring frames are correlated; the truth is that of the rear of the car. Simulated: 300 cars of 40 to 150 "
    "matches, 140 x 110 px, that grow by 0.3 to 2 %, with 0.1 to 0.5 px of noise. The half-width is that of the "
    "interval of scale - 1, as a share of the true one."
)
SIMULATED = (
    "independent errors",
    "a quarter is background",
    "an upper part is up to 2 m deeper",
    "neighbours err alike",
)
CARS = 300
DRIVES = 24
SLOWEST = 0.3
"""The slowest closing speed that counts, m/s."""
SCALE_NOISE = 8e-4
"""The error of a simulated scale, about that of the recorded ones."""
SHARED = 0.05
"""The error that all scales of a simulated drive share, as a part of ``scale - 1``."""
LIDAR_NOISE = 0.02
"""The error of a distance beside the camera, m: the surface of a car is not the same from frame to frame."""
TRACKED = (
    "ScaleTracker with the scales of Consensus(), with the median distance of the lidar's points, taken to be right to "
    "2 cm, and with both. Recorded: frames 6 to 19 of one drive, each with all pictures before it and none after, so "
    "that these are 14 correlated frames. Simulated: 24 drives as roads have them. The half-width is that of the "
    "interval of 1 / TTC, as a share of the true one."
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
    tables = [report(found), intervals(arguments.data), tracked(arguments.data)]
    for table in tables:
        console().print(table.rich())
    if arguments.markdown:
        text = "\n".join(table.markdown() for table in tables)
        write_into(arguments.markdown, "python -m evaluation.camera", text)


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


class Answer(NamedTuple):
    """What was found of a picture, and the truth."""

    seen: Any  # KeypointTTC or TrackedTTC
    ttc: float  # s


def recorded_answers(data: Path, detector: str) -> list[Answer]:
    """Return the answers to the recorded pairs of a detector whose truth is known."""
    truths = recorded.truths()
    pairs = {frame: pair for (name, frame), pair in _recorded(data).items() if name == detector}
    counted = [frame for frame in sorted(pairs) if not np.isnan(truths[frame].ttc)]
    return [Answer(ttc_from_keypoints(*pairs[frame], DT), truths[frame].ttc) for frame in counted]


def simulated_answers(kind: str) -> list[Answer]:
    """Return the answers to simulated cars."""
    cars = [simulated(kind, seed) for seed in range(CARS)]
    return [Answer(ttc_from_keypoints(before, now, DT), DT / (scale - 1.0)) for before, now, scale in cars]


def simulated(kind: str, seed: int) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Return positions before and now, and the true scale."""
    random = np.random.default_rng(seed)
    count, scale, noise = int(random.integers(40, 150)), random.uniform(1.003, 1.02), random.uniform(0.1, 0.5)
    before = random.uniform(-1.0, 1.0, (count, 2)) * (70.0, 55.0)
    now = before * scale + random.normal(0.0, 1.0, 2)
    if kind == "an upper part is up to 2 m deeper":
        distance = 8.0 + 2.0 * np.clip(-before[:, 1] / 55.0, 0.0, 1.0) * random.uniform()
        growth = 8.0 * (scale - 1.0)
        sideways = np.outer(1.0 / distance - 1.0 / 8.0, random.normal(0.0, 4.0, 2))
        now = before * (distance / (distance - growth))[:, None] + random.normal(0.0, 1.0, 2) + sideways
    elif kind == "neighbours err alike":
        apart = np.square(before[:, None] - before).sum(axis=2)
        factor = np.linalg.cholesky(np.exp(-apart / (2.0 * 25.0**2)) + 1e-9 * np.eye(count))
        now += random.uniform(0.0, 0.6) * noise * (factor @ random.normal(0.0, 1.0, (count, 2)))
    elif kind == "a quarter is background":
        others = random.random(count) < 0.25
        now[others] = before[others] + random.normal(0.0, 4.0, 2)
    return before + 600.0, now + 600.0 + random.normal(0.0, noise, now.shape), scale


def inside(answers: Iterable[Answer]) -> list[bool]:
    """Say of each answer whether the truth is in its interval; an answer without an interval does not have it."""
    ends = [(each.seen.ttc_interval or (np.nan, np.nan), each.ttc) for each in answers]
    return [low <= ttc <= high for (low, high), ttc in ends]


def intervals(data: Path) -> Report:
    """Make the table of the intervals."""
    rows = [_interval_row(f"recorded, {detector}", recorded_answers(data, detector)) for detector in DETECTORS]
    rows += [_interval_row(f"simulated, {kind}", simulated_answers(kind)) for kind in SIMULATED]
    header = ["matches", "pairs", "median", "90 %", "largest", "inside", "half-width"]
    return Report("Intervals of the time-to-collision", INTERVALS, header, rows)


def drive(data: Path, detector: str | None, *, lidar: bool = False) -> list[TrackedTTC]:
    """Return the answers of a tracker to the recorded pictures, with the median distance of the lidar beside them.

    Without a detector there are distances only.
    """
    tracker, pairs = ScaleTracker(), _recorded(data)
    distances = [robust_min_x(cloud, gate=recorded.GATE, estimator=Quantile(0.5)).x for cloud in recorded.clouds()]
    answers = []
    for frame, distance in enumerate(distances):
        known = {"distance": distance, "distance_noise": LIDAR_NOISE} if lidar else {}
        seen = ttc_from_keypoints(*pairs[detector, frame], DT) if detector and frame else None
        scale, spread = (seen.scale, seen.spread) if seen else (None, None)
        answers.append(tracker.update(scale, DT * frame, spread, **known))
    return answers


def simulated_drive(seed: int, *, camera: bool = True, lidar: bool = False) -> list[tuple[TrackedTTC, float]]:
    """Return the answers to a simulated road drive, and the true TTC of each, once it is warm and while the gap closes.

    A scale errs by ``SCALE_NOISE`` in each picture, and by a part of ``scale - 1`` that a drive keeps.
    """
    distances, speeds = RoadDrive(seed).motion()
    random = np.random.default_rng([seed, 7])
    shared, tracker, answers = random.normal(1.0, SHARED), ScaleTracker(), []
    for frame, (distance, speed) in enumerate(zip(distances, speeds, strict=True)):
        measured = distance + random.normal(0.0, LIDAR_NOISE)
        known = {"distance": measured, "distance_noise": LIDAR_NOISE} if lidar else {}
        scale = (
            1.0 + shared * (distances[frame - 1] / distance - 1.0) + random.normal(0.0, SCALE_NOISE) if frame else None
        )
        seen = tracker.update(scale if camera else None, DT * frame, SCALE_NOISE, **known)
        if frame >= recorded.FIRST and speed >= SLOWEST:
            answers.append((seen, distance / speed))
    return answers


def tracked(data: Path) -> Report:
    """Make the table of the trackers."""
    truths = recorded.truths()
    rows = []
    kinds: list[tuple[str, str | None, bool]] = [(each, each, False) for each in DETECTORS]
    kinds += [("lidar's median", None, True)] + [(f"{each} and lidar's median", each, True) for each in DETECTORS]
    for name, detector, lidar in kinds:
        seen = drive(data, detector, lidar=lidar)
        answers = [Answer(each, truth.ttc) for each, truth in zip(seen, truths, strict=True) if not np.isnan(truth.ttc)]
        rows.append(_tracked_row(f"recorded, {name}", answers))
    for name, camera, lidar in (("camera", True, False), ("lidar", False, True), ("both", True, True)):
        drives = [simulated_drive(seed, camera=camera, lidar=lidar) for seed in range(DRIVES)]
        rows.append(_tracked_row(f"simulated road, {name}", [Answer(*each) for run in drives for each in run]))
    header = ["measured", "frames", "median", "90 %", "largest", "inside", "half-width"]
    return Report("ScaleTracker", TRACKED, header, rows)


def _tracked_row(name: str, answers: Sequence[Answer]) -> list[str]:
    ends = np.array([each.seen.ttc_interval or (np.nan, np.nan) for each in answers])
    half = np.median((1.0 / ends[:, 0] - 1.0 / ends[:, 1]) / 2.0 * [each.ttc for each in answers])
    return _row(name, answers, float(half))


def _interval_row(name: str, answers: Sequence[Answer]) -> list[str]:
    return _row(name, answers, float(np.median([QUANTILE * it.seen.spread * it.ttc / DT for it in answers])))


def _row(name: str, answers: Sequence[Answer], half: float) -> list[str]:
    errors = np.quantile([abs(it.seen.ttc - it.ttc) / it.ttc for it in answers], [0.5, 0.9, 1.0], method="higher")
    held = inside(answers)
    cells = [f"{100 * error:.1f} %" if np.isfinite(error) else "∞" for error in errors]
    return [name, str(len(answers)), *cells, f"{sum(held)} ({100 * np.mean(held):.0f} %)", f"{100 * half:.0f} %"]


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
