"""Writes new files from recorded sessions: `recover` saves intact data, `trim` cuts by time."""

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from rigwatch.wire.errors import SessionError
from rigwatch.wire.messages import ALARMS, Alarm, Block, Message, RunInfo, SampleBlock, blocks
from rigwatch.wire.new_file import new_file
from rigwatch.wire.session.reader import LostSpan, Recorded, Session
from rigwatch.wire.session.writer import SessionWriter, message_time, run_info

FLUSH_EVERY = 4096
"""Messages per chunk."""
_DATED_NS = round(datetime(2000, 1, 1, tzinfo=UTC).timestamp() * 1e9)
"""Earliest Unix time that is a date [ns]; imported logs may begin at zero."""
_UNDATED_NS = round(datetime(9999, 12, 31, tzinfo=UTC).timestamp() * 1e9)
"""Unix time from which none is a date [ns]: a year has four digits."""


@dataclass(frozen=True, slots=True)
class Written:
    """The content of a new session file.

    Attributes:
        path: the new file.
        messages: number of messages per topic.
        samples: number of samples.
        lost: unreadable parts of the old session.
        notes: remarks for people, such as a reconstructed description of the run.
    """

    path: Path
    messages: dict[str, int]
    samples: int
    lost: tuple[LostSpan, ...]
    notes: str = ""


def recover(session: Session, target: Path) -> Written:
    """Everything intact of `session` in one new, closed and indexed file at `target`.

    Raises:
        SessionError: the target exists or cannot be written.
    """
    run, notes = _run_or_substitute(session)
    written = copy_messages(session.messages(), run, target)
    return replace(written, lost=session.lost, notes=notes)


def _run_or_substitute(session: Session) -> tuple[RunInfo, str]:
    try:
        return session.info, ""
    except SessionError:
        notes = "recovered; the description of the run was lost, its rate is that of the samples"
        return run_info("unknown", _rate(session), t_ns=first_time(session), notes=notes), notes


def _rate(session: Session) -> float:
    """Median rate of the first samples [Hz], 0 if there are too few."""
    first = next(session.samples(), None)
    if first is None or len(first) < 2:
        return 0.0
    step = float(np.median(np.diff(first.t_ns)))
    return 1e9 / step if step > 0 else 0.0


def first_time(session: Session) -> int:
    """Time of the first sample, else of the first message [ns]; 0 if there is none."""
    first = next(session.samples(size=1), None)
    if first is not None:
        return int(first.t_ns[0])
    return next((message_time(item.message) for item in session.messages()), 0)


def trim(session: Session, target: Path, start: int | None, end: int | None) -> Written:
    """The part of `session` in [start, end) [ns], cut at the sample, as one new file at `target`.

    It keeps the description of the run and the alarms active at the start of the part.

    Raises:
        SessionError: the span has no samples, or the target exists or cannot be written.
    """
    run = session.info
    cut = f"trimmed to {_text(start, 'the start')} … {_text(end, 'the end')}"
    run = replace(run, notes=f"{run.notes}; {cut}" if run.notes else cut)
    _check_span(session, start, end)
    written = copy_messages(_part(session, start, end), run, target)
    return replace(written, lost=session.lost, notes=cut)


def _check_span(session: Session, start: int | None, end: int | None) -> None:
    """Raise if the span has no samples, or of a recording without samples no estimates."""
    for kind, deliver in (("samples", session.samples), ("estimates", session.estimates)):
        if next(deliver(None, start, end, 1), None) is not None:
            return
        blocks: list[Block] = list(deliver())
        if blocks:
            first = min(int(block.t_ns[0]) for block in blocks)
            last = max(int(block.t_ns[-1]) for block in blocks)
            raise SessionError(
                f"{session.path}: found no {kind} from {_text(start, 'the start')} to"
                f" {_text(end, 'the end')}, expected a part of {iso_time(first)} to"
                f" {iso_time(last)} ({(last - first) / 1e9:.3f} s)"
            )
    raise SessionError(f"{session.path}: found neither samples nor estimates to trim")


def _text(t_ns: int | None, otherwise: str) -> str:
    return otherwise if t_ns is None else iso_time(t_ns)


def iso_time(t_ns: int) -> str:
    """Unix time as text: UTC, to the millisecond; seconds where it is none.

    A log without a date begins at zero, or at the seconds that its logger counts.
    """
    if not _DATED_NS <= t_ns < _UNDATED_NS:
        return f"{t_ns / 1e9:.3f} s"
    whole, rest = divmod(t_ns, 1_000_000_000)
    text = datetime.fromtimestamp(whole, UTC).strftime("%Y-%m-%dT%H:%M:%S")
    return f"{text}.{rest // 1_000_000:03d}Z"


def _part(session: Session, start: int | None, end: int | None) -> Iterator[Recorded]:
    """Messages of the span, preceded by the alarms active before it."""
    for alarm in standing_alarms(session, start):
        yield Recorded(ALARMS, alarm.t_ns, alarm)
    yield from session.messages(start=start, end=end)


def standing_alarms(session: Session, start: int | None) -> list[Alarm]:
    """The last change of each alarm that is not normal at `start` [ns]; none at the beginning."""
    if start is None:
        return []
    before = (item.message for item in session.messages(["alarms"], end=start))
    last = {alarm.name: alarm for alarm in before if isinstance(alarm, Alarm)}
    return [alarm for alarm in last.values() if alarm.state != "normal"]


def copy_messages(messages: Iterable[Recorded], run: RunInfo, target: Path) -> Written:
    """A new file at `target` with `run` at its head, followed by `messages`, each sample once.

    Args:
        messages: messages to copy; descriptions of runs only if they are new.
        run: is written at the head.
        target: the new file.

    Raises:
        SessionError: the target exists or cannot be written.
    """
    with new_file(target) as part, SessionWriter(part, run, sync=False) as writer:
        written = _copy(messages, run, writer)
    return replace(written, path=target)


def _copy(messages: Iterable[Recorded], run: RunInfo, writer: SessionWriter) -> Written:
    counts: Counter[str] = Counter(run=1)
    following: dict[tuple[str, int], int] = {}
    samples = 0
    for item in messages:
        message = _new_part(item.message, following)
        if message is None or (isinstance(message, RunInfo) and _same_run(message, run)):
            continue
        writer.write(message)
        counts[item.topic.name] += 1
        samples += len(message) if isinstance(message, SampleBlock) else 0
        if len(writer.pending) >= FLUSH_EVERY:
            writer.flush()
    return Written(writer.path, dict(counts), samples, ())


def _new_part(message: Message, following: dict[tuple[str, int], int]) -> Message | None:
    """The message without samples already copied."""
    if not isinstance(message, SampleBlock):
        return message
    key = (message.device, message.boot)
    part = blocks.unseen(message, following.get(key))
    if part is not None:
        following[key] = part.seq + len(part)
    return part


def _same_run(first: RunInfo, second: RunInfo) -> bool:
    return replace(first, notes="", t_ns=0) == replace(second, notes="", t_ns=0)
