"""Serves the viewer's web page with a rule for the browser: connect to this machine only.

As shipped, the page reports usage, asks for updates and loads fonts and examples from the internet,
with no switch for that. The rule is a Content-Security-Policy, which browsers enforce.
"""

import contextlib
import http.client
import threading
import urllib.error
import urllib.parse
import urllib.request
from email.message import Message
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from rigwatch.wire.errors import RigwatchError, reason_of

HOST = "127.0.0.1"
_TIMEOUT = 10.0
_HANDED_ON = ("Content-Type", "Content-Encoding", "Cache-Control")


class PageError(RigwatchError):
    """The page cannot be served."""


class Page:
    """A page server on this machine only.

    Args:
        port: port for browsers.
        source_port: port on which the viewer serves the page.
        data_port: data port for the page.

    Raises:
        PageError: the port is taken.
    """

    def __init__(self, port: int, source_port: int, data_port: int) -> None:
        source = f"http://{HOST}:{source_port}"
        data = urllib.parse.quote(f"rerun+http://{HOST}:{data_port}/proxy", safe="")
        values = {"source": source, "rule": policy(data_port), "start": f"/?url={data}"}
        handler = type("Handler", (_Handler,), values)
        try:
            self._server = ThreadingHTTPServer((HOST, port), handler)
        except OSError as error:
            raise PageError(f"port {port}: {reason_of(error)}: configure another") from error
        self._server.daemon_threads = True
        threading.Thread(target=self._server.serve_forever, name="page", daemon=True).start()

    def close(self) -> None:
        """Stop serving."""
        self._server.shutdown()
        self._server.server_close()


def policy(data_port: int) -> str:
    """The policy: what the page may load and where it may connect."""
    data = " ".join(f"http://{name}:{data_port}" for name in (HOST, "localhost"))
    return (
        "default-src 'self' 'unsafe-inline' 'wasm-unsafe-eval' data: blob:; "
        f"connect-src 'self' data: blob: {data}"
    )


class _Handler(BaseHTTPRequestHandler):
    timeout = _TIMEOUT
    source = ""
    rule = ""
    start = "/"

    def handle(self) -> None:
        """Answer; a browser may go away in the middle of it, as when its page is closed."""
        with contextlib.suppress(ConnectionError):
            super().handle()

    def do_GET(self) -> None:
        """Forward the viewer's content at this path; the bare page gets the address of its data."""
        if self.path == "/":
            self._send_to_start()
            return
        if not self.path.startswith("/"):
            # It would become part of the viewer's address.
            self.send_error(400, "not a path")
            return
        request = urllib.request.Request(self.source + self.path)
        request.add_header("Accept-Encoding", self.headers.get("Accept-Encoding", ""))
        try:
            with urllib.request.urlopen(request, timeout=_TIMEOUT) as answer:
                self._reply(answer.status, answer.headers, answer.read())
        except urllib.error.HTTPError as error:
            self._reply(error.code, error.headers, error.read())
        except (ValueError, http.client.InvalidURL):
            self.send_error(400, "not a path")
        except (OSError, http.client.HTTPException):
            self.send_error(502, "the viewer does not answer")

    def _send_to_start(self) -> None:
        self.send_response(302)
        self.send_header("Location", self.start)
        self.send_header("Content-Length", "0")
        self.end_headers()

    def _reply(self, status: int, found: Message, body: bytes) -> None:
        self.send_response(status)
        for name in filter(found.get, _HANDED_ON):
            self.send_header(name, found[name])
        self.send_header("Content-Security-Policy", self.rule)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002
        """Log nothing: requests are of no interest to users."""
