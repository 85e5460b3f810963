"""What commands print: results for people or as JSON, and remarks beside them."""

import argparse
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import msgspec

from rigwatch.wire.errors import SessionError
from rigwatch.wire.typed_files import as_json


def print_result(arguments: argparse.Namespace, value: Any, lines: Iterable[str] | str) -> None:
    """A command's result: the value as JSON with `--json`, else the lines."""
    if arguments.json:
        print_json(value)
    else:
        print(lines if isinstance(lines, str) else "\n".join(lines))


def print_json(value: Any) -> None:
    """The value, of plain data and dataclasses, as one JSON document; NaN becomes null."""
    print(msgspec.json.format(as_json(value, sort_keys=True)).decode())


def say(text: str) -> None:
    """A remark or progress, on stderr."""
    print(text, file=sys.stderr, flush=True)


def check_folder(target: Path | None) -> None:
    """Refuse an output file in a missing folder, before long work begins.

    Raises:
        SessionError: there is no such folder.
    """
    if target is not None and not target.absolute().parent.is_dir():
        raise SessionError(f"{target}: found no folder {target.parent}, expected one to write to")
