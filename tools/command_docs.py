"""Prints docs/commands.md from the commands' own help: `make docs` writes it."""

import importlib
import inspect
import sys
from collections.abc import Iterator
from pathlib import Path

from rigwatch.commands import COMMANDS

TARGET = Path(__file__).parent.parent / "docs" / "commands.md"
HEAD = """<!-- Printed by `make docs` from the commands' own help. -->

# Commands

Each has `--help` with all its options and `--json` for results that programs read, says an error in
one plain line and then ends with a code other than 0.
"""


def page() -> str:
    """The whole page."""
    return HEAD + "\n".join(part for name in COMMANDS for part in _command(name)) + "\n"


def _command(name: str) -> Iterator[str]:
    module = importlib.import_module(f"rigwatch.commands.{COMMANDS[name]}")
    yield f"\n## rigwatch {name}\n"
    yield f"{module.HELP[0].upper()}{module.HELP[1:]}.\n"
    yield "```"
    yield inspect.cleandoc(module.EXAMPLE)
    yield "```"


def main() -> int:
    """Write the page."""
    TARGET.write_text(page(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
