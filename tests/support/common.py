"""What tests of every kind share: the car, both modules, both dtypes, and the memory of a call."""

from __future__ import annotations

import multiprocessing
import os
import platform
import signal
import tracemalloc
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import settings

import ttc_fast
from ttc_fast import reference

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from multiprocessing.connection import Connection
    from types import FrameType

LEVELS = ["neon"] if platform.machine() in ("aarch64", "arm64") else ["baseline", "avx2", "avx512"]
"""The instruction-set levels of the processor's family, the lowest first."""

LOWER = LEVELS[: LEVELS.index(ttc_fast.SIMD_LEVEL)]
"""Those below the level at which the kernels run here."""

CAR = (-0.1, 0.4, -0.15, 0.15)
"""x_rear, x_front, y_right, y_left, m: a car of 0.5 m by 0.3 m, its origin 0.4 m behind the bumper."""

MODULES = {"kernel": ttc_fast, "reference": reference}
every_module = pytest.mark.parametrize("module", MODULES.values(), ids=MODULES)
both_dtypes = pytest.mark.parametrize("dtype", [np.float32, np.float64])


EXAMPLES = float(os.environ.get("TTC_FAST_EXAMPLES", "0.25"))
"""The share of the random inputs that a run draws; `make test-all` and `make fuzz` draw them all."""


def examples(number: int) -> settings:
    """Let Hypothesis draw this many inputs where all are drawn, and a share of them else."""
    return settings(max_examples=max(1, round(number * EXAMPLES)))


def peak_of(call: Callable[[], Any]) -> int:
    """Return the most bytes that NumPy and Python had at once during a call, beside those from before it."""
    tracemalloc.start()
    try:
        call()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


can_interrupt = pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="needs a timer that interrupts")


@contextmanager
def interrupted_after(seconds: float) -> Iterator[None]:
    """Raise KeyboardInterrupt after some seconds, as Ctrl-C does."""

    def interrupt(_number: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def reports(target: Callable[[Connection], None]) -> tuple[list[Any], int | None]:
    """Return what ``target`` sends from a process of its own, and the exit code of that process."""
    receiver, sender = multiprocessing.Pipe(duplex=False)
    process = multiprocessing.get_context("spawn").Process(target=target, args=(sender,))
    process.start()
    sender.close()
    seen = []
    try:
        while True:
            seen.append(receiver.recv())
    except EOFError:
        process.join()
    return seen, process.exitcode
