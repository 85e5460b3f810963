"""Server-sent events: streams that end when the server does, although a page still listens."""

import asyncio
import contextlib
from collections.abc import AsyncGenerator, AsyncIterator

from starlette.requests import Request
from starlette.responses import StreamingResponse

STILL_HERE = b": still here\n\n"
"""Sent when there is nothing to tell, so that a page that has gone is noticed."""
HEADERS = {"cache-control": "no-store", "x-accel-buffering": "no"}


def event(kind: str, content: bytes = b"{}") -> bytes:
    """One event with JSON as its content."""
    return b"event: " + kind.encode() + b"\ndata: " + content + b"\n\n"


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
