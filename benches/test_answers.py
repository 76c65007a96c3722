"""Each implementation by itself, to follow it over time; ``python -m benches.report`` compares them side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from benches.cases import CASES
from benches.timing import one_call

if TYPE_CHECKING:
    from pytest_benchmark.fixture import BenchmarkFixture

    from benches.case import Case

EVERY = [pytest.param(case, name, id=f"{case} {name}") for case in CASES for name in case.implementations]


@pytest.mark.benchmark(max_time=0.2, min_rounds=3)
@pytest.mark.parametrize(("case", "name"), EVERY)
def test_answers(benchmark: BenchmarkFixture, case: Case, name: str) -> None:
    implementation = case.checked(name)
    benchmark.group = str(case)
    benchmark.extra_info["bytes"] = case.nbytes
    benchmark(one_call(case, implementation))
