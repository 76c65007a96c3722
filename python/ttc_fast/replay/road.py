"""How high a lidar sits above the road, where neither its log nor the user says it: a plane fitted to the first clouds.

Heights from 0.1 to 3.3 m are tried, in steps that ``fit_road`` tolerates. Of the planes that it finds in a cloud, that
of the most square metres is the road: the deck of a trailer or the roof of a car is smaller. The clouds have to agree,
and the road has to be nearly level, because the gate of a replay is. Otherwise there is no answer, and the user is
asked.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ttc_fast._core import fit_road
from ttc_fast._settings import option
from ttc_fast.configuration import ConfigurationError
from ttc_fast.logs import LogError, open_log
from ttc_fast.logs.log import REP_103

if TYPE_CHECKING:
    from ttc_fast._core import RoadFit
    from ttc_fast.logs import CloudLog, Lidar
    from ttc_fast.replay.settings import Settings

FRAMES = 5
"""The road is fitted to this many clouds."""
HEIGHTS, TOLERANCE = (0.5, 1.3, 2.1, 2.9), 0.4
"""The heights that are tried, m, and how far a road may be from one of them."""
AGREE = 0.1
"""The heights by the clouds may differ by this, m."""
LEVEL = 0.02
"""A road that rises or falls by more for each metre ahead is out of the gate, or in it, before 10 m."""


class FoundRoad(NamedTuple):
    """The road under a lidar.

    Attributes
    ----------
    lidar : Lidar
        The lidar of the log, with its height.
    text : str
        What was found, and how sure it is, for people.
    """

    lidar: Lidar
    text: str


def find_road(log: CloudLog, settings: Settings) -> FoundRoad:
    """Return the lidar of a log with its height above the road.

    Parameters
    ----------
    log : CloudLog
        A log whose lidar has no height. It is opened once more.
    settings : Settings
        The settings that it was opened with.

    Returns
    -------
    FoundRoad

    Raises
    ------
    ConfigurationError
        If no road is found; the message says why, and which options say the height.
    """
    placement = None if settings.says_axes else getattr(log, "placement", None)
    axes = log.lidar.axes if placement is None else REP_103
    fits: list[RoadFit] = []
    unread: Exception | None = None
    try:
        again: Any = open_log(log.path, **settings.of_log)
        for frame in islice(again, FRAMES):
            points = frame.points if placement is None else placement.turned(frame.points)
            tried = (fit_road(points, sensor_height=each, height_tolerance=TOLERANCE, axes=axes) for each in HEIGHTS)
            fits.append(max(tried, key=lambda fit: (fit.road is not None, fit.patches)))
    except (LogError, ValueError) as error:
        unread = error  # the replay itself will come to it
    roads = [fit.road for fit in fits if fit.road is not None]
    heights = [-road.offset for road in roads]
    if len(roads) < max(1, 0.6 * len(fits)):
        if unread and not fits:
            raise unread
        why = next((fit.reason for fit in fits if fit.road is None), "there is no cloud")
        raise _ask(f"no road was found in {len(fits) - len(roads)} of the first {len(fits)} clouds ({why})")
    if max(heights) - min(heights) > AGREE:
        raise _ask(f"the road in the first clouds is {min(heights):.2f} to {max(heights):.2f} m below the lidar")
    height, slope = float(np.median(heights)), float(np.median([road.slope_x for road in roads]))
    if abs(slope) > LEVEL:
        raise _ask(f"the road ahead {'rises' if slope > 0.0 else 'falls'} by {abs(slope):.1%}, seen from the lidar")
    share = float(np.median([fit.share for fit in fits if fit.road is not None]))
    seen = f"{height:.2f} m below the lidar (within {max(heights) - min(heights):.2f} m), slope {slope:+.1%}"
    how = f"in {len(roads)} of the first {len(fits)} clouds, on {share:.0%} of the ground"
    return FoundRoad(replace(log.lidar, sensor_height=height), f"{seen}, {how}; {option('sensor_height')} overrides it")


def _ask(problem: str) -> ConfigurationError:
    how = f"say it with {option('sensor_height')}, or say which heights with {option('gate_z')}"
    return ConfigurationError(f"it is not known how high the lidar sits above the road, and {problem}; {how}")
