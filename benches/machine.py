"""The machine that times were taken on, without saying whose it is."""

from __future__ import annotations

import os
import platform
from pathlib import Path

import numba
import numpy as np

import ttc_fast
from ttc_fast._core import BUILD_PROFILE


def require_release() -> None:
    """Exit unless the kernels are a release build: times of another one say nothing about wheels."""
    if BUILD_PROFILE != "release":
        raise SystemExit(f"the kernels are a {BUILD_PROFILE} build; make bench installs and measures a release")


def describe() -> dict[str, str]:
    """Return processor and versions; no host name and no path."""
    return {
        "processor": _processor(),
        "caches": ", ".join(f"{name} {size >> 10} KiB" for name, size in caches().items()) or "unknown",
        "level": ttc_fast.SIMD_LEVEL,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "numba": numba.__version__,
    }


def caches() -> dict[str, int]:
    """Return the sizes of the data caches that one core sees, bytes; empty where the system does not tell."""
    found = {}
    for index in sorted(Path("/sys/devices/system/cpu/cpu0/cache").glob("index*")):
        level, kind, size = ((index / name).read_text(encoding="ascii").strip() for name in ("level", "type", "size"))
        if kind != "Instruction" and size.endswith("K"):
            found[f"L{level}"] = int(size[:-1]) << 10
    return found


def _processor() -> str:
    """Return its model name where the system tells, and the number of cores."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    model = models[0] if models else platform.processor() or platform.machine()
    return f"{model}, {platform.machine()}, {os.cpu_count()} cores"


def sentence() -> str:
    """Return the description as a sentence."""
    described = ", ".join(f"{name} {value}" for name, value in describe().items())
    return f"Measured on: {described}; load {os.getloadavg()[2]:.1f} in the last 15 minutes."
