"""Executors by name: "local:4" for processes of this machine, a Dask scheduler or cluster."""

import multiprocessing
import os
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from rigwatch.batch.dask_clients import client_at, client_of
from rigwatch.wire.errors import BatchError
from rigwatch.wire.host import end_with_parent

T = TypeVar("T")
EXPECTED = "local:4, dask://host:8786 or cluster.toml"
Maker = Callable[[], Executor]


class Here(Executor):
    """Runs everything in this process, at once: the plain loop."""

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> "Future[T]":
        """The finished call."""
        future: Future[T] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


def processes(count: int) -> ProcessPoolExecutor:
    """Processes of this machine that load the code once, and end when this process ends."""
    context = multiprocessing.get_context("forkserver")
    return ProcessPoolExecutor(count, context, initializer=_begin, initargs=(dict(os.environ),))


def preload(module: str) -> None:
    """Have processes of this machine begin with a module loaded, unless some have begun already."""
    modules = [__name__, *({module} - {"__main__"})]
    multiprocessing.get_context("forkserver").set_forkserver_preload(modules)


def _begin(environment: dict[str, str]) -> None:
    """Take the client's present environment, and end with it.

    Workers come from a process that began with an older environment.
    """
    os.environ.clear()
    os.environ.update(environment)
    end_with_parent()


@contextmanager
def executor_on(where: str | None) -> Iterator[Executor | Maker | None]:
    """The executor that a text names, closed at the end.

    Args:
        where: "local:4", "local" for all cores, "dask://host:port", a file that declares a
            cluster ("cluster.toml"), or None for this process.

    Raises:
        BatchError: the text names none, or the scheduler is not there or has other versions.
        ConfigError: the file of a cluster is wrong.
        MissingExtraError: Dask or dask-jobqueue is not installed.
    """
    kind, _, rest = (where or "").partition(":")
    if where is None:
        yield None
    elif kind == "local":
        count = _count(where, rest)
        yield lambda: processes(count)
    elif kind == "dask":
        with client_at(where) as client:
            yield client.get_executor()
    elif where.endswith(".toml"):
        with client_of(Path(where)) as client:
            yield client.get_executor()
    else:
        raise BatchError(f"--on: found {where!r}, expected {EXPECTED}")


def _count(where: str, text: str) -> int:
    if not text:
        return len(os.sched_getaffinity(0))
    if not text.isdecimal() or not 1 <= int(text) <= 1024:
        raise BatchError(f"--on: found {where!r}, expected local:N with N from 1 to 1024")
    return int(text)
