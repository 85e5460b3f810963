"""Routes of the editor of own effects and models: check a text, save it into its study."""

from pathlib import Path
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import Route

from rigwatch.browser.server.context import NOT_KEPT, answer, body_of, context_of, errors_answered
from rigwatch.browser.server.places import MODELS, PlaceError
from rigwatch.browser.views import begun_model, checked, first_text, render
from rigwatch.physics.engine.equations import shipped_models
from rigwatch.wire.errors import RigwatchError
from rigwatch.wire.host import replace_file
from rigwatch.workbench.steps import learn_text, remodel
from rigwatch.workbench.study import Study, digest, open_study

KINDS = ("effect", "model")
LONGEST = 200_000
"""Largest text [characters]."""


def _kind(request: Request) -> str:
    kind = str(request.path_params["kind"])
    if kind not in KINDS:
        raise PlaceError(f"{kind!r}: expected one of {', '.join(KINDS)}")
    return kind


def _study(request: Request) -> Study:
    return open_study(context_of(request).places.checked(request.path_params["name"]))


async def edit_page(request: Request) -> Response:
    """The editor, on an own file of a study."""
    name = request.path_params["name"]
    try:
        kind = _kind(request)
        study = await run_in_threadpool(_study, request)
        file, text = first_text(study, kind)
    except RigwatchError as error:
        return _page(request, "", name, "", str(error))
    seen = digest(text) if file in _own(study) else ""
    return _page(request, kind, name, text, file=file, seen=seen)


async def new_model_page(request: Request) -> Response:
    """The editor, on a copy of a shipped model for later studies."""
    like = request.query_params.get("like", "mass-spring-damper")
    if like not in shipped_models():
        return _page(request, "", "", "", f"{like}: no such model")
    file, text = begun_model(like)
    return _page(request, "model", "", text, file=file, like=like)


def _own(study: Study) -> dict[str, str]:
    return {Path(name).name: text for name, text in study.own_files.items()}


def _page(
    request: Request, kind: str, name: str, text: str, trouble: str = "", **more: Any
) -> Response:
    values = {"file": "", "like": "", "seen": ""} | more
    html = render(
        "edit.html", place="edit", has_rig=context_of(request).rig is not None, kind=kind,
        name=name, text=text, trouble=trouble, models=list(shipped_models()), **values,
    )  # fmt: skip
    return HTMLResponse(html, 404 if trouble else 200, headers=NOT_KEPT)


async def check(request: Request) -> Response:
    """Problems of a text, and pictures of what it describes."""
    kind, wanted = _kind(request), await body_of(request)
    name, text = request.path_params["name"], _text(wanted)
    study = await run_in_threadpool(_study, request) if name else None
    model = study.model if study else None
    file = str(wanted.get("file", ""))
    return answer(await run_in_threadpool(checked, kind, file, text, model))


def _text(wanted: dict[str, Any]) -> str:
    text = wanted.get("text")
    if not isinstance(text, str) or len(text) > LONGEST:
        raise RigwatchError(f"text: expected at most {LONGEST} characters")
    return text


async def save(request: Request) -> Response:
    """Write a text into its study with a line of the ledger, or among the models of the folder."""
    kind, wanted = _kind(request), await body_of(request)
    text, file = _text(wanted), str(wanted.get("file", ""))
    if not request.path_params["name"]:
        return await run_in_threadpool(_save_model, request, file, text)
    return await run_in_threadpool(_save, request, kind, file, text, wanted.get("seen"))


def _save(request: Request, kind: str, file: str, text: str, seen: object) -> Response:
    study, name = _study(request), request.path_params["name"]
    context_of(request).places.new(file)
    before = _own(study).get(file)
    if (digest(before) if before is not None else "") != seen:
        raise RigwatchError(
            f"{name}: {file} has been changed elsewhere since this page showed it; nothing was"
            " written. Copy your text, open the page again, and compare"
        )
    if kind == "effect":
        names = learn_text(study, file, text)[1]
        done = f"saved; Explain ranks {', '.join(names)} with the others"
    else:
        remodel(study, file, text)
        done = "saved; the study now uses this model"
    return answer({"text": done, "seen": digest(text)})


def _save_model(request: Request, file: str, text: str) -> Response:
    """Save a model outside of any study; an existing file is not overwritten."""
    path = context_of(request).places.new(file, MODELS)
    if not file.endswith(".toml") or path.exists():
        raise RigwatchError(f"{file}: expected a new name that ends in .toml")
    found = checked("model", file, text, None)
    if not found["usable"]:
        raise RigwatchError(found["problems"][0]["text"])
    path.parent.mkdir(exist_ok=True)
    replace_file(path, text)
    return answer({"text": f"saved as {MODELS}/{file}; New study offers it", "seen": digest(text)})


ROUTES = [
    Route("/edit-model", new_model_page),
    Route("/edit/{kind}/{name:path}", edit_page),
    Route("/api/check/{kind}/{name:path}", errors_answered(check), methods=["POST"]),
    Route("/api/save/{kind}/{name:path}", errors_answered(save), methods=["POST"]),
]
