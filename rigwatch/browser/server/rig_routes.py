"""Routes of the rig's page: live signals, alarms, a study from an alarm."""

import time

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import Route

from rigwatch.browser.rig import RigLink, study_of_alarm
from rigwatch.browser.server.context import answer, body_of, context_of, told
from rigwatch.browser.server.places import PlaceError
from rigwatch.browser.views import render
from rigwatch.wire.access import operator_name
from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.messages import AlarmCommand

ACTIONS = ("acknowledge", "reset")


def _link(request: Request) -> RigLink:
    """The rig's link, opened on first use."""
    rig = context_of(request).rig
    if rig is None:
        raise PlaceError("no rig: start `rigwatch workbench` with --rig CONFIG")
    state = request.app.state
    if not hasattr(state, "link"):
        state.link = RigLink(rig)
    found: RigLink = state.link
    return found


async def rig_page(request: Request) -> Response:
    """The page."""
    context = context_of(request)
    if context.rig is None:
        return HTMLResponse(render("rig.html", place="rig", has_rig=False, rig=""), 404)
    name = _link(request).config.rig.id
    return HTMLResponse(render("rig.html", place="rig", has_rig=True, rig=name))


async def rig_now(request: Request) -> Response:
    """Latest signals and alarms."""
    return answer(await run_in_threadpool(_link(request).seen))


async def rig_alarm(request: Request) -> Response:
    """Acknowledge or reset an alarm."""
    wanted = await body_of(request)
    name, action = str(wanted.get("name", "")), wanted.get("action")
    if action not in ACTIONS:
        raise RigwatchError(f"found action {action!r}, expected one of {', '.join(ACTIONS)}")
    user = operator_name(_link(request).config.bus)
    command = AlarmCommand(name, action, user, time.time_ns(), "from the workbench")
    changed, refusal = await run_in_threadpool(_link(request).command, command)
    if refusal:
        raise RigwatchError(refusal)
    return answer({"changed": [alarm.name for alarm in changed]})


async def rig_study(request: Request) -> Response:
    """Create a study from an alarm."""
    wanted, link, places = await body_of(request), _link(request), context_of(request).places
    alarm = link.alarm(str(wanted.get("name", "")))
    if alarm is None:
        raise PlaceError(f"{wanted.get('name')!r}: no alarm of this rig")
    study = await run_in_threadpool(study_of_alarm, places.root, link.config, alarm)
    return answer({"study": places.relative(study.folder)})


ROUTES = [
    Route("/rig", rig_page),
    Route("/api/rig", told(rig_now)),
    Route("/api/rig/alarm", told(rig_alarm), methods=["POST"]),
    Route("/api/rig/study", told(rig_study), methods=["POST"]),
]
