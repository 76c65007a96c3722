"""Rows as files: CSV, JSON Lines and Parquet. A format is one class."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any, Protocol

from ttc_fast.brake import Command, Reason
from ttc_fast.replay.row import Row
from ttc_fast.status import Status

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

STATUS, COMMAND, REASON = ({member: member.name for member in kind} for kind in (Status, Command, Reason))
BATCH = 8192
FIRST_NAME = Row._fields.index("status")
AFTER_NAMES = FIRST_NAME + 3
TYPES = {"frame": "int64", "valid": "int64", "beam": "int64", "criterion": "string"} | dict.fromkeys(
    ("status", "command", "reason"), "string"
)


class Writer(Protocol):
    """What takes rows."""

    def write(self, row: Row) -> None:
        """Take a row."""

    def close(self) -> None:
        """Write what is left, and close the file."""


class CsvWriter:
    """Comma-separated values: ``inf`` and ``nan`` where a number is, nothing where nobody counted.

    Parameters
    ----------
    path : Path
        Written anew.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open("w", encoding="utf-8", newline="")
        self._file.write(",".join(Row._fields) + "\n")
        self._lines: list[str] = []
        formats = {"frame": "%d", "stamp": "%.6f", "criterion": "%s", "valid": "%s", "beam": "%d"}
        names = dict.fromkeys(("status", "command", "reason"), "%s")
        self._line = ",".join((formats | names).get(name, "%.6g") for name in Row._fields) + "\n"

    def write(self, row: Row) -> None:
        """Take a row."""
        line = self._line % _named(row)
        self._lines.append(line if row.valid is not None else line.replace("None", "", 1))
        if len(self._lines) >= BATCH:
            self._flush()

    def _flush(self) -> None:
        self._file.write("".join(self._lines))
        self._lines.clear()

    def close(self) -> None:
        """Write what is left, and close the file."""
        with self._file:
            self._flush()


class JsonLinesWriter:
    """One JSON object a line; ``null`` where a number is infinite or not known, which the status tells apart.

    Parameters
    ----------
    path : Path
        Written anew.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open("w", encoding="utf-8")

    def write(self, row: Row) -> None:
        """Take a row."""
        values = zip(Row._fields, _named(row), strict=True)
        plain = {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in values}
        self._file.write(json.dumps(plain) + "\n")

    def close(self) -> None:
        """Close the file."""
        self._file.close()


class ParquetWriter:
    """Apache Parquet, by pyarrow.

    Parameters
    ----------
    path : Path
        Written anew.
    """

    def __init__(self, path: Path) -> None:
        import pyarrow
        import pyarrow.parquet

        self._arrow = pyarrow
        types = [(name, getattr(pyarrow, TYPES.get(name, "float64"))()) for name in Row._fields]
        self._schema = pyarrow.schema(types)
        self._file = pyarrow.parquet.ParquetWriter(path, self._schema)
        self._rows: list[tuple[Any, ...]] = []

    def write(self, row: Row) -> None:
        """Take a row."""
        self._rows.append(_named(row))
        if len(self._rows) >= BATCH:
            self._flush()

    def _flush(self) -> None:
        if self._rows:
            columns = [list(column) for column in zip(*self._rows, strict=True)]
            self._file.write_batch(self._arrow.record_batch(columns, schema=self._schema))
            self._rows.clear()

    def close(self) -> None:
        """Write what is left, and close the file."""
        self._flush()
        self._file.close()


WRITERS: dict[str, Callable[[Path], Writer]] = {
    ".csv": CsvWriter,
    ".jsonl": JsonLinesWriter,
    ".parquet": ParquetWriter,
}
"""By the end of the file's name."""


def _named(row: Row) -> tuple[Any, ...]:
    """Return the values of a row, with names for its enumerations."""
    names = (STATUS[row.status], COMMAND[row.command], REASON[row.reason])
    return (*row[:FIRST_NAME], *names, *row[AFTER_NAMES:])
