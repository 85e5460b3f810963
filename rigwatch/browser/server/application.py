"""The application: routes behind the guard."""

import asyncio
import contextlib
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from importlib.resources import files
from pathlib import Path

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from rigwatch.browser.recordings import kept_uploads
from rigwatch.browser.server import (
    editor_routes,
    import_routes,
    job_routes,
    list_routes,
    rig_routes,
    signal_routes,
    study_routes,
)
from rigwatch.browser.server.access import Access, Guard
from rigwatch.browser.server.context import Context
from rigwatch.browser.server.places import UPLOADS
from rigwatch.browser.views import stamp
from rigwatch.browser.work import warm_up
from rigwatch.page import STYLE
from rigwatch.wire.errors import RigwatchError

STATIC = Path(str(files("rigwatch.browser.server").joinpath("static")))


def application(context: Context, access: Access) -> Starlette:
    """The pages of a folder, for requests that `access` allows."""
    routes = [
        Route("/static/page.css", style),
        Mount("/static", StaticFiles(directory=STATIC)),
        *editor_routes.ROUTES,
        *import_routes.ROUTES,
        *rig_routes.ROUTES,
        *signal_routes.ROUTES,
        *job_routes.ROUTES,
        *list_routes.ROUTES,
        *study_routes.ROUTES,
    ]
    app = Starlette(
        routes=routes,
        middleware=[
            Middleware(Guard, access=access),
            Middleware(GZipMiddleware, minimum_size=2000, compresslevel=5),
        ],
        lifespan=_lifespan,
    )
    app.state.context = context
    return app


async def style(_: Request) -> Response:
    """The style of every page."""
    return Response(STYLE, media_type="text/css")


@asynccontextmanager
async def _lifespan(app: Starlette) -> AsyncIterator[None]:
    context: Context = app.state.context
    warm_up()
    with contextlib.suppress(RigwatchError):  # the rig's page shows what is wrong
        rig_routes.link_of(app)
    watching = asyncio.create_task(context.desks.watch(stamp))
    try:
        with kept_uploads(context.places.inside(UPLOADS)):
            yield
    finally:
        watching.cancel()
        context.desks.close()
        if hasattr(app.state, "link"):
            app.state.link.close()
