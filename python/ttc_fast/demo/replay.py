"""A log through ``ScanTTC.nearest``, frame by frame."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

from ttc_fast import NeighbourSupport, ScanTTC
from ttc_fast.logs import LogError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ttc_fast import Nearest
    from ttc_fast.logs import ScanFrame, ScanLog, Scanner


class Row(NamedTuple):
    """What one frame gave.

    Attributes
    ----------
    frame : int
        Its place in the log, from 0.
    stamp, speed : float
        s and m/s.
    nearest : Nearest
        The nearest beam in time.
    lone_ttc : float
        TTC of the plain nearest beam, s: less than ``nearest.ttc`` where a lone reading was outvoted.
    """

    frame: int
    stamp: float
    speed: float
    nearest: Nearest
    lone_ttc: float


@dataclass(frozen=True)
class Replay:
    """A log replayed.

    Attributes
    ----------
    scan : ScanTTC
        Gave the rows.
    scanner : Scanner
        What it was made of.
    threshold : float
        TTC below which a frame is marked, s.
    rows : list of Row
        One a frame, at least one.
    least : Row
        The frame of least TTC, the first of them; the first of all when nothing ever closes.
    least_scan : ScanFrame
        Its scan.
    """

    scan: ScanTTC
    scanner: Scanner
    threshold: float
    rows: list[Row]
    least: Row
    least_scan: ScanFrame

    @cached_property
    def under(self) -> list[Row]:
        """Frames whose TTC is under the threshold."""
        return [row for row in self.rows if row.nearest.ttc < self.threshold]

    @cached_property
    def outvoted(self) -> list[Row]:
        """Frames in which a lone reading would have said less."""
        return [row for row in self.rows if row.lone_ttc < row.nearest.ttc]


def replay(
    log: ScanLog,
    frames: Iterable[ScanFrame] | None = None,
    *,
    scanner: Scanner | None = None,
    threshold: float = 0.7,
    speed: float | None = None,
    support: int = 1,
) -> Replay:
    """Run a log through ``ScanTTC.nearest``.

    Parameters
    ----------
    log : ScanLog
        What to replay.
    frames : iterable of ScanFrame, optional
        Its frames, if something watches the progress on the way.
    scanner : Scanner, optional
        Instead of the log's.
    threshold : float
        TTC below which a frame is marked, s.
    speed : float, optional
        Instead of the log's, m/s.
    support : int
        How many neighbouring beams must agree with the nearest one; 0 lets a lone reading decide.

    Returns
    -------
    Replay

    Raises
    ------
    LogError
        If the log is damaged, empty, or knows no speed and none is given.
    ValueError
        If the scanner or the support make no sense.

    Examples
    --------
    >>> from ttc_fast.demo import SAMPLE
    >>> from ttc_fast.demo.replay import replay
    >>> from ttc_fast.logs import open_log
    >>> result = replay(open_log(SAMPLE))
    >>> result.least.frame, round(result.least.nearest.ttc, 2)
    (94, 0.34)
    """
    scanner = scanner or log.scanner
    plain = ScanTTC(**vars(scanner))
    scan = ScanTTC(**vars(scanner), minimum=_neighbours(support)) if support else plain
    rows: list[Row] = []
    least = None
    for number, frame in enumerate(log if frames is None else frames):
        now = frame.speed if speed is None else speed
        if now is None:
            raise LogError(log.path, "does not know the speed of the vehicle; say it with --speed, in m/s")
        nearest = scan.nearest(frame.ranges, now, frame.yaw_rate)
        lone = plain.nearest(frame.ranges, now, frame.yaw_rate) if support else nearest
        rows.append(Row(number, frame.stamp, now, nearest, lone.ttc))
        if least is None or nearest.ttc < least[0].nearest.ttc:
            least = rows[-1], frame
    if least is None:
        raise LogError(log.path, "has no frames")
    return Replay(scan, scanner, threshold, rows, *least)


def _neighbours(support: int) -> NeighbourSupport:
    """Look as far to each side as the support needs, and at least two beams."""
    return NeighbourSupport(count=support, window=max(2, support))
