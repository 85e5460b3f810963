"""A session's messages for the screen: as recorded, or computed by the monitor."""

import heapq
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from rigwatch.wire.errors import SessionError

if TYPE_CHECKING:
    from rigwatch.dashboard.continued import Step
    from rigwatch.wire.messages import Message
    from rigwatch.wire.session import Session

Span = tuple[int | None, int | None]
_OTHERS = ["run", "gaps", "health", "events"]
_BLOCK = 64
"""Short blocks, so that text and plots match in time [samples]."""


def messages_of(session: "Session", span: Span, model: Path | None) -> "Iterator[Message]":
    """The messages of a session for the screen.

    Args:
        session: the recording.
        span: the part of it [ns].
        model: compute estimates and alarms with it; None takes the recorded ones.

    Raises:
        ConfigError: the model cannot be read.
    """
    from rigwatch.dashboard.continued import Continued, steps_back
    from rigwatch.wire.session import message_time, standing_alarms

    topics = _OTHERS if model is not None else [*_OTHERS, "alarms"]
    steps = steps_back(session.samples(None, *span))
    others = _others(session, topics, span, steps)
    if model is not None:
        judged = map(Continued(steps).moved, _monitored(session, span, model))
        return heapq.merge(others, judged, key=message_time)
    # Placed at the part's start, where they still hold.
    start = span[0] or 0
    standing = (replace(alarm, t_ns=start) for alarm in standing_alarms(session, span[0]))
    recorded = [map(Continued(steps).moved, found) for found in _recorded(session, span)]
    return heapq.merge(standing, others, *recorded, key=message_time)


def model_for(session: "Session", span: Span, given: Path | None) -> tuple[Path | None, bool]:
    """The model of a session, and whether estimates must be computed with it.

    It is the given one, else the one in the recorded configuration, if it still exists.
    """
    if given is not None:
        return given, True
    recorded = next(session.estimates(None, *span, size=1), None) is not None
    found = _configured_model(session)
    return found, found is not None and not recorded


def length_of(session: "Session", span: Span) -> float:
    """Time from the first to the last sample of the span, as drawn [s]; 0 without samples."""
    from rigwatch.dashboard.continued import drawn_ns

    return drawn_ns(session.samples(None, *span)) / 1e9


def rig_of(session: "Session") -> str:
    """The rig's id, else the session's name."""
    try:
        return session.info.rig
    except SessionError:
        return session.path.stem


def _configured_model(session: "Session") -> Path | None:
    from rigwatch.wire.typed_files import loads

    try:
        name = loads(session.info.configuration).get("monitor", {}).get("model", "")
    except (SessionError, tomllib.TOMLDecodeError):
        return None
    return Path(name) if name and Path(name).is_file() else None


def _others(
    session: "Session", topics: list[str], span: Span, steps: "list[Step]"
) -> "Iterator[Message]":
    """The messages of topics other than those of blocks; samples tell where a clock was set."""
    from rigwatch.dashboard.continued import Continued
    from rigwatch.wire.messages import SAMPLES

    continued, also = Continued(steps), [SAMPLES.name] if steps else []
    for item in session.messages([*also, *topics], *span):
        message = continued.moved(item.message)
        if item.topic is not SAMPLES:
            yield message


def _recorded(session: "Session", span: Span) -> "list[Iterator[Message]]":
    """Samples and estimates in short blocks: a recorder writes long ones."""
    from rigwatch.wire.messages import pieces

    samples = (part for whole in session.samples(None, *span) for part in pieces(whole, _BLOCK))
    estimates = (part for whole in session.estimates(None, *span) for part in pieces(whole, _BLOCK))
    return [samples, estimates]


def _monitored(session: "Session", span: Span, path: Path) -> "Iterator[Message]":
    from monitor.model import load_model
    from monitor.pipeline import RigMonitor
    from rigwatch.wire.messages import pieces

    monitor = RigMonitor(load_model(path))
    for whole in session.samples(None, *span):
        for block in pieces(whole, _BLOCK):
            yield block
            if watched := monitor.update(block):
                yield watched.estimates
                yield from watched.announcements
