"""``ttc-fast demo``: replay a log, whatever it is of."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ttc_fast.cli import demo_clouds, demo_scans
from ttc_fast.cli.exits import FAILED, USAGE, CommandError
from ttc_fast.cli.numbers import count, positive
from ttc_fast.demo import SAMPLES
from ttc_fast.logs import FORMATS, CloudLog, DistanceLog, LogError, open_log

if TYPE_CHECKING:
    import argparse

    from matplotlib.figure import Figure

SUMMARY = "replay a log of scans or clouds: a table and a picture of its TTC"
DESCRIPTION = f"""\
Replay a recorded log, frame by frame: print a table of the time to collision (TTC) and draw a picture of it.
Laser scans go through ttc_fast.ScanTTC.nearest, point clouds through ttc_fast.ttc_from_clouds.

PATH is {FORMATS}.
Without PATH it replays a simulated log that comes with the package: laser scans of a small car that brakes
late for a parked box, or with --sample clouds the point clouds of a car that follows another one, which brakes.

A .npz of scans holds the arrays t, ranges, angle_min, angle_increment, range_min, range_max, and optionally v
(speed), w (yaw rate), mount, outline. A .npz of clouds holds t, points, counts, sensor_height, and optionally
front_offset. All in m, m/s, rad and s; x is forward, y is left, z is up. Published TTC tables of KITTI frames use
--gate-x 2 20 --min-intensity 0.1 --estimator minimum.
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare the options: those of every log, then those of each kind."""
    what = parser.add_mutually_exclusive_group()
    what.add_argument("path", nargs="?", type=Path, metavar="PATH", help="log to replay")
    what.add_argument(
        "--sample", choices=sorted(SAMPLES), default="scans", help="without PATH, which log to replay (default: scans)"
    )
    add = parser.add_argument
    add(
        "--threshold",
        type=positive,
        metavar="S",
        help=f"mark a TTC below this, s (default: {demo_scans.THRESHOLD}, of clouds {demo_clouds.THRESHOLD})",
    )
    add(
        "--rows",
        type=count,
        default=20,
        metavar="N",
        help="about how many rows to print; 0 prints all (default: %(default)s)",
    )
    add(
        "--out", type=Path, default=Path("demo-out"), metavar="DIR", help="folder of the picture (default: %(default)s)"
    )
    add("--no-plot", dest="plot", action="store_false", help="draw no picture")
    for kind in (demo_scans, demo_clouds):
        group = parser.add_argument_group(f"for {kind.WHAT}")
        for flag, settings in kind.OPTIONS.items():
            group.add_argument(flag, **settings)


def run(arguments: argparse.Namespace) -> None:
    """Replay, print, draw."""
    from ttc_fast.demo.table import line, open_console

    log = open_log(arguments.path or SAMPLES[arguments.sample])
    if isinstance(log, DistanceLog):
        raise LogError(log.path, "is a log of distances; the demo replays those of scans and clouds")
    given = _given(arguments, log)
    console = open_console()
    try:
        if isinstance(log, CloudLog):
            figure = demo_clouds.play(log, given, console, rows=arguments.rows, plot=arguments.plot)
        else:
            figure = demo_scans.play(log, given, console, rows=arguments.rows, plot=arguments.plot)
    except ValueError as error:
        raise LogError(log.path, str(error)) from error
    if figure:
        line(console, "  picture", str(_save(figure, arguments.out / f"{log.path.resolve().stem}.png")))


def _given(arguments: argparse.Namespace, log: object) -> dict[str, Any]:
    """Return the settings that were given; refuse those that are for another kind of log."""
    kind, other = (demo_clouds, demo_scans) if isinstance(log, CloudLog) else (demo_scans, demo_clouds)
    given = {name: tuple(v) if isinstance(v, list) else v for name, v in vars(arguments).items() if v is not None}
    for flag in other.OPTIONS:
        if _name(flag) in given:
            raise CommandError(USAGE, f"{flag} is for {other.WHAT}, and this is a log of {kind.WHAT}; leave it out")
    return {name: given[name] for name in ("threshold", *map(_name, kind.OPTIONS)) if name in given}


def _name(flag: str) -> str:
    return flag.removeprefix("--").replace("-", "_")


def _save(figure: Figure, picture: Path) -> Path:
    try:
        picture.parent.mkdir(parents=True, exist_ok=True)
        figure.draw_without_rendering()  # once more than matplotlib does: its layout settles in two steps
        figure.savefig(picture, dpi=110)
    except OSError as error:
        problem = f"cannot write {picture}: {error.strerror or error}; choose another folder with --out"
        raise CommandError(FAILED, problem) from error
    return picture
