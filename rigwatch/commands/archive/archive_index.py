"""`rigwatch archive index`: reads sessions that are new or changed into the catalogue."""

import argparse

from rigwatch.commands.common import add_on, print_result, say

HELP = "update the catalogue of an archive with new and changed sessions"
EXAMPLE = """\
  rigwatch archive index sessions
  rigwatch archive index sessions --on local:4
  rigwatch archive index s3://recordings/rigs --on dask://host:8786 --json"""
_NAMED = 20
"""Most sessions that are named."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("url", metavar="URL", help="folder, or address such as s3://bucket/rigs")
    add_on(parser)


def run(arguments: argparse.Namespace) -> int:
    """0 if the catalogue is up to date, whatever state the sessions are in."""
    from rigwatch.archive import Store, index
    from rigwatch.batch import executor_on

    store = Store(arguments.url)
    with executor_on(arguments.on) as executor:
        done = index(store, executor=executor, say=say)
    lines, more = done.remarks[:_NAMED], len(done.remarks) - _NAMED
    if more > 0:
        lines.append(f"and {more} more: rigwatch archive query {store.url} unsound")
    statuses = ", ".join(f"{count} {status}" for status, count in done.statuses.items())
    lines.append(f"{done.sessions} sessions ({statuses}); {done.read} read, {done.removed} removed")
    print_result(arguments, done, lines)
    return 0
