"""From an alarm on the bus to its notification at a webhook, over a real router and witness.

    alarm ─▶ router ─▶ witness ─▶ Apprise ─▶ HTTP ─▶ webhook

Alarms come at random times, so that they meet every phase of the witness's loop. The alarm's own
persistence, and the milliseconds from the sample to the alarm (`latency`), come before.
"""

import json
import random
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from rigwatch.wire.messages import ALARMS, Alarm
from tests.bus.rig import TestRig
from tests.waiting import eventually
from tools.benchmark_table import Row

BAR_S = 1.0
_NONE = float("nan")


class _Handler(BaseHTTPRequestHandler):
    server: "Webhook"

    def do_POST(self) -> None:
        body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        self.server.got[body["title"].rpartition(" ")[2]] = time.monotonic()
        self.send_response(200)
        self.end_headers()

    def log_message(self, *_: object) -> None:
        pass


class Webhook(ThreadingHTTPServer):
    """Notes when each alarm arrives."""

    def __init__(self) -> None:
        self.got: dict[str, float] = {}
        super().__init__(("127.0.0.1", 0), _Handler)
        threading.Thread(target=self.serve_forever, daemon=True).start()


def run(quick: bool) -> list[Row]:
    """Delays of 30 or 1000 alarms."""
    hook = Webhook()
    with TemporaryDirectory() as folder:
        delays = measured(Path(folder), hook, 30 if quick else 1000)
    hook.shutdown()
    p50, p99 = np.percentile(delays, (50, 99))
    measured_text = f"p50 {p50:.2f}, p99 {p99:.2f}, worst {delays.max():.2f} s"
    return [
        Row(
            "alarm on the bus to notification at a webhook",
            measured_text,
            f"p99 < {BAR_S:g} s",
            "",
            f"{len(delays)} alarms at random times",
            passed=bool(p99 < BAR_S),
        )
    ]


def measured(folder: Path, hook: Webhook, count: int) -> np.ndarray:
    """Delays [s], shape (count,)."""
    people = folder / "people.toml"
    url = f"json://127.0.0.1:{hook.server_port}"
    people.write_text(f'[[recipients]]\nname = "hook"\nurl = "{url}"\nlowest = "warning"\n')
    section = f'\n[witness]\npeople = "{people}"\nstale_after = 1e6\n'
    chance = random.Random(1)
    with TestRig(folder, section) as rig:
        rig.router()
        monitor = rig.bus("monitor")
        rig.start("-m", "rigwatch", "witness", str(rig.path))
        eventually(lambda: "alive/witness" in monitor.tokens("alive/*"), "the witness")
        time.sleep(2.0)
        sent: dict[str, float] = {}
        for number in range(count):
            name = f"alarm-{number}"
            sent[name] = time.monotonic()
            monitor.publish(ALARMS, _alarm(name))
            time.sleep(chance.uniform(0.05, 0.35))
        eventually(lambda: len(hook.got) == count, "all notifications")
    return np.array([hook.got[name] - at for name, at in sent.items()])


def _alarm(name: str) -> Alarm:
    figures = (_NONE, _NONE, _NONE)
    return Alarm(
        name, "unacknowledged", "error", "benchmark", "", "rig", 1, 1, time.time_ns(), *figures,
        False, "", 1,
    )  # fmt: skip
