"""Work on foreign files in a process of its own: the server keeps answering, and memory is bounded.

A text file of a gigabyte needs more than ten times as much memory as tables of cells, and parsing
it holds the interpreter's lock for minutes.
"""

import asyncio
import contextlib
import os
import resource
import threading
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from rigwatch.browser.work.study_process import WORKERS
from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.host import end_with_parent

MOST_MEMORY = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2
"""Most memory of such a process: half of the machine's [bytes]."""
MOST_WAITING = 8
"""Requests that may wait until files of others are read."""
_one_at_a_time = threading.Lock()


class ApartError(RigwatchError):
    """A file that cannot be read, or not in the memory that is allowed."""


class Turns:
    """Lets requests read files one after the other: those that wait hold no thread of the server.

    All pages share its threads, and a large file takes minutes.
    """

    def __init__(self) -> None:
        self._turn = asyncio.Lock()
        self._there = 0

    async def run(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """What a function returns, called in a thread once it is its turn.

        Raises:
            ApartError: too many wait already.
        """
        if self._there > MOST_WAITING:
            raise ApartError(f"{self._there} other files are to be read first, try again later")
        self._there += 1
        try:
            async with self._turn:
                return await asyncio.to_thread(function, *arguments)
        finally:
            self._there -= 1


def apart(function: Callable[..., Any], *arguments: Any, memory: int = MOST_MEMORY) -> Any:
    """What a function of a module returns, executed in another process; one at a time.

    Args:
        function: importable by its name.
        arguments: of it; they and its result are pickled.
        memory: it may use in addition to that of an idle process [bytes].

    Raises:
        ApartError: the function raised a RigwatchError, with its text; or it ran out of memory.
    """
    with _one_at_a_time:
        ours, theirs = WORKERS.Pipe(duplex=False)
        process = WORKERS.Process(
            target=_run, args=(theirs, memory, function, arguments), daemon=True
        )
        process.start()
        theirs.close()
        try:
            kind, content = ours.recv()
        except EOFError:
            kind, content = "failed", _too_large(memory)
        process.join()
    if kind == "failed":
        raise ApartError(content)
    return content


def _run(
    pipe: Connection, memory: int, function: Callable[..., Any], arguments: tuple[Any, ...]
) -> None:
    end_with_parent()
    _bound(memory)
    try:
        found = "done", function(*arguments)
    except RigwatchError as error:
        found = "failed", str(error)
    except MemoryError:
        found = "failed", _too_large(memory)
    except Exception as error:
        found = "failed", f"{function.__name__}: {type(error).__name__}: {error}"
    pipe.send(found)


def _bound(memory: int) -> None:
    """Let allocations fail beyond `memory`, where the system counts a process's pages."""
    with contextlib.suppress(OSError, ValueError):
        used = int(Path("/proc/self/statm").read_bytes().split()[0]) * os.sysconf("SC_PAGE_SIZE")
        resource.setrlimit(resource.RLIMIT_AS, (used + memory, used + memory))


def _too_large(memory: int) -> str:
    return f"reading the file takes more than {memory >> 20} MB of memory, expected a smaller file"
