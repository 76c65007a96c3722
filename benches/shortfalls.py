"""Why a goal is out of reach: kept here, and shown wherever a run falls short of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from benches.goal import Goal

WHY: dict[tuple[str, str], str] = {}
"""By the beginning of what is asked, and whom it is compared with."""


def why(goal: Goal) -> str:
    """The first reason that fits, or that there is none yet."""
    asked = str(goal.ours.case)
    reasons = (text for (call, who), text in WHY.items() if asked.startswith(call) and who == goal.who)
    return next(reasons, "Not explained yet.")
