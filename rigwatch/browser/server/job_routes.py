"""Routes for long tasks: start, progress by server-sent events, cancel."""

import asyncio
from collections.abc import AsyncGenerator

import msgspec
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from rigwatch.browser.server.context import answer, body_of, context_of, errors_answered
from rigwatch.browser.server.event_streams import STILL_EVERY, STILL_HERE, event, event_stream
from rigwatch.browser.server.study_routes import job_data
from rigwatch.browser.work import Desk, Told
from rigwatch.wire.errors import RigwatchError
from rigwatch.workbench.study import digest, open_study

ARGUMENTS: dict[str, dict[str, type]] = {
    "show": {"step": int},
    "explain": {},
    "preview": {"effect": str, "port": str},
    "add": {"effect": str, "port": str, "anyway": bool},
    "undo": {},
    "accept_data": {},
    "report": {},
    "rehearse": {},
    "promote": {},
    "rollback": {},
}
"""Tasks that a page may start, with their arguments."""
CHANGES = frozenset({"add", "undo", "accept_data"})
AT_THE_RIG = frozenset({"rehearse", "promote", "rollback"})


async def begin(request: Request) -> Response:
    """Start a task; one at a time per study."""
    wanted = await body_of(request)
    task = str(wanted.get("task", ""))
    if task not in ARGUMENTS:
        raise RigwatchError(f"found task {task!r}, expected one of {', '.join(ARGUMENTS)}")
    arguments = _arguments(task, wanted.get("arguments", {}))
    context, name = context_of(request), request.path_params["name"]
    folder = await run_in_threadpool(context.places.checked, name)
    if task in CHANGES:
        seen = wanted.get("study")
        if seen is not None and digest(open_study(folder).text) != seen:
            raise RigwatchError(
                f"{name}: the study has been changed elsewhere; the page now shows it as it is,"
                " nothing was done"
            )
    if task in AT_THE_RIG:
        if context.rig is None:
            raise RigwatchError(f"{task}: found no rig, expected `rigwatch workbench --rig CONFIG`")
        arguments["rig"] = str(context.rig.resolve())
    return answer(job_data(context.desk(request).ask(task, arguments)), 202)


def _arguments(task: str, given: object) -> dict[str, object]:
    kinds = ARGUMENTS[task]
    found = dict(given) if isinstance(given, dict) else {}
    for name, value in found.items():
        if name not in kinds or not isinstance(value, kinds[name]):
            raise RigwatchError(f"{task}: found {name!r}, expected {', '.join(kinds) or 'nothing'}")
    missing = [n for n in kinds if n not in found and n not in ("anyway", "step")]
    if missing:
        raise RigwatchError(f"{task}: found no {', '.join(missing)}")
    return found


async def cancel(request: Request) -> Response:
    """Cancel the running task; the study is unchanged."""
    return answer({"cancelled": context_of(request).desk(request).cancel()})


async def events(request: Request) -> Response:
    """Server-sent events of a study."""
    desk = context_of(request).desk(request)
    return event_stream(request, _events(desk))


async def _events(desk: Desk) -> AsyncGenerator[bytes, None]:
    queue = desk.listeners.listen()
    try:
        what, job = "job", desk.job
        while True:
            yield event(what, msgspec.json.encode(job_data(job)) if what == "job" else b"{}")
            while (change := await _next(queue)) is None:
                yield STILL_HERE
            what, job = change
    finally:
        desk.listeners.leave(queue)


async def _next(queue: asyncio.Queue[Told]) -> Told | None:
    """What a queue brings next; None if it brings nothing for a while."""
    try:
        return await asyncio.wait_for(queue.get(), STILL_EVERY)
    except TimeoutError:
        return None


ROUTES = [
    Route("/api/begin/{name:path}", errors_answered(begin), methods=["POST"]),
    Route("/api/cancel/{name:path}", errors_answered(cancel), methods=["POST"]),
    Route("/api/events/{name:path}", errors_answered(events)),
]
