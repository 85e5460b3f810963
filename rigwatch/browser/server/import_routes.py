"""Routes for uploading, inspecting and importing recordings, and for new studies and stories."""

import contextlib
from pathlib import Path
from typing import Any

import msgspec
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import Route

from rigwatch.browser.recordings import (
    begin_story,
    channels_of,
    check_session,
    contents_of,
    import_preview,
    known_channels,
    make_study,
    new_upload,
    recordings_in,
    template_data,
    template_names,
)
from rigwatch.browser.server.context import (
    Context,
    answer,
    body_of,
    context_of,
    errors_answered,
    number_of,
    refused,
)
from rigwatch.browser.server.places import MODELS, RECORDINGS, UPLOADS, PlaceError
from rigwatch.browser.server.signal_routes import packed, span_of
from rigwatch.browser.signals import open_trace
from rigwatch.browser.views import render
from rigwatch.browser.work import apart
from rigwatch.wire.errors import ImportDataError, RigwatchError
from rigwatch.wire.exchange import ImportMapping, import_file
from rigwatch.wire.session import SUFFIX
from rigwatch.wire.typed_files import as_kind

MOST_PREVIEW = 64 << 20
"""Largest file of which a preview is made [bytes]: an import reads any, in the same time, once."""
OWN = "own:"
"""Start of the name of an own model that a study begins with."""


async def new_page(request: Request) -> Response:
    """The page for creating a study."""
    context = context_of(request)
    return HTMLResponse(
        render(
            "new.html", place="new", has_rig=context.rig is not None,
            begin=template_names(context.places.root / MODELS), most=context.most_upload >> 20,
        )
    )  # fmt: skip


async def bring(request: Request) -> Response:
    """Receive a file of bounded size; responds with its content."""
    context = context_of(request)
    name, most = request.path_params["file"], context.most_upload
    context.places.new(name)
    length = request.headers.get("content-length", "")
    if length.isdigit() and int(length) > most:
        return refused(f"found {int(length) >> 20} MB, expected at most {most >> 20} MB", 413)
    folder = new_upload(context.places.inside(UPLOADS))
    path = folder / name
    if not await _written(request, path, most):
        return refused(f"found more than {most >> 20} MB, expected less", 413)
    try:
        look = await _contents(context, path)
        return answer({"upload": f"{folder.name}/{name}", "look": look})
    except RigwatchError as error:
        _gone(path)
        raise ImportDataError(str(error).replace(f"{path}", name)) from None


async def _contents(context: Context, path: Path) -> Any:
    """Content of an uploaded file; None for a session, which needs no mapping."""
    if path.suffix == SUFFIX:
        await context.reading.run(apart, check_session, path)
        return None
    return await context.reading.run(apart, contents_of, path)


async def _written(request: Request, path: Path, most: int) -> bool:
    """Write a request's body to a file; returns whether its size is allowed."""
    size, whole = 0, False
    try:
        with path.open("wb") as file:
            async for part in request.stream():
                size += len(part)
                if size > most:
                    return False
                file.write(part)
        whole = True
    finally:
        if not whole:
            _gone(path)
    return True


def _gone(path: Path) -> None:
    """Remove an upload and the folder that was made for it."""
    with contextlib.suppress(OSError):
        path.unlink(missing_ok=True)
        path.parent.rmdir()


async def take_in(request: Request) -> Response:
    """Import an uploaded file as a session."""
    context, wanted = context_of(request), await body_of(request)
    source = _uploaded(context, wanted)
    target = context.places.new(f"{wanted.get('name', '')}{SUFFIX}", RECORDINGS)
    target.parent.mkdir(exist_ok=True)
    if target.exists():
        raise ImportDataError(f"{target.name}: there is one already, expected another name")
    if source.suffix == SUFFIX:
        source.rename(target)
        _gone(source)
        return answer({"recording": context.places.relative(target), "remarks": []})
    mapping = _mapping(wanted.get("mapping"))
    try:
        made = await context.reading.run(apart, import_file, source, target, mapping)
    except RigwatchError as error:
        # Nothing is left of it; what stands there another request has brought meanwhile.
        raise ImportDataError(str(error).replace(str(source), source.name)) from None
    _gone(source)
    return answer(
        {
            "recording": context.places.relative(target),
            "samples": made.samples,
            "rate": made.rate_hz,
            "remarks": list(made.remarks),
        }
    )


