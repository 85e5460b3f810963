"""Runs the server: on loopback only, unless a secure connection to another address is set up."""

import asyncio
import contextlib
import socket
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import uvicorn
from starlette.applications import Starlette

from rigwatch.browser.server.access import Access, hosts_of
from rigwatch.browser.server.application import application
from rigwatch.browser.server.context import Context
from rigwatch.browser.server.fleet_pages import FleetPages, States, fleet_application
from rigwatch.browser.server.places import Places
from rigwatch.wire.errors import RigwatchError, reason_of

LOCAL = ("127.0.0.1", "localhost", "::1")
STOP_WITHIN = 2


@dataclass(frozen=True)
class Listening:
    """Where pages are served.

    Attributes:
        address, port: to listen on; port 0 takes a free one.
        certificate, key: of TLS.
        behind_proxy: host names of a reverse proxy in front of it, which terminates TLS.
    """

    address: str = "127.0.0.1"
    port: int = 0
    certificate: Path | None = None
    key: Path | None = None
    behind_proxy: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Options(Listening):
    """How the pages of a folder are served.

    Attributes:
        folder: the served folder.
        rig: configuration of a rig to show.
        most_upload: largest upload of a recording [bytes].
    """

    folder: Path
    rig: Path | None = None
    most_upload: int = 1 << 30


class _Server(uvicorn.Server):
    """One that ends its event streams first: pages that are open would keep it from stopping."""

    def __init__(self, config: uvicorn.Config, stopping: asyncio.Event) -> None:
        super().__init__(config)
        self._stopping = stopping

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Stop."""
        self._stopping.set()
        await super().shutdown(sockets)


def serve(options: Options, ready: Callable[[str], None]) -> None:
    """Serve until interrupted; `ready` is called with the address to open.

    Raises:
        RigwatchError: an address other than loopback without TLS, or the port is in use.
    """
    if not options.folder.is_dir():
        raise RigwatchError(f"{options.folder}: no such folder, expected one for studies")
    context = Context(
        Places(options.folder.resolve()), rig=options.rig, most_upload=options.most_upload
    )
    _serve(options, lambda access: application(context, access), context.stopping, ready)


def serve_fleet(poll: States, options: Listening, ready: Callable[[str], None]) -> None:
    """Serve the page of many rigs until interrupted; the rest as in `serve`.

    Args:
        poll: returns the present state of the rigs, the worst first.
        options: where.
        ready: called with the address to open.

    Raises:
        RigwatchError: an address other than loopback without TLS, or the port is in use.
    """
    pages = FleetPages(poll)
    _serve(options, lambda access: fleet_application(pages, access), pages.stopping, ready)


def _serve(
    options: Listening,
    made: Callable[[Access], Starlette],
    stopping: asyncio.Event,
    ready: Callable[[str], None],
) -> None:
    _check(options)
    listening = _listen(options)
    port = int(listening.getsockname()[1])
    secure = bool(options.certificate or options.behind_proxy)
    names = [*LOCAL, options.address, *([socket.gethostname()] if secure else [])]
    hosts = hosts_of(names, port) | frozenset(name.lower() for name in options.behind_proxy)
    access = Access(hosts, secure)
    config = uvicorn.Config(
        made(access), log_level="warning", access_log=False, lifespan="on",
        ssl_certfile=options.certificate, ssl_keyfile=options.key, proxy_headers=False,
        server_header=False, timeout_graceful_shutdown=STOP_WITHIN, limit_concurrency=400,
        h11_max_incomplete_event_size=1 << 16,
    )  # fmt: skip
    where = options.behind_proxy[0] if options.behind_proxy else f"{_shown(options)}:{port}"
    ready(f"{'https' if secure else 'http'}://{where}/?token={access.token}")
    with contextlib.suppress(KeyboardInterrupt):
        _Server(config, stopping).run(sockets=[listening])


def _check(options: Listening) -> None:
    if bool(options.certificate) != bool(options.key):
        raise RigwatchError("--certificate: found one of certificate and key, expected both")
    if options.address not in LOCAL and not (options.certificate or options.behind_proxy):
        raise RigwatchError(
            f"--address: found {options.address}, which others can reach; expected 127.0.0.1, or"
            " --certificate and --key, or --behind-proxy NAME"
        )


def _listen(options: Listening) -> socket.socket:
    family = socket.AF_INET6 if ":" in options.address else socket.AF_INET
    found = socket.socket(family, socket.SOCK_STREAM)
    found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        found.bind((options.address, options.port))
        # A browser given the address may connect before the server listens.
        found.listen(128)
    except OSError as error:
        found.close()
        raise RigwatchError(
            f"{options.address}:{options.port}: {reason_of(error)}, expected a free port"
        ) from error
    return found


def _shown(options: Listening) -> str:
    return f"[{options.address}]" if ":" in options.address else options.address
