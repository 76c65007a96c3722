"""``CloudTracker``: time-to-collision of the body ahead, from cloud to cloud."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast._core import Alignment
from ttc_fast.reference.alignment import Sighting, Trend, trend
from ttc_fast.reference.arguments import finite, number
from ttc_fast.reference.cloud import nearest
from ttc_fast.reference.estimators import checked_estimator
from ttc_fast.reference.gate import candidates, checked_gate
from ttc_fast.reference.points import cloud
from ttc_fast.reference.profile import Profile, profile
from ttc_fast.status import Detection, Status

if TYPE_CHECKING:
    from ttc_fast._core import Gate
    from ttc_fast.reference.estimators import Estimator

ENOUGH = 3
"""Frames that a closing speed needs."""
MOST = 16
"""More frames than this are not kept: of those in the window, the last."""
FASTEST = 60.0
"""No two cars close faster, m/s."""
HARDEST = 20.0
"""Closing speeds don't change faster, m/s^2."""
NINE_TENTHS = 1.645
"""Of a normal distribution, nine tenths are within so many standard deviations."""


@dataclass(frozen=True)
class TrackedTTC:
    """Time-to-collision of the body ahead, and what is known of it."""

    ttc: float
    """s, in [0, inf]; inf where nothing closes or too little is known."""
    ttc_interval: tuple[float, float] | None
    """The truth is in here nine times of ten, s."""
    distance: float
    """From the bumper, m. inf when clear, NaN where nothing is known."""
    closing_speed: float
    """m/s, positive when approaching; NaN where it is not known."""
    closing_speed_interval: tuple[float, float] | None
    """The truth is in here nine times of ten, m/s."""
    status: Status
    """What it means."""


