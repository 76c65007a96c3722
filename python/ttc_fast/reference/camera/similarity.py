"""Similarities between two pictures: scale, turn and shift at once, with positions as complex numbers.

Products are written out, because a complex product may be fused differently by every compiler, and sums are taken in
one order: what agrees with a similarity is then the same, to the bit, wherever it is computed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Doubles = NDArray[np.float64]
    Lanes = NDArray[np.intp]

LANES = 16
"""How many sums terms are added up in, side by side."""
SAME_SPOT = np.finfo(np.float64).eps ** 2
"""Positions whose squared distance is at most this, px^2, are one spot: the square of the smallest step above 1."""


class Similarity(NamedTuple):
    """The map ``now = turn before + shift``."""

    turn: complex
    shift: complex


class Centred(NamedTuple):
    """Matches about their centres."""

    before: complex
    now: complex
    size: float
    """Sum of squared distances from the centre, before."""
    product: complex
    """Sum of the products of a point now and the conjugate of the point before."""

    def about(self, turn: complex) -> Similarity:
        """Give the similarity that takes the centre where it went."""
        return about(turn, self.before, self.now)


def about(turn: complex, before: complex, now: complex) -> Similarity:
    """Give the similarity with this turn that takes one point where it went."""
    moved_x = turn.real * before.real - turn.imag * before.imag
    moved_y = turn.real * before.imag + turn.imag * before.real
    return Similarity(turn, complex(now.real - moved_x, now.imag - moved_y))


def centred(before: Doubles, now: Doubles, lanes: Lanes) -> Centred | None:
    """Centre matches; None if there are none, or if all are on one spot."""
    count = len(before)
    if count == 0:
        return None
    centres = [[total(column, lanes) / count for column in points.T] for points in (before, now)]
    (px, py), (cx, cy) = (before - centres[0]).T, (now - centres[1]).T
    size = total(px * px + py * py, lanes)
    product = complex(total(px * cx + py * cy, lanes), total(px * cy - py * cx, lanes))
    return Centred(complex(*centres[0]), complex(*centres[1]), size, product) if size > SAME_SPOT * count else None


def fitted(before: Doubles, now: Doubles, lanes: Lanes) -> Similarity | None:
    """Give the similarity of the least squared distances in the later picture."""
    matches = centred(before, now, lanes)
    if matches is None:
        return None
    return matches.about(complex(matches.product.real / matches.size, matches.product.imag / matches.size))


def through(before: Doubles, now: Doubles, i: int, j: int) -> Similarity | None:
    """Give the similarity that takes two points where they went; None if they were on one spot."""
    (px, py), (cx, cy) = (before[j] - before[i]).tolist(), (now[j] - now[i]).tolist()
    size = px * px + py * py
    if not size > SAME_SPOT:
        return None
    turn = complex((px * cx + py * cy) / size, (px * cy - py * cx) / size)
    return about(turn, complex(*before[i]), complex(*now[i]))


def residuals(similarity: Similarity, before: Doubles, now: Doubles) -> tuple[Doubles, Doubles]:
    """Find x and y of where the similarity puts each match now, less where the match is."""
    turn, shift = similarity
    px, py = before.T
    x: Doubles = turn.real * px - turn.imag * py + shift.real - now[:, 0]
    y: Doubles = turn.real * py + turn.imag * px + shift.imag - now[:, 1]
    return x, y


def squared_residuals(similarity: Similarity, before: Doubles, now: Doubles) -> Doubles:
    """Find the squared distance of each match from where the similarity puts it now."""
    x, y = residuals(similarity, before, now)
    squared: Doubles = x * x + y * y
    return squared


def lanes_of(matches: Doubles) -> Lanes:
    """Give the sum that each of all matches is added to."""
    return np.arange(len(matches)) % LANES


def total(terms: Doubles, lanes: Lanes) -> float:
    """Add up terms as the kernel does: each to the sum of its lane, one after the other, then the sums by halves."""
    sums = np.zeros(LANES)
    np.add.at(sums, lanes, terms)
    while len(sums) > 1:
        first, second = np.split(sums, 2)
        sums = first + second
    return float(sums[0])
