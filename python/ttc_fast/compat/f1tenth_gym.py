"""The collision check of the F1TENTH gym simulator, bit for bit.

The simulator stops a car when the instantaneous time-to-collision (iTTC) of any beam is at least 0 and below a
threshold. ``check_ttc_jit`` gives its answer and ``beam_tables`` its per-beam tables, in NumPy and float64, so that
recorded runs can be judged the way the simulator judged them (github.com/f1tenth/f1tenth_gym at 4fdb9c7). To decide
whether a real car should brake, use ``ttc_fast.ScanTTC``.

What the simulator does, and what ``ScanTTC`` does instead:

- Only a bool comes back. ``ScanTTC.nearest`` says when, which beam, and why.
- The body is a box of half the *wheelbase*, not half the length, ahead and behind, so the bumper sticks out of it.
  ``outline=`` is the true rectangle.
- The sensor sits at the centre of the body. ``mount=`` says where it sits, and so what a yaw rate does to it.
- A beam at angle exactly 0 (odd numbers of beams) never hits: the way to the side is -inf there. Every beam counts.
- A reading inside the body that closes gives a negative time and no hit. It is CONTACT, 0 s.
- A reading inside the body that opens gives a positive time, and one exactly on it -0.0; both may hit. It is CONTACT
  and infinite, so that a car may free itself.
- NaN and +-inf never hit, so a blind sensor reads as safe. It is a ``NoDataError`` or status NO_DATA, and -inf, an
  object too near to measure, is a hit at ``range_min``.
- Readings below what the sensor can measure count. Error codes are often tiny: ``range_min=`` discards them.
- Only a speed of exactly 0 is rest. ``min_closing_speed=`` sets what is.

Its counterpart, for a car of length L, is
``ScanTTC(-fov / 2, fov / (num_beams - 1), num_beams, outline=(-L / 2, L / 2, -width / 2, width / 2))``
and ``scan.min(ranges, speed) < threshold``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

__all__ = ["BeamTables", "beam_tables", "check_ttc_jit"]


class BeamTables(NamedTuple):
    """The tables that the simulator computes once for its beams. Each is float64 of shape (num_beams,)."""

    scan_angles: NDArray[np.float64]
    """Directions of the beams, rad, from -fov / 2 counter-clockwise."""
    cosines: NDArray[np.float64]
    """Cosines of the directions."""
    side_distances: NDArray[np.float64]
    """Distances from the centre of the body to its side or end along the beam, m; -inf at angle exactly 0."""


def beam_tables(
    num_beams: int = 1080,
    fov: float = 4.7,
    *,
    width: float = 0.31,
    lf: float = 0.15875,
    lr: float = 0.17145,
) -> BeamTables:
    """Compute the per-beam tables of the simulator.

    Parameters
    ----------
    num_beams : int
        Number of beams, at least 2.
    fov : float
        Angle from the first beam to the last, rad; the middle looks ahead.
    width : float
        Width of the car, m.
    lf, lr : float
        Distances from the centre of gravity to the front and the rear axle, m. The simulator takes half their sum, half
        the *wheelbase*, for half the length of the car.

    Returns
    -------
    BeamTables

    Raises
    ------
    ValueError
        If there are fewer than two beams: the simulator divides by their number less one.

    Examples
    --------
    >>> from ttc_fast.compat.f1tenth_gym import beam_tables
    >>> beam_tables(1080).side_distances.min().round(3)       # across the car; along it the bumper is at 0.29
    np.float64(0.155)
    >>> beam_tables(3).side_distances[1]                      # straight ahead
    np.float64(-inf)
    """
    if num_beams < 2:
        raise ValueError(f"num_beams must be at least 2, got {num_beams}")
    angles = -fov / 2.0 + np.arange(num_beams, dtype=np.float64) * (fov / (num_beams - 1))
    half_width, half_length = width / 2.0, (lf + lr) / 2.0

    # Not np.abs: an angle of 0 becomes -0.0, and half_width / sin(-0.0) is the -inf of a beam straight ahead.
    from_ahead = np.where(angles > 0.0, angles, -angles)
    from_abeam = from_ahead - np.pi / 2.0
    ahead = from_ahead < np.pi / 2.0
    with np.errstate(divide="ignore", invalid="ignore"):
        to_side = half_width / np.where(ahead, np.sin(from_ahead), np.cos(from_abeam))
        to_end = half_length / np.where(ahead, np.cos(from_ahead), np.sin(from_abeam))
    # Not np.minimum: like Python's min(), the first stays unless the second is less, also where one is NaN.
    return BeamTables(angles, np.cos(angles), np.where(to_end < to_side, to_end, to_side))


def check_ttc_jit(
    scan: ArrayLike,
    vel: float,
    scan_angles: ArrayLike,
    cosines: ArrayLike,
    side_distances: ArrayLike,
    ttc_thresh: float,
) -> bool:
    """Whether the simulator would stop the car: ``0 <= (scan - side) / (vel cos) < ttc_thresh`` for any beam.

    The name and the arguments are those of the simulator. The top of this module lists the quirks.

    Parameters
    ----------
    scan : array_like, shape (num_beams,)
        Ranges, m. NaN, +inf and -inf never hit.
    vel : float
        Speed of the car, forward, m/s; negative when reversing. At exactly 0 nothing hits; NaN never hits.
    scan_angles : array_like
        Not used by the simulator, nor here.
    cosines, side_distances : array_like, shape (num_beams,)
        The tables that ``beam_tables`` returns.
    ttc_thresh : float
        s; the simulator uses 0.005. A TTC equal to it is no hit.

    Returns
    -------
    bool

    Raises
    ------
    ValueError
        If the arrays differ in length. (The simulator reads past the end of a short one.)

    Examples
    --------
    A wall 2 m ahead of the sensor, at 5 m/s:

    >>> import numpy as np
    >>> from ttc_fast.compat.f1tenth_gym import beam_tables, check_ttc_jit
    >>> tables = beam_tables(1080)
    >>> with np.errstate(divide="ignore"):
    ...     scan = np.where(tables.cosines > 0.0, 2.0 / tables.cosines, np.inf)
    >>> check_ttc_jit(scan, 5.0, *tables, 0.5), check_ttc_jit(scan, 5.0, *tables, 0.3)
    (True, False)
    """
    del scan_angles
    ranges, cosines, sides = (np.asarray(array, np.float64) for array in (scan, cosines, side_distances))
    if not ranges.shape == cosines.shape == sides.shape or ranges.ndim != 1:
        raise ValueError(
            "scan, cosines and side_distances must be one-dimensional and of one length, "
            f"got shapes {ranges.shape}, {cosines.shape} and {sides.shape}"
        )
    if vel == 0.0:
        return False
    with np.errstate(all="ignore"):
        ttc = (ranges - sides) / (vel * cosines)
    return bool(np.any((ttc >= 0.0) & (ttc < ttc_thresh)))
