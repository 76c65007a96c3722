"""The nearest body in a gate, from cloud to cloud: how far it is, and how it moves."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast._core import Alignment
from ttc_fast.reference.alignment.fit import Trend, trend
from ttc_fast.reference.alignment.profile import Profile, Sighting, profile
from ttc_fast.reference.arguments import finite, non_negative, number
from ttc_fast.reference.cloud.estimator import checked_estimator, nearest
from ttc_fast.reference.cloud.gate import candidates, checked_gate
from ttc_fast.reference.points import cloud
from ttc_fast.reference.tracker.answer import TrackedTTC, bounded, nothing, only_where
from ttc_fast.status import Detection, Status

if TYPE_CHECKING:
    from ttc_fast._core import Gate
    from ttc_fast.reference.cloud.estimator import Estimator
    from ttc_fast.reference.cloud.gate import Candidates

ENOUGH = 3
"""The fewest frames that a closing speed needs."""
MOST = 16
"""The most frames that are kept: of those in the window, the last."""
FASTEST = 60.0
"""The fastest closing speed of two cars, m/s."""
HARDEST = 20.0
"""The fastest change of a closing speed, m/s^2."""
NINE_TENTHS = 1.645
"""Nine tenths of a normal distribution are within this many standard deviations."""
PATIENCE = 0.8
"""A cloud that is repeated for longer than this part of ``max_gap`` shows a scene that stands."""
ACCELERATION = 1.6
"""Standard deviation of the acceleration of a body that is predicted, m/s^2."""


@dataclass
class Body:
    """A body and its sightings."""

    sightings: list[Sighting] = field(default_factory=list)
    """The sightings, oldest first."""
    trend: Trend | None = None
    """The motion at the last of them."""

    def forget(self, stamp: float, window: float, max_gap: float) -> None:
        """Forget sightings that are too old, and all of them if the body was gone for too long."""
        gone = bool(self.sightings) and stamp - self.sightings[-1].stamp > max_gap
        # Stamps are rounded, so a sighting at the end of the window counts.
        oldest = window * (1.0 + 1e-6)
        self.sightings = [each for each in self.sightings if not gone and stamp - each.stamp <= oldest]
        if not self.sightings:
            self.trend = None

    def continues(self, now: Sighting, jump: float) -> bool:
        """Whether a sighting belongs to this body."""
        if not self.sightings:
            return False
        last = self.sightings[-1]
        dt = now.stamp - last.stamp
        if self.trend is not None:
            edge, speed = self.trend.distance, self.trend.closing_speed
        elif len(self.sightings) > 1:
            before = self.sightings[-2]
            edge, speed = last.edge, (before.edge - last.edge) / (last.stamp - before.stamp)
        else:
            return abs(now.edge - last.edge) <= jump + FASTEST * dt
        return abs(now.edge - (edge - speed * dt)) <= jump + HARDEST * dt * dt / 2.0

    @property
    def unchanged_since(self) -> float | None:
        """Stamp of the oldest sighting since which the body has looked the same to the bit."""
        since = None
        for sighting in reversed(self.sightings):
            if not _looks_like(sighting, self.sightings[-1]):
                break
            since = sighting.stamp
        return since

    def is_repeated_by(self, now: Sighting, patience: float) -> bool:
        """Whether a sighting is the last one handed over again; after ``patience`` (s) the body stands."""
        since = self.unchanged_since
        return since is not None and _looks_like(now, self.sightings[-1]) and now.stamp - since < patience

    def add(self, sighting: Sighting, settings: Alignment) -> None:
        """Add a sighting, and find the motion anew."""
        self.sightings = [*self.sightings, sighting][-MOST:]
        found = trend(self.sightings, settings) if len(self.sightings) >= ENOUGH else None
        possible = found is not None and found.variance >= 0 and all(math.isfinite(number) for number in found)
        self.trend = found if possible else None


class BodyTracker:
    """Follows the nearest body in a gate, and never two at once."""

    def __init__(
        self,
        gate: Gate | None,
        *,
        estimator: Estimator | None,
        method: Alignment | None,
        front_offset: float,
        jump: float,
        max_gap: float,
        min_closing_speed: float,
    ) -> None:
        self._gate, self._estimator = checked_gate(gate), checked_estimator(estimator)
        if method is not None and not isinstance(method, Alignment):
            raise TypeError(f"method must be an Alignment, got {method!r}")
        self._method = Alignment() if method is None else method
        self._front_offset = finite("front_offset", front_offset)
        self._jump, self._max_gap = _positive("jump", jump), _positive("max_gap", max_gap)
        self._min_closing_speed = non_negative("min_closing_speed", min_closing_speed)
        self.settings: dict[str, Any] = {
            "gate": self._gate,
            "estimator": self._estimator,
            "method": self._method,
            "front_offset": self._front_offset,
            "jump": self._jump,
            "max_gap": self._max_gap,
            "min_closing_speed": self._min_closing_speed,
        }
        self._stamp: float | None = None
        self._present, self._shelved = Body(), Body()

    def update(self, points: Any, stamp: float) -> TrackedTTC:
        """Take a cloud, and say how the body ahead moves."""
        stamp = number("stamp", stamp)
        seen = cloud("points", points)
        found = nearest(seen, self._gate, self._estimator)
        if not math.isfinite(stamp) or (self._stamp is not None and stamp <= self._stamp):
            return replace(self._answer(too_few=False), status=Status.INVALID)
        self._stamp = stamp
        for body in (self._present, self._shelved):
            body.forget(stamp, self._method.window, self._max_gap)
        if found.detection is Detection.NO_DATA:
            return nothing(Status.NO_DATA, math.nan)
        if found.detection is Detection.CLEAR:
            return self._coast(stamp)
        too_few = found.detection is Detection.TOO_FEW
        edge = found.nearest_x if too_few else found.x
        sighting = Sighting(stamp, edge, self._profile(candidates(seen, self._gate), edge))
        cells = sighting.profile
        if not (math.isfinite(edge) and np.isfinite([cells.count, cells.x, cells.z]).all()):  # sums that overflowed
            return only_where(Status.WARMING_UP, edge - self._front_offset)
        if not self._present.is_repeated_by(sighting, PATIENCE * self._max_gap):
            self._follow(sighting)
        return self._answer(too_few)

    def state(self) -> dict[str, Any]:
        """Return what is remembered."""
        return {"stamp": self._stamp, "present": _state(self._present), "shelved": _state(self._shelved)}

    def reset(self) -> None:
        """Forget everything."""
        self._stamp = None
        self._present, self._shelved = Body(), Body()

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from the state of another tracker with the same settings."""
        self._stamp = state["stamp"]
        self._present, self._shelved = _body(state["present"]), _body(state["shelved"])

    def _profile(self, inside: Candidates, edge: float) -> Profile:
        """Sum up the side of the body that faces the sensor, up to ``depth`` behind its edge."""
        body = inside.x <= edge + self._method.depth
        ahead, (_, left, up) = inside.x[body], inside.position[body].T
        return profile(ahead, left, up, self._method)

    def _follow(self, sighting: Sighting) -> None:
        """Give a sighting to the body that it belongs to, or begin another."""
        if not self._present.continues(sighting, self._jump):
            if self._shelved.continues(sighting, self._jump):
                self._present, self._shelved = self._shelved, Body()
            else:
                # A body whose motion was never found is not worth coming back to.
                if self._present.trend is not None:
                    self._shelved = self._present
                self._present = Body()
        self._present.add(sighting, self._method)

    def _answer(self, too_few: bool) -> TrackedTTC:
        """Give the answer about the body at its last sighting."""
        trend, sightings = self._present.trend, self._present.sightings
        if trend is None:
            edge = sightings[-1].edge if sightings else math.nan
            return replace(only_where(Status.WARMING_UP, edge - self._front_offset), age=self._age)
        later = self._stamp - sightings[-1].stamp if self._stamp is not None else 0.0
        speed = trend.closing_speed
        distance = trend.distance - speed * later - self._front_offset
        spread = NINE_TENTHS * math.sqrt(trend.variance + (ACCELERATION * later) ** 2)
        # The first that holds.
        cases = {
            Status.CONTACT: distance <= 0,
            Status.TOO_FEW: too_few,
            Status.CLOSING: speed > self._min_closing_speed,
            Status.NOT_CLOSING: True,
        }
        # The error of the distance counts by its share in the time.
        noise = self._method.range_noise
        either_way = math.hypot(spread, speed * NINE_TENTHS * noise / max(distance, noise))
        return TrackedTTC(
            ttc=self._time_to(distance, speed),
            ttc_interval=(
                bounded(_time(distance, speed + either_way)),
                bounded(_time(distance, speed - either_way)),
            ),
            distance=distance,
            closing_speed=speed,
            closing_speed_interval=(speed - spread, speed + spread),
            status=next(status for status, holds in cases.items() if holds),
            age=self._age,
        )

    @property
    def _age(self) -> float:
        """The time since the newest cloud that was not the one before again, s; infinite without a body."""
        since = self._present.unchanged_since
        return math.inf if since is None or self._stamp is None else self._stamp - since

    def _time_to(self, distance: float, speed: float) -> float:
        """Give the time-to-collision, s; infinite where the gap does not close."""
        return _time(distance, speed) if speed > self._min_closing_speed else math.inf

    def _coast(self, stamp: float) -> TrackedTTC:
        """Give the answer when nothing is ahead: the body that was there a moment ago goes on as it did."""
        trend, sightings = self._present.trend, self._present.sightings
        if not sightings:
            return nothing(Status.CLEAR, math.inf)
        if trend is None:
            return nothing(Status.LOST, math.nan)
        speed = trend.closing_speed
        distance = trend.distance - speed * (stamp - sightings[-1].stamp) - self._front_offset
        lost = nothing(Status.LOST, distance)
        return replace(lost, ttc=self._time_to(distance, speed), closing_speed=speed, age=self._age)


