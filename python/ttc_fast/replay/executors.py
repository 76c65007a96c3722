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
from concurrent.futures import Executor, Future, InvalidStateError, ThreadPoolExecutor
from contextlib import suppress
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable
    from multiprocessing.connection import Connection

GRACE = 10.0
"""s for which a process may clear up."""
FETCHED = 60.0
"""s for which a result may be on its way."""
PATIENCE = 600.0
"""s for which a scheduler that is gone is waited for."""
GUARD = """\
replay_many starts processes, and each of them imports the script that calls it. So call it from below

    if __name__ == "__main__":

in a file, or give jobs=1, which starts no process"""


class WorkerLostError(RuntimeError):
    """The process that replayed a log ended before it was done."""


class StartError(RuntimeError):
    """No process can begin."""


class ThisProcess(Executor):
    """Does what is submitted at once, in this process."""

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **named: Any) -> Future[Any]:
        """Call a function, and return the future of what it gives, which is done."""
        future: Future[Any] = Future()
        try:
            future.set_result(function(*arguments, **named))
        except Exception as error:
            future.set_exception(error)
        return future


class _Own(threading.local):
    """The process of a thread, and the link to it."""

    process: Any = None
    link: Any = None


class Processes(Executor):
    """Processes of this machine, each of which does one thing at a time.

    A thread looks after each process, and starts another one where it is killed. So a process that is killed, perhaps
    because memory ran out, takes its own task with it and no other, and it is known which.

    Parameters
    ----------
    jobs : int or None
        How many processes there are at most; None is one for each core.

    Raises
    ------
    StartError
        If this process is itself one that begins, and imports the script that calls.

    Notes
    -----
    The first process begins alone. Where it cannot, such as for want of the guard of the script, no other is tried.
    """

    def __init__(self, jobs: int | None = None) -> None:
        if getattr(multiprocessing.current_process(), "_inheriting", False):  # as multiprocessing itself finds out
            raise StartError(GUARD)
        self._threads = ThreadPoolExecutor(jobs or os.cpu_count() or 1, "replay")
        self._own = _Own()
        self._processes: dict[Any, Connection] = {}
        self._first = threading.Lock()
        self._begun = False
        self._refused = ""
        self._ended = False

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **named: Any) -> Future[Any]:
        """Let a process call a function, and return the future of what it gives."""
        return self._threads.submit(self._call, function, arguments, named)

    def _call(self, function: Any, arguments: Any, named: Any) -> Any:
        if self._own.process is None:
            with self._first:
                if not self._begun:
                    self._start()
        if self._own.process is None:
            self._start()
        link = self._own.link
        try:
            link.send((function, arguments, named))
            succeeded, value = link.recv()
        except (EOFError, OSError):
            raise WorkerLostError(_how_it_ended(self._lost())) from None
        if succeeded:
            return value
        raise value

    def _lost(self) -> int | None:
        """Clear up after the process of this thread; return its exit code."""
        process, self._own.process = self._own.process, None
        self._own.link.close()
        process.join()
        self._processes.pop(process, None)
        return process.exitcode  # type: ignore[no-any-return]

    def _start(self) -> None:
        """Start a process, and wait until it has imported what it needs."""
        if self._refused:
            raise StartError(self._refused)
        if self._ended:
            raise WorkerLostError("the executor has ended")
        context = multiprocessing.get_context("spawn")
        link, other = context.Pipe()
        _hold_interrupts()
        process = context.Process(target=_serve, args=(other,), daemon=True)
        process.start()
        self._own.process, self._own.link = process, link
        self._processes[process] = link
        other.close()  # so that a process that is gone is noticed
        if self._ended:
            process.terminate()
        try:
            link.recv()
        except (EOFError, OSError):
            code = self._lost()
            if self._begun or code is None or code < 0:
                raise WorkerLostError(_how_it_ended(code)) from None
            self._refused = f"{_how_it_ended(code)} before it had begun: {GUARD}"
            raise StartError(self._refused) from None
        self._begun = True

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
    with suppress(OSError):
        link.send("begun")
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

    The executor that ``client.get_executor()`` gives waits for ever for a result whose scheduler goes while it is
    fetched. This one asks the client itself: a result that is gone with its scheduler is cancelled.

    Parameters
    ----------
    client : distributed.Client
        The client.
    address : str, optional
        Where the scheduler listens, such as tcp://host:8786: a client that has given up is replaced by another one.
    **how
        What ``client.submit`` takes beside the function and its arguments.
    """

    def __init__(self, client: Any, address: str | None = None, **how: Any) -> None:
        self._client, self._address = client, address
        self._how = {**how, "pure": False}
        self._open: dict[Future[Any], Any] = {}
        self._ended = threading.Event()
        threading.Thread(target=self._watch, daemon=True).start()

    @classmethod
    def at(cls, address: str) -> Scheduler:
        """Return the executor of the scheduler at an address; an OSError says that there is none."""
        return cls(_client_of(address), address)

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **named: Any) -> Future[Any]:
        """Let a worker call a function, and return the future of what it gives; wait for a scheduler that is gone."""
        deadline = time.monotonic() + PATIENCE
        while True:
            try:
                there = self._client.submit(function, *arguments, **named, **self._how)
                break
            except Exception as error:  # the client is closed
                if self._address is None or time.monotonic() > deadline:
                    raise RuntimeError(f"the Dask scheduler is gone: {error}") from error
                time.sleep(1.0)
                with suppress(OSError):
                    self._client = _client_of(self._address)
        here: Future[Any] = Future()
        self._open[here] = there
        here.add_done_callback(self._forget)
        there.add_done_callback(lambda there: _hand_on(there, here))
        return here

    def _forget(self, here: Future[Any]) -> None:
        there = self._open.pop(here, None)
        if here.cancelled() and there is not None and there.status == "pending":
            there.cancel()

    def _watch(self) -> None:
        """Cancel what a client that has given up will not hand on any more."""
        while not self._ended.wait(1.0):
            client = self._client
            if client.status == "closed":
                for here, there in list(self._open.items()):
                    if there.client is client:
                        _cancel(here)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Leave the scheduler, and close a client of our own; what was submitted and is not done is cancelled."""
        del wait, cancel_futures
        self._ended.set()
        for here in list(self._open):
            _cancel(here)
        if self._address is not None:
            self._client.close()


def adapted(executor: Executor) -> Executor:
    """Return the executor, or one that loses nothing instead of that of a Dask client."""
    client = getattr(executor, "_client", None)
    if client is None or not type(executor).__module__.startswith("distributed."):
        return executor
    return Scheduler(client, **getattr(executor, "_kwargs", {}))


def _client_of(address: str) -> Any:
    from distributed import Client

    return Client(address, set_as_default=False)


def _hand_on(there: Any, here: Future[Any]) -> None:
    """Give a future what came of one of Dask."""
    try:
        if there.status == "finished":
            here.set_result(there.result(timeout=FETCHED))
        elif there.status == "error":
            here.set_exception(there.exception(timeout=FETCHED))
        else:
            _cancel(here)
    except InvalidStateError:
        pass  # it was cancelled meanwhile
    except Exception:  # the result is gone with its scheduler or its worker
        _cancel(here)


def _cancel(here: Future[Any]) -> None:
    if here.cancel():
        here.set_running_or_notify_cancel()
