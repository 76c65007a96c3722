"""What ``ttc-fast demo`` does with a log of point clouds."""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ttc_fast.cli.numbers import bound, finite, positive
from ttc_fast.demo import name_of
from ttc_fast.demo.clouds.estimators import USAGES, read_estimator

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import Console

    from ttc_fast.demo.clouds.estimators import Estimator
    from ttc_fast.logs import CloudLog

WHAT = "point clouds"
THRESHOLD = 2.5  # s


def _estimator(text: str) -> Estimator:
    try:
        return read_estimator(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


OPTIONS: dict[str, dict[str, Any]] = {
    "--estimator": {
        "type": _estimator,
        "metavar": "NAME",
        "help": f"how outliers are survived (default: kth:10), one of {USAGES}",
    },
    "--gate-x": {
        "type": bound,
        "nargs": 2,
        "metavar": ("LOW", "HIGH"),
        "help": "distances ahead of the sensor that count, m (default: from the vehicle's own front)",
    },
    "--lane-width": {"type": positive, "metavar": "M", "help": "of what counts, half to each side, m (default: 4)"},
    "--height": {
        "type": bound,
        "nargs": 2,
        "metavar": ("LOW", "HIGH"),
        "help": "heights above the road that count, m (default: 0.2 2; 0.23 0.83 for a folder of KITTI clouds, "
        "the band of published TTC tables, which ends below the glare of tail lights)",
    },
    "--min-intensity": {
        "type": finite,
        "metavar": "I",
        "help": "of points that count, in the units stored (default: any; a limit can erase a dark car)",
    },
    "--sensor-height": {
        "type": finite,
        "metavar": "M",
        "help": "above the road, m (default: as the log says; 1.73 for a folder of KITTI clouds)",
    },
    "--front-offset": {
        "type": finite,
        "metavar": "M",
        "help": "from the sensor to the bumper, m (default: as the log says; 0 for a folder of KITTI clouds)",
    },
    "--rate": {"type": positive, "metavar": "HZ", "help": "frames a second, instead of the stamps of the log"},
}
LIDAR = ("sensor_height", "front_offset")  # instead of what the log says of its lidar
GATE = ("gate_x", "lane_width", "height", "min_intensity")


def play(log: CloudLog, given: dict[str, Any], console: Console, *, rows: int, plot: bool) -> Figure | None:
    """Replay the log with the settings given, print the table, and draw the picture if it is wanted."""
    from ttc_fast.demo.clouds import replay, table
    from ttc_fast.demo.table import watch

    if plot:
        from ttc_fast.demo.clouds import picture  # before the table, to say early that a package is missing

    place, bounds = ({name: given.pop(name) for name in names if name in given} for names in (LIDAR, GATE))
    lidar = replace(log.lidar, **place)
    settings = {"threshold": THRESHOLD, **given}
    gate = replay.corridor(lidar, **bounds)
    result = replay.replay(log, watch(log), gate=gate, front_offset=lidar.front_offset, **settings)
    table.report(result, console, rows=rows)
    return picture.draw(result, f"{name_of(log.path)}, distance by {result.estimator}, {result.pace}") if plot else None
