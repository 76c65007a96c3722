"""A log from its first frame to its last, one row each."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ttc_fast.brake import Reason
from ttc_fast.logs import CloudLog, LogError, ScanLog, open_log
from ttc_fast.replay.scans import Scans
from ttc_fast.replay.series import Series
from ttc_fast.replay.settings import Settings
from ttc_fast.replay.summary import Summary
from ttc_fast.replay.tracked import Clouds, Distances

if TYPE_CHECKING:
    from collections.abc import Iterator
    from os import PathLike

    from ttc_fast.replay.row import Row

TTC_THRESHOLD = 1.5
"""s; what exposure is counted below where no criterion compares a TTC."""
SAMPLES = {"scans": "approach.npz", "clouds": "following.npz"}


def sample(name: str) -> Path:
    """Return the path of a simulated log that the package ships.

    Parameters
    ----------
    name : str
        ``"scans"``: a small car brakes late for a parked box. ``"clouds"``: a car follows another one, which brakes.

    Returns
    -------
    Path

    Examples
    --------
    >>> from ttc_fast.replay import sample
    >>> sample("scans").name
    'approach.npz'
    """
    return Path(__file__).parent.parent / "samples" / SAMPLES[name]


class Replay:
    """A log, frame by frame, through what brakes. Iterating gives the rows, once.

    Only a few frames are held, and of the rows a few thousand, evenly over the log.

    Parameters
    ----------
    path : path
        Of the log, as ``open_log`` takes it.
    settings : Settings, optional
        Of the log and of the brake.

    Attributes
    ----------
    log : ScanLog, CloudLog or DistanceLog
        What is replayed.
    summary : Summary
        Of the rows so far.
    series : Series
        Rows to draw and to print.
    moment : (Row, frame) or None
        The first frame that began to brake for a criterion; without one that of least TTC.

    Raises
    ------
    LogError
        If the log cannot be opened. While iterating, after the last row, if something of it was lost.
    ConfigurationError
        If a setting makes no sense.

    Examples
    --------
    >>> from ttc_fast.replay import Replay, sample
    >>> log = Replay(sample("scans"))
    >>> frames = sum(1 for row in log)
    >>> frames, log.summary.brakes, round(log.summary.least.ttc, 2)
    (129, 1, 0.1)
    """

    def __init__(self, path: str | PathLike[str], settings: Settings | None = None) -> None:
        settings = settings or Settings()
        self.log = open_log(path, **settings.of_log)
        self.eyes: Any
        if isinstance(self.log, ScanLog):
            self.eyes = Scans(self.log, settings)
        elif isinstance(self.log, CloudLog):
            self.eyes = Clouds(self.log, settings)
        else:
            self.eyes = Distances(self.log, settings)
        self.threshold = min(self.eyes.judge.thresholds, default=TTC_THRESHOLD)
        self.summary = Summary(str(self.log.path), self.threshold, settings.sensor_timeout)
        self.series = Series()
        self.moment: tuple[Row, Any] | None = None

    def __iter__(self) -> Iterator[Row]:
        eyes, summary, series = self.eyes, self.summary, self.series
        take, add, row_of = summary.add, series.add, eyes.row
        try:
            for number, frame in enumerate(self.log):
                if number == 0:
                    eyes.begin(frame)
                row = row_of(number, frame)
                if take(row):
                    self.moment = row, frame
                add(row)
                yield row
        except LogError as error:
            summary.lost = str(error)
            raise
        except ValueError as error:  # such as a gate that bounds an intensity that the clouds lack
            raise LogError(self.log.path, f"frame {summary.frames}: {error}") from error
        finally:
            series.end()
            summary.stale, summary.resets = eyes.judge.stale, eyes.judge.resets

    @property
    def braked(self) -> bool:
        """Whether the moment is one of braking."""
        return self.moment is not None and self.moment[0].reason is Reason.CRITERION


def replay(path: str | PathLike[str], settings: Settings | None = None) -> Iterator[Row]:
    """Run a log through what brakes, and give a row for each of its frames.

    Parameters
    ----------
    path : path
        Of the log, as ``open_log`` takes it.
    settings : Settings, optional
        Of the log and of the brake.

    Yields
    ------
    Row
        One a frame.

    Raises
    ------
    LogError
        If the log cannot be opened, or, after the last row, if something of it was lost.
    ConfigurationError
        If a setting makes no sense.

    Examples
    --------
    >>> from ttc_fast.replay import replay, sample
    >>> rows = list(replay(sample("clouds")))
    >>> len(rows), rows[-1].status.name
    (12, 'CLOSING')
    """
    yield from Replay(path, settings)
