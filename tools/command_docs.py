"""Prints docs/commands.md from the commands' own help: `make docs` writes it."""

import inspect
from collections.abc import Iterator
from types import ModuleType

from rigwatch.commands import every_command

HEAD = """<!-- Printed by `make docs` from the commands' own help. -->

# Commands

Each has `--help` with all its options and `--json` for results that programs read, says an error in
one plain line and then ends with a code other than 0.
"""


def page() -> str:
    """The whole page."""
    parts = (part for name, module in every_command() for part in _command(name, module))
    return HEAD + "\n".join(parts) + "\n"


def _command(name: str, module: ModuleType) -> Iterator[str]:
    yield f"\n{'#' * len(name.split())} {name}\n"
    yield f"{module.HELP[0].upper()}{module.HELP[1:]}."
    if not hasattr(module, "ACTIONS"):  # else its sub-commands follow, each with its examples
        yield f"\n```\n{inspect.cleandoc(module.EXAMPLE)}\n```"
