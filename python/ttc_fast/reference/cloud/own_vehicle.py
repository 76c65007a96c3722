"""``CloudTracker``: time-to-collision of the body ahead, which is not the vehicle itself.

Where a gate holds the vehicle that carries the sensor, its bonnet is the nearest body, and says for ever that nothing
closes. It keeps its distance while what is beyond moves: then the answer is about what is beyond.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

from ttc_fast._core import Gate
from ttc_fast.reference.arguments import number, shows_settings
from ttc_fast.reference.cloud.tracker import BodyTracker
from ttc_fast.status import Status

if TYPE_CHECKING:
    from ttc_fast._core import Alignment
    from ttc_fast.reference.cloud.estimator import Estimator
    from ttc_fast.reference.tracker.answer import TrackedTTC

REACH = 3.0
"""The vehicle reaches no farther ahead of the sensor than this, m, where ``front_offset`` is not given."""
BEHIND_BUMPER = 0.2
"""With a ``front_offset``, only what is farther behind the bumper than this is the vehicle, m."""
KEEPS = 0.1
"""A body that keeps its distance stays within this of it, m."""
STANDS = 0.05
"""A closing speed up to this is none, m/s."""
NEARER = 0.3
"""A body nearer than the still one by this is another, m."""
WORLD_MOVES = 0.3
"""What is beyond has to move by this, m."""
LONG_ENOUGH = 0.5
"""The near body has to keep its distance for this, s."""
COMES_OUT = 1.0
"""A body that is seen up to this far beyond the reach has come out of it, m."""
UNSEEN = frozenset({Status.LOST, Status.CLEAR, Status.NO_DATA, Status.STALE, Status.INVALID})
"""The statuses of what is beyond in which nothing is seen now."""
GONE = 1.0
"""A still body that was not seen for longer than this is forgotten, s."""


@dataclass(frozen=True)
class StillBody:
    """A body close to the sensor that keeps its distance."""

    distance: float
    """The distance from the sensor that it keeps, m."""
    since: float
    """Stamp since which it has kept it, s."""
    seen: float
    """Stamp at which it was last seen, s."""
    stamp: float
    """Stamp up to which the motion of what is beyond is summed up, s."""
    world_moved: float = 0.0
    """The way that what is beyond has moved meanwhile, m."""
    is_own: bool = False
    """Whether it is the vehicle itself."""
    hides: bool = False
    """Whether another body came so near that it may be between this one and the end of the reach."""

    def after(self, near: TrackedTTC, distance: float | None, beyond: TrackedTTC, stamp: float) -> StillBody | None:
        """Return what is known after another frame; None if the body is gone, or something nearer is there."""
        world_moved = self.world_moved + _moved(beyond) * (stamp - self.stamp)
        now = replace(self, stamp=stamp, world_moved=world_moved, hides=self._hides_after(beyond))
        gone = stamp - self.seen > GONE
        if distance is None:
            return None if gone else now
        if near.closing_speed_interval is None:
            return None if gone or distance < self.distance - NEARER else now
        if abs(distance - self.distance) > KEEPS:
            return StillBody(distance, stamp, stamp, stamp)
        stands = abs(near.closing_speed) <= max(_half(near.closing_speed_interval), STANDS)
        own = stands and world_moved >= WORLD_MOVES and stamp - self.since >= LONG_ENOUGH
        return replace(now, seen=stamp, is_own=self.is_own or own)

    def _hides_after(self, beyond: TrackedTTC) -> bool:
        """Return whether a body may be hidden after another frame: it came to the end of the reach, and not out."""
        if beyond.distance <= REACH + KEEPS:
            return True
        return self.hides and (beyond.status in UNSEEN or beyond.distance > REACH + COMES_OUT)


@shows_settings("gate", "estimator", "method", "front_offset", "jump", "max_gap", "min_closing_speed")
class CloudTracker:
    """Follows the nearest body ahead that is not the vehicle itself, and never two at once.

    Arguments, results and errors are those of ``ttc_fast.CloudTracker``.
    """

    def __init__(
        self,
        gate: Gate | None = None,
        *,
        estimator: Estimator | None = None,
        method: Alignment | None = None,
        front_offset: float = 0.0,
        jump: float = 0.5,
        max_gap: float = 0.5,
        min_closing_speed: float = 0.05,
    ) -> None:
        self._nearest = BodyTracker(
            gate,
            estimator=estimator,
            method=method,
            front_offset=front_offset,
            jump=jump,
            max_gap=max_gap,
            min_closing_speed=min_closing_speed,
        )
        self._settings = self._nearest.settings
        self._beyond = self._beyond_vehicle()
        self._still: StillBody | None = None

    @property
    def own_vehicle(self) -> float | None:
        """How far ahead of the sensor the vehicle itself is seen in the gate, m; None where it is not."""
        return self._still.distance if self._still is not None and self._still.is_own else None

    def update(self, points: Any, stamp: float) -> TrackedTTC:
        """Take a cloud, and say how the body ahead moves."""
        stamp = number("stamp", stamp)
        seen = self._nearest.update(points, stamp)
        if self._beyond is None:
            return seen
        front_offset = self._settings["front_offset"]
        from_sensor = seen.distance + front_offset
        within = front_offset - BEHIND_BUMPER if front_offset > 0 else REACH
        distance = from_sensor if from_sensor < within and seen.status is not Status.LOST else None
        if distance is None and self._still is None:
            self._beyond.reset()
            return seen
        farther = self._beyond.update(points, stamp)
        if seen.status is not Status.INVALID:
            if self._still is not None:
                self._still = self._still.after(seen, distance, farther, stamp)
            elif distance is not None and seen.closing_speed_interval is not None:
                self._still = StillBody(distance, stamp, stamp, stamp)
        if self.own_vehicle is None:
            return seen
        hides = self._still is not None and self._still.hides and front_offset <= 0
        if hides and farther.status in (Status.CLEAR, Status.NOT_CLOSING):
            return replace(farther, status=Status.LOST)
        return farther

    def state(self) -> dict[str, Any]:
        """Return what the tracker remembers, as the kernel's does: either takes up the other's state."""
        still = None if self._still is None else asdict(self._still)
        beyond = BodyTracker(**self._settings) if self._beyond is None else self._beyond
        memory = {**self._nearest.state(), "still": still, "beyond": beyond.state()}
        return {"class": "CloudTracker", "version": 4, **memory}

    def reset(self) -> None:
        """Forget everything."""
        self._nearest.reset()
        self._still = None
        if self._beyond is not None:
            self._beyond.reset()

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from the state of another tracker with the same settings."""
        self._nearest.restore(state)
        self._still = None if state["still"] is None else StillBody(**state["still"])
        if self._beyond is not None:
            self._beyond.restore(state["beyond"])

    def _beyond_vehicle(self) -> BodyTracker | None:
        """Make the tracker of what is beyond the reach of the vehicle; None where the gate ends within it."""
        gate, front_offset = self._settings["gate"], self._settings["front_offset"]
        low, high = gate.x
        low = max(low, front_offset if front_offset > 0 else REACH)
        if low >= high:
            return None
        others = {name: getattr(gate, name) for name in ("y", "z", "intensity", "axes", "curvature", "road", "height")}
        return BodyTracker(**{**self._settings, "gate": Gate(x=(low, high), **others)})


def _half(interval: tuple[float, float]) -> float:
    return (interval[1] - interval[0]) / 2.0


def _moved(body: TrackedTTC) -> float:
    """Return the speed at which a body certainly moves, m/s; 0 where it may stand."""
    if body.closing_speed_interval is None:
        return 0.0
    speed = abs(body.closing_speed)
    return speed if speed > max(_half(body.closing_speed_interval), STANDS) else 0.0
