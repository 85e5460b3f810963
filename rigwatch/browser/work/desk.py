"""The server's side of the study processes: one per study, one task at a time, killed to cancel."""

import asyncio
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Generic, TypeVar

from rigwatch.browser.work.study_process import StudyProcess
from rigwatch.wire.errors import RigwatchError

MOST_PROCESSES = 4
"""Number of idle processes kept for the next task of their studies."""
MOST_WAITING = 64
"""Number of events queued for a page."""
QUIET = frozenset({"show"})
"""Tasks that start automatically and do not block requested ones."""


class BusyError(RigwatchError):
    """A study's process is busy with a requested task."""


@dataclass(frozen=True)
class Job:
    """A task of a study.

    Attributes:
        task: its name, such as "explain".
        arguments: of it.
        state: waiting, running, done, failed, refused or cancelled.
        text: current activity, or result.
        began: start, Unix time [s].
        ended: end, Unix time [s]; None while it runs.
        number: serial number of the job in the server.
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
        """Whether it is waiting or running."""
        return self.state in ("waiting", "running")


Change = TypeVar("Change")
Told = tuple[str, Job | None]
"""Kind of change, and a copy of the job at that time."""


@dataclass(eq=False)
class Listeners(Generic[Change]):
    """Pages that are notified of changes, each by a queue; false if there are none."""

    _queues: set[asyncio.Queue[Change]] = field(default_factory=set)

    def __bool__(self) -> bool:
        return bool(self._queues)

    def listen(self) -> asyncio.Queue[Change]:
        """A queue of all changes from now on."""
        queue: asyncio.Queue[Change] = asyncio.Queue(MOST_WAITING)
        self._queues.add(queue)
        return queue

    def leave(self, queue: asyncio.Queue[Change]) -> None:
        """Remove a queue."""
        self._queues.discard(queue)

    def tell(self, change: Change) -> None:
        """Notify all listeners; a full queue misses the change but gets the next one."""
        for queue in self._queues:
            with suppress(asyncio.QueueFull):
                queue.put_nowait(change)


@dataclass(eq=False)
class Desk:
    """One study's process and its tasks; to be used only in the server's event loop.

    Attributes:
        folder: the study's.
        everyone: notified of the jobs of all studies.
        job: the running job, or the last one; None before the first.
        listeners: get "job" with the job, or "study" if the study's files or results changed.
    """

    folder: Path
    everyone: Listeners[tuple[Path, Job]] = field(default_factory=Listeners)
    job: Job | None = None
    listeners: Listeners[Told] = field(default_factory=Listeners)
    _queue: list[Job] = field(default_factory=list)
    _process: StudyProcess | None = None
    _number: int = 0

    def ask(self, task: str, arguments: Mapping[str, Any]) -> Job:
        """Start a task.

        Raises:
            BusyError: another requested task is running.
        """
        for job in self._all():
            if (job.task, job.arguments) == (task, arguments):
                return job
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

    def cancel(self) -> bool:
        """Cancel the running and the waiting task; returns whether there was one."""
        if not self._all():
            return False
        self._queue.clear()
        self._end_process()
        self._change(state="cancelled", text="cancelled; the study is as it was", ended=time.time())
        return True

    def close(self) -> None:
        """End the process; nothing is lost, as studies are written atomically."""
        self._queue.clear()
        self._end_process()

    @property
    def at_work(self) -> bool:
        """Whether there is an active job."""
        return bool(self._all())

    @property
    def alive(self) -> bool:
        """Whether its process is running."""
        return self._process is not None

    def tell(self, what: str) -> None:
        """Notify all listeners of a change, "job" or "study"."""
        self.listeners.tell((what, self.job))
        if what == "job" and self.job is not None:
            self.everyone.tell((self.folder, self.job))

    def _next(self) -> None:
        if self._queue and not (self.job and self.job.active):
            self.job = replace(self._queue.pop(0), state="running", began=time.time())
            self._open().send((self.job.task, dict(self.job.arguments)))
            self.tell("job")

    def _open(self) -> StudyProcess:
        if self._process is None or not self._process.is_alive():
            self._process = StudyProcess(self.folder, self._said)
        return self._process

    def _said(self, process: StudyProcess, kind: str, content: Any) -> None:
        if process is not self._process or self.job is None:
            return
        if kind == "progress":
            self._change(text=str(content))
            return
        if kind == "shown":
            self.tell("study")
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
        process, self._process = self._process, None
        if process is not None:
            process.kill()


@dataclass(eq=False)
class Desks:
    """The desks of all studies, by folder.

    Attributes:
        listeners: notified of each change of a job, with the study's folder.
    """

    listeners: Listeners[tuple[Path, Job]] = field(default_factory=Listeners)
    _desks: dict[Path, Desk] = field(default_factory=dict)

    def of(self, folder: Path) -> Desk:
        """The desk of a study; idle processes of others are ended to make room."""
        desk = self._desks.pop(folder, None) or Desk(folder, self.listeners)
        self._desks[folder] = desk
        alive = [other for other in self._desks.values() if other.alive and not other.at_work]
        for other in alive[: max(len(alive) - MOST_PROCESSES, 0)]:
            other.close()
        return desk

    def jobs(self) -> dict[Path, Job]:
        """The running job of each study, or its last one, by the study's folder."""
        found = ((folder, desk.job) for folder, desk in self._desks.items())
        return {folder: job for folder, job in found if job is not None}

    def close(self) -> None:
        """End all processes."""
        for desk in self._desks.values():
            desk.close()

    async def watch(self, state: Callable[[Path], object], every: float = 0.5) -> None:
        """Notify pages of a study that its files have changed."""
        seen: dict[Path, object] = {}
        while True:
            for folder, desk in list(self._desks.items()):
                if desk.listeners:
                    now = await asyncio.to_thread(state, folder)  # a disk may keep it waiting
                    if seen.setdefault(folder, now) != now:
                        seen[folder] = now
                        desk.tell("study")
            await asyncio.sleep(every)
