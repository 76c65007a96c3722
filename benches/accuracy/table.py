"""Every method on simulated approaches and on recorded frames."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from benches.accuracy import recorded
from benches.accuracy.approach import CHANGING, GATE, STEADY
from benches.accuracy.methods import methods
from benches.accuracy.score import SLOWEST, Score, score

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from benches.accuracy.approach import Approach, Frame
    from benches.accuracy.methods import Method

WARM = 5
"""Frames of each approach that warm methods up."""


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


def row(name: str, score: Score) -> str:
    """One line of a table."""

    def percent(share: float) -> str:
        return f"{100 * share:.1f} %" if np.isfinite(share) else "∞"

    numbers = [*map(percent, (score.median, score.most, score.largest)), str(score.negative), percent(score.jitter)]
    return f"| {name} | " + " | ".join(numbers) + " |"


HEAD = """| method | median | 90 % | largest | negative | jitter |
|---|---:|---:|---:|---:|---:|"""


def tables(seeds: int) -> str:
    """Both tables, in Markdown."""
    runs = simulate((*STEADY, *CHANGING), seeds)
    simulated = [row(name, on_simulation(method, runs)) for name, method in methods().items()]
    parts = [f"## Simulated approaches, {sum(map(len, runs))} frames\n", HEAD, *simulated]
    found = {name: on_recordings(method) for name, method in methods().items()}
    known = [row(name, score) for name, score in found.items() if score is not None]
    if known:
        parts += ["\n## Recorded: KITTI 2011_09_26, frames 6 to 19\n", HEAD, *known]
    return "\n".join(parts) + "\n"
