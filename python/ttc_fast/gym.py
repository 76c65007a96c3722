"""A safety filter for training: a wrapper of Gymnasium that slows an action down before it drives into something.

It needs the extra ``gym``.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ttc_fast._core import ScanSweptPath, ScanTTC
from ttc_fast._extras import missing
from ttc_fast.brake.criteria import StoppingDistance
from ttc_fast.brake.decision import Command
from ttc_fast.brake.unseen import widest_unseen
from ttc_fast.status import Status

try:
    from gymnasium import Wrapper
    from gymnasium.vector import VectorEnv, VectorWrapper
except ImportError as error:
    raise missing("ttc_fast.gym", "gymnasium") from error

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

HORIZON = 10.0
"""The filter looks this far ahead, s."""


_READ = "give SafetyFilter read=, a function of the observation that returns Observed(ranges, speed, yaw_rate)"


class Observed(NamedTuple):
    """What a filter needs of an observation. A vectorised environment has one of each in each row.

    Attributes
    ----------
    ranges : ndarray, shape (beams,) or (B, beams)
        The scan, m, as ``ScanTTC`` reads it.
    speed, yaw_rate : float or ndarray, shape (B,)
        The speed, m/s, negative when reversing, and the yaw rate, rad/s.
    """

    ranges: Any
    speed: Any
    yaw_rate: Any = 0.0


def f1tenth(observation: Any, agent: int = 0) -> Observed:
    """Return what a filter needs of an observation of f1tenth_gym.

    Parameters
    ----------
    observation : dict
        With ``scans``, ``linear_vels_x`` and ``ang_vels_z`` of all agents, or ``scan``, ``linear_vel_x`` and perhaps
        ``ang_vel_z`` of one, or a dict of the latter for each agent.
    agent : int
        The number of the agent.

    Returns
    -------
    Observed

    Raises
    ------
    ValueError
        If it is no dict, or has none of these names.
    """
    if not isinstance(observation, Mapping):
        raise ValueError(f"observation must be a dict, got {type(observation).__name__}: {_READ}")
    if "scans" in observation:
        ranges, *motion = (np.asarray(observation[name]) for name in ("scans", "linear_vels_x", "ang_vels_z"))
        return Observed(ranges[..., agent, :], *(each[..., agent] for each in motion))
    if "scan" in observation and "linear_vel_x" in observation:
        return Observed(observation["scan"], observation["linear_vel_x"], observation.get("ang_vel_z", 0.0))
    inner = [each for each in observation.values() if isinstance(each, dict)]
    if len(inner) > agent and "scan" in inner[agent]:
        return f1tenth(inner[agent])
    raise ValueError(
        f"observation must have scans, linear_vels_x and ang_vels_z as in f1tenth_gym, got the names "
        f"{sorted(observation)}: {_READ}"
    )


class _Filter:
    """The rule of both wrappers, for B vehicles at once. It remembers the newest observation alone.

    A vehicle may be as fast as it can stop in time: on its present arc, and on the one that the action asks for. It is
    told to stop if it is faster than that already, or if its scan shows nothing.
    """

    env: Any

    def __init__(
        self,
        env: Any,
        scan: ScanTTC,
        *,
        stopping: StoppingDistance | None = None,
        read: Callable[[Any], Observed] | None = None,
        wheelbase: float | None = None,
        speed_index: int = 1,
        steering_index: int = 0,
        agent: int = 0,
        unseen_speed: float = 0.0,
    ) -> None:
        super().__init__(env)  # type: ignore[call-arg]
        if not isinstance(scan, ScanTTC):
            raise TypeError(f"scan must be a ScanTTC, got {type(scan).__name__}")
        self._path = ScanSweptPath(scan, horizon=HORIZON)
        self._stopping = StoppingDistance() if stopping is None else stopping
        self._read = partial(f1tenth, agent=agent) if read is None else read
        self._agent, self._wheelbase = agent, wheelbase
        self._speed_index, self._steering_index = speed_index, steering_index
        self._unseen_speed = unseen_speed
        self._unseen_ahead, self._unseen_behind = unseen(self._path, 1.0), unseen(self._path, -1.0)
        self._newest: Any = None

    def reset(self, **how: Any) -> tuple[Any, dict[str, Any]]:
        """Reset what is wrapped."""
        self._newest, info = self.env.reset(**how)
        return self._newest, info

    def _columns(self, actions: Any, rows: int | None) -> Any:
        """Return the last axis of the vehicle's actions as a view, of shape (B, ...)."""
        actions = np.asarray(actions)
        mine = actions if actions.ndim <= (1 if rows is None else 2) else actions[..., self._agent, :]
        return mine[np.newaxis] if rows is None else mine

    def _filtered(self, action: Any, rows: int | None) -> tuple[Any, dict[str, Any]]:
        """Return an action that is no faster than is safe, and what it was decided by."""
        if self._newest is None:
            raise RuntimeError("step() came before reset(): call reset() first, which gives the first observation")
        observed = self._read(self._newest)
        ranges = np.atleast_2d(np.asarray(observed.ranges))
        count = len(ranges)
        ranges = ranges if ranges.dtype in (np.float32, np.float64) else ranges.astype(np.float64)
        speed, yaw_rate = (np.broadcast_to(np.asarray(each, np.float64).reshape(-1), (count,)) for each in observed[1:])
        filtered = np.array(action)
        if filtered.dtype.kind != "f":
            filtered = filtered.astype(np.float64)
        columns = self._columns(filtered, rows)
        wanted = columns[..., self._speed_index].astype(np.float64)
        self._check(wanted, "speed", self._speed_index)
        curvature = np.divide(yaw_rate, speed, out=np.zeros(count), where=np.abs(speed) > 0.05)
        asked = curvature
        if self._wheelbase is not None:
            steering = columns[..., self._steering_index].astype(np.float64)
            self._check(steering, "steering angle", self._steering_index)
            asked = np.tan(steering) / self._wheelbase
        # Both arcs are asked for at a speed at which the horizon is far enough, and answered in m.
        pace = np.maximum(np.maximum(np.abs(speed), np.abs(wanted)), 1.0)
        going = np.where(wanted < 0.0, -pace, pace)
        now = np.where(speed < 0.0, -pace, pace)
        motions = np.concatenate([now, going]), np.concatenate([now * curvature, going * asked])
        nearest = self._path.nearest(np.concatenate([ranges, ranges]), *motions)
        ttc, status = np.asarray(nearest.ttc), np.asarray(nearest.status)
        ahead = (ttc * np.concatenate([pace, pace])).reshape(2, count)
        ahead[0, np.abs(speed) < 0.05] = np.inf  # it stands, and goes where it is told
        clearance = ahead.min(axis=0)
        limit = self._fastest(clearance)
        blind = status[:count] == Status.NO_DATA
        into_unseen = self._unseen_ahead & ((wanted > 0.0) | (speed > 0.05))
        into_unseen |= self._unseen_behind & ((wanted < 0.0) | (speed < -0.05))
        limit = np.where(blind, 0.0, np.where(into_unseen, np.minimum(limit, self._unseen_speed), limit))
        must = np.abs(speed) > np.where(np.abs(speed) < 0.05, np.inf, limit)
        allowed = np.where(must, 0.0, limit)
        clipped = np.clip(wanted, -allowed, allowed)
        command = np.where(must | blind, Command.BRAKE, np.where(clipped != wanted, Command.WARN, Command.NONE))
        columns[..., self._speed_index] = clipped
        return filtered, {
            "command": command,
            "status": status.reshape(2, count).max(axis=0),
            "ttc": ttc.reshape(2, count).min(axis=0),
            "clearance": clearance,
            "speed_limit": allowed,
            "wanted_speed": wanted,
            "clipped": clipped != wanted,
        }

    def _check(self, asked: Floats, what: str, index: int) -> None:
        """Raise if what an action asks for is not finite: no clipping makes sense of it."""
        wrong = ~np.isfinite(asked)
        if wrong.any():
            row = int(np.flatnonzero(wrong)[0])
            where = f" of environment {row}" if len(asked) > 1 else ""
            raise ValueError(
                f"action must be finite: its {what}, at index {index},{where} is {asked[row]}. A network that has "
                "diverged gives such numbers: find out where its NaN begin, or replace them before step(), as by "
                "np.nan_to_num"
            )

    def _fastest(self, clearance: Floats) -> Floats:
        """Return the speed from which a vehicle stops in a distance, m/s: the root of the stopping distance."""
        rule = self._stopping
        left = np.maximum(clearance - rule.margin, 0.0)
        coasting = rule.deceleration * rule.reaction_time
        with np.errstate(invalid="ignore"):
            speed = np.sqrt(coasting * coasting + 2.0 * rule.deceleration * left) - coasting
        return np.where(np.isinf(left), np.inf, speed)


