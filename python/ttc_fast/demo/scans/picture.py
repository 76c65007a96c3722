"""The picture of a replayed log of scans: TTC and speed over time, and the worst moment from above."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import LinearSegmentedColormap, LogNorm
from matplotlib.patches import Rectangle

from ttc_fast import Status
from ttc_fast.demo.picture import (
    ALARM,
    BLIND,
    INK,
    LINE,
    OUTVOTED,
    QUIET,
    colour_of_least,
    draw_ttc,
    label_seconds,
    legend_above,
    mark_on_top,
    open_figure,
    quieten,
    title_of,
)
from ttc_fast.demo.scans.replay import TOO_LONG

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import PathCollection
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from ttc_fast.demo.scans.replay import ScanReplay, ScanRow
    from ttc_fast.logs import Scanner

LONGEST = 10.0  # s; the axis ends there, a longer TTC is as good as none
SHORTEST = 0.02  # s; and here, contact is drawn on the edge
ASIDE = math.radians(30.0)  # from the way the vehicle goes
PALE = "#7fc0d4"
CLOSEST_VIEW = 2.5  # m to each side that the view from above shows at least
URGENCY = LinearSegmentedColormap.from_list("urgency", ("#ef9a3d", "#e3d68c", "#8db9cc")).with_extremes(under=ALARM)


def draw(result: ScanReplay, title: str) -> Figure:
    """Draw a replayed log.

    Parameters
    ----------
    result : ScanReplay
        At least one frame.
    title : str
        Above it all.

    Returns
    -------
    matplotlib.figure.Figure
        With its own canvas, so that no display is needed; save it with ``savefig``.
    """
    figure = open_figure(title, _footnote(result))
    grid = figure.add_gridspec(2, 2, width_ratios=(1.25, 1), height_ratios=(2.2, 1))
    over_time = figure.add_subplot(grid[0, 0])
    speed = figure.add_subplot(grid[1, 0], sharex=over_time)
    above = figure.add_subplot(grid[:, 1])
    _draw_ttc(over_time, result)
    _draw_speed(speed, result)
    dots = _draw_from_above(above, result)
    _draw_scale(figure, above, dots, result)
    return figure


def _footnote(result: ScanReplay) -> str:
    """Explain what the picture cannot show."""
    lines = []
    angles = np.degrees([abs(_bearing(result, row)) for row in result.rows if _is_aside(result, row)])
    if len(angles):
        aside = f"Pale: the deciding beam points aside, in the median by {np.median(angles):.0f}\N{DEGREE SIGN}."
        wall = "Each beam counts on its own: a wall alongside, d away, reads as about 2 d / speed, though it is passed."
        lines.append(f"{aside} {wall}")
    if result.scanner.outline is None:
        lines.append(f"Distances are from the scanner, so every {TOO_LONG}.")
    return "\n".join(lines)


def _is_aside(result: ScanReplay, row: ScanRow) -> bool:
    """Whether something beside the vehicle's way decides a frame, such as a wall alongside, and raises no alarm."""
    return result.threshold <= row.ttc < math.inf and abs(_bearing(result, row)) > ASIDE


def _bearing(result: ScanReplay, row: ScanRow) -> float:
    """Angle from the way the vehicle goes to the beam that decided, rad, from -pi to pi."""
    behind = math.pi if row.speed < 0.0 else 0.0
    return math.remainder(row.nearest.angle + result.scanner.mount[2] - behind, math.tau)


def _draw_ttc(axes: Axes, result: ScanReplay) -> None:
    """Draw TTC over time, and what would have made it shorter."""
    lowest = min(result.threshold, *(row.lone_ttc for row in result.rows))
    low = min(max(0.7 * lowest, SHORTEST), 0.5 * LONGEST)
    draw_ttc(axes, result, "nearest beam", low, LONGEST)
    aside = [row.ttc if _is_aside(result, row) else math.nan for row in result.rows]
    if not np.isnan(aside).all():
        when = [row.stamp for row in result.rows]
        label = f"beam over {math.degrees(ASIDE):.0f}\N{DEGREE SIGN} aside"
        axes.plot(when, aside, color=PALE, lw=2.4, label=label)
    if result.outvoted:
        lone = np.clip([row.lone_ttc for row in result.outvoted], low, None)
        when = [row.stamp for row in result.outvoted]
        axes.plot(when, lone, "o", mfc="none", color=OUTVOTED, ms=5, label="outvoted reading")
    stamps, ttc = np.array([(row.stamp, row.ttc) for row in result.rows]).T
    status = np.array([row.nearest.status for row in result.rows])
    mark_on_top(axes, stamps[np.isinf(ttc) & (status != Status.NO_DATA)], QUIET, "nothing closes")
    mark_on_top(axes, stamps[status == Status.NO_DATA], BLIND, "nothing valid seen")
    legend_above(axes)
    axes.tick_params(labelbottom=False)
    quieten(axes)


