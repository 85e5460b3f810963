"""`rigwatch trim`: cuts a span of time out of a session."""

import argparse

from rigwatch.commands.common import add_session_and_target, add_span, report_written, span_of

HELP = "cut a session by time into a new file"
EXAMPLE = """\
  rigwatch trim run.mcap part.mcap --start 10 --end 25.5
  rigwatch trim sessions/bench1-20260501T120000Z part.mcap --start 2026-05-01T12:10:00Z"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_session_and_target(parser)
    add_span(parser)


def run(arguments: argparse.Namespace) -> int:
    """0 if the part is written."""
    from rigwatch.wire.session import open_session, trim

    session = open_session(arguments.session)
    start, end = span_of(arguments, session)
    report_written(arguments, trim(session, arguments.target, start, end))
    return 0
