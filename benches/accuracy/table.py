"""Every method on simulated approaches and on recorded frames."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from benches.accuracy import recorded
from benches.accuracy.approach import CHANGING, GATE, STEADY
from benches.accuracy.methods import ALIGNMENT, aligned, groups, methods
from benches.accuracy.scanner import Scanner
from benches.accuracy.score import SLOWEST, Score, score

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from benches.accuracy.approach import Approach, Frame
    from benches.accuracy.methods import Method

WARM = 5
"""Frames of each approach that warm methods up."""
NODS = (0.0, 0.05, 0.1, 0.2)
"""Standard deviation of the pitch from frame to frame, degrees."""


def simulate(approaches: Iterable[Approach], seeds: int) -> list[list[Frame]]:
    """Frames of each approach, so many times."""
    return [approach.frames(seed) for approach in approaches for seed in range(seeds)]


def on_simulation(method: Method, runs: Sequence[Sequence[Frame]]) -> Score:
    """How far a method is off where the truth is known."""

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
    """How far a method is from the reference; ``None`` where there are no recordings."""
    clouds = recorded.clouds()
    if not clouds:
        return None
    stamps = [frame / recorded.RATE for frame in range(len(clouds))]
    return score([(method(clouds, stamps, recorded.GATE), recorded.truths(len(clouds)))])


def percent(share: float, digits: int = 1) -> str:
    """A share as text; empty where there is none."""
    return "" if np.isnan(share) else f"{100 * share:.{digits}f} %" if np.isfinite(share) else "∞"


HEAD = """| method | median | 90 % | largest | negative | jitter | inside |
|---|---:|---:|---:|---:|---:|---:|"""


def row(name: str, score: Score) -> str:
    """One line of a table."""
    errors = map(percent, (score.median, score.most, score.largest))
    numbers = [*errors, str(score.negative), percent(score.jitter), percent(score.inside, 0)]
    return f"| {name} | " + " | ".join(numbers) + " |"


def table(scores: Mapping[str, Score]) -> str:
    """Every method."""
    return "\n".join([HEAD, *(row(name, score) for name, score in scores.items())])


def beside_the_best(scores: Mapping[str, Score]) -> list[str]:
    """The 90 % error of the alignment beside that of the best method of each group."""
    ours = scores[ALIGNMENT].most
    lines = []
    for group, members in groups().items():
        best = min(members, key=lambda name: scores[name].most)
        theirs = scores[best].most
        lines.append(f"| {group} | {best} | {percent(theirs)} | {percent(ours)} | {ours / theirs:.2f} |")
    return lines


BESIDE = """| of | the best is | its 90 % | alignment's | ratio |
|---|---|---:|---:|---:|"""


def nodding(seeds: int) -> str:
    """The alignment on a car that nods."""
    lines = [
        "| pitch | motion | median | 90 % | largest | inside |",
        "|---:|---|---:|---:|---:|---:|",
    ]
    for pitch in NODS:
        scanner = Scanner(pitch=math.radians(pitch))
        for motion, approaches in {"steady": STEADY, "changing": CHANGING}.items():
            score = on_simulation(aligned, simulate([replace(each, scanner=scanner) for each in approaches], seeds))
            errors = " | ".join(map(percent, (score.median, score.most, score.largest)))
            lines.append(f"| {pitch:g}° | {motion} | {errors} | {percent(score.inside, 0)} |")
    return "\n".join(lines)


def tables(seeds: int) -> str:
    """All of them, in Markdown."""
    runs = simulate((*STEADY, *CHANGING), seeds)
    simulated = {name: on_simulation(method, runs) for name, method in methods().items()}
    asked = {name: on_recordings(method) for name, method in methods().items()}
    recorded = {name: score for name, score in asked.items() if score is not None}
    beside = [
        "## The alignment beside the best of the others",
        "The best by these same frames: nobody knows beforehand which it is.",
        "Simulated:",
        BESIDE + _joined(simulated),
    ]
    if recorded:
        beside += ["Recorded:", BESIDE + _joined(recorded)]
    parts = [
        *beside,
        "## The alignment on a car that nods, simulated",
        nodding(seeds),
        f"## Simulated approaches, {sum(map(len, runs))} frames",
        table(simulated),
    ]
    if recorded:
        parts += ["## Recorded: KITTI 2011_09_26, frames 6 to 19", table(recorded)]
    return "\n\n".join(parts) + "\n"


def _joined(scores: Mapping[str, Score]) -> str:
    return "".join(f"\n{line}" for line in beside_the_best(scores))
