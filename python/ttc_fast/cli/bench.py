"""``ttc-fast bench``: times against the reference."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ttc_fast._exit_codes import FAILED
from ttc_fast.cli.exits import CommandError
from ttc_fast.cli.options import positive_count

if TYPE_CHECKING:
    import argparse

SUMMARY = "time ttc_fast against its NumPy reference"
DESCRIPTION = """\
  ttc-fast bench
  ttc-fast bench --beams 271 --rounds 200

Time ttc_fast against its NumPy reference on this machine, in turns, and check that they agree: the methods of ScanTTC
on one scan, and robust_min_x with KthSmallest(20) on one cloud. In a checkout of the project, python -m benches.report
compares it with other NumPy code and numba as well.
"""
COMMON = ("--beams", "--points", "--rounds")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    add = parser.add_argument
    add(
        "--beams",
        type=positive_count,
        default=1080,
        metavar="N",
        help="The number of beams of a scan (default %(default)s).",
    )
    add(
        "--points",
        type=positive_count,
        default=100_000,
        metavar="N",
        help="The number of points of a cloud (default %(default)s).",
    )
    add(
        "--rounds",
        type=positive_count,
        default=50,
        metavar="N",
        help="The number of turns of each side, of which the medians are reported (default %(default)s).",
    )


def run(arguments: argparse.Namespace) -> None:
    """Compare and print."""
    from ttc_fast import bench
    from ttc_fast.replay.terminal import open_console

    try:
        timings = bench.compare(arguments.beams, arguments.points, arguments.rounds)
    except bench.AnswersDifferError as error:
        raise CommandError(FAILED, str(error)) from error
    bench.report(timings, open_console())
