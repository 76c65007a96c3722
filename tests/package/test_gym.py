"""`ttc_fast.gym.SafetyFilter` on a real Gymnasium environment: a car in a box, alone and several at once."""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
import pytest

from ttc_fast import Command, ScanTTC, Status, StoppingDistance

gymnasium: Any = pytest.importorskip("gymnasium", reason="needs gymnasium: pip install '.[gym]'")

from ttc_fast.gym import Observed, SafetyFilter, VectorSafetyFilter, f1tenth  # noqa: E402

BEAMS, VIEW, HALF = 181, 4.7, 5.0
ANGLES = np.linspace(-VIEW / 2.0, VIEW / 2.0, BEAMS)
OUTLINE = (-0.125, 0.455, -0.155, 0.155)
WHEELBASE, STEP = 0.33, 0.05


def scanner() -> ScanTTC:
    return ScanTTC(ANGLES[0], VIEW / (BEAMS - 1), BEAMS, range_max=30.0, mount=(0.27, 0.0, 0.0), outline=OUTLINE)


class Box(gymnasium.Env):  # type: ignore[misc]
    """A car in a square room of 10 m: steering angle and speed in, scan, speed and yaw rate out."""

    def __init__(self, several: bool = False, blind_from: float = math.inf) -> None:
        self.several, self.blind_from = several, blind_from
        shape = (1, 2) if several else (2,)
        self.action_space = gymnasium.spaces.Box(-20.0, 20.0, shape, np.float64)
        self.observation_space = gymnasium.spaces.Dict(
            {
                name: gymnasium.spaces.Box(-np.inf, np.inf, size, np.float64)
                for name, size in (("scan", (BEAMS,)), ("linear_vel_x", ()), ("ang_vel_z", ()))
            }
        )
        if several:
            self.observation_space = gymnasium.spaces.Dict(
                {
                    name: gymnasium.spaces.Box(-np.inf, np.inf, size, np.float64)
                    for name, size in (("scans", (1, BEAMS)), ("linear_vels_x", (1,)), ("ang_vels_z", (1,)))
                }
            )

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        self.x, self.y = self.np_random.uniform(-1.0, 1.0, 2)
        self.heading = float(self.np_random.uniform(-math.pi, math.pi))
        self.speed = self.yaw_rate = self.time = 0.0
        return self._see(), {}

    def _see(self) -> Any:
        x, y = self.x + 0.27 * math.cos(self.heading), self.y + 0.27 * math.sin(self.heading)
        cos, sin = np.cos(ANGLES + self.heading), np.sin(ANGLES + self.heading)
        with np.errstate(divide="ignore"):
            ranges = np.minimum((HALF - np.sign(cos) * x) / np.abs(cos), (HALF - np.sign(sin) * y) / np.abs(sin))
        if self.time >= self.blind_from:
            ranges = np.full(BEAMS, np.nan)
        if self.several:
            return {
                "scans": ranges[None],
                "linear_vels_x": np.array([self.speed]),
                "ang_vels_z": np.array([self.yaw_rate]),
            }
        return {"scan": ranges, "linear_vel_x": np.array(self.speed), "ang_vel_z": np.array(self.yaw_rate)}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        steering, wanted = np.asarray(action).reshape(-1)
        for _ in range(5):
            self.speed += float(np.clip(wanted - self.speed, -6.0 * STEP / 5, 4.0 * STEP / 5))
            self.yaw_rate = self.speed * math.tan(np.clip(steering, -0.4, 0.4)) / WHEELBASE
            self.yaw_rate = float(np.clip(self.yaw_rate, -10.0 / max(self.speed, 1.0), 10.0 / max(self.speed, 1.0)))
            self.heading += self.yaw_rate * STEP / 5
            self.x += self.speed * math.cos(self.heading) * STEP / 5
            self.y += self.speed * math.sin(self.heading) * STEP / 5
        self.time += STEP
        corners = [(x, y) for x in OUTLINE[:2] for y in OUTLINE[2:]]
        cos, sin = math.cos(self.heading), math.sin(self.heading)
        places = [(self.x + u * cos - v * sin, self.y + u * sin + v * cos) for u, v in corners]
        hit = any(max(abs(x), abs(y)) >= HALF for x, y in places)
        return self._see(), -1.0 if hit else self.speed * STEP, hit, False, {"mine": 1}


def drive(env: Any, seed: int, steps: int = 200) -> tuple[bool, list[dict[str, Any]], float]:
    """Full speed and a steering angle at random; whether it hit, what the filter said, and how far it came."""
    rng = np.random.default_rng(seed)
    _, _ = env.reset(seed=seed)
    said, way, angle = [], 0.0, 0.0
    for at in range(steps):
        if at % 8 == 0:
            angle = rng.uniform(-0.1, 0.1)
        action = np.array([angle, 4.0])
        _, reward, hit, _, info = env.step(action[None] if env.unwrapped.several else action)
        said.append(info.get("safety", {}))
        assert info["mine"] == 1
        if hit:
            return True, said, way
        way += reward
    return False, said, way


