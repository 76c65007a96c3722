"""``DistanceTracker``: which target a distance belongs to, and what is said when there is none."""

from __future__ import annotations

import math
import operator
from dataclasses import replace
from typing import Any

from ttc_fast._core import EstimatedNoise, MotionMixture
from ttc_fast.reference.arguments import non_negative, number, positive, shows_settings
from ttc_fast.reference.tracker.answer import TrackedTTC, nothing, of_posterior, only_where
from ttc_fast.reference.tracker.filter import Measurement
from ttc_fast.reference.tracker.repeats import Repeat, Repeats
from ttc_fast.reference.tracker.track import NORMAL, Innovation, NoiseLevel, Track, filter_of
from ttc_fast.status import Status


@shows_settings("method", "noise", "gate", "jump", "confirm", "max_gap", "max_speed", "min_closing_speed")
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
        self._method = MotionMixture() if method is None else method
        filter_of(self._method)
        noise = EstimatedNoise() if noise is None else noise
        self._noise = NoiseLevel(noise)
        self._gate, self._jump = positive("gate", gate), positive("jump", jump)
        self._confirm = operator.index(confirm)
        if not 2 <= self._confirm <= 1000:
            raise ValueError(f"confirm must be from 2 to 1000 frames, got {confirm}")
        self._max_gap, self._max_speed = positive("max_gap", max_gap), positive("max_speed", max_speed)
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
        self._repeats = Repeats()
        self._confirmed: Track | None = None
        self._tentative: Track | None = None
        self._answer = nothing(Status.NO_DATA, math.nan)

    def update(self, distance: float | None, stamp: float, noise: float | None = None) -> TrackedTTC:
        """Give the answer after one more frame."""
        distance = math.nan if distance is None else number("distance", distance)
        stamp = number("stamp", stamp)
        own_noise = None if noise is None else positive("noise", noise)
        seconds = stamp - (stamp if self._origin is None else self._origin)
        out_of_order = self._origin is not None and seconds <= self._newest
        if not math.isfinite(seconds) or out_of_order or distance == -math.inf:
            return replace(self._answer, status=Status.INVALID)
        self._frames.append((distance, stamp, noise))
        if self._origin is None:
            self._origin = stamp
        interval, self._newest = seconds - self._newest, seconds
        if math.isfinite(distance):
            variance = self._noise.variance if own_noise is None else own_noise**2
            row = Measurement(seconds, distance, variance, own_noise is not None)
            predicted = self._confirmed.posterior(seconds, self._noise) if self._confirmed else None
            reading = self._repeats.read(row, predicted, interval)
            if isinstance(reading, Measurement):
                answer = self._associate(reading, learns=own_noise is None)
            else:
                answer = self._repeat(reading)
        else:
            answer = self._coast(distance)
        self._answer = replace(answer, age=self._repeats.age(seconds))
        return self._answer

    def state(self) -> dict[str, Any]:
        """Return every frame so far, for ``restore``."""
        return {"frames": list(self._frames)}

    def reset(self) -> None:
        """Forget everything."""
        self.__init__(**self._settings)  # type: ignore[misc]

    def restore(self, state: dict[str, Any]) -> None:
        """Remember what another tracker with the same settings remembered, by seeing all its frames."""
        self.reset()
        for frame in state["frames"]:
            self.update(*frame)

    def _coast(self, distance: float) -> TrackedTTC:
        self._drop_stale_tracks()
        if self._confirmed:
            return replace(self._answer_of(self._confirmed), status=Status.LOST)
        return nothing(Status.NO_DATA, math.nan) if math.isnan(distance) else nothing(Status.CLEAR, math.inf)

    def _repeat(self, reading: Repeat) -> TrackedTTC:
        """Give the answer to a frame that hands over the last measurement again: the track is predicted."""
        self._drop_stale_tracks()
        if self._confirmed is None:
            return nothing(Status.STALE, math.nan)
        result = self._answer_of(self._confirmed)
        return replace(result, status=Status.LOST) if reading is Repeat.FROZEN else result

    def _associate(self, new: Measurement, *, learns: bool) -> TrackedTTC:
        """Give a distance to the track that it belongs to; ``learns`` says whether the noise is learnt from it."""
        had_track = self._confirmed is not None
        self._drop_stale_tracks()
        confirmed, tentative = self._confirmed, self._tentative
        if confirmed is None:
            self._confirmed = Track(self._method, new)
            return only_where(Status.STALE if had_track else Status.WARMING_UP, new.distance)
        innovation = confirmed.innovation(new, self._noise, self._gate, self._max_speed)
        if innovation.normalized is not None and learns:
            self._noise.learn(innovation.normalized, new.variance)
        other = tentative.innovation(new, self._noise, self._gate, self._max_speed) if tentative else None
        lost = False
        if tentative and other and other.in_gate and _prefers_tentative(confirmed, innovation, other):
            tentative.update(new, other)
            flicker = confirmed.is_warming_up and tentative.filter.frames > confirmed.filter.frames
            confirmed.consecutive_hits = 0
            if tentative.consecutive_hits >= self._confirm:
                self._confirmed, self._tentative = tentative, None
            elif flicker:
                self._confirmed, self._tentative = tentative, confirmed
            else:
                lost = innovation.value > self._jump
        elif innovation.in_gate:
            confirmed.update(new, innovation)
            if confirmed.consecutive_hits >= self._confirm:
                self._tentative = None
            elif tentative:
                tentative.consecutive_hits = 0
        else:
            lost = self._begin_track(confirmed, tentative, new, innovation)
        assert self._confirmed is not None
        result = self._answer_of(self._confirmed)
        return replace(result, status=Status.LOST) if lost else result

    def _begin_track(self, confirmed: Track, tentative: Track | None, new: Measurement, innovation: Innovation) -> bool:
        """Begin a track with a distance that is in no gate; say whether the confirmed target is lost."""
        begun = Track(self._method, new)
        confirmed.consecutive_hits = 0
        if tentative and confirmed.is_warming_up and not tentative.is_warming_up:
            tentative.consecutive_hits = 0
            self._confirmed = begun
        elif innovation.value < -self._jump:
            self._confirmed, self._tentative = begun, confirmed
        else:
            self._tentative = begun
            return innovation.value > self._jump
        return False

    def _drop_stale_tracks(self) -> None:
        fresh = [
            track
            for track in (self._confirmed, self._tentative)
            if track and self._newest - track.last.stamp <= self._max_gap
        ]
        if self._confirmed not in fresh:
            self._confirmed = fresh.pop() if fresh else None
            self._tentative = None
        elif self._tentative not in fresh:
            self._tentative = None

    def _answer_of(self, track: Track) -> TrackedTTC:
        posterior = track.posterior(self._newest, self._noise)
        if posterior is None:
            return only_where(Status.WARMING_UP, track.last.distance)
        quantile = NORMAL if track.last.has_own_variance else self._noise.quantile
        closes = track.stationary.closes(posterior, quantile, track.correlation.variance_factor)
        answer = of_posterior(posterior, quantile, closes and bool(posterior.mean[1] > self._min_closing_speed))
        low, _ = answer.closing_speed_interval or (-math.inf, math.inf)
        if answer.status is Status.NOT_CLOSING and low > self._min_closing_speed and track.stationary.is_young:
            return replace(answer, status=Status.WARMING_UP)  # the line proves nothing yet, and the filter contradicts
        return answer


def _prefers_tentative(confirmed: Track, innovation: Innovation, tentative: Innovation) -> bool:
    """Whether the tentative track gets a distance that is in its gate, and perhaps in that of the confirmed one too."""
    return not innovation.in_gate or (confirmed.is_warming_up and abs(tentative.value) < abs(innovation.value))
