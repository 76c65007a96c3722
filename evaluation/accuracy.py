"""How far each method is off, on simulated approaches and on recorded frames: ``python -m evaluation.accuracy``."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from evaluation import recorded
from evaluation.lidar import CHANGING, GATE, STEADY
from evaluation.methods import ALIGNMENT, groups, methods
from evaluation.report import write_into

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from evaluation.lidar import Approach, Frame
    from evaluation.methods import Answer, Method

SLOWEST = 0.3
"""The slowest closing speed that counts, m/s: what closes more slowly has no time-to-collision to compare with."""


@dataclass(frozen=True)
class Score:
    """Relative errors of the time-to-collision, and what else matters about it."""

    median: float
    most: float
    """The 90 % quantile."""
    largest: float
    negative: int
    """The number of frames in which a car that comes closer was taken to go away."""
    jitter: float
    """The robust standard deviation of the change of the error from frame to frame."""
    inside: float
    """The share of frames with an interval that have the truth inside it; NaN if no frame has an interval."""


def score(runs: Sequence[tuple[Sequence[Answer], Sequence[float]]]) -> Score:
    """Score runs: each has the answers, and beside them the true times, NaN where a frame does not count."""
    errors: list[float] = []
    changes: list[float] = []
    inside: list[bool] = []
    negative = 0
    for answers, truths in runs:
        before = np.nan
        for answer, truth in zip(answers, truths, strict=True):
            if np.isnan(truth):
                before = np.nan
                continue
            error = (answer.ttc - truth) / truth
            negative += answer.closing_speed <= 0.0
            errors.append(abs(error))
            if answer.interval is not None:
                inside.append(answer.interval[0] <= truth <= answer.interval[1])
            if np.isfinite(error) and np.isfinite(before):
                changes.append(error - before)
            before = error
    # An infinite error has no neighbour to interpolate with: the next larger one stands.
    median, most = np.quantile(errors, [0.5, 0.9], method="higher")
    jitter = 1.4826 * float(np.median(np.abs(changes))) if changes else np.nan
    share = float(np.mean(inside)) if inside else np.nan
    return Score(float(median), float(most), float(np.max(errors)), negative, jitter, share)


WARM = 5
"""The number of frames of each approach that warm methods up."""


def simulate(approaches: Iterable[Approach], seeds: int) -> list[list[Frame]]:
    """Return the frames of each approach, ``seeds`` times."""
    return [approach.frames(seed) for approach in approaches for seed in range(seeds)]


def on_simulation(method: Method, runs: Sequence[Sequence[Frame]]) -> Score:
    """Score a method where the truth is known."""

    def truth(number: int, frame: Frame) -> float:
        return frame.ttc if number >= WARM and frame.closing_speed >= SLOWEST else np.nan

    return score(
        [
            (
                method([frame.points for frame in run], [frame.stamp for frame in run], GATE),
                [truth(number, frame) for number, frame in enumerate(run)],
            )
            for run in runs
        ]
    )


def on_recordings(method: Method) -> Score | None:
    """Score a method by the truth of the recordings; return None where there are no recordings."""
    clouds = recorded.clouds()
    if not clouds:
        return None
    stamps = [frame / recorded.RATE for frame in range(len(clouds))]
    return score([(method(clouds, stamps, recorded.GATE), [truth.ttc for truth in recorded.truths()])])


def percent(share: float, digits: int = 1) -> str:
    """Return a share as text, and NaN as the empty text."""
    return "" if np.isnan(share) else f"{100 * share:.{digits}f} %" if np.isfinite(share) else "∞"


HEAD = """| method | median | 90 % | largest | negative | jitter | inside |
|---|---:|---:|---:|---:|---:|---:|"""


def row(name: str, score: Score) -> str:
    """Return one line of a table."""
    errors = map(percent, (score.median, score.most, score.largest))
    numbers = [*errors, str(score.negative), percent(score.jitter), percent(score.inside, 0)]
    return f"| {name} | " + " | ".join(numbers) + " |"


def table(scores: Mapping[str, Score]) -> str:
    """Return the table of every method."""
    return "\n".join([HEAD, *(row(name, score) for name, score in scores.items())])


def beside_the_best(scores: Mapping[str, Score]) -> list[str]:
    """Return the 90 % error of the alignment beside that of the best method of each group."""
    ours = scores[ALIGNMENT].most
    lines = []
    for group, members in groups().items():
        best = min(members, key=lambda name: scores[name].most)
        theirs = scores[best].most
        lines.append(f"| {group} | {best} | {percent(theirs)} | {percent(ours)} | {ours / theirs:.2f} |")
    return lines


BESIDE = """| of | the best is | its 90 % | alignment's | ratio |
|---|---|---:|---:|---:|"""


def tables(seeds: int) -> str:
    """Return all tables, in Markdown."""
    runs = simulate((*STEADY, *CHANGING), seeds)
    simulated = {name: on_simulation(method, runs) for name, method in methods().items()}
    asked = {name: on_recordings(method) for name, method in methods().items()}
    recorded = {name: score for name, score in asked.items() if score is not None}
    beside = [
        "## The alignment beside the best of the others",
        "The best is chosen by these same frames; which one it is, is not known beforehand.",
        "Simulated:",
        BESIDE + _joined(simulated),
    ]
    if recorded:
        beside += ["Recorded:", BESIDE + _joined(recorded)]
    parts = [
        *beside,
        f"## Simulated approaches, {sum(map(len, runs))} frames",
        table(simulated),
    ]
    if recorded:
        parts += ["## Recorded: KITTI 2011_09_26, frames 6 to 19", table(recorded)]
    return "\n\n".join(parts) + "\n"


def _joined(scores: Mapping[str, Score]) -> str:
    return "".join(f"\n{line}" for line in beside_the_best(scores))


def main() -> None:
    """Make the tables, and put them where they belong."""
    parser = argparse.ArgumentParser(prog="python -m evaluation.accuracy", description=__doc__)
    parser.add_argument("--markdown", type=Path, help="a document whose tables are replaced, such as docs/accuracy.md")
    parser.add_argument("--seeds", type=int, default=4, help="how often each approach is simulated")
    chosen = parser.parse_args()
    made = tables(chosen.seeds)
    if chosen.markdown is None:
        print(made)
        return
    write_into(chosen.markdown, "python -m evaluation.accuracy", made)


if __name__ == "__main__":
    main()
