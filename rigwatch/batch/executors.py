"""Executors by name: "local:4" for processes of this machine, "dask://host:8786" for Dask."""

import logging
import multiprocessing
import os
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import connection
from typing import Any, TypeVar
from urllib.parse import urlsplit

from rigwatch.version import __version__
from rigwatch.wire.errors import BatchError, MissingExtraError

T = TypeVar("T")
Maker = Callable[[], Executor]
CONNECT_S = 15.0
"""Longest wait for a scheduler [s]."""
FIRST_WORKER_S = 60.0
"""Longest wait for its first worker [s]."""


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

    Workers come from a process that began with an older environment. A client that is killed
    cannot tell its workers: they watch it.
    """
    os.environ.clear()
    os.environ.update(environment)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_watch, args=(parent.sentinel,), daemon=True).start()


def _watch(sentinel: int) -> None:
    connection.wait([sentinel])
    os._exit(1)


@contextmanager
def executor_on(where: str | None) -> Iterator[Executor | Maker | None]:
    """The executor that a text names, closed at the end.

    Args:
        where: "local:4", "local" for all cores, "dask://host:port", or None for this process.

    Raises:
        BatchError: the text names none, or the scheduler is not there or has other versions.
        MissingExtraError: Dask is not installed.
    """
    kind, _, rest = (where or "").partition(":")
    if where is None:
        yield None
    elif kind == "local":
        count = _count(where, rest)
        yield lambda: processes(count)
    elif kind == "dask":
        with _dask(where) as client:
            yield client.get_executor()
    else:
        raise BatchError(f"--on: found {where!r}, expected local:4 or dask://host:8786")


def _count(where: str, text: str) -> int:
    if not text:
        return len(os.sched_getaffinity(0))
    if not text.isdecimal() or not 1 <= int(text) <= 1024:
        raise BatchError(f"--on: found {where!r}, expected local:N with N from 1 to 1024")
    return int(text)


@contextmanager
def _dask(where: str) -> Iterator[Any]:
    """A client of a Dask scheduler whose workers have this version of rigwatch."""
    try:
        from distributed import Client
    except ImportError:
        raise MissingExtraError("distributed", "dask", "--on dask://") from None
    # What it logs about a lost connection is said in one line by this program.
    logging.getLogger("distributed").setLevel(logging.CRITICAL + 1)
    client = _connected(Client, where)
    try:
        _check_workers(client, where)
        yield client
    finally:
        client.close(timeout=2)


def _connected(client: Any, where: str) -> Any:
    try:
        host, port = urlsplit(where).hostname, urlsplit(where).port
    except ValueError:
        host = port = None
    if not host:
        raise BatchError(f"--on: found {where!r}, expected dask://host:8786")
    try:
        return client(f"tcp://{host}:{port or 8786}", timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError, RuntimeError) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise BatchError(f"{where}: no scheduler of this version answers: {reason}") from None


def _check_workers(client: Any, where: str) -> None:
    """Raise if no worker comes, or one cannot load this version of rigwatch."""
    try:
        client.wait_for_workers(1, timeout=FIRST_WORKER_S)
        found = client.run(_version, on_error="return")
    except TimeoutError:
        raise BatchError(f"{where}: the scheduler has no worker, expected at least one") from None
    for worker, version in sorted(found.items()):
        if isinstance(version, Exception):
            raise BatchError(f"{where}: worker {worker} cannot load rigwatch: {version}")
        if version != __version__:
            raise BatchError(
                f"{where}: worker {worker} has rigwatch {version}, expected {__version__}"
            )


def _version() -> str:
    return __version__
