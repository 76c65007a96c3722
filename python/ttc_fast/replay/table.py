"""The table of logs: a line for each log holds what its rows come to. Rows and lines are given to pandas here, too.

``logs.parquet`` of a dataset has these columns, and some about its parts. A file of its own is Parquet, in which each
line lists its events of braking, or CSV, in which it has their number and when the first began.
"""

from __future__ import annotations

import csv
from itertools import chain
from typing import TYPE_CHECKING, Any

from ttc_fast._extras import missing
from ttc_fast.replay.row import Row, plain, schema_with_units
from ttc_fast.replay.summary import Summary

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

    from pandas import DataFrame

    from ttc_fast.replay.replayed import Replayed

TABLES = (".csv", ".parquet")
"""The endings of a file that holds the table."""
COUNTS = ("frames", "with_known_ttc", "brakes", "warnings", "invalid", "unknown", "isolated", "stale", "resets")
TIMES = ("duration", "judged", "threshold", "longest_gap")
SAME = (*COUNTS, *TIMES, "assumed")
"""Columns that are attributes of the summary; ``odd`` is one too."""
LINE: dict[str, type] = {
    "log": str,
    "exit_code": int,
    "reason": str,
    **dict.fromkeys(COUNTS, int),
    **dict.fromkeys(TIMES, float),
    **dict.fromkeys(("tet", "tit", "least_ttc"), float),
    **dict.fromkeys(("least_frame", "start_frames"), int),
    **dict.fromkeys(("least_stamp", "least_distance", "least_closing_speed", "first_brake"), float),
    "assumed": str,
}
OF_LEAST = ("ttc", "frame", "stamp", "distance", "closing_speed")
"""The columns of ``Row`` that the line has of the row of least TTC."""
OF_BEGIN = ("frame", "stamp", "criterion", "value", "threshold", "ttc", "speed")
"""The columns of ``Row`` that an event has of its first row."""
EVENT: dict[str, type] = {
    "frame": int,
    **dict.fromkeys(("stamp", "end"), float),
    "frames": int,
    **dict.fromkeys(("reason", "criterion"), str),
    **dict.fromkeys(("value", "threshold", "ttc", "speed"), float),
}
UNITS = {
    **dict.fromkeys(("duration", "threshold", "judged", "tet", "least_ttc", "longest_gap"), "s"),
    **dict.fromkeys(("least_stamp", "first_brake"), "s"),
    "tit": "s^2",
    "least_distance": "m",
    "least_closing_speed": "m/s",
}


def line_of(result: Replayed | Summary) -> dict[str, Any]:
    """Return the line of a log. A summary does not know its exit code, which is None."""
    summary = result if isinstance(result, Summary) else result.summary
    least = summary.least
    return {
        "log": result.path if isinstance(result, Summary) else result.log,
        "exit_code": None if isinstance(result, Summary) else result.exit_code,
        "reason": summary.lost,
        **{name: getattr(summary, name) for name in SAME},
        "tet": summary.exposed,
        "tit": summary.integrated,
        **{f"least_{name}": getattr(least, name, None) for name in OF_LEAST},
        "start_frames": 0 if summary.start is None else summary.start.frames,
        "first_brake": summary.events[0].begin.stamp if summary.events else None,
        "odd": summary.odd,
        "events": [
            {
                **{name: getattr(begin, name) for name in OF_BEGIN},
                **{"end": end, "frames": frames, "reason": begin.reason.name},
            }
            for begin, end, frames in summary.events
        ],
    }


def schema(more: dict[str, type] | None = None, units: dict[str, str] | None = None) -> Any:
    """Return the schema of the table for pyarrow, with more columns of a dataset and their units."""
    import pyarrow

    kinds = {int: pyarrow.int64(), float: pyarrow.float64(), str: pyarrow.string()}
    event = pyarrow.struct([(name, kinds[kind]) for name, kind in EVENT.items()])
    columns = {name: kinds[kind] for name, kind in {**LINE, **(more or {})}.items()}
    columns |= {"odd": pyarrow.list_(pyarrow.string()), "events": pyarrow.list_(event)}
    return schema_with_units(columns, {**UNITS, **(units or {})})


def write_table(results: Sequence[Replayed], path: Path, suffix: str) -> None:
    """Write the table of logs.

    Parameters
    ----------
    results : sequence of Replayed
        The logs.
    path : Path
        The file, which is written anew.
    suffix : str
        Its format, one of ``TABLES``.
    """
    lines = map(line_of, results)
    if suffix == ".parquet":
        import pyarrow.parquet

        pyarrow.parquet.write_table(pyarrow.Table.from_pylist(list(lines), schema()), path)
        return
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.DictWriter(file, [*LINE, "odd"], extrasaction="ignore", lineterminator="\n")
        table.writeheader()
        table.writerows({**each, "odd": "; ".join(each["odd"])} for each in lines)


def to_pandas(items: Iterable[Row] | Iterable[Summary] | Iterable[Replayed]) -> DataFrame:
    """Return rows, or what logs come to, as a table of pandas.

    Parameters
    ----------
    items : Replay, or iterable of Row, of Summary or of Replayed
        Rows give a line for each frame, with the columns of ``Row``. Summaries, and the results of ``replay_many``,
        give a line for each log, with the columns of ``logs.parquet``.

    Returns
    -------
    pandas.DataFrame
        Status, command and reason are their names. A count that is not known is ``<NA>``, any other number NaN.

    Raises
    ------
    ModuleNotFoundError
        If pandas is missing (extra ``pandas``).
    TypeError
        If an item is something else.

    Examples
    --------
    >>> from ttc_fast.replay import Replay, sample, to_pandas
    >>> drive = Replay(sample("scans"))
    >>> rows = to_pandas(drive)
    >>> rows[rows.command == "BRAKE"][["frame", "status", "reason"]].values[0].tolist()
    [52, 'CLOSING', 'CRITERION']
    >>> to_pandas([drive.summary])[["frames", "brakes"]].values.tolist()
    [[129, 1]]
    """
    try:
        import pandas as pd
    except ModuleNotFoundError as error:
        raise missing("to_pandas", "pandas") from error
    each = iter(items)
    first = next(each, None)
    if first is None or isinstance(first, Row):
        rows: Any = chain([] if first is None else [first], each)
        table = pd.DataFrame.from_records(list(map(plain, rows)), columns=Row._fields)
        counts = ["frame", "valid", "beam"]
    else:
        logs: list[Any] = [first, *each]
        wrong = next((log for log in logs if not hasattr(log, "summary") and not isinstance(log, Summary)), None)
        if wrong is not None:
            raise TypeError(f"items must be rows, summaries or results of replay_many, got {type(wrong).__name__}")
        table = pd.DataFrame(list(map(line_of, logs)))
        counts = [name for name, kind in LINE.items() if kind is int]
    return table.astype(dict.fromkeys(counts, "Int64"))
