"""Somebody who does a job, and how the expression that does it is put where it is needed."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


def _unchanged(data: Any) -> Any:
    return data


@dataclass(frozen=True)
class Contestant:
    """A name, and an expression as a user would write it, of the input (called ``argument``) and other ``names``."""

    name: str
    expression: str
    names: Mapping[str, Any] = field(repr=False)
    argument: str = "ranges"
    prepare: Callable[[Any], Any] = field(default=_unchanged, repr=False)
    """Brings an input into the form that this one wants, outside of the measured time."""
    verify: Callable[[Any, Any], bool] | None = field(default=None, repr=False)
    """Whether an answer to an input is right, where the question is not the case's own (a bare read has no time)."""

    def compiled(self, template: str, **names: Any) -> Callable[..., Any]:
        """The function ``timed`` of ``template``, with the expression in the place of ``EXPRESSION``.

        Compiled into the timing loop itself, as ``timeit`` does it, because one call more would cost as much as some
        of the answers.
        """
        scope = {**self.names, **names}
        exec(template.replace("EXPRESSION", self.expression).replace("ARGUMENT", self.argument), scope)
        timed: Callable[..., Any] = scope["timed"]
        return timed

    def answer(self, data: Any) -> Any:
        """What it says of one input."""
        return self.compiled("def timed(ARGUMENT):\n    return EXPRESSION\n")(self.prepare(data))
