"""``DistanceTracker`` by every method, on approaches whose truth is known: ``python -m benches.accuracy.distances``."""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.progress import track

import ttc_fast
from benches.accuracy import approaches
from benches.table import Report, console
from ttc_fast import Status

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from benches.accuracy.approaches import Approach

METHODS = (
    ttc_fast.KalmanCA(),
    ttc_fast.KalmanCV(),
    ttc_fast.SlidingParabola(),
    ttc_fast.SlidingLine(),
    ttc_fast.TheilSen(),
    ttc_fast.AlphaBeta(),
)
JUDGED = {Status.CLOSING, Status.NOT_CLOSING, Status.CONTACT}
SOON = 10.0
"""s"""
LEGEND = (
    "Percent of frames with the truth inside the 90 % interval, closing speed / TTC, and 90 % quantile of the error of "
    "the closing speed, m/s. Every frame counts in which the target was measured, an interval was given and the truth "
    "is known. No frame knows a later one."
)
RULES = (
    "Standing: cars behind standing cars, 1 to 8 m apart; their frames, how many were called closing, and the least "
    f"TTC. Late: simulated frames with a true TTC under {SOON:g} s that were not called closing, per 1000. Wrong: "
    "answers of all approaches that were negative, NaN or outside their own interval."
)


@dataclass
class Score:
    """How one method did on some approaches."""

    speeds: list[bool] = field(default_factory=list)
    """Whether the true closing speed was inside its interval."""
    times: list[bool] = field(default_factory=list)
    """Whether the true TTC was."""
    errors: list[float] = field(default_factory=list)
    """Of the closing speed, m/s."""
    ttcs: list[float] = field(default_factory=list)
    """Of the judged frames, s."""
    soon: int = 0
    """Frames with a true TTC under ``SOON``."""
    missed: int = 0
    """Those that were not called closing."""
    wrong: int = 0
    """Answers that no TTC may ever be."""

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
            self.times.append(ends[0] <= ttc <= ends[1])
            self.missed += ttc < SOON and result.ttc == math.inf
            self.soon += ttc < SOON
            self.errors.append(abs(result.closing_speed - speed))
            self.ttcs.append(result.ttc)

    def __str__(self) -> str:
        shares = f"{100 * np.mean(self.speeds):.0f} / {100 * np.mean(self.times):.0f}"
        return f"{shares}, {np.quantile(self.errors, 0.9):.2f}"


def main(argv: Sequence[str] | None = None) -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(prog="python -m benches.accuracy.distances", description=__doc__)
    parser.add_argument("--approaches", type=int, default=200, help="of each kind (%(default)s)")
    parser.add_argument("--rate", type=float, default=10.0, help="frames a second (%(default)s)")
    parser.add_argument("--noise", type=float, help="tell the trackers this, m, instead of letting them learn it")
    arguments = parser.parse_args(argv)
    for report in reports(arguments.approaches, arguments.rate, arguments.noise):
        console().print(report.rich())


def reports(count: int, rate: float, noise: float | None = None) -> list[Report]:
    """Measure every method."""
    kinds = {kind: list(approaches.simulated(kind, count, rate)) for kind in approaches.KINDS}
    standing = list(approaches.standing(count, rate))
    kitti = dict(approaches.labelled())
    coverage, stillness = [], []
    for method in track(METHODS, description="methods", transient=True):
        scores = {kind: scored(method, some, noise) for kind, some in kinds.items()}
        moving = scored(method, (each for some in kinds.values() for each in some), noise)
        scores |= {"all simulated": moving}
        if kitti:
            scores |= {"KITTI labels": scored(method, kitti.values(), noise)}
        coverage.append([str(method), *(str(score) for score in scores.values())])
        still = scored(method, standing, noise)
        closing = int(np.isfinite(still.ttcs).sum())
        wrong = still.wrong + sum(score.wrong for score in scores.values())
        late = 1000 * moving.missed / moving.soon
        row = [len(still.ttcs), closing, f"{min(still.ttcs):.3g} s", f"{late:.1f}", wrong]
        stillness.append([str(method), *map(str, row)])
    columns = ["method", *approaches.KINDS, "all simulated", *(["KITTI labels"] if kitti else [])]
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
