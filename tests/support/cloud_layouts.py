"""One cloud in every layout that drivers choose: columns (x, y, z[, intensity]) go in, points come out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Columns = tuple[NDArray[Any], ...]

FIELDS = ("x", "y", "z", "intensity")


def rows(columns: Columns) -> NDArray[Any]:
    return np.stack(columns, axis=-1)


def wider(columns: Columns) -> NDArray[Any]:
    """Return rows with more numbers in them. The fourth would be an intensity, so without one they are cut off."""
    plain = rows(columns)
    wide = np.concatenate([plain, np.full((len(plain), 2), 7, plain.dtype)], axis=1)
    return wide if len(columns) == 4 else wide[:, :3]


def unaligned(array: NDArray[Any]) -> NDArray[Any]:
    """Copy an array to memory that is one byte off its alignment."""
    memory = np.empty(array.nbytes + 1, np.uint8)
    copy: NDArray[Any] = memory[1:].view(array.dtype).reshape(array.shape)
    copy[...] = array
    return copy


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    array.flags.writeable = False
    return array


def records(columns: Columns, *, lead: int = 0, gap: int = 0, tail: int = 0, backwards: bool = False) -> NDArray[Any]:
    """Return records with bytes of something else before x, before the intensity, and at the end."""
    size = columns[0].itemsize
    places = [lead, lead + size, lead + 2 * size, lead + 3 * size + gap][: len(columns)]
    if backwards:
        places[:3] = places[2::-1]
    end = max(place + column.itemsize for place, column in zip(places, columns, strict=True))
    formats = [column.dtype for column in columns]
    names = list(FIELDS[: len(columns)])
    dtype = np.dtype({"names": names, "formats": formats, "offsets": places, "itemsize": end + tail})
    filled = np.full(len(columns[0]) * dtype.itemsize, 0xFF, np.uint8).view(dtype)
    for name, column in zip(names, columns, strict=True):
        filled[name] = column
    return filled


def grid(array: NDArray[Any]) -> NDArray[Any]:
    """Return points (or one column of them) in rows of equal length."""
    count = len(array)
    height = next(height for height in (4, 3, 7, 5, 2, 1) if count % height == 0)
    return array.reshape(height, count // height, *array.shape[1:])


def padded(array: NDArray[Any]) -> NDArray[Any]:
    """Return a grid whose rows do not follow each other in memory."""
    organised = grid(array)
    spare = np.zeros((organised.shape[0], 3, *organised.shape[2:]), organised.dtype)
    return np.concatenate([organised, spare], axis=1)[:, :-3]


def by_columns(array: NDArray[Any]) -> NDArray[Any]:
    """Return a grid stored column by column."""
    return np.ascontiguousarray(grid(array).swapaxes(0, 1)).swapaxes(0, 1)


def mixed(columns: Columns) -> Columns:
    """Return columns with a stride and sign of their own each."""
    x, y, *others = columns
    return (x[::-1].copy()[::-1], np.repeat(y, 3)[::3], *(unaligned(other) for other in others))


IN_ROWS: dict[str, Callable[[Columns], Any]] = {
    "rows": rows,
    "wider rows": wider,
    "Fortran": lambda columns: np.asfortranarray(rows(columns)),
    "rows backwards": lambda columns: rows(columns)[::-1].copy()[::-1],
    "numbers backwards": lambda columns: rows(columns)[:, ::-1].copy()[:, ::-1],
    "every third": lambda columns: np.repeat(rows(columns), 3, axis=0)[::3],
    "unaligned": lambda columns: unaligned(rows(columns)),
    "read-only": lambda columns: read_only(rows(columns)),
    "grid": lambda columns: grid(rows(columns)),
    "padded grid": lambda columns: padded(rows(columns)),
    "grid by columns": lambda columns: by_columns(rows(columns)),
    "grid backwards": lambda columns: grid(rows(columns))[::-1, ::-1].copy()[::-1, ::-1],
}
"""Layouts in which all numbers are of one dtype."""

IN_COLUMNS: dict[str, Callable[[Columns], Any]] = {
    "columns": lambda columns: columns,
    "mixed columns": mixed,
    "columns as grids": lambda columns: tuple(grid(column) for column in columns),
    "columns as unlike grids": lambda columns: (*map(by_columns, columns[:1]), *map(padded, columns[1:])),
    "one field of records": lambda columns: (records(columns)["x"], *columns[1:]),
    "records": records,
    "records, as of Velodyne": lambda columns: records(columns, tail=6),
    "records, as of PCL": lambda columns: records(columns, gap=4, tail=12),
    "records with a lead": lambda columns: records(columns, lead=5, tail=1),
    "records, z first": lambda columns: records(columns, backwards=True),
    "records backwards": lambda columns: records(columns)[::-1].copy()[::-1],
    "grid of records": lambda columns: padded(records(columns, tail=2)),
}
"""Layouts in which the intensity may have another dtype than the coordinates."""

LAYOUTS = IN_ROWS | IN_COLUMNS
