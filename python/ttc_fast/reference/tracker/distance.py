"""Which target a distance belongs to, and what is said when there is none."""

from __future__ import annotations

import math
import operator
from dataclasses import dataclass, replace
from typing import Any

from ttc_fast._core import EstimatedNoise, KalmanCA
from ttc_fast.reference.arguments import finite, non_negative, number
from ttc_fast.reference.tracker.answer import TrackedTTC, answer, nothing, only_where
from ttc_fast.reference.tracker.filters import Measured, Posterior, filter_of
from ttc_fast.reference.tracker.noise import NORMAL, NoiseLevel, Whiteness
from ttc_fast.reference.tracker.standing import Standing
from ttc_fast.status import Status


@dataclass(frozen=True)
class Surprise:
    """How a distance compares with what a track expects."""

    miss: float
    """Measured less expected, m."""
    deviations: float | None
    """In standard deviations of the noise alone, so that a lag is a surprise too; None after a single frame."""
    fits: bool
    """Whether it belongs to the track."""


class Track:
    """One target."""

    def __init__(self, method: Any, first: Measured) -> None:
        self.filter, self.standing, self.whiteness = filter_of(method), Standing(), Whiteness()
        self.run = 0
        self.put(first)

    @property
    def is_young(self) -> bool:
        """Whether it has seen too few frames to say anything."""
        return self.filter.frames < self.filter.needed

    def put(self, new: Measured) -> None:
        """Take a distance."""
        self.filter.push(new)
        self.standing.push(new)
        self.last = new
        self.run += 1

    def take(self, new: Measured, surprise: Surprise) -> None:
        """Take a distance, and learn from how much it surprised."""
        if surprise.deviations is not None:
            self.whiteness.learn(surprise.deviations)
        self.put(new)

    def at(self, stamp: float, noise: NoiseLevel) -> Posterior | None:
        """Say what is believed, once there are frames enough."""
        posterior = None if self.is_young else self.filter.at(stamp, noise.variance)
        return posterior and replace(posterior, covariance=posterior.covariance * self.whiteness.factor)


