"""A log through ``ScanTTC.nearest``, frame by frame."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

from ttc_fast import NeighbourSupport, ScanTTC
from ttc_fast.demo.replay import Replay, collect
from ttc_fast.logs import LogError, ScanFrame

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from ttc_fast import Nearest
    from ttc_fast.logs import ScanLog, Scanner


TOO_LONG = "TTC is too long by (scanner to edge of the vehicle) / closing speed"
"""What distances from the scanner mean for the TTC."""


class ScanRow(NamedTuple):
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
        TTC of the plain nearest beam, s: less than ``ttc`` where a lone reading was outvoted.
    """

    frame: int
    stamp: float
    speed: float
    nearest: Nearest
    lone_ttc: float

    @property
    def ttc(self) -> float:
        """TTC of the nearest beam, s."""
        return self.nearest.ttc


@dataclass(frozen=True)
class ScanReplay(Replay[ScanRow, ScanFrame]):
    """A log replayed, as ``Replay``, and what the rows rest on.

    Attributes
    ----------
    scan : ScanTTC
        Gave the rows.
    scanner : Scanner
        What it was made of.
    vote : NeighbourSupport or None
        How lone readings were outvoted; None when they decided.
    """

    scan: ScanTTC
    scanner: Scanner
    vote: NeighbourSupport | None

    @property
    def start(self) -> str:
        """What clearances start from, for people."""
        return "scanner" if self.scanner.outline is None else "outline"

    @cached_property
    def outvoted(self) -> list[ScanRow]:
        """Frames in which a lone reading would have said less."""
        return [row for row in self.rows if row.lone_ttc < row.ttc]

    @property
    def worst_outvoted(self) -> ScanRow | None:
        """That of them in which it would have said least; None when there are none."""
        return min(self.outvoted, key=lambda row: row.lone_ttc, default=None)


def replay(
    log: ScanLog,
    frames: Iterable[ScanFrame] | None = None,
    *,
    scanner: Scanner | None = None,
    threshold: float = 0.7,
    speed: float | None = None,
    support: int = 1,
) -> ScanReplay:
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
    ScanReplay

    Raises
    ------
    LogError
        If the log is damaged, empty, or knows no speed and none is given.
    ValueError
        If the scanner or the support make no sense.

    Examples
    --------
    >>> from ttc_fast.demo import SAMPLES
    >>> from ttc_fast.demo.scans.replay import replay
    >>> from ttc_fast.logs import open_log
    >>> result = replay(open_log(SAMPLES["scans"]))
    >>> result.least.frame, round(result.least.ttc, 2)
    (94, 0.34)
    """
    scanner = scanner or log.scanner
    plain = ScanTTC(**vars(scanner))
    vote = _neighbours(support) if support else None
    scan = ScanTTC(**vars(scanner), minimum=vote) if vote else plain

    def play() -> Iterator[tuple[ScanRow, ScanFrame]]:
        for number, frame in enumerate(log if frames is None else frames):
            now = frame.speed if speed is None else speed
            if now is None:
                raise LogError(log.path, "does not know the speed of the vehicle; say it with --speed, in m/s")
            nearest = scan.nearest(frame.ranges, now, frame.yaw_rate)
            lone = plain.nearest(frame.ranges, now, frame.yaw_rate) if support else nearest
            yield ScanRow(number, frame.stamp, now, nearest, lone.ttc), frame

    return ScanReplay(*collect(log.path, play()), threshold, scan, scanner, vote)


def _neighbours(support: int) -> NeighbourSupport:
    """Look as far to each side as the support needs, and at least two beams."""
    return NeighbourSupport(count=support, window=max(2, support))
