"""The loop of the F1TENTH gym's collision check, as numba kernels of our own that give the least time, or its beam too.

Like there: one pass with a branch per beam, float64 tables made once, positional arguments, no fast-math.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

from benches.car import MIN_CLOSING_SPEED, RANGE_MAX, RANGE_MIN


@numba.njit(error_model="numpy")
def nearest(ranges: Any, speed: Any, cosines: Any, offsets: Any) -> Any:
    best, beam = np.inf, -1
    for i in range(ranges.shape[0]):
        closing = speed * cosines[i]
        if closing > MIN_CLOSING_SPEED and ranges[i] >= RANGE_MIN and ranges[i] <= RANGE_MAX:
            ttc = max(ranges[i] - offsets[i], 0.0) / closing
            if ttc < best:
                best, beam = ttc, i
    return best, beam


@numba.njit(error_model="numpy")
def least(ranges: Any, speed: Any, cosines: Any, offsets: Any) -> Any:
    return nearest(ranges, speed, cosines, offsets)[0]


@numba.njit(error_model="numpy")
def least_turning(ranges: Any, vx: Any, vy: Any, cosines: Any, sines: Any, offsets: Any) -> Any:
    return nearest_turning(ranges, vx, vy, cosines, sines, offsets)[0]


@numba.njit(error_model="numpy")
def nearest_turning(ranges: Any, vx: Any, vy: Any, cosines: Any, sines: Any, offsets: Any) -> Any:
    best, beam = np.inf, -1
    for i in range(ranges.shape[0]):
        closing = vx * cosines[i] + vy * sines[i]
        if closing > MIN_CLOSING_SPEED and ranges[i] >= RANGE_MIN and ranges[i] <= RANGE_MAX:
            ttc = max(ranges[i] - offsets[i], 0.0) / closing
            if ttc < best:
                best, beam = ttc, i
    return best, beam


@numba.njit(error_model="numpy")
def least_each(ranges: Any, speeds: Any, cosines: Any, offsets: Any) -> Any:
    ttc = np.empty(ranges.shape[0])
    for row in range(ranges.shape[0]):
        ttc[row] = nearest(ranges[row], speeds[row], cosines, offsets)[0]
    return ttc


@numba.njit(error_model="numpy")
def nearest_each(ranges: Any, speeds: Any, cosines: Any, offsets: Any) -> Any:
    ttc, beams = np.empty(ranges.shape[0]), np.empty(ranges.shape[0], np.int64)
    for row in range(ranges.shape[0]):
        ttc[row], beams[row] = nearest(ranges[row], speeds[row], cosines, offsets)
    return ttc, beams


@numba.njit(error_model="numpy")
def least_turning_each(ranges: Any, vx: Any, vy: Any, cosines: Any, sines: Any, offsets: Any) -> Any:
    ttc = np.empty(ranges.shape[0])
    for row in range(ranges.shape[0]):
        ttc[row] = nearest_turning(ranges[row], vx[row], vy[row], cosines, sines, offsets)[0]
    return ttc
