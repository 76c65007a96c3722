"""What a user would write in NumPy: tables made once, in the dtype of the ranges; then a line for each step."""

from __future__ import annotations

from typing import Any

import numpy as np

from benches.scans.car import MIN_CLOSING_SPEED, RANGE_MAX, RANGE_MIN


def times(ranges: Any, closing: Any, offsets: Any) -> Any:
    usable = (ranges >= RANGE_MIN) & (ranges <= RANGE_MAX) & (closing > MIN_CLOSING_SPEED)
    return np.where(usable, np.maximum(ranges - offsets, 0.0) / closing, np.inf)


def per_beam(ranges: Any, speed: Any, cosines: Any, offsets: Any) -> Any:
    return times(ranges, speed * cosines, offsets)


def least(ranges: Any, speed: Any, cosines: Any, offsets: Any) -> Any:
    return times(ranges, speed * cosines, offsets).min()


def least_turning(ranges: Any, vx: Any, vy: Any, cosines: Any, sines: Any, offsets: Any) -> Any:
    return times(ranges, vx * cosines + vy * sines, offsets).min()


def nearest(ranges: Any, speed: Any, cosines: Any, offsets: Any) -> Any:
    return _nearest(times(ranges, speed * cosines, offsets))


def nearest_turning(ranges: Any, vx: Any, vy: Any, cosines: Any, sines: Any, offsets: Any) -> Any:
    return _nearest(times(ranges, vx * cosines + vy * sines, offsets))


def _nearest(ttc: Any) -> Any:
    beam = ttc.argmin()
    return ttc[beam], beam


def least_each(ranges: Any, speeds: Any, cosines: Any, offsets: Any) -> Any:
    return times(ranges, speeds[:, np.newaxis] * cosines, offsets).min(axis=1)


def nearest_each(ranges: Any, speeds: Any, cosines: Any, offsets: Any) -> Any:
    ttc = times(ranges, speeds[:, np.newaxis] * cosines, offsets)
    beam = ttc.argmin(axis=1)
    return np.take_along_axis(ttc, beam[:, np.newaxis], axis=1)[:, 0], beam


def ittc(ranges: Any, closing: Any) -> Any:
    return np.where((ranges >= 0.0) & (closing > 0.0), ranges / closing, np.inf)


def per_beam_each(ranges: Any, speeds: Any, cosines: Any, offsets: Any) -> Any:
    return times(ranges, speeds[:, np.newaxis] * cosines, offsets)
