"""Where the logs of ``replay_many`` are replayed: the processes of this machine, or the workers of a Dask scheduler.

Both have the interface of ``concurrent.futures.Executor``, and so does ``client.get_executor()`` of a Dask client that
the caller has. What ``replay_many`` asks of an executor is small: ``submit`` gives a future; a future whose process is
gone raises or is cancelled; ``submit`` raises when no more can be done.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable
    from multiprocessing.connection import Connection

GRACE = 10.0
"""s for which a process may clear up."""
PATIENCE = 600.0
"""s for which a scheduler that is gone is waited for."""


class WorkerLostError(RuntimeError):
    """The process that replayed a log ended before it was done."""


class Processes(Executor):
    """Processes of this machine, each of which does one thing at a time.

    A thread looks after each process, and starts another one where it is killed. So a process that is killed, perhaps
    because memory ran out, takes its own task with it and no other, and it is known which.

    Parameters
    ----------
    jobs : int or None
        How many processes there are at most; None is one for each core.
    """

    def __init__(self, jobs: int | None = None) -> None:
        self._threads = ThreadPoolExecutor(jobs or os.cpu_count() or 1, "replay")
        self._own = threading.local()
        self._processes: dict[Any, Connection] = {}
        self._ended = False

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **named: Any) -> Future[Any]:
        """Let a process call a function, and return the future of what it gives."""
        return self._threads.submit(self._call, function, arguments, named)

    def _call(self, function: Any, arguments: Any, named: Any) -> Any:
        if getattr(self._own, "process", None) is None:
            self._start()
        process, link = self._own.process, self._own.link
        try:
            link.send((function, arguments, named))
            succeeded, value = link.recv()
        except (EOFError, OSError):
            self._own.process = None
            link.close()
            process.join()
            self._processes.pop(process, None)
            raise WorkerLostError(_how_it_ended(process.exitcode)) from None
        if succeeded:
            return value
        raise value

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._own.link, other = context.Pipe()
        _hold_interrupts()
        self._own.process = context.Process(target=_serve, args=(other,), daemon=True)
        self._own.process.start()
        self._processes[self._own.process] = self._own.link
        other.close()  # so that a process that is gone is noticed
        if self._ended:
            self._own.process.terminate()

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes: after what was submitted, or with ``cancel_futures`` at once."""
        self._ended = cancel_futures
        self._threads.shutdown(wait=not cancel_futures and wait, cancel_futures=cancel_futures)
        if not wait and not cancel_futures:
            return  # what was submitted goes on; the processes end with this one
        for process, link in list(self._processes.items()):
            if cancel_futures:
                process.terminate()  # the rest of a long log is not waited for
            else:
                link.close()  # it ends by itself, and clears up
        self._threads.shutdown(wait=wait)
        for process in list(self._processes):
            process.join(GRACE)


def _hold_interrupts() -> None:
    """Keep interrupts from what this thread starts until it is ready: Python would print where it was."""
    if hasattr(signal, "pthread_sigmask"):
        from multiprocessing import resource_tracker

        resource_tracker.ensure_running()  # which begins with the first process, and lets interrupts through again
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})


def _serve(link: Connection) -> None:
    """Call what comes through a link until it is closed; end without a message when the terminal interrupts."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    while True:
        try:
            function, arguments, named = link.recv()
        except EOFError:
            return
        try:
            answer = True, function(*arguments, **named)
        except Exception as error:
            answer = False, error
        try:
            link.send(answer)
        except OSError:
            return
        except Exception as error:  # an error that cannot be pickled
            link.send((False, RuntimeError(f"{type(answer[1]).__name__}: {answer[1]} ({error})")))


def _how_it_ended(code: int | None) -> str:
    if code is not None and code < 0:
        perhaps = ", perhaps because memory ran out" if code == -9 else ""
        return f"its process was killed by signal {-code}{perhaps}"
    return f"its process ended with exit code {code}"


class Scheduler(Executor):
    """The workers of a Dask scheduler, which may be away for some minutes.

    Parameters
    ----------
    address : str
        Where it listens, such as tcp://host:8786.

    Raises
    ------
    OSError
        If there is no scheduler.
    """

    def __init__(self, address: str) -> None:
        self.address = address
        self._client: Any = None
        self._connect()

    def _connect(self) -> None:
        from distributed import Client

        self._client = Client(self.address, set_as_default=False)
        self._executor = self._client.get_executor(pure=False)

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **named: Any) -> Future[Any]:
        """Let a worker call a function, and return the future of what it gives; wait for a scheduler that is gone."""
        deadline = time.monotonic() + PATIENCE
        while True:
            try:
                if self._client.status not in ("running", "connecting"):
                    self._connect()
                future: Future[Any] = self._executor.submit(function, *arguments, **named)
                return future
            except Exception as error:  # distributed raises a bare Exception where a client is closed
                if time.monotonic() > deadline:
                    raise RuntimeError(f"there is no scheduler at {self.address} any more: {error}") from error
                time.sleep(1.0)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Leave the scheduler; what was submitted and is not done is cancelled."""
        del wait, cancel_futures
        self._client.close()
