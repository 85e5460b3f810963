"""Malformed requests to the viewer's page and to the witness's figures, over real connections.

Mutated are the bytes of requests as a browser and a collector of metrics make them; some clients go
away in the middle of the answer. A crash is an answer 500, a traceback, or a server that does not
answer any more; a hang is an answer that takes more than two seconds of the processor's time.
"""

import contextlib
import io
import os
import random
import socket
import struct
import threading
import time
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from benchmarks.malformed.fuzzed_requests import LONGEST_S, answered
from benchmarks.malformed.mutations import mutated
from rigwatch.dashboard.viewer.viewer_page import Page
from rigwatch.wire.host import free_port
from rigwatch.wire.messages import Health
from rigwatch.wire.rig_config import SecuritySection
from rigwatch.witness.metrics import Endpoint, Figures
from tools.benchmark_table import Row

HOST = "127.0.0.1"
GONE = 0.05
"""Share of the clients that go away without reading the answer."""
HEAD = b"Host: 127.0.0.1\r\nAccept-Encoding: gzip, br\r\nConnection: close\r\n\r\n"
EXAMPLES = (
    b"GET / HTTP/1.1\r\n" + HEAD,
    b"GET /?url=rerun%2Bhttp%3A%2F%2F127.0.0.1%3A9876%2Fproxy HTTP/1.1\r\n" + HEAD,
    b"GET /re_viewer_bg.wasm HTTP/1.1\r\n" + HEAD,
    b"GET /metrics HTTP/1.1\r\n" + HEAD,
    b"GET /metrics?name[]=rigwatch_alarms&name[]=rigwatch_figure HTTP/1.1\r\n" + HEAD,
    b"HEAD / HTTP/1.0\r\n\r\n",
    b"POST / HTTP/1.1\r\nContent-Length: 4\r\n" + HEAD + b"text",
    b"OPTIONS * HTTP/1.1\r\n" + HEAD,
)


class _Viewer(BaseHTTPRequestHandler):
    """Stands for the viewer: a large file at any path."""

    body = bytes(1 << 20)

    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Content-Length", str(len(self.body)))
        self.end_headers()
        with contextlib.suppress(ConnectionError):
            self.wfile.write(self.body)

    def log_message(self, *_: object) -> None:
        pass


def run(quick: bool) -> list[Row]:
    """Ten seconds each, or half of the minutes that RIGWATCH_FUZZ_MINUTES says (default 10)."""
    minutes = float(os.environ.get("RIGWATCH_FUZZ_MINUTES", "10"))
    seconds = 10.0 if quick else 30.0 * minutes
    return [
        _row(name, _fuzzed(serve, seconds), seconds)
        for name, serve in (("the viewer's page", _page), ("the witness's figures", _figures))
    ]


def _page(port: int) -> Callable[[], None]:
    source = ThreadingHTTPServer((HOST, 0), _Viewer)
    threading.Thread(target=source.serve_forever, daemon=True).start()
    page = Page(port, source.server_port, free_port())

    def close() -> None:
        page.close()
        source.shutdown()

    return close


def _figures(port: int) -> Callable[[], None]:
    figures = Figures("bench")
    figures.take_health(Health("daq/rig", 1, "running", "", {"rate_hz": 256.0}), 0.0)
    return Endpoint(f"{HOST}:{port}", figures, SecuritySection()).close


class _Found:
    """What went wrong, by its kind, and the longest answer."""

    def __init__(self) -> None:
        self.wrong: dict[str, bytes] = {}
        self.count, self.slowest_s = 0, 0.0

    def note(self, data: bytes, status: int, spent_s: float, said: str) -> None:
        self.count, self.slowest_s = self.count + 1, max(self.slowest_s, spent_s)
        last = [line for line in said.splitlines() if line and line[0].isalpha()][-1:]
        what = (
            "no answer" if status < 0 else "500" if status == 500
            else "hang" if spent_s > LONGEST_S
            else f"traceback {''.join(last)[:80]}" if "Traceback" in said else ""
        )  # fmt: skip
        if what:
            self.wrong.setdefault(what, data[:120])


def _fuzzed(serve: Callable[[int], Callable[[], None]], seconds: float) -> _Found:
    chance, found, port = random.Random(1), _Found(), free_port()
    close, ends = serve(port), time.monotonic() + seconds
    with contextlib.redirect_stderr(io.StringIO()) as said:
        while time.monotonic() < ends:
            data, began = mutated(chance, EXAMPLES), time.process_time()
            gone = chance.random() < GONE
            status = _left(port, data) if gone else answered(HOST, port, data)
            # A thread of the server may write later: that is told of the next request.
            found.note(data, status, time.process_time() - began, said.getvalue())
            said.truncate(said.seek(0))
    found.note(b"at the end", answered(HOST, port, EXAMPLES[3]) or -1, 0.0, "")
    close()
    return found


def _left(port: int, data: bytes) -> int:
    """Ask and go away; 0, as nothing is read."""
    with contextlib.suppress(OSError), socket.create_connection((HOST, port), 5.0) as line:
        line.sendall(data)
        line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    return 0


def _row(name: str, found: _Found, seconds: float) -> Row:
    wrong = "; ".join(f"{what} by {data!r}" for what, data in found.wrong.items())
    return Row(
        f"malformed requests to {name}",
        f"{len(found.wrong)} crashes or hangs, slowest {found.slowest_s:.2f} s",
        f"0, {LONGEST_S:g} s",
        "",
        f"{found.count} requests in {seconds:.0f} s {wrong}",
        passed=not found.wrong,
    )
