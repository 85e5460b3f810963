"""Shared by the routes: folders, study processes, and responses of one form."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from functools import wraps
from pathlib import Path
from typing import Any

from starlette.requests import ClientDisconnect, Request
from starlette.responses import PlainTextResponse, Response

from rigwatch.browser.server.places import PlaceError, Places
from rigwatch.browser.work import Desk, Desks, Turns
from rigwatch.wire.errors import RigwatchError, reason_of
from rigwatch.wire.typed_files import JsonError, as_json, json_value

MOST_BODY = 1 << 20
"""Largest request that is not an upload [bytes]."""
NOT_KEPT = {"cache-control": "no-store"}
"""Headers of what browsers shall ask for again."""
LARGEST_NUMBER = 2.0**53
"""Largest number in an address; the integers up to it are exact, and NaN is not below it."""


@dataclass(frozen=True)
class Context:
    """State of the server.

    Attributes:
        places: the folder.
        desks: the studies' processes.
        reading: turns of those who read whole files.
        rig: configuration of a rig, None without one.
        most_upload: largest upload of a recording [bytes].
        stopping: set when the server is about to stop.
    """

    places: Places
    desks: Desks = field(default_factory=Desks)
    reading: Turns = field(default_factory=Turns)
    rig: Path | None = None
    most_upload: int = 1 << 30
    stopping: asyncio.Event = field(default_factory=asyncio.Event)

    def desk(self, request: Request) -> Desk:
        """The desk of the study named in a request.

        Raises:
            RigwatchError: there is no such study, or its files are outside the folder.
        """
        return self.desks.of(self.places.study(request.path_params["name"]))


def context_of(request: Request) -> Context:
    """The server's context."""
    found: Context = request.app.state.context
    return found


def answer(value: Any, status: int = 200) -> Response:
    """A value as a JSON response; non-finite numbers become null."""
    return Response(as_json(value), status, NOT_KEPT, media_type="application/json")


Handler = Callable[[Request], Awaitable[Response]]


def errors_answered(handler: Handler) -> Handler:
    """A handler whose user errors become a one-line response."""

    @wraps(handler)
    async def guarded(request: Request) -> Response:
        try:
            return await handler(request)
        except PlaceError as error:
            return answer({"error": str(error)}, 404)
        except RigwatchError as error:
            return answer({"error": str(error)}, 409)
        except OSError as error:  # a full disk, a folder that may only be read
            return answer({"error": f"{error.filename or 'files'}: {reason_of(error)}"}, 409)
        except ClientDisconnect:
            return answer({"error": "the request ended before its content"}, 400)

    return guarded


async def body_of(request: Request) -> dict[str, Any]:
    """A request's JSON body.

    Raises:
        RigwatchError: it is not JSON, or too long.
    """
    whole = bytearray()
    async for part in request.stream():
        whole += part
        if len(whole) > MOST_BODY:
            raise RigwatchError(f"found more than {MOST_BODY} bytes, expected a short request")
    try:
        return json_value(bytes(whole) or b"{}", dict[str, Any])
    except JsonError as error:
        raise RigwatchError(f"found no JSON: {error}") from None


def number_of(request: Request, name: str) -> float | None:
    """A numeric query parameter, None if missing, invalid or beyond what counts exactly."""
    try:
        found = float(request.query_params[name])
    except (KeyError, ValueError):
        return None
    return found if abs(found) <= LARGEST_NUMBER else None


def refused(text: str, status: int) -> Response:
    """A refusal with its reason as text."""
    return PlainTextResponse(f"rigwatch: {text}\n", status)
