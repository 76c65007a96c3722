"""``native.cpp``, compiled when it is asked for: bare reads and copies, a C++ loop and prototypes, by ctypes."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import ttc_fast
from benches.case import Implementation

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

COMMAND = ("g++", "-O3", "-march=native", "-shared", "-fPIC")
READ, COPY, CPP, PROTOTYPE = "bare read", "bare copy", "C++", "prototype"
ROUNDS = 16
"""How often a prototype goes through its inputs in a call, so that hardly any of the time is the call itself."""
AVAILABLE = shutil.which(COMMAND[0]) is not None
HAS_MEDIAN = AVAILABLE and ttc_fast.SIMD_LEVEL == "avx512"
"""Whether there is a prototype of the median, which is for one level only."""


@lru_cache(maxsize=1)
def library() -> ctypes.CDLL:
    """Compile and load ``native.cpp``."""
    with tempfile.TemporaryDirectory() as folder:
        built = Path(folder) / "native.so"
        subprocess.run([*COMMAND, str(Path(__file__).with_suffix(".cpp")), "-o", str(built)], check=True)
        native = ctypes.CDLL(str(built))
    native.bare_read.argtypes = (ctypes.c_void_p, ctypes.c_size_t)
    native.bare_read.restype = ctypes.c_uint8
    native.copy.argtypes = (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t)
    native.copy.restype = None
    native.least_keys.argtypes = (
        *(ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int32, ctypes.c_void_p),
        *(ctypes.c_float, ctypes.c_float, ctypes.c_size_t, ctypes.c_void_p),
    )
    native.least_keys.restype = None
    if HAS_MEDIAN:
        native.median_ratios.argtypes = (
            *(ctypes.c_void_p, ctypes.c_size_t, ctypes.c_size_t),
            *(ctypes.c_float, ctypes.c_size_t, ctypes.c_void_p),
        )
        native.median_ratios.restype = None
    native.kth_smallest.argtypes = (ctypes.c_void_p, ctypes.c_size_t, ctypes.c_size_t, ctypes.c_void_p)
    native.kth_smallest.restype = ctypes.c_float
    return native


def bare(nbytes: int, *, copies: bool = False) -> dict[str, Callable[[], Implementation]]:
    """Return the bare read of an input, or its bare copy, by name; nothing without a compiler."""
    if not AVAILABLE:
        return {}
    return {COPY: lambda: bare_copy(nbytes)} if copies else {READ: lambda: bare_read(nbytes)}


def bare_read(nbytes: int) -> Implementation:
    """Read every byte of an input, and do next to nothing else."""
    names = {"bare_read": library().bare_read, "nbytes": nbytes}
    return Implementation("bare_read(ranges, nbytes)", names, prepare=address, verify=_is_every_byte)


def bare_copy(nbytes: int) -> Implementation:
    """Read every byte of an input and write as many."""
    out = np.empty(nbytes, np.uint8)

    def is_copy(data: NDArray[Any], _: Any) -> bool:
        return data.tobytes() == out.tobytes()

    names = {"copy": library().copy, "out": address(out), "nbytes": nbytes}
    return Implementation("copy(ranges, out, nbytes)", names, prepare=address, verify=is_copy)


def least_keys(scans: int, cosines: NDArray[np.float64], low: float, high: float) -> Implementation:
    """Find the least range / cosine of each of some scans, and its beam, ``ROUNDS`` times."""
    with np.errstate(divide="ignore"):
        inverses = np.where(cosines > 0.0, 1.0 / cosines, np.inf).astype(np.float32)
    out = np.empty(scans, np.dtype([("key", np.float32), ("beam", np.int32)]))

    def is_least(data: NDArray[Any], _: Any) -> bool:
        keys = np.where((data >= np.float32(low)) & (data <= np.float32(high)), data * inverses, np.inf)
        return bool((keys.argmin(1) == out["beam"]).all() and (keys.min(1) == out["key"]).all())

    names = {"least_keys": library().least_keys, "inverses": address(inverses), "out": address(out), "kept": inverses}
    names |= {"scans": scans, "beams": len(cosines), "low": low, "high": high, "rounds": ROUNDS}
    call = "least_keys(ranges, scans, beams, inverses, low, high, rounds, out)"
    return Implementation(call, names, prepare=address, verify=is_least)


def median_ratios(scales: Sequence[float], count: int, least: float) -> Implementation:
    """Find the median ratio of each picture of ``count`` matches, ``ROUNDS`` times; right if they are the scales."""
    out = np.empty(len(scales))

    def is_median(_: NDArray[Any], __: Any) -> bool:
        return np.allclose(out, scales, rtol=1e-6, atol=0.0)

    names = {"median_ratios": library().median_ratios, "out": address(out), "kept": out}
    names |= {"pictures": len(scales), "count": count, "least": least, "rounds": ROUNDS}
    call = "median_ratios(matches, pictures, count, least, rounds, out)"
    return Implementation(call, names, "matches", prepare=address, verify=is_median)


def address(array: NDArray[Any]) -> int:
    """Return where a contiguous array begins."""
    assert array.flags.c_contiguous
    return array.ctypes.data


def _is_every_byte(data: NDArray[Any], answer: int) -> bool:
    return answer == int(np.bitwise_or.reduce(np.frombuffer(data.tobytes(), np.uint8)))
