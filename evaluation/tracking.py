"""``DistanceTracker`` by every method, on approaches whose truth is known: ``python -m evaluation.tracking``.

The approaches are simulated, with exact truth, or the labelled lead vehicles of KITTI.
"""

from __future__ import annotations

import argparse
import csv
import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.progress import track

import ttc_fast
from evaluation.recorded import DATA
from evaluation.report import Report, console
from ttc_fast import Status

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    from collections.abc import Iterable, Sequence

SECONDS = 6.0
FINE = 6000
"""The number of steps in which a motion is integrated."""


@dataclass(frozen=True)
class Approach:
    """The measurements of one approach, and the truth at their stamps."""

    stamps: Floats
    """The times of the measurements, s."""
    measured: Floats
    """The measured distance to contact, m; NaN where the target was not seen."""
    distance: Floats
    """The true distance, m; NaN where it is not known."""
    closing_speed: Floats
    """The true closing speed, m/s; NaN where it is not known."""

    @property
    def ttc(self) -> Floats:
        """Distance over closing speed, s; inf where it does not close."""
        closes = self.closing_speed > 0
        return np.where(closes, self.distance / np.where(closes, self.closing_speed, 1.0), np.inf)


def constant(rng: np.random.Generator, time: Floats) -> Floats:
    """Return the closing acceleration of a constant speed: 0."""
    return np.zeros_like(time)


def accelerating(rng: np.random.Generator, time: Floats) -> Floats:
    """Return a closing acceleration that is positive from the first frame on."""
    return np.full_like(time, rng.uniform(0.5, 3.0))


def braking(rng: np.random.Generator, time: Floats) -> Floats:
    """Return a closing acceleration that is negative from the first frame on."""
    return np.full_like(time, -rng.uniform(0.5, 4.0))


def manoeuvre(rng: np.random.Generator, time: Floats) -> Floats:
    """Return 0 until a car brakes or accelerates, with a jerk of 2 to 8 m/s^3 up to 1 to 6 m/s^2."""
    start, jerk, most = rng.uniform(1.0, 4.0), rng.uniform(2.0, 8.0), rng.uniform(1.0, 6.0)
    return np.asarray(np.clip((time - start) * jerk, 0.0, most) * rng.choice([-1.0, 1.0]))


KINDS: dict[str, Callable[[np.random.Generator, Floats], Floats]] = {
    "constant": constant,
    "accelerating": accelerating,
    "braking": braking,
    "manoeuvre": manoeuvre,
}


def simulated(kind: str, count: int, rate: float = 10.0, seed: int = 2026) -> Iterator[Approach]:
    """Make approaches of one kind, closing at 0.5 to 15 m/s at first from 5 to 60 m away."""
    rng = np.random.default_rng([seed, list(KINDS).index(kind)])
    for _ in range(count):
        time = np.linspace(0.0, SECONDS, FINE)
        speed = rng.uniform(0.5, 15.0) + _integral(KINDS[kind](rng, time), time)
        speed = np.maximum(speed, -2.0)
        distance = rng.uniform(5.0, 60.0) - _integral(speed, time)
        yield _measured(rng, time, distance, speed, rate)


def standing(count: int, rate: float = 10.0, seed: int = 2026) -> Iterator[Approach]:
    """Make standing cars behind standing cars, 1 to 8 m apart."""
    rng = np.random.default_rng([seed, len(KINDS)])
    for _ in range(count):
        time = np.linspace(0.0, SECONDS, FINE)
        yield _measured(rng, time, np.full(FINE, rng.uniform(1.0, 8.0)), np.zeros(FINE), rate)


def _integral(values: Floats, time: Floats) -> Floats:
    return np.concatenate([[0.0], np.cumsum((values[1:] + values[:-1]) / 2 * np.diff(time))])