class SafetyFilter(_Filter, Wrapper):
    """Slow an action down before it drives into something.

    Each action is held against the newest observation: the vehicle may be as fast as it can stop in time, on its
    present arc and on the one that the action asks for. A faster action is clipped. The vehicle is told to stop if it
    is faster than that already, or if its scan shows nothing. The filter remembers nothing, so that what an agent sees
    stays a Markov process. For the votes and the watchdog of a real car there is ``BrakeController``.

    It reads actions in m/s and rad and observations in m and m/s, so it is the innermost wrapper: wrappers that rescale
    or normalise these go around it, as in ``RescaleAction(SafetyFilter(env, scan), -1.0, 1.0)``. An action of 1 that is
    rescaled inside of it would be taken for 1 m/s.

    A vectorised environment is wrapped as well: all of its scans are read in one call of the kernel, and what is below
    a number is an array then, with an entry for each environment.

    Parameters
    ----------
    env : gymnasium.Env or gymnasium.vector.VectorEnv
        The environment.
    scan : ScanTTC
        The scanner, with the vehicle's outline.
    stopping : StoppingDistance, optional
        Deceleration, reaction time and margin of the vehicle.
    read : callable, optional
        A function that returns ``Observed(ranges, speed, yaw_rate)`` of an observation. The default is ``f1tenth``, for
        the agent.
    wheelbase : float, optional
        Distance between the axles, m. With it the steering angle of the action says which arc it asks for; without
        it, that is the present one.
    speed_index, steering_index : int, default 1 and 0
        Where speed, m/s, and steering angle, rad, are in an action.
    agent : int, default 0
        Which agent is filtered, where observations and actions have several.
    unseen_speed : float, default 0.0
        How fast the vehicle may go where the scanner does not look, m/s: back with a scanner that sees only the front.

    Raises
    ------
    TypeError
        If ``scan`` is no ``ScanTTC``.
    ValueError
        If the scanner has no outline, or an observation does not have the names.

    Notes
    -----
    ``step`` raises a ValueError for an action that is not finite, and a RuntimeError before the first ``reset``. The
    environment has not moved then.

    ``info["safety"]`` of each step has ``command`` (BRAKE if it was told to stop, WARN if the action was clipped, else
    NONE), ``status``, ``ttc`` (s, at the speed that was asked for, at least 1 m/s), ``clearance`` (the length of the
    way that is left, m), ``speed_limit`` (m/s), ``wanted_speed`` (m/s) and ``clipped``.

    Examples
    --------
    >>> import gymnasium, numpy as np                                              # doctest: +SKIP
    >>> from ttc_fast import ScanTTC
    >>> from ttc_fast.gym import SafetyFilter
    >>> scan = ScanTTC(-2.35, 4.7 / 1079, 1080, range_max=30.0, outline=(-0.29, 0.29, -0.155, 0.155))
    >>> env = SafetyFilter(gymnasium.make("f1tenth_gym:f1tenth-v0"), scan)         # doctest: +SKIP
    >>> observation, info = env.reset()                                            # doctest: +SKIP
    >>> observation, *_, info = env.step(np.array([[0.0, 8.0]]))                   # doctest: +SKIP
    >>> info["safety"]["speed_limit"]                                              # doctest: +SKIP
    5.1
    """

    def __new__(cls, env: Any, *arguments: Any, **settings: Any) -> Any:
        """Wrap a vectorised environment by ``VectorSafetyFilter``."""
        if isinstance(env, VectorEnv):
            return VectorSafetyFilter(env, *arguments, **settings)
        return super().__new__(cls)

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Step the environment with the action as it is safe."""
        filtered, said = self._filtered(action, None)
        self._newest, reward, terminated, truncated, info = self.env.step(filtered)
        one = {name: values[0].item() for name, values in said.items()}
        one |= {"command": Command(one["command"]), "status": Status(one["status"])}
        return self._newest, reward, terminated, truncated, {**info, "safety": one}


class VectorSafetyFilter(_Filter, VectorWrapper):
    """The ``SafetyFilter`` of a vectorised environment, with its parameters."""

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Step the environments with the actions as they are safe."""
        filtered, said = self._filtered(actions, self.env.num_envs)
        self._newest, reward, terminated, truncated, info = self.env.step(filtered)
        return self._newest, reward, terminated, truncated, {**info, "safety": said}


def unseen(path: ScanSweptPath, speed: float) -> bool:
    """Return whether no beam looks at a part of the path straight ahead or back that is too wide to be left unseen."""
    return path.unseen(speed, ahead=1.0) > widest_unseen(path.scan.outline or (0.0, 0.0, 0.0, 0.0))
