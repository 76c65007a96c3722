"""What the contracts share: each is held by the kernels and by the reference."""

from typing import Any

import pytest

import ttc_fast
from ttc_fast import reference


@pytest.fixture(params=[ttc_fast, reference], ids=["kernels", "reference"])
def ttc(request: pytest.FixtureRequest) -> Any:
    """The two implementations of the contract."""
    return request.param
