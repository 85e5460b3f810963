"""The live page of many rigs: one poll for all open pages, and events for each."""

import asyncio
import contextlib
import time
from collections.abc import AsyncGenerator, AsyncIterator, Callable
from contextlib import asynccontextmanager

import msgspec
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import HTMLResponse, PlainTextResponse, RedirectResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from rigwatch.browser.rig import Faults
from rigwatch.browser.server.access import Access, Guard
from rigwatch.browser.server.application import STATIC, style
from rigwatch.browser.server.context import NOT_KEPT
from rigwatch.browser.server.event_streams import (
    STILL_EVERY,
    STILL_HERE,
    event,
    event_stream,
    stalled,
)
from rigwatch.fleet import Dashboards, RigState, as_live_page, as_part, summary
from rigwatch.wire.errors import RigwatchError

BETWEEN = 2.0
"""Time between two polls of the rigs [s]."""
States = Callable[[], list[RigState]]


class FleetPages:
    """State of the server.

    Args:
        poll: returns the present state of the rigs, the worst first; may take seconds.

    Attributes:
        states: as last seen.
        dashboards: of single rigs, those that were opened.
        stopping: set when the server is about to stop.
    """

    def __init__(self, poll: States) -> None:
        self.states: list[RigState] = []
        self.stopping = asyncio.Event()
        self._poll = poll
        self.dashboards = Dashboards()
        self._news = asyncio.Condition()
        self._looked_at = time.monotonic()
        self._why, self._faults = "", Faults("the look at the rigs")

    async def follow(self) -> None:
        """Poll the rigs, and notify the open pages."""
        while True:
            try:
                states = await asyncio.to_thread(self._poll)
            except Exception as error:  # the pages go on, and say that their figures are old
                self._why = self._faults.told(error)
            else:
                async with self._news:
                    self.states, self._looked_at, self._why = states, time.monotonic(), ""
                    self._news.notify_all()
            await asyncio.sleep(BETWEEN)

    async def events(self) -> AsyncGenerator[bytes, None]:
        """The rigs now, and whenever something has changed; how old they are if polls stall."""
        sent = b""
        while True:
            if old := stalled(self._looked_at, self._why):
                sent = b""  # the next poll is sent whatever it shows
                yield old
            else:
                content = msgspec.json.encode(
                    {"summary": summary(self.states), "html": as_part(self.states)}
                )
                yield STILL_HERE if content == sent else event("rigs", content)
                sent = content
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(STILL_EVERY), self._news:
                    await self._news.wait()


def fleet_application(pages: FleetPages, access: Access) -> Starlette:
    """The page and its events, for requests that `access` allows."""

    @asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        following = asyncio.create_task(pages.follow())
        yield
        following.cancel()
        pages.dashboards.close()

    async def fleet_page(_: Request) -> Response:
        return HTMLResponse(as_live_page(pages.states), headers=NOT_KEPT)

    async def events(request: Request) -> Response:
        return event_stream(request, pages.events())

    async def dashboard(request: Request) -> Response:
        wanted = request.path_params["rig"]
        state = next((state for state in pages.states if state.rig == wanted), None)
        if state is None:
            return PlainTextResponse(f"rigwatch: {wanted}: no such rig here\n", 404)
        if not state.reachable:
            return PlainTextResponse(f"rigwatch: {wanted}: {state.state}\n", 503)
        try:
            return RedirectResponse(await asyncio.to_thread(pages.dashboards.address, state), 303)
        except RigwatchError as error:
            return PlainTextResponse(f"{error}\n", 503)

    routes = [
        Route("/", fleet_page),
        Route("/dashboard/{rig:path}", dashboard),
        Route("/events", events),
        Route("/static/page.css", style),
        Mount("/static", StaticFiles(directory=STATIC)),
    ]
    app = Starlette(routes=routes, middleware=[Middleware(Guard, access=access)], lifespan=lifespan)
    app.state.context = pages
    return app
