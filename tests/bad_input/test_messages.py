"""What is said of numbers that are far too large: the name of the argument, and the number in a few characters."""

from __future__ import annotations

import inspect
import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import ttc_fast
from tests.support.common import CAR, every_module
from ttc_fast import BrakeController, Motion, ScanSweptPath, ScanTTC, SweptPath

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

HUGE = 1e300
SCAN = ScanTTC(-0.5, 0.1, 11, mount=(0.2, 0.0, 0.0), outline=CAR)
NEEDED: dict[str, dict[str, Any]] = {
    "ScanTTC": {"angle_min": -0.5, "angle_increment": 0.1, "beams": 11},
    "SweptPath": {"outline": CAR},
    "ScanSweptPath": {"scan": SCAN},
    "RangeRate": {"scan": SCAN},
    "Quantile": {"q": 0.5},
    "Cluster": {"tolerance": 0.1, "min_points": 3},
    "InterquartileFence": {"factor": 1.5},
    "Supported": {"points": 3, "gap": 0.1},
    "TrimmedMeanRatio": {"share": 0.1},
    "ttc_from_distances": {"previous": 2.0, "current": 1.0, "dt": 0.1},
    "ttc_from_scale": {"scale": 1.1, "dt": 0.1},
    "ttc_from_heights": {"previous": 1.0, "current": 1.1, "dt": 0.1},
    "ttc_constant_velocity": {"distance": 1.0, "closing_speed": 1.0},
    "ttc_constant_acceleration": {"distance": 1.0, "closing_speed": 1.0, "closing_acceleration": 0.0},
    "stopping_distance": {"speed": 1.0, "deceleration": 6.0, "reaction_time": 0.1},
}
"""Arguments that have to be given."""
OTHERS = ["Gate", "Alignment", "DistanceTracker", "CloudTracker", "KalmanCA", "KalmanCV", "SlidingLine", "AlphaBeta"]
OTHERS += ["ScaleTracker", "SlidingParabola", "TheilSen", "EstimatedNoise", "Consensus"]
PAIRS = {"limits", "x", "y", "z", "intensity"}
WHOLES = {"scan", "beams", "points", "min_points", "confirm", "trials", "seed", "threads", "min_scans"}


def numbers_of(name: str) -> Iterator[tuple[str, Any]]:
    """Each argument that is a number, or holds some, with far too large ones in it."""
    for argument in inspect.signature(getattr(ttc_fast, name)).parameters:
        if argument in WHOLES:
            continue
        for huge in (HUGE, -HUGE):
            yield argument, (huge, -huge) if argument in PAIRS else huge
            if argument == "limits":
                yield argument, (0.0, huge)
        if argument == "outline":
            yield argument, (HUGE, -HUGE, HUGE, -HUGE)
        if argument == "mount":
            yield argument, (0.0, 0.0, HUGE)


CALLS = [
    pytest.param(name, argument, value, id=f"{name}-{argument}-{value}")
    for name in [*NEEDED, *OTHERS]
    for argument, value in numbers_of(name)
]


def said(call: Callable[[], Any]) -> str:
    try:
        call()
    except (ValueError, TypeError) as error:
        return str(error)
    return ""


@every_module
@pytest.mark.parametrize(("name", "argument", "value"), CALLS)
def test_settings(module: Any, name: str, argument: str, value: Any) -> None:
    if not hasattr(module, name):
        pytest.skip("the reference takes the kernel's")
    message = said(lambda: getattr(module, name)(**{**NEEDED.get(name, {}), argument: value}))
    assert not re.search(r"\d{17}", message)


@pytest.mark.parametrize("way", [SCAN, ScanSweptPath(SCAN), SweptPath(CAR)], ids=lambda way: type(way).__name__)
@pytest.mark.parametrize("motion", [(HUGE, 0.0, 0.0), (0.0, HUGE, 0.0), (0.0, 0.0, -HUGE)])
def test_motions(way: Any, motion: tuple[float, float, float]) -> None:
    seen = np.ones((3, 2)) if isinstance(way, SweptPath) else np.ones(11)
    message = said(lambda: way.min(seen, *motion))
    assert re.search(r"\de\+?(299|300)\b", message)
    assert not re.search(r"\d{17}", message)


@pytest.mark.parametrize("setting", ["horizon", "time_increment", "hold", "deceleration", "warn_at", "min_returns"])
def test_brakes(setting: str) -> None:
    settings: dict[str, Any] = {setting: -HUGE}
    message = said(lambda: BrakeController(scan=SCAN, **settings))
    assert message.startswith(setting)
    assert not re.search(r"\d{17}", message)


@pytest.mark.parametrize("wrong", ["1", None, np.array([1.0]), [1.0]])
def test_what_is_no_number_is_named(wrong: Any) -> None:
    pixels, cloud = np.ones((4, 2)), np.ones((4, 3))
    calls: dict[str, Callable[[], Any]] = {
        "scale": lambda: ttc_fast.ttc_from_scale(wrong, 0.1),
        "dt": lambda: ttc_fast.ttc_from_scale(1.1, wrong),
        "previous": lambda: ttc_fast.ttc_from_heights(wrong, 1.0, 0.1),
        "current": lambda: ttc_fast.ttc_from_heights(1.0, wrong, 0.1),
        "stamp": lambda: ttc_fast.CloudTracker().update(cloud, wrong),
    }
    for name, call in calls.items():
        assert said(call).startswith(f"{name} must be a number, got ")
    assert said(lambda: ttc_fast.ttc_from_keypoints(pixels, pixels, wrong)).startswith("dt must be a number, got ")


def test_a_brake_that_is_told_a_huge_speed() -> None:
    frame: dict[str, Any] = {"ranges": np.ones(11), "stamp": 0.0, "motion": Motion(HUGE)}
    message = said(lambda: BrakeController(scan=SCAN).update(0.0, **frame))
    assert message.startswith("motion.speed must be below that of light")
    assert len(message) < 100
