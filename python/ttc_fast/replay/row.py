"""What one frame of a log gave."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from ttc_fast.brake import Command, Reason
    from ttc_fast.status import Status


class Row(NamedTuple):
    """One frame: what was seen, and what the brake would have done.

    Parameters
    ----------
    frame : int
        Its place in the log, from 0.
    stamp : float
        s, as the log counts.
    distance : float
        To what is nearest in time, m: from the outline where there is one, along the path where that decides. inf where
        nothing is ahead, NaN where it is not known.
    closing_speed : float
        m/s, positive when approaching; NaN where it is not known.
    ttc : float
        s, in [0, inf].
    status : Status
        What the TTC means.
    command : Command
        Of the brake.
    reason : Reason
        Why.
    closing_low, closing_high : float
        The 90 % interval of the closing speed, m/s; NaN without one.
    ttc_low, ttc_high : float
        The 90 % interval of the TTC, s; NaN without one.
    speed : float
        Of the vehicle, m/s; NaN where the log does not know it.
    valid : int or None
        Readings that are valid, or points in the gate; None where nobody counted.
    criterion : str
        The one nearest to its threshold; empty when nothing was judged.
    value, threshold : float
        What it compares, in its own unit. It triggers when ``value < threshold``.
    beam : int
        The beam or point that was nearest in time; -1 when there is none.
    range, angle : float
        Where it is, m and rad; NaN when not known.
    nearest : float
        Of clouds: how far away the plain nearest point in the gate is, m, counted as ``distance`` is: what the tracker
        did not believe may be nearer than ``distance``. inf where there is none, NaN for other sensors.

    Examples
    --------
    >>> from ttc_fast.replay import Replay, sample
    >>> row = max(Replay(sample("scans")), key=lambda row: row.command)
    >>> row.frame, row.command.name, row.reason.name, row.criterion
    (52, 'BRAKE', 'CRITERION', 'SweptPathThreshold')
    """

    frame: int
    stamp: float
    distance: float
    closing_speed: float
    ttc: float
    status: Status
    command: Command
    reason: Reason
    closing_low: float = math.nan
    closing_high: float = math.nan
    ttc_low: float = math.nan
    ttc_high: float = math.nan
    speed: float = math.nan
    valid: int | None = None
    criterion: str = ""
    value: float = math.nan
    threshold: float = math.nan
    beam: int = -1
    range: float = math.nan
    angle: float = math.nan
    nearest: float = math.nan
