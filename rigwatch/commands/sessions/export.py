"""`rigwatch export`: writes a session as CSV, MAT or Parquet."""

import argparse
from pathlib import Path

from rigwatch.commands.common import add_span, damage_lines, print_result, say, span_of

HELP = "write a session as CSV, MAT or Parquet, units in the titles"
EXAMPLE = """\
  rigwatch export run.mcap run.csv
  rigwatch export run.mcap estimates.parquet --estimates --start 10 --end 20"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("session", type=Path, help="session file or folder of segments")
    parser.add_argument("target", type=Path, help="the new file, .csv, .mat or .parquet")
    parser.add_argument("--estimates", action="store_true", help="estimates instead of samples")
    parser.add_argument("--device", help="device, if the session has several")
    add_span(parser)


def run(arguments: argparse.Namespace) -> int:
    """0 if the file is written, even if damage in the session leaves gaps."""
    from rigwatch.wire.exchange import export_session
    from rigwatch.wire.session import open_session

    session = open_session(arguments.session)
    start, end = span_of(arguments, session)
    made = export_session(
        session,
        arguments.target,
        estimates=arguments.estimates,
        device=arguments.device,
        start=start,
        end=end,
    )
    for line in damage_lines(session.lost):
        say(line)
    told = f"{made.path}: {made.rows} rows of {', '.join(made.columns)}"
    print_result(arguments, made, told)
    return 0
