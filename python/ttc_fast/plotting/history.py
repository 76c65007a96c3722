"""Distance, closing speed and TTC over time, one above the other.

A replay draws its rows so, ``ttc_fast.plot`` the answers of a tracker.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ttc_fast.plotting.style import (
    ALARM,
    BLIND,
    CAUTION,
    LINE,
    QUIET,
    label_seconds,
    legend_above,
    mark_on_top,
    quieten,
)
from ttc_fast.status import Status

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.gridspec import GridSpecBase
    from numpy.typing import NDArray

    Numbers = NDArray[np.float64]

LONGEST, SHORTEST = 20.0, 0.02
"""The axis of the TTC ends there, s."""


@dataclass(frozen=True)
class History:
    """What is drawn over time. A number that is not known is NaN.

    Attributes
    ----------
    stamps, distance, closing_speed, ttc : ndarray, shape (N,)
        s, m, m/s and s.
    closing_interval, ttc_interval : (ndarray, ndarray)
        The lower and upper ends of the 90 % intervals.
    status : ndarray, shape (N,)
        The statuses.
    nearest, speed : ndarray, shape (N,), or None
        The distance of the plain nearest point, m, and the speed of the vehicle, m/s.
    isolated, warned : bool ndarray, shape (N,), or None
        Where a reading is isolated, and where the brake warns.
    thresholds : tuple of float
        The thresholds of the TTC, s.
    """

    stamps: Numbers
    distance: Numbers
    closing_speed: Numbers
    ttc: Numbers
    closing_interval: tuple[Numbers, Numbers]
    ttc_interval: tuple[Numbers, Numbers]
    status: NDArray[np.integer]
    nearest: Numbers | None = None
    speed: Numbers | None = None
    isolated: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, bool))
    warned: NDArray[np.bool_] | None = None
    thresholds: tuple[float, ...] = ()


def draw_history(
    figure: Figure, grid: GridSpecBase, history: History, mark: Callable[[Axes], None] | None = None
) -> Axes:
    """Draw the three into the first column of a grid, and return the axes of the TTC. ``mark`` draws into each."""
    ttc = figure.add_subplot(grid[2, 0])
    distance, closing = (figure.add_subplot(grid[row, 0], sharex=ttc) for row in (0, 1))
    _draw_distance(distance, history)
    _draw_closing_speed(closing, history)
    _draw_ttc(ttc, history)
    for axes in (distance, closing):
        axes.tick_params(labelbottom=False)
    for axes in (distance, closing, ttc):
        if mark is not None:
            mark(axes)
        legend_above(axes)
        quieten(axes)
    figure.align_ylabels([distance, closing, ttc])
    return ttc


def _known(numbers: Numbers) -> Numbers:
    """Return the numbers with NaN for inf, which cannot be drawn."""
    return np.where(np.isfinite(numbers), numbers, np.nan)


def _isolated(history: History) -> NDArray[np.bool_]:
    return history.isolated if len(history.isolated) else np.zeros(len(history.stamps), bool)


def _draw_distance(axes: Axes, history: History) -> None:
    stamps, distance, isolated = history.stamps, _known(history.distance), _isolated(history)
    if history.nearest is not None and np.isfinite(history.nearest).any():
        axes.plot(stamps, _known(history.nearest), ".-", color=QUIET, lw=1, ms=4, label="plain nearest point")
    axes.plot(stamps, np.where(isolated, np.nan, distance), ".-", color=LINE, lw=1.4, ms=3, label="distance")
    if isolated.any():
        axes.plot(stamps[isolated], distance[isolated], "x", color=CAUTION, ms=5, mew=1.6, label="isolated reading")
    axes.set(ylabel="distance, m")
    axes.set_ylim(bottom=0.0)


def _draw_closing_speed(axes: Axes, history: History) -> None:
    stamps, (low, high) = history.stamps, map(_known, history.closing_interval)
    if history.speed is not None and np.isfinite(history.speed).any():
        axes.plot(stamps, _known(history.speed), color=QUIET, lw=4, alpha=0.6, label="of the vehicle")
    if np.isfinite(low).any():
        axes.fill_between(stamps, low, high, color=LINE, alpha=0.25, lw=0, label="90 % interval")
    axes.plot(stamps, _known(history.closing_speed), ".-", color=LINE, lw=1.4, ms=3, label="closing speed")
    axes.set(ylabel="speed, m/s")
    axes.set_ylim(bottom=min(axes.get_ylim()[0], 0.0))


def _draw_ttc(axes: Axes, history: History) -> None:
    """Draw the TTC and the thresholds on a logarithmic axis."""
    stamps, ttc, isolated = history.stamps, _known(history.ttc), _isolated(history)
    finite = ttc[np.isfinite(ttc)].tolist()
    least, most = min(history.thresholds, default=np.inf), 2.0 * min(history.thresholds, default=0.0)
    low = max(0.7 * min([least, *finite], default=1.0), SHORTEST) if np.isfinite(least) or finite else SHORTEST
    high = min(1.5 * max([most, *finite, 2.0 * low]), LONGEST)
    shown = np.maximum(ttc, low)
    axes.set(yscale="log", ylabel="time to collision, s", xlabel="time, s", ylim=(low, high))
    label_seconds(axes.yaxis)
    for each in sorted(set(history.thresholds)):
        axes.axhline(each, color=ALARM, lw=1, ls=(0, (5, 3)), label=f"threshold {each:g} s")
    lower, upper = (np.clip(end, low, 1e9) for end in history.ttc_interval)
    if np.isfinite(lower).any():
        axes.fill_between(stamps, lower, upper, color=LINE, alpha=0.25, lw=0)
    axes.plot(stamps, np.where(isolated, np.nan, shown), ".-", color=LINE, lw=1.5, ms=3, label="TTC")
    if isolated.any():
        axes.plot(stamps[isolated], shown[isolated], "x", color=CAUTION, ms=5, mew=1.6)
    if history.warned is not None and (warned := history.warned & np.isfinite(shown)).any():
        axes.plot(stamps[warned], shown[warned], "o", mfc="none", color=CAUTION, ms=5, label="warns")
    going = np.isin(history.status, (Status.CLEAR, Status.NOT_CLOSING))
    unseen = np.isin(history.status, (Status.NO_DATA, Status.INVALID))
    mark_on_top(axes, stamps[going], QUIET, "TTC is infinite")
    mark_on_top(axes, stamps[unseen], BLIND, "nothing valid seen")
