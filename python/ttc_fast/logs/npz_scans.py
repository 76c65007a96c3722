"""Logs of laser scans as NumPy archives."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast.logs.options import SCANNER
from ttc_fast.logs.scans import ScanFrame, Scanner

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ttc_fast.logs.npz import Arrays
    from ttc_fast.logs.options import LogOptions

BEAM = ("angle_min", "angle_increment", "range_min", "range_max")
PLACE = {"mount": 3, "outline": 4}  # how many numbers each has
REQUIRED = ("t", "ranges", *BEAM)
NAMES = (*REQUIRED, "v", "w", *PLACE)


class NpzScans:
    """Scans in a NumPy archive (.npz).

    Its arrays: ``t`` (N,) s, increasing; ``ranges`` (N, beams) float32 or float64, m, as recorded; ``angle_min``,
    ``angle_increment`` (rad), ``range_min``, ``range_max`` (m), one number each. Optional: ``v`` (N,) m/s, signed;
    ``w`` (N,) rad/s, 0 when absent; ``mount`` (x, y, yaw) and ``outline`` (x_rear, x_front, y_right, y_left).

    Parameters
    ----------
    arrays : Arrays
        Of the archive.
    options : LogOptions
        What the user says of it.

    Raises
    ------
    LogError
        If an array is missing or of the wrong shape or type.
    """

    clock = "stamps of the log"

    def __init__(self, arrays: Arrays, options: LogOptions) -> None:
        options.only((*SCANNER, "speed"), arrays.path, "an archive of scans")
        arrays.require(REQUIRED)
        self.path = arrays.path
        shape = arrays["ranges"].shape
        self._ranges = arrays.readings("ranges", "(frames, beams)", fits=len(shape) == 2 and 0 not in shape)
        self.frame_count, beams = shape
        one_each = (self.frame_count, "scan of ranges")
        self._stamps = arrays.stamps(*one_each)
        self._speeds = arrays.per_frame("v", *one_each) if "v" in arrays else None
        self._yaw_rates = arrays.per_frame("w", *one_each) if "w" in arrays else np.zeros(self.frame_count)
        placed: dict[str, Any] = {name: arrays.numbers(name, n) for name, n in PLACE.items() if name in arrays}
        scanner = Scanner(**{name: arrays.numbers(name, 1)[0] for name in BEAM}, beams=beams, **placed)
        self.scanner = options.applied(scanner, SCANNER)
        self._speed = options.speed
        self.motion = _motion(self._speed, known=self._speeds is not None)

    def __iter__(self) -> Iterator[ScanFrame]:
        for i, ranges in enumerate(self._ranges):
            speed = self._speed
            if speed is None and self._speeds is not None:
                speed = float(self._speeds[i])
            yield ScanFrame(float(self._stamps[i]), ranges, speed, float(self._yaw_rates[i]))


def _motion(given: float | None, *, known: bool) -> str:
    if given is not None:
        return "speed as given"
    return "speeds of the log" if known else "the speed is unknown"
