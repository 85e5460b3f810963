"""Shared parts of commands on session files: arguments, times, descriptions of damage."""

import argparse
from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from rigwatch.commands.common.output import print_result
from rigwatch.wire.errors import SessionError

if TYPE_CHECKING:
    from rigwatch.wire.session import LostSpan, Session, Written


def add_session_and_target(parser: argparse.ArgumentParser) -> None:
    """Arguments of commands that write one session file from another."""
    parser.add_argument("session", type=Path, help="session file or folder of segments")
    parser.add_argument("target", type=Path, help="the new session file (.mcap)")


def add_span(parser: argparse.ArgumentParser) -> None:
    """Options `--start` and `--end`."""
    kind = "seconds from the first sample, or ISO time (UTC without a zone)"
    parser.add_argument("--start", metavar="TIME", help=f"start time: {kind}")
    parser.add_argument("--end", metavar="TIME", help="end time (exclusive)")


def span_of(arguments: argparse.Namespace, session: "Session") -> tuple[int | None, int | None]:
    """The times of `--start` and `--end` [ns], None if not given.

    Raises:
        SessionError: one of them is not a time.
    """
    return span_between(arguments.start, arguments.end, session)


def span_between(
    start: str | None, end: str | None, session: "Session"
) -> tuple[int | None, int | None]:
    """Times given as texts [ns], None if not given.

    Raises:
        SessionError: one of them is not a time, or the end is not after the start.
    """
    begins = None if start is None else point_in_time(start, session, "--start")
    ends = None if end is None else point_in_time(end, session, "--end")
    if begins is not None and ends is not None and ends <= begins:
        raise SessionError(f"--end: found {end}, expected a time after --start {start}")
    return begins, ends


def point_in_time(text: str, session: "Session", option: str) -> int:
    """Unix time [ns] of `text`: seconds from the session's first sample, or an ISO time.

    Raises:
        SessionError: it is neither.
    """
    from rigwatch.wire.session import first_time

    try:
        return first_time(session) + round(float(text) * 1e9)
    except (ValueError, OverflowError):
        pass
    return unix_time(text, option, "seconds from the start, or ")


def unix_time(text: str, option: str, alternative: str = "") -> int:
    """Unix time [ns] of an ISO time; UTC without a zone.

    Raises:
        SessionError: it is not one; `alternative` names the other valid form.
    """
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        expected = f"{alternative}a time such as 2026-05-01T12:00:00Z"
        raise SessionError(f"{option}: found {text!r}, expected {expected}") from None
    moment = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
    return round(moment.timestamp() * 1e6) * 1000


def damage_lines(lost: "Iterable[LostSpan]") -> list[str]:
    """One line per lost span."""
    return [
        f"lost: {span.size} bytes at {span.offset} of {span.file.name}, "
        f"{_between(span.after_ns, span.before_ns)}: {span.reason}"
        for span in lost
    ]


def _between(after_ns: int | None, before_ns: int | None) -> str:
    from rigwatch.wire.session import iso_time

    after = "the start" if after_ns is None else iso_time(after_ns)
    before = "the end" if before_ns is None else iso_time(before_ns)
    return f"between {after} and {before}"


def report_written(arguments: argparse.Namespace, written: "Written") -> None:
    """The content of a new file, and the lost parts of the old one."""
    counts = ", ".join(f"{name} {count}" for name, count in sorted(written.messages.items()))
    head = f"{written.path}: {written.samples} samples; messages: {counts}"
    notes = [written.notes] if written.notes else []
    print_result(arguments, written, [head, *damage_lines(written.lost), *notes])
