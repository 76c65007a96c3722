"""What remembers keeps one contract: update, reset, state, restore, pickling, and several threads at once."""

from __future__ import annotations

import copy
import json
import pickle
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import ttc_fast
from tests.support.common import CAR

if TYPE_CHECKING:
    from collections.abc import Callable

FRAMES = 40
BEAMS = 31
SCAN = ttc_fast.ScanTTC(-0.75, 0.05, BEAMS, range_min=0.05, range_max=30.0, outline=CAR)


@dataclass(frozen=True)
class Kept:
    """A class that remembers, and how it is used."""

    make: Callable[[], Any]
    """A new one."""
    update: Callable[[Any, int], Any]
    """Give it a frame of a recording, and return its answer."""
    other_shape: Callable[[], Any]
    """One with settings of another shape, whose states it cannot take up."""
    refused: list[Callable[[Any], Any]]
    """Calls that raise."""
    extreme: list[Callable[[Any, int], Any]]
    """Frames of numbers that overflow and underflow."""
    is_json: bool = True
    """Whether its states pass through JSON."""


def distance(frame: int) -> float:
    """A gap that shrinks, with noise, a miss, and something that cuts in."""
    noise = 0.02 * np.sin(37.0 * frame)
    return float("nan") if frame % 11 == 7 else (6.0 if frame > 30 else 20.0) - 0.3 * frame % 9 + noise


def scale(tracker: Any, frame: int) -> Any:
    """A target that grows, with misses, and a distance now and then."""
    seen = None if frame % 11 == 7 else 1.02 + 0.002 * np.sin(37.0 * frame)
    known = {"distance": 9.0 - 0.15 * frame, "distance_noise": 0.1} if frame % 7 == 3 else {}
    return tracker.update(seen, 1.7e9 + 0.1 * frame, 1e-3, **known)


def wall(frame: int) -> Any:
    y, z = (side.ravel() for side in np.meshgrid(np.linspace(-0.8, 0.8, 17), np.linspace(-1.0, 0.5, 11)))
    x = (25.0 if frame % 9 else 7.0) - 0.3 * frame
    return np.column_stack([np.full(y.size, x) + 0.01 * np.sin(y * frame), y, z])


def ranges(frame: int) -> Any:
    scan = 9.0 - 0.15 * frame + 0.01 * np.sin(np.arange(BEAMS) * (frame + 1.0))
    scan[frame % BEAMS] = np.nan
    return scan


def brake(controller: Any, frame: int) -> Any:
    now = 0.1 * frame
    motion = ttc_fast.Motion(4.0, stamp=now) if frame < 20 else None
    return controller.update(now + 0.02, ranges=ranges(frame), stamp=now, motion=motion)


def controller(**settings: Any) -> Any:
    return ttc_fast.BrakeController(scan=SCAN, range_rate=ttc_fast.RangeRate(SCAN), **settings)


def huge_cloud(size: float) -> Any:
    return np.column_stack([np.full(40, size), np.linspace(-1.0, 1.0, 40), np.ones(40)])


def approach_from(size: float) -> Callable[[Any, int], Any]:
    return lambda tracker, frame: tracker.update(huge_cloud(size * (1.0 - 1e-3 * frame)), 1e10 + 0.1 * frame)


