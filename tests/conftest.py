"""Fixtures that every test may use."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def data() -> Path:
    """Directory of the real recordings, whose licences forbid shipping them."""
    named = os.environ.get("TTC_FAST_DATA")
    beside = Path(__file__).parents[2] / "shared" / "data"
    directory = Path(named) if named else beside
    if not directory.is_dir():
        where = f"TTC_FAST_DATA={named}" if named else f"{beside} (set TTC_FAST_DATA to have them elsewhere)"
        pytest.skip(f"needs the recordings, which are not shipped: no directory {where}")
    return directory
