"""Server-sent events: streams that end when the server does, although a page still listens.

What a page shows is as new as the last look behind it. Each stream has an event at least every
`STILL_EVERY` while its looks go on, and says how old the figures are while they stall; a page that
hears nothing for longer takes them for old by itself (`static/stream.js`).
"""

import asyncio
import contextlib
import time
from collections.abc import AsyncGenerator, AsyncIterator

import msgspec
from starlette.requests import Request
from starlette.responses import StreamingResponse

STILL_EVERY = 5.0
"""Longest time without an event while looks go on [s]."""
OLD_AFTER = 10.0
"""Time without a look that ends, after which the pages are told that their figures are old [s]."""
HEADERS = {"cache-control": "no-store", "x-accel-buffering": "no"}


def event(kind: str, content: bytes = b"{}") -> bytes:
    """One event with JSON as its content."""
    return b"event: " + kind.encode() + b"\ndata: " + content + b"\n\n"


STILL_HERE = event("still")
"""Sent when there is nothing to tell, so that a page knows that what it shows is still so, and one
that has gone is noticed."""


def stalled(looked_at: float, why: str = "") -> bytes:
    """The event that says for how long no look has ended; empty while that is usual.

    Args:
        looked_at: end of the last look, monotonic time [s].
        why: what is known of the cause.
    """
    silent = time.monotonic() - looked_at
    if silent <= OLD_AFTER:
        return b""
    return event("old", msgspec.json.encode({"seconds": round(silent), "why": why}))


def event_stream(request: Request, events: AsyncGenerator[bytes, None]) -> StreamingResponse:
    """Events as a response, until the page leaves or the server is stopped."""
    stream = _until(request.app.state.context.stopping, events)
    return StreamingResponse(stream, media_type="text/event-stream", headers=HEADERS)


async def _until(
    stopping: asyncio.Event, events: AsyncGenerator[bytes, None]
) -> AsyncIterator[bytes]:
    stopped = asyncio.create_task(stopping.wait())
    following = asyncio.create_task(anext(events))
    try:
        while True:
            await asyncio.wait({stopped, following}, return_when=asyncio.FIRST_COMPLETED)
            if stopped.done():
                return
            yield following.result()
            following = asyncio.create_task(anext(events))
    except StopAsyncIteration:
        return
    finally:
        stopped.cancel()
        following.cancel()
        with contextlib.suppress(asyncio.CancelledError, StopAsyncIteration):
            await following
        await events.aclose()
