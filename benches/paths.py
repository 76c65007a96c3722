"""``SweptPath`` and ``ScanSweptPath``: what the car of the scans would run into, driving straight on or turning."""

from __future__ import annotations

from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np

import ttc_fast
from benches import by_numpy, car, native
from benches.case import OURS, Case, Goal, Implementation, close_to_reference
from benches.inputs import turns
from ttc_fast import reference

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from types import ModuleType

BEAMS, HORIZON = 1080, 5.0
TURNING = car.YAW_RATE


@lru_cache(maxsize=2)
def _frames(as_points: bool) -> list[Any]:
    """Make scans of rooms, or what they see as rows x, y."""
    rooms = car.rooms(turns(4 * BEAMS), BEAMS, "float32")
    if not as_points:
        return list(rooms)
    cos, sin = car.directions(BEAMS)
    seen = np.where((rooms >= car.RANGE_MIN) & (rooms <= car.RANGE_MAX), rooms, np.nan)
    return list(np.stack([car.MOUNT[0] + seen * cos, car.MOUNT[1] + seen * sin], axis=-1).astype(np.float32))


def _case(method: str, yaw_rate: float, *, as_points: bool, numpy: float | None = None) -> Case:
    """Make a case; ``numpy`` is the goal beside NumPy where that does the same."""
    argument, name = ("points", "SweptPath") if as_points else ("ranges", "ScanSweptPath")
    motion = {"speed": car.SPEED, "yaw_rate": yaw_rate}

    def library(module: ModuleType) -> Implementation:
        if as_points:
            path = module.SweptPath(car.OUTLINE, horizon=HORIZON)
        else:
            path = module.ScanSweptPath(module.ScanTTC(*car.place(BEAMS), **car.SETTINGS), horizon=HORIZON)
        out = ", out=out" if method.startswith("per_") else ""
        names = {"path": path, "out": np.empty(BEAMS, np.float32), **motion}
        return Implementation(f"path.{method}({argument}, speed, yaw_rate{out})", names, argument)

    def by_hand() -> Implementation:
        bend = "swept_least(points, speed, yaw_rate, outline, horizon)"
        call = bend if yaw_rate else "swept_least_straight(points, speed, outline, horizon)"
        return Implementation(call, {**vars(by_numpy), **motion, "outline": car.OUTLINE, "horizon": HORIZON}, "points")

    def compare(implementation: Implementation, inputs: Sequence[Any]) -> None:
        rtol = 1e-5 if implementation.expression.startswith("swept") else 0.0  # NumPy computes in float32
        close_to_reference("ttc", library(reference), rtol)(implementation, inputs)

    every: dict[str, Callable[[], Implementation]] = {
        OURS: partial(library, ttc_fast),
        "reference": partial(library, reference),
        **({"NumPy": by_hand} if numpy else {}),
        **native.bare(BEAMS * (8 if as_points else 4)),
    }
    goals = [Goal(30, "reference"), *([Goal(numpy, "NumPy")] if numpy else [])]
    call = f"{name}.{method}{', turning' if yaw_rate else ''}"
    return Case(call, f"{BEAMS} float32", partial(_frames, as_points), every, compare, goals)


CASES = [
    _case("min", 0.0, as_points=True, numpy=4),
    _case("min", TURNING, as_points=True, numpy=30),
    _case("min", 0.0, as_points=False),
    _case("min", TURNING, as_points=False),
    _case("nearest", TURNING, as_points=True),
    _case("nearest", TURNING, as_points=False),
    _case("per_point", TURNING, as_points=True),
    _case("per_beam", TURNING, as_points=False),
]