def settings() -> dict[str, Any]:
    return {"stopping": StoppingDistance(4.0, 0.2, 0.3), "wheelbase": WHEELBASE}


@pytest.mark.parametrize("several", [False, True])
def test_it_keeps_a_random_agent_from_the_walls(several: bool) -> None:
    ways = []
    for seed in range(12):
        assert drive(Box(several), seed)[0]
        hit, said, way = drive(SafetyFilter(Box(several), scanner(), **settings()), seed)
        assert not hit
        assert {each["command"] for each in said} <= set(Command)
        assert any(each["clipped"] for each in said)
        ways.append(way)
    assert np.median(ways) > 3.0, "it drives all the same"


def test_what_it_says_of_an_action() -> None:
    env: Any = SafetyFilter(Box(), scanner(), stopping=StoppingDistance(6.0, 0.1, 0.2))
    env.reset(seed=1)
    env.unwrapped.x, env.unwrapped.y, env.unwrapped.heading = 0.0, 0.0, 0.0
    env._newest = env.unwrapped._see()
    _, _, _, _, info = env.step(np.array([0.0, 20.0]))
    safety = info["safety"]
    left = HALF - OUTLINE[1]
    assert safety["clearance"] == pytest.approx(left, abs=1e-6)
    fastest = safety["speed_limit"]
    assert fastest * 0.1 + fastest**2 / 12.0 + 0.2 == pytest.approx(left, abs=1e-6)
    assert (safety["command"], safety["status"], safety["clipped"]) == (Command.WARN, Status.CLOSING, True)
    assert safety["wanted_speed"] == 20.0
    _, _, _, _, info = env.step(np.array([0.0, 1.0]))
    assert (info["safety"]["command"], info["safety"]["clipped"]) == (Command.NONE, False)


def test_too_fast_already_is_told_to_stop() -> None:
    env: Any = SafetyFilter(Box(), scanner())
    env.reset(seed=1)
    car = env.unwrapped
    car.x, car.y, car.heading, car.speed = 3.0, 0.0, 0.0, 5.0
    env._newest = car._see()
    _, _, _, _, info = env.step(np.array([0.0, 5.0]))
    assert (info["safety"]["command"], info["safety"]["speed_limit"]) == (Command.BRAKE, 0.0)
    assert car.speed < 5.0


def test_a_blind_scanner_stops_it() -> None:
    env: Any = SafetyFilter(Box(blind_from=0.2), scanner())
    env.reset(seed=1)
    for _ in range(60):
        _, _, _, _, info = env.step(np.array([0.0, 2.0]))
    assert (info["safety"]["command"], info["safety"]["status"]) == (Command.BRAKE, Status.NO_DATA)
    assert env.unwrapped.speed == pytest.approx(0.0, abs=1e-9)


def test_it_does_not_reverse_where_it_does_not_look() -> None:
    env: Any = SafetyFilter(Box(), scanner())
    env.reset(seed=1)
    env.step(np.array([0.0, -2.0]))
    assert env.unwrapped.speed == 0.0
    slow: Any = SafetyFilter(Box(), scanner(), unseen_speed=0.3)
    slow.reset(seed=1)
    for _ in range(5):
        _, _, _, _, info = slow.step(np.array([0.0, -2.0]))
    assert slow.unwrapped.speed == pytest.approx(-0.3)
    assert info["safety"]["speed_limit"] == pytest.approx(0.3)


@pytest.mark.parametrize("blinded", [{"mask": np.abs(ANGLES) < 0.6}, {"mount": (-0.1, 0.0, math.pi)}], ids=str)
def test_it_does_not_drive_ahead_where_it_does_not_look(blinded: dict[str, Any]) -> None:
    behind = ScanTTC(ANGLES[0], VIEW / (BEAMS - 1), BEAMS, range_max=30.0, outline=OUTLINE, **blinded)
    env: Any = SafetyFilter(Box(), behind)
    env.reset(seed=1)
    for _ in range(60):
        env.step(np.array([0.0, 5.0]))
    assert env.unwrapped.speed == 0.0


