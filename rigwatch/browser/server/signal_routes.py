"""Routes for chart data: any span, in as many columns as the chart has."""

import math
from functools import lru_cache
from pathlib import Path

import msgspec
import numpy as np
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from rigwatch.browser.server.context import NOT_KEPT, answer, context_of, errors_answered, number_of
from rigwatch.browser.server.places import PlaceError
from rigwatch.browser.signals import Trace, open_trace
from rigwatch.browser.views import figure_csv, figure_svg
from rigwatch.browser.work import RESULTS, Directions, Results, signal_key
from rigwatch.wire.arrays import FloatArray

WIDEST = 4000
CHARTS = {"signals": ("measured", "modelled"), "residual": ("residual",)}
LONGEST_KEY = 128
MOST_SPANS = 400
"""Largest number of spans drawn for a selected region."""


def _results(request: Request) -> Results:
    """The results named in a request by the page's key."""
    folder = context_of(request).places.study(request.path_params["name"])
    key = request.query_params.get("key", "")
    if not key.isalnum() or len(key) > LONGEST_KEY:
        raise PlaceError(f"{key[:LONGEST_KEY]!r}: no key of results")
    return Results(folder / RESULTS / key)


def _lines(request: Request) -> dict[str, Trace]:
    """The lines of a chart by name, the preview last."""
    asked = request.query_params
    results, chart = _results(request), asked.get("chart", "signals")
    use, channel = asked.get("use", "held_out"), asked.get("channel", "")
    if chart not in CHARTS or use not in ("train", "held_out"):
        raise PlaceError(f"{chart} of {use}: no such chart")
    found = {
        line: _trace(results.folder / "signals", signal_key(use, line, channel))
        for line in CHARTS[chart]
    }
    label = asked.get("preview", "")
    if label and chart == "residual":
        preview = _preview(results, label, use, channel, int(number_of(request, "number") or 0))
        if preview is not None:
            found["preview"] = preview
    return found


def _preview(results: Results, label: str, use: str, channel: str, number: int) -> Trace | None:
    """The predicted residual with a candidate: from its fit, otherwise to first order."""
    known = results.read("evidence") or {}
    if label not in known:
        raise PlaceError(f"{label!r}: no candidate of this study")
    try:
        return _trace(results.folder / "previews" / label, signal_key(use, "residual", channel))
    except PlaceError:
        if use != "train" or not results.has("directions"):
            return None
    directions = _directions(results.folder / "directions", _made(results.folder / "directions"))
    if label not in directions.labels or not 0 <= number < directions.channels:
        raise PlaceError(f"{label[:LONGEST_KEY]!r} of channel {number}: no such line of this study")
    return directions.trace(label, number)


def _trace(folder: Path, name: str) -> Trace:
    path = folder / f"{name}.npy"
    if Path(name).name != name or folder.parent not in path.resolve().parents:
        raise PlaceError(f"{name!r}: no line of this study")
    try:
        return _opened(folder, name, _made(path))
    except FileNotFoundError:
        raise PlaceError(f"{name}: not fitted yet") from None


def _made(path: Path) -> int:
    return path.stat().st_mtime_ns


@lru_cache(maxsize=32)
def _opened(folder: Path, name: str, _: int) -> Trace:
    return open_trace(folder, name)


@lru_cache(maxsize=4)
def _directions(folder: Path, _: int) -> Directions:
    return Directions(folder)


def span_of(request: Request, lines: dict[str, Trace]) -> tuple[float, float]:
    """The requested span within the lines' ends [s]."""
    ends = [trace.ends for trace in lines.values()]
    start, end = number_of(request, "from"), number_of(request, "to")
    low, high = min(e[0] for e in ends), max(e[1] for e in ends)
    if start is None or end is None or not (math.isfinite(start) and math.isfinite(end)):
        return low, high
    return max(start, low), min(end, high)


async def signals(request: Request) -> Response:
    """Lines of a chart over a span."""
    return await run_in_threadpool(_signals, request)


