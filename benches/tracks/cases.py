"""What is asked of a tracker: the answer after each of a hundred distances."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

import ttc_fast
from benches.contestant import Contestant
from benches.tracks import by_numpy
from ttc_fast import reference

if TYPE_CHECKING:
    from types import ModuleType

FRAMES = 100
NOISE = 0.02


@dataclass(frozen=True)
class Case:
    """A method, fed with approaches. Light: they are made when asked for."""

    method: Any
    dtype: str = "float64"

    def __str__(self) -> str:
        return f"{self.call} {self.size}"

    @property
    def call(self) -> str:
        """The name of the method."""
        return f"DistanceTracker.update {type(self.method).__name__}"

    @property
    def size(self) -> str:
        """In calls."""
        return f"{FRAMES} calls"

    @property
    def nbytes(self) -> int:
        """Of the distances and stamps."""
        return 16 * FRAMES

    def pool(self) -> list[Any]:
        """Approaches, to be followed in turn."""
        return _approaches()

    @property
    def names(self) -> list[str]:
        """Of everybody who can do it; ttc_fast first."""
        line = isinstance(self.method, ttc_fast.SlidingLine)
        return ["ttc_fast", "reference", *(["NumPy"] if line else [])]

    def contestant(self, name: str) -> Contestant:
        """One of ``names``."""
        if name == "NumPy":
            expression = f"speeds(frames, {self.method.window})"
            return Contestant(name, expression, vars(by_numpy), "frames")
        module = ttc_fast if name == "ttc_fast" else reference
        return Contestant(name, "follow(frames)", {"follow": _follower(module, self.method)}, "frames")

    def check(self, contestant: Contestant) -> None:
        """AssertionError if the last closing speed of an approach is not that of the reference."""
        follow = _follower(reference, self.method)
        for frames in self.pool()[:2]:
            np.testing.assert_allclose(contestant.answer(frames), follow(frames), 1e-6, err_msg=f"{self}")


def _follower(module: ModuleType, method: Any) -> Any:
    def follow(frames: list[tuple[float, float]]) -> float:
        update = module.DistanceTracker(method, noise=NOISE).update
        for distance, stamp in frames:
            result = update(distance, stamp)
        speed: float = result.closing_speed
        return speed

    return follow


@lru_cache
def _approaches() -> list[list[tuple[float, float]]]:
    rng = np.random.default_rng(11)
    stamps = 1.7e9 + 0.1 * np.arange(FRAMES)
    distances = 60.0 - 0.5 * np.arange(FRAMES) + rng.normal(0.0, NOISE, (8, FRAMES))
    return [list(zip(row.tolist(), stamps.tolist(), strict=True)) for row in distances]


KALMAN, LINE = Case(ttc_fast.KalmanCA()), Case(ttc_fast.SlidingLine(0.55))
CASES = [KALMAN, *map(Case, (ttc_fast.KalmanCV(), ttc_fast.SlidingParabola(), ttc_fast.TheilSen())), LINE]
