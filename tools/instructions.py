"""Count the instructions of the hot calls, and hold them to the recorded figures.

callgrind counts, at the AVX2 level and on pinned input (``rust/benches/src/bin/hot_calls.rs``), so that a regression is
seen on a noisy machine too. A call costs what 16 of them cost more than 8: what comes before the calls cancels out.

A call that grew by more than 5 % fails; one that shrank as much asks to be recorded again. What a compiler makes of the
same source differs, so the figures of another rustc are shown beside the recorded ones, and nothing fails.

    python tools/instructions.py [--record]
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parent.parent
RECORD = ROOT / "benches" / "instructions.json"
RECORD_AGAIN = "make instructions RECORD=1"

CALLS = 8
TOLERANCE = 0.05


def obstacle() -> str | None:
    """Return the reason why nothing can be counted here, if there is one."""
    cpuinfo = Path("/proc/cpuinfo")
    if not cpuinfo.exists() or "avx2" not in cpuinfo.read_text().split():
        return "the processor has no AVX2 (or /proc/cpuinfo does not say so)"
    if shutil.which("valgrind") is None and os.environ.get("CI") == "true" and os.geteuid() == 0:
        subprocess.run("apt-get update -q && apt-get install -q -y valgrind", shell=True, check=False)
    if shutil.which("valgrind") is None:
        return "valgrind is missing: on Debian and Ubuntu run apt install valgrind"
    return None


def build() -> str:
    """Build the program that makes the calls, as a release, and return its path."""
    command = "cargo build --release --locked --package ttc-fast-benches --bin hot_calls"
    options = ["--quiet", "--message-format=json-render-diagnostics"]
    messages = map(json.loads, run(*command.split(), *options).splitlines())
    return next(str(message["executable"]) for message in messages if message.get("executable"))


def run(*command: str) -> str:
    """Run a command at the root of the repository, and return what it prints."""
    return subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout


def per_call(program: str, name: str) -> int:
    """Return the instructions of one call."""
    return round((instructions(program, name, 2 * CALLS) - instructions(program, name, CALLS)) / CALLS)


def instructions(program: str, name: str, times: int) -> int:
    """Return the instructions of a process that makes a call ``times`` times."""
    with tempfile.TemporaryDirectory() as folder:
        profile = Path(folder) / "profile"
        run("valgrind", "--quiet", "--tool=callgrind", f"--callgrind-out-file={profile}", program, name, str(times))
        summary = re.search(r"^summary: (\d+)$", profile.read_text(), re.MULTILINE)
    if summary is None:
        raise SystemExit("callgrind's profile has no summary")
    return int(summary[1])


def compare(counted: dict[str, int], recorded: dict[str, int]) -> tuple[list[str], list[str]]:
    """Print both side by side, and return what grew and what should be recorded again, each as a sentence."""
    grown, outdated = [], []
    print(f"{'instructions a call':30} {'recorded':>10} {'now':>10}")
    for name, now in counted.items():
        if name not in recorded:
            print(f"{name:30} {'-':>10} {now:10,}")
            grown.append(f"{name} has no recorded figure.")
            continue
        before = recorded[name]
        ratio = now / before
        print(f"{name:30} {before:10,} {now:10,} {ratio - 1:+7.1%}")
        sentence = f"{name} takes {now:,} instructions, {ratio:.3f} times the {before:,} recorded."
        if ratio > 1 + TOLERANCE:
            grown.append(sentence)
        elif ratio < 1 - TOLERANCE:
            outdated.append(sentence)
    outdated += [f"{name} is recorded, and no call any more." for name in recorded if name not in counted]
    return grown, outdated


def main() -> None:
    """Count, then compare or record."""
    parser = argparse.ArgumentParser(description="Count the instructions of the hot calls.")
    parser.add_argument("--record", action="store_true", help="record the figures instead of comparing with them")
    record = parser.parse_args().record
    reason = obstacle()
    if reason is not None:
        print(f"No instructions counted: {reason}.")
        sys.exit(record)

    program, rustc = build(), run("rustc", "--version").strip()
    counted = {name: per_call(program, name) for name in run(program).splitlines()}
    recorded = json.loads(RECORD.read_text())
    grown, outdated = compare(counted, recorded["instructions"])
    if record:
        RECORD.write_text(json.dumps({"rustc": rustc, "instructions": counted}, indent=2) + "\n")
        print(f"Recorded in {RECORD.relative_to(ROOT)}.")
        return
    if rustc != recorded["rustc"]:
        print(f"Not binding: recorded with {recorded['rustc']}, counted with {rustc}.")
        return
    for sentence in grown + outdated:
        print(sentence)
    if grown:
        print(f"Failed: a call may take at most {TOLERANCE:.0%} more than recorded. If it has to be: {RECORD_AGAIN}")
    elif outdated:
        print(f"Please record the new figures: {RECORD_AGAIN}")
    sys.exit(bool(grown))


if __name__ == "__main__":
    main()