def _signals(request: Request) -> Response:
    lines = _lines(request)
    return packed(lines, span_of(request, lines), int(number_of(request, "width") or 1000))


def packed(lines: dict[str, Trace], span: tuple[float, float], columns: int) -> Response:
    """Lines over a span: a head as JSON, then times and values of each.

    Layout: length of the head (4 bytes); the head, padded so that the data start at a multiple of
    8; the times of each line as 64-bit floats, once if all lines have the same; then the values of
    each as 32-bit floats.
    """
    width = min(max(columns, 1), WIDEST)
    cut = {name: trace.between(*span, width) for name, trace in lines.items()}
    whole = [trace.ends for trace in lines.values()]
    times = [x for x, _ in cut.values()]
    if all(np.array_equal(x, times[0]) for x in times[1:]):
        times = times[:1]
    head = msgspec.json.encode(
        {
            "lines": [[name, len(x)] for name, (x, _) in cut.items()],
            "shared": len(times) == 1,
            "ends": [min(e[0] for e in whole), max(e[1] for e in whole)],
        }
    )
    head += b" " * (-(len(head) + 4) % 8)
    at = b"".join(np.ascontiguousarray(x, "<f8").tobytes() for x in times)
    values = b"".join(np.ascontiguousarray(y, "<f4").tobytes() for _, y in cut.values())
    body = len(head).to_bytes(4, "little") + head + at + values
    # Not compressed: noise hardly shrinks, and compressing takes five times as long as all else.
    headers = NOT_KEPT | {"content-encoding": "identity"}
    return Response(body, media_type="application/octet-stream", headers=headers)


async def place(request: Request) -> Response:
    """The samples of a selected region as time spans, and what each candidate explains there."""
    results, number = _results(request), int(number_of(request, "number") or 0)
    path = results.folder / "places" / f"{number}.npy"
    if not path.is_file():
        raise PlaceError(f"{number}: no place with samples")
    spans = await run_in_threadpool(_spans, np.load(path))
    shares: dict[str, float] = {}
    if results.has("directions"):
        folder = results.folder / "directions"
        directions = await run_in_threadpool(_directions, folder, _made(folder))
        shares = await run_in_threadpool(directions.explained, spans)
    return answer({"spans": spans.tolist(), "explained": shares})


def _spans(times: FloatArray) -> FloatArray:
    """Runs of neighbouring samples; if there are too many, the narrowest gaps are closed."""
    if len(times) < 2:
        return np.array([[times[0], times[0]]])
    gaps = np.diff(times)
    widest = np.sort(gaps)[::-1][: MOST_SPANS - 1].min(initial=np.inf)
    step = max(float(np.min(gaps)) * 1.5, float(widest) if len(gaps) >= MOST_SPANS else 0.0)
    cuts = np.flatnonzero(gaps > step)
    first, last = np.concatenate([[0], cuts + 1]), np.concatenate([cuts, [len(times) - 1]])
    return np.stack([times[first], times[last]], axis=1)


async def figure(request: Request) -> Response:
    """A chart over the displayed span, as SVG or CSV."""
    return await run_in_threadpool(_figure, request)


def _figure(request: Request) -> Response:
    lines, kind = _lines(request), request.path_params["kind"]
    asked = request.query_params
    name = f"{asked.get('chart', 'signals')}-{asked.get('channel', '')}.{kind}"
    headers = {"content-disposition": f'attachment; filename="{name}"'}
    span, axis = span_of(request, lines), f"{asked.get('channel', '')} [{asked.get('unit', '')}]"
    if kind == "csv":
        return Response(figure_csv(axis, lines, span), media_type="text/csv", headers=headers)
    title = f"{' and '.join(lines)}, {asked.get('use', 'held_out').replace('_', ' ')}"
    svg = figure_svg(title, axis, lines, span)
    return Response(svg, media_type="image/svg+xml", headers=headers)


ROUTES = [
    Route("/api/signals/{name:path}", errors_answered(signals)),
    Route("/api/place/{name:path}", errors_answered(place)),
    Route("/api/figure.{kind}/{name:path}", errors_answered(figure)),
]
