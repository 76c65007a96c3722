"""What is printed: a console, lines of a summary, words for numbers."""

from __future__ import annotations

import math

from rich.console import Console
from rich.text import Text

PIPE_WIDTH = 120
"""Columns, where no terminal tells."""


def open_console() -> Console:
    """Open standard output: as wide as the terminal, or wide enough for the table in a pipe."""
    console = Console(highlight=False)
    return console if console.is_terminal else Console(highlight=False, width=PIPE_WIDTH)


def line(console: Console, name: str, text: str) -> None:
    """Print a line of a summary."""
    console.print(Text.assemble((f"{name:<12}", "bold"), text), soft_wrap=True)


def number(value: float, digits: int) -> str:
    """Show a number, and a dash where it is not known."""
    return "-" if math.isnan(value) else f"{value:.{digits}f}"


def frames(count: int) -> str:
    """Say how many frames."""
    return "1 frame" if count == 1 else f"{count} frames"


def times(count: int) -> str:
    """Say how often."""
    return {0: "never", 1: "once"}.get(count, f"{count} times")
