"""Runs all processes of a rig in one loop: start, monitor, restart, stop in order.

    every 0.1 s, for each process:  read its notifications and output
                                    ended?            → pause, longer each time, then start
                                    hangs or stalls?  → kill, pause, start
    on stop:                        reverse order, SIGTERM, then SIGKILL

A process that dies does not affect the others: each reconnects by itself.
"""

import contextlib
import os
import selectors
import shutil
import signal
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from rigwatch.supervisor.child import Child
from rigwatch.supervisor.plan import ProcessPlan
from rigwatch.supervisor.processor_time import ProcessorWait
from rigwatch.supervisor.vitals import Limits, Vitals
from rigwatch.wire.errors import RigwatchError, reason_of

Kind = Literal[
    "started",
    "ready",
    "says",
    "ended",
    "ill",
    "restarting",
    "renewing",
    "finished",
    "stopping",
    "stopped",
    "changed",
]
IN_MEMORY = "/dev/shm"
TURN = 0.1
"""Time between two checks of the processes [s]."""


@dataclass(frozen=True, slots=True)
class ProcessEvent:
    """An event of one process: its kind, and one plain line."""

    process: str
    kind: Kind
    text: str
    pid: int
    restarts: int


@dataclass(slots=True)
class Watched:
    """One process and its history under this supervisor."""

    child: Child
    restarts: int = 0
    failures: int = 0
    start_at: float | None = None
    was_ready: bool = False
    held: bool = False
    finished: bool = False
    wait: ProcessorWait | None = None

    @property
    def vitals(self) -> Vitals:
        """What the current run has reported."""
        return self.child.vitals

    @property
    def state(self) -> str:
        """One word for people."""
        if self.finished:
            return "finished"
        if self.start_at is not None:
            return "waiting" if self.held else "down"
        return "running" if self.vitals.ready else "starting"


