"""The formula: clearance over closing speed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Float = TypeVar("Float", bound=np.floating[Any])


def time_to_collision(clearance: NDArray[Float], closing: NDArray[Float], min_closing_speed: Float) -> NDArray[Float]:
    """Return the seconds until each clearance is used up: ``clearance / closing``, in their dtype.

    Parameters
    ----------
    clearance : ndarray
        What is left before contact, m; 0 or below is contact, NaN where nothing is known.
    closing : ndarray of the same dtype and shape
        Speed at which it shrinks, m/s; NaN where unknown.
    min_closing_speed : scalar of that dtype
        Closing at or below this, m/s, is not closing.

    Returns
    -------
    ndarray
        In [0, inf]: 0 in contact, infinite where nothing closes or nothing is known.
    """
    ttc = np.full_like(clearance, np.inf)
    closes = closing > min_closing_speed
    with np.errstate(over="ignore", under="ignore"):
        np.divide(clearance, closing, out=ttc, where=closes & (clearance > 0))
    ttc[closes & (clearance <= 0)] = 0
    return ttc


def rounded(value: float, dtype: np.dtype[Float]) -> Float:
    """Return ``value`` as the nearest scalar of ``dtype``; infinite where it is too large for it."""
    with np.errstate(over="ignore", under="ignore"):
        return dtype.type(value)
