"""The kernels are timed against the NumPy reference, in one process and in turns, after their answers are compared."""

from __future__ import annotations

import time
from statistics import median
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

import ttc_fast
from ttc_fast import SIMD_LEVEL, Gate, KthSmallest, reference
from ttc_fast._core import BUILD_PROFILE

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray
    from rich.console import Console

MOTION = (3.0, 0.2)  # m/s and rad/s
METHODS = ("min", "nearest", "per_beam")
SMALL_CAR: dict[str, Any] = {
    "range_min": 0.06,
    "range_max": 30.0,
    "mount": (0.27, 0.0, 0.0),
    "outline": (-0.1, 0.4, -0.15, 0.15),
}
"""The scanner of a small car: arguments of ``ScanTTC``, for the tests of ``ttc-fast doctor`` as well."""
CLOUD = {"gate": Gate(x=(2.0, 60.0), z=(-1.5, 0.3)), "estimator": KthSmallest(20)}
RTOL = 1e-6  # between the answers of per_beam, which is computed in float32
TURN = 5e-3  # s that one side gets before the other's turn


class AnswersDifferError(Exception):
    """The kernels and the reference disagree, so that their times mean nothing."""


class Case(NamedTuple):
    """One call of both sides.

    Attributes
    ----------
    name : str
        What is called.
    fast, reference : callable
        The call, without arguments.
    size : int
        Number of beams or points of the input.
    agree : bool
        Whether both sides gave the same answer.
    """

    name: str
    fast: Callable[[], Any]
    reference: Callable[[], Any]
    size: int
    agree: bool


class Timing(NamedTuple):
    """The times of one call.

    Attributes
    ----------
    name : str
        What is called.
    fast, reference : float
        The median over all turns of each side, s.
    size : int
        Number of beams or points of the input.
    """

    name: str
    fast: float
    reference: float
    size: int


def compare(beams: int = 1080, points: int = 100_000, rounds: int = 50) -> list[Timing]:
    """Check the answers, then time both sides in turns, so that a busy machine slows both alike.

    Parameters
    ----------
    beams : int
        Number of beams of a float32 scan over 270 degrees.
    points : int
        Number of points of a float32 cloud.
    rounds : int
        Number of turns of each side.

    Returns
    -------
    list of Timing
        One for each of ``METHODS`` of ``ScanTTC``, and one for ``robust_min_x``.

    Raises
    ------
    AnswersDifferError
        If the two sides disagree.
    """
    cases = [*_scan_cases(beams), _cloud_case(points)]
    wrong = [case.name for case in cases if not case.agree]
    if wrong:
        raise AnswersDifferError(f"{', '.join(wrong)} and the reference give different answers; please report it")
    return [_time(case, rounds) for case in cases]


def report(timings: list[Timing], console: Console) -> None:
    """Print the times as a table.

    Parameters
    ----------
    timings : list of Timing
        The result of ``compare``.
    console : Console
        Where the table is printed.
    """
    from rich.table import Table

    table = Table(box=None, header_style="bold", pad_edge=False)
    table.add_column("")
    for name in ("input", "ttc_fast", "reference", "ratio", "a second"):
        table.add_column(name, justify="right")
    for name, fast, slow, size in timings:
        times = (f"{1e6 * fast:.2f} µs", f"{1e6 * slow:.1f} µs")
        table.add_row(name, str(size), *times, f"{slow / fast:.0f} x", f"{size / fast / 1e6:.0f} M")
    build = "" if BUILD_PROFILE == "release" else f" ({BUILD_PROFILE} build, slower than a release)"
    console.print(f"float32 beams or points, whole Python calls, kernels: {SIMD_LEVEL}{build}, NumPy {np.__version__}")
    console.print(table)
    console.print("medians, both sides in turns; the answers were compared and agree")


def _scan_cases(beams: int) -> Iterator[Case]:
    ranges = _scan(beams)
    angles = (-0.75 * np.pi, 1.5 * np.pi / beams, beams)
    fast, slow = ttc_fast.ScanTTC(*angles, **SMALL_CAR), reference.ScanTTC(*angles, **SMALL_CAR)
    for method, agree in _agreement(fast, slow, ranges).items():
        kernel, specified = (_call(getattr(side, method), ranges, *MOTION) for side in (fast, slow))
        yield Case(f"ScanTTC.{method}", kernel, specified, beams, agree)


def _agreement(fast: ttc_fast.ScanTTC, slow: reference.ScanTTC, ranges: NDArray[np.float32]) -> dict[str, bool]:
    """Return whether the two sides agree, for each of ``METHODS``."""
    near, far = fast.nearest(ranges, *MOTION), slow.nearest(ranges, *MOTION)
    status, expected_status = np.empty((2, len(ranges)), np.uint8)
    per_beam = fast.per_beam(ranges, *MOTION, status_out=status)
    expected = slow.per_beam(ranges, *MOTION, status_out=expected_status)
    close = np.allclose(per_beam, expected, rtol=RTOL, atol=0.0)
    answers = (
        fast.min(ranges, *MOTION) == slow.min(ranges, *MOTION),
        (near.ttc, near.status, near.beam) == (far.ttc, far.status, far.beam),
        close and np.array_equal(status, expected_status),
    )
    return dict(zip(METHODS, answers, strict=True))


def _cloud_case(points: int) -> Case:
    cloud = _cloud(points)
    fast, slow = (_call(side.robust_min_x, cloud, **CLOUD) for side in (ttc_fast, reference))
    found, expected = fast(), slow()
    agree = (found.index, found.detection) == (expected.index, expected.detection)
    return Case("robust_min_x", fast, slow, points, agree and np.array_equal(found.x, expected.x, equal_nan=True))


def _call(function: Callable[..., Any], *arguments: Any, **settings: Any) -> Callable[[], Any]:
    return lambda: function(*arguments, **settings)


def _scan(beams: int) -> NDArray[np.float32]:
    """Return a scan with every kind of reading; it is seeded, so that every run times the same one."""
    rng = np.random.default_rng(1)
    ranges = rng.uniform(1.0, 12.0, beams).astype(np.float32)
    kind = rng.random(beams)
    ranges[kind < 0.05] = np.inf
    ranges[(kind >= 0.05) & (kind < 0.07)] = np.nan
    ranges[(kind >= 0.07) & (kind < 0.08)] = 0.01
    return ranges


def _cloud(points: int) -> NDArray[np.float32]:
    """Return rows of x, y, z, intensity all around, on the road and above it; they are seeded as well."""
    rng = np.random.default_rng(1)
    angle, distance = rng.uniform(-np.pi, np.pi, points), rng.uniform(2.5, 60.0, points)
    x, y = distance * np.cos(angle), distance * np.sin(angle)
    z = np.where(rng.random(points) < 0.5, -1.7, rng.uniform(-1.7, 2.0, points))
    return np.column_stack([x, y, z, rng.random(points)]).astype(np.float32)


def _time(case: Case, rounds: int) -> Timing:
    sides = (case.fast, case.reference)
    calls = [max(1, round(TURN / max(_turn(side, 3), 1e-7))) for side in sides]
    turns = [[_turn(side, many) for side, many in zip(sides, calls, strict=True)] for _ in range(rounds)]
    fast, slow = (median(times) for times in zip(*turns, strict=True))
    return Timing(case.name, fast, slow, case.size)


def _turn(call: Callable[[], Any], calls: int) -> float:
    """Return the time of one of several calls, s."""
    start = time.perf_counter()
    for _ in range(calls):
        call()
    return (time.perf_counter() - start) / calls
