"""The standard error of a scale, by how far the matches are from a similarity, and a map that allows for strain.

If their errors were independent, they would average out. But neighbours in the picture err alike: parts of a body are
not equally far away, its surface turns, background remains among the matches, and detectors draw positions towards
pixels. Such an error is a smooth strain of the picture, and a strain of equal size may be in the scale, where nobody
sees it. What is seen are stretch and shear: a plane that comes nearer has none of them, and what the matches show of
them more than independent errors would is strain. Its size is not known from two numbers. So there are a few sizes,
each weighed by how likely stretch and shear are under it, and the variance of the scale is the average.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ttc_fast.reference.camera.similarity import centred, lanes_of, residuals, total

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from ttc_fast.reference.camera.similarity import Centred, Lanes

    Doubles = NDArray[np.float64]

STRAINS = ((0.6, 0.0), (0.2, 0.15), (0.13, 0.3), (0.07, 0.6))
"""Prior probability and size of each strain: that of its error at the mean distance from the centre over that of one
match."""
IN_SCALE = 1.5
"""The variance of the strain in the scale over that in stretch and in shear; parts farther away change the scale."""
THIN = 1e-9
"""Matches whose extent across is less than this share of that along are on one line, and show no stretch."""


class Strained(NamedTuple):
    """The map of matches about their centres that allows for strain: ``now = turn before + strain conj(before)``."""

    before: complex
    now: complex
    turn: complex
    strain: complex
    spread: float
    """The standard error of the scale; NaN with fewer than three matches."""

    @property
    def scale(self) -> float:
        """The factor by which the map enlarges."""
        return abs(self.turn)

    def squared_residuals(self, before: Doubles, now: Doubles) -> Doubles:
        """Find the squared distance of each match from where the map puts it now."""
        turn, strain = self.turn, self.strain
        px, py = (before - [self.before.real, self.before.imag]).T
        x = (turn.real * px - turn.imag * py) + (strain.real * px + strain.imag * py) + self.now.real - now[:, 0]
        y = (turn.real * py + turn.imag * px) + (strain.imag * px - strain.real * py) + self.now.imag - now[:, 1]
        return np.asarray(x * x + y * y)


def strained(before: Doubles, now: Doubles, lanes: Lanes) -> Strained | None:
    """Fit the map of least squares, with stretch and shear as likely as strain of each size makes them."""
    matches = centred(before, now, lanes)
    if matches is None:
        return None
    seen = _Seen(matches, before, now, lanes, matches.product / matches.size)
    part = seen.part() if seen.tells else 0.0
    strain = -seen.along / seen.across * part if part > 0 else 0j
    turn = (matches.product - seen.own.conjugate() * strain) / matches.size
    shared = abs(seen.own) ** 2 / (seen.size * seen.across) * part if part > 0 else 0.0
    return Strained(matches.before, matches.now, turn, strain, seen.spread(shared))


def spread(before: Doubles, now: Doubles, scale: float) -> float:
    """Find the standard error of a scale of all matches; NaN with fewer than three."""
    lanes = lanes_of(before)
    matches = centred(before, now, lanes)
    if matches is None:
        return math.nan
    length = abs(matches.product)
    turn = matches.product / length * scale if length > 0 else complex(scale)
    return _Seen(matches, before, now, lanes, turn).spread()


class _Seen:
    """What matches show of stretch and shear."""

    def __init__(self, matches: Centred, before: Doubles, now: Doubles, lanes: Lanes, turn: complex) -> None:
        self.count, self.size = len(before), matches.size
        x, y = residuals(matches.about(turn), before, now)
        # The residuals are fitted by a similarity and a strain, residual = a p + b conj(p), and b is stretch and shear.
        px, py = (before - [matches.before.real, matches.before.imag]).T
        self.own = complex(total(px * px - py * py, lanes), total(2.0 * px * py, lanes))
        along = complex(total(px * x - py * y, lanes), total(px * y + py * x, lanes))
        self.along = along - self.own * (turn * self.size - matches.product) / self.size
        self.across = self.size - abs(self.own) ** 2 / self.size
        self.variance = total(x * x + y * y, lanes) / (2 * self.count - 4) if self.count > 2 else math.nan
        self.thin = self.across <= THIN * self.size

    @property
    def tells(self) -> bool:
        """Whether stretch and shear can be told from scale and turn."""
        return not self.thin and self.variance > 0

    def sizes(self) -> Iterator[tuple[float, float, float]]:
        """Give the weight of each size of strain, its variance, and that of stretch and shear with it.

        Variances are over that of the scale by independent errors.
        """
        logs, parts = [], []
        for share, strain in STRAINS:
            of_strain = strain * strain * self.count
            both = 1.0 if self.thin else of_strain + self.size / self.across
            squared = 0.0 if self.thin else (abs(self.along) / self.across) ** 2 * self.size / self.variance
            logs.append(math.log(share) - math.log(both) - squared / (2.0 * both))
            parts.append((of_strain, both))
        weights = np.exp(np.array(logs) - max(logs))
        for weight, (of_strain, both) in zip(weights / weights.sum(), parts, strict=True):
            yield float(weight), of_strain, both

    def part(self) -> float:
        """Give the part of stretch and shear that is strain rather than independent errors."""
        return sum(weight * of_strain / both for weight, of_strain, both in self.sizes())

    def spread(self, shared: float = 0.0) -> float:
        """Give the standard error of the scale."""
        if self.variance == 0 or math.isnan(self.variance):
            return self.variance
        strain = sum(weight * of_strain for weight, of_strain, _ in self.sizes())
        return math.sqrt(self.variance / self.size * (1.0 + IN_SCALE * strain + shared))
