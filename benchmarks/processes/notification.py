"""From an alarm, or a fault in the samples, to the notification at a webhook.

    alarm ─▶ router ─▶ witness ─▶ Apprise ─▶ HTTP ─▶ webhook

Alarms come at random times, so that they meet every phase of the witness's loop. Faults are counted
from the sample that raises the alarm (`notified_faults.py`), so its persistence is not in the time.
"""

import json
import random
import re
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.processes.notified_faults import delays
from rigwatch.wire.messages import ALARMS as TOPIC
from rigwatch.wire.messages import HEALTH, Alarm
from tests.bus.rig import TestRig
from tests.waiting import eventually
from tools.benchmark_table import Row

BAR_S = 1.0
ALARMS = 500
"""Alarms of one rig: of more different ones than a monitor can have, listeners take no notice."""
_NONE = float("nan")
_HEADLINE = re.compile(r"^(?:warning|error|critical): ([^\s:,]+)", re.MULTILINE)
"""An alarm in the title of a message, or in a line of one of many."""


class _Handler(BaseHTTPRequestHandler):
    server: "Webhook"

    def do_POST(self) -> None:
        body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        self.server.note(body["title"], body["message"])
        self.send_response(200)
        self.end_headers()

    def log_message(self, *_: object) -> None:
        pass


class Webhook(ThreadingHTTPServer):
    """Notes when each alarm arrives, alone or with others in one message."""

    def __init__(self) -> None:
        self.got: dict[str, float] = {}
        super().__init__(("127.0.0.1", 0), _Handler)
        threading.Thread(target=self.serve_forever, daemon=True).start()

    def note(self, title: str, text: str) -> None:
        """Note the alarms of a message."""
        now = time.monotonic()
        for name in _HEADLINE.findall(f"{title.partition('] ')[2]}\n{text}"):
            self.got.setdefault(name, now)

    def people(self) -> str:
        """A file of people with this webhook as the only one."""
        url = f"json://127.0.0.1:{self.server_port}"
        return f'[[recipients]]\nname = "hook"\nurl = "{url}"\nlowest = "warning"\n'


def run(quick: bool) -> list[Row]:
    """Delays of the alarms of 1 or 2 rigs, and of the faults of 1 or 20."""
    hook = Webhook()
    alarms = np.concatenate(
        [measured(hook, seed, 30 if quick else ALARMS) for seed in range(1 if quick else 2)]
    )
    faults = delays(1 if quick else 20, hook.people(), hook.got)
    hook.shutdown()
    return [
        _row("alarm on the bus", alarms, f"{len(alarms)} alarms at random times"),
        _row("faulty sample on the bus", faults, f"{len(faults)} faults at random times"),
    ]


def _row(what: str, seconds: np.ndarray, note: str) -> Row:
    p50, p99 = np.percentile(seconds, (50, 99))
    return Row(
        f"{what} to notification at a webhook",
        f"p50 {p50:.2f}, p99 {p99:.2f}, worst {seconds.max():.2f} s",
        f"p99 < {BAR_S:g} s",
        "",
        note,
        passed=bool(p99 < BAR_S),
    )


def measured(hook: Webhook, seed: int, count: int) -> np.ndarray:
    """Delays of the alarms of one rig [s], shape (count,)."""
    hook.got.clear()
    with TemporaryDirectory() as folder:
        return _delays(Path(folder), hook, random.Random(seed), count)


def _delays(folder: Path, hook: Webhook, chance: random.Random, count: int) -> np.ndarray:
    people = folder / "people.toml"
    people.write_text(hook.people())
    section = f'\n[witness]\npeople = "{people}"\nstale_after = 1e6\n'
    with TestRig(folder, section) as rig:
        rig.router()
        monitor = rig.bus("monitor")
        rig.start("-m", "rigwatch", "witness", str(rig.path))
        # Its first report says that it listens; its token appears before.
        healths = monitor.subscribe(HEALTH)
        eventually(lambda: any(one.source == "witness" for one in healths.drain()), "the witness")
        sent: dict[str, float] = {}
        for number in range(count):
            name = f"alarm-{number}"
            sent[name] = time.monotonic()
            monitor.publish(TOPIC, _alarm(name))
            time.sleep(chance.uniform(0.05, 0.35))
        eventually(lambda: sent.keys() <= hook.got.keys(), "all notifications")
    return np.array([hook.got[name] - at for name, at in sent.items()])


def _alarm(name: str) -> Alarm:
    figures = (_NONE, _NONE, _NONE)
    return Alarm(
        name, "unacknowledged", "error", "benchmark", "", "rig", 1, 1, time.time_ns(), *figures,
        False, "", 1,
    )  # fmt: skip
