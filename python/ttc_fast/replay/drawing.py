"""What a recording to scrub through shows of each frame, in Rerun (scrub.py) as in Foxglove (foxglove.py).

A drawing is the bird's eye view that pictures have of the key frame (key_frame.py), here of every frame, as points and
lines in the frame of the vehicle. A decision is put into words when it changes.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ttc_fast.brake import Command
from ttc_fast.configuration import ConfigurationError
from ttc_fast.plotting import style as look
from ttc_fast.plotting.birds_eye import moved
from ttc_fast.replay.key_frame import has_view, view_of
from ttc_fast.sensors.clouds import FAR_AWAY

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

    from ttc_fast.plotting.birds_eye import Box
    from ttc_fast.replay.row import Row
    from ttc_fast.replay.run import Replay

    Colour = tuple[int, int, int]
    Lines = list[NDArray[np.float64]]

STEPS = 24
FARTHEST_GATE = 100.0
"""A gate is drawn this far at most, m."""
LATEST = 9.2e9
"""A recording has times up to here, s: they are ns in 64 bits."""


def _rgb(colour: str) -> Colour:
    red, green, blue = bytes.fromhex(colour[1:])
    return red, green, blue


ALARM, CAUTION, INK = _rgb(look.ALARM), _rgb(look.CAUTION), (232, 238, 243)  # the viewers are dark
LINE, PALE, QUIET = _rgb(look.LINE), _rgb(look.PALE), _rgb(look.QUIET)
URGENCY = {Command.NONE: INK, Command.WARN: CAUTION, Command.BRAKE: ALARM}


class Drawing(NamedTuple):
    """What is drawn of a frame, in the frame of the vehicle, m.

    Attributes
    ----------
    points : ndarray, float32, shape (N, 3)
        Where something was seen; the height of what a scanner sees is 0.
    threatening, strays : bool ndarray, shape (N,)
        Which of them threaten, and which are strays.
    at : (float, float, float) or None
        Where what decides is.
    decides : str
        What that is called.
    outline, path, gate : list of ndarray, shape (M, 3)
        The lines of the vehicle, of the ways of its corners, and of the gate. Each may be empty.
    """

    points: NDArray[np.float32]
    threatening: NDArray[np.bool_]
    strays: NDArray[np.bool_]
    at: tuple[float, float, float] | None
    decides: str
    outline: Lines
    path: Lines
    gate: Lines


def shown(replay: Replay, rows: Iterable[Row]) -> Iterator[tuple[Row, Drawing | None, str]]:
    """Yield each row with its drawing, and with its decision in words where that is another one than before.

    A table of distances has no drawings. ``ConfigurationError`` is raised for a stamp that no recording can have.
    """
    seen = has_view(replay)
    before = None
    for row in rows:
        if abs(row.stamp) > LATEST:
            latest = f"a recording has times of at most {LATEST:g} s"
            raise ConfigurationError(f"frame {row.frame} is at {row.stamp:g} s, and {latest}; leave the recording out")
        said = row.command, row.reason
        yield row, drawing_of(replay, row) if seen else None, "" if said == before else in_words(row)
        before = said


def in_words(row: Row) -> str:
    """Return what the brake decides and why."""
    text = f"{row.command.name}: {row.reason.name}"
    if row.criterion and math.isfinite(row.value):
        text += f", {row.criterion}: {row.value:.2f} of {row.threshold:.3g}"
    return text


def drawing_of(replay: Replay, row: Row) -> Drawing:
    """Return the drawing of the frame that came last, with its row."""
    view = view_of(replay, row, replay.frame)
    points = in_space(view.points)
    kept = np.abs(points[:, :2]).max(axis=1, initial=0.0) < FAR_AWAY  # not what is no point or does not count
    strays = np.zeros(len(points), bool) if view.strays is None else view.strays
    vehicle, lane = view.vehicle, view.lane
    return Drawing(
        points[kept],
        view.threatening[kept],
        strays[kept],
        None if view.at is None else (*view.at, 0.0),
        view.decides,
        [] if vehicle is None else [box(vehicle)],
        [] if vehicle is None or view.path is None else swept(vehicle, *view.path),
        [] if lane is None else [box((lane[0], min(lane[1], FARTHEST_GATE), lane[2], lane[3]))],
    )


def in_space(points: NDArray[Any]) -> NDArray[np.float32]:
    """Return points with a height, which is 0 for those of a scan."""
    if len(points) == 0:  # of no shape in particular
        return np.zeros((0, 3), np.float32)
    points = np.asarray(points, np.float32).reshape(len(points), -1)[:, :3]
    return points if points.shape[1] == 3 else np.column_stack([points, np.zeros(len(points), np.float32)])


def closed(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the closed line around some corners, on the ground."""
    line = corners[[0, 1, 2, 3, 0]]
    return np.column_stack([line, np.zeros(len(line))])


def box(outline: Box) -> NDArray[np.float64]:
    """Return the closed line around a box of (rear, front, right, left)."""
    return closed(moved(outline, 0.0, 0.0, np.zeros(1))[0])


def swept(outline: Box, speed: float, yaw_rate: float, ahead: float) -> Lines:
    """Return the ways of the corners of an outline at constant speed and yaw rate, and the outline at their end."""
    if not math.isfinite(speed) or speed == 0.0:
        return []
    corners = moved(outline, speed, yaw_rate, np.linspace(0.0, ahead, STEPS))
    ways = np.pad(corners, ((0, 0), (0, 0), (0, 1)))
    return [*ways.swapaxes(0, 1), closed(corners[-1])]
