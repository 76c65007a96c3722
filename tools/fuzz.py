"""Try inputs that nobody thought of, for as long as one likes: ``make fuzz SECONDS=600``.

What has to hold is written down once, in the tests, and they draw their inputs at random: kernels and reference agree
over all dtypes, strides and odd values (``tests/parity``, ``tests/contract``, ``tests/layouts``), messages are read
inside their bytes or refused (``tests/bad_input``, ``tests/ros``), damaged logs are read or refused (``tests/logs``),
and the invariants of the brake hold in any life (``tests/brake``). The tests of a change draw a few inputs. This runs
them again and again, with another seed each round, and counts what they tried.

A log that fails goes into ``tests/logs/corpus``, which the tests read ever after. For another input, Hypothesis prints
the smallest that fails; it belongs into an ``@example`` of its test. The exit code is 1 if something failed.

    python tools/fuzz.py SECONDS [--seed SEED]
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parent.parent
FOLDERS = ("parity", "contract", "layouts", "bad_input", "logs", "brake", "ros")
LIVES = 1000  # of brake controllers in a round; from this number on they follow the seed


class Tried:
    """A plugin of pytest that counts the inputs of each folder of tests, and what failed."""

    def __init__(self) -> None:
        self.inputs: Counter[str] = Counter()
        self.failed: list[str] = []

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Remember a test that failed."""
        if report.failed:
            self.failed.append(report.nodeid)

    def pytest_runtest_teardown(self, item: pytest.Item) -> None:
        """Count: Hypothesis counts its own inputs, the other tests record the property ``inputs``."""
        drawn = re.findall(r"(\d+)(?= (?:passing|failing))", getattr(item, "hypothesis_statistics", ""))
        own: list[Any] = [value for name, value in item.user_properties if name == "inputs"]
        self.inputs[item.path.parent.name] += sum(map(int, [*drawn, *own]))


def one_round(report: Path, seed: int) -> None:
    """Run the tests with one seed, and write what was tried."""
    tried = Tried()
    folders = [str(ROOT / "tests" / folder) for folder in FOLDERS]
    options = ["-q", "--no-header", "-p", "no:cacheprovider", "-m", "hypothesis or fuzz", f"--hypothesis-seed={seed}"]
    pytest.main([*options, "-r", "f", "--rootdir", str(ROOT), *folders], plugins=[tried])
    report.write_text(json.dumps([tried.inputs, tried.failed]), encoding="utf-8")


def main() -> int:
    """Run rounds until the time is over; a round that has begun is ended."""
    parser = argparse.ArgumentParser(description="Try random inputs.")
    parser.add_argument("seconds", type=float)
    parser.add_argument("--seed", type=int, default=int(time.time()), help="of the first round (default: the time)")
    parser.add_argument("--report", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.report:
        one_round(arguments.report, arguments.seed)
        return 0
    begun, seed, inputs, failed = time.monotonic(), arguments.seed, Counter[str](), Counter[str]()
    with tempfile.TemporaryDirectory() as folder:
        while seed == arguments.seed or time.monotonic() - begun < arguments.seconds:
            report = Path(folder) / f"{seed}.json"
            environment = os.environ | {
                "TTC_FAST_SEED": str(seed),
                "TTC_FAST_LIVES": str(LIVES),
                "TTC_FAST_EXAMPLES": "1",
                "TTC_FAST_CORPUS": str(ROOT / "tests" / "logs" / "corpus"),
            }
            command = [sys.executable, __file__, "0", "--seed", str(seed), "--report", str(report)]
            done = subprocess.run(command, env=environment, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=False)
            tried, wrong = json.loads(report.read_text(encoding="utf-8")) if report.exists() else ({}, ["a crash"])
            inputs += Counter(tried)
            failed += Counter(wrong)
            if wrong:
                print(done.stdout, f"seed {seed}, exit code {done.returncode}", sep="\n")
            print(
                f"{time.monotonic() - begun:7.0f} s: {inputs.total():,} inputs, {len(failed)} tests failed", flush=True
            )
            seed += 1
    print(f"seeds {arguments.seed} to {seed - 1}; inputs of " + ", ".join(f"{k} {v:,}" for k, v in inputs.items()))
    for name, times in failed.items():
        print(f"failed in {times} rounds: {name}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
