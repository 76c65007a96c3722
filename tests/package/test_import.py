"""What ``import ttc_fast`` costs, and what it says where the compiled part does not fit the Python part."""

from __future__ import annotations

import subprocess
import sys

import pytest

import ttc_fast
from ttc_fast._extras import CHECKOUT


def printed(program: str) -> str:
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True)
    return done.stdout.strip()


def test_brake_plots_and_logs_are_not_imported() -> None:
    own = printed("import sys, ttc_fast; print(*sorted(name for name in sys.modules if name.startswith('ttc_fast.')))")
    assert own.split() == ["ttc_fast._core", "ttc_fast.pointcloud2", "ttc_fast.signs", "ttc_fast.status"]


def test_it_costs_little_beside_numpy() -> None:
    """CPU time of the quickest of five imports; it is 10 ms, and three times that on a busy machine."""
    program = "import time, numpy; begun = time.process_time(); import ttc_fast; print(time.process_time() - begun)"
    assert min(float(printed(program)) for _ in range(5)) < 0.03


@pytest.mark.parametrize("name", ttc_fast.__all__)
def test_every_public_name_is_there(name: str) -> None:
    assert name in dir(ttc_fast)
    assert getattr(ttc_fast, name) is getattr(ttc_fast, name)


def test_other_names_are_not() -> None:
    with pytest.raises(AttributeError, match="no attribute 'BreakController'"):
        ttc_fast.BreakController  # noqa: B018


OLD = """
import sys, types
if {missing}:
    sys.modules["ttc_fast._core"] = None
else:
    old = sys.modules["ttc_fast._core"] = types.ModuleType("ttc_fast._core")
    old.SIMD_LEVEL = "avx2"
sys.argv = [{command!r}]
{statement}
"""


@pytest.mark.parametrize("missing", [True, False])
@pytest.mark.parametrize(
    ("command", "statement", "begins"),
    [
        ("/usr/bin/ttc-fast", "from ttc_fast.cli import main", "ttc-fast: "),
        ("drive.py", "import ttc_fast", "ImportError: "),
    ],
)
def test_a_compiled_part_that_is_old_is_named_with_what_mends_it(
    command: str, statement: str, begins: str, missing: bool
) -> None:
    program = OLD.format(missing=missing, command=command, statement=statement)
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=False)
    said = done.stderr.splitlines()
    how = "is missing" if missing else "is older than the Python part (cannot import name 'Alignment')"
    assert done.returncode == 1
    again = "--editable " if (CHECKOUT / "Cargo.toml").exists() else "--force-reinstall ttc-fast"
    assert said[-1].startswith(f"{begins}the compiled part of ttc_fast {how}; build it again: pip install {again}")
    if command.endswith("ttc-fast"):
        assert len(said) == 1
