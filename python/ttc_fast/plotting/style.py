"""The look of the pictures: colours, axes, legends."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator, StrMethodFormatter

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from numpy.typing import NDArray

INK, QUIET = "#22303c", "#98a4b0"
# These are of the palette of Okabe and Ito, which suits every kind of colour vision.
PALE = "#d5e6f2"
LINE, ALARM, CAUTION, BLIND = "#0072b2", "#d55e00", "#e69f00", "#cc79a7"
TICKS = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)  # s
SMALL = {"frameon": False, "fontsize": 8.5, "labelcolor": INK, "handlelength": 1.4, "columnspacing": 1.1}


class Picture(Figure):
    """A figure that a notebook shows, whether pyplot was imported or not."""

    def _repr_png_(self) -> bytes:
        buffer = io.BytesIO()
        self.savefig(buffer, format="png", dpi=80)
        return buffer.getvalue()


def open_figure(title: str, footnote: str, size: tuple[float, float]) -> Figure:
    """Make a figure with its own canvas, so that no display is needed; an empty title or footnote takes no room."""
    figure = Picture(figsize=size, layout="constrained")
    if title:
        figure.suptitle(title, x=0.01, ha="left", color=INK, fontsize=12, fontweight="bold")
    if footnote:
        figure.supxlabel(footnote, x=0.01, ha="left", color=INK, fontsize=8.5)
    return figure


def label_seconds(axis: Axis) -> None:
    """Label a logarithmic axis of seconds in steps of 1, 2 and 5."""
    axis.set_major_locator(FixedLocator(TICKS))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_locator(NullLocator())


def mark_on_top(axes: Axes, stamps: NDArray[Any], colour: str, label: str) -> None:
    """Mark the frames that have no TTC, along the upper edge."""
    if len(stamps):
        edge = axes.get_xaxis_transform()
        top = np.full(len(stamps), 0.975)
        axes.plot(stamps, top, "|", color=colour, ms=7, mew=1.5, transform=edge, label=label)


def legend_above(axes: Axes) -> None:
    """Explain the lines in rows above the axes."""
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="lower left", bbox_to_anchor=(-0.01, 0.99), ncols=4, **SMALL)


def legend_below(axes: Axes) -> None:
    """Explain the marks in rows below the axes and their label."""
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="upper left", bbox_to_anchor=(-0.02, -0.09), ncols=2, **SMALL)


def title_of(axes: Axes, text: str) -> None:
    """Write above the axes what they show."""
    axes.set_title(text, color=INK, fontsize=10, loc="left")


def quieten(axes: Axes) -> None:
    """Draw only the parts of the frame that carry information."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(QUIET)
    axes.tick_params(colors=INK, labelsize=9, which="both")
    axes.xaxis.label.set_color(INK)
    axes.yaxis.label.set_color(INK)
    axes.grid(visible=True, color=QUIET, alpha=0.2, lw=0.6)
