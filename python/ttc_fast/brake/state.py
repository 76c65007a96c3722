"""What a controller remembers from one update to the next.

Every field of ``ControllerState`` and ``Brake`` is a plain value, an enumeration or a named tuple, so that it can be
saved.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any, NamedTuple

from ttc_fast.brake.types import NOTHING, STANDING

if TYPE_CHECKING:
    from ttc_fast.brake.types import Criterion, Estimate, Evaluation, Motion


class Driven(NamedTuple):
    """How a vehicle has moved since readings came first.

    Attributes
    ----------
    stamp : float
        The stamp of the newest frame that had them, s.
    way : float
        The way that the vehicle has driven, m.
    x, y, yaw : float
        Where it has got by that, from where it was, m and rad.
    """

    stamp: float
    way: float = 0.0
    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0


Held = tuple[bytes, float, "Motion | None", "Driven | None", bool]
"""The newest readings of a sensor, or a part of them; the stamp of the first frame that had them, s; the motion of the
vehicle when the newest frame had them; how it has moved since then, None for the first frame; whether they are stale.
"""

NEVER: Held = b"", -math.inf, None, None, False

Newest = tuple["Motion | None", float, "Estimate | None", float]
"""The newest odometry and its stamp, s; the newest estimate of a tracker or a camera, and the stamp with which its
numbers came first, where a finite TTC is repeated.
"""

Found = tuple["Criterion | None", "Evaluation", bool, bool]
"""The most urgent criterion of a frame and its evaluation; whether something is inside the outline, and neither motion
nor command says which way it will go; whether nothing looks at a part of the path, or of the path that a braked vehicle
would go on with.
"""

Quorum = tuple[int, int]
"""How many votes are needed, and the bits of the frames that count."""


@dataclass(slots=True)
class Brake:
    """Whether a brake is on, the votes about it, and what it was braked from."""

    on: bool = False
    """Whether it brakes."""
    triggered_at: float = -math.inf
    """Time of the last decision that had a cause to brake, s."""
    braked_from: Motion = STANDING
    """The fastest motion of the frames that had a cause, since the first of them."""
    trigger_votes: int = 0
    """The votes on braking of frames like the newest, scans or clouds; the newest is in the lowest bit."""
    release_votes: int = 0
    """Their votes on release, the newest in the lowest bit."""
    other_trigger_votes: int = 0
    """The votes on braking of the other frames: of the clouds where the newest is a scan, or of the scans."""
    other_release_votes: int = 0
    """Their votes on release."""

    def brake(self, now: float, motion: Motion) -> None:
        """Begin to brake, or begin the hold time again."""
        if not self.on or motion.over_ground > self.braked_from.over_ground:
            self.braked_from = motion
        self._hold(now)

    def _hold(self, now: float) -> None:
        self.on, self.triggered_at, self.release_votes, self.other_release_votes = True, now, 0, 0

    def turn(self) -> None:
        """Let the votes of scans and of clouds change places."""
        self.trigger_votes, self.other_trigger_votes = self.other_trigger_votes, self.trigger_votes
        self.release_votes, self.other_release_votes = self.other_release_votes, self.release_votes

    def vote(
        self,
        now: float,
        triggers: bool,
        clear: bool,
        motion: Motion | None,
        trigger: Quorum,
        release: Quorum,
        hold: float,
    ) -> bool:
        """Count the two votes of a frame, and begin to brake; return whether the frames of its kind let go.

        ``motion`` is what the frame was evaluated for.
        """
        needed, counts = trigger
        before = self.trigger_votes & counts
        self.trigger_votes = votes = (before << 1 | triggers) & counts
        self.release_votes = (self.release_votes << 1 | clear) & release[1]
        if triggers:
            motion = motion or STANDING
            if not (self.on or before) or motion.over_ground > self.braked_from.over_ground:
                self.braked_from = motion
            if self.on or votes.bit_count() >= needed:
                self._hold(now)
        elif self.on:
            if motion is not None and not any(self.braked_from[:3]):  # it began to brake when no motion was known
                self.braked_from = motion
            # The votes of older frames let nothing go that this one shows.
            return clear and now - self.triggered_at >= hold and self.release_votes.bit_count() >= release[0]
        return False


@dataclass(slots=True)
class Source:
    """What is remembered of the frames of one kind, scans or clouds. They are counted each for themselves."""

    newest_at: float = -math.inf
    """Stamp of the newest frame."""
    seen_at: float = -math.inf
    """Stamp of the newest frame that was not blind."""
    voted_at: float = -math.inf
    """Stamp of the newest frame that was evaluated: it was not blind, and its closing speeds were known."""
    period: float = math.inf
    """The usual time between two evaluated frames, s."""
    held: Held = NEVER
    """The readings of the newest frame, and how long they have been the same."""
    held_before: Held = NEVER
    """The readings before, which were others."""


@dataclass(slots=True)
class ControllerState:
    """The memory of a controller. Times are stamps, s, and -inf before the first."""

    scans: Source = field(default_factory=Source)
    """The scans, or the estimates where these are the only frames."""
    clouds: Source = field(default_factory=Source)
    """The clouds."""
    is_cloud: bool = False
    """Whether the newest frame is a cloud."""
    cloud_looks: dict[int, float] = field(default_factory=dict)
    """Stamp of the newest cloud that had a point ahead of an edge of the outline, by the number of the edge."""
    newest: Newest = None, -math.inf, None, -math.inf
    """The newest odometry and estimate."""
    found: Found = None, NOTHING, False, False
    """What the newest evaluated frame came to."""

    brake: Brake = field(default_factory=Brake)
    """The brake."""
    brake_without_estimates: Brake | None = None
    """The brake as it would be if there had been no estimate; None as long as there was none."""

    frames: int = 0
    """Number of frames that were assessed, blind ones included."""
    ignored: int = 0
    """Number of frames whose stamp was not newer than the last one's, or lay in the future."""
    blind: int = 0
    """Number of frames with too few returns."""

    @property
    def brakes(self) -> tuple[Brake, ...]:
        """The brake, and the brake without estimates if there is one."""
        without = self.brake_without_estimates
        return (self.brake,) if without is None else (self.brake, without)

    def saved(self) -> dict[str, Any]:
        """Return everything as plain values, enumerations, named tuples and dicts."""
        plain: dict[str, Any] = {}
        for name in (each.name for each in fields(self)):
            value = getattr(self, name)
            if name in PARTS:
                value = value and {each.name: getattr(value, each.name) for each in fields(PARTS[name])}
            plain |= zip(TOGETHER[name], value, strict=True) if name in TOGETHER else {name: value}
        return plain

    @classmethod
    def of(cls, saved: dict[str, Any]) -> ControllerState:
        """Return the memory that ``saved`` returned. A ValueError says what is missing."""
        for name in cls().saved():
            if name not in saved:
                raise ValueError(f"state has no {name}: it must come from state()")
        together = {name: tuple(saved[each] for each in names) for name, names in TOGETHER.items()}
        parts = {name: None if saved[name] is None else kind(**saved[name]) for name, kind in PARTS.items()}
        plain = {each.name: saved[each.name] for each in fields(cls) if each.name in saved}
        return cls(**(plain | together | parts))


PARTS: dict[str, Any] = {"scans": Source, "clouds": Source, "brake": Brake, "brake_without_estimates": Brake}
TOGETHER = {
    "newest": ("motion", "motion_at", "estimate", "estimate_since"),
    "found": ("criterion", "evaluation", "rests_in_contact", "unseen"),
}
"""What is remembered as one tuple is saved by these names."""
