"""How many inputs a call is timed with, in turn.

A processor learns the branches of an input that comes again and again, and then guesses them right. No sensor delivers
the same scan or cloud twice, so a benchmark rotates its inputs.
"""

from __future__ import annotations

POOL_BYTES, MOST, FEWEST = 1 << 19, 64, 2


def turns(nbytes: int, most: int = MOST, fewest: int = FEWEST) -> int:
    """Return the number of inputs of a size: at most ``most``, and as many as stay near the processor together."""
    return min(max(POOL_BYTES // nbytes, fewest), most, MOST)