def _draw_speed(axes: Axes, result: ScanReplay) -> None:
    stamps, speed = [row.stamp for row in result.rows], [row.speed for row in result.rows]
    axes.fill_between(stamps, speed, color=LINE, alpha=0.12, lw=0)
    axes.plot(stamps, speed, color=LINE, lw=1.8)
    axes.axvline(result.least.stamp, color=colour_of_least(result), lw=1, alpha=0.5)
    axes.set(xlabel="time, s", ylabel="speed, m/s")
    axes.margins(x=0.01)
    quieten(axes)


def _draw_from_above(axes: Axes, result: ScanReplay) -> PathCollection:
    """Draw the scan of the least TTC in the vehicle frame, ahead is up and left is left; return the coloured dots."""
    frame, scanner = result.least_frame, result.scanner
    status = np.empty(scanner.beams, np.uint8)
    ttc = result.scan.per_beam(frame.ranges, result.least.speed, frame.yaw_rate, status_out=status)
    seen = np.isin(status, (Status.NOT_CLOSING, Status.CLOSING, Status.CONTACT)) & np.isfinite(frame.ranges)
    x, y = _to_vehicle(scanner, result.scan.angles[seen], frame.ranges[seen])
    ttc = np.maximum(ttc[seen], SHORTEST)
    closing = ttc < LONGEST
    later = f"beam, not closing within {LONGEST:g} s"
    axes.plot(y[~closing], x[~closing], ".", color=QUIET, ms=4, mew=0, label=later)
    scale = LogNorm(np.clip(result.threshold, SHORTEST, 0.9 * LONGEST), LONGEST)
    dots = axes.scatter(y[closing], x[closing], c=ttc[closing], s=14, cmap=URGENCY, norm=scale, lw=0)
    _draw_vehicle(axes, scanner)
    axes.set_aspect("equal")
    quieten(axes)
    _draw_nearest(axes, result)
    axes.set(xlabel="y, m", ylabel="x, m")
    axes.legend(loc="lower center", frameon=False, fontsize=8.5, labelcolor=INK)
    return dots


def _draw_scale(figure: Figure, axes: Axes, dots: PathCollection, result: ScanReplay) -> None:
    """Draw what the colours of the dots mean."""
    bar = figure.colorbar(dots, ax=axes, shrink=0.75, aspect=40, pad=0.03, extend="min")
    bar.set_label(f"time to collision of each beam, s; red is under {result.threshold:g} s", color=INK, fontsize=9)
    bar.outline.set_visible(False)
    label_seconds(bar.ax.yaxis)
    bar.ax.tick_params(colors=INK, labelsize=8.5, which="both")


def _draw_vehicle(axes: Axes, scanner: Scanner) -> None:
    """Draw the outline as far as it is known, and the scanner."""
    if scanner.outline is not None:
        x_rear, x_front, y_right, y_left = scanner.outline
        size = (y_left - y_right, x_front - x_rear)
        axes.add_patch(Rectangle((y_right, x_rear), *size, facecolor=LINE, edgecolor=INK, alpha=0.85, lw=1, zorder=2))
    axes.plot(
        scanner.mount[1], scanner.mount[0], "o", color="white", mec=INK, ms=4, ls="none", zorder=4, label="scanner"
    )


def _draw_nearest(axes: Axes, result: ScanReplay) -> None:
    """Mark the beam that decided, and show what lies around it and the vehicle."""
    nearest, scanner = result.least.nearest, result.scanner
    angle, distance = (nearest.angle, nearest.range) if nearest.beam >= 0 else (0.0, 0.0)
    (x,), (y,) = _to_vehicle(scanner, np.array([angle]), np.array([distance]))
    half = max(0.85 * distance + 0.8, CLOSEST_VIEW)
    axes.set(xlim=(y / 2 + half, y / 2 - half), ylim=(x / 2 - half, x / 2 + half))  # y grows to the left
    if nearest.beam < 0:
        title_of(axes, "nothing closes in any frame")
        return
    axes.plot([scanner.mount[1], y], [scanner.mount[0], x], color=INK, lw=1.2, zorder=3)
    axes.plot(y, x, "o", mfc="none", mec=INK, mew=1.8, ms=12, ls="none", zorder=4, label="deciding beam")
    title_of(
        axes,
        f"{nearest.ttc:.2f} s to collision at t = {result.least.stamp:.2f} s\n"
        f"{nearest.clearance:.2f} m from the {result.start}, closing at {nearest.closing_speed:.2f} m/s",
    )


def _to_vehicle(scanner: Scanner, angles: NDArray[Any], ranges: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Turn readings into points x, y of the vehicle frame."""
    x, y, yaw = scanner.mount
    return x + ranges * np.cos(angles + yaw), y + ranges * np.sin(angles + yaw)
