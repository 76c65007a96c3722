"""The scanner: rays against segments, with the faults of a real one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benches.closed_loop.world import Floats, seen_from
from ttc_fast import ScanTTC

BEAMS = 361
ANGLE_MIN = -0.75 * np.pi
INCREMENT = 1.5 * np.pi / (BEAMS - 1)
RANGE_MIN, RANGE_MAX = 0.05, 20.0
ANGLES = ANGLE_MIN + INCREMENT * np.arange(BEAMS)
DIRECTIONS = np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])


@dataclass(frozen=True)
class Scanner:
    """What is wrong with it, and where it sits."""

    mount: tuple[float, float, float] = (0.25, 0.0, 0.0)
    """x, y (m) and yaw (rad) in the vehicle frame."""
    noise: float = 0.015
    """Standard deviation of a reading, m."""
    dropouts: float = 0.02
    """Share of readings that are missing."""
    speckle: float = 0.0005
    """Share of readings that are anything nearer than the truth: dust, rain, sun."""
    latency: float = 0.02
    """From measuring to deciding, s."""
    period: float = 0.025
    """s."""
    blind_from: float = np.inf
    """When it goes blind, s."""

    def scan(self, time: float, segments: Floats, rng: np.random.Generator) -> Floats:
        """Readings of segments in the vehicle's frame."""
        if time >= self.blind_from:
            return np.full(BEAMS, np.nan)
        ranges = distances(seen_from(segments, *self.mount))
        ranges += rng.normal(0.0, self.noise, BEAMS)
        ranges[ranges > RANGE_MAX] = np.inf
        speckled = rng.random(BEAMS) < self.speckle
        ranges[speckled] = rng.uniform(RANGE_MIN, np.minimum(ranges[speckled], RANGE_MAX))
        ranges[rng.random(BEAMS) < self.dropouts] = np.nan
        return ranges

    def reader(self, outline: tuple[float, float, float, float]) -> ScanTTC:
        """What reads it."""
        return ScanTTC(
            ANGLE_MIN,
            INCREMENT,
            BEAMS,
            range_min=RANGE_MIN,
            range_max=RANGE_MAX,
            mount=self.mount,
            outline=outline,
        )


def distances(segments: Floats) -> Floats:
    """Of the nearest segment along each beam, in the scanner's frame; infinite without one."""
    begin, along = segments[:, :2], segments[:, 2:] - segments[:, :2]
    across = DIRECTIONS[:, :1] * along[:, 1] - DIRECTIONS[:, 1:] * along[:, 0]
    area = begin[:, 0] * along[:, 1] - begin[:, 1] * along[:, 0]
    offset = begin[:, 0] * DIRECTIONS[:, 1:] - begin[:, 1] * DIRECTIONS[:, :1]
    with np.errstate(divide="ignore", invalid="ignore"):
        distance, part = area / across, offset / across
    hit = (distance > 0.0) & (part >= 0.0) & (part <= 1.0)
    nearest: Floats = np.min(np.where(hit, distance, np.inf), axis=1, initial=np.inf)
    return nearest
