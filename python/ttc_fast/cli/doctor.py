"""``ttc-fast doctor``: what is installed on which processor, and whether the kernels answer as their reference does."""

from __future__ import annotations

import dataclasses
import importlib.metadata
import math
import os
import platform
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import ttc_fast
from ttc_fast import _core, reference
from ttc_fast._core import BUILD_PROFILE
from ttc_fast._exit_codes import FAILED
from ttc_fast._extras import CHECKOUT, DISTRIBUTIONS, EXTRAS, build_again
from ttc_fast.bench import SMALL_CAR
from ttc_fast.cli.exits import CommandError

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Iterator

    Answers = Callable[[Any], Any]

SUMMARY = "say what is installed, and test each kernel against the reference in about a second"
DESCRIPTION = """\
  ttc-fast doctor

Print the versions, the processor, the instruction-set level of the kernels and the extras that are installed, and test
each kernel against the NumPy reference. A report of a problem should hold this output. The exit code is 1 if a kernel
and the reference disagree.
"""
COMMON = ()

RTOL = 1e-5
"""Sums, and what is computed in float32, may differ from the reference by rounding, which is far less."""

BEAMS, MATCHES, POINTS = 360, 40, 1000


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare no options."""


def run(arguments: argparse.Namespace) -> None:
    """Print, and fail if a kernel is wrong."""
    width = 12
    for name, value in described().items():
        print(f"{name:{width}} {value}")
    tests = self_tests()
    wrong = [name for name, answers in tests.items() if not agrees(answers)]
    print(f"{'self-test':{width}} {len(tests) - len(wrong)} of {len(tests)} kernels agree with the reference")
    if wrong:
        raise CommandError(FAILED, f"{', '.join(wrong)} and the reference give different answers; please report it")


def described() -> dict[str, str]:
    """Return what a report of a problem should say about the machine, without names of hosts, users or folders."""
    gil = "" if getattr(sys, "_is_gil_enabled", lambda: True)() else ", without the GIL"
    return {
        "ttc-fast": f"{ttc_fast.__version__}, {BUILD_PROFILE} build{_older_than_sources()}",
        "python": f"{platform.python_implementation()} {platform.python_version()}{gil}",
        "numpy": np.__version__,
        "system": f"{platform.system()} {platform.release()}, {' '.join(platform.libc_ver()) or 'unknown C library'}",
        "processor": f"{_processor()}, {platform.machine()}, {os.cpu_count()} cores",
        "SIMD level": ttc_fast.SIMD_LEVEL + (" (TTC_FAST_SIMD is set)" if "TTC_FAST_SIMD" in os.environ else ""),
        **{f"[{extra}]": state for extra, state in extras().items()},
    }


def _older_than_sources() -> str:
    """Return what to do where the compiled part is older than the Rust sources beside it, else nothing."""
    changed = max((each.stat().st_mtime for each in CHECKOUT.glob("rust/**/*.rs")), default=0.0)
    return f", older than its Rust sources: {build_again()}" if Path(_core.__file__).stat().st_mtime < changed else ""


def _processor() -> str:
    """Return its name where the system tells; a Jetson's kernel names the board instead."""
    for path, pattern in (("/proc/cpuinfo", r"^model name\s*: (.*)$"), ("/proc/device-tree/model", r"^([^\0]*)")):
        if Path(path).exists():
            found = re.search(pattern, Path(path).read_text("utf-8", "replace"), re.MULTILINE)
            if found:
                return found[1]
    return platform.processor() or "unknown processor"


def extras() -> dict[str, str]:
    """Return which packages of each extra are installed, with their versions, and which are missing."""
    names = sorted(set(EXTRAS.values()))
    return {name: ", ".join(_version(package) for package, extra in EXTRAS.items() if extra == name) for name in names}


def _version(package: str) -> str:
    name = DISTRIBUTIONS.get(package, package)
    try:
        return f"{package} {importlib.metadata.version(name)}"
    except importlib.metadata.PackageNotFoundError:
        return f"{package} missing"


