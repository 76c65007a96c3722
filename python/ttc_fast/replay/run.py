"""A replay takes a log from its first frame to its last, and gives a row for each."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ttc_fast.brake import Reason
from ttc_fast.configuration import ConfigurationError
from ttc_fast.logs import CloudLog, LogError, ScanLog, open_log
from ttc_fast.logs.log import ReadErrors, origin
from ttc_fast.logs.ros import BagScans
from ttc_fast.replay.pipelines import Clouds, Distances, Scans
from ttc_fast.replay.settings import Settings
from ttc_fast.replay.summary import Summary
from ttc_fast.sensors.oddities import RefusedError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from os import PathLike

    from ttc_fast.replay.row import Row

TTC_THRESHOLD = 1.5
"""The threshold of exposure where no criterion compares a TTC, s."""
MOST_ROWS = 4096
"""A series has at most this many rows."""
_FOLDER = Path(__file__).parent.parent / "samples"
SAMPLES = {"scans": "approach.npz", "clouds": "following.npz"}
SCENES = {
    "approach.npz": "simulated laser scans of a small car that brakes late for a parked box",
    "following.npz": "simulated point clouds of a car that follows another one, which brakes",
}


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
    return _FOLDER / SAMPLES[name]


def name_of(path: Path) -> str:
    """Return the name of a log above its picture and its table: what a sample shows, or else the name of the file.

    Parameters
    ----------
    path : Path
        The log.

    Returns
    -------
    str

    Examples
    --------
    >>> from pathlib import Path
    >>> from ttc_fast.replay.run import name_of, sample
    >>> name_of(sample("scans"))
    'simulated laser scans of a small car that brakes late for a parked box'
    >>> name_of(Path("some/drive.bag"))
    'drive.bag'
    """
    path = path.resolve()
    return SCENES[path.name] if path.parent == _FOLDER.resolve() and path.name in SCENES else path.name


class Series:
    """Rows of a long log, a few thousand at most, to draw and to print.

    Of every ``step`` successive rows it keeps the one with the strongest command, and among those the least TTC.

    Attributes
    ----------
    rows : list of Row
        The rows that are kept, in order.
    step : int
        How many rows each of them stands for.

    Examples
    --------
    >>> from ttc_fast.replay import Replay, sample
    >>> log = Replay(sample("scans"))
    >>> all_rows = list(log)
    >>> log.series.rows == all_rows, log.series.step
    (True, 1)
    """

    def __init__(self) -> None:
        self.rows: list[Row] = []
        self.step = 1
        self._pending: Row | None = None
        self._count = 0

    def add(self, row: Row) -> None:
        """Take a row."""
        if self.step == 1:
            self.rows.append(row)
        else:
            pending = self._pending
            self._pending = row if pending is None else stronger(pending, row)
            self._count += 1
            if self._count < self.step:
                return
            self.end()
        if len(self.rows) >= MOST_ROWS:
            rows = self.rows
            self.rows = [stronger(rows[i], rows[i + 1]) for i in range(0, MOST_ROWS, 2)]
            self.step *= 2

    def end(self) -> None:
        """Keep what is pending: there are no more rows."""
        if self._pending is not None:
            self.rows.append(self._pending)
        self._pending, self._count = None, 0


def stronger(one: Row, other: Row) -> Row:
    """Return the row with the stronger command; of equal ones that of the lesser TTC, or else the first."""
    if one.command is not other.command:
        return one if one.command > other.command else other
    return one if one.ttc <= other.ttc else other


class Replay:
    """A log that goes through the brake, frame by frame. Iterating gives the rows, once.

    A replay holds a few frames, and a few thousand rows spread evenly over the log.

    Parameters
    ----------
    path : path
        The log, as ``open_log`` takes it, URLs included.
    settings : Settings, optional
        The settings of the log and of the brake.

    Attributes
    ----------
    log : ScanLog, CloudLog or DistanceLog
        The log.
    pipeline : Scans, Clouds or Distances
        What makes rows of its frames.
    threshold : float
        The least threshold of the criteria that compare a TTC, s.
    summary : Summary
        The summary of the rows so far.
    series : Series
        The rows to draw and to print.
    frame : frame or None
        The frame of the row that came last.
    key_frame : (Row, frame) or None
        The frame that the picture shows, with its row: the first that brakes for a criterion, or else the one of least
        TTC.

    Raises
    ------
    LogError
        If the log cannot be opened, or has no use for an option. While iterating, after the last row, if a part of
        the log was lost.
    ConfigurationError
        If a setting makes no sense.

    Examples
    --------
    >>> from ttc_fast.replay import Replay, sample
    >>> log = Replay(sample("scans"))
    >>> rows = list(log)
    >>> len(rows), rows[-1].command.name, log.summary.brakes, round(log.summary.least.ttc, 2)
    (129, 'BRAKE', 1, 0.34)
    """

    def __init__(self, path: str | PathLike[str], settings: Settings | None = None) -> None:
        if settings is not None and not isinstance(settings, Settings):
            fix = "such as Settings(log_options={'speed': 2.0})"
            raise TypeError(f"settings must be Settings, {fix}, got {type(settings).__name__}")
        settings = Settings() if settings is None else settings
        self.log = open_log(path, **settings.of_log)
        if isinstance(self.log, BagScans) and settings.of_scanner.get("mount") is not None:
            self.log.without_mount()
        kind: Any = Distances
        if isinstance(self.log, ScanLog):
            kind = Scans
        elif isinstance(self.log, CloudLog):
            kind = Clouds
        settings.refuse_useless(self.log.path, kind.name, kind.uses)
        self.pipeline: Any = kind(self.log, settings)
        self.threshold = min(self.pipeline.controller.thresholds, default=TTC_THRESHOLD)
        self.summary = Summary(origin(self.log.path), self.threshold, settings.sensor_timeout)
        self.summary.assumed = "; ".join(filter(None, (self.log.assumed, self.pipeline.assumed)))
        self.series = Series()
        self.frame: Any = None
        self.key_frame: tuple[Row, Any] | None = None

    def __iter__(self) -> Iterator[Row]:
        pipeline, summary, series = self.pipeline, self.summary, self.series
        take, add, row_of = summary.add, series.add, pipeline.row
        frame: Any = None
        refused = ReadErrors(self.log.path)
        try:
            for number, each in enumerate(self.log):
                before, frame = frame, each
                try:
                    row = row_of(number, frame)
                except RefusedError as error:
                    refused.add(f"the frame at {frame.stamp:.3f} s {error}")
                    continue
                key_frame = take(row)
                if key_frame is not None:
                    self.key_frame = key_frame, frame if key_frame is row else before
                add(row)
                self.frame = frame
                yield row
            refused.raise_if_any(summary.frames)
        except LogError as error:
            summary.lost = str(error)
            raise
        except ConfigurationError:
            raise
        except ValueError as error:  # such as a gate that bounds an intensity that the clouds lack
            why = "; ".join([str(error), *_fields(frame), *self._odd()])
            lost = LogError(self.log.path, f"frame {summary.frames}: {why}")
            summary.lost = str(lost)
            raise lost from error
        finally:
            series.end()
            key_frame = summary.end()
            if key_frame is not None:
                self.key_frame = key_frame, frame
            summary.odd = [*self._odd(), *pipeline.odd]
            controller = pipeline.controller
            summary.stale, summary.longest_gap, summary.resets = (
                controller.stale,
                controller.longest_gap,
                controller.resets,
            )

    def _odd(self) -> list[str]:
        """Return what was odd about the messages so far, where the log counts it."""
        odd = getattr(self.log, "odd", None)
        return [] if odd is None else odd.sentences()

    @property
    def braked(self) -> bool:
        """Whether the key frame is one of braking."""
        return self.key_frame is not None and self.key_frame[0].reason is Reason.CRITERION


def _fields(frame: Any) -> list[str]:
    """Name the fields that the points of a frame have, where they have names."""
    points = getattr(frame, "points", None)
    names = None if points is None else points.dtype.names
    return [f"its fields are {', '.join(names)}"] if names else []
