"""A request to a URL that another thread can cut, however slowly the server answers.

Time limits of sockets are for each part of an answer: who sends a byte every few seconds, in the
handshake of TLS, the headers or a redirection, would hold a request for ever.
"""

import http.client
import socket
import ssl
import threading
import urllib.error
import urllib.request
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any

from rigwatch.wire.errors import reason_of

Keep = Callable[[socket.socket], None]


class CutRequest:
    """One request, to be asked once.

    Args:
        url: http or https.
        timeout: longest wait for each part of the answer [s].
    """

    def __init__(self, url: str, timeout: float) -> None:
        self._url, self._timeout = url, timeout
        self._lock = threading.Lock()
        self._sockets: list[socket.socket] = []
        self._is_cut = False

    def ask(self) -> str:
        """Why the URL does not answer with success; "" if it does."""
        try:
            with self._opener().open(self._url, timeout=self._timeout):
                return ""
        except urllib.error.HTTPError as error:
            error.close()
            return f"the server answers {error.code}"
        except urllib.error.URLError as error:
            reason = error.reason
            return reason_of(reason) if isinstance(reason, OSError) else str(reason)
        except (ValueError, http.client.InvalidURL):
            return "the address is not valid"
        except http.client.HTTPException:
            return "the answer is not HTTP"
        except OSError as error:
            return reason_of(error)
        finally:
            self._close()

    def cut(self) -> None:
        """End the connections, and with them a call of `ask`; those made later as well."""
        with self._lock:
            self._is_cut = True
            for kept in self._sockets:
                _shut(kept)

    def _keep(self, connected: socket.socket) -> None:
        # A second descriptor: TLS takes the first one over, and responses close it.
        with self._lock:
            self._sockets.append(connected.dup())
            if self._is_cut:
                _shut(connected)

    def _close(self) -> None:
        with self._lock:
            for kept in self._sockets:
                kept.close()
            self._sockets.clear()

    def _opener(self) -> urllib.request.OpenerDirector:
        opener = urllib.request.OpenerDirector()
        for handler in (
            urllib.request.ProxyHandler(),
            _Handler(self._keep),
            urllib.request.HTTPDefaultErrorHandler(),
            urllib.request.HTTPRedirectHandler(),
            urllib.request.HTTPErrorProcessor(),
        ):
            opener.add_handler(handler)
        return opener


class _Handler(urllib.request.AbstractHTTPHandler):
    """Opens http and https, and hands over each socket as soon as it is connected."""

    http_request = https_request = urllib.request.AbstractHTTPHandler.do_request_

    def __init__(self, keep: Keep) -> None:
        super().__init__()
        self._keep = keep

    def http_open(self, req: urllib.request.Request) -> http.client.HTTPResponse:
        return self.do_open(partial(_Plain, self._keep), req)

    def https_open(self, req: urllib.request.Request) -> http.client.HTTPResponse:
        context = _Context(ssl.PROTOCOL_TLS_CLIENT)
        context.keep = self._keep
        context.load_default_certs()
        return self.do_open(http.client.HTTPSConnection, req, context=context)


class _Plain(http.client.HTTPConnection):
    def __init__(self, keep: Keep, *words: Any, **named: Any) -> None:
        super().__init__(*words, **named)
        self._keep = keep

    def connect(self) -> None:
        super().connect()
        self._keep(self.sock)


class _Context(ssl.SSLContext):
    """Hands over the socket before the handshake."""

    keep: Keep

    def wrap_socket(self, sock: socket.socket, *words: Any, **named: Any) -> ssl.SSLSocket:
        self.keep(sock)
        return super().wrap_socket(sock, *words, **named)


def _shut(connected: socket.socket) -> None:
    with suppress(OSError):
        connected.shutdown(socket.SHUT_RDWR)
