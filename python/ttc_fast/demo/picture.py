"""What the pictures of all kinds of logs have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator, StrMethodFormatter

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from numpy.typing import NDArray

    from ttc_fast.demo.replay import FrameT, Replay, RowT

INK, QUIET, LINE = "#22303c", "#98a4b0", "#1f6f8b"
ALARM = "#d1352b"  # only of a TTC under the threshold
OUTVOTED, BLIND = "#d08a1d", "#a23a8e"
TICKS = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)  # s


def open_figure(title: str, footnote: str) -> Figure:
    """Make a figure with its own canvas, so that no display is needed; an empty footnote takes no room."""
    figure = Figure(figsize=(11, 5), layout="constrained")
    figure.suptitle(title, x=0.01, ha="left", color=INK, fontsize=12, fontweight="bold")
    if footnote:
        figure.supxlabel(footnote, x=0.01, ha="left", color=INK, fontsize=8.5)
    return figure


def draw_ttc(axes: Axes, result: Replay[RowT, FrameT], label: str, low: float, high: float) -> None:
    """Draw TTC over time on a logarithmic axis from low to high, red where it is under the threshold."""
    stamps = np.array([row.stamp for row in result.rows])
    ttc = np.array([row.ttc for row in result.rows])
    shown = np.where(np.isfinite(ttc), np.maximum(ttc, low), np.nan)
    axes.set(yscale="log", ylabel="time to collision, s")
    label_seconds(axes.yaxis)
    axes.set_ylim(low, high)
    axes.axhspan(low, result.threshold, color=ALARM, alpha=0.07, lw=0)
    axes.axhline(result.threshold, color=ALARM, lw=1, ls=(0, (5, 3)), label=f"threshold {result.threshold:g} s")
    axes.plot(stamps, shown, color=LINE, lw=1.8, label=label)
    under = shown < result.threshold
    if under.any():
        axes.plot(stamps, np.where(under, shown, np.nan), color=ALARM, lw=2.4, label="under it")
    if np.isfinite(result.least.ttc):
        lowest = max(result.least.ttc, low)
        colour = colour_of_least(result)
        axes.plot(result.least.stamp, lowest, "o", color=colour, mec="white", ms=9, ls="none", zorder=3, label="least")


def colour_of_least(result: Replay[RowT, FrameT]) -> str:
    """Mark the least TTC in red only if it is under the threshold."""
    return ALARM if result.alarming else INK


def label_seconds(axis: Axis) -> None:
    """Label a logarithmic axis of seconds in steps of 1, 2 and 5."""
    axis.set_major_locator(FixedLocator(TICKS))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_locator(NullLocator())


def mark_on_top(axes: Axes, stamps: NDArray[Any], colour: str, label: str) -> None:
    """Mark the frames that have no TTC, along the upper edge."""
    if len(stamps):
        edge = axes.get_xaxis_transform()
        axes.plot(stamps, np.full(len(stamps), 0.985), "|", color=colour, ms=7, transform=edge, label=label)


def legend_above(axes: Axes) -> None:
    """Explain the lines in rows above the axes."""
    axes.legend(
        loc="lower left",
        bbox_to_anchor=(-0.01, 0.99),
        ncols=4,
        frameon=False,
        fontsize=8.5,
        labelcolor=INK,
        handlelength=1.4,
        columnspacing=1.1,
    )


def title_of(axes: Axes, text: str) -> None:
    """Say above the axes what they show."""
    axes.set_title(text, color=INK, fontsize=10, loc="left")


def quieten(axes: Axes) -> None:
    """Leave of the frame what carries information."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(QUIET)
    axes.tick_params(colors=INK, labelsize=9, which="both")
    axes.xaxis.label.set_color(INK)
    axes.yaxis.label.set_color(INK)
    axes.grid(visible=True, color=QUIET, alpha=0.2, lw=0.6)
