"""Tables for the terminal and for documents, and how times are written in them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

if TYPE_CHECKING:
    from collections.abc import Sequence

WIDTH = 130
"""Of the widest table; a narrower terminal wraps it."""


@dataclass(frozen=True)
class Report:
    """A table with a title and a legend."""

    title: str
    legend: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]

    def rich(self) -> Table:
        table = Table(title=self.title, caption=self.legend, caption_justify="left", title_justify="left")
        for column, name in enumerate(self.header):
            table.add_column(name, justify="left" if column == 0 else "right")
        for row in self.rows:
            table.add_row(*row)
        return table

    def markdown(self) -> str:
        rule = ["---", *("---:" for _ in self.header[1:])]
        lines = [f"| {' | '.join(row)} |" for row in (self.header, rule, *self.rows)]
        return "\n".join([f"### {self.title}", "", self.legend, "", *lines, ""])


def console() -> Console:
    """The terminal, or whatever stands in for it, wide enough."""
    wide = Console()
    wide.width = max(wide.width, WIDTH)
    return wide


def time_of(ns: float) -> str:
    """Three digits of a time."""
    for unit, size in (("ms", 1e6), ("us", 1e3)):
        if ns >= 0.9995 * size:
            return f"{ns / size:.3g} {unit}"
    return f"{ns:.0f} ns"


def number(ratio: float) -> str:
    """Two or three digits of a ratio."""
    return f"{ratio:.0f}" if ratio >= 10 else f"{ratio:.2g}" if ratio < 1 else f"{ratio:.1f}"