class Supervisor:
    """Runs a rig's processes until `stop` is called or a signal comes.

    Args:
        plans: the processes in starting order.
        report: called with every event.
        limits: time limits.
        clock: seconds on a monotonic clock [s].

    Raises:
        RigwatchError: there is no folder for the sockets of the processes.
    """

    def __init__(
        self,
        plans: Sequence[ProcessPlan],
        report: Callable[[ProcessEvent], None],
        limits: Limits | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._report = report
        self._limits = limits or Limits()
        self._clock = clock
        self._folder = _own_folder()
        self._selector = selectors.DefaultSelector()
        self._watched = {plan.name: self._new(plan) for plan in plans}
        self._stopped = False

    @property
    def processes(self) -> dict[str, Watched]:
        """All processes by name, in starting order."""
        return self._watched

    def run(self, each_turn: Callable[[], None] = lambda: None) -> None:
        """Start everything and monitor it until `stop`; then stop in reverse order and clean up."""
        try:
            for watched in self._watched.values():
                self._start_or_hold(watched)
            while not self._stopped:
                self._turn()
                each_turn()
        finally:
            self._stop_all()

    def stop(self) -> None:
        """End `run` after the current turn; may be called from a signal handler."""
        self._stopped = True

    def follow(self, plans: Sequence[ProcessPlan]) -> None:
        """Run these processes from now on: end others, start new ones, and those that differ."""
        names = [plan.name for plan in plans]
        for name in [name for name in reversed(self._watched) if name not in names]:
            watched = self._watched[name]
            self._stop(watched)
            self._selector.unregister(watched.child.words)
            watched.child.close()
            del self._watched[name]
        before, self._watched = self._watched, {}
        for plan in plans:
            self._watched[plan.name] = before.get(plan.name) or self._new(plan)
        for plan in plans:
            watched = self._watched[plan.name]
            if plan.name not in before:
                self._start_or_hold(watched)
                continue
            differs = watched.child.plan.arguments != plan.arguments
            watched.child.plan = plan
            if differs:
                self.restart(plan.name, "it serves other rigs from now on")

    def _new(self, plan: ProcessPlan) -> Watched:
        child = Child(plan, self._folder)
        self._selector.register(child.words, selectors.EVENT_READ)
        return Watched(child)

    def restart(self, name: str, reason: str) -> None:
        """Stop a process in good order and start it anew in the next turn."""
        watched = self._watched[name]
        if watched.finished or watched.start_at is not None:
            return
        self._say(watched, "restarting", reason)
        self._stop(watched)
        watched.child.close_run()
        watched.start_at = self._clock()

    def renew(self, name: str, reason: str) -> None:
        """Ask a process of several rigs to start those anew that have changed."""
        watched = self._watched[name]
        if not watched.vitals.ready:
            self.restart(name, reason)
            return
        self._say(watched, "renewing", reason)
        watched.child.renew()

    def stop_on_signals(self) -> None:
        """Stop in order on SIGTERM and SIGINT."""
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda _number, _frame: self.stop())

    def _turn(self) -> None:
        self._selector.select(TURN)
        now = self._clock()
        # All notifications are read before any process is judged: after a turn that was itself late
        # they have been waiting, and no process was silent.
        for watched in self._watched.values():
            self._take_in(watched, now)
        for watched in self._watched.values():
            self._judge(watched, now)
        time.sleep(TURN / 2)

    def _take_in(self, watched: Watched, now: float) -> None:
        if watched.child.pid == 0:
            return
        watched.child.listen(now)
        for line in watched.child.lines():
            self._say(watched, "says", line)
        if watched.vitals.ready and not watched.was_ready:
            watched.was_ready = True
            self._say(watched, "ready", watched.vitals.status or "ready")

    def _judge(self, watched: Watched, now: float) -> None:
        if watched.finished:
            return
        if watched.start_at is not None:
            if watched.held and self._all_ready(watched.child.plan.after):
                watched.start_at = now
            if now >= watched.start_at and self._is_gone(watched, now):
                watched.restarts += not watched.held
                self._start(watched)
            return
        code = watched.child.exit_code()
        if code is not None:
            self._ended(watched, code, now)
            return
        source, router = self._vitals_of(watched.child.plan.source), self._vitals_of("router")
        complaint = watched.vitals.complaint(source, now, self._limits, router)
        if not complaint:
            watched.wait = None
            if now - watched.vitals.started_at > self._limits.settled:
                watched.failures = 0
            return
        stalls = watched.vitals.stalls(source, now, self._limits, router)
        if stalls and self._may_only_wait(watched, now):
            return
        self._say(watched, "ill", complaint)
        self._pause(watched, now)

    def _may_only_wait(self, watched: Watched, now: float) -> bool:
        """Whether a process that passes nothing on lacks processor time, as far as is known yet."""
        if watched.wait is None:
            watched.wait = ProcessorWait(watched.child.pid, now)
        lacked = watched.wait.lacks
        watched.wait.look(now)
        if watched.wait.lacks and not lacked:
            self._say(watched, "says", "passes no samples on for want of processor time")
        patient = now - watched.wait.since < self._limits.patience
        return patient and watched.wait.lacks is not False

    def _is_gone(self, watched: Watched, now: float) -> bool:
        """Whether the run before has ended; one that cannot be killed is tried again later."""
        if watched.child.close_run():
            return True
        self._say(watched, "ill", "cannot be killed; it starts again once its process has ended")
        watched.start_at = now + self._limits.longest_pause
        return False

    def _vitals_of(self, name: str) -> Vitals | None:
        """Those of a process of this supervisor; None if it has no such process."""
        found = self._watched.get(name)
        return found.vitals if found is not None else None

    def _ended(self, watched: Watched, code: int, now: float) -> None:
        for line in watched.child.lines():
            self._say(watched, "says", line)
        if code == 0 and watched.child.plan.may_finish:
            watched.finished = True
            watched.child.close_run()
            self._say(watched, "finished", "closed by its user")
            return
        self._say(watched, "ended", how_it_ended(code, watched.child.last_line))
        self._pause(watched, now)

    def _pause(self, watched: Watched, now: float) -> None:
        watched.child.close_run()
        longest = self._limits.longest_pause
        pause = min(longest, self._limits.first_pause * 2 ** min(watched.failures, 16))
        watched.failures += 1
        watched.start_at = now + pause
        self._say(watched, "restarting", f"starts again in {pause:.1f} s")

    def _start_or_hold(self, watched: Watched) -> None:
        if self._all_ready(watched.child.plan.after):
            self._start(watched)
        else:
            watched.held = True
            watched.start_at = self._clock() + self._limits.patience

    def _all_ready(self, names: Sequence[str]) -> bool:
        return all(self._watched[name].was_ready for name in names if name in self._watched)

    def _start(self, watched: Watched) -> None:
        watched.start_at, watched.was_ready, watched.held = None, False, False
        try:
            watched.child.start(self._clock())
        except OSError as error:  # the others go on
            self._say(watched, "ill", f"cannot be started: {reason_of(error)}")
            self._pause(watched, self._clock())
            return
        self._say(watched, "started", f"process {watched.child.pid}")

    def _stop_all(self) -> None:
        for watched in reversed(self._watched.values()):
            self._stop(watched)
            watched.child.close()
        self._selector.close()
        shutil.rmtree(self._folder, ignore_errors=True)

    def _stop(self, watched: Watched) -> None:
        if watched.start_at is not None or watched.child.exit_code() is not None:
            return
        self._say(watched, "stopping", "asked to stop")
        watched.child.terminate()
        asked_at = self._clock()
        while watched.child.exit_code() is None and self._clock() < self._end_of(watched, asked_at):
            # Processes waiting for their turn to stop keep printing: their pipes must not fill.
            for other in self._watched.values():
                self._take_in(other, self._clock())
            time.sleep(TURN / 5)
        self._take_in(watched, self._clock())
        code = watched.child.exit_code()
        if code is None:
            text = f"killed: did not stop within {self._clock() - asked_at:.0f} s"
        else:
            text = "stopped" if code == 0 else how_it_ended(code, watched.child.last_line)
        self._say(watched, "stopped", text)

    def _end_of(self, watched: Watched, asked_at: float) -> float:
        """When a process is killed that was asked to stop: hundreds of rigs take their time."""
        heard_at = max(asked_at, watched.vitals.stopping_at)
        return min(heard_at + self._limits.stop, asked_at + self._limits.longest_stop)

    def _say(self, watched: Watched, kind: Kind, text: str) -> None:
        child = watched.child
        self._report(ProcessEvent(child.plan.name, kind, text, child.pid, watched.restarts))


def _own_folder() -> Path:
    """A folder for sockets, in memory where the disk is full: a rig has to start nevertheless."""
    places = (None, os.environ.get("XDG_RUNTIME_DIR"), IN_MEMORY)
    for place in places:
        with contextlib.suppress(OSError):
            return Path(tempfile.mkdtemp(prefix="rigwatch-", dir=place))
    expected = f"expected room in TMPDIR or {IN_MEMORY}"
    raise RigwatchError(f"no folder can be made for sockets, {expected}")


def how_it_ended(code: int, last_line: str) -> str:
    """An exit code as text, with the last line that the process printed."""
    how = f"ended with code {code}"
    if code < 0:
        how = f"ended by signal {-code}"
        with contextlib.suppress(ValueError):
            how = f"ended by {signal.Signals(-code).name}"
    return f"{how}: {last_line}" if last_line else how
