"""`rigwatch archive show`: what an archive holds, or what it knows of one session."""

import argparse
from collections.abc import Iterator
from typing import Any

from rigwatch.commands.archive.archive_text import cell, table
from rigwatch.commands.common import print_json

HELP = "show what an archive holds by rig, or one of its sessions"
EXAMPLE = """\
  rigwatch archive show sessions
  rigwatch archive show sessions bench1-20260501T120000Z"""
_LISTS = ("rigs", "unsound", "alarms", "losses")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("url", metavar="URL", help="folder, or address such as s3://bucket/rigs")
    parser.add_argument("session", nargs="?", help="name of a session, as in the catalogue")


def run(arguments: argparse.Namespace) -> int:
    """0 on success."""
    from rigwatch.archive import Store, show

    found = show(Store(arguments.url), arguments.session)
    if arguments.json:
        print_json(found)
        return 0
    for name, value in found.session.items():
        print(f"{name}: {cell(value)}")
    for name in _LISTS:
        if rows := getattr(found, name):
            print("\n".join(["", f"{name}:", *_rows(rows)]).lstrip("\n"))
    return 0


def _rows(rows: list[dict[str, Any]]) -> Iterator[str]:
    hidden = {name for name in rows[0] if all(row[name] is None for row in rows)}
    columns = [name for name in rows[0] if name not in hidden]
    return iter(table(columns, ([row[name] for name in columns] for row in rows)))
