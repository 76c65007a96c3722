"""Somebody who does a job, and how the expression that does it is put where it is needed."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


@dataclass(frozen=True)
class Contestant:
    """A name, and an expression as a user would write it, of ``ranges`` and of other ``names``."""

    name: str
    expression: str
    names: Mapping[str, Any] = field(repr=False)

    def compiled(self, template: str, **names: Any) -> Callable[..., Any]:
        """The function ``timed`` of ``template``, with the expression in the place of ``EXPRESSION``.

        Compiled into the timing loop itself, as ``timeit`` does it, because one call more would cost as much as some
        of the answers.
        """
        scope = {**self.names, **names}
        exec(template.replace("EXPRESSION", self.expression), scope)
        timed: Callable[..., Any] = scope["timed"]
        return timed

    def answer(self, ranges: Any) -> Any:
        """What it says of a scan or a batch."""
        return self.compiled("def timed(ranges):\n    return EXPRESSION\n")(ranges)
