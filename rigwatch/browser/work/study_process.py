"""The server's end of a study's process: it is started in a thread, where it may wait.

The fork server answers only once it has loaded the engine, which takes seconds, on a busy machine
many; the server's event loop, and with it every page, must not wait for that.
"""

import asyncio
import multiprocessing
import threading
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.forkserver import ensure_running
from pathlib import Path
from typing import Any

from rigwatch.browser.work.worker import work

WORKERS = multiprocessing.get_context("forkserver")
Said = Callable[["StudyProcess", str, Any], None]


def warm_up() -> None:
    """Start the process from which the others are forked, with the engine loaded."""
    multiprocessing.set_forkserver_preload(["rigwatch.browser.work.worker"])
    ensure_running()


class StudyProcess:
    """One process that works on one study; to be used only in the server's event loop.

    Args:
        folder: the study's.
        said: called in the loop with this process and kind and content of each message; the last
            one is of kind "gone".
    """

    def __init__(self, folder: Path, said: Said) -> None:
        self._said, self._loop = said, asyncio.get_running_loop()
        self._pipe, self._theirs = WORKERS.Pipe()
        self._process = WORKERS.Process(target=work, args=(self._theirs, str(folder)), daemon=True)
        self._lock = threading.Lock()
        self._started = self._killed = False
        self._waiting: list[Any] = []
        threading.Thread(target=self._run, daemon=True).start()

    @property
    def pid(self) -> int | None:
        """Its number in the system, None while it starts."""
        return self._process.pid

    def is_alive(self) -> bool:
        """Whether it runs, or is about to."""
        with self._lock:
            return self._process.is_alive() if self._started else not self._killed

    def send(self, task: Any) -> None:
        """Give it a task, at once or when it has started."""
        with self._lock:
            if not self._started:
                self._waiting.append(task)
                return
        with suppress(OSError):  # it has ended, as its last message says
            self._pipe.send(task)

    def kill(self) -> None:
        """End it, at once or when it has started."""
        with self._lock:
            self._killed = True
            if self._started:
                self._process.kill()

    def _run(self) -> None:
        """In a thread: start it, and pass on what it says."""
        with suppress(OSError, EOFError):
            self._process.start()
            self._theirs.close()
            self._begin()
            while True:
                self._tell(*self._pipe.recv())
        self._tell("gone", None)

    def _begin(self) -> None:
        with self._lock:
            self._started = True
            if self._killed:
                self._process.kill()
        for task in self._waiting:
            self._pipe.send(task)

    def _tell(self, kind: str, content: Any) -> None:
        with suppress(RuntimeError):  # the loop may be closed already
            self._loop.call_soon_threadsafe(self._said, self, kind, content)
