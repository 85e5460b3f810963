"""Malformed requests to the workbench in the browser, a real server: it answers each, and in time.

Examples are the requests that its pages make, to a folder with a study and a recording. Mutated are
bytes of the address, values of the query, the type of any value in a body, or bytes of the request.
A crash is an answer 500, a traceback, or the server's end; a hang is an answer that takes more than
two seconds of the processor's time.
"""

import contextlib
import http.client
import json
import os
import random
import shutil
import socket
import tempfile
import time
from pathlib import Path
from typing import Any
from urllib.parse import quote

import psutil

from benchmarks.malformed.mutations import mutated
from rigwatch.browser.recordings import begin_story
from tests.browser.page import Served
from tools.benchmark_table import Row

LONGEST_S = 2.0
PATIENCE_S = 30.0
"""Longest wait for an answer on a busy machine [s]."""
VALUES: tuple[Any, ...] = (
    None, True, -1, 0, 2**63, 1e308, -0.5, "", "x", "../..", "a" * 5000, "\x00", "\ud800", [], [1],
    {}, {"a": {}}, [[[]]], float("nan"),
)  # fmt: skip
NUMBERS = ("nan", "inf", "-inf", "-1", "1e400", "9" * 400, "0.5", "", "x", "1e18")
Example = tuple[str, str, dict[str, str], dict[str, Any] | bytes | None]


def examples(study: str, recording: str) -> tuple[Example, ...]:
    """Requests as the pages make them: method, path, query, body."""
    span = {"session": recording, "use": "train", "start": 0.0, "end": 1.0}
    mapping = {"channels": {"position": "x[mm]"}, "time": "t[ms]"}
    signals = {"key": "a" * 8, "chart": "residual", "use": "train", "channel": "position",
               "from": "0", "to": "1", "width": "900", "preview": "x", "number": "1"}  # fmt: skip
    effect = '[effects.mine]\nport = "force"\nexpression = "c*v"\n'
    return (
        ("GET", "/", {}, None),
        ("GET", "/new", {}, None),
        ("GET", "/edit-model", {"like": "mass-spring-damper"}, None),
        ("GET", f"/edit/effect/{study}", {}, None),
        ("GET", f"/api/parts/{study}", {"step": "0"}, None),
        ("GET", f"/api/candidate/{study}", {"label": "x", "step": "1"}, None),
        ("GET", f"/api/signals/{study}", signals, None),
        ("GET", f"/api/figure.svg/{study}", signals, None),
        ("GET", f"/api/place/{study}", {"key": "a" * 8, "number": "1"}, None),
        ("GET", f"/api/file/report/{study}", {}, None),
        ("GET", "/api/recordings", {}, None),
        ("GET", f"/api/recording/{recording}", {}, None),
        ("GET", f"/api/recording-signals/{recording}",
         {"channel": "position", "from": "0", "to": "1", "width": "900"}, None),
        ("GET", "/api/template/emps", {}, None),
        ("PUT", "/api/upload/a.csv", {}, b"t,x\n0,1\n4,2\n8,3\n"),
        ("POST", "/api/import", {}, {"upload": "a/a.csv", "name": "a", "mapping": mapping}),
        ("POST", "/api/import-preview", {}, {"upload": "a/a.csv", "mapping": mapping}),
        ("POST", "/api/new", {}, {"name": "made", "begin": "emps", "spans": [span]}),
        ("POST", f"/api/cancel/{study}", {}, {}),
        ("POST", f"/api/begin/{study}", {}, {"task": "show", "arguments": {"step": 99}}),
        ("POST", f"/api/begin/{study}", {},
         {"task": "add", "study": "s", "arguments": {"effect": "x", "port": "x", "anyway": True}}),
        ("POST", f"/api/check/effect/{study}", {}, {"file": "mine.toml", "text": effect}),
        ("POST", "/api/check/model/", {}, {"file": "mine.toml", "text": "[model]\n"}),
        ("POST", f"/api/save/effect/{study}", {},
         {"file": "mine.toml", "text": "[effects.", "seen": ""}),
        ("POST", "/api/rig/alarm", {}, {"name": "link", "action": "reset"}),
        ("POST", "/api/rig/study", {}, {"name": "link"}),
    )  # fmt: skip


