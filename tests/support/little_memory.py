"""Calls in a process that cannot have a copy of their input: address space is limited to what is in use."""

from __future__ import annotations

import ctypes
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from multiprocessing.connection import Connection

M_MMAP_THRESHOLD = -3  # of glibc's malloc.h


def call_each(progress: Connection, calls: Iterable[tuple[Any, int, Callable[[], object]]]) -> None:
    """Make each of the calls (name, bytes of a copy, call) where half of these bytes are free.

    Before each call its name is sent, with whether ``malloc`` of a copy was refused: that is the control.
    """
    import resource

    libc = ctypes.CDLL(None)
    libc.malloc.restype = ctypes.c_void_p
    libc.mallopt(M_MMAP_THRESHOLD, 1 << 17)  # what is freed goes back at once, and cannot serve a copy
    for name, size, call in calls:
        with open("/proc/self/statm") as statm:
            used = int(statm.read().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + size // 2, resource.RLIM_INFINITY))
        refused = libc.malloc(size) is None
        progress.send((*name, refused))
        call()
        resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
