"""``ttc-fast demo``: the replay, shown over the simulated logs that the package ships."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ttc_fast.cli import options
from ttc_fast.cli.replay import check, show
from ttc_fast.logs.storage import located, name_in

if TYPE_CHECKING:
    import argparse

SUMMARY = "replay the simulated logs of the package, or your own, and draw pictures"
EXTRA = "demo"
USAGE_LINE = "ttc-fast demo [OPTION ...] [PATH ...]"
DESCRIPTION = """\
  ttc-fast demo
  ttc-fast demo drive.bag --outline -0.1 0.4 -0.15 0.15

Replay logs as ttc-fast replay does, print a table and a summary of each, and draw a picture of each into a folder.

Without PATH these are the two simulated logs that come with the package: laser scans of a small car that brakes late
for a parked box, and point clouds of a car that follows another one, which brakes. PATH is anything that
ttc-fast replay reads, and the options are the same.
"""
COMMON = ("--outline", "--speed", "--criterion", "--config", "--out", "--rows")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("paths", nargs="*", type=located, metavar="PATH", help="A log to replay.")
    options.add(parser)
    out = parser.add_argument_group("what comes out")
    out.add_argument(
        "--out",
        type=Path,
        default=Path("demo-out"),
        metavar="DIR",
        help="The folder of the pictures (default %(default)s).",
    )
    options.add_rows(out)


def run(arguments: argparse.Namespace) -> None:
    """Replay, print, draw."""
    import matplotlib  # noqa: F401 - if it is missing, that is said before the table is printed

    from ttc_fast.replay import Files, sample
    from ttc_fast.replay.run import SAMPLES, name_of
    from ttc_fast.replay.terminal import line, open_console

    settings, console = options.settings(arguments), open_console()
    for path in arguments.paths or [sample(name) for name in SAMPLES]:
        name = name_in(path)
        console.print(f"Replay: {name_of(path) if isinstance(path, Path) else name}.\n", style="bold")
        picture = arguments.out / f"{name.split('.')[0]}.png"
        played, _ = show(path, settings, console, arguments.rows, Files(plot=picture))
        check(played)
        line(console, "picture", f"{picture}\n")
