"""``ScanTTC`` against the NumPy reference, in one process and in turns, with their answers compared first."""

from __future__ import annotations

import time
from statistics import median
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from rich.table import Table

from ttc_fast import SIMD_LEVEL, ScanTTC, reference

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray
    from rich.console import Console

MOTION = (3.0, 0.2)  # m/s and rad/s
METHODS = ("min", "nearest", "per_beam")
RTOL = 1e-6  # of per_beam, which is computed in float32
TURN = 5e-3  # s that one side gets before the other's turn


class AnswersDifferError(Exception):
    """The kernels and the reference disagree, so that their times mean nothing."""


class Timing(NamedTuple):
    """Medians over all turns of one method, s a call."""

    method: str
    fast: float
    reference: float


def compare(beams: int = 1080, rounds: int = 50) -> list[Timing]:
    """Check the answers, then time both sides in turns, so that a busy machine slows both alike.

    Parameters
    ----------
    beams : int
        Of a float32 scan over 270 degrees.
    rounds : int
        Turns for each side.

    Returns
    -------
    list of Timing
        For each of ``METHODS``.

    Raises
    ------
    AnswersDifferError
        If the two sides disagree.
    """
    ranges = _scan(beams)
    setting: dict[str, Any] = {
        "range_min": 0.06,
        "range_max": 30.0,
        "mount": (0.27, 0.0, 0.0),
        "outline": (-0.1, 0.4, -0.15, 0.15),
    }
    angles = (-0.75 * np.pi, 1.5 * np.pi / beams, beams)
    fast, slow = ScanTTC(*angles, **setting), reference.ScanTTC(*angles, **setting)
    _check(fast, slow, ranges)
    return [_time(name, getattr(fast, name), getattr(slow, name), ranges, rounds) for name in METHODS]


def report(timings: list[Timing], beams: int, console: Console) -> None:
    """Print the times as a table.

    Parameters
    ----------
    timings : list of Timing
        What ``compare`` gave.
    beams : int
        Of each scan.
    console : Console
        Where to.
    """
    table = Table(box=None, header_style="bold", pad_edge=False)
    table.add_column("ScanTTC")
    for name in ("ttc_fast", "reference", "ratio", "beams/s"):
        table.add_column(name, justify="right")
    for method, fast, slow in timings:
        times = (f"{1e6 * fast:.2f} µs", f"{1e6 * slow:.1f} µs")
        table.add_row(f".{method}", *times, f"{slow / fast:.0f} x", f"{beams / fast / 1e6:.0f} M")
    console.print(f"{beams} float32 beams, whole Python calls, kernels: {SIMD_LEVEL}, NumPy {np.__version__}")
    console.print(table)
    console.print("medians, both sides in turns; the answers were compared and agree")


def _scan(beams: int) -> NDArray[np.float32]:
    """Make a scan with every kind of reading; seeded, so that every run times the same one."""
    rng = np.random.default_rng(1)
    ranges = rng.uniform(1.0, 12.0, beams).astype(np.float32)
    kind = rng.random(beams)
    ranges[kind < 0.05] = np.inf
    ranges[(kind >= 0.05) & (kind < 0.07)] = np.nan
    ranges[(kind >= 0.07) & (kind < 0.08)] = 0.01
    return ranges


def _check(fast: ScanTTC, slow: reference.ScanTTC, ranges: NDArray[np.float32]) -> None:
    near, far = fast.nearest(ranges, *MOTION), slow.nearest(ranges, *MOTION)
    status, expected_status = np.empty((2, len(ranges)), np.uint8)
    per_beam = fast.per_beam(ranges, *MOTION, status_out=status)
    expected = slow.per_beam(ranges, *MOTION, status_out=expected_status)
    agree = {
        "min": fast.min(ranges, *MOTION) == slow.min(ranges, *MOTION),
        "nearest": (near.ttc, near.status, near.beam) == (far.ttc, far.status, far.beam),
        "per_beam": np.allclose(per_beam, expected, rtol=RTOL, atol=0.0) and np.array_equal(status, expected_status),
    }
    wrong = [name for name, same in agree.items() if not same]
    if wrong:
        raise AnswersDifferError(
            f"ScanTTC.{', .'.join(wrong)} and the reference give different answers; please report it"
        )


def _time(
    method: str, fast: Callable[..., Any], slow: Callable[..., Any], ranges: NDArray[np.float32], rounds: int
) -> Timing:
    sides = (fast, slow)
    calls = [max(1, round(TURN / max(_turn(side, ranges, 3), 1e-7))) for side in sides]
    turns = [[_turn(side, ranges, many) for side, many in zip(sides, calls, strict=True)] for _ in range(rounds)]
    return Timing(method, *(median(times) for times in zip(*turns, strict=True)))


def _turn(call: Callable[..., Any], ranges: NDArray[np.float32], calls: int) -> float:
    """Call so many times, and return the seconds of one."""
    speed, yaw_rate = MOTION
    start = time.perf_counter()
    for _ in range(calls):
        call(ranges, speed, yaw_rate)
    return (time.perf_counter() - start) / calls
