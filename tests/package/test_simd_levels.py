"""Every instruction-set level below this processor's best, chosen as a user would: by TTC_FAST_SIMD, at import."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import ttc_fast
from tests.support.common import LEVELS, LOWER

PARITY = sorted(Path(__file__).parents[1].joinpath("parity").glob("test_*.py"))


def run(level: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"TTC_FAST_SIMD": level, "TTC_FAST_EXAMPLES": "0.25"}
    command = [sys.executable, *arguments]
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=600, check=False)


@pytest.mark.slow
@pytest.mark.skipif(not LOWER, reason="this processor, or TTC_FAST_SIMD, has the baseline only")
@pytest.mark.parametrize("level", LOWER)
def test_parity_at_lower_levels(level: str) -> None:
    assert run(level, "-c", "import ttc_fast; print(ttc_fast.SIMD_LEVEL)").stdout.strip() == level
    tests = run(level, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *map(str, PARITY))
    assert tests.returncode == 0, tests.stdout + tests.stderr


def test_the_highest_level_is_the_processors() -> None:
    said = run("avx512", "-c", "import ttc_fast; print(ttc_fast.SIMD_LEVEL)").stdout.strip()
    assert LEVELS.index(said) >= LEVELS.index(ttc_fast.SIMD_LEVEL)


def test_an_unknown_level_is_refused() -> None:
    failed = run("sse9", "-c", "import ttc_fast")
    assert failed.returncode != 0
    assert "ValueError: TTC_FAST_SIMD must be one of baseline, neon, avx2, avx512, got 'sse9'" in failed.stderr.replace(
        '"', "'"
    )
