"""Each contestant by itself, for following one over time; ``python -m benches.report`` compares them side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from benches.camera.cases import CASES as CAMERA
from benches.case import Case, Entrant
from benches.clouds.cases import CASES as CLOUDS
from benches.clouds.tracking import CASES as TRACKED_CLOUDS
from benches.paths.cases import CASES as PATHS
from benches.scans.cases import CASES as SCANS
from benches.scans.rates import CASES as RATES
from benches.timing import one_call
from benches.tracks.cases import CASES as TRACKS

if TYPE_CHECKING:
    from pytest_benchmark.fixture import BenchmarkFixture

CASES: list[Case] = [*SCANS, *RATES, *CLOUDS, *TRACKED_CLOUDS, *PATHS, *TRACKS, *CAMERA]
ENTRANTS = [pytest.param(Entrant(case, name), id=f"{case} {name}") for case in CASES for name in case.names]


@pytest.mark.benchmark(max_time=0.2, min_rounds=3)
@pytest.mark.parametrize("entrant", ENTRANTS)
def test_answers(benchmark: BenchmarkFixture, entrant: Entrant) -> None:
    contestant = entrant.checked()
    benchmark.group = str(entrant.case)
    benchmark.extra_info["bytes"] = entrant.case.nbytes
    benchmark(one_call(entrant.case, contestant))
