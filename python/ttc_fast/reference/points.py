"""Point clouds in any layout, as columns."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ttc_fast.reference.arguments import as_array

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.floating[Any]]
    Bools = NDArray[np.bool_]

COORDINATES = ("x", "y", "z")
INTENSITIES = (np.int8, np.uint8, np.int16, np.uint16, np.int32, np.uint32, np.float32, np.float64)
WIDEST_POINT = 64
"""The most numbers of a point. An array with more in a row is likely transposed."""


class Cloud(NamedTuple):
    """N points; an organised cloud is taken row by row."""

    xyz: Floats
    """Coordinates as stored, along whatever axes, of shape (3, N)."""
    intensity: NDArray[Any] | None
    """Intensities in the units and dtype stored, of shape (N,)."""

    def valid(self) -> Bools:
        """Say which points count: finite ones, but not (0, 0, 0), which drivers store where nothing came back."""
        valid: Bools = np.isfinite(self.xyz).all(axis=0) & (self.xyz != 0).any(axis=0)
        return valid


def cloud(argument: str, points: Any) -> Cloud:
    """Return ``points`` as a cloud; they are plain rows, records, or a tuple of columns."""
    if isinstance(points, tuple):
        return _of_columns(argument, points)
    points = as_array(argument, points)
    return _of_rows(argument, points) if points.dtype.names is None else _of_records(argument, points)


def _of_rows(argument: str, points: NDArray[Any]) -> Cloud:
    """Return a cloud from rows (x, y, z[, intensity, ...]), of shape (N, 3) or (H, W, 3) or wider."""
    if points.ndim not in (2, 3) or points.shape[-1] < 3:
        raise ValueError(
            f"{argument} must have shape (N, 3), (N, 4) or wider, or (H, W, 3) or wider for an organised cloud, "
            f"got {points.shape}"
        )
    if points.shape[-1] > WIDEST_POINT:
        raise ValueError(f"{argument} has shape {points.shape}, which looks transposed; pass {argument}.T")
    return _of_columns(argument, tuple(np.moveaxis(points, -1, 0)[:4]))


def _of_records(argument: str, points: NDArray[Any]) -> Cloud:
    """Return a cloud from records with fields x, y and z, and perhaps intensity."""
    names = points.dtype.names or ()
    if not set(COORDINATES) <= set(names):
        raise ValueError(f"{argument} must be records with fields x, y and z, got {names}")
    fields = [*COORDINATES, "intensity"] if "intensity" in names else COORDINATES
    return _of_columns(argument, tuple(points[name] for name in fields))


def _of_columns(argument: str, columns: tuple[Any, ...]) -> Cloud:
    """Return a cloud from one array each for x, y and z, and perhaps intensity."""
    if len(columns) not in (3, 4):
        raise ValueError(f"{argument} as a tuple must be (x, y, z) or (x, y, z, intensity), got {len(columns)} arrays")
    columns = tuple(as_array(argument, column) for column in columns)
    shapes = [column.shape for column in columns]
    if len(set(shapes)) > 1 or len(shapes[0]) not in (1, 2):
        raise ValueError(f"{argument} must have columns of one shape, (N,) or (H, W), got {shapes}")
    dtypes = {column.dtype for column in columns[:3]}
    if dtypes not in ({np.dtype(np.float32)}, {np.dtype(np.float64)}):
        raise TypeError(f"{argument} must have dtype float32 or float64, got {', '.join(map(str, dtypes))}")
    intensity = columns[3].ravel() if len(columns) == 4 else None
    if intensity is not None and intensity.dtype not in INTENSITIES:
        raise TypeError(
            f"intensity of {argument} must have an integer dtype of up to 32 bits, float32 or float64, "
            f"got {intensity.dtype}"
        )
    return Cloud(np.array([column.ravel() for column in columns[:3]]), intensity)


def frames(argument: str, points: Any) -> tuple[Floats, bool]:
    """Return points in a plane as columns x, y, z of shape (B, 3, N), and whether they were a batch.

    Where there is no z, x stands in for it: that never makes a valid point invalid.
    """
    columns = _planar(argument, points)
    columns = tuple(as_array(argument, column) for column in columns)
    shapes = [column.shape for column in columns]
    if len(set(shapes)) > 1 or len(shapes[0]) not in (1, 2):
        raise ValueError(f"{argument} must have columns of one shape, (N,) or (B, N), got {shapes}")
    dtypes = {column.dtype for column in columns}
    if dtypes not in ({np.dtype(np.float32)}, {np.dtype(np.float64)}):
        raise TypeError(f"{argument} must have dtype float32 or float64, got {', '.join(map(str, dtypes))}")
    xyz = [*columns, columns[0]] if len(columns) == 2 else columns
    return np.stack([np.atleast_2d(column) for column in xyz], axis=1), len(shapes[0]) == 2


def _planar(argument: str, points: Any) -> tuple[Any, ...]:
    """Return the columns x, y and perhaps z."""
    if isinstance(points, tuple):
        if len(points) not in (2, 3, 4):
            raise ValueError(f"{argument} as a tuple must be (x, y) or (x, y, z), got {len(points)} arrays")
        return points[:3]
    points = as_array(argument, points)
    if points.dtype.names is not None:
        if not {"x", "y"} <= set(points.dtype.names):
            raise ValueError(f"{argument} must be records with fields x and y, got {points.dtype.names}")
        return tuple(points[name] for name in COORDINATES if name in points.dtype.names)
    if points.ndim not in (2, 3) or points.shape[-1] < 2:
        raise ValueError(f"{argument} must have shape (N, 2) or wider, or (B, N, 2) or wider, got {points.shape}")
    if points.shape[-1] > WIDEST_POINT:
        raise ValueError(f"{argument} has shape {points.shape}, which looks transposed; pass {argument}.T")
    return tuple(np.moveaxis(points, -1, 0)[:3])
