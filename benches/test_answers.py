"""Each contestant by itself, for following one over time; ``python -m benches.report`` compares them side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from benches.answers import check
from benches.cases import CASES, Case
from benches.timing import one_call

if TYPE_CHECKING:
    from pytest_benchmark.fixture import BenchmarkFixture

CONTESTANTS = [pytest.param(case, name, id=f"{case} {name}") for case in CASES for name in case.names]


@pytest.mark.benchmark(max_time=0.2, min_rounds=3)
@pytest.mark.parametrize(("case", "name"), CONTESTANTS)
def test_scan(benchmark: BenchmarkFixture, case: Case, name: str) -> None:
    contestant = case.contestant(name)
    check(case, contestant)
    benchmark.group = str(case)
    benchmark.extra_info["bytes"] = case.nbytes
    benchmark(one_call(case, contestant))
