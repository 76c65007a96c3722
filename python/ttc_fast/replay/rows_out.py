"""Rows as files: CSV, JSON Lines and Parquet. A format is one class."""

from __future__ import annotations

import json
import math
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any

from ttc_fast.brake import Command, Reason
from ttc_fast.replay.row import Row
from ttc_fast.status import Status

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path
    from typing import TextIO

    from typing_extensions import Self

STATUS, COMMAND, REASON = ({member: member.name for member in kind} for kind in (Status, Command, Reason))
BATCH = 8192
FIRST_NAME = Row._fields.index("status")
AFTER_NAMES = FIRST_NAME + 3
FORMATS = {"frame": "%d", "stamp": "%.6f", "criterion": "%s", "valid": "%s", "beam": "%d"} | dict.fromkeys(
    ("status", "command", "reason"), "%s"
)
LINE = ",".join(FORMATS.get(name, "%.6g") for name in Row._fields) + "\n"
TYPES = {"frame": "int64", "valid": "int64", "beam": "int64", "criterion": "string"} | dict.fromkeys(
    ("status", "command", "reason"), "string"
)


class Writer(ABC):
    """Takes rows, and writes some thousands at a time. Close it, or use it as a context.

    Parameters
    ----------
    path : Path
        Written anew.
    """

    def __init__(self, path: Path) -> None:
        self._file = self.open(path)
        self._rows: list[Row] = []

    @abstractmethod
    def open(self, path: Path) -> Any:
        """Open the file, and write what is above the rows."""

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
    """Comma-separated values: ``inf`` and ``nan`` where a number is, nothing where nobody counted."""

    def open(self, path: Path) -> TextIO:
        """Open the file, and write the names of the columns."""
        file = path.open("w", encoding="utf-8", newline="")
        file.write(",".join(Row._fields) + "\n")
        return file

    def put(self, rows: list[Row]) -> None:
        """Write a line each."""
        lines = (LINE % named(row) for row in rows)
        self._file.write("".join(line.replace("None", "", 1) for line in lines))


class JsonLinesWriter(Writer):
    """One JSON object a line; ``null`` where a number is infinite or not known, which the status tells apart."""

    def open(self, path: Path) -> TextIO:
        """Open the file."""
        return path.open("w", encoding="utf-8")

    def put(self, rows: list[Row]) -> None:
        """Write an object each."""
        for row in rows:
            values = zip(Row._fields, named(row), strict=True)
            plain = {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in values}
            self._file.write(json.dumps(plain) + "\n")


class ParquetWriter(Writer):
    """Apache Parquet, by pyarrow; numbers as they are."""

    def open(self, path: Path) -> Any:
        """Open the file with its schema."""
        import pyarrow
        import pyarrow.parquet

        types = [(name, getattr(pyarrow, TYPES.get(name, "float64"))()) for name in Row._fields]
        self._batch = pyarrow.record_batch
        self._schema = pyarrow.schema(types)
        return pyarrow.parquet.ParquetWriter(path, self._schema)

    def put(self, rows: list[Row]) -> None:
        """Write a group of rows."""
        columns = [list(column) for column in zip(*map(named, rows), strict=True)]
        self._file.write_batch(self._batch(columns, schema=self._schema))


WRITERS: dict[str, Callable[[Path], Writer]] = {
    ".csv": CsvWriter,
    ".jsonl": JsonLinesWriter,
    ".parquet": ParquetWriter,
}
"""By the end of the file's name."""


def named(row: Row) -> tuple[Any, ...]:
    """Return the values of a row, with names for its enumerations."""
    names = (STATUS[row.status], COMMAND[row.command], REASON[row.reason])
    return (*row[:FIRST_NAME], *names, *row[AFTER_NAMES:])
