"""``ttc_fast`` at lower instruction-set levels: one process for each, in turns.

``python -m benches.levels CASE...`` is such a process. It prints its level and the time of each case, as JSON.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import ttc_fast
from benches.case import OURS
from benches.cases import BY_NAME
from benches.timing import interleaved

if TYPE_CHECKING:
    from collections.abc import Sequence

LEVELS = ("avx512", "avx2", "baseline")
TURNS, ROUNDS = 3, 31


def measure(names: Sequence[str]) -> dict[tuple[str, str], float]:
    """Return the best of ``TURNS`` medians, ns, by the name of the case and the level."""
    best: dict[tuple[str, str], float] = {}
    for _ in range(TURNS):
        for level in LEVELS:
            times = _process(level, names)
            if times.pop("level") != level:
                continue  # this processor does not have it
            for name, ns in times.items():
                best[name, level] = min(best.get((name, level), float("inf")), ns)
    return best


def _process(level: str, names: Sequence[str]) -> dict[str, Any]:
    command = [sys.executable, "-m", "benches.levels", *names]
    done = subprocess.run(command, env={**os.environ, "TTC_FAST_SIMD": level}, check=True, capture_output=True)
    times: dict[str, Any] = json.loads(done.stdout)
    return times


def main(names: Sequence[str]) -> None:
    """Measure and print."""
    times = interleaved([(BY_NAME[name], OURS) for name in names], ROUNDS)
    print(json.dumps({"level": ttc_fast.SIMD_LEVEL, **{str(case): ns for (case, _), ns in times.items()}}))


if __name__ == "__main__":
    main(sys.argv[1:])
