"""``DistanceTracker``: what it says of targets that come, go, flicker and stand, and what holds of every answer."""

from __future__ import annotations

import json
import math
import pickle
import threading
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ttc_fast
from tests.support.common import every_module, examples
from tests.support.distance_histories import METHODS, history
from ttc_fast import DistanceTracker, Status

if TYPE_CHECKING:
    from collections.abc import Iterable

every_method = pytest.mark.parametrize("method", METHODS, ids=repr)


def fed(tracker: Any, distances: Iterable[Any], start: float = 0.0, step: float = 0.1) -> list[Any]:
    return [tracker.update(distance, start + step * frame) for frame, distance in enumerate(distances)]


def names(results: list[Any]) -> list[str]:
    return [result.status.name for result in results]


@every_module
@every_method
def test_a_steady_approach(module: Any, method: Any) -> None:
    results = fed(module.DistanceTracker(method, noise=0.02), 30.0 - 0.5 * np.arange(20), start=1.7e9)
    assert names(results)[:2] == ["WARMING_UP"] * 2
    assert results[0].ttc_interval is None
    assert results[0].distance == 30.0
    last = results[-1]
    assert last.status is Status.CLOSING
    assert last.closing_speed == pytest.approx(5.0, rel=1e-5)
    assert last.ttc == pytest.approx(20.5 / 5.0, rel=1e-5)
    assert last.ttc_interval[0] < last.ttc < last.ttc_interval[1] < math.inf
    assert last.closing_speed_interval[0] < 5.0 < last.closing_speed_interval[1]


@every_module
def test_contact_is_0_while_closing_and_inf_while_opening(module: Any) -> None:
    tracker = module.DistanceTracker(noise=0.02)
    results = fed(tracker, 1.0 - 0.2 * np.arange(8))
    assert results[-1].status is Status.CONTACT
    assert results[-1].ttc == 0.0
    away = fed(module.DistanceTracker(noise=0.02), -1.0 + 0.1 * np.arange(6))
    assert away[-1].status is Status.CONTACT
    assert away[-1].ttc == math.inf


@every_module
@pytest.mark.parametrize("distance", [0.0, -0.0, -0.3])
def test_contact_with_something_new_is_contact_at_once(module: Any, distance: float) -> None:
    """The first frame ever, one after a long gap, and one nearer than what was there."""
    trackers = [module.DistanceTracker() for _ in range(3)]
    fed(trackers[1], [5.0] * 9)
    fed(trackers[2], [5.0] * 9)
    for tracker, stamp in zip(trackers, (0.0, 9.0, 0.9), strict=True):
        seen = tracker.update(distance, stamp)
        assert (seen.status, seen.ttc, seen.distance) == (Status.CONTACT, math.inf, distance)
        assert seen.ttc_interval is None
        assert math.isnan(seen.closing_speed)


@every_method
def test_a_nearer_car_leads_at_once(method: Any) -> None:
    tracker = DistanceTracker(method, noise=0.03)
    fed(tracker, 30.0 - 0.1 * np.arange(15))
    near = 12.0 - 0.1 * np.arange(12)
    results = fed(tracker, near, start=1.5)
    assert names(results)[:2] == ["WARMING_UP"] * 2
    assert names(results)[-1] == "CLOSING"
    for distance, result in zip(near, results, strict=True):
        assert result.distance == pytest.approx(distance, abs=0.2), "never between two cars"


@every_method
def test_a_flicker_costs_one_frame(method: Any) -> None:
    tracker = DistanceTracker(method, noise=0.03)
    fed(tracker, 30.0 - 0.5 * np.arange(15))
    assert tracker.update(3.0, 1.5).status is Status.WARMING_UP
    after = tracker.update(22.0, 1.6)
    assert after.status is Status.CLOSING
    assert after.closing_speed == pytest.approx(5.0, abs=0.01)


@every_method
def test_a_car_that_changes_lanes_is_lost_and_the_next_one_followed(method: Any) -> None:
    tracker = DistanceTracker(method, noise=0.03)
    fed(tracker, 12.0 - 0.1 * np.arange(15))
    results = fed(tracker, 40.0 - 0.5 * np.arange(6), start=1.5)
    assert names(results)[:2] == ["LOST"] * 2
    assert results[1].distance < 12.0
    assert results[-1].distance == pytest.approx(37.5, abs=0.2)


