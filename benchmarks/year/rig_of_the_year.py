"""A supervised rig whose processes live by a fast clock, and who listens to it."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Self

from benchmarks.processes.live_rig import ROOT, LiveRig
from benchmarks.year.calendar import BEGIN, ZONE
from benchmarks.year.fast_clock import FastClock
from rigwatch.wire.bus import connect
from rigwatch.wire.messages import ESTIMATES
from sim_plant.serve import ask, control_path
from tests.waiting import wait_until

PROCESSES = ("router", "daq", "monitor", "recorder", "witness")
START_S = 120.0
"""Longest start of all processes, by the machine's clock [s]."""


class Lines:
    """A process that prints a JSON object a line; the objects are handed to `take`."""

    def __init__(
        self, take: Callable[[dict[str, Any]], None], env: dict[str, str], *arguments: str
    ) -> None:
        self.process = subprocess.Popen(
            [sys.executable, *arguments],
            cwd=ROOT,
            env=env,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            bufsize=1,
        )
        self._take = take
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        for line in self.process.stdout or ():
            with contextlib.suppress(ValueError):
                self._take(json.loads(line))

    def say(self, line: str) -> None:
        """A line to its standard input."""
        if self.process.stdin is not None:
            self.process.stdin.write(line + "\n")

    def end(self) -> None:
        """End it by a signal, and by a kill if that does not suffice."""
        self.process.send_signal(signal.SIGTERM)
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(20.0)
        self.process.kill()
        self.process.wait()


class RigOfTheYear:
    """`rigwatch up` and a control room by the fast clock.

    Args:
        rig: configured, not started.
        rate: of the clock, once all processes are up.

    Attributes:
        heard: what the control room heard, in order.
        endings: of processes, by themselves or killed.
    """

    def __init__(self, rig: LiveRig, rate: float) -> None:
        self.rig, self.rate = rig, rate
        self.heard: list[dict[str, Any]] = []
        self.endings: list[dict[str, Any]] = []
        self._answers, self._states = 0, dict[str, str]()
        self._status: dict[str, Any] = {}
        self._estimated_ns = 0.0
        self.clock = FastClock(rig.folder, int(BEGIN * 1e9), 1.0)

    def __enter__(self) -> Self:
        env = {**os.environ, **self.clock.environment, "TZ": ZONE, "PYTHONPATH": str(ROOT)}
        path = str(self.rig.path)
        words = ("-m", "rigwatch", "up", path, "--json", "--without", "dashboard")
        self._up = Lines(self._follow, env, *words)
        self._room = Lines(self._hear, env, "-m", "benchmarks.year.control_room", path)
        self._bus = connect(self.rig.config, "year", START_S)
        self._estimates = self._bus.subscribe_lossy(ESTIMATES, capacity=1)
        if not self.recovered():
            raise TimeoutError(f"the rig did not come up: {self._status}")
        return self

    def __exit__(self, *_: object) -> None:
        self.clock.set_rate(1.0)
        self._bus.close()
        for process in (self._room, self._up):
            process.end()
        self.clock.close()

    def recovered(self) -> bool:
        """At the machine's pace, wait until all processes and estimates are there."""
        self.clock.set_rate(1.0)
        there = wait_until(lambda: self.whole() and self.lag_s() < 1.0, START_S, 0.05)
        self.clock.set_rate(self.rate)
        return there

    def whole(self) -> bool:
        """Whether all processes run and the control room listens."""
        running = all(self._status.get(n, {}).get("state") == "running" for n in PROCESSES)
        return running and all(map(self.alive, PROCESSES)) and bool(self.heard)

    def pid(self, name: str) -> int:
        """The process's number, 0 if there is none."""
        return int(self._status.get(name, {}).get("pid", 0))

    def alive(self, name: str) -> bool:
        """Whether the process of the newest status exists."""
        return self.pid(name) > 0 and Path(f"/proc/{self.pid(name)}").exists()

    def kill(self, name: str) -> None:
        """End a process at once."""
        os.kill(self.pid(name), signal.SIGKILL)

    def ask(self, line: str) -> None:
        """A line to the simulated rig."""
        if line:
            ask(control_path(self.rig.config.rig.id), line)

    def operate(self, *actions: str) -> None:
        """Let the operator act, and wait for the answers."""
        for action in actions:
            before = self._answers
            self._room.say(action)
            wait_until(lambda before=before: self._answers > before, 10.0, 0.01)  # type: ignore[misc]

    def alarms(self) -> Iterator[dict[str, Any]]:
        """Alarms in the order in which they were heard."""
        return (one for one in list(self.heard) if one["kind"] == "alarm")

    def standing(self) -> dict[str, str]:
        """State of each alarm that is not normal, as the control room knows it."""
        return {name: state for name, state in dict(self._states).items() if state != "normal"}

    def lag_s(self) -> float:
        """Age of the newest estimate by the fast clock [s]."""
        for block in self._estimates.drain():  # the newest alone is kept
            self._estimated_ns = float(block.t_ns[-1])
        return (self.clock.wall_ns() - self._estimated_ns) * 1e-9

    def _hear(self, one: dict[str, Any]) -> None:
        # Counted as they come: a year has too many to be looked through again and again.
        self.heard.append(one)
        if one["kind"] == "answer":
            self._answers += 1
        elif one["kind"] == "alarm" and one["severity"] != "info":
            self._states[one["name"]] = one["state"]

    def _follow(self, event: dict[str, Any]) -> None:
        if event["event"] == "status":
            self._status = event["processes"]
        elif event["event"] not in ("starting", "ready", "started"):
            self.endings.append(event)
