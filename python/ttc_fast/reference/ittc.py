"""``ittc``: the bare formula over arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ttc_fast.reference.arguments import finite, floats, non_negative, number, output
from ttc_fast.reference.formula import rounded, time_to_collision
from ttc_fast.status import Status

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.floating[Any]]


def ittc(
    ranges: Any,
    *,
    closing_speed: Any = None,
    range_rate: Any = None,
    min_closing_speed: float = 0.0,
    out: Floats | None = None,
    status_out: NDArray[np.uint8] | None = None,
) -> Any:
    """Instantaneous time-to-collision of each range, ``range / max(closing_speed, 0)`` [F1TENTH lecture].

    Arguments, result and errors are those of ``ttc_fast.ittc``: +inf is free space, -inf a contact; NaN and negative
    ranges and non-finite speeds are invalid, with an infinite result.

    Examples
    --------
    >>> import numpy as np
    >>> from ttc_fast import reference
    >>> reference.ittc(np.array([10.0, -np.inf, np.nan]), range_rate=-5.0)
    array([ 2.,  0., inf])
    """
    if (closing_speed is None) == (range_rate is None):
        raise TypeError("give exactly one of closing_speed and range_rate")
    min_closing_speed = non_negative("min_closing_speed", min_closing_speed)
    name, rate = ("closing_speed", closing_speed) if range_rate is None else ("range_rate", range_rate)
    if np.ndim(ranges) == 0 and np.ndim(rate) == 0:
        if out is not None or status_out is not None:
            raise TypeError("out and status_out are for arrays; the range and its rate are numbers")
        one = np.array([number("ranges", ranges)])
        return float(ittc(one, **{name: rate}, min_closing_speed=min_closing_speed)[0])
    if np.ndim(rate) == 0:
        ranges = floats("ranges", ranges)
        same = rounded(finite(name, rate), ranges.dtype)
        rates = np.full_like(ranges, finite(f"{name} in the dtype of ranges", same), subok=False)
    else:
        rates = floats(name, rate)
        if np.ndim(ranges) == 0:
            ranges = np.full_like(rates, number("ranges", ranges), subok=False)
        ranges = floats("ranges", ranges)
        dtype = np.result_type(ranges, rates)
        try:
            rates = np.broadcast_to(rates, ranges.shape)
        except ValueError:
            problem = f"must be a number or broadcast to the shape {ranges.shape} of ranges, got {rates.shape}"
            raise ValueError(f"{name} {problem}") from None
        ranges, rates = ranges.astype(dtype, copy=False), rates.astype(dtype)
    closing = rates if range_rate is None else -rates
    if status_out is not None:
        output("status_out", status_out, ranges, np.uint8)
    out = np.empty_like(ranges, subok=False) if out is None else output("out", out, ranges, ranges.dtype)

    distance = ranges.copy()
    distance[ranges == -np.inf] = 0
    distance[distance < 0] = np.nan
    closing[~np.isfinite(closing)] = np.nan
    least = rounded(min_closing_speed, ranges.dtype)

    out[...] = time_to_collision(distance, closing, least)
    if status_out is not None:
        # The first that holds.
        cases = [
            (np.isnan(distance) | np.isnan(closing), Status.INVALID),
            (distance == 0, Status.CONTACT),
            (distance == np.inf, Status.CLEAR),
            (closing > least, Status.CLOSING),
        ]
        conditions, statuses = zip(*cases, strict=True)
        status_out[...] = np.select(conditions, statuses, Status.NOT_CLOSING)
    return out