@every_module
def test_statuses_of_frames_without_a_distance(module: Any) -> None:
    tracker = module.DistanceTracker(noise=0.03, max_gap=0.5)
    assert tracker.update(None, 0.0).status is Status.NO_DATA
    assert tracker.update(math.inf, 0.1).status is Status.CLEAR
    fed(tracker, 30.0 - 0.5 * np.arange(10), start=0.2)
    coasting = [tracker.update(gone, 1.2 + 0.1 * i) for i, gone in enumerate([None, math.nan, math.inf, None])]
    assert names(coasting) == ["LOST"] * 4
    assert coasting[0].distance == pytest.approx(25.0, abs=0.01)
    widths = [result.ttc_interval[1] - result.ttc_interval[0] for result in coasting]
    assert widths == sorted(widths)
    assert tracker.update(math.inf, 1.8).status is Status.CLEAR
    assert tracker.update(None, 1.9).status is Status.NO_DATA
    assert tracker.update(20.0, 2.0).status is Status.WARMING_UP


@every_module
def test_a_gap_makes_the_past_stale(module: Any) -> None:
    tracker = module.DistanceTracker(noise=0.03)
    fed(tracker, 30.0 - 0.5 * np.arange(10))
    result = tracker.update(10.0, 5.0)
    assert result.status is Status.STALE
    assert result.ttc == math.inf
    assert result.ttc_interval is None
    assert tracker.update(9.5, 5.1).status is Status.WARMING_UP


@every_module
@pytest.mark.parametrize("stamp", [0.9, 0.5, -3.0, math.nan, math.inf])
def test_a_frame_that_is_not_later_changes_nothing(module: Any, stamp: float) -> None:
    tracker, other = (module.DistanceTracker(noise=0.03) for _ in range(2))
    last = fed(tracker, 30.0 - 0.5 * np.arange(10))[-1]
    fed(other, 30.0 - 0.5 * np.arange(10))
    result = tracker.update(2.0, stamp)
    assert result.status is Status.INVALID
    assert (result.ttc, result.distance, result.ttc_interval) == (last.ttc, last.distance, last.ttc_interval)
    assert repr(tracker.update(25.0, 1.0)) == repr(other.update(25.0, 1.0))


@every_module
def test_what_is_refused(module: Any) -> None:
    for wrong in (
        {"gate": 0.0},
        {"jump": -1.0},
        {"confirm": 1},
        {"confirm": -1},
        {"max_gap": 0.0},
        {"max_speed": math.inf},
        {"min_closing_speed": -0.1},
        {"noise": 0.0},
        {"noise": math.nan},
    ):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            module.DistanceTracker(**wrong)
    with pytest.raises(TypeError, match="method"):
        module.DistanceTracker("KalmanCA")
    with pytest.raises(TypeError, match="noise"):
        module.DistanceTracker(noise="loud")
    tracker = module.DistanceTracker()
    with pytest.raises(TypeError, match="distance"):
        tracker.update("near", 0.0)
    with pytest.raises(TypeError, match="stamp"):
        tracker.update(1.0, None)
    with pytest.raises(ValueError, match="noise"):
        tracker.update(1.0, 0.0, -0.1)


SETTINGS: list[tuple[Any, dict[str, Any]]] = [
    (ttc_fast.MotionMixture, {"memory": 61.0}),
    (ttc_fast.MotionMixture, {"scale": 0.0}),
    (ttc_fast.SlidingLine, {"window": 0.0}),
    (ttc_fast.SlidingLine, {"window": 61.0}),
    (ttc_fast.SlidingLine, {"acceleration": -1.0}),
    (ttc_fast.SlidingParabola, {"jerk": math.nan}),
    (ttc_fast.TheilSen, {"window": -1.0}),
    (ttc_fast.AlphaBeta, {"memory": 0.0}),
    (ttc_fast.KalmanCV, {"acceleration": 0.0}),
    (ttc_fast.KalmanCA, {"jerk": math.inf}),
    (ttc_fast.EstimatedNoise, {"start": 0.0}),
    (ttc_fast.EstimatedNoise, {"frames": 2}),
]


