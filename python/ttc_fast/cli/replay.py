"""``ttc-fast replay``: recorded logs in, tables and pictures out, by the code that brakes."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

from ttc_fast.cli import replay_options
from ttc_fast.cli.exits import PARTIAL, UNREADABLE, USAGE, CommandError
from ttc_fast.cli.replay_log import opened, play, spare_logs
from ttc_fast.cli.replay_many import run_many
from ttc_fast.logs import FORMATS

if TYPE_CHECKING:
    import argparse

    from rich.console import Console

    from ttc_fast.replay import Replay, Settings

SUMMARY = "replay logs through the brake: when would it have braked, and why"
USAGE_LINE = "ttc-fast replay [OPTION ...] PATH [PATH ...]"
DESCRIPTION = f"""\
Replay recorded logs, frame by frame, through the code that brakes on the vehicle: when would it have braked, and why?

{fill(f"PATH is {FORMATS}.", 118)}
Several paths are replayed on all cores at once, and end in a table with a line each.

Scans are judged by what their beams and, with an outline, the vehicle's path run into; a log that does not know the
speed by how the ranges change. Clouds and tables of distances are tracked, and the brake judges what the tracker says.

  ttc-fast replay drive.bag --outline -0.1 0.4 -0.15 0.15 --plot drive.png
  ttc-fast replay drive.mcap --topic /scan --criterion IttcThreshold:threshold=0.7 --out rows.csv
  ttc-fast replay velodyne/ --speed 8 --gate-x 2 40 --out rows.parquet
  ttc-fast replay logs/*.bag --config car.toml --out rows.csv
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument("paths", nargs="+", type=Path, metavar="PATH", help="log to replay")
    replay_options.add(parser)
    out = parser.add_argument_group("what comes out")
    out.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="write a row for each frame, as .csv, .jsonl or .parquet; of several logs a file each, FILE with the "
        "name of the log behind it",
    )
    out.add_argument("--plot", type=Path, metavar="FILE", help="draw a picture, .png or .svg; of several logs likewise")
    replay_options.add_rows(out)
    out.add_argument("--jobs", type=replay_options.positive_count, metavar="N", help="processes (default: all cores)")


def run(arguments: argparse.Namespace) -> None:
    """Replay, write, draw, print."""
    settings = replay_options.settings(arguments)
    _check_outputs(arguments.out, arguments.plot)
    if len(arguments.paths) > 1:
        run_many(arguments.paths, settings, arguments.out, arguments.plot, arguments.jobs)
        return
    from ttc_fast.replay.terminal import open_console

    spare_logs(arguments.paths, [arguments.out])
    played = show(arguments.paths[0], settings, open_console(), arguments.rows, arguments.out, arguments.plot)
    check(played)


def show(path: Path, settings: Settings, console: Console, rows: int, out: Path | None, plot: Path | None) -> Replay:
    """Replay one log: print its rows and its summary, write and draw it."""
    from ttc_fast.replay.terminal import print_rows, print_summary, watch

    played = opened(path, settings)
    play(played, watch(played, console), out, plot)
    print_rows(played, console, rows)
    print_summary(played, console)
    return played


def check(played: Replay) -> None:
    """Complain if something of a log was lost."""
    if played.summary.lost:
        raise CommandError(PARTIAL if played.summary.frames else UNREADABLE, played.summary.lost)
    if not played.summary.frames:
        raise CommandError(UNREADABLE, f"{played.log.path}: has no frames")


def _check_outputs(out: Path | None, plot: Path | None) -> None:
    """Refuse names that say no format, and find out early that a package is missing."""
    from ttc_fast.replay.row import WRITERS

    if out is not None:
        suffix = out.suffix.lower()
        if suffix not in WRITERS:
            raise CommandError(USAGE, f"--out must end in {', '.join(WRITERS)}, got {out}")
        if suffix == ".parquet":
            import pyarrow  # noqa: F401
    if plot is not None:
        if plot.suffix.lower() not in (".png", ".svg"):
            raise CommandError(USAGE, f"--plot must end in .png or .svg, got {plot}")
        import matplotlib  # noqa: F401
