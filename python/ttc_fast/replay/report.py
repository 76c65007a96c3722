"""A report of one log or of many: one file of HTML that needs no server and no network.

Each replay gives a chapter: its curves, and a bird's eye view of each frame in which it begins to brake, drawn as it
comes. The report has them all beside tables of events and logs, with the curves drawn by Bokeh, whose bundle it holds.

https://docs.bokeh.org
"""

from __future__ import annotations

import base64
import io
import json
import math
from datetime import datetime, timezone
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast import __version__
from ttc_fast._extras import missing
from ttc_fast.logs.stamps import SINCE_1970
from ttc_fast.logs.storage import name_in
from ttc_fast.plotting import VIEW, style
from ttc_fast.plotting.birds_eye import draw_birds_eye
from ttc_fast.plotting.history import LONGEST, SHORTEST
from ttc_fast.replay.key_frame import has_view, view_of
from ttc_fast.replay.picture import history_of
from ttc_fast.replay.replayed import Chapter
from ttc_fast.replay.run import name_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from numpy.typing import NDArray

    from ttc_fast.replay.replayed import Replayed
    from ttc_fast.replay.row import Row
    from ttc_fast.replay.run import Replay

MOST_PICTURES = 12
"""A log has pictures of at most this many events, and of its key frame."""
LOOK = {"dpi": 80, "pil_kwargs": {"quality": 60}}
EVENTS = {
    **dict.fromkeys(("log", "reason", "criterion"), "text"),
    **dict.fromkeys(("at, s", "until, s", "frames", "value", "threshold", "TTC, s", "distance, m", "speed, m/s"), ""),
}
LOGS = {
    "log": "text",
    **dict.fromkeys(("frames", "time, s", "least TTC, s", "TET, s", "TIT, s\N{SUPERSCRIPT TWO}", "brakes"), ""),
    **dict.fromkeys(("warnings", "invalid", "gaps"), ""),
    "lost": "text",
}


class Pictures:
    """Draws the frames in which a replay begins to brake.

    Parameters
    ----------
    replay : Replay
        The replay.
    """

    def __init__(self, replay: Replay) -> None:
        self._replay = replay
        self._drawn: dict[int, bytes] = {}
        self._seen = has_view(replay)

    def through(self, rows: Iterable[Row]) -> Iterator[Row]:
        """Pass rows on, and draw the first of each event."""
        for row in rows:
            events = self._replay.summary.events
            if self._seen and events and events[-1].begin is row and len(self._drawn) < MOST_PICTURES:
                self._draw(row, self._replay.frame)
            yield row

    def chapter(self) -> Chapter | None:
        """Return the chapter of a replay that has ended; None where it has no rows."""
        replay, key_frame = self._replay, self._replay.key_frame
        if not replay.summary.frames:
            return None
        if self._seen and key_frame is not None and key_frame[0].frame not in self._drawn:
            self._draw(*key_frame)
        at = None if key_frame is None else key_frame[0].frame
        return Chapter(name_of(replay.log.path), history_of(replay), self._drawn, at)

    def _draw(self, row: Row, frame: Any) -> None:
        figure, file = style.open_figure("", "", VIEW), io.BytesIO()
        draw_birds_eye(figure.add_subplot(), view_of(self._replay, row, frame))
        figure.draw_without_rendering()  # the layout takes two steps to settle
        figure.savefig(file, format="webp", **LOOK)  # type: ignore[arg-type]
        self._drawn[row.frame] = file.getvalue()


def write_report(results: Sequence[Replayed], path: Path) -> None:
    """Write the report of some logs.

    Parameters
    ----------
    results : sequence of Replayed
        How the replays ended, with their chapters.
    path : Path
        The file, which ends in .html.
    """
    try:
        from bokeh.embed import file_html
        from bokeh.resources import INLINE
        from jinja2 import Template
    except ModuleNotFoundError:
        raise missing("a report", "bokeh") from None
    template = Template(Path(__file__).with_name("report.html").read_text(encoding="utf-8"))
    begins = [_begin(each) for each in results]
    variables = {
        "totals": _totals(results),
        "events": _table(EVENTS, _events(results, begins)),
        "logs": _table(LOGS, map(_log, range(len(results)), results)),
        "data": json.dumps(list(map(_data, results, begins))).replace("</", "<\\/"),
    }
    title = f"Replay of {'1 log' if len(results) == 1 else f'{len(results)} logs'}"
    page = file_html(_curves(), INLINE, title, template=template, template_variables=variables)
    path.write_text(page, encoding="utf-8")


