"""Routes of the list of studies: page, table, and events as tasks proceed and studies change."""

import asyncio
import time
from collections.abc import AsyncGenerator, AsyncIterator
from pathlib import Path
from typing import Any, TypeVar

import msgspec
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import Route

from rigwatch.browser.recordings import stories
from rigwatch.browser.server.context import NOT_KEPT, Context, context_of
from rigwatch.browser.server.event_streams import event, event_stream, stalled
from rigwatch.browser.server.study_routes import job_data
from rigwatch.browser.views import listed, render, stamp, study_folders
from rigwatch.browser.work import Job

Change = TypeVar("Change")
EVERY = 0.5
"""Time between checks of the files [s]; changes of tasks are sent at once."""


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
    """The current table of the list."""
    values = await run_in_threadpool(_table, context_of(request))
    return HTMLResponse(render("studies_table.html", **values), headers=NOT_KEPT)


def _table(context: Context) -> dict[str, Any]:
    return {"studies": listed(context.places.root), "folder": context.places.root.name}


async def studies_events(request: Request) -> Response:
    """Server-sent events: "jobs" as tasks proceed, "studies" if the table changes."""
    return event_stream(request, _events(context_of(request)))


async def _events(context: Context) -> AsyncGenerator[bytes, None]:
    queue = context.desks.listeners.listen()
    shown, looked_at = None, time.monotonic()
    look = asyncio.create_task(run_in_threadpool(_shown, context))
    try:
        while True:
            active = _active(context)
            yield stalled(looked_at) or _jobs(context, active)
            async for folder, job in _within(queue, EVERY):
                active = {path: other for path, other in active.items() if path != folder}
                active |= {folder: job} if job.active else {}
                yield stalled(looked_at) or _jobs(context, active)
            if not look.done():
                continue  # a disk may keep it waiting
            looked_at = time.monotonic()
            if shown not in (None, look.result()):
                yield event("studies")
            shown = look.result()
            look = asyncio.create_task(run_in_threadpool(_shown, context))
    finally:
        look.cancel()
        context.desks.listeners.leave(queue)


async def _within(queue: asyncio.Queue[Change], seconds: float) -> AsyncIterator[Change]:
    """What a queue brings within a time [s]."""
    clock = asyncio.get_running_loop().time
    until = clock() + seconds
    while (left := until - clock()) > 0.0:
        try:
            change = await asyncio.wait_for(queue.get(), left)
        except TimeoutError:
            return
        yield change


def _active(context: Context) -> dict[Path, Job]:
    return {path: job for path, job in context.desks.jobs().items() if job.active}


def _jobs(context: Context, active: dict[Path, Job]) -> bytes:
    """The event of the active jobs, by the name of their study."""
    plain = {context.places.relative(path): job_data(job) for path, job in active.items()}
    return event("jobs", msgspec.json.encode(plain))


def _shown(context: Context) -> object:
    """A value that changes with the table: files of studies, and tasks that ended."""
    ended = {folder: job.number for folder, job in context.desks.jobs().items() if not job.active}
    return {folder: stamp(folder) for folder in study_folders(context.places.root)}, ended


ROUTES = [
    Route("/", studies_page),
    Route("/api/studies", studies_table),
    Route("/api/studies/events", studies_events),
]
