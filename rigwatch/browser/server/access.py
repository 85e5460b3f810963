"""Access control: checks Host, token and Origin of every request, and limits what a page may load.

A page of another site in the user's browser must not reach this server: DNS rebinding to 127.0.0.1
fails at the Host check, a form or script of another site at the Origin check, and requests without
a token are refused.
"""

import secrets
from collections.abc import Iterable
from dataclasses import dataclass, field
from http.cookies import CookieError, SimpleCookie

from starlette.datastructures import Headers, MutableHeaders, QueryParams
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

POLICY = {
    "content-security-policy": "default-src 'self'; img-src 'self' data:; frame-ancestors 'none';"
    " base-uri 'none'; form-action 'self'; object-src 'none'",
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
}
SAFE = frozenset({"GET", "HEAD"})


@dataclass(frozen=True)
class Access:
    """Rules for requests.

    Attributes:
        hosts: allowed values of `Host`, with the port.
        secure: whether the server is reached by https.
        token: required once in the address; then kept in a cookie.
    """

    hosts: frozenset[str]
    secure: bool = False
    token: str = field(default_factory=lambda: secrets.token_urlsafe(24))

    def origins(self) -> frozenset[str]:
        """Allowed values of `Origin`."""
        scheme = "https" if self.secure else "http"
        return frozenset(f"{scheme}://{host}" for host in self.hosts)

    def refusal(self, method: str, headers: Headers, token: str) -> tuple[int, str] | None:
        """Status and reason of a refusal, None if the request is allowed."""
        if headers.get("host", "").lower() not in self.hosts:
            return 421, "found another Host than this server's"
        if not secrets.compare_digest(token.encode(), self.token.encode()):
            return 403, "found no token: open the address that `rigwatch workbench` printed"
        if method not in SAFE and headers.get("origin", "").lower() not in self.origins():
            return 403, "found another Origin than this server's"
        return None


def hosts_of(names: Iterable[str], port: int) -> frozenset[str]:
    """Allowed values of `Host` for some names; the port is optional if it is the default one."""
    plain = [f"[{name}]" if ":" in name and name[0] != "[" else name.lower() for name in names]
    usual = plain if port in (80, 443) else []
    return frozenset([*usual, *(f"{name}:{port}" for name in plain)])


class Guard:
    """Passes requests that `Access` allows, and tells browsers to load nothing from other sites.

    Args:
        app: the guarded application.
        access: rules for requests.
    """

    def __init__(self, app: ASGIApp, access: Access) -> None:
        self._app, self._access = app, access

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        answer = self._answer(scope)
        await (answer or self._app)(scope, receive, _with_policy(send))

    def _answer(self, scope: Scope) -> Response | None:
        headers, query = Headers(scope=scope), QueryParams(scope["query_string"])
        given = query.get("token", "")
        token = given or _cookie(headers) or _bearer(headers)
        refused = self._access.refusal(scope["method"], headers, token)
        if refused:
            return PlainTextResponse(f"rigwatch: {refused[1]}\n", refused[0])
        if given and scope["method"] == "GET":
            answer = RedirectResponse(scope["path"], 303)
            name, secure = cookie_name(headers.get("host", "")), self._access.secure
            answer.set_cookie(name, given, httponly=True, samesite="strict", secure=secure)
            return answer
        return None


def cookie_name(host: str) -> str:
    """Name of the cookie with the token: browsers keep one jar for all ports of a machine.

    Args:
        host: of the request, with its port.
    """
    port = host.rpartition(":")[2]
    return f"rigwatch-{port}" if port.isdecimal() else "rigwatch"


def _cookie(headers: Headers) -> str:
    try:
        found = SimpleCookie(headers.get("cookie", "")).get(cookie_name(headers.get("host", "")))
    except CookieError:
        return ""
    return found.value if found else ""


def _bearer(headers: Headers) -> str:
    kind, _, token = headers.get("authorization", "").partition(" ")
    return token if kind.lower() == "bearer" else ""


def _with_policy(send: Send) -> Send:
    async def sent(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in POLICY.items():
                headers.setdefault(name, value)
        await send(message)

    return sent
