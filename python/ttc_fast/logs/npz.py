"""Logs as NumPy archives: the arrays of a recording under agreed names."""

from __future__ import annotations

import zipfile
import zlib
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast.logs.log import LogError, ScanFrame, Scanner

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

BEAM = ("angle_min", "angle_increment", "range_min", "range_max")
PLACE = {"mount": 3, "outline": 4}  # how many numbers each has
REQUIRED = ("t", "ranges", *BEAM)
OPTIONAL = ("v", "w", *PLACE)
# What a damaged archive raises, from its directory to the header of an array.
DAMAGED = (ValueError, EOFError, MemoryError, RuntimeError, SyntaxError, zipfile.BadZipFile, zlib.error)


class NpzLog:
    """Scans in a NumPy archive (.npz).

    Its arrays: ``t`` (N,) s, increasing; ``ranges`` (N, beams) float32 or float64, m, as recorded; ``angle_min``,
    ``angle_increment`` (rad), ``range_min``, ``range_max`` (m), one number each. Optional: ``v`` (N,) m/s, signed;
    ``w`` (N,) rad/s, 0 when absent; ``mount`` (x, y, yaw) and ``outline`` (x_rear, x_front, y_right, y_left).

    Parameters
    ----------
    path : Path
        Of the archive. It is read at once, and whole.

    Raises
    ------
    LogError
        If it cannot be read, or an array is missing or of the wrong shape or type.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._arrays = _load(path)
        self._ranges = self._scans()
        self._stamps = self._motion("t")
        self._speeds = self._motion("v") if "v" in self._arrays else None
        self._yaw_rates = self._motion("w") if "w" in self._arrays else np.zeros(len(self._ranges))
        self._check_order()
        self.frame_count = len(self._ranges)
        placed: dict[str, Any] = {name: self._numbers(name, n) for name, n in PLACE.items() if name in self._arrays}
        self.scanner = Scanner(
            **{name: self._numbers(name, 1)[0] for name in BEAM}, beams=self._ranges.shape[1], **placed
        )

    def __iter__(self) -> Iterator[ScanFrame]:
        for i, ranges in enumerate(self._ranges):
            speed = None if self._speeds is None else float(self._speeds[i])
            yield ScanFrame(float(self._stamps[i]), ranges, speed, float(self._yaw_rates[i]))

    def _scans(self) -> NDArray[Any]:
        ranges = self._arrays["ranges"]
        if ranges.ndim != 2 or 0 in ranges.shape:
            raise self._error("ranges", f"must have the shape (frames, beams), got {ranges.shape}")
        if ranges.dtype not in (np.float32, np.float64):
            raise self._error("ranges", f"must be float32 or float64 in metres, got {ranges.dtype}")
        return ranges

    def _motion(self, name: str) -> NDArray[Any]:
        """Return an array of one finite number a frame."""
        numbers, frames = self._arrays[name], len(self._ranges)
        if numbers.shape != (frames,):
            raise self._error(name, f"must have the shape ({frames},), one a scan of ranges, got {numbers.shape}")
        if numbers.dtype.kind not in "fiu":
            raise self._error(name, f"must be numbers, got {numbers.dtype}")
        bad = np.flatnonzero(~np.isfinite(numbers))
        if len(bad):
            raise self._error(name, f"must be finite, got {numbers[bad[0]]} in frame {bad[0]}")
        return numbers

    def _check_order(self) -> None:
        backwards = np.flatnonzero(self._stamps[1:] <= self._stamps[:-1])
        if len(backwards):
            frame = backwards[0] + 1
            before, after = self._stamps[frame - 1], self._stamps[frame]
            raise self._error("t", f"must increase, got {after} after {before} in frame {frame}")

    def _numbers(self, name: str, size: int) -> tuple[Any, ...]:
        numbers = self._arrays[name]
        if numbers.size != size or numbers.dtype.kind not in "fiu":
            wanted = "one number" if size == 1 else f"{size} numbers"
            raise self._error(name, f"must be {wanted}, got {numbers.dtype} of shape {numbers.shape}")
        return tuple(float(number) for number in numbers.flat)

    def _error(self, name: str, problem: str) -> LogError:
        return LogError(self.path, f"array {name!r} {problem}")


def _load(path: Path) -> dict[str, NDArray[Any]]:
    """Read the arrays that a log is made of."""
    try:
        with path.open("rb") as file:  # opened here, as np.load leaves a damaged archive open
            archive = np.load(file)
            if not isinstance(archive, np.lib.npyio.NpzFile):
                raise LogError(path, "is a single NumPy array, not an archive of several; write it with numpy.savez")
            missing = [name for name in REQUIRED if name not in archive]
            if missing:
                raise LogError(path, f"has no array {', '.join(missing)}; a log needs {', '.join(REQUIRED)}")
            return {name: archive[name] for name in (*REQUIRED, *OPTIONAL) if name in archive}
    except OSError as error:
        raise LogError(path, f"cannot be opened: {error.strerror or error}") from error
    except DAMAGED as error:
        raise LogError(path, f"is not a NumPy archive, or is damaged: {error}") from error
