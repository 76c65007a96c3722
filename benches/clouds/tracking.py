"""What following a body costs: ``CloudTracker`` over the frames of a drive, and the gate pass alone over the same."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

import ttc_fast
from benches.contestant import Contestant
from evaluation import lidar, recorded
from ttc_fast import reference

if TYPE_CHECKING:
    from types import ModuleType

FRAMES = 20


@dataclass(frozen=True)
class Case:
    """Frames of a drive, to be followed or only gated. Light: they are made when asked for."""

    kind: str
    """One of ``KINDS``."""
    follows: bool = True
    dtype: str = "float32"

    def __str__(self) -> str:
        return f"{self.call} {self.size}"

    @property
    def call(self) -> str:
        """What is asked of each frame."""
        return "CloudTracker.update" if self.follows else "robust_min_x"

    @property
    def size(self) -> str:
        """In frames."""
        return f"{FRAMES} {self.kind} frames"

    @property
    def nbytes(self) -> int:
        """Of the frames."""
        return sum(points.nbytes for points in _drive(self.kind)[0])

    def pool(self) -> list[Any]:
        """One drive, after which the next tracker begins anew."""
        return [_drive(self.kind)[0]]

    @property
    def names(self) -> list[str]:
        """Of everybody who can do it."""
        return ["ttc_fast", "reference"]

    def contestant(self, name: str) -> Contestant:
        """One of ``names``."""
        module = ttc_fast if name == "ttc_fast" else reference
        return Contestant(name, "job(frames)", {"job": self._job(module)}, "frames")

    def check(self, contestant: Contestant) -> None:
        """AssertionError if the last closing speed, or the last distance, is not that of the reference."""
        for frames in self.pool():
            expected = self._job(reference)(frames)
            assert np.isfinite(expected), f"{self}: nothing to follow"
            np.testing.assert_allclose(contestant.answer(frames), expected, 1e-6, err_msg=f"{self}")

    def _job(self, module: ModuleType) -> Any:
        gate = _drive(self.kind)[1]

        def follow(frames: list[Any]) -> float:
            update = module.CloudTracker(gate).update
            for number, points in enumerate(frames):
                speed: float = update(points, number / recorded.RATE).closing_speed
            return speed

        def look(frames: list[Any]) -> float:
            for points in frames:
                x: float = module.robust_min_x(points, gate=gate).x
            return x

        return follow if self.follows else look


@lru_cache
def _drive(kind: str) -> tuple[list[Any], ttc_fast.Gate]:
    if kind == "recorded" and recorded.clouds():
        return recorded.clouds()[:FRAMES], recorded.GATE
    frames = lidar.Approach(kind, 20.0, 3.0).frames(seed=1)[:FRAMES]
    return [frame.points for frame in frames], lidar.GATE


KINDS = ("recorded", "simulated")
"""KITTI frames of 114k points, and our own of some 12k, which also stand in where there are no recordings."""
FOLLOWED = [Case(kind) for kind in KINDS]
GATED = [Case(kind, follows=False) for kind in KINDS]
CASES = [*FOLLOWED, *GATED]