def _curves() -> Any:
    """Return the document of the curves, whose data come when a log is chosen."""
    from bokeh.document import Document
    from bokeh.layouts import column
    from bokeh.models import ColumnDataSource, CrosshairTool, CustomJS, Range1d
    from bokeh.plotting import figure

    def source(name: str, *columns: str) -> Any:
        return ColumnDataSource({each: [] for each in columns}, name=name)

    rows = source("rows", "x", *CURVES)
    brakes, thresholds, chosen = source("brakes", "begin", "end"), source("thresholds", "y"), source("chosen", "x")
    time, plots = Range1d(start=0.0, end=1.0, name="time"), []
    tools = "box_zoom,xwheel_zoom,xpan,reset,save"
    for title, lines, height in PLOTS:
        is_ttc = title.startswith("TTC")
        scale: dict[str, Any] = {"y_range": Range1d(start=0.0, end=1.0, name=title)}
        if is_ttc:
            scale = {"y_axis_type": "log", "y_range": (SHORTEST, LONGEST)}
        plot = figure(
            height=height, x_range=time, tools=tools, sizing_mode="stretch_width", active_drag="box_zoom", **scale
        )
        plot.vstrip(x0="begin", x1="end", source=brakes, fill_color=style.ALARM, fill_alpha=0.12, line_width=0)
        plot.vspan(x="x", source=chosen, line_color=style.INK, line_dash="dashed")
        if is_ttc:
            plot.hspan(y="y", source=thresholds, line_color=style.ALARM, line_dash=[5, 3])
        for name, label, colour in lines:
            if f"{name}_low" in CURVES:
                plot.varea("x", f"{name}_low", f"{name}_high", source=rows, fill_color=colour, fill_alpha=0.25)
            plot.line("x", name, source=rows, color=colour, line_width=1.5, legend_label=label)
            plot.scatter("x", name, source=rows, color=colour, size=3)
        plot.yaxis.axis_label = title
        plot.legend.location, plot.legend.orientation = "top_left", "horizontal"
        plot.legend.update(background_fill_alpha=0.6, padding=2)
        plots.append(plot)
    plots[-1].xaxis.axis_label = "time, s"
    plots[0].add_tools(crosshair := CrosshairTool(dimensions="height"))
    for each in plots[1:]:
        each.add_tools(crosshair)
    document = Document()
    document.add_root(column(*plots, sizing_mode="stretch_width"))
    document.js_on_event("document_ready", CustomJS(code="window.began()"))
    return document


PLOTS = (
    ("TTC, s", (("ttc", "TTC", style.LINE), ("isolated", "isolated reading", style.CAUTION)), 240),
    ("speed, m/s", (("speed", "of the vehicle", style.QUIET), ("closing", "closing", style.LINE)), 170),
    ("distance, m", (("nearest", "plain nearest point", style.QUIET), ("distance", "distance", style.LINE)), 170),
)
CURVES = (
    "ttc",
    "isolated",
    "ttc_low",
    "ttc_high",
    "speed",
    "closing",
    "closing_low",
    "closing_high",
    "nearest",
    "distance",
)


def _data(result: Replayed, begin: float) -> dict[str, Any]:
    """Return what the page draws of a log: columns as float32, and pictures, in base64."""
    chapter = result.chapter
    without = "A table of distances has no picture of a frame." if chapter else _why_nothing(result)
    if chapter is None:
        rows, thresholds, pictures = {name: np.zeros(0) for name in ("x", *CURVES)}, np.zeros(0), {}
    else:
        if chapter.pictures:
            without = f"This event has no picture: a log has {MOST_PICTURES} at most."
        drawn, pictures = chapter.history, chapter.pictures
        unknown, ttc = np.full(len(drawn.stamps), math.nan), np.clip(drawn.ttc, SHORTEST, None)
        values = (
            np.where(drawn.isolated, math.nan, ttc),
            np.where(drawn.isolated, ttc, math.nan),
            *(np.clip(end, SHORTEST, LONGEST) for end in drawn.ttc_interval),
            unknown if drawn.speed is None else drawn.speed,
            drawn.closing_speed,
            *drawn.closing_interval,
            unknown if drawn.nearest is None else drawn.nearest,
            np.where(drawn.isolated, math.nan, drawn.distance),
        )
        rows = {"x": drawn.stamps - begin, **dict(zip(CURVES, values, strict=True))}
        thresholds = np.array(drawn.thresholds, float)
    events = result.summary.events
    brakes = {"begin": [each.begin.stamp for each in events], "end": [each.end for each in events]}
    return {
        "name": result.log if chapter is None else chapter.name,
        "without": without,
        "rows": {name: _packed(values) for name, values in rows.items()},
        "ranges": {title: _range([rows[name] for name, *_ in lines]) for title, lines, _ in PLOTS[1:]},
        "thresholds": {"y": _packed(thresholds)},
        "brakes": {name: _packed(np.array(stamps) - begin) for name, stamps in brakes.items()},
        "pictures": {frame: base64.b64encode(picture).decode() for frame, picture in pictures.items()},
    }


