"""A bird's eye view of one frame: ahead is up, and left is left.

``View`` says what is drawn. A replay makes one of its key frame, ``ttc_fast.plot`` one of an answer and its frame.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.patches import Polygon, Rectangle

from ttc_fast._core import ScanSweptPath
from ttc_fast.plotting.style import ALARM, CAUTION, INK, LINE, PALE, QUIET, legend_below, quieten, title_of
from ttc_fast.status import Status

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from ttc_fast._core import ScanTTC

CLOSEST_VIEW, FARTHEST_VIEW = 2.5, 60.0
"""The view reaches at least and at most this far, m."""
BODY_DEPTH = 0.5
"""Points within this of the distance that a tracker gives belong to the body that it follows, m."""
STRAY = 0.1
"""Points of the lane that are nearer than the body by more than this are strays: a plain minimum would take them, m."""
STEPS = 120

Box = tuple[float, float, float, float]


class View(NamedTuple):
    """What a bird's eye view shows, in the vehicle frame, m.

    Attributes
    ----------
    title : str
        What stands above it.
    points : ndarray, shape (N, 2) or wider
        Where something was seen.
    threatening : bool ndarray, shape (N,)
        Which of them are drawn as a threat.
    threats : str
        What those are called.
    at : (float, float) or None
        Where what decides is.
    decides : str
        What that is called.
    sensor : (float, float)
        Where the sensor is.
    vehicle : (float, float, float, float) or None
        The vehicle, as an outline has it.
    path : (float, float, float) or None
        Speed, yaw rate, and for how long ahead the path of the vehicle is drawn, m/s, rad/s and s.
    lane : (float, float, float, float) or None
        The box in which points count, as an outline has it.
    strays : bool ndarray, shape (N,), or None
        Which points are drawn as strays.
    """

    title: str
    points: NDArray[Any]
    threatening: NDArray[np.bool_]
    threats: str
    at: tuple[float, float] | None
    decides: str
    sensor: tuple[float, float] = (0.0, 0.0)
    vehicle: Box | None = None
    path: tuple[float, float, float] | None = None
    lane: Box | None = None
    strays: NDArray[np.bool_] | None = None


def draw_birds_eye(axes: Axes, view: View) -> None:
    """Draw a frame with the vehicle, its path, what was seen and what threatens."""
    points, threatening, at = view.points, view.threatening, view.at
    _frame(axes, view)
    if view.path is not None and view.vehicle is not None:
        _draw_path(axes, view.vehicle, *view.path)
    elif view.lane is not None:
        near, far, right, left = view.lane
        length = min(far, 10.0 * FARTHEST_VIEW) - near
        axes.add_patch(
            Rectangle((right, near), left - right, length, color=PALE, alpha=0.6, lw=0, zorder=0, label="gate")
        )
    axes.plot(points[~threatening, 1], points[~threatening, 0], ".", color=QUIET, ms=3, mew=0)
    if threatening.any():
        threats = points[threatening]
        axes.plot(threats[:, 1], threats[:, 0], ".", color=ALARM, ms=6, mew=0, label=view.threats, zorder=3)
    if view.strays is not None and view.strays.any():
        stray = points[view.strays]
        axes.plot(stray[:, 1], stray[:, 0], "x", color=CAUTION, ms=6, mew=1.6, ls="none", zorder=3, label="stray point")
    if at is not None:
        axes.plot(at[1], at[0], "o", mfc="none", mec=INK, mew=1.8, ms=12, zorder=4, ls="none", label=view.decides)
    if view.vehicle is not None:
        rear, front, right, left = view.vehicle
        size = (left - right, front - rear)
        axes.add_patch(Rectangle((right, rear), *size, facecolor=LINE, edgecolor=INK, alpha=0.85, lw=1, zorder=2))
    x, y = view.sensor
    axes.plot(y, x, "o", color="white", mec=INK, ms=4, ls="none", zorder=5, label="sensor")
    legend_below(axes)
    quieten(axes)
    title_of(axes, view.title)


def _frame(axes: Axes, view: View) -> None:
    """Set the limits of the view: the vehicle, what is nearest in time, and a little around both."""
    x, y = (FARTHEST_VIEW / 6, 0.0) if view.at is None else view.at
    low = min(view.vehicle[0] if view.path and view.vehicle else -1.0, x, 0.0)
    high = max(x, 0.0)
    size = min(max(1.35 * max(high - low, 2.0 * abs(y)), CLOSEST_VIEW), 2.0 * FARTHEST_VIEW)
    middle = (low + high) / 2.0
    axes.set(xlim=(size / 2, -size / 2), ylim=(middle - size / 2, middle + size / 2), xlabel="y, m", ylabel="x, m")
    axes.set_aspect("equal")


def _draw_path(axes: Axes, outline: Box, speed: float, yaw_rate: float, ahead: float) -> None:
    """Draw where the outline will be for some time ahead if the vehicle goes on as it does."""
    if not math.isfinite(speed) or speed == 0.0:
        return
    for corners in moved(outline, speed, yaw_rate, np.linspace(ahead, 0.0, STEPS)):
        axes.add_patch(Polygon(corners[:, ::-1], closed=True, color=PALE, lw=0, zorder=1))
    path = Rectangle((0.0, 0.0), 0.0, 0.0, color=PALE, lw=0, label=f"its path in {ahead:g} s")
    axes.add_patch(path)


def moved(outline: Box, speed: float, yaw_rate: float, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the corners of an outline that moves on an arc, at each of some times from now, shape (times, 4, 2)."""
    rear, front, right, left = outline
    corners = np.array([(rear, right), (front, right), (front, left), (rear, left)])
    turn = yaw_rate * times
    way = speed * times * np.sinc(turn / 2.0 / np.pi)
    cos, sin = np.cos(turn)[:, None], np.sin(turn)[:, None]
    x = (way * np.cos(turn / 2.0))[:, None] + cos * corners[:, 0] - sin * corners[:, 1]
    y = (way * np.sin(turn / 2.0))[:, None] + sin * corners[:, 0] + cos * corners[:, 1]
    return np.stack([x, y], axis=-1)


