"""The camera time-to-collision of Udacity's sensor fusion course, ``computeTTCCamera``, with its quirks.

With it, published tables can be computed again and judged (github.com/udacity/SFND_3D_Object_Tracking at 3f28643). To
decide anything, use ``ttc_fast.ttc_from_keypoints``.

What the course does, and what ``ttc_from_keypoints(..., estimator=MedianRatio())`` does instead:

- Pairs are ordered: the outer index goes from the first match to the last but one, the inner one from the second match
  to the last, whatever the outer one is. So a pair of interior matches counts twice, and one with the first or the last
  match once. Every pair counts once.
- The time may be negative or infinite: a median ratio below 1 gives a negative time, one of exactly 1 minus infinity,
  and no pair at all NaN. It is inf, with a status that says which it is.
- Differences of float32 positions are rounded to float32, as OpenCV's points do it. They are exact in float64.
- A NaN in a position makes its pairs drop out; here it is the match that does not count, and ``matches`` says how many
  do.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

__all__ = ["compute_ttc_camera", "ordered_ratios"]

MIN_DISTANCE = 100.0
"""The minDist of the course, px."""


def ordered_ratios(previous: ArrayLike, current: ArrayLike, min_distance: float = MIN_DISTANCE) -> NDArray[np.float64]:
    """Return the ratios of distances, now over before, of all ordered pairs that the course keeps, in its order.

    Parameters
    ----------
    previous, current : array_like, shape (N, 2)
        x and y of each match, px. Of float32 arrays the differences are float32, as in the course.
    min_distance : float
        A pair is kept if its distance before is above 2.2e-16 px, and its distance now at least this.

    Returns
    -------
    ndarray
        float64.

    Raises
    ------
    ValueError
        If the arrays are not (N, 2) both.

    Examples
    --------
    Three matches make four ordered pairs, (0, 1), (0, 2), (1, 1) and (1, 2), one of which has no distance:

    >>> from ttc_fast.compat.udacity_camera import ordered_ratios
    >>> ordered_ratios([[0, 0], [100, 0], [300, 0]], [[0, 0], [110, 0], [330, 0]]).round(3).tolist()
    [1.1, 1.1, 1.1]
    """
    before, now = np.asarray(previous), np.asarray(current)
    if before.shape != now.shape or before.ndim != 2 or before.shape[1] != 2:
        raise ValueError(f"previous and current must have one shape (N, 2), got {before.shape} and {now.shape}")
    distances_before, distances_now = _ordered_distances(before), _ordered_distances(now)
    kept = (distances_before > np.finfo(np.float64).eps) & (distances_now >= min_distance)
    ratios: NDArray[np.float64] = distances_now[kept] / distances_before[kept]
    return ratios


def compute_ttc_camera(
    previous: ArrayLike, current: ArrayLike, frame_rate: float, *, min_distance: float = MIN_DISTANCE
) -> float:
    """Compute the time-to-collision of the course: ``-dT / (1 - median)`` of the ordered pairs' ratios.

    Parameters
    ----------
    previous, current : array_like, shape (N, 2)
        x and y of each match, px; see ``ordered_ratios``.
    frame_rate : float
        Pictures per second.
    min_distance : float
        A pair is kept if its distance now is at least this, px; see ``ordered_ratios``.

    Returns
    -------
    float
        The time, s; negative when the object shrinks, -inf when it keeps its size, NaN when no pair is kept.

    Raises
    ------
    ValueError
        If the arrays are not (N, 2) both.

    Examples
    --------
    >>> from ttc_fast.compat.udacity_camera import compute_ttc_camera
    >>> round(compute_ttc_camera([[0, 0], [100, 0], [300, 0]], [[0, 0], [105, 0], [315, 0]], 10.0), 6)
    2.0
    >>> compute_ttc_camera([[0, 0], [10, 0]], [[0, 0], [11, 0]], 10.0)
    nan
    """
    ratios = ordered_ratios(previous, current, min_distance)
    if len(ratios) == 0:
        return float("nan")
    with np.errstate(divide="ignore"):
        return float(-(1.0 / frame_rate) / (1.0 - np.median(ratios)))


def _ordered_distances(points: NDArray[Any]) -> NDArray[np.float64]:
    """Return the distances of every match but the last to every match but the first."""
    x, y = (points[1:] - points[:-1, np.newaxis]).reshape(-1, 2).astype(np.float64).T
    distances: NDArray[np.float64] = np.sqrt(x * x + y * y)
    return distances
