"""Settings of the brake, checked with the reason when refused."""

from __future__ import annotations

import math
import operator
from typing import Any


def number(argument: str, value: Any) -> float:
    """Return ``value`` as a float, if it is a number."""
    try:
        if isinstance(value, (str, bytes)):
            raise TypeError
        return float(value)
    except (TypeError, ValueError):
        raise TypeError(f"{argument} must be a number, got {value!r}") from None


def above_zero(argument: str, value: Any, unit: str) -> float:
    """Return ``value``, if it is finite and above 0."""
    if not 0.0 < number(argument, value) < math.inf:
        raise ValueError(f"{argument} must be finite and above 0 {unit}, got {value}")
    return float(value)


def not_negative(argument: str, value: Any, unit: str) -> float:
    """Return ``value``, if it is finite and at least 0."""
    if not 0.0 <= number(argument, value) < math.inf:
        raise ValueError(f"{argument} must be finite and at least 0 {unit}, got {value}")
    return float(value)


def at_least(argument: str, value: Any, least: float, why: str) -> float:
    """Return ``value``, if it is finite and at least ``least``."""
    if not least <= number(argument, value) < math.inf:
        raise ValueError(f"{argument} must be finite and at least {least:g}, got {value}: {why}")
    return float(value)


def count(argument: str, value: Any) -> int:
    """Return ``value``, if it is a whole number of at least 0."""
    try:
        result = operator.index(value)
    except TypeError:
        raise TypeError(f"{argument} must be a whole number, got {value!r}") from None
    if result < 0:
        raise ValueError(f"{argument} must be at least 0, got {value}")
    return result


def finite(argument: str, value: Any) -> float:
    """Return ``value`` as a float, if it is a finite number."""
    result = value if type(value) is float else number(argument, value)
    if not -math.inf < result < math.inf:
        raise ValueError(f"{argument} must be finite, got {value}")
    return result
