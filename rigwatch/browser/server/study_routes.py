"""Routes of study pages and their parts."""

from pathlib import Path
from typing import Any

import msgspec
from markupsafe import Markup
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, Response
from starlette.routing import Route

from rigwatch.browser.rig import can_roll_back, study_in_force
from rigwatch.browser.server.context import (
    NOT_KEPT,
    Context,
    answer,
    context_of,
    errors_answered,
    number_of,
)
from rigwatch.browser.server.places import PlaceError
from rigwatch.browser.views import AtRig, candidate_html, parts_of, render, state_of
from rigwatch.browser.work import Job, model_in_force
from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.typed_files import as_json


def _step(request: Request) -> int | None:
    step = number_of(request, "step")
    return None if step is None else int(step)


async def study_page(request: Request) -> Response:
    """One study; its model is fitted if it has not been yet."""
    context, name = context_of(request), request.path_params["name"]
    values: dict[str, Any] = {
        "name": name, "model": "", "trouble": "", "parts": {}, "state": "",
        "place": "study", "has_rig": context.rig is not None,
    }  # fmt: skip
    try:
        folder = await run_in_threadpool(context.places.checked, name)
        state, parts = await run_in_threadpool(_drawn, folder, name, _step(request), context)
    except RigwatchError as error:
        return HTMLResponse(render("study.html", **(values | {"trouble": str(error)})), 404)
    shown = {name: Markup(html) for name, html in parts.items()}
    values |= {"model": state["model"], "parts": shown, "state": _script(state)}
    return HTMLResponse(render("study.html", **values), headers=NOT_KEPT)


async def study_parts(request: Request) -> Response:
    """The parts of a study's page and the data for its script."""
    context, name = context_of(request), request.path_params["name"]
    folder = await run_in_threadpool(context.places.checked, name)
    state, parts = await run_in_threadpool(_drawn, folder, name, _step(request), context)
    return answer({"parts": parts, "state": state, "job": job_data(context.desk(request).job)})


async def study_candidate(request: Request) -> Response:
    """One candidate of the ranking, with the evidence for it."""
    context, name = context_of(request), request.path_params["name"]
    folder, label = context.places.study(name), request.query_params.get("label", "")
    state = await run_in_threadpool(state_of, folder, name, _step(request))
    return answer({"html": candidate_html(state, label)})


async def study_file(request: Request) -> Response:
    """A file created from a study: its report, or the excitation of the next experiment."""
    context, name = context_of(request), request.path_params["name"]
    kind = request.url.path.split("/")[3]
    folder = await run_in_threadpool(context.places.checked, name)
    state = await run_in_threadpool(state_of, folder, name)
    path = state.results.folder / FILES[kind]
    if not path.is_file():
        raise PlaceError(f"{name}: found no {kind}, expected it to be made first")
    return FileResponse(path, filename=f"{folder.name}-{FILES[kind]}")


def _drawn(
    folder: Path, name: str, step: int | None, context: Context
) -> tuple[dict[str, Any], dict[str, str]]:
    state = state_of(folder, name, step)
    return state.plain(), parts_of(state, _at_rig(context))


def _at_rig(context: Context) -> AtRig | None:
    """The rig to promote to; what is wrong with its configuration is said on its own page."""
    rig = context.rig
    if rig is None:
        return None
    try:
        study = study_in_force(rig, context.places.root)
        return AtRig(rig, model_in_force(rig), study, can_roll_back(rig))
    except RigwatchError:
        return AtRig(rig)


def _script(state: dict[str, Any]) -> Any:
    return Markup(as_json(state).decode().replace("<", "\\u003c"))


def job_data(job: Job | None) -> dict[str, Any] | None:
    """A job as JSON for the pages."""
    if job is None:
        return None
    plain: dict[str, Any] = msgspec.to_builtins(job)
    return plain | {"active": job.active}


FILES = {"report": "report.html", "experiment": "experiment.csv"}
ROUTES = [
    Route("/api/file/report/{name:path}", errors_answered(study_file)),
    Route("/api/file/experiment/{name:path}", errors_answered(study_file)),
    Route("/study/{name:path}", study_page),
    Route("/api/parts/{name:path}", errors_answered(study_parts)),
    Route("/api/candidate/{name:path}", errors_answered(study_candidate)),
]
