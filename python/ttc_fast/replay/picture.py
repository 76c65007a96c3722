"""The picture of a replay: distance, closing speed and TTC over time, and a bird's eye view of the key frame."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ttc_fast.brake import Command
from ttc_fast.replay.birds_eye import draw_birds_eye
from ttc_fast.replay.run import name_of
from ttc_fast.replay.style import (
    ALARM,
    BLIND,
    CAUTION,
    INK,
    LINE,
    QUIET,
    label_seconds,
    legend_above,
    mark_on_top,
    open_figure,
    quieten,
)
from ttc_fast.replay.summary import GOING, UNSEEN, is_isolated, known_ttc

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from ttc_fast.replay.run import Replay

LONGEST, SHORTEST = 20.0, 0.02
"""The axis of the TTC ends there, s."""
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
    from_above = replay.key_frame is not None and not hasattr(replay.log, "column")
    title = f"{name_of(replay.log.path)}, {replay.summary.pace}"
    figure = open_figure(title, _footnote(replay), SIZE if from_above else NARROW)
    grid = figure.add_gridspec(3, 2 if from_above else 1, height_ratios=(1, 0.8, 1.5))
    ttc = figure.add_subplot(grid[2, 0])
    distance, closing = (figure.add_subplot(grid[row, 0], sharex=ttc) for row in (0, 1))
    isolated = _isolated(replay)
    _draw_distance(distance, replay, isolated)
    _draw_closing_speed(closing, replay)
    _draw_ttc(ttc, replay, isolated)
    for axes in (distance, closing):
        axes.tick_params(labelbottom=False)
    for axes in (distance, closing, ttc):
        _draw_events(axes, replay)
        legend_above(axes)
        quieten(axes)
    figure.align_ylabels([distance, closing, ttc])
    if from_above:
        draw_birds_eye(figure.add_subplot(grid[:, 1]), replay)
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


def _column(replay: Replay, name: str) -> NDArray[np.float64]:
    """Return a column of the rows with NaN for inf, which cannot be drawn."""
    numbers = np.array([getattr(row, name) for row in replay.series.rows], float)
    return np.where(np.isfinite(numbers), numbers, np.nan)


def _isolated(replay: Replay) -> NDArray[np.bool_]:
    """Return which rows are isolated: none where each stands for several, as they are no neighbours."""
    rows, longest = replay.series.rows, replay.summary.longest
    isolated = np.zeros(len(rows), bool)
    if replay.series.step == 1:
        isolated[1:-1] = [is_isolated(*rows[i : i + 3], longest=longest) for i in range(len(rows) - 2)]
    return isolated


def _draw_distance(axes: Axes, replay: Replay, isolated: NDArray[np.bool_]) -> None:
    stamps, distance, nearest = (_column(replay, name) for name in ("stamp", "distance", "nearest"))
    if np.isfinite(nearest).any():
        axes.plot(stamps, nearest, ".-", color=QUIET, lw=1, ms=4, label="plain nearest point")
    axes.plot(stamps, np.where(isolated, np.nan, distance), ".-", color=LINE, lw=1.4, ms=3, label="distance")
    if isolated.any():
        axes.plot(stamps[isolated], distance[isolated], "x", color=CAUTION, ms=5, mew=1.6, label="isolated reading")
    axes.set(ylabel="distance, m")
    axes.set_ylim(bottom=0.0)


def _draw_closing_speed(axes: Axes, replay: Replay) -> None:
    stamps, low, high = (_column(replay, name) for name in ("stamp", "closing_low", "closing_high"))
    speed = _column(replay, "speed")
    if np.isfinite(speed).any():
        axes.plot(stamps, speed, color=QUIET, lw=4, alpha=0.6, label="of the vehicle")
    if np.isfinite(low).any():
        axes.fill_between(stamps, low, high, color=LINE, alpha=0.25, lw=0, label="90 % interval")
    axes.plot(stamps, _column(replay, "closing_speed"), ".-", color=LINE, lw=1.4, ms=3, label="closing speed")
    axes.set(ylabel="speed, m/s")
    axes.set_ylim(bottom=min(axes.get_ylim()[0], 0.0))


def _draw_ttc(axes: Axes, replay: Replay, isolated: NDArray[np.bool_]) -> None:
    """Draw the TTC and the thresholds on a logarithmic axis."""
    rows, threshold = replay.series.rows, replay.threshold
    stamps, status = _column(replay, "stamp"), np.array([row.status for row in rows])
    ttc = np.array([known_ttc(row) for row in rows])
    ttc[np.isinf(ttc)] = np.nan
    finite = ttc[np.isfinite(ttc)]
    low = max(0.7 * min([threshold, *finite]), SHORTEST)
    high = min(1.5 * max([2.0 * threshold, *finite]), LONGEST)
    shown = np.maximum(ttc, low)
    axes.set(yscale="log", ylabel="time to collision, s", xlabel="time, s", ylim=(low, high))
    label_seconds(axes.yaxis)
    for each in sorted(set(replay.pipeline.controller.thresholds)):
        axes.axhline(each, color=ALARM, lw=1, ls=(0, (5, 3)), label=f"threshold {each:g} s")
    least, most = (np.clip([getattr(row, name) for row in rows], low, 1e9) for name in ("ttc_low", "ttc_high"))
    if np.isfinite(least).any():
        axes.fill_between(stamps, least, most, color=LINE, alpha=0.25, lw=0)
    axes.plot(stamps, np.where(isolated, np.nan, shown), ".-", color=LINE, lw=1.5, ms=3, label="TTC")
    if isolated.any():
        axes.plot(stamps[isolated], shown[isolated], "x", color=CAUTION, ms=5, mew=1.6)
    warned = np.array([row.command is Command.WARN for row in rows]) & np.isfinite(shown)
    if warned.any():
        axes.plot(stamps[warned], shown[warned], "o", mfc="none", color=CAUTION, ms=5, label="warns")
    mark_on_top(axes, stamps[np.isin(status, GOING)], QUIET, "nothing closes")
    mark_on_top(axes, stamps[np.isin(status, UNSEEN)], BLIND, "nothing valid seen")
    if replay.key_frame is not None and math.isfinite(replay.key_frame[0].ttc):
        row, braked = replay.key_frame[0], replay.braked
        at, colour = (row.stamp, max(row.ttc, low)), ALARM if braked else INK
        label = "begins to brake" if braked else "least TTC"
        axes.plot(*at, "o", color=colour, mec="white", ms=9, ls="none", zorder=3, label=label)


def _draw_events(axes: Axes, replay: Replay) -> None:
    """Tint the times at which it brakes."""
    for i, event in enumerate(replay.summary.events):
        label = "brakes" if i == 0 and axes.get_ylabel().startswith("distance") else None
        axes.axvspan(event.begin.stamp, event.end, color=ALARM, alpha=0.1, lw=0, label=label)
        axes.axvline(event.begin.stamp, color=ALARM, lw=0.8, alpha=0.7)