class Client:
    """Sends requests as a page does, and keeps what went wrong.

    Args:
        served: the server.
        chance: of the mutations.
    """

    def __init__(self, served: Served, chance: random.Random) -> None:
        self.served, self._chance = served, chance
        self._server = psutil.Process(served.process.pid)
        self.wrong: dict[str, str] = {}
        self.count, self.slowest = 0, 0.0

    def try_one(self, example: Example) -> None:
        """One mutation of an example, by its values or by its bytes."""
        method, path, query, body = example
        kind = self._chance.randrange(4)
        if kind == 0:
            path = quote(mutated(self._chance, (path.encode(),)), safe="/%~")
        if kind == 1 and query:
            query = {**query, self._chance.choice(list(query)): self._chance.choice(NUMBERS)}
        if isinstance(body, dict) and body and kind > 0:
            body = changed(self._chance, body)
        data = body if isinstance(body, bytes) else json.dumps(body or {}).encode()
        if kind == 3 and method != "GET":
            data = mutated(self._chance, (data,))
        asked = "&".join(f"{name}={quote(value)}" for name, value in query.items())
        raw = self._request(method, f"{path}?{asked}" if asked else path, data)
        if self._chance.random() < 0.1:
            raw = mutated(self._chance, (raw,))
        self._send(raw)

    def _request(self, method: str, path: str, data: bytes) -> bytes:
        host = self.served.address.removeprefix("http://")
        head = (
            f"{method} {path} HTTP/1.1\r\nHost: {host}\r\nOrigin: {self.served.address}\r\n"
            f"Authorization: {self.served.bearer}\r\nConnection: close\r\n"
            f"Content-Length: {len(data)}\r\n\r\n"
        )
        return head.encode() + data

    def _send(self, raw: bytes) -> None:
        host, _, port = self.served.address.removeprefix("http://").rpartition(":")
        before, said = self._spent(), len(self.served.said)
        status = answered(host, int(port), raw)
        spent = self._spent() - before
        self.count, self.slowest = self.count + 1, max(self.slowest, spent)
        trouble = "".join(self.served.said[said:])
        what = (
            "no answer" if status < 0 else "500" if status == 500
            else "hang" if spent > LONGEST_S else "traceback" if "Traceback" in trouble else ""
        )  # fmt: skip
        if self.served.process.poll() is not None:
            what = "the server ended"
        if what:
            last = trouble.strip().splitlines()[-1:] or [""]
            where = raw.split(b"?")[0].split(b" HTTP")[0][:24].decode(errors="replace")
            self.wrong.setdefault(f"{what} {last[0].partition(':')[0]} {where}", repr(raw)[:400])

    def _spent(self) -> float:
        """Processor time of the server [s]; its workers are for tasks that may be long."""
        try:
            times = self._server.cpu_times()
        except psutil.Error:
            return 0.0
        return float(times.user + times.system)


def changed(chance: random.Random, body: dict[str, Any]) -> dict[str, Any]:
    """A body in which one value, at any depth, is another."""
    made: dict[str, Any] = json.loads(json.dumps(body))
    at: Any = made
    while True:
        keys = list(at) if isinstance(at, dict) else list(range(len(at)))
        key = chance.choice(keys)
        deeper = isinstance(at[key], dict | list) and len(at[key]) > 0
        if not deeper or chance.random() < 0.3:
            at[key] = chance.choice(VALUES)
            return made
        at = at[key]


def answered(host: str, port: int, raw: bytes) -> int:
    """The answer's status, 0 if the server closes the line without one, -1 if none comes."""
    try:
        with socket.create_connection((host, port), timeout=PATIENCE_S) as line:
            with contextlib.suppress(ConnectionError):
                line.sendall(raw)
                line.shutdown(socket.SHUT_WR)
            answer = http.client.HTTPResponse(line)
            answer.begin()
            with contextlib.suppress(http.client.HTTPException):
                answer.read(1 << 16)
            return answer.status
    except TimeoutError:
        return -1
    except (OSError, http.client.HTTPException):
        return 0


def run(quick: bool) -> list[Row]:
    """Twenty seconds, or as many minutes as RIGWATCH_FUZZ_MINUTES says (default 10)."""
    seconds = 20.0 if quick else 60.0 * float(os.environ.get("RIGWATCH_FUZZ_MINUTES", "10"))
    root = Path(tempfile.mkdtemp(prefix="rigwatch-requests-"))
    served = None
    try:
        study = begin_story(root, "emps")
        served = Served(root, "--most-upload", "8")
        recording = next(root.rglob("*.mcap")).relative_to(root).as_posix()
        client = Client(served, random.Random(1))
        planned, ends = examples(study, recording), time.monotonic() + seconds
        turns = random.Random(2)
        while time.monotonic() < ends and served.process.poll() is None:
            client.try_one(turns.choice(planned))
    finally:
        if served is not None:
            served.end()
        shutil.rmtree(root, ignore_errors=True)
    return [_row(client, seconds)]


def _row(client: Client, seconds: float) -> Row:
    found = "; ".join(f"{what} by {raw}" for what, raw in client.wrong.items())
    return Row(
        "malformed requests to the workbench in the browser",
        f"{len(client.wrong)} crashes or hangs, slowest {client.slowest:.2f} s",
        f"0, {LONGEST_S:g} s",
        "",
        f"{client.count} requests in {seconds:.0f} s {found}",
        passed=not client.wrong,
    )
