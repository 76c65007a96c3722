"""No time without a right answer."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from benches.contestant import Contestant


def check(contestant: Contestant, exact: Contestant, pool: Sequence[Any], *, every_beam: bool) -> None:
    """Compare every answer with the exact one. Warms up too: the first answer compiles what is to compile.

    Raises
    ------
    AssertionError
        If one differs; it says whose, and about what.
    """
    if contestant.verify is not None:
        assert all(contestant.verify(data, contestant.answer(data)) for data in pool), f"{contestant} is wrong"
        return
    for ranges in pool:
        # Of float32 tables and differences of float32 ranges; of ratios in float64 otherwise.
        rtol = 1e-4 if ranges.dtype == np.float32 else 1e-9
        every = exact.answer(ranges.astype(np.float64))
        assert np.isfinite(every).any(), "nothing to find"
        times, beams = _parts(contestant.answer(ranges))
        expected = every if every_beam else every.min(axis=-1)
        np.testing.assert_allclose(times, expected, rtol, err_msg=f"{contestant.name} is wrong")
        if beams is not None:
            chosen = np.take_along_axis(every, np.expand_dims(beams, -1), axis=-1)[..., 0]
            np.testing.assert_allclose(chosen, expected, rtol, err_msg=f"{contestant.name} names a wrong beam")


def _parts(answer: Any) -> tuple[Any, Any]:
    """The times, and the beams if it says which."""
    if isinstance(answer, tuple):
        times, beams = answer
        return times, beams
    return getattr(answer, "ttc", answer), getattr(answer, "beam", None)
