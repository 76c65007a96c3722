"""What is asked of swept paths: by points and by beams, driving straight and turning, and who answers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

import ttc_fast
from benches import native
from benches.contestant import Contestant
from benches.paths import by_numpy
from benches.scans import car
from ttc_fast import reference

if TYPE_CHECKING:
    from types import ModuleType

HORIZON = 5.0
FRAMES = 64


@lru_cache(maxsize=2)
def _frames(beams: int, as_points: bool) -> list[Any]:
    """Scans of rooms, or what they see as rows x, y."""
    rooms = car.rooms(FRAMES, beams, "float32")
    if not as_points:
        return list(rooms)
    cos, sin = car.directions(beams)
    seen = np.where((rooms >= car.RANGE_MIN) & (rooms <= car.RANGE_MAX), rooms, np.nan)
    return list(np.stack([car.MOUNT[0] + seen * cos, car.MOUNT[1] + seen * sin], axis=-1).astype(np.float32))


@dataclass(frozen=True)
class Case:
    """One question about points, or about beams."""

    method: str
    beams: int
    yaw_rate: float = 0.0
    as_points: bool = True
    dtype: str = "float32"

    def __str__(self) -> str:
        return f"{self.call} {self.size} {self.dtype}"

    @property
    def call(self) -> str:
        """The name of the job."""
        turning = ", turning" if self.yaw_rate else ""
        return f"{'SweptPath' if self.as_points else 'ScanSweptPath'}.{self.method}{turning}"

    @property
    def size(self) -> str:
        """In points."""
        return str(self.beams)

    @property
    def nbytes(self) -> int:
        """Of the points or ranges that one call reads."""
        return self.beams * 4 * (2 if self.as_points else 1)

    def pool(self) -> list[Any]:
        """Points or scans, to be asked about in turn."""
        return _frames(self.beams, self.as_points)

    @property
    def names(self) -> list[str]:
        """Of everybody who can do the job; ttc_fast first."""
        by_hand = ["NumPy"] if self.as_points and self.method == "min" else []
        return ["ttc_fast", "reference", *by_hand, *([native.READ] if native.AVAILABLE else [])]

    def contestant(self, name: str) -> Contestant:
        """One of ``names``."""
        match name:
            case "ttc_fast":
                return self._library(name, ttc_fast)
            case "reference":
                return self._library(name, reference)
            case "NumPy":
                call = "least(points, speed, yaw_rate, outline, horizon)"
                call = call if self.yaw_rate else "least_straight(points, speed, outline, horizon)"
                motion = {"speed": car.SPEED, "yaw_rate": self.yaw_rate}
                names = {**vars(by_numpy), **motion, "outline": car.OUTLINE, "horizon": HORIZON}
                return Contestant(name, call, names, argument="points")
            case native.READ:
                return native.bare_read(self.nbytes)
            case _:
                raise ValueError(f"name must be one of {self.names}, got {name!r}")

    def check(self, contestant: Contestant) -> None:
        """AssertionError if an answer is not that of the reference."""
        if contestant.verify is not None:
            assert all(contestant.verify(data, contestant.answer(data)) for data in self.pool()), (
                f"{contestant} is wrong"
            )
            return
        expected = self.contestant("reference")
        rtol = 1e-5 if contestant.name == "NumPy" else 0.0  # it computes in float32
        for data in self.pool():
            said, right = (getattr(each.answer(data), "ttc", each.answer(data)) for each in (contestant, expected))
            np.testing.assert_allclose(said, right, rtol, err_msg=f"{self}: {contestant.name} is wrong")

    def _library(self, name: str, module: ModuleType) -> Contestant:
        argument = "points" if self.as_points else "ranges"
        if self.as_points:
            path = module.SweptPath(car.OUTLINE, horizon=HORIZON)
        else:
            path = module.ScanSweptPath(module.ScanTTC(*car.place(self.beams), **car.SETTINGS), horizon=HORIZON)
        out = ", out=out" if self.method.startswith("per_") else ""
        names = {"path": path, "speed": car.SPEED, "yaw_rate": self.yaw_rate, "out": np.empty(self.beams, np.float32)}
        return Contestant(name, f"path.{self.method}({argument}, speed, yaw_rate{out})", names, argument=argument)


TURNING = car.YAW_RATE
POINTS = [Case("min", 1080), Case("min", 1080, TURNING)]
BEAMS = [Case("min", 1080, as_points=False), Case("min", 1080, TURNING, as_points=False)]
NEAREST = [Case("nearest", 1080, TURNING), Case("nearest", 1080, TURNING, as_points=False)]
EVERY = [Case("per_point", 1080, TURNING), Case("per_beam", 1080, TURNING, as_points=False)]
CASES = [*POINTS, *BEAMS, *NEAREST, *EVERY]