@pytest.mark.parametrize("several", [False, True])
def test_several_environments_are_as_each_alone(several: bool) -> None:
    count = 5
    batch = SafetyFilter(gymnasium.vector.SyncVectorEnv([lambda: Box(several)] * count), scanner(), **settings())
    assert isinstance(batch, VectorSafetyFilter)
    alone = [SafetyFilter(Box(several), scanner(), **settings()) for _ in range(count)]
    batch.reset(seed=list(range(count)))
    for seed, env in enumerate(alone):
        env.reset(seed=seed)
    rng = np.random.default_rng(3)
    for _ in range(30):
        actions = np.column_stack([rng.uniform(-0.3, 0.3, count), rng.uniform(0.0, 8.0, count)])
        given = actions[:, None] if several else actions
        before = given.copy()
        seen, _, hit, _, info = batch.step(given)
        np.testing.assert_array_equal(given, before, err_msg="the action was written to")
        assert not hit.any()
        for at, env in enumerate(alone):
            own, _, _, _, own_info = env.step(given[at])
            for name, value in own_info["safety"].items():
                assert info["safety"][name][at] == value, name
            for name, value in own.items():
                np.testing.assert_array_equal(seen[name][at], value)


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
def test_an_action_that_is_not_finite_is_refused_before_anything_moves(wrong: float) -> None:
    env: Any = SafetyFilter(Box(), scanner(), **settings())
    env.reset(seed=1)
    before = env.unwrapped.x, env.unwrapped.time
    for action, what in (([0.0, wrong], "speed, at index 1, is"), ([wrong, 1.0], "steering angle, at index 0, is")):
        with pytest.raises(ValueError, match=f"action must be finite: its {what}.*nan_to_num"):
            env.step(np.array(action))
    assert (env.unwrapped.x, env.unwrapped.time) == before
    assert env.step(np.array([0.0, 1.0]))[-1]["safety"]["command"] is Command.NONE


def test_a_step_before_the_first_reset_says_so() -> None:
    several: Any = SafetyFilter(gymnasium.vector.SyncVectorEnv([Box, Box]), scanner(), **settings())
    for env, action in ((SafetyFilter(Box(), scanner(), **settings()), [0.0, 1.0]), (several, [[0.0, 1.0]] * 2)):
        with pytest.raises(RuntimeError, match=r"step\(\) came before reset\(\): call reset\(\) first"):
            env.step(np.array(action))


def test_of_several_environments_it_says_which() -> None:
    several: Any = SafetyFilter(gymnasium.vector.SyncVectorEnv([Box, Box, Box]), scanner(), **settings())
    several.reset(seed=1)
    with pytest.raises(ValueError, match=r"its speed, at index 1, of environment 2 is nan"):
        several.step(np.array([[0.0, 1.0], [0.0, 2.0], [0.0, math.nan]]))


def test_other_names_are_read_by_a_function() -> None:
    class Named(Box):
        def _see(self) -> Any:
            seen = super()._see()
            return {"lidar": seen["scan"].astype(np.float32), "v": seen["linear_vel_x"]}

    env: Any = SafetyFilter(Named(), scanner(), read=lambda seen: Observed(seen["lidar"], seen["v"]))
    assert not drive(env, 3)[0]
    nameless = SafetyFilter(Named(), scanner())
    nameless.reset(seed=1)
    with pytest.raises(ValueError, match="observation must have scans"):
        nameless.step(np.array([0.0, 1.0]))


def test_names_of_f1tenth_gym() -> None:
    scans, speeds = np.arange(6.0).reshape(2, 3), np.array([1.0, 2.0])
    old = {"scans": scans, "linear_vels_x": speeds, "ang_vels_z": speeds / 10.0}
    assert f1tenth(old, 1)[1:] == (2.0, 0.2)
    np.testing.assert_array_equal(f1tenth(old, 1).ranges, scans[1])
    new = {"agent_0": {"scan": scans[0], "linear_vel_x": 1.0}, "agent_1": {"scan": scans[1], "linear_vel_x": 2.0}}
    assert f1tenth(new, 1)[1:] == (2.0, 0.0)


def test_an_environment_without_a_scan() -> None:
    """The observations of CartPole are an array of four numbers."""
    env = SafetyFilter(gymnasium.make("CartPole-v1"), scanner())
    env.reset()
    with pytest.raises(ValueError, match=r"observation must be a dict, got ndarray: give SafetyFilter read="):
        env.step(0)


def test_a_scanner_that_is_none() -> None:
    nothing: Any = None
    with pytest.raises(TypeError, match="scan must be a ScanTTC"):
        SafetyFilter(Box(), nothing)
    with pytest.raises(ValueError, match="outline"):
        SafetyFilter(Box(), ScanTTC(0.0, 0.1, 3))


def test_without_gymnasium_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    monkeypatch.delitem(sys.modules, "ttc_fast.gym")
    with pytest.raises(ImportError, match=r"pip install '\.\[gym\]'"):
        import ttc_fast.gym  # noqa: F401
