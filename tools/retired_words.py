"""Fail where a word is left that the project has retired: ``make lint`` runs it.

A row is folders, the retired word as a regular expression, and what is written instead. A row names only the folders
where the word had the retired meaning, because the same word may be right elsewhere. The changelog keeps all of them.
"""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent
ALL = "rust python tests evaluation benches docs ros README.md CONTRIBUTING.md"
CORE = "rust/core rust/python"
TRACKER = "rust/core/src/tracker python/ttc_fast/reference/tracker docs/tracking.md"
CLOUD = (
    "rust/core/src/cloud rust/core/src/alignment python/ttc_fast/reference/cloud python/ttc_fast/reference/alignment"
)
ROAD = "rust/core/src/road python/ttc_fast/reference/road.py"
BRAKE = (
    "python/ttc_fast/brake python/ttc_fast/replay tests/brake tests/replay "
    "docs/braking.md docs/closed_loop.md docs/racing.md"
)
REPLAY = "python/ttc_fast/replay tests/replay"
LOGS = "python/ttc_fast/logs tests/logs"

RETIRED = [
    (ALL, r"surpris\w+", "innovation"),
    (ALL, r"whiteness", "InnovationCorrelation"),
    (TRACKER, r"\bwanders?\b(?! (by|up))", "process noise"),
    (TRACKER, r"\brivals?\b", "a tentative track"),
    (TRACKER, r"(struct|class) Standing\b", "StationaryTest"),
    (TRACKER, r"(struct|class) Measured\b", "Measurement"),
    (BRAKE, r"\beyes\b|\blook_along\b", "ThreatAssessment, assess_along, pipeline"),
    (BRAKE, r"\bscene\b|\bsight\b|\blooks\b\(", "Threats, Threat, Needs"),
    (BRAKE, r"\bjudgements?\b|\bjudge\(|\btighter\b", "Evaluation, evaluate, more_urgent_than"),
    (BRAKE, r"\bonward\b|second.opinion\b|\bwish\b", "continued_motion, estimate, commanded"),
    (BRAKE, r"\bVoteRule\b|\.cast\(|\.carried\b", "NOfM.push, NOfM.reached"),
    (REPLAY, r"\bwitness\b|\bguilty\b|\blone\b", "the decision, threatening, isolated"),
    (CLOUD, r"\b(struct|class|mod) (Kept|Rest|Shrinking|Sieve)\b", "CandidateBuffer, NonBoxGate, two_frame, prefilter"),
    (CLOUD, r"\b(Witnesses|weigh|lean)\b", "CellObservations, irls_weights, slope"),
    (ROAD, r"\b(stacks|elect)\b", "columns, hough_vote"),
    (CORE, r"\b(Asked|Prepared|Census)\b|struct Exact\b", "BeamQuery, KernelTables, CountReadings, ExactBeams"),
    (CORE, r"fn (meaning|wide|of)\b(?=<F: Real)|\bundecided\b|struct Best\b", "finish_ttc, to_f64, borderline, Hit"),
    (LOGS, r"(class|import) Recording\b|\bLosses\b", "LogOptions, ReadErrors"),
    ("python/ttc_fast/ros", r"\brefusals\b|\bpauses\b", "what the API reports"),
]


def hits(folders: str, pattern: str) -> list[str]:
    """Return what git finds: file, line and the word. Names in capitals are looked for as they are."""
    flags = [] if re.search(r"[A-Z]", pattern) else ["--ignore-case"]
    command = ["git", "grep", "-noP", *flags, pattern, "--", *folders.split(), ":!*.csv", ":!*.json"]
    found = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if found.returncode > 1:
        raise SystemExit(found.stderr)
    return found.stdout.splitlines()


left = [f"{hit}: write {instead}" for folders, pattern, instead in RETIRED for hit in hits(folders, pattern)]
print("\n".join(left), end="\n" if left else "")
sys.exit(bool(left))