class CloudTracker:
    """Follows the nearest body ahead, and never two at once.

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
    ) -> None:
        self._gate, self._estimator = checked_gate(gate), checked_estimator(estimator)
        if method is not None and not isinstance(method, Alignment):
            raise TypeError(f"method must be an Alignment, got {method!r}")
        self._method = Alignment() if method is None else method
        self._front_offset = finite("front_offset", front_offset)
        self._jump, self._max_gap = _positive("jump", jump), _positive("max_gap", max_gap)
        self._stamp: float | None = None
        self._sightings: list[Sighting] = []
        self._trend: Trend | None = None

    def update(self, points: Any, stamp: float) -> TrackedTTC:
        """Take in a cloud, and say how the body ahead moves."""
        stamp = number("stamp", stamp)
        seen = cloud("points", points)
        found = nearest(seen, self._gate, self._estimator)
        if not math.isfinite(stamp) or (self._stamp is not None and stamp <= self._stamp):
            return _unknown(Status.INVALID, math.nan)
        self._stamp = stamp
        self._forget(stamp)
        if found.detection is Detection.NO_DATA:
            return _unknown(Status.NO_DATA, math.nan)
        if found.detection is Detection.CLEAR:
            return self._coast(stamp)
        too_few = found.detection is Detection.TOO_FEW
        edge = found.nearest_x if too_few else found.x
        self._follow(Sighting(stamp, edge, profile(candidates(seen, self._gate), edge, self._method)))
        return self._answer(too_few)

    def state(self) -> dict[str, Any]:
        """Give what the tracker remembers, in plain lists and numbers."""
        sightings = [
            {
                "stamp": sighting.stamp,
                "edge": sighting.edge,
                "cells": [list(cell) for cell in zip(*(column.tolist() for column in _columns(sighting)), strict=True)],
            }
            for sighting in self._sightings
        ]
        trend = None if self._trend is None else list(self._trend)
        return {"stamp": self._stamp, "sightings": sightings, "trend": trend}

    def restore(self, state: dict[str, Any]) -> None:
        """Remember what another tracker did."""
        self._stamp = state["stamp"]
        self._sightings = [
            Sighting(each["stamp"], each["edge"], _profile(each["cells"])) for each in state["sightings"]
        ]
        self._trend = None if state["trend"] is None else Trend(*state["trend"])

    def _forget(self, stamp: float) -> None:
        """Forget what is too old, and a body that was gone for too long."""
        gone = bool(self._sightings) and stamp - self._sightings[-1].stamp > self._max_gap
        # Stamps are rounded: the window's own end counts.
        window = self._method.window * (1.0 + 1e-6)
        kept = [sighting for sighting in self._sightings if not gone and stamp - sighting.stamp <= window]
        self._sightings = kept
        if not kept:
            self._trend = None

    def _follow(self, sighting: Sighting) -> None:
        """Add a sighting to those of the same body, or begin anew."""
        before = self._sightings if self._continues(sighting) else []
        self._sightings = [*before, sighting][-MOST:]
        self._trend = trend(self._sightings, self._method) if len(self._sightings) >= ENOUGH else None

    def _continues(self, now: Sighting) -> bool:
        """Whether a sighting is of the same body."""
        if not self._sightings:
            return True
        last = self._sightings[-1]
        dt = now.stamp - last.stamp
        if self._trend is not None:
            edge, speed = self._trend.distance, self._trend.closing_speed
        elif len(self._sightings) > 1:
            before = self._sightings[-2]
            edge, speed = last.edge, (before.edge - last.edge) / (last.stamp - before.stamp)
        else:
            return abs(now.edge - last.edge) <= self._jump + FASTEST * dt
        return abs(now.edge - (edge - speed * dt)) <= self._jump + HARDEST * dt * dt / 2.0

    def _answer(self, too_few: bool) -> TrackedTTC:
        """Say what is known of the body at its last sighting."""
        if self._trend is None:
            return _unknown(Status.WARMING_UP, self._sightings[-1].edge - self._front_offset)
        distance, speed = self._trend.distance - self._front_offset, self._trend.closing_speed
        spread = NINE_TENTHS * math.sqrt(self._trend.variance)
        # The first that holds.
        cases = {
            Status.CONTACT: distance <= 0,
            Status.TOO_FEW: too_few,
            Status.CLOSING: speed > 0,
            Status.NOT_CLOSING: True,
        }
        # What is not known of the distance counts for as much as it makes of the time.
        noise = self._method.range_noise
        either_way = math.hypot(spread, speed * NINE_TENTHS * noise / max(distance, noise))
        return TrackedTTC(
            ttc=_time(distance, speed),
            ttc_interval=(_time(distance, speed + either_way), _time(distance, speed - either_way)),
            distance=distance,
            closing_speed=speed,
            closing_speed_interval=(speed - spread, speed + spread),
            status=next(status for status, holds in cases.items() if holds),
        )

    def _coast(self, stamp: float) -> TrackedTTC:
        """Nothing is ahead: the body that was there a moment ago goes on as it did."""
        if not self._sightings:
            return _unknown(Status.CLEAR, math.inf)
        if self._trend is None:
            return _unknown(Status.LOST, math.nan)
        speed = self._trend.closing_speed
        distance = self._trend.distance - speed * (stamp - self._sightings[-1].stamp) - self._front_offset
        lost = asdict(_unknown(Status.LOST, distance))
        return TrackedTTC(**{**lost, "ttc": _time(distance, speed), "closing_speed": speed})


def _unknown(status: Status, distance: float) -> TrackedTTC:
    """No time is known."""
    return TrackedTTC(math.inf, None, distance, math.nan, None, status)


def _time(distance: float, closing_speed: float) -> float:
    """At a constant speed, s; 0 in contact, infinite where nothing closes."""
    return max(distance, 0.0) / closing_speed if closing_speed > 0 else math.inf


def _columns(sighting: Sighting) -> tuple[Any, ...]:
    profile = sighting.profile
    return profile.column, profile.level, profile.count, profile.x, profile.z


def _profile(cells: list[Any]) -> Profile:
    column, level, count, x, z = np.array(cells, np.float64).reshape(-1, 5).T
    return Profile(column.astype(np.int64), level.astype(np.int64), count, x, z)


def _positive(argument: str, value: Any) -> float:
    result = number(argument, value)
    if not result > 0:
        raise ValueError(f"{argument} must be above 0, got {result}")
    return result
