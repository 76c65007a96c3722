"""No time without a right answer."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from benches.contestant import Contestant
    from benches.scans.cases import Case


def check(case: Case, contestant: Contestant) -> None:
    """Compare every answer with plain NumPy in float64. Warms up too: the first answer compiles what is to compile.

    Raises
    ------
    AssertionError
        If one differs; it says whose, and about what.
    """
    if contestant.verify is not None:
        assert all(contestant.verify(data, contestant.answer(data)) for data in case.pool()), f"{contestant} is wrong"
        return
    # Of float32 tables and differences of float32 ranges; of ratios in float64 otherwise.
    rtol = 1e-4 if case.dtype == "float32" else 1e-9
    exact = case.exact()
    for ranges in case.pool():
        every = exact.answer(ranges.astype(np.float64))
        assert np.isfinite(every).any(), f"{case}: nothing to find"
        times, beams = _parts(contestant.answer(ranges))
        expected = every if case.job.every_beam else every.min(axis=-1)
        np.testing.assert_allclose(times, expected, rtol, err_msg=f"{case}: {contestant.name} is wrong")
        if beams is not None:
            chosen = np.take_along_axis(every, np.expand_dims(beams, -1), axis=-1)[..., 0]
            np.testing.assert_allclose(chosen, expected, rtol, err_msg=f"{case}: {contestant.name} names a wrong beam")


def _parts(answer: Any) -> tuple[Any, Any]:
    """The times, and the beams if it says which."""
    if isinstance(answer, tuple):
        times, beams = answer
        return times, beams
    return getattr(answer, "ttc", answer), getattr(answer, "beam", None)
