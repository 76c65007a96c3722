"""The picture of a replay: distance, closing speed and TTC over time, and the frame that decided from above."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ttc_fast.brake import Command
from ttc_fast.demo import name_of
from ttc_fast.demo.picture import (
    ALARM,
    BLIND,
    INK,
    LINE,
    OUTVOTED,
    QUIET,
    label_seconds,
    legend_above,
    mark_on_top,
    open_figure,
    quieten,
)
from ttc_fast.replay.above import draw_above
from ttc_fast.status import Status

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from ttc_fast.replay.run import Replay

LONGEST, SHORTEST = 20.0, 0.02
"""s; the axis of the TTC ends there."""


def draw(replay: Replay, title: str = "") -> Figure:
    """Draw a replayed log.

    Parameters
    ----------
    replay : Replay
        With at least one row.
    title : str, optional
        Above it all; by default the name of the log.

    Returns
    -------
    matplotlib.figure.Figure
        With its own canvas, so that no display is needed; save it with ``savefig``.
    """
    step = replay.series.step
    note = f"Each point stands for {step} frames, by the strongest command and least TTC." if step > 1 else ""
    figure = open_figure(title or f"{name_of(replay.log.path)}, {replay.summary.pace}", note)
    figure.set_size_inches(11, 6.2)
    from_above = replay.moment is not None and not hasattr(replay.log, "column")
    grid = figure.add_gridspec(3, 2 if from_above else 1, height_ratios=(1, 0.8, 1.5))
    ttc = figure.add_subplot(grid[2, 0])
    distance, closing = (figure.add_subplot(grid[row, 0], sharex=ttc) for row in (0, 1))
    _draw_distance(distance, replay)
    _draw_closing_speed(closing, replay)
    _draw_ttc(ttc, replay)
    for axes in (distance, closing):
        axes.tick_params(labelbottom=False)
    for axes in (distance, closing, ttc):
        _draw_events(axes, replay)
        quieten(axes)
    figure.align_ylabels([distance, closing, ttc])
    if from_above:
        draw_above(figure.add_subplot(grid[:, 1]), replay)
    return figure


def _column(replay: Replay, name: str) -> NDArray[np.float64]:
    """Return the numbers of the rows; what is infinite cannot be drawn."""
    numbers = np.array([getattr(row, name) for row in replay.series.rows], float)
    return np.where(np.isfinite(numbers), numbers, np.nan)


def _draw_distance(axes: Axes, replay: Replay) -> None:
    axes.plot(_column(replay, "stamp"), _column(replay, "distance"), ".-", color=LINE, lw=1.2, ms=3)
    axes.set(ylabel="distance, m")
    axes.set_ylim(bottom=0.0)
    if replay.summary.brakes:
        axes.plot([], [], color=ALARM, lw=6, alpha=0.25, label="brakes")
        legend_above(axes)


def _draw_closing_speed(axes: Axes, replay: Replay) -> None:
    stamps, low, high = (_column(replay, name) for name in ("stamp", "closing_low", "closing_high"))
    speed = _column(replay, "speed")
    if np.isfinite(low).any():
        axes.fill_between(stamps, low, high, color=LINE, alpha=0.25, lw=0, label="90 %")
    if np.isfinite(speed).any():
        axes.plot(stamps, speed, color=QUIET, lw=1, label="vehicle")
    axes.plot(stamps, _column(replay, "closing_speed"), ".-", color=LINE, lw=1.2, ms=3, label="closing")
    axes.set(ylabel="speed, m/s")
    legend_above(axes)


def _draw_ttc(axes: Axes, replay: Replay) -> None:
    """Draw the TTC on a logarithmic axis, with what it is compared with."""
    rows, threshold = replay.series.rows, replay.threshold
    stamps, ttc = _column(replay, "stamp"), np.array([row.ttc for row in rows])
    finite = ttc[np.isfinite(ttc)]
    low = max(0.7 * min([threshold, *finite]), SHORTEST)
    high = min(1.5 * max([2.0 * threshold, *finite]), LONGEST)
    shown = np.where(np.isfinite(ttc), np.maximum(ttc, low), np.nan)
    axes.set(yscale="log", ylabel="time to collision, s", xlabel="time, s", ylim=(low, high))
    label_seconds(axes.yaxis)
    for each in sorted(set(replay.eyes.judge.thresholds)):
        axes.axhline(each, color=ALARM, lw=1, ls=(0, (5, 3)), label=f"threshold {each:g} s")
    least, most = (np.clip([getattr(row, name) for row in rows], low, 1e9) for name in ("ttc_low", "ttc_high"))
    if np.isfinite(least).any():
        axes.fill_between(stamps, least, most, color=LINE, alpha=0.25, lw=0, label="90 %")
    axes.plot(stamps, shown, ".-", color=LINE, lw=1.5, ms=3, label="TTC")
    warned = np.array([row.command is Command.WARN for row in rows])
    if (warned & np.isfinite(shown)).any():
        axes.plot(stamps[warned], shown[warned], "o", mfc="none", color=OUTVOTED, ms=5, label="warns")
    status = np.array([row.status for row in rows])
    mark_on_top(axes, stamps[np.isin(status, (Status.NO_DATA, Status.INVALID))], BLIND, "nothing valid seen")
    if replay.moment is not None and math.isfinite(replay.moment[0].ttc):
        row = replay.moment[0]
        colour = ALARM if replay.braked else INK
        label = "begins to brake" if replay.braked else "least"
        axes.plot(row.stamp, max(row.ttc, low), "o", color=colour, mec="white", ms=9, ls="none", zorder=3, label=label)
    legend_above(axes)


def _draw_events(axes: Axes, replay: Replay) -> None:
    """Tint when it brakes."""
    for event in replay.summary.events:
        axes.axvspan(event.begin.stamp, event.end, color=ALARM, alpha=0.08, lw=0)
        axes.axvline(event.begin.stamp, color=ALARM, lw=0.8, alpha=0.6)
