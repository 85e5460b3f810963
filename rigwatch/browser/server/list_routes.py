"""Routes of the list of studies: page, table, and events as tasks go on and studies change."""

import asyncio
from collections.abc import AsyncIterator
from typing import Any

import msgspec
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response, StreamingResponse
from starlette.routing import Route

from rigwatch.browser.recordings import stories
from rigwatch.browser.server.context import Context, context_of
from rigwatch.browser.server.study_routes import job_data
from rigwatch.browser.views import listed, render, stamp, study_folders

EVERY = 0.5
"""Time between looks at the tasks and at the files [s]."""


async def studies_page(request: Request) -> Response:
    """The list of studies."""
    context = context_of(request)
    values = await run_in_threadpool(_table, context)
    return HTMLResponse(
        render(
            "studies.html", **values, place="studies", has_rig=context.rig is not None,
            stories=stories(context.places.root),
        )
    )  # fmt: skip


async def studies_table(request: Request) -> Response:
    """The table of the list, as it is now."""
    values = await run_in_threadpool(_table, context_of(request))
    return HTMLResponse(
        render("studies_table.html", **values), headers={"cache-control": "no-store"}
    )


def _table(context: Context) -> dict[str, Any]:
    return {"studies": listed(context.places.root), "folder": context.places.root.name}


async def studies_events(request: Request) -> Response:
    """Server-sent events: "jobs" as tasks go on, "studies" if the table changes."""
    headers = {"cache-control": "no-store", "x-accel-buffering": "no"}
    events = _events(context_of(request))
    return StreamingResponse(events, media_type="text/event-stream", headers=headers)


async def _events(context: Context) -> AsyncIterator[bytes]:
    running, shown = b"", await run_in_threadpool(_shown, context)
    while True:
        now = await run_in_threadpool(_shown, context)
        if now != shown:
            yield b"event: studies\ndata: {}\n\n"
        jobs = msgspec.json.encode(_running(context))
        changed = jobs != running
        yield b"event: jobs\ndata: " + jobs + b"\n\n" if changed else b": still here\n\n"
        running, shown = jobs, now
        await asyncio.sleep(EVERY)


def _running(context: Context) -> dict[str, dict[str, Any] | None]:
    """The active jobs by the name of their study."""
    found = context.desks.jobs().items()
    return {context.places.relative(path): job_data(job) for path, job in found if job.active}


def _shown(context: Context) -> object:
    """What tells that the table would be another one: files of studies, tasks that ended."""
    ended = {folder: job.number for folder, job in context.desks.jobs().items() if not job.active}
    return {folder: stamp(folder) for folder in study_folders(context.places.root)}, ended


ROUTES = [
    Route("/", studies_page),
    Route("/api/studies", studies_table),
    Route("/api/studies/events", studies_events),
]
