"""The results of many logs as Parquet: a part for each log, and a table with a line for each.

.. code-block:: text

    DIR/rows/drive.bag-1f0c2a9be0d34c1a.parquet    the rows of one log, with a column ``log``
    DIR/logs.parquet                               a line for each log: its summary, events, reason and exit code

A part is written under another name and renamed, so that it is whole or absent. Its metadata say what it was made of
(size and time of the log, settings, version) and hold the summary. So a part is all that is known of its log: a
later run sees by it that the log is done, and the table follows from the parts. A log that cannot be read has a
part without rows. One that failed for another reason, such as a bucket that does not answer, has none, and is named in
the table; the next run replays it again.
"""

from __future__ import annotations

import hashlib
import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast.logs.storage import Location, join, name_in, read_by, remove, written_whole
from ttc_fast.replay.output import OutputError, prepare_folder
from ttc_fast.replay.replayed import Made, Replayed
from ttc_fast.replay.summary import Summary
from ttc_fast.replay.table import line_of, schema

if TYPE_CHECKING:
    from collections.abc import Iterable

    from ttc_fast.replay.row import ParquetWriter
    from ttc_fast.replay.settings import Settings

NOTE = "ttc_fast"
"""The name of what a part says of itself."""
OF_PART: dict[str, type] = {"part": str, "size": int, "modified": float, "settings": str, "version": str}
"""The columns of the table that say what a part was made of."""
DAMAGED = (OSError, ValueError, KeyError, TypeError, NotImplementedError, MemoryError)
"""What pyarrow raises over a file that is missing or damaged."""
UNITS = {"modified": "s", "size": "bytes"}


def digest_of(settings: Settings) -> str:
    """Return a short text that is the same for settings that are equal, in every process."""
    with np.printoptions(threshold=sys.maxsize, floatmode="unique"):  # a long mask is not cut short
        return hashlib.sha256(repr(settings).encode()).hexdigest()[:16]


class Dataset:
    """A folder or a URL below which the results are.

    Parameters
    ----------
    place : Location
        The folder or URL.
    run : str
        What no other run of this moment is called.
    """

    def __init__(self, place: Location, run: str) -> None:
        self.place = place.rstrip("/") if isinstance(place, str) else place
        self.unfinished = join(self.place, f".unfinished-{run}")

    def begin(self) -> None:
        """Raise if nothing can be written here."""
        import pyarrow  # noqa: F401 - if it is missing, that is said before anything is replayed

        if isinstance(self.place, Path):
            prepare_folder(self.place / "rows", self.place)

    def part(self, log: str) -> Location:
        """Return where the part of a log is."""
        name = Path(name_in(log.rstrip("/"))).name
        return join(self.place, "rows", f"{name}-{hashlib.sha256(log.encode()).hexdigest()[:16]}.parquet")

    def done(self, log: str, made: Made) -> Replayed | None:
        """Return the result of an earlier run if its part was made of just this, else None."""
        import pyarrow.parquet

        try:
            noted = read_by(self.part(log), lambda file: pyarrow.parquet.read_metadata(file).metadata)
            note = json.loads(noted[NOTE.encode()])
            if note["log"] != log or Made(**note["made"]) != made:
                return None
            return Replayed(log, Summary.of_json(note["summary"]), note["exit_code"], made, skipped=True)
        except DAMAGED:
            return None

    def note(self, writer: ParquetWriter, result: Replayed) -> None:
        """Let a part say what it is of."""
        made = None if result.made is None else asdict(result.made)
        said = {"log": result.log, "made": made, "exit_code": result.exit_code, "summary": result.summary.to_json()}
        writer.note(NOTE, json.dumps(said))

    def end(self, results: Iterable[Replayed]) -> None:
        """Write the table of all logs of this run, and of those that earlier ones had; clear up."""
        import pyarrow
        import pyarrow.parquet

        columns = schema(OF_PART, UNITS)
        place = join(self.place, "logs.parquet")
        lines = {}
        try:
            table = read_by(place, lambda file: pyarrow.parquet.read_table(file))
            lines = {each["log"]: each for each in table.to_pylist() if set(each) == set(columns.names)}
        except DAMAGED:
            pass
        lines |= {each.log: self._line(each) for each in results}
        table = pyarrow.Table.from_pylist([lines[log] for log in sorted(lines)], columns)
        try:
            with written_whole(place, self.unfinished) as file:
                pyarrow.parquet.write_table(table, file)
        except OSError as error:
            raise OutputError(f"cannot write {place}: {error.strerror or error}; choose another --out") from error
        finally:
            if isinstance(self.unfinished, Path):
                remove(self.unfinished)

    def _line(self, result: Replayed) -> dict[str, Any]:
        if result.made is None:
            return {**line_of(result), **dict.fromkeys(OF_PART)}
        return {**line_of(result), "part": name_in(self.part(result.log)), **asdict(result.made)}
