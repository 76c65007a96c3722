"""What drives come to, in tables."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from benches.table import Report

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from benches.closed_loop.drive import Drive

COUNTS = ("drives", "possible", "collisions", "unavoidable", "needless stops", "of them false")
MARGINS = ("earliest", "5 %", "median", "latest", "least room")
LEGEND = (
    "Possible: there was a collision to prevent, and time to do so. Collisions: in these. Unavoidable: other "
    "collisions. Earliest to latest: from the brake to when the collision would have been; room: what was left before "
    "the car when it stood, at most 3 m. Both in possible drives."
)


def table(title: str, first: str, drives: Mapping[str, Sequence[Drive]]) -> Report:
    """A row for each setting, or kind of scenario."""
    rows = [[name, *counts(each), *margins(each)] for name, each in drives.items()]
    return Report(title, LEGEND, [first, *COUNTS, *MARGINS], rows)


def kinds(drives: Sequence[Drive]) -> dict[str, Sequence[Drive]]:
    """All of them, and those of each kind."""
    names = dict.fromkeys(each.kind for each in drives)
    return {"all": drives, **{name: [each for each in drives if each.kind == name] for name in names}}


def counts(drives: Sequence[Drive]) -> list[str]:
    """How many were what."""
    return [
        str(len(drives)),
        str(sum(each.truth.possible for each in drives)),
        str(sum(each.crashed for each in drives)),
        str(sum(each.unavoidable for each in drives)),
        str(sum(each.needless for each in drives)),
        str(sum(each.false_stop for each in drives)),
    ]


def margins(drives: Sequence[Drive]) -> list[str]:
    """When they braked, and how much was left."""
    early = [each.early for each in drives if not math.isnan(each.early)]
    room = [each.margin for each in drives if each.truth.possible and not math.isnan(each.margin)]
    if not early or not room:
        return ["-"] * len(MARGINS)
    quantiles = np.quantile(early, [1.0, 0.95, 0.5, 0.0])
    return [*(f"{each:.2f} s" for each in quantiles), f"{min(room):.2f} m"]


def gone_wrong(drives: Iterable[Drive]) -> list[str]:
    """Every drive that did, to look at it again."""
    return [
        f"{'collision' if each.crashed else 'false stop'}: {each}" for each in drives if each.crashed or each.false_stop
    ]


def needless(drives: Sequence[Drive]) -> str:
    """How near to a threshold it really was where a stop turned out needless."""
    nearest = sorted(each.truth.nearest for each in drives if each.needless)
    beyond = [f"{each:.2f}" for each in nearest if each >= 1.0]
    within = len(nearest) - len(beyond)
    text = f"of {len(nearest)} needless stops of the default {within} were within a threshold by the truth"
    return f"{text}; the others came to {', '.join(beyond)} of it" if beyond else text
