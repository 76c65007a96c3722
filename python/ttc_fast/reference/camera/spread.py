"""The standard error of a scale, by how far the matches are from a similarity.

If their errors were independent, they would average out. But neighbours in the picture err alike: parts of a body are
not equally far away, its surface turns, background remains among the matches, and detectors draw positions towards
pixels. Such an error is a smooth strain of the picture, and a strain of equal size may be in the scale, where nobody
sees it. What is seen are stretch and shear: a plane that comes nearer has none of them, and what the matches show of
them more than independent errors would is strain. Its size is not known from two numbers. So there are a few sizes,
each weighed by how likely stretch and shear are under it, and the variance of the scale is the average.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ttc_fast.reference.camera.similarity import centred, residuals, total

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Doubles = NDArray[np.float64]

STRAINS = ((0.6, 0.0), (0.2, 0.15), (0.13, 0.3), (0.07, 0.6))
"""Prior probability and size of each strain: that of its error at the mean distance from the centre over that of one
match."""
IN_SCALE = 1.5
"""The variance of the strain in the scale over that in stretch and in shear; parts farther away change the scale."""
THIN = 1e-9
"""Matches whose extent across is less than this share of that along are on one line, and show no stretch."""


def spread(before: Doubles, now: Doubles, scale: float) -> float:
    """Find the standard error of a scale; NaN with fewer than three matches."""
    matches, count = centred(before, now), len(before)
    if matches is None or count < 3:
        return math.nan
    length, size = abs(matches.product), matches.size
    turn = matches.product / length * scale if length > 0 else complex(scale)
    x, y = residuals(matches.about(turn), before, now)
    variance = total(x * x + y * y) / (2 * count - 4)
    if variance == 0:
        return 0.0
    # The residuals are fitted by a similarity and a strain, residual = a p + b conj(p), and b is stretch and shear.
    px, py = (before - [matches.before.real, matches.before.imag]).T
    own = complex(total(px * px - py * py), total(2.0 * px * py))
    along = complex(total(px * x - py * y), total(px * y + py * x)) - own * (turn * size - matches.product) / size
    across = size - abs(own) ** 2 / size
    seen = across > THIN * size
    log_weights, strains = [], []
    for share, strain in STRAINS:
        of_strain = strain * strain * count
        both = of_strain + size / across if seen else 1.0
        squared = (abs(along) / across) ** 2 * size / variance if seen else 0.0
        log_weights.append(math.log(share) - math.log(both) - squared / (2.0 * both))
        strains.append(of_strain)
    weights = np.exp(np.array(log_weights) - max(log_weights))
    strain = float(weights @ np.array(strains) / weights.sum())
    return math.sqrt(variance / size * (1.0 + IN_SCALE * strain))
