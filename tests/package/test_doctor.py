"""``ttc-fast doctor``: it says what is installed, and finds out a kernel that is wrong."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import ttc_fast
from ttc_fast import reference
from ttc_fast.cli import doctor, main

if TYPE_CHECKING:
    from pathlib import Path

TESTS = doctor.self_tests()
CALLS = {
    "ScanTTC": "ScanTTC",
    "ittc": "ittc",
    "SweptPath": "SweptPath",
    "RangeRate": "RangeRate",
    "robust_min_x": "ttc_from_clouds",
    "CloudTracker": "CloudTracker",
    "fit_road": "fit_road",
    "DistanceTracker": "DistanceTracker",
    "ScaleTracker": "ScaleTracker",
    "ttc_from_keypoints": "ttc_from_heights",
    "the formulae of motion": "time_headway",
}
"""What each self-test calls, among other things."""


def test_a_report_holds_what_a_maintainer_asks_for(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor"]) == 0
    said = dict(line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines())
    assert said["ttc-fast"].startswith(ttc_fast.__version__)
    assert {"python", "numpy", "system", "processor", "SIMD"} <= said.keys()
    assert said["self-test"] == f"{len(TESTS)} of {len(TESTS)} kernels agree with the reference"


def test_sources_that_are_newer_than_the_compiled_part(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    source = tmp_path / "rust/core/src/lib.rs"
    source.parent.mkdir(parents=True)
    source.touch()
    monkeypatch.setattr(doctor, "CHECKOUT", tmp_path)
    assert ", older than its Rust sources: build it again: pip install " in doctor.described()["ttc-fast"]
    os.utime(source, (0, 0))
    assert doctor.described()["ttc-fast"].endswith(" build")


def test_extras_are_named_with_what_they_lack(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "EXTRAS", {"numpy": "log", "no-such-package": "log"})
    assert doctor.extras() == {"log": f"numpy {np.__version__}, no-such-package missing"}


def test_what_the_tests_see() -> None:
    assert TESTS.keys() == CALLS.keys()


@pytest.mark.parametrize("name", TESTS)
def test_a_kernel_that_raises_is_found_out(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(*_: Any, **__: Any) -> Any:
        raise RuntimeError

    monkeypatch.setattr(ttc_fast, CALLS[name], broken)
    monkeypatch.setattr(doctor, "self_tests", lambda: {name: TESTS[name]})
    assert main(["doctor"]) == 1
    assert f"ttc-fast: {name} and the reference give different answers" in capsys.readouterr().err


class Reference:
    """The reference, whose formulae are a thousandth off."""

    def __getattr__(self, name: str) -> Any:
        call = getattr(reference, name)
        return (lambda *given, **named: 1.001 * call(*given, **named)) if name == "time_headway" else call


def test_a_number_that_is_off_is_found_out() -> None:
    formulae = TESTS["the formulae of motion"]
    assert doctor.agrees(formulae)
    assert not doctor.agrees(lambda module: formulae(Reference() if module is ttc_fast else module))


def test_an_output_that_is_not_read_any_more_is_no_traceback() -> None:
    command = [sys.executable, "-m", "ttc_fast.cli", "doctor"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        assert (process.stderr.read(), process.wait(timeout=60)) == ("", 1)