def self_tests() -> dict[str, Answers]:
    """Return a test of each kernel: what it answers, of the kernels or of the reference, whose module it is given."""
    random = np.random.default_rng(1)
    ranges = random.uniform(0.5, 20.0, (3, BEAMS)).astype(np.float32)
    ranges[random.random(ranges.shape) < 0.1] = math.nan
    cloud = random.uniform((1.0, -3.0, -1.5, 0.0), (40.0, 3.0, 0.5, 1.0), (POINTS, 4)).astype(np.float32)
    road = cloud[:, :3] * (1.0, 2.0, 0.02) + (0.0, 0.0, -1.7)
    pixels = random.uniform(0.0, 1000.0, (MATCHES, 2))
    grown = 1.05 * pixels + random.normal(0.0, 0.1, pixels.shape)
    speeds = random.uniform(-3.0, 10.0, BEAMS)
    estimators = [
        ttc_fast.Minimum(),
        ttc_fast.KthSmallest(10),
        ttc_fast.Quantile(0.05),
        ttc_fast.MeanOfLowest(10),
        ttc_fast.InterquartileFence(1.5),
        ttc_fast.Supported(5, 0.5),
        ttc_fast.Cluster(0.6, 5),
    ]

    def scanner(module: Any, **settings: Any) -> Any:
        return module.ScanTTC(-0.75 * math.pi, 1.5 * math.pi / BEAMS, BEAMS, **SMALL_CAR, **settings)

    def beams(module: Any) -> Iterator[Any]:
        for scan in (scanner(module), scanner(module, minimum=ttc_fast.KthSmallest(3))):
            for precise in (ranges, ranges.astype(np.float64)):
                yield scan.min(precise, 3.0, 0.2), scan.nearest(precise[0], 3.0, 0.2), scan.per_beam(precise, 3.0, 0.2)

    def swept(module: Any) -> Any:
        path, scan = module.SweptPath(SMALL_CAR["outline"]), module.ScanSweptPath(scanner(module))
        way = (
            path.min(cloud[:, :2], 3.0, 0.2),
            path.nearest(cloud[:, :2], 3.0, 0.2),
            path.per_point(cloud[:, :2], 3.0, 0.2),
        )
        return *way, scan.min(ranges, 3.0, 0.2), scan.nearest(ranges[0], 3.0, 0.2)

    def rates(module: Any) -> Any:
        rate = module.RangeRate(scanner(module))
        return [rate.update(ranges[0] - 0.3 * frame, 0.1 * frame) for frame in range(6)]

    def clouds(module: Any) -> Any:
        gate = ttc_fast.Gate(x=(2.0, 30.0), z=(-1.0, 0.3), intensity=(0.1, 1.0))
        return [
            answer
            for each in estimators
            for answer in (
                module.robust_min_x(cloud, gate=gate, estimator=each),
                module.ttc_from_clouds(cloud, cloud - np.float32(0.5), 0.1, gate=ttc_fast.Gate(), estimator=each),
            )
        ]

    def body(module: Any) -> Any:
        tracker = module.CloudTracker(ttc_fast.Gate(y=(-1.0, 1.0)))
        return [tracker.update(cloud[:300, :3] / (20, 3, 3) + (12 - frame, 0, 0), 0.1 * frame) for frame in range(5)]

    def distances(module: Any) -> Any:
        trackers = [module.DistanceTracker(), module.DistanceTracker(ttc_fast.SlidingLine(0.5))]
        return [each.update(20 - 0.5 * k + 0.01 * speeds[k], 0.1 * k) for each in trackers for k in range(20)]

    def scales(module: Any) -> Any:
        tracker = module.ScaleTracker()
        measured = [(1.02 + 1e-4 * speeds[k], 0.1 * k, 1e-3, 9.0 - 0.2 * k if k % 3 else None) for k in range(20)]
        return [
            tracker.update(scale, stamp, spread, distance=distance, distance_noise=0.1)
            for scale, stamp, spread, distance in measured
        ]

    def keypoints(module: Any) -> Any:
        chosen = (ttc_fast.MedianRatio(), ttc_fast.TrimmedMeanRatio(0.1), ttc_fast.LeastSquares(), ttc_fast.Consensus())
        of_pixels = [module.ttc_from_keypoints(pixels, grown, 0.1, estimator=each) for each in chosen]
        return *of_pixels, module.ttc_from_heights(1.0, 1.05, 0.1), module.ttc_from_scale(1.05, 0.1)

    def formulae(module: Any) -> Any:
        near, fast = np.abs(speeds) + 1.0, {"closing_speed": speeds}
        limits = {"response_time": 0.5, "acceleration_max": 2.0, "braking_min": 4.0, "braking_max": 8.0}
        return (
            module.ttc_constant_velocity(near, **fast),
            module.ttc_constant_acceleration(near, **fast, closing_acceleration=-0.5),
            module.time_headway(near, speed=speeds),
            module.deceleration_to_avoid_crash(near, **fast),
            module.stopping_distance(speeds, deceleration=6.0, reaction_time=0.2),
            module.rss_longitudinal_distance(near, near[::-1], **limits),
            module.ttc_from_distances(20.0, 19.0, 0.1),
        )

    return {
        "ScanTTC": lambda module: list(beams(module)),
        "ittc": lambda module: module.ittc(ranges[0], closing_speed=speeds),
        "SweptPath": swept,
        "RangeRate": rates,
        "robust_min_x": clouds,
        "CloudTracker": body,
        "fit_road": lambda module: module.fit_road(road),
        "DistanceTracker": distances,
        "ScaleTracker": scales,
        "ttc_from_keypoints": keypoints,
        "the formulae of motion": formulae,
    }


def agrees(answers: Answers) -> bool:
    """Whether the kernels and the reference say the same, but for rounding; a kernel that raises does not."""
    expected = answers(reference)
    try:
        return _alike(answers(ttc_fast), expected)
    except Exception:
        return False


def _alike(one: Any, other: Any) -> bool:
    """Compare numbers, arrays and sequences of them, and results by the fields that the reference's have."""
    if dataclasses.is_dataclass(other):
        return all(_alike(getattr(one, each.name), getattr(other, each.name)) for each in dataclasses.fields(other))
    if isinstance(other, (tuple, list)):
        return len(one) == len(other) and all(map(_alike, one, other))
    if one is None or other is None or isinstance(other, str):
        return bool(one == other)
    if isinstance(other, ttc_fast.Road):
        one, other = ((road.slope_x, road.slope_y, road.offset) for road in (one, other))
    return np.allclose(one, other, rtol=RTOL, atol=RTOL, equal_nan=True)
