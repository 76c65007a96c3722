"""A recording for Rerun, to scrub through: scan or cloud, path, threats, curves and decisions on the time of the log.

Each frame is written as it comes, so memory stays flat. Where the stamps are times since 1970, so is the time line
``stamp``; else it counts seconds. The blueprint opens on the bird's eye view beside the curves and the decisions.

https://rerun.io
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast._extras import missing
from ttc_fast.brake import Command
from ttc_fast.logs import CloudLog, ScanLog
from ttc_fast.plotting import style as look
from ttc_fast.plotting.birds_eye import moved
from ttc_fast.replay.key_frame import view_of
from ttc_fast.replay.run import name_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from ttc_fast.plotting.birds_eye import Box
    from ttc_fast.replay.row import Row
    from ttc_fast.replay.run import Replay

SINCE_1970 = 946_684_800.0
"""Stamps from 2000 on are times since 1970, s."""
CURVES = {
    "ttc": ("TTC, s", ("ttc", "ttc_low", "ttc_high", "threshold")),
    "speed": ("speeds, m/s", ("speed", "closing_speed", "closing_low", "closing_high")),
    "distance": ("distances, m", ("distance", "nearest")),
}
LEVELS = {Command.NONE: "INFO", Command.WARN: "WARN", Command.BRAKE: "ERROR"}
STEPS = 24


def _rgb(colour: str) -> tuple[int, ...]:
    return tuple(bytes.fromhex(colour[1:]))


ALARM, CAUTION, INK = _rgb(look.ALARM), _rgb(look.CAUTION), (232, 238, 243)  # the viewer is dark
LINE, PALE, QUIET = _rgb(look.LINE), _rgb(look.PALE), _rgb(look.QUIET)
COLOURS = {
    **dict.fromkeys(("ttc", "closing_speed", "distance"), ALARM),
    "threshold": CAUTION,
    "speed": INK,
    "nearest": QUIET,
}


def recorded(replay: Replay, rows: Iterable[Row], path: Path) -> Iterator[Row]:
    """Pass rows on, and write each with its frame into a recording.

    Parameters
    ----------
    replay : Replay
        The replay whose rows they are.
    rows : iterable of Row
        Its rows, or what passes them on.
    path : Path
        The file, which ends in .rrd.

    Yields
    ------
    Row
    """
    try:
        import rerun
    except ModuleNotFoundError:
        raise missing("a recording", "rerun") from None
    stream = rerun.RecordingStream("ttc_fast", make_default=False)
    seen = isinstance(replay.log, (ScanLog, CloudLog))
    stream.save(path, _blueprint(replay, seen=seen))
    try:
        _log_fixed(rerun, stream, replay)
        said = None
        for row in rows:
            stream.set_time("frame", sequence=row.frame)
            since_1970 = {"timestamp": row.stamp} if row.stamp >= SINCE_1970 else {"duration": row.stamp}
            stream.set_time("stamp", **since_1970)
            _log_curves(rerun, stream, replay, row)
            if seen:
                _log_view(rerun, stream, replay, row)
            if (row.command, row.reason) != said:
                said = row.command, row.reason
                text = f"{row.command.name}: {row.reason.name}"
                if row.criterion and math.isfinite(row.value):
                    text += f", {row.criterion}: {row.value:.2f} of {row.threshold:.3g}"
                stream.log("decisions", rerun.TextLog(text, level=LEVELS[row.command]))
            yield row
    finally:
        stream.flush()
        stream.disconnect()


def _blueprint(replay: Replay, *, seen: bool) -> Any:
    import rerun.blueprint as views

    curves = [views.TimeSeriesView(origin=f"/{name}", name=title) for name, (title, _) in CURVES.items()]
    beside = [*curves, views.TextLogView(origin="/decisions", name="decisions")]
    if seen:
        above = views.Spatial3DView(origin="/vehicle", name=name_of(replay.log.path))
        contents: Any = views.Horizontal(above, views.Vertical(*beside), column_shares=[3, 2])
    else:
        contents = views.Vertical(*beside)
    time = views.TimePanel(timeline="stamp", state="collapsed")
    return views.Blueprint(contents, time, views.SelectionPanel(state="hidden"), views.BlueprintPanel(state="hidden"))


def _log_fixed(rerun: Any, stream: Any, replay: Replay) -> None:
    """Write the names and colours of the curves, which never change."""
    stream.log("vehicle", rerun.ViewCoordinates.FLU, static=True)
    for name, (_, columns) in CURVES.items():
        for column in columns:
            colour = COLOURS.get(column, LINE)
            style = rerun.SeriesLines(
                names=column, colors=colour, widths=1.0 if column.endswith(("low", "high")) else 2.0
            )
            stream.log(f"{name}/{column}", style, static=True)


def _log_curves(rerun: Any, stream: Any, replay: Replay, row: Row) -> None:
    """Write the numbers of a row. What is infinite or not known is a gap."""
    for name, (_, columns) in CURVES.items():
        for column in columns:
            value = replay.threshold if column == "threshold" else getattr(row, column)
            stream.log(f"{name}/{column}", rerun.Scalars(value if math.isfinite(value) else math.nan))


def _log_view(rerun: Any, stream: Any, replay: Replay, row: Row) -> None:
    """Write what is seen from above, in the frame of the vehicle."""
    view = view_of(replay, row, replay.frame)
    points, threatening = in_space(view.points), view.threatening
    stream.log("vehicle/seen", rerun.Points3D(points[~threatening], colors=QUIET, radii=rerun.Radius.ui_points(1.5)))
    stream.log("vehicle/threats", rerun.Points3D(points[threatening], colors=ALARM, radii=rerun.Radius.ui_points(4.0)))
    strays = np.zeros(len(points), bool) if view.strays is None else view.strays
    stream.log("vehicle/strays", rerun.Points3D(points[strays], colors=CAUTION, radii=rerun.Radius.ui_points(4.0)))
    decides = [] if view.at is None else [(*view.at, 0.0)]
    labels = None if view.at is None else [view.decides]
    stream.log("vehicle/decides", rerun.Points3D(decides, colors=INK, radii=rerun.Radius.ui_points(7.0), labels=labels))
    colour = ALARM if row.command is Command.BRAKE else CAUTION if row.command is Command.WARN else INK
    outline = [] if view.vehicle is None else [box(view.vehicle)]
    stream.log("vehicle/outline", rerun.LineStrips3D(outline, colors=colour))
    path = [] if view.path is None or view.vehicle is None else swept(view.vehicle, *view.path)
    stream.log("vehicle/path", rerun.LineStrips3D(path, colors=PALE if row.command is Command.NONE else colour))
    lane = view.lane
    gate = [] if lane is None else [box((lane[0], min(lane[1], 100.0), lane[2], lane[3]))]
    stream.log("vehicle/gate", rerun.LineStrips3D(gate, colors=LINE))


def in_space(points: NDArray[Any]) -> NDArray[np.float32]:
    """Return points with a height, which is 0 for those of a scan."""
    points = np.asarray(points, np.float32).reshape(len(points), -1)[:, :3]
    return points if points.shape[1] == 3 else np.column_stack([points, np.zeros(len(points), np.float32)])


def closed(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the closed line around some corners, on the ground."""
    line = corners[[0, 1, 2, 3, 0]]
    return np.column_stack([line, np.zeros(len(line))])


def box(outline: Box) -> NDArray[np.float64]:
    """Return the closed line around a box of (rear, front, right, left)."""
    return closed(moved(outline, 0.0, 0.0, np.zeros(1))[0])


def swept(outline: Box, speed: float, yaw_rate: float, ahead: float) -> list[NDArray[np.float64]]:
    """Return the ways of the corners of an outline at constant speed and yaw rate, and the outline at their end."""
    if not math.isfinite(speed) or speed == 0.0:
        return []
    corners = moved(outline, speed, yaw_rate, np.linspace(0.0, ahead, STEPS))
    ways = np.pad(corners, ((0, 0), (0, 0), (0, 1)))
    return [*ways.swapaxes(0, 1), closed(corners[-1])]