class DistanceTracker:
    """Closing speed and time-to-collision from the distance of the nearest target, frame by frame.

    Arguments, results and errors are those of ``ttc_fast.DistanceTracker``. Its state is every frame that it has seen.

    Examples
    --------
    >>> from ttc_fast import reference
    >>> tracker = reference.DistanceTracker(noise=0.02)
    >>> for frame in range(5):
    ...     result = tracker.update(10.0 - 0.5 * frame, stamp=0.1 * frame)
    >>> round(result.ttc, 6), result.status.name
    (1.6, 'CLOSING')
    """

    def __init__(
        self,
        method: Any = None,
        *,
        noise: Any = None,
        gate: float = 4.0,
        jump: float = 1.0,
        confirm: int = 3,
        max_gap: float = 1.0,
        max_speed: float = 100.0,
        min_closing_speed: float = 0.05,
    ) -> None:
        self._method = KalmanCA() if method is None else method
        filter_of(self._method)
        noise = EstimatedNoise() if noise is None else noise
        self._noise = NoiseLevel(noise)
        self._gate, self._jump = _above_zero("gate", gate), _above_zero("jump", jump)
        self._confirm = operator.index(confirm)
        if not 2 <= self._confirm <= 1000:
            raise ValueError(f"confirm must be from 2 to 1000 frames, got {confirm}")
        self._max_gap, self._max_speed = _above_zero("max_gap", max_gap), _above_zero("max_speed", max_speed)
        self._min_closing_speed = non_negative("min_closing_speed", min_closing_speed)
        self._settings = {
            "method": self._method,
            "noise": noise,
            "gate": gate,
            "jump": jump,
            "confirm": confirm,
            "max_gap": max_gap,
            "max_speed": max_speed,
            "min_closing_speed": min_closing_speed,
        }
        self._frames: list[tuple[float, float, float | None]] = []
        self._origin: float | None = None
        self._newest = 0.0
        self._present: Track | None = None
        self._rival: Track | None = None
        self._answer = nothing(Status.NO_DATA, math.nan)

    def update(self, distance: float | None, stamp: float, noise: float | None = None) -> TrackedTTC:
        """Give the answer after one more frame."""
        distance = math.nan if distance is None else number("distance", distance)
        stamp = number("stamp", stamp)
        own = None if noise is None else _above_zero("noise", noise)
        seconds = stamp - (stamp if self._origin is None else self._origin)
        out_of_order = self._origin is not None and seconds <= self._newest
        if not math.isfinite(seconds) or out_of_order or distance == -math.inf:
            return replace(self._answer, status=Status.INVALID)
        self._frames.append((distance, stamp, noise))
        if self._origin is None:
            self._origin = stamp
        self._newest = seconds
        if math.isfinite(distance):
            variance = self._noise.variance if own is None else own**2
            self._answer = self._seen(Measured(seconds, distance, variance, own is not None))
        else:
            self._answer = self._missed(distance)
        return self._answer

    def state(self) -> dict[str, Any]:
        """Give every frame so far, for ``restore``."""
        return {"frames": list(self._frames)}

    def restore(self, state: dict[str, Any]) -> None:
        """Remember what another tracker with the same settings did, by seeing all its frames."""
        self.__init__(**self._settings)  # type: ignore[misc]
        for frame in state["frames"]:
            self.update(*frame)

    def _missed(self, distance: float) -> TrackedTTC:
        self._forget_what_is_old()
        if self._present:
            return replace(self._about(self._present), status=Status.LOST)
        return nothing(Status.NO_DATA, math.nan) if math.isnan(distance) else nothing(Status.CLEAR, math.inf)

    def _seen(self, new: Measured) -> TrackedTTC:
        had = self._present is not None
        self._forget_what_is_old()
        present, rival = self._present, self._rival
        if present is None:
            self._present = Track(self._method, new)
            return only_where(Status.STALE if had else Status.WARMING_UP, new.distance)
        surprise = self._surprise(present, new)
        if surprise.deviations is not None and not new.own:
            self._noise.learn(surprise.deviations)
        claim = self._surprise(rival, new) if rival else None
        lost = False
        if rival and claim and claim.fits and _prefers(present, surprise, claim):
            rival.take(new, claim)
            flicker = present.is_young and rival.filter.frames > present.filter.frames
            present.run = 0
            if rival.run >= self._confirm:
                self._present, self._rival = rival, None
            elif flicker:
                self._present, self._rival = rival, present
            else:
                lost = surprise.miss > self._jump
        elif surprise.fits:
            present.take(new, surprise)
            if present.run >= self._confirm:
                self._rival = None
            elif rival:
                rival.run = 0
        else:
            lost = self._begin(present, rival, new, surprise)
        assert self._present is not None
        result = self._about(self._present)
        return replace(result, status=Status.LOST) if lost else result

    def _begin(self, present: Track, rival: Track | None, new: Measured, surprise: Surprise) -> bool:
        """Begin a target with a distance that fits none; say whether the present one is lost."""
        begun = Track(self._method, new)
        present.run = 0
        if rival and present.is_young and not rival.is_young:
            rival.run = 0
            self._present = begun
        elif surprise.miss < -self._jump:
            self._present, self._rival = begun, present
        else:
            self._rival = begun
            return surprise.miss > self._jump
        return False

    def _surprise(self, track: Track, new: Measured) -> Surprise:
        expected = track.filter.at(new.stamp, self._noise.variance)
        if expected is None:
            miss = new.distance - track.last.distance
            return Surprise(miss, None, abs(miss) <= self._max_speed * (new.stamp - track.last.stamp))
        miss, variance = float(new.distance - expected.mean[0]), float(expected.covariance[0, 0])
        wide = math.sqrt(variance * track.whiteness.factor + new.variance)
        deviations = miss / math.sqrt(variance - expected.lag + new.variance)
        return Surprise(miss, deviations, abs(miss) <= self._gate * wide)

    def _forget_what_is_old(self) -> None:
        fresh = [
            track
            for track in (self._present, self._rival)
            if track and self._newest - track.last.stamp <= self._max_gap
        ]
        if self._present not in fresh:
            self._present = fresh.pop() if fresh else None
            self._rival = None
        elif self._rival not in fresh:
            self._rival = None

    def _about(self, track: Track) -> TrackedTTC:
        posterior = track.at(self._newest, self._noise)
        if posterior is None:
            return only_where(Status.WARMING_UP, track.last.distance)
        quantile = NORMAL if track.last.own else self._noise.quantile
        closes = track.standing.closes(posterior, quantile, track.whiteness.factor)
        return answer(posterior, quantile, closes and bool(posterior.mean[1] > self._min_closing_speed))


def _prefers(present: Track, surprise: Surprise, claim: Surprise) -> bool:
    """Whether a rival gets a distance that it fits, though it may fit the present target too."""
    return not surprise.fits or (present.is_young and abs(claim.miss) < abs(surprise.miss))


def _above_zero(argument: str, value: Any) -> float:
    result = finite(argument, value)
    if not result > 0:
        raise ValueError(f"{argument} must be above 0, got {result}")
    return result
