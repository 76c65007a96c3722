"""``DistanceTracker``: the answer after each of a hundred distances, by every method."""

from __future__ import annotations

from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np

import ttc_fast
from benches import by_numpy
from benches.case import OURS, Case, Goal, Implementation, close_to_reference
from benches.scans import MINIMUM
from ttc_fast import reference

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import ModuleType

FRAMES = 100
NOISE = 0.02
# A hundred updates may take as long as three hundred scans of 1080 beams.
AS_MANY_SCANS = Goal(300, other=MINIMUM[1080], label="ScanTTC.min, 1080 beams")


@lru_cache
def _approaches() -> list[list[tuple[float, float]]]:
    rng = np.random.default_rng(11)
    stamps = 1.7e9 + 0.1 * np.arange(FRAMES)
    distances = 60.0 - 0.5 * np.arange(FRAMES) + rng.normal(0.0, NOISE, (8, FRAMES))
    return [list(zip(row.tolist(), stamps.tolist(), strict=True)) for row in distances]


def _case(method: Any, *goals: Goal) -> Case:
    def made(module: ModuleType) -> Implementation:
        def follow(frames: list[tuple[float, float]]) -> float:
            update = module.DistanceTracker(method, noise=NOISE).update
            for distance, stamp in frames:
                result = update(distance, stamp)
            speed: float = result.closing_speed
            return speed

        return Implementation("follow(frames)", {"follow": follow}, "frames")

    every: dict[str, Callable[[], Implementation]] = {
        OURS: partial(made, ttc_fast),
        "reference": partial(made, reference),
    }
    if isinstance(method, ttc_fast.SlidingLine):
        every["NumPy"] = lambda: Implementation(f"speeds(frames, {method.window})", vars(by_numpy), "frames")
    compare = close_to_reference("", made(reference), 1e-6)
    name = f"DistanceTracker.update {type(method).__name__}"
    return Case(name, f"{FRAMES} calls", _approaches, every, compare, goals)


CALLS = "Most of it is the call itself: with KalmanCA, the cheapest method, a call takes nearly as long."
CASES = [
    _case(ttc_fast.MotionMixture(), Goal(100, "reference")),
    _case(ttc_fast.KalmanCA(), AS_MANY_SCANS, Goal(100, "reference")),
    *map(_case, (ttc_fast.KalmanCV(), ttc_fast.SlidingParabola(), ttc_fast.TheilSen())),
    _case(ttc_fast.SlidingLine(0.55), AS_MANY_SCANS, Goal(100, "NumPy", why=CALLS)),
]