def collision(ttc: float, distance: float, closing_speed: float) -> str:
    """Return when and where something is hit, for a title."""
    within = f"{ttc:.2f} s to collision" if math.isfinite(ttc) else "no collision known"
    return f"{within}, {distance:.2f} m, closing at {closing_speed:.2f} m/s"


def view_of_scan(
    title: str,
    scan: ScanTTC,
    ranges: Any,
    motion: tuple[float, float],
    ahead: float,
    nearest: tuple[int, float, float, float],
) -> View:
    """Return the view of a scan: its readings as points, of which those with a TTC below ``ahead`` threaten.

    The TTC is that of the swept path where the scanner has an outline. ``motion`` is speed and yaw rate. ``nearest`` is
    the beam that decides, -1 without one, with its angle, range and TTC.
    """
    kernel = scan if scan.outline is None else ScanSweptPath(scan)
    threatening: NDArray[np.bool_] = np.asarray(kernel.per_beam(ranges, *motion)) < ahead
    status = np.empty(scan.beams, np.uint8)
    scan.per_beam(ranges, *motion, status_out=status)
    ranges = np.asarray(ranges, float)
    seen = np.isfinite(ranges) & np.isin(status, (Status.NOT_CLOSING, Status.CLOSING, Status.CONTACT))
    at, (beam, angle, distance, ttc) = None, nearest
    if beam >= 0:
        ((x, y),) = _placed(scan.mount, np.array([angle]), np.array([distance])).tolist()
        at = x, y
        threatening[beam] |= ttc < ahead  # where the motion is not given, the range rate tells it
    points = _placed(scan.mount, scan.angles[seen], ranges[seen])
    said = f"contact within {ahead:g} s", at, "nearest in time"
    return View(title, points, threatening[seen], *said, scan.mount[:2], scan.outline, (*motion, ahead))


def _placed(mount: Any, angles: NDArray[Any], ranges: NDArray[Any]) -> NDArray[Any]:
    """Return x and y in the vehicle frame of what a sensor sees at these angles and ranges."""
    x, y, yaw = mount
    return np.column_stack([x + ranges * np.cos(angles + yaw), y + ranges * np.sin(angles + yaw)])


def view_of_body(title: str, points: NDArray[Any], lane: Box, x: float) -> View:
    """Return the view of what a tracker or an estimator found ``x`` ahead in a lane of (near, far, right, left)."""
    near, _, right, left = lane
    in_lane = (points[:, 1] >= right) & (points[:, 1] <= left)
    view = View(title, points, np.zeros(len(points), bool), "what is followed", None, "distance", lane=lane)
    if not math.isfinite(x):
        return view
    body = (np.abs(points[:, 0] - x) < BODY_DEPTH) & in_lane
    strays = (points[:, 0] < x - STRAY - BODY_DEPTH) & (points[:, 0] >= near) & in_lane
    y = float(points[body, 1].mean()) if body.any() else (right + left) / 2.0
    return view._replace(threatening=body, at=(x, y), strays=strays)
