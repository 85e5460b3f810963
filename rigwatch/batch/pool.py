"""An executor that can be replaced when its processes have died."""

import os
import time
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from typing import Any

from rigwatch.batch.executors import Here, Maker
from rigwatch.wire.errors import BatchError

_COUNT_AGAIN_S = 5.0
_PAUSES = (0.05, 0.2, 1.0)
"""Waits before a process is started again that could not be started [s]."""


class Pool:
    """The executor in use, and how to make another one.

    Args:
        executor: an executor, a function that makes one, or None for this process. A broken
            `ProcessPoolExecutor` is replaced by one of the same kind.
    """

    def __init__(self, executor: Executor | Maker | None) -> None:
        self.executor: Executor
        self._make: Maker | None
        if isinstance(executor, Executor):
            self.executor, self._make, self._own = executor, _maker_of(executor), False
        else:
            self._make = executor or Here
            self.executor, self._own = self._make(), True
        self.generation = 0
        self._workers, self._counted = 0, 0.0

    def submit(self, call: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        """Submit a call; a broken executor is replaced first.

        Raises:
            OSError: no further process can be started.
        """
        failed = 0
        while True:
            try:
                return self.executor.submit(call, *arguments)
            except BrokenExecutor:
                self.renew(self.generation)
            except OSError:
                # A pool that breaks while it starts a process fails so, and is broken then; the
                # process that starts the others may have died with it, and is missed later.
                if failed == len(_PAUSES):
                    raise
                time.sleep(_PAUSES[failed])
                failed += 1

    def check(self) -> None:
        """Replace an executor that broke unnoticed.

        Before Python 3.12 a call that is submitted while the pool breaks may be forgotten: its
        future is never done.
        """
        if isinstance(self.executor, ProcessPoolExecutor):
            self.submit(int)

    def renew(self, generation: int) -> None:
        """Replace the executor of a generation that broke; once for all its calls.

        Raises:
            BatchError: the executor was given and is of a kind that cannot be made again.
        """
        if generation != self.generation:
            return
        if self._make is None:
            kind = type(self.executor).__name__
            raise BatchError(f"{kind} is broken; pass a function that makes a new one")
        if self._own:
            self.executor.shutdown(wait=False, cancel_futures=True)
        self.executor, self._own = self._make(), True
        self.generation += 1

    @property
    def workers(self) -> int:
        """Number of workers now, 0 if all are gone; the number of cores if it is unknown."""
        if time.monotonic() >= self._counted + _COUNT_AGAIN_S or not self._counted:
            self._workers, self._counted = _workers(self.executor), time.monotonic()
        return self._workers

    def close(self) -> None:
        """End the executor, unless it is the caller's."""
        if self._own:
            self.executor.shutdown(wait=True, cancel_futures=True)

    def abandon(self) -> None:
        """End the executor without waiting for what runs, unless it is the caller's."""
        if self._own:
            running = list((vars(self.executor).get("_processes") or {}).values())
            self.executor.shutdown(wait=False, cancel_futures=True)
            for process in running:
                process.terminate()


def _maker_of(executor: Executor) -> Maker | None:
    if type(executor) is not ProcessPoolExecutor:
        return None
    known = vars(executor)
    return lambda: ProcessPoolExecutor(
        known.get("_max_workers"),
        known.get("_mp_context"),
        known.get("_initializer"),
        known.get("_initargs", ()),
    )


def _workers(executor: Executor) -> int:
    if isinstance(executor, Here):
        return 1
    client: Any = getattr(executor, "_client", None)
    if hasattr(client, "nthreads"):  # Dask
        return sum(client.nthreads().values())
    for name in ("_max_workers", "num_workers"):
        if isinstance(count := getattr(executor, name, None), int):
            return count
    return os.cpu_count() or 1
