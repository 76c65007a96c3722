"""What is odd about messages: counted where it is usable, and refused with a reason where it is not."""

from __future__ import annotations

import contextlib
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable


class RefusedError(ValueError):
    """A message that cannot be used: the text says in one sentence what is wrong with it."""


def say_on_console(text: str) -> None:
    """Write a line to the standard error; a console that is closed or full stops nothing."""
    with contextlib.suppress(OSError, ValueError):
        print(f"ttc_fast: {text}", file=sys.stderr, flush=True)


class Tally:
    """Counts what happens to messages, and says each kind of it once, when it first happens.

    Parameters
    ----------
    say : callable, optional
        Is called with a sentence the first time that something happens.

    Examples
    --------
    >>> from ttc_fast.sensors.oddities import Tally
    >>> odd = Tally(print)
    >>> for _ in range(3):
    ...     odd.count("/scan", "has no stamp")
    /scan: has no stamp
    >>> odd.values("odd")
    [('odd: /scan', '3; has no stamp')]
    """

    def __init__(self, say: Callable[[str], None] | None = None) -> None:
        self._say = say
        self._counts: dict[str, int] = {}
        self._why: dict[str, str] = {}

    def count(self, where: str, why: str) -> None:
        """Count one more: where it happened is its kind, and the reason of the last one is kept."""
        count = self._counts.get(where, 0) + 1
        self._counts[where] = count
        self._why[where] = why
        if count == 1 and self._say is not None:
            self._say(f"{where}: {why}" if why else where)

    def of(self, where: str) -> int:
        """Return how often it happened."""
        return self._counts.get(where, 0)

    def values(self, title: str) -> list[tuple[str, str]]:
        """Return a key and a value for each kind, as diagnostics have them."""
        return [(f"{title}: {where}", f"{n}; {self._why[where]}".strip("; ")) for where, n in self._counts.items()]

    def sentences(self) -> list[str]:
        """Return a sentence for each kind, as a summary has them."""
        return [f"{where}, {times(count)}: {self._why[where]}" for where, count in self._counts.items()]


def times(count: int) -> str:
    """Return how often, for people.

    Examples
    --------
    >>> from ttc_fast.sensors.oddities import times
    >>> times(1), times(3)
    ('once', '3 times')
    """
    return "once" if count == 1 else f"{count} times"
