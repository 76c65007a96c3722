"""Numbers of a command line: readers that say what they wanted."""

from __future__ import annotations

import argparse
import math
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable

T = TypeVar("T", float, int)


def _number(kind: type[T], wanted: str, accepts: Callable[[T], bool]) -> Callable[[str], T]:
    def read(text: str) -> T:
        try:
            number = kind(text)
        except ValueError:
            number = None
        if number is None or not accepts(number):
            raise argparse.ArgumentTypeError(f"must be {wanted}, got {text!r}")
        return number

    return read


finite = _number(float, "a finite number", math.isfinite)
bound = _number(float, "a number, inf included", lambda number: not math.isnan(number))
positive = _number(float, "a finite number above 0", lambda number: 0.0 < number < math.inf)
count = _number(int, "a whole number from 0", lambda number: number >= 0)
positive_count = _number(int, "a whole number from 1", lambda number: number >= 1)