def _measured(rng: np.random.Generator, time: Floats, distance: Floats, speed: Floats, rate: float) -> Approach:
    """Look at a motion through a sensor.

    Frames come with 10 % of jitter, distances with white noise of 1 to 5 cm; the front edge jitters as a whole by up to
    2 cm with a memory of 0.1 to 0.4 s; 2 % are outliers of 0.1 to 0.8 m and 2 % are missing.
    """
    frames = int(SECONDS * rate)
    stamps = np.cumsum((1 + rng.uniform(-0.1, 0.1, frames)) / rate)
    stamps = stamps[stamps < SECONDS]
    n = len(stamps)
    at = np.interp(stamps, time, distance)
    noise = rng.normal(0.0, rng.uniform(0.01, 0.05), n)
    edge = _wandering(rng, stamps, rng.uniform(0.0, 0.02), rng.uniform(0.1, 0.4))
    outlier = (rng.random(n) < 0.02) * rng.choice([-1.0, 1.0], n) * rng.uniform(0.1, 0.8, n)
    measured = np.where(rng.random(n) < 0.02, np.nan, at + noise + edge + outlier)
    ahead = at > 0.3
    return Approach(1.7e9 + stamps[ahead], measured[ahead], at[ahead], np.interp(stamps, time, speed)[ahead])


def _wandering(rng: np.random.Generator, stamps: Floats, std: float, memory: float) -> Floats:
    """Return noise that resembles that of the frame before."""
    kept = np.exp(-np.diff(stamps, prepend=stamps[0]) / memory)
    steps: Floats = (
        rng.normal(0.0, 1.0, len(stamps)) * std * np.sqrt(1 - np.where(np.arange(len(stamps)) > 0, kept, 0.0) ** 2)
    )
    values: Floats = np.empty_like(steps)
    value = 0.0
    for i, step in enumerate(steps):
        value = values[i] = kept[i] * value + step
    return values


def labelled() -> Iterator[tuple[str, Approach]]:
    """Give the lead vehicles of KITTI's tracking labels, by name; nothing where there are no recordings.

    Measured is the near face of the labelled box. True is the slope of a line through the labels of +-5 frames: it
    knows the future, and its noise is that of the labels.
    """
    path = DATA / "ground_truth" / "kitti_lead_tracks.csv"
    if not path.exists():
        return
    tracks: dict[str, list[dict[str, str]]] = {}
    with path.open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            tracks.setdefault(f"{row['seq']}/{row['track_id']}", []).append(row)
    for name, rows in tracks.items():
        columns = ("t_s", "near_face_m", "d_ref_m", "v_closing_ref_mps")
        yield name, Approach(*(np.array([float(row[column] or "nan") for row in rows]) for column in columns))


METHODS = (
    ttc_fast.MotionMixture(),
    ttc_fast.KalmanCA(),
    ttc_fast.KalmanCV(),
    ttc_fast.SlidingParabola(),
    ttc_fast.SlidingLine(),
    ttc_fast.TheilSen(),
    ttc_fast.AlphaBeta(),
)
JUDGED = {Status.CLOSING, Status.NOT_CLOSING, Status.CONTACT}
SOON = 10.0
"""The true TTC under which a frame has to be called closing, s."""
LEGEND = (
    "Percent of frames with the truth inside the 90 % interval, closing speed / TTC; 90 % quantile of the error of the "
    "closing speed and median half-width of its interval, m/s. Every frame counts in which the target was measured, an "
    "interval was given and the truth is known. No frame knows a later one."
)
RULES = (
    "Standing: cars behind standing cars, 1 to 8 m apart; their frames, how many were called closing, and the least "
    f"TTC. Late: simulated frames with a true TTC under {SOON:g} s that were not called closing, per 1000. Wrong: "
    "answers of all approaches that were negative, NaN or outside their own interval."
)