def _range(curves: list[NDArray[Any]]) -> tuple[float, float]:
    """Return from where to where an axis goes on which 0 and all of some curves are seen."""
    finite = [0.0, *(value for curve in curves for value in curve[np.isfinite(curve)].tolist())]
    low, high = min(finite), max(finite)
    return 1.05 * low, 1.05 * high if high > low else low + 1.0


def _packed(values: NDArray[Any]) -> str:
    """Return numbers as float32 in base64; NaN, which is a gap, for those that are infinite; nothing if all are."""
    numbers = np.where(np.isfinite(values), values, np.nan).astype("<f4")
    return "" if np.isnan(numbers).all() else base64.b64encode(numbers.tobytes()).decode()


def _why_nothing(result: Replayed) -> str:
    if result.skipped:
        return "An earlier run replayed this log, and kept neither curves nor pictures: --again draws them."
    return result.summary.lost or "There are no frames."


def _begin(result: Replayed) -> float:
    """Return what the times of a log count from: its first frame, where its stamps are times since 1970."""
    begin = result.summary.begin
    return begin if begin >= SINCE_1970 else 0.0


# Tables


def _totals(results: Sequence[Replayed]) -> str:
    summaries = [each.summary for each in results]
    least = min((each.least.ttc for each in summaries if each.least is not None), default=math.inf)
    lost = sum(bool(each.lost) for each in summaries)
    totals = {
        "logs": str(len(results)),
        "frames": f"{sum(each.frames for each in summaries):,}",
        "time": f"{sum(each.duration for each in summaries):,.1f} s",
        "events of braking": str(sum(each.brakes for each in summaries)),
        "least TTC": f"{least:.2f} s" if math.isfinite(least) else "none",
        "TET": f"{sum(each.exposed for each in summaries):.2f} s",
        "TIT": f"{sum(each.integrated for each in summaries):.2f} s\N{SUPERSCRIPT TWO}",
        "logs not read whole": str(lost),
        "made": f"{datetime.now(timezone.utc):%Y-%m-%d %H:%M} UTC, ttc_fast {__version__}",
    }
    items = "".join(f"<div><dt>{name}</dt><dd>{escape(text)}</dd></div>" for name, text in totals.items())
    return f'<dl class="totals">{items}</dl>'


def _events(results: Sequence[Replayed], begins: Sequence[float]) -> Iterator[tuple[dict[str, Any], list[Any]]]:
    for number, (result, begin) in enumerate(zip(results, begins, strict=True)):
        for event in result.summary.events:
            row, at = event.begin, event.begin.stamp - begin
            numbers = row.value, row.threshold, row.ttc, row.distance, row.speed
            cause = name_in(result.log), row.reason.name, row.criterion
            values = [*cause, at, event.end - begin, event.frames, *numbers]
            yield {"log": number, "frame": row.frame, "at": f"{at:.6f}"}, values


def _log(number: int, result: Replayed) -> tuple[dict[str, Any], list[Any]]:
    summary = result.summary
    least = math.nan if summary.least is None else summary.least.ttc
    values = [name_in(result.log), summary.frames, summary.duration, least, summary.exposed, summary.integrated]
    values += [summary.brakes, summary.warnings, summary.invalid, summary.stale, summary.lost]
    key_frame = None if result.chapter is None else result.chapter.key_frame
    return {"log": number, "frame": "" if key_frame is None else key_frame}, values


def _table(columns: dict[str, str], rows: Iterable[tuple[dict[str, Any], list[Any]]]) -> str:
    """Return a table; the page sorts by the values of its cells, and shows what a line is about."""
    head = "".join(f'<th class="{kind}" scope="col">{name}</th>' for name, kind in columns.items())
    lines = []
    for about, values in rows:
        said = "".join(f' data-{name}="{escape(str(value))}"' for name, value in about.items())
        lines.append(f"<tr{said}>{''.join(map(_cell, values))}</tr>")
    return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(lines)}</tbody></table>"


def _cell(value: Any) -> str:
    if isinstance(value, str):
        return f'<td class="text">{escape(value)}</td>'
    if isinstance(value, float):
        shown = f"{value:.2f}" if math.isfinite(value) else "\N{INFINITY}" if value > 0.0 else "-"
        return f'<td data-value="{"Infinity" if value == math.inf else value}">{shown}</td>'
    return f'<td data-value="{value}">{value}</td>'
