"""A job of one size, as the clocks and tables see it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

if TYPE_CHECKING:
    from benches.contestant import Contestant


class Case(Protocol):
    """Light: inputs and contestants are made when asked for."""

    @property
    def call(self) -> str:
        """What is asked."""

    @property
    def size(self) -> str:
        """Of what."""

    @property
    def dtype(self) -> str:
        """Of the numbers in it."""

    @property
    def nbytes(self) -> int:
        """Of the input of one call."""

    @property
    def names(self) -> list[str]:
        """Of everybody who can do the job here; ttc_fast first."""

    def pool(self) -> list[Any]:
        """Inputs to be asked about in turn."""

    def contestant(self, name: str) -> Contestant:
        """One of ``names``."""

    def check(self, contestant: Contestant) -> None:
        """Compare every answer with the right one; AssertionError if one differs."""


class Entrant(NamedTuple):
    """One contestant of one case: what takes a turn."""

    case: Case
    name: str

    @property
    def exists(self) -> bool:
        """Whether it can be measured here."""
        return self.name in self.case.names

    def checked(self) -> Contestant:
        """The contestant, after its answers were found right."""
        contestant = self.case.contestant(self.name)
        self.case.check(contestant)
        return contestant
