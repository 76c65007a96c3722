"""How far a method is off."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from benches.accuracy.methods import Answer

SLOWEST = 0.3
"""m/s: whatever closes more slowly has no time-to-collision to be off from."""


@dataclass(frozen=True)
class Score:
    """Relative errors of the time-to-collision, and what else matters about it."""

    median: float
    most: float
    """In nine frames of ten it is no larger."""
    largest: float
    negative: int
    """Frames in which a car that comes closer was taken to go away."""
    jitter: float
    """Standard deviation, robust, of how the error changes from frame to frame."""
    inside: float
    """Share of frames with the truth inside the interval, of those with one; NaN if there is none."""


def score(runs: Sequence[tuple[Sequence[Answer], Sequence[float]]]) -> Score:
    """Of runs: answers, and the true times beside them, NaN where none counts."""
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
