"""A call that is timed: its inputs, who answers it, how the answers are checked, and the goals for its time.

Each domain (scans, clouds, ...) makes its cases in a module of its own; ``benches.cases`` lists them all, and
pytest-benchmark, ``benches.report`` and ``benches.goals`` time what is listed there.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

OURS, TWO_THREADS = "ttc_fast", "ttc_fast, 2 threads"


def _unchanged(data: Any) -> Any:
    return data


@dataclass(frozen=True)
class Implementation:
    """An expression as a user would write it, of the input (called ``argument``) and of other ``names``."""

    expression: str
    names: Mapping[str, Any] = field(repr=False)
    argument: str = "ranges"
    prepare: Callable[[Any], Any] = field(default=_unchanged, repr=False)
    """Brings an input into the form that the expression wants, outside of the measured time."""
    verify: Callable[[Any, Any], bool] | None = field(default=None, repr=False)
    """Says whether an answer to an input is right, where the question is not the case's own (a bare read)."""

    def compiled(self, template: str, **names: Any) -> Callable[..., Any]:
        """Return the function ``timed`` of ``template``, with the expression in the place of ``EXPRESSION``.

        The expression is compiled into the timing loop itself, as ``timeit`` does it, because one call more would
        cost as much as some of the answers.
        """
        scope = {**self.names, **names}
        exec(template.replace("EXPRESSION", self.expression).replace("ARGUMENT", self.argument), scope)
        timed: Callable[..., Any] = scope["timed"]
        return timed

    def answer(self, data: Any) -> Any:
        """Return the answer to one input."""
        return self.compiled("def timed(ARGUMENT):\n    return EXPRESSION\n")(self.prepare(data))


class Share(NamedTuple):
    """A part of the time of a call: that of one of its ``of`` inputs."""

    case: Case
    name: str
    of: int = 1


@dataclass(frozen=True)
class Goal:
    """A limit on the ratio of two times: that of ``ours`` and that of ``beside``, at the case or at another one.

    With ``more`` it is a limit on their difference.
    """

    limit: float
    beside: str = OURS
    other: Case | None = None
    """The case of ``beside``, where it is another one. Our time is to be at most ``limit`` times that time then;
    without another case the time of ``beside`` is to be at least ``limit`` times ours."""
    of: int = 1
    """How many inputs ``beside`` answers in a call."""
    plus: Share | None = None
    """What is added to the time of ``beside``."""
    ours: str = OURS
    label: str = ""
    """The description of ``beside`` where that takes more than its name."""
    more: bool = False
    """Whether the limit is on how much more time ours takes, us, and not on the ratio."""
    why: str = ""
    """The reason why the goal is out of reach, where it is."""

    @property
    def who(self) -> str:
        """The entry of the table beside ours."""
        return self.label or self.beside

    @property
    def at_most(self) -> bool:
        """Whether the limit is an upper one."""
        return self.more or self.other is not None

    @property
    def wanted(self) -> str:
        return f"{'≤' if self.at_most else '≥'} {self.limit:g}{' us more' if self.more else ''}"

    def parts(self, case: Case) -> list[Share]:
        """Return what the time beside consists of, at a case."""
        return [Share(self.other or case, self.beside, self.of), *([self.plus] if self.plus else [])]

    def ratio(self, ours: float, theirs: float) -> float:
        """Return what is held to the limit."""
        if self.more:
            return (ours - theirs) / 1e3
        return ours / theirs if self.other else theirs / ours

    def is_met(self, ratio: float) -> bool:
        return ratio <= self.limit if self.at_most else ratio >= self.limit


@dataclass(frozen=True, eq=False)
class Case:
    """A call over inputs of one kind. It is light: inputs and implementations are made when they are asked for."""

    call: str
    size: str
    inputs: Callable[[], Sequence[Any]]
    """Makes the inputs that the call is timed with in turn."""
    implementations: Mapping[str, Callable[[], Implementation]]
    """The implementations that can answer on this machine; ttc_fast is the first."""
    compare: Callable[[Implementation, Sequence[Any]], None]
    """Raises AssertionError if an answer is wrong."""
    goals: Sequence[Goal] = ()
    by_level: bool = False
    """Whether the instruction-set levels are compared at this case."""
    why: str = ""
    """The reason why goals are out of reach, where a goal has none of its own."""

    def __str__(self) -> str:
        return f"{self.call} {self.size}"

    @property
    def nbytes(self) -> int:
        """The bytes of one input."""
        return _nbytes(self.inputs()[0])

    def checked(self, name: str) -> Implementation:
        """Return an implementation after its answers were found right."""
        implementation, inputs = self.implementations[name](), self.inputs()
        if implementation.verify is None:
            self.compare(implementation, inputs)
        else:
            right = all(implementation.verify(data, implementation.answer(data)) for data in inputs)
            assert right, f"{self}: {name} is wrong"
        return implementation


def _nbytes(data: Any) -> int:
    if isinstance(data, np.ndarray):
        return data.nbytes
    return sum(map(_nbytes, data)) if isinstance(data, (tuple, list)) else 8


def close_to_reference(attribute: str, reference: Implementation, rtol: float = 0.0) -> Callable[..., None]:
    """Return a check that holds an attribute of each answer, or the answer itself, to that of the reference."""

    def compare(implementation: Implementation, inputs: Sequence[Any]) -> None:
        found = False
        for data in inputs:
            said, right = implementation.answer(data), reference.answer(data)
            said, right = getattr(said, attribute, said), getattr(right, attribute, right)
            np.testing.assert_allclose(said, right, rtol, err_msg=f"{implementation} is wrong")
            found = found or bool(np.isfinite(right).any())
        assert found, f"{implementation}: nothing to find"

    return compare
