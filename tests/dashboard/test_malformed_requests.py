"""Whoever asks the viewer's page for something that no browser asks for gets an answer."""

import socket
import struct
import threading
from collections.abc import Iterator
from http.server import HTTPServer
from typing import ClassVar

import pytest

from rigwatch.dashboard.viewer.viewer_page import HOST, Page
from rigwatch.wire.host import free_port
from tests.waiting import eventually
from tests.witness.test_outputs import Switch, serving

MUCH = 16 << 20
"""More than the kernel keeps for a browser that does not read [bytes]."""
ASKED = {
    "another port": b"GET 1/x HTTP/1.1",
    "another host": b"GET .example.org/x HTTP/1.1",
    "a user and another host": b"GET @127.0.0.2/x HTTP/1.1",
    "a character that no address has": b"GET /\x01 HTTP/1.1",
    "letters of no known kind": b"GET /\xff\xfe HTTP/1.1",
    "no path": b"GET HTTP/1.1",
    "a file above the page": b"GET /../../etc/passwd HTTP/1.1",
    "a line without end": b"GET /" + b"a" * 70_000 + b" HTTP/1.1",
}


class Viewer(Switch):
    """Serves something small at any path, and much at one."""

    hits: ClassVar[list[str]] = []

    def do_GET(self) -> None:  # noqa: N802
        if self.path != "/much":
            super().do_GET()
            return
        self.send_response(200)
        self.send_header("Content-Length", f"{MUCH}")
        self.end_headers()
        self.wfile.write(bytes(MUCH))


@pytest.fixture(scope="module")
def page() -> Iterator[int]:
    source = HTTPServer((HOST, 0), Viewer)
    threading.Thread(target=source.serve_forever, daemon=True).start()
    port = free_port()
    served = Page(port, source.server_port, free_port())
    yield port
    served.close()
    source.shutdown()
    source.server_close()


@pytest.mark.parametrize("asked", ASKED.values(), ids=ASKED)
def test_what_no_browser_asks_for_is_answered_without_a_traceback(
    page: int, asked: bytes, capfd: pytest.CaptureFixture[str]
) -> None:
    with socket.create_connection((HOST, page), 30.0) as line:
        line.sendall(asked + b"\r\nHost: x\r\n\r\n")
        answer = line.recv(4096)
    assert any(status in answer for status in (b"200", b"400", b"414", b"502"))
    assert "Traceback" not in capfd.readouterr().err


def test_a_browser_that_goes_away_is_no_traceback(
    page: int, capfd: pytest.CaptureFixture[str]
) -> None:
    before = serving()
    with socket.create_connection((HOST, page), 30.0) as line:
        line.sendall(b"GET /much HTTP/1.1\r\nHost: x\r\n\r\n")
        assert b"200" in line.recv(64)
        line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    eventually(lambda: serving() <= before, "the thread of the connection has ended")
    assert "Traceback" not in capfd.readouterr().err
