"""The picture of a replay: distance, closing speed and TTC over time, and a bird's eye view of the key frame."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ttc_fast.brake import Command
from ttc_fast.plotting.birds_eye import draw_birds_eye
from ttc_fast.plotting.history import History, draw_history
from ttc_fast.plotting.style import ALARM, INK, QUIET, legend_above, open_figure
from ttc_fast.replay.key_frame import has_view, view_of
from ttc_fast.replay.run import name_of
from ttc_fast.replay.summary import is_isolated, known_ttc

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from ttc_fast.replay.run import Replay

SIZE, NARROW = (11.0, 6.4), (8.0, 6.4)
"""The size with and without a bird's eye view, inch."""


def save(replay: Replay, path: Path) -> None:
    """Draw a replayed log into a file.

    Parameters
    ----------
    replay : Replay
        The replay, which has at least one row.
    path : Path
        The file, whose name ends in .png or .svg.
    """
    figure = draw(replay)
    figure.draw_without_rendering()  # a second time beside that of savefig, as the layout takes two steps to settle
    figure.savefig(path, dpi=110)


def draw(replay: Replay) -> Figure:
    """Draw a replayed log.

    Parameters
    ----------
    replay : Replay
        The replay, which has at least one row.

    Returns
    -------
    matplotlib.figure.Figure
        The picture. It has a canvas of its own, so that no display is needed.
    """
    seen = replay.key_frame if has_view(replay) else None
    title = f"{name_of(replay.log.path)}, {replay.summary.pace}"
    figure = open_figure(title, _footnote(replay), SIZE if seen else NARROW)
    grid = figure.add_gridspec(3, 2 if seen else 1, height_ratios=(1, 0.8, 1.5))
    ttc = draw_history(figure, grid, history_of(replay), lambda axes: _mark_events(axes, replay))
    _mark_key_frame(ttc, replay)
    if seen:
        draw_birds_eye(figure.add_subplot(grid[:, 1]), view_of(replay, *seen))
    return figure


def _footnote(replay: Replay) -> str:
    """Return why it braked first, and what each point stands for."""
    said = []
    if replay.braked and replay.key_frame is not None:
        row = replay.key_frame[0]
        unit = next((each.unit for each in replay.pipeline.controller.criteria if each.name == row.criterion), "")
        why = f"{row.criterion}, {row.value:.2f} < {row.threshold:.3g} {unit}"
        said.append(f"It brakes at {row.stamp:.2f} s, when enough of the last frames agree: {why}.")
    if replay.series.step > 1:
        said.append(f"Each point stands for {replay.series.step} frames, by the strongest command and least TTC.")
    return " ".join(said)


def history_of(replay: Replay) -> History:
    """Return the rows to draw as columns."""
    rows = replay.series.rows

    def column(name: str) -> NDArray[np.float64]:
        return np.array([getattr(row, name) for row in rows], float)

    return History(
        column("stamp"),
        column("distance"),
        column("closing_speed"),
        np.array([known_ttc(row) for row in rows]),
        (column("closing_low"), column("closing_high")),
        (column("ttc_low"), column("ttc_high")),
        np.array([row.status for row in rows]),
        nearest=column("nearest"),
        speed=column("speed"),
        isolated=_isolated(replay),
        warned=np.array([row.command is Command.WARN for row in rows]),
        thresholds=tuple(replay.pipeline.controller.thresholds),
    )


def _isolated(replay: Replay) -> NDArray[np.bool_]:
    """Return which rows are isolated: none where each stands for several, as they are no neighbours."""
    rows, longest = replay.series.rows, replay.summary.longest
    isolated = np.zeros(len(rows), bool)
    if replay.series.step == 1:
        isolated[1:-1] = [is_isolated(*rows[i : i + 3], longest=longest) for i in range(len(rows) - 2)]
    return isolated


def _mark_key_frame(axes: Axes, replay: Replay) -> None:
    """Mark the TTC of the key frame."""
    if replay.key_frame is not None and math.isfinite(replay.key_frame[0].ttc):
        row, braked = replay.key_frame[0], replay.braked
        at, colour = (row.stamp, max(row.ttc, axes.get_ylim()[0])), ALARM if braked else INK
        label = "begins to brake" if braked else "least TTC"
        axes.plot(*at, "o", color=colour, mec="white", ms=9, ls="none", zorder=3, label=label)
        legend_above(axes)


def _mark_events(axes: Axes, replay: Replay) -> None:
    """Tint the times at which it brakes, red, and that of the start, grey."""
    start, labelled = replay.summary.start, axes.get_ylabel().startswith("distance")
    if start is not None:
        label = "brakes at the start" if labelled else None
        axes.axvspan(start.begin.stamp, start.end, color=QUIET, alpha=0.2, lw=0, label=label)
    for i, event in enumerate(replay.summary.events):
        label = "brakes" if i == 0 and labelled else None
        axes.axvspan(event.begin.stamp, event.end, color=ALARM, alpha=0.1, lw=0, label=label)
        axes.axvline(event.begin.stamp, color=ALARM, lw=0.8, alpha=0.7)