@dataclass
class Score:
    """The answers of one method to some approaches, compared with the truth."""

    speeds: list[bool] = field(default_factory=list)
    """Whether the true closing speed was inside its interval, frame by frame."""
    times: list[bool] = field(default_factory=list)
    """Whether the true TTC was inside its interval, frame by frame."""
    errors: list[float] = field(default_factory=list)
    """The errors of the closing speed, m/s."""
    widths: list[float] = field(default_factory=list)
    """Half the widths of the intervals of the closing speed, m/s."""
    ttcs: list[float] = field(default_factory=list)
    """The TTC of each frame that counts, s."""
    soon: int = 0
    """The number of frames with a true TTC under ``SOON``."""
    missed: int = 0
    """The number of frames with a true TTC under ``SOON`` that were not called closing."""
    wrong: int = 0
    """The number of answers that no TTC may ever be."""

    def judge(self, tracker: Any, approach: Approach) -> None:
        """Let a fresh tracker see an approach."""
        truth = zip(approach.stamps, approach.measured, approach.closing_speed, approach.ttc, strict=True)
        for stamp, measured, speed, ttc in truth:
            result = tracker.update(measured, stamp)
            ends = result.ttc_interval or (math.inf, math.inf)
            self.wrong += not 0 <= ends[0] <= result.ttc <= ends[1]
            interval = result.closing_speed_interval  # None in contact with something new
            if result.status not in JUDGED or interval is None or math.isnan(speed):
                continue
            low, high = interval
            self.speeds.append(low <= speed <= high)
            self.widths.append((high - low) / 2.0)
            self.times.append(ends[0] <= ttc <= ends[1])
            self.missed += ttc < SOON and result.ttc == math.inf
            self.soon += ttc < SOON
            self.errors.append(abs(result.closing_speed - speed))
            self.ttcs.append(result.ttc)

    def __str__(self) -> str:
        shares = f"{100 * np.mean(self.speeds):.0f} / {100 * np.mean(self.times):.0f}"
        return f"{shares}, {np.quantile(self.errors, 0.9):.2f}, ± {np.median(self.widths):.2f}"


def main(argv: Sequence[str] | None = None) -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(prog="python -m evaluation.tracking", description=__doc__)
    parser.add_argument("--approaches", type=int, default=200, help="of each kind (%(default)s)")
    parser.add_argument("--rate", type=float, default=10.0, help="frames a second (%(default)s)")
    parser.add_argument("--noise", type=float, help="tell the trackers this, m, instead of letting them learn it")
    arguments = parser.parse_args(argv)
    for report in reports(arguments.approaches, arguments.rate, arguments.noise):
        console().print(report.rich())


def reports(count: int, rate: float, noise: float | None = None) -> list[Report]:
    """Measure every method."""
    kinds = {kind: list(simulated(kind, count, rate)) for kind in KINDS}
    still_cars = list(standing(count, rate))
    kitti = dict(labelled())
    coverage, stillness = [], []
    for method in track(METHODS, description="methods", transient=True):
        scores = {kind: scored(method, some, noise) for kind, some in kinds.items()}
        moving = scored(method, (each for some in kinds.values() for each in some), noise)
        scores |= {"all simulated": moving}
        if kitti:
            scores |= {"KITTI labels": scored(method, kitti.values(), noise)}
        coverage.append([str(method), *(str(score) for score in scores.values())])
        still = scored(method, still_cars, noise)
        closing = int(np.isfinite(still.ttcs).sum())
        wrong = still.wrong + sum(score.wrong for score in scores.values())
        late = 1000 * moving.missed / moving.soon
        row = [len(still.ttcs), closing, f"{min(still.ttcs):.3g} s", f"{late:.1f}", wrong]
        stillness.append([str(method), *map(str, row)])
    columns = ["method", *KINDS, "all simulated", *(["KITTI labels"] if kitti else [])]
    return [
        Report(f"Coverage and error at {rate:g} frames a second", LEGEND, columns, coverage),
        Report("Rules", RULES, ["method", "standing frames", "closing", "least TTC", "late", "wrong"], stillness),
    ]


def scored(method: Any, some: Iterable[Approach], noise: float | None = None) -> Score:
    """Give the score of a method on approaches, each with a tracker of its own."""
    score = Score()
    for approach in some:
        score.judge(ttc_fast.DistanceTracker(method, noise=noise), approach)
    return score


if __name__ == "__main__":
    main()