@pytest.mark.parametrize(("kind", "wrong"), SETTINGS)
def test_methods_refuse_senseless_settings(kind: Any, wrong: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        kind(**wrong)


@every_module
@every_method
def test_a_state_goes_on_where_it_was_taken(module: Any, method: Any) -> None:
    frames = history(5, 120)
    tracker = module.DistanceTracker(method, max_gap=0.8)
    for frame in frames[:60]:
        tracker.update(*frame)
    state = tracker.state()
    if module is ttc_fast:
        state = json.loads(json.dumps(state))
    copies = [module.DistanceTracker(method, max_gap=0.8), pickle.loads(pickle.dumps(tracker))]
    copies[0].restore(state)
    for frame in frames[60:]:
        said = repr(tracker.update(*frame))
        assert [repr(copy.update(*frame)) for copy in copies] == [said] * len(copies)


def test_an_answer_says_its_intervals() -> None:
    assert "ttc_interval=(" in repr(fed(DistanceTracker(), 10.0 - 0.5 * np.arange(8))[-1])


def test_a_state_that_is_none() -> None:
    tracker = DistanceTracker()
    fed(tracker, 10.0 - 0.5 * np.arange(5))
    state, other = tracker.state(), DistanceTracker()
    with pytest.raises(TypeError, match="state"):
        other.restore([])  # type: ignore[arg-type]
    for key in state:
        with pytest.raises(ValueError, match="state"):
            other.restore({name: value for name, value in state.items() if name != key})
    for numbers in ([], state["numbers"][:-1], [*state["numbers"], 0.0], [math.nan] * len(state["numbers"])):
        with pytest.raises(ValueError, match="state"):
            other.restore(state | {"numbers": numbers})
    with pytest.raises(ValueError, match="version"):
        other.restore(state | {"version": 99})
    assert repr(other.state()) == repr(DistanceTracker().state()), "what is refused changes nothing"


@examples(100)
@given(seed=st.integers(0, 2**31), method=st.sampled_from(METHODS), spoiled=st.integers(0, 300))
def test_no_state_makes_a_wrong_answer(seed: int, method: Any, spoiled: int) -> None:
    """Whatever numbers are restored, an answer is one that a TTC may be."""
    rng = np.random.default_rng(seed)
    tracker = DistanceTracker(method)
    for frame in history(seed, 30):
        tracker.update(*frame)
    state = tracker.state()
    numbers = list(state["numbers"])
    numbers[spoiled % len(numbers)] = float(
        rng.choice([0.0, -1.0, 1e308, -1e308, 1.0, 3.0, math.nan, math.inf, -math.inf])
    )
    copy = DistanceTracker(method)
    try:
        copy.restore(state | {"numbers": numbers})
    except ValueError:
        return
    for i in range(10):
        allowed(copy.update(float(rng.uniform(-5, 50)), 3e9 + 0.1 * i))


def allowed(result: Any) -> None:
    assert 0 <= result.ttc <= math.inf
    if result.ttc_interval is not None:
        low, high = result.ttc_interval
        assert 0 <= low <= result.ttc <= high


@examples(200)
@given(
    method=st.sampled_from(METHODS),
    noise=st.sampled_from([None, 1e-6, 0.03, 1e6]),
    frames=st.lists(
        st.tuples(
            st.floats() | st.floats(-5, 50) | st.sampled_from([1e308, -1e308, 5e-324]),
            st.floats() | st.floats(0, 10),
            st.sampled_from([None, None, 0.01, 1e150, 1e-150]),
        ),
        max_size=30,
    ),
)
def test_no_history_makes_a_wrong_answer(method: Any, noise: Any, frames: list[Any]) -> None:
    tracker = DistanceTracker(method, noise=noise)
    stamp = 0.0
    for i, (distance, moment, own) in enumerate(frames):
        stamp = moment if i % 3 == 0 else stamp + 0.1
        allowed(tracker.update(distance, stamp, own))


@examples(60)
@given(seed=st.integers(0, 2**31), which=st.integers(0, 6), power=st.integers(-8, 8))
def test_units_do_not_matter(seed: int, which: int, power: int) -> None:
    """Metres or eighths of a metre: the same times, and speeds in the same unit."""
    c = 2.0**power
    kinds: list[Any] = [
        lambda c: ttc_fast.MotionMixture(2.0, c),
        lambda c: ttc_fast.KalmanCA(1.5 * c, 3.0 * c),
        lambda c: ttc_fast.KalmanCV(0.7 * c),
        lambda c: ttc_fast.SlidingLine(0.5, c),
        lambda c: ttc_fast.SlidingParabola(1.0, c),
        lambda c: ttc_fast.TheilSen(0.5, c),
        lambda c: ttc_fast.AlphaBeta(0.2, c),
    ]

    def tracker(c: float) -> DistanceTracker:
        lengths: dict[str, Any] = {"jump": c, "max_speed": 100 * c, "min_closing_speed": 0.05 * c}
        return DistanceTracker(kinds[which](c), noise=ttc_fast.EstimatedNoise(0.03 * c), **lengths)

    metres, others = tracker(1.0), tracker(c)
    for distance, stamp, own in history(seed, 60):
        one = metres.update(distance, stamp, own)
        other = others.update(distance * c, stamp, None if own is None else own * c)
        assert (one.status, one.ttc, one.ttc_interval) == (other.status, other.ttc, other.ttc_interval)
        np.testing.assert_array_equal([one.distance * c, one.closing_speed * c], [other.distance, other.closing_speed])


@examples(60)
@given(seed=st.integers(0, 2**31), method=st.sampled_from(METHODS), shift=st.sampled_from([-8.0, 1024.0, 2.0**30]))
def test_the_year_does_not_matter(seed: int, method: Any, shift: float) -> None:
    """Stamps that are multiples of 1/64 s lose nothing when moved: bit for bit the same answers."""
    now, later = DistanceTracker(method), DistanceTracker(method)
    for distance, stamp, own in history(seed, 60):
        exact = round((stamp % 1e6) * 64) / 64
        assert repr(now.update(distance, exact, own)) == repr(later.update(distance, exact + shift, own))


@every_method
def test_a_fast_target_is_followed_from_the_third_frame_on(method: Any) -> None:
    results = fed(DistanceTracker(method), 60.0 - 3.0 * np.arange(8))
    assert all(result.ttc < 3.0 for result in results[4:])


@every_module
def test_intervals_are_narrow_while_a_gap_closes_steadily_and_widen_when_the_target_brakes(module: Any) -> None:
    noise, tracker = np.random.default_rng(6).normal(0.0, 0.02, 60), module.DistanceTracker()
    time = 0.1 * np.arange(60)
    braking = 4.0 * np.maximum(time - 3.0, 0.0)
    results = fed(tracker, 40.0 - 3.0 * time - braking * (time - 3.0) / 2.0 + noise)
    widths = np.array([np.ptp(result.closing_speed_interval) for result in results[10:]])
    assert widths[19] < 0.2
    assert widths[20:28].max() > 3.0 * widths[19]
    inside = [
        result.closing_speed_interval[0] <= 3.0 + more <= result.closing_speed_interval[1]
        for result, more in zip(results[10:], braking[10:], strict=True)
    ]
    assert sum(inside) >= 0.9 * len(inside)


def test_the_standard_error_of_a_line_reaches_the_bound_of_cramer_and_rao() -> None:
    """White noise of known size, constant closing: no unbiased estimate from the window's frames can do better."""
    rng, noise, errors, claimed = np.random.default_rng(8), 0.03, [], []
    time = 0.1 * np.arange(30)
    for _ in range(1500):
        tracker = DistanceTracker(ttc_fast.SlidingLine(window=0.55, acceleration=0.0), noise=noise)
        for stamp, distance in zip(time, 40.0 - 6.0 * time + rng.normal(0, noise, 30), strict=True):
            result = tracker.update(distance, stamp)
        errors.append(result.closing_speed - 6.0)
        low, high = result.closing_speed_interval or (math.nan, math.nan)
        claimed.append((high - low) / 2 / 1.645)
    frames = time[-6:]
    bound = noise / math.sqrt(((frames - frames.mean()) ** 2).sum())
    assert bound * 0.93 < np.std(errors) < bound * 1.1  # 1.5 would do; the frames in the window are all there is
    assert abs(np.mean(errors)) < 0.1 * bound
    assert 0.9 * bound < np.min(claimed) < 1.1 * bound


def test_a_line_is_that_of_polyfit() -> None:
    rng = np.random.default_rng(3)
    time = np.cumsum(rng.uniform(0.05, 0.1, 30))
    distances = 20.0 - 3.0 * time + rng.normal(0, 0.02, 30)
    for method, degree in ((ttc_fast.SlidingLine(1.0), 1), (ttc_fast.SlidingParabola(1.0), 2)):
        tracker = DistanceTracker(method, gate=100.0)
        for stamp, distance in zip(time, distances, strict=True):
            result = tracker.update(distance, stamp)
        recent = time >= time[-1] - 1.0
        *_, slope, level = np.polyfit(time[recent] - time[-1], distances[recent], degree)
        assert result.closing_speed == pytest.approx(-slope, rel=1e-9)
        assert result.distance == pytest.approx(level, rel=1e-9)


def test_noise_may_come_with_each_distance() -> None:
    """What a sensor trusts little moves the answer little."""
    trusted, doubted = DistanceTracker(noise=0.02), DistanceTracker(noise=0.02)
    for tracker in (trusted, doubted):
        fed(tracker, 20.0 - 0.5 * np.arange(20))
    one, other = trusted.update(10.05, 2.0), doubted.update(10.05, 2.0, noise=1.0)
    assert abs(other.closing_speed - 5.0) < abs(one.closing_speed - 5.0) / 10


@pytest.mark.parametrize("car", [1.0, 1.5, 3.0])
def test_heights_in_a_picture(car: float) -> None:
    """The inverse of a height is a distance but for a factor, and no time depends on that; this car is 1.5 m high."""
    rng, focal, pixels = np.random.default_rng(12), 720.0, 0.7
    inside, errors = [], []
    for _ in range(100):
        speed, acceleration, start = rng.uniform(1, 12), rng.choice([-2.0, 0.0, 2.0]), rng.uniform(10, 40)
        tracker = DistanceTracker()
        for stamp in 0.05 * np.arange(40):
            true, closing = start - speed * stamp - acceleration * stamp**2 / 2, speed + acceleration * stamp
            if true < 3:
                break
            height = focal * 1.5 / true + rng.normal(0.0, pixels)
            distance = focal * car / height
            seen = tracker.update(distance, stamp, noise=distance * pixels / height)
            if seen.ttc_interval is not None and closing > 0.3:
                low, high = seen.ttc_interval
                inside.append(low <= true / closing <= high)
                errors.append(abs(seen.ttc * closing / true - 1) if seen.status is Status.CLOSING else math.nan)
    assert 0.85 <= np.mean(inside) <= 0.99
    assert np.nanmedian(errors) < 0.07


def test_threads_may_share_a_tracker() -> None:
    tracker = DistanceTracker()
    start, results = threading.Barrier(4), list[Any]()

    def work(offset: int) -> None:
        start.wait()
        results.extend(tracker.update(20.0, 0.1 * (4 * i + offset)) for i in range(2000))

    threads = [threading.Thread(target=work, args=(offset,)) for offset in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(results) == 8000
    for result in results:
        allowed(result)


@pytest.mark.parametrize("speed", [1.0, 5.0])
@pytest.mark.parametrize("rate", [10.0, 20.0])
def test_what_surely_closes_is_not_said_to_stand(speed: float, rate: float) -> None:
    tracker = ttc_fast.DistanceTracker()
    for frame in range(30):
        seen = tracker.update(20.0 - speed * frame / rate, stamp=frame / rate)
        if seen.status is ttc_fast.Status.NOT_CLOSING:
            low, _ = seen.closing_speed_interval or (-math.inf, math.inf)
            assert low <= 0.05
    assert seen.status is ttc_fast.Status.CLOSING
