"""A recording for Rerun, to scrub through: scan or cloud, path, threats, curves and decisions on the time of the log.

Each frame is written as it comes, so memory stays flat. Where the stamps are times since 1970, so is the time line
``stamp``; else it counts seconds. The blueprint opens on the bird's eye view beside the curves and the decisions.

https://rerun.io
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from ttc_fast._extras import missing
from ttc_fast.brake import Command
from ttc_fast.logs.stamps import SINCE_1970
from ttc_fast.replay.drawing import ALARM, CAUTION, INK, LINE, PALE, QUIET, URGENCY, shown
from ttc_fast.replay.key_frame import has_view
from ttc_fast.replay.run import name_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from ttc_fast.replay.drawing import Drawing
    from ttc_fast.replay.row import Row
    from ttc_fast.replay.run import Replay

CURVES = {
    "ttc": ("TTC, s", ("ttc", "ttc_low", "ttc_high", "threshold")),
    "speed": ("speeds, m/s", ("speed", "closing_speed", "closing_low", "closing_high")),
    "distance": ("distances, m", ("distance", "nearest")),
}
LEVELS = {Command.NONE: "INFO", Command.WARN: "WARN", Command.BRAKE: "ERROR"}
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
    stream.save(path, _blueprint(replay, seen=has_view(replay)))
    try:
        _log_fixed(rerun, stream)
        for row, drawing, said in shown(replay, rows):
            stream.set_time("frame", sequence=row.frame)
            since_1970 = {"timestamp": row.stamp} if row.stamp >= SINCE_1970 else {"duration": row.stamp}
            stream.set_time("stamp", **since_1970)
            _log_curves(rerun, stream, replay, row)
            if drawing is not None:
                _log_drawing(rerun, stream, drawing, row.command)
            if said:
                stream.log("decisions", rerun.TextLog(said, level=LEVELS[row.command]))
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


def _log_fixed(rerun: Any, stream: Any) -> None:
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


def _log_drawing(rerun: Any, stream: Any, drawing: Drawing, command: Command) -> None:
    """Write what is seen from above."""
    points, threatening = drawing.points, drawing.threatening
    for name, positions, colour, size in (
        ("seen", points[~threatening], QUIET, 1.5),
        ("threats", points[threatening], ALARM, 4.0),
        ("strays", points[drawing.strays], CAUTION, 4.0),
    ):
        stream.log(f"vehicle/{name}", rerun.Points3D(positions, colors=colour, radii=rerun.Radius.ui_points(size)))
    at, labels = ([], None) if drawing.at is None else ([drawing.at], [drawing.decides])
    stream.log("vehicle/decides", rerun.Points3D(at, colors=INK, radii=rerun.Radius.ui_points(7.0), labels=labels))
    path = PALE if command is Command.NONE else URGENCY[command]
    for name, lines, colour in (
        ("outline", drawing.outline, URGENCY[command]),
        ("path", drawing.path, path),
        ("gate", drawing.gate, LINE),
    ):
        stream.log(f"vehicle/{name}", rerun.LineStrips3D(lines, colors=colour))