def _looks_like(one: Sighting, other: Sighting) -> bool:
    """Whether two frames show the same, to the bit."""
    cells = zip(vars(one.profile).values(), vars(other.profile).values(), strict=True)
    return one.edge == other.edge and all(np.array_equal(a, b) for a, b in cells)


def _time(distance: float, closing_speed: float) -> float:
    """Give the time to cover ``distance`` at a constant speed, s; 0 in contact, infinite where nothing closes."""
    return max(distance, 0.0) / closing_speed if closing_speed > 0 else math.inf


def _state(body: Body) -> dict[str, Any]:
    def cells(profile: Profile) -> list[list[float]]:
        columns = profile.column, profile.level, profile.count, profile.x, profile.z
        cells: list[list[float]] = np.column_stack(columns).tolist()
        return cells

    sightings = [{"stamp": it.stamp, "edge": it.edge, "cells": cells(it.profile)} for it in body.sightings]
    return {"sightings": sightings, "trend": None if body.trend is None else list(body.trend)}


def _body(state: dict[str, Any]) -> Body:
    def profile(cells: list[list[float]]) -> Profile:
        column, level, count, x, z = np.array(cells, np.float64).reshape(-1, 5).T
        return Profile(column.astype(np.int64), level.astype(np.int64), count, x, z)

    sightings = [Sighting(it["stamp"], it["edge"], profile(it["cells"])) for it in state["sightings"]]
    return Body(sightings, None if state["trend"] is None else Trend(*state["trend"]))


def _positive(argument: str, value: Any) -> float:
    result = number(argument, value)
    if not result > 0:
        raise ValueError(f"{argument} must be above 0, got {result}")
    return result
