"""What a node says: what to publish, as plain values."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from ttc_fast.brake import Command, Decision

OK, WARN, ERROR, STALE = range(4)
"""Levels of diagnostic_msgs/DiagnosticStatus."""


class Drive(NamedTuple):
    """What to ask of the vehicle: of ackermann_msgs/AckermannDrive.

    Attributes
    ----------
    speed : float
        m/s, negative backwards.
    acceleration : float
        m/s^2, without sign.
    """

    speed: float
    acceleration: float


class Outputs(NamedTuple):
    """What to publish.

    Attributes
    ----------
    brake : bool
        For ``brake_topic``.
    drive : Drive or None
        For ``drive_topic``; None is silence.
    decision : Decision
        Where both come from.
    """

    brake: bool
    drive: Drive | None
    decision: Decision


class Diagnostics(NamedTuple):
    """For ``diagnostics_topic``, as of diagnostic_msgs/DiagnosticStatus."""

    level: int
    name: str
    message: str
    values: list[tuple[str, str]]


class Cause(NamedTuple):
    """For ``marker_topic``: where the beam or point is that decided, in a frame, m."""

    frame: str
    x: float
    y: float
    command: Command
    text: str


class Losses:
    """Messages that could not be read: how many of each topic, and why the last one could not."""

    def __init__(self) -> None:
        self._counts: dict[str, int] = {}
        self._why: dict[str, str] = {}

    def count(self, topic: str, why: str) -> None:
        """Count one."""
        self._counts[topic] = self._counts.get(topic, 0) + 1
        self._why[topic] = why

    def values(self) -> list[tuple[str, str]]:
        """Return key and value of each."""
        return [(f"dropped: {topic}", f"{n}; {self._why[topic]}".strip("; ")) for topic, n in self._counts.items()]
