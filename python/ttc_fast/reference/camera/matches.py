"""Matched keypoints, and which of them count."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast.reference.arguments import as_array

if TYPE_CHECKING:
    from numpy.typing import NDArray

FARTHEST = 1e9
"""No picture is this wide, px: a number farther out is not a position."""


def matches(previous: Any, current: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the positions before and now of the matches that count, in float64."""
    before, now = _positions("previous", previous), _positions("current", current)
    if before.dtype != now.dtype:
        raise TypeError(f"previous and current must have the same dtype, got {before.dtype} and {now.dtype}")
    if len(before) != len(now):
        raise ValueError(f"current must have one row for each of previous, which has {len(before)}, got {len(now)}")
    numbers = np.hstack([before, now]).astype(np.float64)
    # NaN and inf are beyond that, too.
    count = (np.abs(numbers) <= FARTHEST).all(axis=1)
    return numbers[count, :2], numbers[count, 2:]


def _positions(argument: str, points: Any) -> NDArray[Any]:
    array = as_array(argument, points)
    if array.ndim == 3 and array.shape[1] == 1:
        array = array[:, 0]
    if array.ndim != 2 or array.shape[1] != 2:
        raise ValueError(f"{argument} must have shape (N, 2), one x and y in pixels for each match, got {array.shape}")
    if array.dtype not in (np.float32, np.float64):
        raise TypeError(f"{argument} must have dtype float32 or float64, got {array.dtype}")
    return array
