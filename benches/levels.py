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
from benches.case import Case, Entrant
from benches.clouds.cases import CASES as CLOUDS
from benches.scans.cases import CASES as SCANS
from benches.timing import interleaved

if TYPE_CHECKING:
    from collections.abc import Sequence

LEVELS = ("avx512", "avx2", "baseline")
TURNS, ROUNDS = 3, 31


def measure(cases: Sequence[Case]) -> dict[Entrant, float]:
    """The best of ``TURNS`` medians of each case, ns, for a contestant named after the level."""
    best: dict[Entrant, float] = {}
    for _ in range(TURNS):
        for level in LEVELS:
            times = _process(level, cases)
            if times.pop("level") != level:
                continue  # this processor does not have it
            for case in cases:
                entrant = Entrant(case, level)
                best[entrant] = min(best.get(entrant, float("inf")), times[str(case)])
    return best


def _process(level: str, cases: Sequence[Case]) -> dict[str, Any]:
    command = [sys.executable, "-m", "benches.levels", *map(str, cases)]
    done = subprocess.run(command, env={**os.environ, "TTC_FAST_SIMD": level}, check=True, capture_output=True)
    times: dict[str, Any] = json.loads(done.stdout)
    return times


def main(names: Sequence[str]) -> None:
    """Measure and print."""
    cases: list[Case] = [*SCANS, *CLOUDS]
    named = {str(case): case for case in cases}
    times = interleaved([Entrant(named[name], "ttc_fast") for name in names], ROUNDS)
    print(json.dumps({"level": ttc_fast.SIMD_LEVEL, **{str(entrant.case): ns for entrant, ns in times.items()}}))


if __name__ == "__main__":
    main(sys.argv[1:])
