"""The picture of a replayed log of clouds: distance and TTC over time, and the worst moment from above."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import Rectangle

from ttc_fast import Status
from ttc_fast.demo.clouds.replay import STRAY, TOO_LONG
from ttc_fast.demo.picture import (
    BLIND,
    INK,
    LINE,
    OUTVOTED,
    QUIET,
    colour_of_least,
    draw_ttc,
    legend_above,
    mark_on_top,
    open_figure,
    quieten,
    title_of,
)
from ttc_fast.reference.gate import candidates
from ttc_fast.reference.points import cloud

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from ttc_fast import Gate
    from ttc_fast.demo.clouds.replay import CloudReplay

LONGEST = 30.0  # s; the axis ends there, a longer TTC is as good as none
SHORTEST = 0.1  # s; and here, contact is drawn on the edge
FARTHEST_VIEW = 40.0  # m ahead that the view from above shows at most
CAR_WIDTH = 1.8  # m; logs do not say it


def draw(result: CloudReplay, title: str) -> Figure:
    """Draw a replayed log.

    Parameters
    ----------
    result : CloudReplay
        At least one frame.
    title : str
        Above it all.

    Returns
    -------
    matplotlib.figure.Figure
        With its own canvas, so that no display is needed; save it with ``savefig``.
    """
    figure = open_figure(title, "" if result.front_offset else f"Distances are from the sensor, so every {TOO_LONG}.")
    grid = figure.add_gridspec(2, 2, width_ratios=(1.25, 1))
    distance = figure.add_subplot(grid[0, 0])
    ttc = figure.add_subplot(grid[1, 0], sharex=distance)
    _draw_distance(distance, result)
    _draw_ttc(ttc, result)
    figure.align_ylabels([distance, ttc])
    _draw_from_above(figure.add_subplot(grid[:, 1]), result)
    return figure


def _draw_distance(axes: Axes, result: CloudReplay) -> None:
    """Draw the robust distance over time, and what the plain nearest points would have said."""
    stamps = [row.stamp for row in result.rows]
    robust, plain = (
        np.array([seen.distance if math.isfinite(seen.distance) else math.nan for seen in each])
        for each in ([row.seen for row in result.rows], [row.plain for row in result.rows])
    )
    axes.plot(stamps, plain, ".-", color=QUIET, lw=1, ms=4, label="plain nearest point")
    axes.plot(stamps, robust, ".-", color=LINE, lw=1.8, ms=6, label="robust distance")
    stray = np.array([row.frame for row in result.outvoted], dtype=int)
    if len(stray):
        axes.plot(np.array(stamps)[stray], plain[stray], "o", mfc="none", color=OUTVOTED, ms=7, label="outvoted point")
    axes.axvline(result.least.stamp, color=colour_of_least(result), lw=1, alpha=0.5)
    axes.set(ylabel=f"from the {result.start}, m")
    axes.margins(x=0.02)
    legend_above(axes)
    axes.tick_params(labelbottom=False)
    quieten(axes)


def _draw_ttc(axes: Axes, result: CloudReplay) -> None:
    """Draw TTC over time, and what the plain nearest points would have said."""
    lowest = min(result.threshold, *(min(row.ttc, row.plain.ttc) for row in result.rows))
    low = min(max(0.7 * lowest, SHORTEST), 0.5 * LONGEST)
    stamps, ttc, plain = np.array([(row.stamp, row.ttc, row.plain.ttc) for row in result.rows]).T
    highest = max([result.threshold, *ttc[np.isfinite(ttc)]])
    draw_ttc(axes, result, "by robust distance", low, min(1.5 * highest, LONGEST))
    axes.plot(stamps, np.maximum(plain, low), "o", mfc="none", color=QUIET, ms=5, label="by plain nearest point")
    status = np.array([row.seen.status for row in result.rows])
    mark_on_top(axes, stamps[np.isinf(ttc) & np.isin(status, (Status.NOT_CLOSING, Status.CLEAR))], QUIET, "not closing")
    mark_on_top(axes, stamps[status == Status.NO_DATA], BLIND, "nothing valid seen")
    axes.set(xlabel="time, s")
    legend_above(axes)
    quieten(axes)


def _draw_from_above(axes: Axes, result: CloudReplay) -> None:
    """Draw the cloud of the least TTC: ahead is up and left is left, the gate is tinted."""
    points, gate = result.least_frame.points, result.gate
    deciding = result.least.seen.distance + result.front_offset
    ahead = min(1.3 * deciding + 2.0, FARTHEST_VIEW) if math.isfinite(deciding) else FARTHEST_VIEW
    behind = min(-1.5, result.front_offset - 4.5)
    half = (ahead - behind) / 2
    axes.set(xlim=(half, -half), ylim=(behind, ahead), xlabel="y, m", ylabel="x, m")  # y grows to the left
    axes.set_aspect("equal")
    shown = points[(points[:, 0] > behind) & (points[:, 0] < ahead) & (np.abs(points[:, 1]) < half)]
    counted = _counted(gate, shown)
    low = gate.z[0] if gate.z else -math.inf
    for some, colour, size in (
        (~counted & (shown[:, 2] < low), "#d9dfe5", 2),
        (~counted & (shown[:, 2] >= low), QUIET, 3),
        (counted, LINE, 5),
    ):
        axes.plot(shown[some, 1], shown[some, 0], ".", color=colour, ms=size, mew=0)
    _draw_gate(axes, gate, ahead)
    _draw_vehicle(axes, result.front_offset)
    _draw_deciding(axes, result, deciding)
    quieten(axes)


def _counted(gate: Gate, points: NDArray[Any]) -> NDArray[np.bool_]:
    """Tell which points the gate lets through."""
    counted = np.zeros(len(points), bool)
    counted[candidates(cloud("points", points), gate).index] = True
    return counted


def _draw_gate(axes: Axes, gate: Gate, ahead: float) -> None:
    near, right, left = gate.x[0], *gate.y
    length = min(gate.x[1], ahead) - near
    axes.add_patch(Rectangle((right, near), left - right, length, color=LINE, alpha=0.08, lw=0, zorder=0))


def _draw_vehicle(axes: Axes, front_offset: float) -> None:
    """Draw the vehicle as far as it is known, and the sensor."""
    if front_offset > 0.0:
        corner = (-CAR_WIDTH / 2, front_offset - 4.2)
        axes.add_patch(Rectangle(corner, CAR_WIDTH, 4.2, facecolor=LINE, edgecolor=INK, alpha=0.85, lw=1, zorder=2))
    axes.plot(0.0, 0.0, "o", color="white", mec=INK, ms=4, zorder=4)


def _draw_deciding(axes: Axes, result: CloudReplay, deciding: float) -> None:
    """Mark the point that decided, or only its distance if it was no single one, and those that it outvoted."""
    least, points = result.least, result.least_frame.points
    if not math.isfinite(least.ttc):
        title_of(axes, "nothing closes in any frame")
        return
    index = least.seen.current.index
    x, y = points[index, :2] if index >= 0 else (deciding, 0.0)
    axes.plot([y, y], [result.front_offset, x], color=INK, lw=1.2, zorder=3)
    axes.hlines(deciding, *result.gate.y, color=INK, lw=1, ls=(0, (5, 3)), zorder=3, label=f"x = {deciding:.2f} m")
    if index >= 0:
        axes.plot(y, x, "o", mfc="none", mec=INK, mew=1.8, ms=12, zorder=4, label="deciding point")
    strays = points[_counted(result.gate, points) & (points[:, 0] < deciding - STRAY)]
    if len(strays):
        axes.plot(strays[:, 1], strays[:, 0], "o", mfc="none", mec=OUTVOTED, ms=7, zorder=3, label="outvoted point")
    axes.legend(loc="lower right", frameon=False, fontsize=8.5, labelcolor=INK)
    title_of(
        axes,
        f"{least.ttc:.2f} s to collision at t = {least.stamp:.2f} s\n"
        f"{least.seen.distance:.2f} m from the {result.start}, closing at {least.seen.closing_speed:.2f} m/s",
    )
