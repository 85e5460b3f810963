"""Routes of the rig's page: live signals, alarms, promotions, a study from an alarm."""

import asyncio
import time
from collections.abc import AsyncGenerator
from pathlib import Path
from typing import Any

import msgspec
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import Route

from rigwatch.browser.rig import (
    RigLink,
    TooSoonError,
    can_roll_back,
    promotions,
    roll_back,
    study_of_alarm,
)
from rigwatch.browser.server.context import answer, body_of, context_of, errors_answered
from rigwatch.browser.server.event_streams import STILL_HERE, event, event_stream, stalled
from rigwatch.browser.server.places import PlaceError
from rigwatch.browser.views import listed, render
from rigwatch.wire.access import operator_name
from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.messages import AlarmCommand
from rigwatch.wire.typed_files import as_json

ACTIONS = ("acknowledge", "reset")
EVERY = 0.25
"""Time between events [s]."""


def _link(request: Request) -> RigLink:
    return link_of(request.app)


def link_of(app: Starlette) -> RigLink:
    """The rig's link, opened on first use.

    Raises:
        RigwatchError: there is no rig, or its configuration cannot be read.
    """
    rig: Path | None = app.state.context.rig
    if rig is None:
        raise PlaceError("no rig: start `rigwatch workbench` with --rig CONFIG")
    if not hasattr(app.state, "link"):
        app.state.link = RigLink(rig)
    found: RigLink = app.state.link
    return found


async def rig_page(request: Request) -> Response:
    """The page."""
    context = context_of(request)
    if context.rig is None:
        return HTMLResponse(render("rig.html", place="rig", has_rig=False, rig="", trouble=""), 404)
    try:
        name, trouble = _link(request).config.rig.id, ""
    except RigwatchError as error:
        name, trouble = context.rig.stem, str(error)
    return HTMLResponse(render("rig.html", place="rig", has_rig=True, rig=name, trouble=trouble))


async def rig_now(request: Request) -> Response:
    """Latest signals, alarms and states."""
    link = _link(request)
    _, signals = await run_in_threadpool(link.signals, 0)
    return answer(signals | await run_in_threadpool(link.status))


async def rig_events(request: Request) -> Response:
    """Server-sent events: new signals a few times a second, alarms and states when they change."""
    return event_stream(request, _events(_link(request)))


async def _events(link: RigLink) -> AsyncGenerator[bytes, None]:
    since, sent = 0, b""
    while True:
        if old := stalled(link.looked_at):
            sent = b""  # the next poll is sent whatever it shows
            yield old
            await asyncio.sleep(EVERY)
            continue
        status = as_json(link.status())
        if status != sent:
            sent = status
            yield event("status", status)
        newest, signals = link.signals(since)
        if newest != since:
            since = newest
            yield event("signals", msgspec.json.encode(signals))
        else:
            yield STILL_HERE
        await asyncio.sleep(EVERY)


async def rig_history(request: Request) -> Response:
    """Promotions of the rig's model, and the studies with effects that could be promoted."""
    link, root = _link(request), context_of(request).places.root
    return answer(await run_in_threadpool(_history, link.path, root))


def _history(rig: Path, root: Path) -> dict[str, Any]:
    studies = [
        {
            "name": one.name,
            "effects": [f"{a.effect}@{a.port}" for a in one.state.whole.file.effects],
        }
        for one in listed(root)
        if one.state is not None and one.state.whole.file.effects
    ]
    history = promotions(rig, root)
    return {"history": history, "can_roll_back": can_roll_back(rig), "studies": studies}


async def rig_rollback(request: Request) -> Response:
    """Restore the previous model of the rig's monitor."""
    link, root = _link(request), context_of(request).places.root
    done = await run_in_threadpool(roll_back, link.path, root)
    if not done.reply.done:
        raise RigwatchError(done.reply.text)
    return answer({"text": f"the previous model is {done.reply.text}"})


async def rig_alarm(request: Request) -> Response:
    """Acknowledge or reset an alarm."""
    wanted = await body_of(request)
    name, action = str(wanted.get("name", "")), wanted.get("action")
    if action not in ACTIONS:
        raise RigwatchError(f"found action {action!r}, expected one of {', '.join(ACTIONS)}")
    user = operator_name(_link(request).config.bus)
    command = AlarmCommand(name, action, user, time.time_ns(), "from the workbench")
    said = await run_in_threadpool(_link(request).command, command)
    if said.refusal:
        raise RigwatchError(said.refusal)
    return answer({"changed": [alarm.name for alarm in said.changed]})


async def rig_study(request: Request) -> Response:
    """Create a study from an alarm, or say for how long its fault is still to be recorded [s]."""
    wanted, link, places = await body_of(request), _link(request), context_of(request).places
    alarm = link.alarm(str(wanted.get("name", "")))
    if alarm is None:
        raise PlaceError(f"{wanted.get('name')!r}: no alarm of this rig")
    try:
        study = await run_in_threadpool(study_of_alarm, places.root, link.config, alarm)
    except TooSoonError as error:
        return answer({"wait": error.seconds})
    return answer({"study": places.relative(study.folder)})


ROUTES = [
    Route("/rig", rig_page),
    Route("/api/rig", errors_answered(rig_now)),
    Route("/api/rig/events", errors_answered(rig_events)),
    Route("/api/rig/history", errors_answered(rig_history)),
    Route("/api/rig/rollback", errors_answered(rig_rollback), methods=["POST"]),
    Route("/api/rig/alarm", errors_answered(rig_alarm), methods=["POST"]),
    Route("/api/rig/study", errors_answered(rig_study), methods=["POST"]),
]
