"""However positions lie in memory, the answer is that of plain rows, and nothing is copied."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.support.camera_strategies import matches
from tests.support.cloud_layouts import read_only, unaligned
from tests.support.common import peak_of
from ttc_fast import Consensus, MedianRatio, ttc_from_keypoints

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Array = NDArray[Any]


def key_points(array: Array) -> Array:
    """x and y of records as OpenCV stores key points, 28 bytes each."""
    pair = np.dtype((array.dtype, 2))
    layout: Any = {"names": ["pt"], "formats": [pair], "offsets": [3], "itemsize": 3 + pair.itemsize + 12}
    records = np.full(len(array) * (15 + pair.itemsize), 0x41, np.uint8).view(np.dtype(layout))
    records["pt"] = array
    inside: Array = records["pt"]
    return inside


LAYOUTS: dict[str, Callable[[Array], Any]] = {
    "rows": lambda array: array,
    "Fortran": np.asfortranarray,
    "of OpenCV": lambda array: array[:, np.newaxis],
    "of OpenCV, every second": lambda array: np.repeat(array, 2, axis=0)[::2, np.newaxis],
    "wider rows": lambda array: np.hstack([array, np.full((len(array), 3), np.nan, array.dtype)])[:, :2],
    "backwards": lambda array: array[::-1].copy()[::-1],
    "y before x": lambda array: array[:, ::-1].copy()[:, ::-1],
    "every third": lambda array: np.repeat(array, 3, axis=0)[::3],
    "unaligned": unaligned,
    "read-only": lambda array: read_only(array.copy()),
    "key points": key_points,
    "a buffer": lambda array: memoryview(np.ascontiguousarray(array)),  # type: ignore[arg-type, unused-ignore]
}


def answer(previous: Any, current: Any) -> str:
    estimators = (MedianRatio(), Consensus(trials=20))
    return repr([ttc_from_keypoints(previous, current, 0.1, estimator=estimator) for estimator in estimators])


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("count", [0, 1, 2, 15, 16, 17, 33, 200])
@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=LAYOUTS)
def test_every_layout_says_the_same(layout: Callable[[Array], Any], count: int, dtype: str) -> None:
    previous, current = matches("with_gaps", count, 1, dtype)
    expected = answer(previous, current)
    assert answer(layout(previous), current) == expected
    assert answer(previous, layout(current)) == expected
    assert answer(layout(previous), layout(current)) == expected


@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=LAYOUTS)
def test_no_array_is_copied(layout: Callable[[Array], Any]) -> None:
    """NumPy's allocations are seen by tracemalloc; what is made of a call is a small object."""
    previous, current = (layout(array) for array in matches("noisy", 3000, 1, "float32"))
    ttc_from_keypoints(previous, current, 0.1, min_distance=1e9)
    assert peak_of(lambda: ttc_from_keypoints(previous, current, 0.1, min_distance=1e9)) < 3000
