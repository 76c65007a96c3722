"""Checks of arguments and settings.

Each check takes the name of the argument and its value, and returns the value in its own type. A value of the wrong
type raises TypeError, one out of range ValueError; the message names the argument, says what would be right, and shows
what was given.
"""

from __future__ import annotations

import math
import operator
import reprlib
from enum import Enum
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

SHOWN = reprlib.Repr()
SHOWN.maxlevel, SHOWN.maxstring, SHOWN.maxother, SHOWN.maxlong = 3, 200, 200, 200
SHOWN.maxlist = SHOWN.maxtuple = SHOWN.maxdict = SHOWN.maxset = SHOWN.maxfrozenset = 12


def shown(value: Any) -> str:
    """Return a value as a message shows it, cut where it is long: a few lines of YAML may stand for gigabytes."""
    try:
        return SHOWN.repr(value)
    except Exception:  # such as a number of more digits than Python writes
        return f"a value of type {type(value).__name__}"


def number(argument: str, value: Any) -> float:
    """Return ``value`` as a float. NaN and inf are numbers, True is none."""
    try:
        if isinstance(value, (str, bytes, bool)):
            raise TypeError
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"{argument} must be a number, got {shown(value)}") from None


def finite(argument: str, value: Any) -> float:
    """Return ``value`` as a float if it is a finite number."""
    result = value if type(value) is float else number(argument, value)
    if not -math.inf < result < math.inf:
        raise ValueError(f"{argument} must be finite, got {value}")
    return result


def positive(argument: str, value: Any, unit: str = "") -> float:
    """Return ``value`` as a float if it is finite and above 0."""
    if not 0.0 < number(argument, value) < math.inf:
        raise ValueError(f"{argument} must be finite and above {_with_unit(0.0, unit)}, got {value}")
    return float(value)


def non_negative(argument: str, value: Any, unit: str = "") -> float:
    """Return ``value`` as a float if it is finite and at least 0."""
    return at_least(argument, value, 0.0, unit=unit)


def at_least(argument: str, value: Any, least: float, reason: str = "", *, unit: str = "") -> float:
    """Return ``value`` as a float if it is finite and at least ``least``; the message ends with the reason."""
    if not least <= number(argument, value) < math.inf:
        problem = f"{argument} must be finite and at least {_with_unit(least, unit)}, got {value}"
        raise ValueError(f"{problem}: {reason}" if reason else problem)
    return float(value)


def from_to(argument: str, value: Any, least: float, most: float, unit: str = "") -> float:
    """Return ``value`` as a float if it lies from ``least`` to ``most``."""
    if not least <= number(argument, value) <= most:
        raise ValueError(f"{argument} must be from {least:g} to {_with_unit(most, unit)}, got {value}")
    return float(value)


def not_nan(argument: str, value: Any, least: float | None = None, unit: str = "") -> float:
    """Return ``value`` as a float if it is a number, inf included, and at least ``least``."""
    result = number(argument, value)
    if math.isnan(result) or (least is not None and result < least):
        limit = "" if least is None else f" of at least {_with_unit(least, unit)}"
        raise ValueError(f"{argument} must be a number{limit}, inf included, got {value}")
    return result


def count(argument: str, value: Any, least: int = 0, most: int | None = None) -> int:
    """Return ``value`` as an int if it is a whole number from ``least`` to ``most``."""
    try:
        if isinstance(value, bool):
            raise TypeError
        result = operator.index(value)
    except TypeError:
        raise TypeError(f"{argument} must be a whole number, got {shown(value)}") from None
    if most is not None and not least <= result <= most:
        raise ValueError(f"{argument} must be from {least} to {most}, got {value}")
    if result < least:
        raise ValueError(f"{argument} must be at least {least}, got {value}")
    return result


