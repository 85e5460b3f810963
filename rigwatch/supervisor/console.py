"""The supervisor's output for people and programs: a line per event, and a status line."""

import json
import sys
import time
from collections.abc import Callable
from dataclasses import asdict
from typing import TextIO

from rigwatch.supervisor.supervisor import ProcessEvent, Supervisor
from rigwatch.wire.host import Printer

NAME_WIDTH = 10
STATUS_EVERY_TERMINAL = 1.0
STATUS_EVERY_FILE = 30.0
"""Time between two status lines, on a terminal and elsewhere [s]."""


class Flow:
    """Samples through each process: the current rate, and the total over all restarts."""

    def __init__(self, supervisor: Supervisor, clock: Callable[[], float] = time.monotonic) -> None:
        self._supervisor = supervisor
        self._clock = clock
        self._counts: dict[str, int] = {}
        self._marks: dict[str, int] = {}
        self._marked_at = clock()
        self.totals: dict[str, int] = {}
        self.rates: dict[str, float] = {}

    def update(self) -> None:
        """Update with the current counts."""
        for name, watched in self._supervisor.processes.items():
            before, now = self._counts.get(name, 0), watched.vitals.count
            self._counts[name] = now
            # A smaller count belongs to a new run, which starts at 0.
            grown = now - before if now >= before else now
            self.totals[name] = self.totals.get(name, 0) + grown
        passed = self._clock() - self._marked_at
        if passed >= 1.0:
            self.rates = {n: (t - self._marks.get(n, 0)) / passed for n, t in self.totals.items()}
            self._marks, self._marked_at = dict(self.totals), self._clock()


class Console:
    """Prints events and status.

    Args:
        rig: the rig's id, or how many there are.
        as_json: one JSON object a line instead of text.
        out: where it is printed.
    """

    def __init__(self, rig: str, as_json: bool, out: TextIO | None = None) -> None:
        self._rig = rig
        self._json = as_json
        out = out or sys.stdout
        self._on_terminal = out.isatty() and not as_json
        self._printer = Printer(out.fileno(), self._lost)
        self._every = STATUS_EVERY_TERMINAL if self._on_terminal or as_json else STATUS_EVERY_FILE
        self._started_at = self._status_at = time.monotonic()

    def event(self, event: ProcessEvent) -> None:
        """One event, one line."""
        self._print(self._text(event))

    def changed(self, text: str) -> None:
        """One line about the configuration."""
        self.event(ProcessEvent("configuration", "changed", text, 0, 0))

    def remark(self, text: str) -> None:
        """One line of the supervisor itself."""
        self.event(_remark(text))

    def status(self, supervisor: Supervisor, flow: Flow) -> None:
        """The state of all processes, at intervals."""
        now = time.monotonic()
        if now - self._status_at < self._every:
            return
        self._status_at = now
        if self._json:
            self._print(json.dumps({"event": "status", "processes": states(supervisor, flow)}))
            return
        line = status_line(self._rig, now - self._started_at, supervisor, flow)
        if self._on_terminal:
            self._printer.print(f"\r\x1b[K{line}")
        else:
            self._print(line)

    def _print(self, text: str) -> None:
        clear = "\r\x1b[K" if self._on_terminal else ""
        self._printer.print(f"{clear}{text}\n")

    def close(self) -> None:
        """Print the last lines, if the output takes them."""
        self._printer.close()

    def _lost(self, count: int) -> str:
        """The line that says how many could not be printed."""
        return f"{self._text(_remark(f'{count} lines could not be printed'))}\n"

    def _text(self, event: ProcessEvent) -> str:
        if self._json:
            return json.dumps({"event": event.kind, "t": time.time()} | _fields(event))
        mark = "|" if event.kind == "says" else f"{event.kind}:"
        return f"{event.process:{NAME_WIDTH}} {mark} {event.text}"


def _remark(text: str) -> ProcessEvent:
    return ProcessEvent("up", "says", text, 0, 0)


def _fields(event: ProcessEvent) -> dict[str, object]:
    return {name: value for name, value in asdict(event).items() if name != "kind"}


def states(supervisor: Supervisor, flow: Flow) -> dict[str, dict[str, object]]:
    """State, rate [1/s], total, restarts and own status text of each process."""
    return {
        name: {
            "state": watched.state,
            "rate": round(flow.rates.get(name, 0.0), 1),
            "total": flow.totals.get(name, 0),
            "restarts": watched.restarts,
            "status": watched.vitals.status,
            "pid": watched.child.pid,
        }
        for name, watched in supervisor.processes.items()
    }


def status_line(rig: str, seconds: float, supervisor: Supervisor, flow: Flow) -> str:
    """One line: uptime of the rig, and the state of each process."""
    minutes, second = divmod(int(seconds), 60)
    parts = [f"{rig} {minutes}:{second:02}"]
    for name, watched in supervisor.processes.items():
        rate = flow.rates.get(name, 0.0)
        flowing = f" {rate:.0f}/s" if rate and name != "router" else ""
        again = f" ({watched.restarts} restarts)" if watched.restarts else ""
        parts.append(f"{name} {watched.state}{flowing}{again}")
    return " · ".join(parts)
