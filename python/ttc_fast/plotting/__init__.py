"""Pictures of answers, by matplotlib (the extra ``plot``).

``plot`` is one function, and no method of each result: an answer does not hold the frame that it is about, so both have
to be given, and the results of the kernels know nothing of pictures.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast._core import CloudTTC, Gate, MinX, Nearest, NearestPoint, RangeRateNearest, TrackedTTC
from ttc_fast._extras import missing
from ttc_fast._validate import shown
from ttc_fast.brake import Decision, Motion

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike

    from ttc_fast._core import ScanTTC
    from ttc_fast.plotting.birds_eye import Box, View

__all__ = ["plot"]

OF_SCANS = (Nearest, RangeRateNearest)
OF_CLOUDS = (MinX, CloudTTC, TrackedTTC)
AHEAD = 1.5
"""What comes within this is drawn as a threat unless a threshold says otherwise, s."""
VIEW, HISTORY = (6.0, 6.4), (8.0, 6.4)
"""Sizes, inch."""


def plot(
    result: Any,
    frame: Any = None,
    *,
    scan: ScanTTC | None = None,
    outline: Box | None = None,
    gate: Gate | None = None,
    front_offset: float = 0.0,
    motion: Motion | float | None = None,
    stamps: ArrayLike | None = None,
    ahead: float | None = None,
    axes: Axes | None = None,
) -> Figure:
    """Draw an answer: a bird's eye view of its frame, or a tracker's answers over time.

    In the view ahead is up. It shows what was seen, the vehicle, what threatens, and what decides. A notebook shows the
    figure that is returned.

    Parameters
    ----------
    result : Decision, Nearest, RangeRateNearest, NearestPoint, MinX, CloudTTC, TrackedTTC, or a list of TrackedTTC
        The answer. A list is drawn over time.
    frame : array_like
        What the answer is about: the ranges of a scan, where ``scan`` is given, or else the points of a cloud. An
        answer over time needs none.
    scan : ScanTTC, optional
        The scanner of the ranges. Its outline is drawn.
    outline : (float, float, float, float), optional
        (x_rear, x_front, y_right, y_left) of the vehicle whose path the points are on, m.
    gate : Gate, optional
        The gate of the answer about a cloud; by default ``Gate()``. Points at other heights are not drawn.
    front_offset : float
        Distance from the sensor to the bumper, m, as the tracker has it.
    motion : Motion or float, optional
        The motion, or the speed, m/s, that the answer was computed with. With it the path is drawn.
    stamps : array_like, shape (N,), optional
        The stamps of a list, s; by default its places.
    ahead : float, optional
        What comes within this is drawn as a threat, s; by default the threshold of the decision, or 1.5.
    axes : matplotlib Axes, optional
        Where to draw; by default into a figure of its own. Answers over time have three panels, which take the place
        of these axes.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ModuleNotFoundError
        If matplotlib is missing; the message says how to install it.
    TypeError
        If the answer cannot be drawn, or what it needs beside it was not given.
    ValueError
        If the frame does not fit the scanner, or if ``axes`` are no subplot and three panels cannot take their place.

    Examples
    --------
    >>> import numpy as np, ttc_fast
    >>> scan = ttc_fast.ScanTTC(-1.5, 0.01, 301, outline=(-0.1, 0.4, -0.15, 0.15))
    >>> ranges = np.full(301, 6.0)
    >>> figure = ttc_fast.plot(scan.nearest(ranges, 4.0), ranges, scan=scan, motion=4.0)
    >>> figure.axes[0].get_title(loc="left")
    'CLOSING: 1.40 s to collision, 5.60 m, closing at 4.00 m/s'
    """
    try:
        from ttc_fast.plotting.style import open_figure
    except ModuleNotFoundError as error:
        raise missing("ttc_fast.plot", "matplotlib") from error
    if isinstance(result, (list, tuple)) and result and all(isinstance(each, TrackedTTC) for each in result):
        return _history(result, stamps, axes)
    from ttc_fast.plotting.birds_eye import draw_birds_eye

    speed = Motion(float(motion)) if isinstance(motion, (int, float)) else motion
    if frame is None:
        raise TypeError("frame must be the ranges or points that the answer is about: ttc_fast.plot(result, ranges)")
    of_scan = isinstance(result, OF_SCANS) or (isinstance(result, Decision) and scan is not None)
    if of_scan and scan is None:
        raise TypeError("scan must be the ScanTTC of the ranges, as in ttc_fast.plot(result, ranges, scan=scan)")
    if scan is not None and of_scan:
        view = _of_scan(result, frame, scan, speed, _ahead(result, ahead))
    elif isinstance(result, (NearestPoint, Decision)):
        view = _of_points(result, frame, outline, speed, _ahead(result, ahead))
    elif isinstance(result, OF_CLOUDS):
        view = _of_cloud(result, frame, Gate() if gate is None else gate, front_offset)
    else:
        raise TypeError(
            f"result must be an answer about one frame, or a list of a tracker's answers, got {shown(result)}; "
            "of a batch, result[i] is one"
        )
    if axes is not None:
        draw_birds_eye(axes, view)
        return axes.figure  # type: ignore[return-value]  # or the part of one that holds the axes
    figure = open_figure("", "", VIEW)
    draw_birds_eye(figure.add_subplot(), view)
    figure.draw_without_rendering()  # the layout takes two steps to settle
    return figure


def _ahead(result: Any, ahead: float | None) -> float:
    """Return what is drawn as a threat comes within this: as given, or by the criterion that compares a TTC."""
    if ahead is not None:
        return ahead
    criterion = getattr(result, "criterion", None)
    return float(result.threshold) if criterion is not None and criterion.unit == "s" else AHEAD


def _title(result: Any) -> str:
    """Return what an answer says, in one line; of a decision in two."""
    from ttc_fast.plotting.birds_eye import collision

    if isinstance(result, MinX):
        return f"{result.detection.name}: {result.x:.2f} m, nearest {result.nearest_x:.2f} m"
    if not isinstance(result, Decision):
        distance = result.clearance if hasattr(result, "clearance") else result.distance
        return f"{result.status.name}: {collision(result.ttc, distance, result.closing_speed)}"
    head, threat = f"{result.command.name} ({result.reason.name})", result.threat
    return head if threat is None else f"{head}\n{collision(threat.ttc, threat.clearance, threat.closing_speed)}"


def _of_scan(result: Any, ranges: Any, scan: ScanTTC, motion: Motion | None, ahead: float) -> View:
    from ttc_fast.plotting.birds_eye import view_of_scan

    moves = (0.0, 0.0) if motion is None else (motion.speed, motion.yaw_rate)
    found: Any = result.threat if isinstance(result, Decision) else result
    nearest = (-1, math.nan, math.nan, math.inf)
    if found is not None:
        beam = found.index if isinstance(result, Decision) else found.beam
        nearest = (beam, found.angle, found.range, found.ttc)
    return view_of_scan(_title(result), scan, ranges, moves, ahead, nearest)


def _of_points(result: Any, points: Any, outline: Box | None, motion: Motion | None, ahead: float) -> View:
    from ttc_fast._core import SweptPath
    from ttc_fast.plotting.birds_eye import View

    if outline is None:
        raise TypeError("outline must be that of the vehicle; of ranges, give scan: ttc_fast.plot(..., scan=scan)")
    points = np.asarray(points)
    moves = Motion(0.0) if motion is None else motion
    threatening = SweptPath(outline).per_point(points, moves.speed, moves.yaw_rate) < ahead
    found: Any = result.threat if isinstance(result, Decision) else result
    index = -1 if found is None else found.index
    at = None
    if index >= 0:
        at = float(points[index, 0]), float(points[index, 1])
        threatening[index] |= found.ttc < ahead
    path = (moves.speed, moves.yaw_rate, ahead)
    named = f"contact within {ahead:g} s", at, "nearest in time"
    return View(_title(result), points, threatening, *named, vehicle=outline, path=path)


def _of_cloud(result: Any, cloud: Any, gate: Gate, front_offset: float) -> View:
    """Return the view of the points at the heights of the gate; what the answer is about lies in its lane."""
    from ttc_fast.logs.log import forward_left_up
    from ttc_fast.plotting.birds_eye import view_of_body

    cloud = np.column_stack(cloud) if isinstance(cloud, (list, tuple)) else np.asarray(cloud)
    points = forward_left_up(cloud, gate.axes)
    points = points[np.isfinite(points[:, :3]).all(axis=1) & points[:, :3].any(axis=1)]
    if gate.z is not None:
        points = points[(points[:, 2] >= gate.z[0]) & (points[:, 2] <= gate.z[1])]
    x = result.x if isinstance(result, MinX) else result.distance + front_offset
    if isinstance(result, MinX) and not math.isfinite(x):
        x = result.nearest_x
    return view_of_body(_title(result), points, (*gate.x, *gate.y), x)


def _history(tracked: Sequence[TrackedTTC], stamps: ArrayLike | None, place: Axes | None) -> Figure:
    """Draw distance, closing speed and TTC of a tracker over time."""
    from ttc_fast.plotting.history import History, draw_history
    from ttc_fast.plotting.style import open_figure

    at = np.arange(len(tracked), dtype=float) if stamps is None else np.asarray(stamps, float)
    if at.shape != (len(tracked),):
        raise ValueError(f"stamps must be {len(tracked)}, one for each answer, got shape {at.shape}")
    unknown = (math.nan, math.nan)
    closing, ttc = (
        np.array([getattr(each, name) or unknown for each in tracked], float)
        for name in ("closing_speed_interval", "ttc_interval")
    )
    history = History(
        at,
        np.array([each.distance for each in tracked]),
        np.array([each.closing_speed for each in tracked]),
        np.array([each.ttc for each in tracked]),
        (closing[:, 0], closing[:, 1]),
        (ttc[:, 0], ttc[:, 1]),
        np.array([each.status for each in tracked]),
    )
    ratios = (1, 0.8, 1.5)
    if place is None:
        figure: Any = open_figure("", "", HISTORY)
        panels: Any = figure.add_gridspec(3, 1, height_ratios=ratios)
    else:
        figure, spec = place.figure, place.get_subplotspec()
        if spec is None:
            raise ValueError(
                "axes must be a subplot, such as plt.subplots makes, to hold the three panels of a history"
            )
        panels = spec.subgridspec(3, 1, height_ratios=ratios)
        place.remove()
    axes = draw_history(figure, panels, history)
    axes.set(xlabel="time, s" if stamps is not None else "frame")
    if place is None:
        figure.draw_without_rendering()
    return figure  # type: ignore[no-any-return]