KEPT = {
    "DistanceTracker": Kept(
        make=lambda: ttc_fast.DistanceTracker(max_gap=0.8),
        update=lambda tracker, frame: tracker.update(distance(frame), 1.7e9 + 0.1 * frame),
        other_shape=lambda: ttc_fast.DistanceTracker(ttc_fast.TheilSen()),
        refused=[
            lambda tracker: tracker.update("near", 1.0),
            lambda tracker: tracker.update(3.0, None),
            lambda tracker: tracker.update(3.0, 1.8e9, noise=-1.0),
        ],
        extreme=[
            lambda tracker, frame: tracker.update(1e300, 1e10 + frame),
            lambda tracker, frame: tracker.update(8.0 - frame, 1e10 + frame, 1e-170),
            lambda tracker, frame: tracker.update(8.0 - frame, 1e10 + 1e-6 * frame, 1e200),
        ],
    ),
    "ScaleTracker": Kept(
        make=lambda: ttc_fast.ScaleTracker(max_gap=0.8),
        update=scale,
        other_shape=lambda: ttc_fast.DistanceTracker(),
        refused=[
            lambda tracker: tracker.update("larger", 1.0, 1e-3),
            lambda tracker: tracker.update(1.1, None, 1e-3),
            lambda tracker: tracker.update(-1.1, 1.8e9, 1e-3),
            lambda tracker: tracker.update(None, 1.8e9, distance=3.0),
        ],
        extreme=[
            lambda tracker, frame: tracker.update(1e300, 1e10 + frame, 1e-300),
            lambda tracker, frame: tracker.update(1e-300, 1e10 + 0.1 * frame, 1e300),
            lambda tracker, frame: tracker.update(None, 1e10 + 0.1 * frame, distance=-1e300, distance_noise=1e200),
        ],
    ),
    "CloudTracker": Kept(
        make=lambda: ttc_fast.CloudTracker(estimator=ttc_fast.KthSmallest(5)),
        update=lambda tracker, frame: tracker.update(wall(frame), 0.1 * frame),
        other_shape=lambda: ttc_fast.DistanceTracker(),
        refused=[
            lambda tracker: tracker.update("points", 9.0),
            lambda tracker: tracker.update(np.ones((3, 2)), 9.0),
            lambda tracker: tracker.update(wall(0), "now"),
        ],
        extreme=[
            lambda tracker, frame: tracker.update(huge_cloud(1e3 - frame), 1e10 + frame),
            lambda tracker, frame: tracker.update(huge_cloud(1e300), 1e10 + 0.1 * frame),
            lambda tracker, frame: tracker.update(huge_cloud(1e-300), 1e10 + 1e-5 * frame),
        ],
    ),
    "CloudTracker of means": Kept(
        make=lambda: ttc_fast.CloudTracker(estimator=ttc_fast.MeanOfLowest(5)),
        update=lambda tracker, frame: tracker.update(wall(frame), 0.1 * frame),
        other_shape=lambda: ttc_fast.RangeRate(SCAN),
        refused=[lambda tracker: tracker.update(wall(0), None)],
        extreme=[approach_from(size) for size in (1e308, 1e200, 1e160, 1e150)],
    ),
    "RangeRate": Kept(
        make=lambda: ttc_fast.RangeRate(SCAN),
        update=lambda rates, frame: rates.update(ranges(frame), 0.1 * frame, 0.05 * (frame % 3)),
        other_shape=lambda: ttc_fast.RangeRate(ttc_fast.ScanTTC(0.0, 0.1, BEAMS + 1)),
        refused=[
            lambda rates: rates.update(np.ones(BEAMS - 1), 9.0),
            lambda rates: rates.update(ranges(0), float("nan")),
            lambda rates: rates.update(ranges(0), 9.0, 1e9),
            lambda rates: rates.update(ranges(0), 9.0, status_out=np.empty(3, np.uint8)),
        ],
        extreme=[
            lambda rates, frame: rates.update(np.full(BEAMS, -np.inf), 1e10 + frame),
            lambda rates, frame: rates.update(np.full(BEAMS, 1e300), 1e10 + 0.1 * frame, 100.0),
            lambda rates, frame: rates.update(ranges(frame), 1e307 * (frame + 1)),
        ],
    ),
    "BrakeController": Kept(
        make=controller,
        update=brake,
        other_shape=lambda: ttc_fast.BrakeController(scan=SCAN),
        refused=[
            lambda controller: controller.update(float("nan")),
            lambda controller: controller.update(9.0, ranges=np.ones(3), stamp=9.0, motion=ttc_fast.Motion(1.0)),
            lambda controller: controller.update(9.0, ranges=ranges(1)),
            lambda controller: controller.update(9.0, motion=ttc_fast.Motion(3.0), estimate="soon"),
            lambda controller: controller.update(9.0, motion=ttc_fast.Motion(3.0), override="yes"),
        ],
        extreme=[
            lambda controller, frame: controller.update(1e10 + frame, motion=ttc_fast.Motion(2.9e8)),
            lambda controller, frame: controller.update(
                1e10 + frame, ranges=np.full(BEAMS, 1e-300), stamp=1e10 + frame, motion=ttc_fast.Motion(-1e3)
            ),
        ],
        is_json=False,
    ),
}
every_class = pytest.mark.parametrize("kept", KEPT.values(), ids=KEPT)


def said(kept: Kept, it: Any, frames: range) -> list[str]:
    """What it answers, to the last bit."""
    answers = [kept.update(it, frame) for frame in frames]
    return [repr(answer._asdict() if hasattr(answer, "_asdict") else answer) for answer in answers]