async def preview(request: Request) -> Response:
    """An uploaded file as it would be imported; nothing is kept."""
    context, wanted = context_of(request), await body_of(request)
    source = _uploaded(context, wanted)
    mapping = _mapping(wanted.get("mapping"))
    if (size := source.stat().st_size) > MOST_PREVIEW:
        found = f"found {size >> 20} MB, expected at most {MOST_PREVIEW >> 20} MB"
        raise ImportDataError(f"{source.name}: {found} for a preview: import it without one")
    try:
        return answer(await context.reading.run(apart, import_preview, source, mapping))
    except RigwatchError as error:
        raise ImportDataError(str(error).replace(str(source), source.name)) from None


def _uploaded(context: Context, wanted: dict[str, Any]) -> Path:
    uploads = context.places.inside(UPLOADS)
    source = context.places.inside(f"{UPLOADS}/{wanted.get('upload')}")
    if not (source.is_file() and source.is_relative_to(uploads)):
        raise PlaceError("found no uploaded file, expected one")
    return source


def _mapping(given: object) -> ImportMapping:
    try:
        return as_kind(given, ImportMapping)
    except msgspec.ValidationError as error:
        raise ImportDataError(f"mapping: {error}") from None


async def recordings(request: Request) -> Response:
    """The recordings of the folder."""
    root = context_of(request).places.root
    return answer(await run_in_threadpool(recordings_in, root))


async def recording(request: Request) -> Response:
    """Channels and length of a recording."""
    return answer((await _channels(request))[1])


async def recording_signals(request: Request) -> Response:
    """A channel of a recording, for its chart."""
    kept, found = await _channels(request)
    channel = request.query_params.get("channel", "")
    if channel not in found["channels"]:
        raise PlaceError(f"{channel!r}: no channel of this recording")
    lines = {channel: open_trace(kept.folder / "signals", channel)}
    return packed(lines, span_of(request, lines), int(number_of(request, "width") or 1000))


async def _channels(request: Request) -> Any:
    context = context_of(request)
    root, path = context.places.root, context.places.inside(request.path_params["file"])
    if path.suffix != SUFFIX or not path.is_file():
        raise PlaceError(f"{path.name}: no recording")
    known = await run_in_threadpool(known_channels, root, path)
    return known or await context.reading.run(channels_of, root, path)


async def template(request: Request) -> Response:
    """A template's recordings."""
    return answer(template_data(request.path_params["template"]))


async def make(request: Request) -> Response:
    """Create a study."""
    places, wanted = context_of(request).places, await body_of(request)
    folder = places.new(str(wanted.get("name", "")))
    spans = []
    for part in _spans(wanted.get("spans", [])):
        path = places.inside(str(part.get("session", "")))
        if not path.is_file():
            raise PlaceError(f"{part.get('session')}: no such recording")
        spans.append(
            (str(part.get("use")), path, _seconds(part, "start") or 0.0, _seconds(part, "end"))
        )
    begin, own = str(wanted.get("begin", "")), None
    if begin.startswith(OWN):
        own = places.inside(f"{MODELS}/{begin.removeprefix(OWN)}")
        if own.suffix != ".toml" or not own.is_file():
            raise PlaceError(f"{begin}: no such model")
    study = await run_in_threadpool(make_study, folder, begin, spans, own)
    return answer({"study": places.relative(study.folder)})


def _spans(given: object) -> list[dict[str, Any]]:
    """The spans of a request, each an object."""
    if not isinstance(given, list) or not all(isinstance(part, dict) for part in given):
        raise RigwatchError("spans: expected a list of objects with session, use, start and end")
    return given


def _seconds(part: dict[str, Any], name: str) -> float | None:
    value = part.get(name)
    if value is not None and not isinstance(value, int | float):
        raise RigwatchError(f"{name}: found {value!r}, expected seconds")
    return value


async def story(request: Request) -> Response:
    """Start a story."""
    root = context_of(request).places.root
    made = await run_in_threadpool(begin_story, root, request.path_params["story"])
    return answer({"study": made})


ROUTES = [
    Route("/new", new_page),
    Route("/api/upload/{file}", errors_answered(bring), methods=["PUT"]),
    Route("/api/import", errors_answered(take_in), methods=["POST"]),
    Route("/api/import-preview", errors_answered(preview), methods=["POST"]),
    Route("/api/recordings", errors_answered(recordings)),
    Route("/api/recording/{file:path}", errors_answered(recording)),
    Route("/api/recording-signals/{file:path}", errors_answered(recording_signals)),
    Route("/api/template/{template}", errors_answered(template)),
    Route("/api/new", errors_answered(make), methods=["POST"]),
    Route("/api/story/{story}", errors_answered(story), methods=["POST"]),
]
