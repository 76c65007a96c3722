"""What may go in: arrays of floats, arrays to write to, and numbers; everything else is refused by name."""

from __future__ import annotations

import math
import operator
from typing import TYPE_CHECKING, Any, SupportsFloat, SupportsIndex

import numpy as np

from ttc_fast.reference.geometry import Motion

if TYPE_CHECKING:
    from numpy.typing import DTypeLike, NDArray

    Floats = NDArray[np.floating[Any]]


def floats(argument: str, values: Any) -> Floats:
    """``values`` as an array over the same memory: float32 or float64, one scan (1-D) or a batch of scans (2-D)."""
    if not isinstance(values, np.ndarray):
        try:
            values = memoryview(values)
        except TypeError:
            raise TypeError(f"{argument} must be a numpy array or a buffer, got {type(values).__name__}") from None
    array: NDArray[Any] = np.asarray(values)
    if array.ndim not in (1, 2):
        raise ValueError(f"{argument} must have 1 or 2 dimensions, got shape {array.shape}")
    if array.dtype not in (np.float32, np.float64):
        raise TypeError(f"{argument} must have dtype float32 or float64, got {array.dtype}")
    return array


def output(argument: str, array: Any, ranges: Floats, dtype: DTypeLike) -> NDArray[Any]:
    """``array`` itself, if results for ``ranges`` may be written to it: of the same shape, and apart in memory.

    It may be ``ranges`` itself, but not a shifted part of it.
    """
    if not isinstance(array, np.ndarray):
        raise TypeError(f"{argument} must be a numpy array to write to, got {type(array).__name__}")
    if array.dtype != dtype:
        raise TypeError(f"{argument} must have dtype {np.dtype(dtype)}, got {array.dtype}")
    if array.shape != ranges.shape:
        raise ValueError(f"{argument} must have the shape {ranges.shape}, got {array.shape}")
    if not array.flags.writeable:
        raise ValueError(f"{argument} is read-only")
    same = array.ctypes.data == ranges.ctypes.data and array.strides == ranges.strides and array.dtype == ranges.dtype
    if not same and np.may_share_memory(array, ranges):
        raise ValueError(f"{argument} overlaps the input in memory")
    return array


def number(argument: str, value: Any) -> float:
    """``value`` as a float, if it is a single number."""
    if np.ndim(value) == 0 and isinstance(value, SupportsFloat | SupportsIndex):
        return float(value)
    raise TypeError(f"{argument} must be a number, got {value!r}")


def finite(argument: str, value: Any) -> float:
    """``value`` as a float, if it is a single finite number."""
    result = number(argument, value)
    if not math.isfinite(result):
        raise ValueError(f"{argument} must be a finite number, got {result}")
    return result


def non_negative(argument: str, value: Any) -> float:
    """``value`` as a float, if it is a single finite number of at least 0."""
    result = finite(argument, value)
    if result < 0:
        raise ValueError(f"{argument} must be at least 0, got {result}")
    return result


def positive(argument: str, value: Any) -> float:
    """``value`` as a float, if it is a single finite number above 0."""
    result = finite(argument, value)
    if not result > 0:
        raise ValueError(f"{argument} must be above 0, got {result}")
    return result


def motions(ranges: Floats, speed: Any, yaw_rate: Any, lateral_speed: Any) -> list[Motion]:
    """Give each scan its motion: numbers for one scan; for a batch, numbers or arrays with one entry per scan."""
    if ranges.ndim == 1:
        return [Motion(finite("speed", speed), finite("yaw_rate", yaw_rate), finite("lateral_speed", lateral_speed))]
    columns = (
        _one_each("speed", speed, len(ranges)),
        _one_each("yaw_rate", yaw_rate, len(ranges)),
        _one_each("lateral_speed", lateral_speed, len(ranges)),
    )
    return [Motion(*row) for row in zip(*columns, strict=True)]


def _one_each(argument: str, values: Any, scans: int) -> list[float]:
    array = np.asarray(values)
    if array.ndim == 0:
        return [finite(argument, values)] * scans
    if array.shape != (scans,):
        raise ValueError(f"{argument} must be a number or have shape ({scans},), got {array.shape}")
    return [finite(argument, value) for value in array]


def checked_threads(threads: Any) -> int:
    """``threads``, if it is a number of threads."""
    if not 1 <= operator.index(threads) <= 1024:
        raise ValueError(f"threads must be at least 1 and at most 1024, got {threads}")
    return operator.index(threads)


def checked_dt(dt: Any) -> float:
    """``dt``, if it is a time that has passed."""
    seconds = finite("dt", dt)
    if not seconds > 0:
        raise ValueError(f"dt must be above 0 s, got {seconds}; it is the time between the two, from their stamps")
    return seconds
