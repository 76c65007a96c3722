"""Fixtures that every test may use."""

from pathlib import Path

import pytest
from hypothesis import settings

from evaluation.recorded import DATA

# A busy machine is no reason to fail.
settings.register_profile("no deadline", deadline=None)
settings.load_profile("no deadline")


@pytest.fixture(scope="session")
def data() -> Path:
    """Directory of the real recordings, whose licences forbid shipping them."""
    if not DATA.is_dir():
        pytest.skip(f"needs the recordings, which are not shipped: no directory {DATA} (TTC_FAST_DATA names another)")
    return DATA
