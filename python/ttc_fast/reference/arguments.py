"""The checks of arguments: numbers, arrays of floats, and arrays to write to; and how a class shows its settings.

Each check takes the name of the argument and its value, and returns the value in its own type. A value of the wrong
type raises TypeError, one out of range ValueError; the message names the argument.
"""

from __future__ import annotations

import math
import operator
from typing import TYPE_CHECKING, Any, SupportsFloat, SupportsIndex, TypeVar

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import DTypeLike, NDArray

    Floats = NDArray[np.floating[Any]]

_Class = TypeVar("_Class", bound=type)


def shows_settings(*names: str) -> Callable[[_Class], _Class]:
    """Give a class a property for each setting, which its constructor keeps in ``self._settings``."""

    def shown(name: str) -> property:
        return property(lambda self: self._settings[name], doc=f"The setting ``{name}``.")

    def decorated(cls: _Class) -> _Class:
        for name in names:
            setattr(cls, name, shown(name))
        return cls

    return decorated


def as_array(argument: str, values: Any) -> NDArray[Any]:
    """Return ``values`` as an array over the same memory; of a list or a tuple a copy, with ints as floats."""
    if isinstance(values, np.ndarray):
        return values
    typed = isinstance(values, list | tuple)
    kind = type(values).__name__
    try:
        array: NDArray[Any] = np.asarray(memoryview(values))
    except TypeError:
        if not typed and not any(hasattr(values, name) for name in ("__dlpack__", "__array_interface__", "__array__")):
            problem = f"must be a numpy array of float32 or float64, or a list of numbers, got {kind}"
            raise TypeError(f"{argument} {problem}") from None
        try:
            array = np.from_dlpack(values) if hasattr(values, "__dlpack__") else np.asarray(values)
        except Exception as error:
            raise TypeError(f"{argument} of type {kind} cannot be read as a numpy array: {error}") from None
    return array.astype(np.float64) if typed and array.dtype.kind == "i" else array


def floats(argument: str, values: Any) -> Floats:
    """Return ``values`` as an array over the same memory: float32 or float64, a scan (1-D) or a batch (2-D)."""
    array = as_array(argument, values)
    if array.ndim not in (1, 2):
        raise ValueError(f"{argument} must have 1 or 2 dimensions, got shape {array.shape}")
    if array.dtype not in (np.float32, np.float64):
        raise TypeError(f"{argument} must have dtype float32 or float64, got {array.dtype}")
    return array


def output(argument: str, array: Any, ranges: Floats, dtype: DTypeLike) -> NDArray[Any]:
    """Return ``array`` if results for ``ranges`` may be written to it: of the same shape, and apart in memory.

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
    """Return ``value`` as a float if it is a single number."""
    if np.ndim(value) == 0 and isinstance(value, SupportsFloat | SupportsIndex):
        return float(value)
    raise TypeError(f"{argument} must be a number, got {value!r}")


def finite(argument: str, value: Any) -> float:
    """Return ``value`` as a float if it is a single finite number."""
    result = number(argument, value)
    if not math.isfinite(result):
        raise ValueError(f"{argument} must be a finite number, got {result}")
    return result


def not_nan(argument: str, value: Any) -> float:
    """Return ``value`` as a float if it is a single number other than NaN."""
    result = number(argument, value)
    if math.isnan(result):
        raise ValueError(f"{argument} must be a number, got {result}")
    return result


def non_negative(argument: str, value: Any) -> float:
    """Return ``value`` as a float if it is a single finite number of at least 0."""
    result = finite(argument, value)
    if result < 0:
        raise ValueError(f"{argument} must be at least 0, got {result}")
    return result


def positive(argument: str, value: Any) -> float:
    """Return ``value`` as a float if it is a single finite number above 0."""
    result = finite(argument, value)
    if not result > 0:
        raise ValueError(f"{argument} must be above 0, got {result}")
    return result


def duration(argument: str, value: Any, longest: float) -> float:
    """Return ``value`` as a float if it is a number of seconds above 0 and at most ``longest``."""
    seconds = number(argument, value)
    if not 0 < seconds <= longest:
        raise ValueError(f"{argument} must be above 0 and at most {longest} s, got {seconds}")
    return seconds


def count_in(argument: str, value: Any, least: int, most: int) -> int:
    """Return ``value`` as an int if it is a whole number from ``least`` to ``most``."""
    result = operator.index(value)
    if not least <= result <= most:
        raise ValueError(f"{argument} must be at least {least} and at most {most}, got {result}")
    return result


def choice(argument: str, value: Any, options: tuple[str, str]) -> str:
    """Return ``value`` if it is one of the two options."""
    if value not in options:
        raise ValueError(f"{argument} must be {options[0]!r} or {options[1]!r}, got {value!r}")
    return str(value)


def checked_threads(threads: Any) -> int:
    """Return ``threads`` if that many can work."""
    return count_in("threads", threads, 1, 1024)


def checked_dt(dt: Any) -> float:
    """Return ``dt`` if that many seconds can lie between two frames."""
    seconds = finite("dt", dt)
    if not seconds > 0:
        raise ValueError(f"dt must be above 0 s, got {seconds}; it is the time between the two, from their stamps")
    return seconds


def checked_no_data(no_data: Any) -> float | None:
    """Return what ``min`` gives where a sensor is blind."""
    if no_data is None:
        return None
    seconds = number("no_data", no_data)
    if not seconds >= 0:
        raise ValueError(f"no_data must be a time in [0, inf], in seconds, got {seconds}")
    return seconds
