"""Kill -9 of the workbench's server, or of a study's process, during add and undo."""

import http.client
import json
import random
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import psutil

from rigwatch.workbench.study import FILE, digest, open_study
from tests.browser.page import Served
from tests.waiting import PATIENCE, wait_until

LEDGER = "ledger.jsonl"
EFFECT = {"effect": "constant_force", "port": "load"}


@dataclass
class Kills:
    """A study that is changed through its server, which is killed meanwhile.

    Attributes:
        root: folder with the study.
        name: of the study.
        moments: draws when and whom to kill.
        longest: time of the longest step so far [s].
        steps: lines that were written.
        wrong: what was found wrong after a kill.
    """

    root: Path
    name: str
    moments: random.Random
    longest: float = 0.5
    steps: int = 0
    wrong: list[str] = field(default_factory=list)
    served: Served | None = None

    def run(self, count: int) -> None:
        """Kill `count` times."""
        try:
            self._whole_step()
            for number in range(count):
                self._kill(server=number % 4 == 0)
            self._whole_step()
        finally:
            if self.served is not None:
                self.served.end()

    def _whole_step(self) -> None:
        """A step that is not disturbed: how long one takes, and that work goes on after kills."""
        before = len(self._ledger())
        self._begin()
        begun = time.monotonic()
        if not wait_until(lambda: self._state() not in ("waiting", "running"), PATIENCE):
            self.wrong.append("a step did not end")
        self.longest = max(self.longest, time.monotonic() - begun)
        self._judge(before, self._state() == "done")

    def _kill(self, *, server: bool) -> None:
        before = len(self._ledger())
        earlier = (self.root / self.name / LEDGER).read_bytes()
        self._begin()
        time.sleep(self.moments.uniform(0, 1.1 * self.longest))
        done = self._state() == "done"
        assert self.served is not None
        if server:
            family = psutil.Process(self.served.process.pid).children(recursive=True)
            self.served.process.kill()
            self.served.process.wait()
            wait_until(lambda: all(_ended(one) for one in family), PATIENCE)
            self.served = None
        else:
            self._kill_worker()
        if not (self.root / self.name / LEDGER).read_bytes().startswith(earlier):
            self.wrong.append("the ledger lost a line")
        self._judge(before, done)

    def _kill_worker(self) -> None:
        assert self.served is not None
        found = workers(self.served)
        for worker in found:
            worker.kill()
        wait_until(lambda: all(_ended(worker) for worker in found), PATIENCE)
        wait_until(lambda: self._state() not in ("waiting", "running"), PATIENCE)

    def _judge(self, before: int, done: bool) -> None:
        """Study and ledger agree; what was reported as done is in both."""
        study = open_study(self.root / self.name)
        lines = self._ledger()
        added = len(lines) - before
        self.steps += added
        effects = [f"{a.effect}@{a.port}" for a in study.file.effects]
        last = lines[-1]
        if (last["effects"], last["study"]) != (effects, digest(study.text)):
            self.wrong.append(f"the ledger ends with {last['effects']}, the study has {effects}")
        if not int(done) <= added <= 1:
            self.wrong.append(f"{added} lines were added by a step that was done: {done}")

    def _ledger(self) -> list[dict[str, Any]]:
        whole = (self.root / self.name / LEDGER).read_bytes().splitlines()
        return [json.loads(line) for line in whole]

    def _begin(self) -> None:
        task = "undo" if "[[effects]]" in (self.root / self.name / FILE).read_text() else "add"
        body = {"task": task, "arguments": EFFECT if task == "add" else {}}
        self._ask("POST", f"/api/begin/{self.name}", json.dumps(body))

    def _state(self) -> str:
        """State of the server's last task."""
        job = json.loads(self._ask("GET", f"/api/parts/{self.name}"))["job"]
        return job["state"] if job else ""

    def _ask(self, method: str, path: str, body: str | None = None) -> str:
        self.served = self.served or Served(self.root)
        line = http.client.HTTPConnection(self.served.address.removeprefix("http://"), timeout=60)
        head = {"Authorization": self.served.bearer, "Origin": self.served.address}
        line.request(method, path, body, head)
        answer = line.getresponse()
        text = answer.read().decode()
        line.close()
        assert answer.status < 300, text
        return text


def _ended(process: psutil.Process) -> bool:
    """Whether it has ended; it may not have been waited for."""
    try:
        return process.status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return True


def workers(served: Served) -> list[psutil.Process]:
    """Processes of the studies: children of the process that the server forks them from."""
    return [
        worker
        for child in psutil.Process(served.process.pid).children()
        for worker in child.children()
    ]
