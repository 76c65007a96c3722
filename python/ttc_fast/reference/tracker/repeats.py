"""Tells a new measurement from the last one handed over again.

A value that is repeated to the bit is no measurement, and the track is predicted through it. Some repeats are
measurements all the same: those of a sensor that rounds to ``quantum``, and those of a target that stands, seen without
noise.
"""

from __future__ import annotations

import math
from dataclasses import replace
from enum import Enum
from itertools import pairwise
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ttc_fast.reference.tracker.filter import Measurement, Posterior

PATIENCE = 0.5
"""The time for which a value may be repeated before it counts as measured again, s."""
USUAL = 1.5
"""A value that is repeated for up to this multiple of the usual time says nothing."""
STEPS = 4
"""The steps that tell a quantum."""
TURNS = 3
"""Steps that turn from growing to shrinking, or back, that show noise."""
SMALLEST = 1e-3
"""A smaller quantum does not matter, m."""
ROUNDING = 1e-4
"""Steps are multiples of a quantum to within this, m: numbers written as text or as float32 are rounded."""
EDGE = 0.4
"""Where in a cell a target was when its value stepped is not known better than to this part of the cell."""


class Repeat(Enum):
    """What a row says that is no measurement."""

    REPEAT = "the last measurement again: the track is predicted"
    FROZEN = "the last measurement again, for longer than a noisy sensor can repeat itself"


class Repeats:
    """The newest distinct values of a sensor: how far they step, and for how long they are repeated."""

    def __init__(self) -> None:
        self.value, self.since = math.nan, 0.0
        self.steps: list[float] = []
        self.dwells: list[float] = []

    def age(self, stamp: float) -> float:
        """Give the time since a value that was new, s."""
        return math.inf if math.isnan(self.value) else stamp - self.since

    def read(self, row: Measurement, predicted: Posterior | None, interval: float) -> Measurement | Repeat:
        """Read a row; ``predicted`` is the track at its stamp, ``interval`` the time since the row before, s."""
        if row.distance == self.value:
            return self._repeated(row, predicted)
        step = row.distance - self.value
        if math.isfinite(step):
            self.steps = [abs(step), *self.steps][:12]
            self.dwells = [min(row.stamp - self.since, PATIENCE), *self.dwells][:4]  # the target may have been away
        self.value, self.since = row.distance, row.stamp
        quantum = self.quantum
        if quantum == 0:
            return row
        if predicted is None or abs(step) >= 1.5 * quantum:
            return at_least_uniform(row, quantum)
        # The target crossed the edge between two cells within the newest row.
        travelled = min(abs(float(predicted.mean[1])) * interval, quantum)
        distance = row.distance - math.copysign(quantum - travelled, step) / 2
        return at_least_uniform(replace(row, distance=distance), max(travelled, EDGE * quantum))

    def _repeated(self, row: Measurement, predicted: Posterior | None) -> Measurement | Repeat:
        held, usual, quantum = row.stamp - self.since, max(self.dwells, default=0.0), self.quantum
        if held <= USUAL * usual:
            return Repeat.REPEAT
        if predicted is not None and quantum > 0:
            distance = float(predicted.mean[0])
            edge = min(max(distance, self.value - quantum / 2), self.value + quantum / 2)
            if edge != distance:
                return at_least_uniform(replace(row, distance=edge), quantum)
        if held <= max(PATIENCE, 2 * USUAL * usual):
            return Repeat.REPEAT
        if quantum == 0 and self._is_jagged():
            return Repeat.FROZEN
        return at_least_uniform(row, quantum)

    def _is_jagged(self) -> bool:
        """Whether steps grow and shrink in turns, as noise makes them and no motion does."""
        changes = [after - before for before, after in pairwise(self.steps)]
        turns = [a * b < 0 and min(abs(a), abs(b)) > ROUNDING for a, b in pairwise(changes)]
        return sum(turns) >= TURNS

    @property
    def quantum(self) -> float:
        """The width to which the sensor rounds, m: the greatest common divisor of the newest steps; 0 without one."""
        if len(self.steps) < STEPS:
            return 0.0
        if not (_vary(self.steps, 2 * ROUNDING) or _vary(self.dwells, self.dwells[0] / 2)):
            return 0.0  # steps that are all alike are those of a steady motion as well
        divisor = 0.0
        for step in self.steps:
            larger, smaller = max(step, divisor), min(step, divisor)
            while smaller > ROUNDING:
                rest = math.fmod(larger, smaller)
                larger, smaller = smaller, 0.0 if smaller - rest < ROUNDING else rest
            divisor = larger
            if divisor <= SMALLEST:
                return 0.0
        return divisor


def at_least_uniform(new: Measurement, cell: float) -> Measurement:
    """Give the measurement at least the variance of a number that is rounded to ``cell``, m."""
    variance = cell * cell / 12
    return replace(new, variance=variance, has_own_variance=True) if variance > new.variance else new


def _vary(sizes: Sequence[float], alike: float) -> bool:
    return any(abs(size - sizes[0]) > alike for size in sizes)
