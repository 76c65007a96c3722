"""What is asked of range rates: scans of a standing car at the rate of its scanner, one after the other."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

import ttc_fast
from benches.contestant import Contestant
from benches.scans import car
from ttc_fast import reference

if TYPE_CHECKING:
    from types import ModuleType

SCANS = 64
MODULES: dict[str, ModuleType] = {"ttc_fast": ttc_fast, "reference": reference}


@dataclass(frozen=True)
class Case:
    """A scanner of some size that turns so many times a second. Light: scans are made when asked for."""

    beams: int
    hertz: int
    dtype: str = "float32"

    def __str__(self) -> str:
        return f"{self.call} {self.size} {self.dtype}"

    @property
    def call(self) -> str:
        return "RangeRate.update"

    @property
    def size(self) -> str:
        return f"{self.beams} at {self.hertz} Hz"

    @property
    def nbytes(self) -> int:
        """Of one scan."""
        return self.beams * np.dtype(self.dtype).itemsize

    @property
    def names(self) -> list[str]:
        """ttc_fast first."""
        return list(MODULES)

    def pool(self) -> list[Any]:
        """Scans of one room, each with noise, error codes and dropouts of its own."""
        room = car.rooms(1, self.beams, "float64")
        rng = np.random.default_rng(self.beams)
        scans = room + rng.normal(0.0, 0.01, (SCANS, self.beams))
        scans[rng.random(scans.shape) < 0.02] = np.nan
        return list(scans.astype(self.dtype))

    def contestant(self, name: str) -> Contestant:
        """One of ``names``, with a clock of its own."""
        rates = MODULES[name].RangeRate(MODULES[name].ScanTTC(*car.place(self.beams), **car.SETTINGS))
        stamps = itertools.count(0.0, 1.0 / self.hertz)
        return Contestant(name, "rates.update(ranges, next(stamps))", {"rates": rates, "stamps": stamps})

    def check(self, contestant: Contestant) -> None:
        """AssertionError if an answer is not that of the reference."""
        judge = self.contestant("reference")
        for ranges in self.pool()[:16]:
            said, right = contestant.answer(ranges), judge.answer(ranges)
            assert (said.ttc, said.status, said.rated) == (right.ttc, right.status, right.rated)
        assert said.rated > self.beams / 3


CASES = [Case(271, 10), Case(1080, 10), Case(1080, 40), Case(4096, 10)]
