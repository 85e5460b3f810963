"""`rigwatch recover`: saves the intact parts of a killed, truncated or damaged session."""

import argparse

from rigwatch.commands.common import add_session_and_target, report_written

HELP = "save the intact parts of a damaged session in a new file"
EXAMPLE = "  rigwatch recover broken.mcap saved.mcap"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_session_and_target(parser)


def run(arguments: argparse.Namespace) -> int:
    """0 with or without damage: the report lists what is lost."""
    from rigwatch.wire.session import open_session, recover

    report_written(arguments, recover(open_session(arguments.session), arguments.target))
    return 0
