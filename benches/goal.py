"""What is to be reached: one time beside another."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from benches.case import Case, Entrant

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True)
class Goal:
    """A limit on the ratio of two times."""

    ours: Entrant
    other: Entrant
    limit: float
    at_least: bool
    """Whether the other's time over ours is to be at least the limit, or ours over the other's at most."""
    beside: str = ""
    """What the other one is, where that takes more than its name."""

    @property
    def who(self) -> str:
        """Whom ours is compared with."""
        return self.beside or self.other.name

    @property
    def wanted(self) -> str:
        return f"{'≥' if self.at_least else '≤'} {self.limit:g}"

    def ratio(self, times: Mapping[Entrant, float]) -> float | None:
        """None where one of the two could not be measured here."""
        if self.ours not in times or self.other not in times:
            return None
        ratio = times[self.other] / times[self.ours]
        return ratio if self.at_least else 1.0 / ratio

    def is_met(self, ratio: float) -> bool:
        return ratio >= self.limit if self.at_least else ratio <= self.limit


def faster(case: Case, other: str, limit: float, beside: str = "", ours: str = "ttc_fast") -> Goal:
    """Somebody else's time at the same job is at least so many times ours."""
    return Goal(Entrant(case, ours), Entrant(case, other), limit, True, beside)


def within(case: Case, other: Case, limit: float, beside: str) -> Goal:
    """Our time at one job is at most so many times our time at another."""
    return Goal(Entrant(case, "ttc_fast"), Entrant(other, "ttc_fast"), limit, False, beside)


def at_level(case: Case, level: str, limit: float) -> Goal:
    """Our time at a lower level is at most so many times that at the highest."""
    return Goal(Entrant(case, level), Entrant(case, "avx512"), limit, False, "AVX-512")
