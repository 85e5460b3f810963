"""Whoever asks the viewer's page for something that no browser asks for gets an answer."""

import socket
import threading
from collections.abc import Iterator
from http.server import HTTPServer

import pytest

from rigwatch.dashboard.viewer.viewer_page import HOST, Page
from rigwatch.wire.host import free_port
from tests.witness.test_outputs import Switch

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


@pytest.fixture(scope="module")
def page() -> Iterator[int]:
    source = HTTPServer((HOST, 0), type("Viewer", (Switch,), {"hits": []}))
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
