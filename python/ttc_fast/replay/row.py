"""The row of a frame, and the files of rows: CSV, JSON Lines and Parquet. A format of files is one class."""

from __future__ import annotations

import csv
import json
import math
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, NamedTuple, get_type_hints

from ttc_fast.brake import Command, Reason
from ttc_fast.status import Status

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path
    from typing import TextIO

    from typing_extensions import Self


class Row(NamedTuple):
    """What a frame shows, and what the brake would have done.

    Parameters
    ----------
    frame : int
        Number of the frame in the log, from 0.
    stamp : float
        Time of the frame by the clock of the log, s.
    distance : float
        Distance to what is nearest in time, m: from the outline where there is one, along the path where that decides;
        otherwise from the bumper or the sensor. The replay prints which, and it is the same in all rows of a log.
        inf where nothing is there (CLEAR), NaN where it is not known or nothing comes closer.
    closing_speed : float
        Closing speed, m/s, positive when approaching; NaN where it is not known.
    ttc : float
        Time-to-collision, s, in [0, inf].
    status : Status
        What the TTC means.
    command : Command
        The command of the brake.
    reason : Reason
        The reason of the command.
    closing_low, closing_high : float
        The 90 % interval of the closing speed, m/s; NaN without one.
    ttc_low, ttc_high : float
        The 90 % interval of the TTC, s; NaN without one.
    speed : float
        Speed of the vehicle, m/s; NaN where the log does not have it.
    valid : int or None
        Number of valid readings, or of points in the gate; None where they were not counted.
    criterion : str
        Name of the most urgent criterion; empty when nothing was evaluated.
    value, threshold : float
        What that criterion compares, in its own unit. It triggers when ``value < threshold``. NaN when nothing was
        evaluated, as without a closing speed (NO_MOTION); a value of inf is one that nothing is near.
    beam : int
        Number of the beam or point that is nearest in time; -1 when there is none.
    range, angle : float
        Distance from the sensor or the vehicle's origin, m, and direction, rad, of that beam or point; NaN when not
        known.
    nearest : float
        Distance of the plain nearest point in the gate, m, measured as ``distance`` is. A point that the tracker did
        not believe may be nearer than ``distance``. inf where there is none, NaN for other logs than clouds.

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


TYPES = get_type_hints(Row)
UNITS = {
    **dict.fromkeys(("stamp", "ttc", "ttc_low", "ttc_high"), "s"),
    **dict.fromkeys(("closing_speed", "closing_low", "closing_high", "speed"), "m/s"),
    **dict.fromkeys(("distance", "range", "nearest"), "m"),
    "angle": "rad",
}
"""The units of the columns; ``value`` and ``threshold`` have that of their criterion."""
STATUS = Row._fields.index("status")  # command and reason follow
FLOATS = [(i, "%.6f" if name == "stamp" else "%.6g") for i, name in enumerate(Row._fields) if TYPES[name] is float]
"""The columns that CSV formats, and how."""
BATCH = 8192


class Writer(ABC):
    """Takes rows, and writes some thousands at a time. Close it, or use it as a context.

    Parameters
    ----------
    path : Path
        The file, which is written anew.
    """

    def __init__(self, path: Path) -> None:
        self._file = self.open(path)
        self._rows: list[Row] = []

    @abstractmethod
    def open(self, path: Path) -> Any:
        """Open the file, and write what stands above the rows."""

    @abstractmethod
    def put(self, rows: list[Row]) -> None:
        """Write rows."""

    def write(self, row: Row) -> None:
        """Take a row."""
        self._rows.append(row)
        if len(self._rows) >= BATCH:
            self._flush()

    def _flush(self) -> None:
        rows, self._rows = self._rows, []
        if rows:
            self.put(rows)

    def close(self) -> None:
        """Write what is left, and close the file."""
        try:
            self._flush()
        finally:
            self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class CsvWriter(Writer):
    """Comma-separated values. Numbers may be ``inf`` and ``nan``; a number that was not counted is empty."""

    def open(self, path: Path) -> TextIO:
        """Open the file, and write the names of the columns."""
        file = path.open("w", encoding="utf-8", newline="")
        self._csv = csv.writer(file, lineterminator="\n")
        self._csv.writerow(Row._fields)
        return file

    def put(self, rows: list[Row]) -> None:
        """Write a line for each row."""
        self._csv.writerows(map(formatted, rows))


class JsonLinesWriter(Writer):
    """One JSON object a line. ``null`` is a number that is infinite, not known or not counted, as the status says."""

    def open(self, path: Path) -> TextIO:
        """Open the file."""
        return path.open("w", encoding="utf-8")

    def put(self, rows: list[Row]) -> None:
        """Write an object for each row."""
        for row in rows:
            values = zip(Row._fields, plain(row), strict=True)
            finite = {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in values}
            self._file.write(json.dumps(finite) + "\n")


class ParquetWriter(Writer):
    """Apache Parquet, by pyarrow, with the numbers as they are. The schema has the units.

    Parameters
    ----------
    path : Path
        The file, which is written anew.
    log : str, optional
        What the column ``log`` says of every row; without it there is no such column.
    """

    def __init__(self, path: Path, log: str | None = None) -> None:
        self._log = log
        super().__init__(path)

    def open(self, path: Path) -> Any:
        """Open the file with its schema."""
        import pyarrow
        import pyarrow.parquet

        kinds = {float: pyarrow.float64(), int: pyarrow.int64(), int | None: pyarrow.int64()}
        columns = {name: kinds.get(kind, pyarrow.string()) for name, kind in TYPES.items()}
        self._schema = schema_with_units(columns if self._log is None else {"log": pyarrow.string(), **columns}, UNITS)
        self._batch = pyarrow.record_batch
        return pyarrow.parquet.ParquetWriter(path, self._schema)

    def put(self, rows: list[Row]) -> None:
        """Write a group of rows."""
        columns = [list(column) for column in zip(*map(plain, rows), strict=True)]
        if self._log is not None:
            columns.insert(0, [self._log] * len(rows))
        self._file.write_batch(self._batch(columns, schema=self._schema))

    def note(self, name: str, text: str) -> None:
        """Write a text beside the rows, into the metadata of the file."""
        self._file.add_key_value_metadata({name: text})


WRITERS: dict[str, Callable[[Path], Writer]] = {
    ".csv": CsvWriter,
    ".jsonl": JsonLinesWriter,
    ".parquet": ParquetWriter,
}
"""The writer for each ending of a file's name."""


def schema_with_units(columns: dict[str, Any], units: dict[str, str]) -> Any:
    """Return a schema of pyarrow: its metadata ``units`` is JSON, and each column has the metadata ``unit``."""
    import pyarrow

    fields = [pyarrow.field(name, kind, metadata={"unit": units.get(name, "")}) for name, kind in columns.items()]
    return pyarrow.schema(fields, {"units": json.dumps({name: units.get(name, "") for name in columns})})


def plain(row: Row) -> list[Any]:
    """Return the values of a row, with names for its enumerations."""
    values: list[Any] = list(row)
    values[STATUS : STATUS + 3] = row.status.name, row.command.name, row.reason.name
    return values


def of_plain(values: list[Any]) -> Row:
    """Return the row that has these values, with names for its enumerations."""
    status, command, reason = values[STATUS : STATUS + 3]
    return Row._make([*values[:STATUS], Status[status], Command[command], Reason[reason], *values[STATUS + 3 :]])


def formatted(row: Row) -> list[Any]:
    """Return the values of a row as CSV has them."""
    values = plain(row)
    for i, form in FLOATS:
        values[i] = form % values[i]
    return values
