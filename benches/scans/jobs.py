"""The questions about scans, and the two ways to ask each: by the library's names, or by a function and its tables."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Job:
    """One question."""

    name: str
    library: str
    """Asked of ``ttc_fast`` and its reference."""
    function: str
    """Asked of ``by_numpy``, and of ``by_numba`` where it has such a function."""
    arguments: str
    """Of that function."""
    exact: str
    """The time of each beam, in the words of ``by_numpy``."""
    every_beam: bool = False
    """Whether the answer has a time for each beam, or only the least."""


_STRAIGHT = "ranges, speed, cosines, offsets"
_BATCH = "ranges, speeds, cosines, offsets"
_EXACT = f"per_beam({_STRAIGHT})"
_EXACT_BATCH = f"per_beam_each({_BATCH})"

MIN = Job("min", "scan.min(ranges, speed)", "least", _STRAIGHT, _EXACT)
TURNING = Job(
    "min, turning",
    "scan.min(ranges, speed, yaw_rate)",
    "least_turning",
    "ranges, speed, sideways, cosines, sines, offsets",
    "times(ranges, speed * cosines + sideways * sines, offsets)",
)
NEAREST_TURNING = Job(
    "nearest, turning",
    "scan.nearest(ranges, speed, yaw_rate)",
    "nearest_turning",
    TURNING.arguments,
    TURNING.exact,
)
NEAREST = Job("nearest", "scan.nearest(ranges, speed)", "nearest", _STRAIGHT, _EXACT)
PER_BEAM = Job("per_beam", "scan.per_beam(ranges, speed, out=out)", "per_beam", _STRAIGHT, _EXACT, every_beam=True)
ITTC = Job(
    "ittc",
    "ittc(ranges, closing_speed=closing, out=out)",
    "ittc",
    "ranges, closing",
    "ittc(ranges, closing)",
    every_beam=True,
)
MIN_BATCH = Job("min", "scan.min(ranges, speeds)", "least_each", _BATCH, _EXACT_BATCH)
NEAREST_BATCH = Job("nearest", "scan.nearest(ranges, speeds)", "nearest_each", _BATCH, _EXACT_BATCH)
PER_BEAM_BATCH = Job(
    "per_beam", "scan.per_beam(ranges, speeds, out=out)", "per_beam_each", _BATCH, _EXACT_BATCH, every_beam=True
)
