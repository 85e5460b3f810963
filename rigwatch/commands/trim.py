"""`rigwatch trim`: cuts a span of time out of a session."""

import argparse

from rigwatch.commands._sessions import add_session_and_target, point_in_time, report_written

HELP = "cut a session by time into a new file"
EXAMPLE = """\
  rigwatch trim run.mcap part.mcap --start 10 --end 25.5
  rigwatch trim sessions/bench1-20260501T120000Z part.mcap --start 2026-05-01T12:10:00Z"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_session_and_target(parser)
    kind = "seconds from the first sample, or ISO time (UTC where it names no zone)"
    parser.add_argument("--start", metavar="TIME", help=f"first time that is kept: {kind}")
    parser.add_argument("--end", metavar="TIME", help="first time that is not kept any more")


def run(arguments: argparse.Namespace) -> int:
    """0 when the part was written."""
    from rigwatch.wire.session import open_session
    from rigwatch.wire.session.edit import trim

    session = open_session(arguments.session)
    start, end = (
        None if text is None else point_in_time(text, session, f"--{option}")
        for option, text in (("start", arguments.start), ("end", arguments.end))
    )
    report_written(trim(session, arguments.target, start, end), arguments.json)
    return 0