def fed(kept: Kept, frames: int = FRAMES // 2) -> Any:
    it = kept.make()
    said(kept, it, range(frames))
    return it


def text(state: dict[str, Any]) -> str:
    return repr(sorted(state.items()))


@every_class
@pytest.mark.parametrize("frames", range(0, FRAMES, 3))
def test_a_state_goes_on_with_the_same_bits(kept: Kept, frames: int) -> None:
    it, other = fed(kept, frames), fed(kept, 5)
    state = it.state()
    assert state["class"] == type(it).__name__
    assert isinstance(state["version"], int)
    other.restore(json.loads(json.dumps(state)) if kept.is_json else pickle.loads(pickle.dumps(state)))
    assert text(other.state()) == text(state)
    assert said(kept, other, range(frames, FRAMES)) == said(kept, it, range(frames, FRAMES))


@every_class
@pytest.mark.parametrize("again", [copy.copy, copy.deepcopy, lambda it: pickle.loads(pickle.dumps(it))])
def test_copies_and_pickles_go_on_by_themselves(kept: Kept, again: Callable[[Any], Any]) -> None:
    it = fed(kept)
    copies = [again(it), again(it)]
    rest = range(FRAMES // 2, FRAMES)
    expected = said(kept, it, rest)
    assert [said(kept, each, rest) for each in copies] == [expected, expected]
    assert text(copies[0].state()) == text(it.state())


@every_class
def test_a_state_is_taken_and_given_by_value(kept: Kept) -> None:
    it = fed(kept)
    state = it.state()
    before = text(state)
    said(kept, it, range(FRAMES // 2, FRAMES))
    assert text(state) == before, "what is remembered later does not reach an older state"
    it.restore(state)
    said(kept, it, range(FRAMES // 2, FRAMES))
    assert text(state) == before, "a state may be taken up again and again"


@every_class
def test_a_reset_forgets_all(kept: Kept) -> None:
    it = fed(kept)
    it.reset()
    assert text(it.state()) == text(kept.make().state())
    assert said(kept, it, range(FRAMES)) == said(kept, kept.make(), range(FRAMES))


@every_class
def test_foreign_states_are_refused(kept: Kept) -> None:
    it = fed(kept)
    state = it.state()
    foreign = [other.make().state() for other in KEPT.values() if type(other.make()) is not type(it)]
    incomplete = [{name: value for name, value in state.items() if name != key} for key in state]
    versions = [state | {"version": version} for version in (state["version"] + 1, 0, None, "1")]
    classes = [state | {"class": name} for name in ("Tracker", None)]
    for wrong in [*foreign, *incomplete, *versions, *classes, {}, kept.other_shape().state()]:
        with pytest.raises(ValueError, match="state"):
            it.restore(wrong)
        assert text(it.state()) == text(state)
    for wrong in ([], None, 3, "state"):
        with pytest.raises(TypeError, match="state"):
            it.restore(wrong)
        assert text(it.state()) == text(state)
    with pytest.raises(ValueError, match="version"):
        it.restore(versions[0])
    with pytest.raises(ValueError, match="class"):
        it.restore(foreign[0])


@every_class
def test_a_call_that_raises_changes_nothing(kept: Kept) -> None:
    it = fed(kept)
    state = text(it.state())
    for call in kept.refused:
        with pytest.raises((TypeError, ValueError)):
            call(it)
        assert text(it.state()) == state


@every_class
def test_every_state_that_is_given_is_taken(kept: Kept) -> None:
    for extreme in kept.extreme:
        it = fed(kept)
        for frame in range(12):
            extreme(it, frame)
            other = kept.make()
            other.restore(it.state())
            assert text(other.state()) == text(it.state())
            assert text(copy.deepcopy(it).state()) == text(it.state())


@every_class
def test_threads_wait_for_each_other(kept: Kept) -> None:
    """No call fails because another one is under way, and what is remembered afterwards is a state like any other."""
    it = kept.make()
    start, frames = threading.Barrier(4), iter(range(10_000))

    def work(index: int) -> None:
        start.wait()
        for _ in range(60):
            kept.update(it, next(frames))
            if index == 0:
                it.restore(it.state())
            elif index == 1:
                copy.copy(it)

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(work, range(4)))
    other = kept.make()
    other.restore(it.state())
    assert said(kept, other, range(1000, 1010)) == said(kept, it, range(1000, 1010))


@pytest.mark.parametrize("name", ["CloudTracker", "RangeRate"])
def test_threads_wait_while_another_one_works_without_the_gil(name: str) -> None:
    beams = 1 << 17
    scan = ttc_fast.ScanTTC(-1.0, 2.0 / beams, beams)
    large = {"CloudTracker": np.ones((beams, 3)) + 3.0, "RangeRate": np.full(beams, 8.0)}[name]
    it = ttc_fast.CloudTracker() if name == "CloudTracker" else ttc_fast.RangeRate(scan)
    stamps = iter(0.01 * np.arange(1000))

    def work(_: int) -> None:
        for _ in range(10):
            it.update(large, next(stamps))

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(work, range(4)))
    assert it.update(large, 20.0).status is not ttc_fast.Status.INVALID
