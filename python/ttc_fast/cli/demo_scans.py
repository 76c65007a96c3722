"""What ``ttc-fast demo`` does with a log of laser scans."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ttc_fast.cli.numbers import count, finite
from ttc_fast.demo import name_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import Console

    from ttc_fast.logs import ScanLog

WHAT = "laser scans"
THRESHOLD = 0.7  # s
OPTIONS: dict[str, dict[str, Any]] = {
    "--support": {
        "type": count,
        "metavar": "N",
        "help": "neighbouring beams that must agree with the nearest one; 0 lets a lone reading decide (default: 1)",
    },
    "--speed": {"type": finite, "metavar": "V", "help": "of the vehicle, m/s, negative when reversing"},
    "--range-min": {"type": finite, "metavar": "M", "help": "readings below this are discarded, m"},
    "--mount": {
        "type": finite,
        "nargs": 3,
        "metavar": ("X", "Y", "YAW"),
        "help": "of the scanner on the vehicle, m and rad",
    },
    "--outline": {
        "type": finite,
        "nargs": 4,
        "metavar": ("REAR", "FRONT", "RIGHT", "LEFT"),
        "help": "of the vehicle, m; rear and right are usually negative",
    },
}
PLACE = ("range_min", "mount", "outline")  # instead of what the log says of its scanner


def play(log: ScanLog, given: dict[str, Any], console: Console, *, rows: int, plot: bool) -> Figure | None:
    """Replay the log with the settings given, print the table, and draw the picture if it is wanted."""
    from ttc_fast.demo.scans import replay, table
    from ttc_fast.demo.table import watch

    if plot:
        from ttc_fast.demo.scans import picture  # before the table, to say early that a package is missing

    place = {name: given.pop(name) for name in PLACE if name in given}
    settings = {"threshold": THRESHOLD, **given}
    result = replay.replay(log, watch(log), scanner=replace(log.scanner, **place), **settings)
    table.report(result, console, rows=rows)
    return picture.draw(result, f"{name_of(log.path)}, {result.scan.beams} beams, {result.pace}") if plot else None
