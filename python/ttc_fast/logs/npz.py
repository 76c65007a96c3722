"""NumPy archives (.npz): the arrays of a recording under agreed names, which tell what was recorded."""

from __future__ import annotations

import zipfile
import zlib
from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast.logs.log import LogError

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from numpy.typing import NDArray

# What a damaged archive raises, from its directory to the header of an array.
DAMAGED = (ValueError, EOFError, MemoryError, RuntimeError, SyntaxError, zipfile.BadZipFile, zlib.error)


class Arrays:
    """The arrays of an archive, checked as they are taken.

    Parameters
    ----------
    path : Path
        Of the archive. It is read at once.
    names : iterable of str
        The arrays to read, as far as it has them.

    Raises
    ------
    LogError
        If it cannot be read; from the methods, if an array is not what it should be.
    """

    def __init__(self, path: Path, names: Iterable[str]) -> None:
        self.path = path
        self._arrays = _load(path, names)

    def __contains__(self, name: str) -> bool:
        return name in self._arrays

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self._arrays[name]

    def require(self, names: tuple[str, ...]) -> None:
        """Refuse an archive that lacks one of the names."""
        missing = [name for name in names if name not in self]
        if missing:
            raise LogError(self.path, f"has no array {', '.join(missing)}; a log needs {', '.join(names)}")

    def readings(self, name: str, shape: str, *, fits: bool) -> NDArray[Any]:
        """Return an array in metres, if the shape that it should have fits."""
        readings = self[name]
        if not fits:
            raise self.error(name, f"must have the shape {shape}, got {readings.shape}")
        if readings.dtype not in (np.float32, np.float64):
            raise self.error(name, f"must be float32 or float64 in metres, got {readings.dtype}")
        return readings

    def per_frame(self, name: str, frames: int, of: str) -> NDArray[Any]:
        """Return an array of one finite number a frame."""
        numbers = self[name]
        if numbers.shape != (frames,):
            raise self.error(name, f"must have the shape ({frames},), one a {of}, got {numbers.shape}")
        if numbers.dtype.kind not in "fiu":
            raise self.error(name, f"must be numbers, got {numbers.dtype}")
        bad = np.flatnonzero(~np.isfinite(numbers))
        if len(bad):
            raise self.error(name, f"must be finite, got {numbers[bad[0]]} in frame {bad[0]}")
        return numbers

    def stamps(self, frames: int, of: str) -> NDArray[Any]:
        """Return the array ``t``, which must increase."""
        stamps = self.per_frame("t", frames, of)
        backwards = np.flatnonzero(stamps[1:] <= stamps[:-1])
        if len(backwards):
            frame = backwards[0] + 1
            raise self.error("t", f"must increase, got {stamps[frame]} after {stamps[frame - 1]} in frame {frame}")
        return stamps

    def numbers(self, name: str, size: int) -> tuple[Any, ...]:
        """Return a setting of so many numbers."""
        numbers = self[name]
        if numbers.size != size or numbers.dtype.kind not in "fiu":
            wanted = "one number" if size == 1 else f"{size} numbers"
            raise self.error(name, f"must be {wanted}, got {numbers.dtype} of shape {numbers.shape}")
        return tuple(float(number) for number in numbers.flat)

    def error(self, name: str, problem: str) -> LogError:
        """Say what is wrong with an array."""
        return LogError(self.path, f"array {name!r} {problem}")


def _load(path: Path, names: Iterable[str]) -> dict[str, NDArray[Any]]:
    try:
        with path.open("rb") as file:  # opened here, as np.load leaves a damaged archive open
            archive = np.load(file)
            if not isinstance(archive, np.lib.npyio.NpzFile):
                raise LogError(path, "is a single NumPy array, not an archive of several; write it with numpy.savez")
            return {name: archive[name] for name in names if name in archive}
    except OSError as error:
        raise LogError(path, f"cannot be opened: {error.strerror or error}") from error
    except DAMAGED as error:
        raise LogError(path, f"is not a NumPy archive, or is damaged: {error}") from error