def flag(argument: str, value: Any) -> bool:
    """Return ``value`` as a bool if it is True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{argument} must be True or False, got {shown(value)}")
    return bool(value)


def text(argument: str, value: Any) -> str:
    """Return ``value`` if it is a string."""
    if not isinstance(value, str):
        raise TypeError(f"{argument} must be a text, got {shown(value)}")
    return value


def choice(argument: str, value: Any, options: Sequence[Any], reason: str = "") -> Any:
    """Return ``value`` if it is one of the options; the message ends with the reason."""
    if not any(value is option or (isinstance(value, (str, int)) and value == option) for option in options):
        *names, last = [
            f"{type(option).__name__}.{option.name}" if isinstance(option, Enum) else repr(option) for option in options
        ]
        problem = f"{argument} must be {', '.join(names)} or {last}, got {shown(value)}"
        raise ValueError(f"{problem}: {reason}" if reason else problem)
    return value


def interval(argument: str, value: Any) -> tuple[float, float] | None:
    """Return ``value`` as two floats, the lower one first, if it is an interval; None is an interval not known."""
    if value is None:
        return None
    try:
        low, high = map(float, value)
    except (TypeError, ValueError):
        raise TypeError(f"{argument} must be None or two numbers, got {shown(value)}") from None
    if not low <= high:
        raise ValueError(f"{argument} must be a lower end and an upper one, got {shown(value)}")
    return low, high


def numbers(argument: str, value: Any, names: Sequence[str]) -> tuple[float, ...]:
    """Return ``value`` as a tuple of floats if it has a number for each of the names."""
    try:
        if isinstance(value, (str, bytes)):
            raise TypeError
        result = tuple(number(argument, each) for each in value)
    except TypeError:
        raise TypeError(f"{argument} must be a list of numbers, got {shown(value)}") from None
    if len(result) != len(names):
        raise ValueError(f"{argument} must be {len(names)} numbers ({', '.join(names)}), got {shown(value)}")
    return result


def ordered(argument: str, numbers: tuple[float, ...], names: Sequence[str], order: str) -> None:
    """Raise if of each two numbers the first is not ``order`` the second, which is < or <=."""
    pairs = [slice(i, i + 2) for i in range(0, len(names), 2)]
    if not all(low < high or (low == high and order == "<=") for low, high in (numbers[pair] for pair in pairs)):
        rule = " and ".join(f" {order} ".join(names[pair]) for pair in pairs)
        raise ValueError(f"{argument} must be ({', '.join(names)}) with {rule}, got {shown(numbers)}")


def texts(argument: str, value: Any, what: str = "texts") -> tuple[str, ...]:
    """Return ``value`` as a tuple if it is a list of strings; the message calls them ``what``."""
    if not isinstance(value, (list, tuple)) or not all(isinstance(each, str) for each in value):
        raise TypeError(f"{argument} must be a list of {what}, got {shown(value)}")
    return tuple(value)


def flags(argument: str, value: Any) -> Any:
    """Return ``value`` if it is an array, or a list of True and False."""
    if not isinstance(value, np.ndarray):
        if not isinstance(value, (list, tuple)):
            raise TypeError(f"{argument} must be a list of True and False, got {shown(value)}")
        for index, each in enumerate(value):
            flag(f"{argument}[{index}]", each)
    return value


def votes(argument: str, value: Any) -> tuple[int, int] | tuple[float, float]:
    """Return ``value`` as (N, M), N of the last M frames, or as (share, seconds), a share of those of the last seconds.

    Two whole numbers are (N, M), and so are two floats without a fraction, of which the first is above 1: files and ROS
    may have nothing else.
    """
    problem = (
        f"{argument} must be two integers (N, M), N of the last M frames, with 1 <= N <= M <= 64, or (share, seconds), "
        f"a share above 0 and at most 1 of the frames of the last seconds, up to 60; got {shown(value)}"
    )
    try:
        first, second = (each if is_whole(each) else number(argument, each) for each in value)
    except (TypeError, ValueError):
        raise TypeError(problem) from None
    if first > 1.0 and float(first).is_integer() and float(second).is_integer():
        first, second = int(first), int(second)
    if is_whole(first) and is_whole(second):
        if 1 <= first <= second <= 64:
            return int(first), int(second)
    elif 0.0 < first <= 1.0 and 0.0 < second <= 60.0:
        return float(first), float(second)
    raise ValueError(problem)


def is_whole(value: Any) -> bool:
    """Return whether ``value`` is of an integer type other than bool."""
    return hasattr(value, "__index__") and not isinstance(value, (bool, np.bool_))


def _with_unit(value: float, unit: str) -> str:
    return f"{value:g} {unit}".rstrip()
