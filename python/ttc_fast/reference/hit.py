"""How many of each kind a scan or a cloud has, and the results of several frames side by side."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

Result = TypeVar("Result")

DTYPES = {"status": np.uint8, "beam": np.int64, "index": np.int64}
"""The dtypes of the columns of a batch that are not float64."""


@dataclass(frozen=True)
class Counts:
    """How often each case of a reading occurred in one scan. The first seven count every beam once."""

    valid: int
    """Valid readings within the user's limits."""
    invalid: int
    """Readings that are NaN."""
    too_close: int
    """Readings of -inf: an object is nearer than ``range_min``."""
    no_return: int
    """Readings of +inf: free space was observed."""
    out_of_range: int
    """Finite readings outside the sensor's ``[range_min, range_max]``, which are discarded."""
    beyond_limits: int
    """Valid readings beyond the user's far limit."""
    masked: int
    """Beams ignored because of ``mask``, or because they look at the vehicle itself."""
    contact: int
    """Readings inside the outline."""


class CountsBatch:
    """The ``Counts`` of a batch under the same names, each a uint32 array of shape (B,)."""

    def __init__(self, frames: Sequence[Counts]) -> None:
        for field in fields(Counts):
            setattr(self, field.name, np.array([getattr(counts, field.name) for counts in frames], np.uint32))
        self._length = len(frames)

    def __len__(self) -> int:
        return self._length


class Batch(Generic[Result]):
    """Results of several frames under the same names, each an array of shape (B,). ``batch[i]`` is the result of one.

    ``status`` is uint8, ``beam`` and ``index`` are int64, ``counts`` is a ``CountsBatch``, everything else float64.
    """

    def __init__(self, result: type[Result], frames: Sequence[Result]) -> None:
        for field in fields(result):  # type: ignore[arg-type]
            values: list[Any] = [getattr(frame, field.name) for frame in frames]
            dtype = DTYPES.get(field.name, np.float64)
            setattr(self, field.name, CountsBatch(values) if field.name == "counts" else np.array(values, dtype))
        self._frames = tuple(frames)

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...

    def __len__(self) -> int:
        return len(self._frames)

    def __getitem__(self, index: int) -> Result:
        return self._frames[index]
