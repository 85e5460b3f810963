"""The server's side of the studies' processes: one each, one task at a time, killed to cancel."""

import asyncio
import multiprocessing
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from rigwatch.browser.work.worker import work
from rigwatch.wire.errors import RigwatchError

WORKERS = multiprocessing.get_context("forkserver")
MOST_PROCESSES = 4
"""Processes that stay for their studies' next task."""
MOST_WAITING = 64
"""Events that a page may be behind."""
QUIET = frozenset({"show"})
"""Tasks that begin by themselves and give way to what somebody asks for."""


class BusyError(RigwatchError):
    """A study's process is at work for somebody."""


@dataclass(frozen=True)
class Job:
    """A task of a study.

    Attributes:
        task: its name, such as "explain".
        arguments: of it.
        state: waiting, running, done, failed, refused or cancelled.
        text: what it does now, or how it ended.
        began: when [s], as `time.time` says.
        ended: the same; None while it runs.
        number: counts the jobs of a server.
    """

    task: str
    arguments: Mapping[str, Any]
    state: str = "waiting"
    text: str = ""
    began: float = 0.0
    ended: float | None = None
    number: int = 0

    @property
    def active(self) -> bool:
        """Whether it is still to be done."""
        return self.state in ("waiting", "running")


Told = tuple[str, Job | None]
"""What has changed, and the job as it was then."""


@dataclass(eq=False)
class Desk:
    """One study's process and its tasks; to be used in the server's event loop alone.

    Attributes:
        folder: the study's.
        job: what runs, or what ended last; None before.
    """

    folder: Path
    job: Job | None = None
    _queue: list[Job] = field(default_factory=list)
    _listeners: set[asyncio.Queue[Told]] = field(default_factory=set)
    _process: BaseProcess | None = None
    _pipe: Connection | None = None
    _number: int = 0

    def ask(self, task: str, arguments: Mapping[str, Any]) -> Job:
        """Have a task done.

        Raises:
            BusyError: another is being done that somebody asked for.
        """
        same = next((job for job in self._all() if self._is(job, task, arguments)), None)
        if same is not None:
            return same
        if task not in QUIET and any(job.task not in QUIET for job in self._all()):
            assert self.job is not None
            raise BusyError(f"{self.folder.name}: busy with {self.job.task}; cancel it or wait")
        self._number += 1
        job = Job(task, arguments, began=time.time(), number=self._number)
        self._queue.append(job)
        self._next()
        return job

    def _all(self) -> list[Job]:
        running = [self.job] if self.job is not None and self.job.active else []
        return running + self._queue

    @staticmethod
    def _is(job: Job, task: str, arguments: Mapping[str, Any]) -> bool:
        return (job.task, job.arguments) == (task, arguments)

    def cancel(self) -> bool:
        """End what runs and what waits, whatever it is doing; whether there was anything."""
        if not self._all():
            return False
        self._queue.clear()
        self._end_process()
        self._change(state="cancelled", text="cancelled; the study is as it was", ended=time.time())
        return True

    def close(self) -> None:
        """End the process; nothing is lost, as a study is only ever written whole."""
        self._queue.clear()
        self._end_process()

    @property
    def at_work(self) -> bool:
        """Whether there is anything to do."""
        return bool(self._all())

    @property
    def alive(self) -> bool:
        """Whether it has a process."""
        return self._process is not None

    def listen(self) -> asyncio.Queue[Told]:
        """A queue that is told what changes: "job" with it, or "study" where its files did."""
        queue: asyncio.Queue[Told] = asyncio.Queue(MOST_WAITING)
        self._listeners.add(queue)
        return queue

    def leave(self, queue: asyncio.Queue[Told]) -> None:
        """Tell it no more."""
        self._listeners.discard(queue)

    @property
    def watched(self) -> bool:
        """Whether anybody listens."""
        return bool(self._listeners)

    def tell(self, what: str) -> None:
        """Tell all who listen; who is far behind hears of the next change."""
        for queue in self._listeners:
            with suppress(asyncio.QueueFull):
                queue.put_nowait((what, self.job))

    def _next(self) -> None:
        if self._queue and not (self.job and self.job.active):
            self.job = replace(self._queue.pop(0), state="running", began=time.time())
            self._open().send((self.job.task, dict(self.job.arguments)))
            self.tell("job")

    def _open(self) -> Connection:
        if self._pipe is None or self._process is None or not self._process.is_alive():
            self._pipe, theirs = WORKERS.Pipe()
            self._process = WORKERS.Process(
                target=work, args=(theirs, str(self.folder)), daemon=True
            )
            self._process.start()
            theirs.close()
            loop = asyncio.get_running_loop()
            heard = (self._pipe, loop)
            threading.Thread(target=self._hear, args=heard, daemon=True).start()
        return self._pipe

    def _hear(self, pipe: Connection, loop: asyncio.AbstractEventLoop) -> None:
        """In a thread of its own: pass on what the process says."""
        said: tuple[str, Any] = ("", None)
        while said[0] != "gone":
            try:
                said = pipe.recv()
            except (EOFError, OSError):
                said = ("gone", None)
            with suppress(RuntimeError):  # the loop may be closed already
                loop.call_soon_threadsafe(self._said, pipe, *said)

    def _said(self, pipe: Connection, kind: str, content: Any) -> None:
        if pipe is not self._pipe or self.job is None:
            return
        if kind == "progress":
            self._change(text=str(content))
            return
        if kind == "gone":
            self._end_process()
            content = f"{self.job.task}: the process of this study ended; the study is as it was"
        done = content if isinstance(content, dict) else {}
        state = {"done": done.get("step", "done")}.get(kind, "failed")
        state = state if state in ("refused", "failed") else "done"
        text = done.get("text", "") if kind == "done" else str(content)
        if self.job.active:
            self._change(state=state, text=text, ended=time.time())
        self._next()

    def _change(self, **what: Any) -> None:
        assert self.job is not None
        self.job = replace(self.job, **what)
        self.tell("job")

    def _end_process(self) -> None:
        process, self._process, self._pipe = self._process, None, None
        if process is not None:
            process.kill()


@dataclass(eq=False)
class Desks:
    """The desks of all studies, by folder."""

    _desks: dict[Path, Desk] = field(default_factory=dict)

    def of(self, folder: Path) -> Desk:
        """The desk of a study; idle processes of others make room for it."""
        desk = self._desks.pop(folder, None) or Desk(folder)
        self._desks[folder] = desk
        alive = [other for other in self._desks.values() if other.alive and not other.at_work]
        for other in alive[: max(len(alive) - MOST_PROCESSES, 0)]:
            other.close()
        return desk

    def close(self) -> None:
        """End all processes."""
        for desk in self._desks.values():
            desk.close()

    async def watch(self, state: Callable[[Path], object], every: float = 0.5) -> None:
        """Tell those who look at a study that its files have changed, whoever changed them."""
        seen: dict[Path, object] = {}
        while True:
            for folder, desk in list(self._desks.items()):
                if desk.watched:
                    now = state(folder)
                    if seen.setdefault(folder, now) != now:
                        seen[folder] = now
                        desk.tell("study")
            await asyncio.sleep(every)


def warm_up() -> None:
    """Start the process that the others are made of, with the engine in it."""
    multiprocessing.set_forkserver_preload(["rigwatch.browser.work.worker"])
